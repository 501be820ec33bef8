(* What is asked of the arithmetic that a header computes in, as T10 asks it of floats: each
   operation returns the exact result but for u of its size and the least normal number, so it may
   flush. *)
From Coq Require Import Reals Lra.
Open Scope R_scope.

Definition u : R := / 2 ^ 53. (* unit roundoff of a double *)
Definition eta : R := / 2 ^ 1022. (* its least normal number *)
Definition largest : R := 2 ^ 1023. (* a result of at most this size does not overflow *)

Definition near (exact computed : R) : Prop :=
  Rabs (computed - exact) <= u * Rabs exact + eta.

(* sum x y z: x + y may give z; which of several results comes is left open, each time anew. *)
Record arithmetic := {
  number : Type;
  value : number -> R; (* of what is finite *)
  finite : number -> Prop;
  zero : number;
  negated : number -> number;
  at_most : number -> number -> bool;
  less : number -> number -> bool;
  sum : number -> number -> number -> Prop;
  product : number -> number -> number -> Prop;
  fused : number -> number -> number -> number -> Prop;

  zero_is : finite zero /\ value zero = 0;
  negated_is : forall x, finite x -> finite (negated x) /\ value (negated x) = - value x;
  at_most_is : forall x y, finite x -> finite y -> at_most x y = true <-> value x <= value y;
  less_is : forall x y, finite x -> finite y -> less x y = true <-> value x < value y;
  between_is : forall lo x hi,
    finite lo -> finite hi -> at_most lo x = true -> at_most x hi = true -> finite x;
  sum_is : forall x y z, finite x -> finite y -> Rabs (value x + value y) <= largest ->
    sum x y z -> finite z /\ near (value x + value y) (value z);
  product_is : forall x y z, finite x -> finite y -> Rabs (value x * value y) <= largest ->
    product x y z -> finite z /\ near (value x * value y) (value z);
  fused_is : forall x y s z, finite x -> finite y -> finite s ->
    Rabs (value x * value y + value s) <= largest ->
    fused x y s z -> finite z /\ near (value x * value y + value s) (value z)
}.

Lemma u_pos : 0 < u.
Proof. unfold u. apply Rinv_0_lt_compat, pow_lt. lra. Qed.

Lemma u_small : u <= / 1024.
Proof.
  unfold u. apply Rinv_le_contravar; [lra|]. replace 1024 with (2 ^ 10) by lra.
  apply Rle_pow; [lra|]. repeat constructor.
Qed.

Lemma eta_pos : 0 < eta.
Proof. unfold eta. apply Rinv_0_lt_compat, pow_lt. lra. Qed.

Lemma grown_once : forall d, 1 <= (1 + u) ^ d.
Proof. intros d. apply pow_R1_Rle. pose proof u_pos. lra. Qed.

Global Opaque u eta largest.
