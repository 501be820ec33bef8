(* The theorem, in full, for doubles; and what it rests on. docs/onboard.md quotes it. *)
From Coq Require Import Reals.
From Flocq Require Import Core BinarySingleNaN.
From ParcJax.Onboard Require Import Arithmetic Network Rows Tube Header Sound Loop Ieee.

Check (safe_is_kept (F := binary64) :
  forall (T : tables binary64) (room beta most start steep wide excess : R),
  fits_together T -> all_finite T start ->
  margins_pay T room beta most start steep wide excess ->
  forall p0 k : nat -> double, is_safe T p0 k ->
  keeps T room (values (F := binary64) p0) (values (F := binary64) k)).

Check (kept_whatever_the_error (F := binary64) :
  forall (T : tables binary64) (room : R) (p0 k : nat -> R) (bin corridor : nat),
  kept T room p0 k bin corridor ->
  forall (run t i s : nat) (e : nat -> R),
  (first_run T corridor <= run < first_run T (S corridor))%nat ->
  (run_first T run <= t < run_end T run)%nat -> (i < n_part T)%nat -> s = t \/ s = S t ->
  let w := run_w T run in let point := pair_point T (run_pair T run) i in
  in_tube T bin t point e ->
  (value binary64 (run_support T run) - room * one_norm (n_p T) w
   < along (n_p T) w (fun c => place T p0 k (at_knot T s point c) + e c))%R).

Check (@row_in_turn : forall (F : arithmetic) n a x z, loop a x n (zero F) z -> row_gives n a x z).

Check (@box_in_turn : forall (F : arithmetic) n (B : basis F) w far, box n B ->
  row_gives n (half B) (fun c => size_of (w c)) far -> reaches n w B far).

Print Assumptions safe_is_kept.
Print Assumptions kept_whatever_the_error.
Print Assumptions binary64.
Print Assumptions row_in_turn.
Print Assumptions neuron_in_turn.
Print Assumptions box_in_turn.
