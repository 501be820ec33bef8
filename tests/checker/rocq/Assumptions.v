(* Prints what the theorems rest on.  tests/checker/test_rocq.py compares this with the axioms of Coq's reals. *)
Require Import Theorems DoubtFacts NoPlanFacts Sanity.
Print Assumptions sample_safe.
Print Assumptions corridor_safe.
Print Assumptions set_safe.
Print Assumptions box_safe.
Print Assumptions no_plan.
Print Assumptions volumes_true.
Print Assumptions failing_is_not_safe.
Print Assumptions tube_not_empty.
Print Assumptions a_hit_is_not_safe.
