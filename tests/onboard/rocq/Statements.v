(* The theorem, in full, for doubles; and what it rests on. docs/onboard.md quotes it. *)
From Coq Require Import Reals.
From Flocq Require Import Core BinarySingleNaN.
Require Import Arithmetic Network Header Sound Loop Ieee.

Check (safe_is_kept (F := binary64) :
  forall (T : tables binary64) (room beta most start : R),
  fits_together T -> all_finite T start -> margins_pay T room beta most start ->
  forall p0 k : nat -> double, is_safe T p0 k ->
  keeps T room (values (F := binary64) p0) (values (F := binary64) k)).

Check (@row_in_turn : forall (F : arithmetic) n a x z, loop a x n (zero F) z -> row_gives n a x z).

Print Assumptions safe_is_kept.
Print Assumptions binary64.
Print Assumptions row_in_turn.
Print Assumptions neuron_in_turn.
