(* Prints what the theorems rest on.  tests/checker/test_rocq.py compares this with the axioms of
   Coq's reals. *)
From ParcJax Require Import Statements.
Print Assumptions succeeds_is.
Print Assumptions sample_safe.
Print Assumptions corridor_safe.
Print Assumptions set_safe.
Print Assumptions box_safe.
Print Assumptions no_plan.
Print Assumptions volumes_true.
Print Assumptions failing_is_not_safe.
Print Assumptions tube_not_empty.
Print Assumptions a_hit_is_not_safe.
Print Assumptions not_void.
Print Assumptions sample_of_something.
Print Assumptions model_held.
Print Assumptions body_not_void.
Print Assumptions accepted.
Print Assumptions claim_is_true.
Print Assumptions order_statistic.
Print Assumptions risk_of_a_set.
Print Assumptions risk_of_a_density.
Print Assumptions claim_shown.
Print Assumptions bounds_shown.
Print Assumptions accepted_episode.
Print Assumptions accepted_place.
Print Assumptions accepted_turning.
Print Assumptions a_drive_there_is.
