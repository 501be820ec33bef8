(* Sums of n numbers, and numbers of two rows in turn. *)
From Coq Require Import Reals Lra Lia List PeanoNat.
Import ListNotations.
Open Scope R_scope.

Definition added (n : nat) (f : nat -> R) : R := fold_right (fun j s => f j + s) 0 (seq 0 n).

(* a 0, b 0, a 1, b 1, ... *)
Definition in_turn {A : Type} (a b : nat -> A) (i : nat) : A :=
  if Nat.even i then a (Nat.div2 i) else b (Nat.div2 i).

Lemma added_le n f g : (forall j, (j < n)%nat -> f j <= g j) -> added n f <= added n g.
Proof.
  intros H. unfold added. assert (G : forall j, In j (seq 0 n) -> f j <= g j).
  { intros j Hj. apply in_seq in Hj. apply H. lia. }
  induction (seq 0 n) as [|j l IH]; simpl; [lra|].
  pose proof (G j (or_introl eq_refl)) as Here.
  assert (There : forall i, In i l -> f i <= g i) by (intros i Hi; apply G; right; exact Hi).
  specialize (IH There). lra.
Qed.

Lemma added_minus n f g : added n f - added n g = added n (fun j => f j - g j).
Proof. unfold added. induction (seq 0 n) as [|j l IH]; simpl; lra. Qed.

Lemma added_abs n f : Rabs (added n f) <= added n (fun j => Rabs (f j)).
Proof.
  unfold added. induction (seq 0 n) as [|j l IH]; simpl; [rewrite Rabs_R0; lra|].
  eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.

Lemma added_scaled n c f : added n (fun j => f j * c) = added n f * c.
Proof. unfold added. induction (seq 0 n) as [|j l IH]; simpl; lra. Qed.

Lemma added_pos n f : (forall j, (j < n)%nat -> 0 <= f j) -> 0 <= added n f.
Proof.
  intros H. replace 0 with (added n (fun _ => 0)).
  - apply added_le; exact H.
  - unfold added. induction (seq 0 n); simpl; lra.
Qed.

Lemma added_ext n f g : (forall j, (j < n)%nat -> f j = g j) -> added n f = added n g.
Proof. intros H. apply Rle_antisym; apply added_le; intros j Hj; rewrite (H j Hj); lra. Qed.

Lemma added_next m f : added (S m) f = added m f + f m.
Proof.
  assert (Last : forall l z, fold_right (fun j s => f j + s) z l
    = fold_right (fun j s => f j + s) 0 l + z).
  { induction l as [|j l IH]; intros z; simpl; [ring|]. rewrite IH. ring. }
  unfold added. rewrite seq_S, fold_right_app. simpl. rewrite Last. ring.
Qed.

(* All but one of the numbers are zero. *)
Lemma added_one m f axis : (forall c, (c < m)%nat -> c <> axis -> f c = 0) ->
  added m f = if (axis <? m)%nat then f axis else 0.
Proof.
  induction m as [|m IH]; intros Zero; [reflexivity|].
  rewrite added_next, IH by (intros c Hc; apply Zero; lia).
  destruct (Nat.ltb_spec axis m); destruct (Nat.ltb_spec axis (S m)); try lia.
  - rewrite (Zero m) by lia. ring.
  - replace axis with m by lia. ring.
  - rewrite (Zero m) by lia. ring.
Qed.

Lemma added_plus m f g : added m (fun j => f j + g j) = added m f + added m g.
Proof. unfold added. induction (seq 0 m) as [|j l IH]; simpl; [ring|]. rewrite IH. ring. Qed.

Lemma added_exchanged m k f :
  added m (fun i => added k (fun j => f i j)) = added k (fun j => added m (fun i => f i j)).
Proof.
  induction m as [|m IH].
  - rewrite (added_one k _ k) by reflexivity. rewrite Nat.ltb_irrefl. reflexivity.
  - rewrite added_next, IH, <- added_plus. apply added_ext. intros j _. rewrite added_next.
    reflexivity.
Qed.

Lemma turn_even A (a b : nat -> A) j : in_turn a b (2 * j) = a j.
Proof.
  unfold in_turn. rewrite Nat.even_mul, Nat.div2_double. reflexivity.
Qed.

Lemma turn_odd A (a b : nat -> A) j : in_turn a b (S (2 * j)) = b j.
Proof.
  unfold in_turn. rewrite Nat.div2_succ_double, Nat.even_succ, <- Nat.negb_even, Nat.even_mul.
  reflexivity.
Qed.

Lemma turn_cases j : exists i, j = (2 * i)%nat \/ j = S (2 * i).
Proof. exists (Nat.div2 j). destruct (Nat.Even_or_Odd j) as [E|O]; [left|right].
  - apply Nat.Even_double in E. unfold Nat.double in E. lia.
  - apply Nat.Odd_double in O. unfold Nat.double in O. lia.
Qed.

Lemma added_in_turn m f :
  added (2 * m) f = added m (fun j => f (2 * j)%nat + f (S (2 * j))).
Proof.
  induction m as [|m IH]; [reflexivity|].
  replace (2 * S m)%nat with (S (S (2 * m))) by lia. rewrite !added_next, IH. ring.
Qed.
