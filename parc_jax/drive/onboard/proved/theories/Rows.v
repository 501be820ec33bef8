(* Rows of numbers that the code sums along, and how far off it can be. *)
From Coq Require Import Reals Lra Lia.
From ParcJax.Onboard Require Import Arithmetic Dot Sums Network.
Open Scope R_scope.

Section Rows.
Context {F : arithmetic}.

(* for (c) value += a[c] * x[c], from 0.0: first a product, then a sum, each rounded; or fused. *)
Definition row_gives (n : nat) (a x : nat -> number F) (s : number F) : Prop :=
  computes (S n) (2 * n) (products n a x) s.

Definition size_of (x : number F) : number F := if less F x (zero F) then negated F x else x.

Definition one_norm (n : nat) (a : nat -> number F) : R := added n (fun j => Rabs (value F (a j))).
Definition along (n : nat) (a : nat -> number F) (x : nat -> R) : R :=
  added n (fun j => value F (a j) * x j).
Definition values (x : nat -> number F) (j : nat) : R := value F (x j).

Lemma close_weaker x r a b c d : close (F := F) x r a b -> a <= c -> b <= d -> close x r c d.
Proof. intros [Fx [Ex Sx]] Hc Hd. split; [exact Fx|]. lra. Qed.

Lemma close_itself x : finite F x -> close x (value F x) 0 (Rabs (value F x)).
Proof.
  intros Fx. split; [exact Fx|]. rewrite Rminus_diag_eq by reflexivity. rewrite Rabs_R0. lra.
Qed.

Lemma close_0 : close (zero F) 0 0 0.
Proof.
  destruct (zero_is F) as [Hf Hv]. pose proof (close_itself _ Hf) as Close.
  rewrite Hv, Rabs_R0 in Close. exact Close.
Qed.

Lemma negated_close x r off_ size_ : close x r off_ size_ -> close (negated F x) (- r) off_ size_.
Proof.
  intros [Fx [Ex Sx]]. destruct (negated_is F x Fx) as [Fn Vn]. split; [exact Fn|]. rewrite Vn.
  split; [|rewrite Rabs_Ropp; exact Sx].
  replace (- value F x - - r) with (- (value F x - r)) by ring. rewrite Rabs_Ropp. exact Ex.
Qed.

Lemma size_is x : finite F x -> finite F (size_of x) /\ value F (size_of x) = Rabs (value F x).
Proof.
  intros Fx. destruct (zero_is F) as [F0 V0]. destruct (negated_is F x Fx) as [Fn Vn].
  pose proof (less_is F x (zero F) Fx F0) as L. rewrite V0 in L. unfold size_of.
  destruct (less F x (zero F)) eqn:E.
  - split; [exact Fn|]. rewrite Vn, Rabs_left; [reflexivity|]. apply L. reflexivity.
  - split; [exact Fx|]. rewrite Rabs_right; [reflexivity|].
    destruct (Rlt_or_le (value F x) 0) as [Q|Q]; [|lra]. apply L in Q. discriminate.
Qed.

Lemma size_close x r off_ size_ : close x r off_ size_ -> close (size_of x) (Rabs r) off_ size_.
Proof.
  intros [Fx [Ex Sx]]. destruct (size_is x Fx) as [Fs Vs]. split; [exact Fs|]. rewrite Vs.
  split; [|rewrite Rabs_Rabsolu; exact Sx].
  eapply Rle_trans; [apply Rabs_triang_inv2|exact Ex].
Qed.

Lemma one_norm_pos n a : 0 <= one_norm n a.
Proof. apply added_pos. intros c _. apply Rabs_pos. Qed.

Lemma row_close n a x xr off_ size_ s :
  (forall c, (c < n)%nat -> finite F (a c)) ->
  (forall c, (c < n)%nat -> close (x c) (xr c) off_ size_) ->
  reach_of (S n) (2 * n) (one_norm n a * size_) <= largest -> row_gives n a x s ->
  close s (along n a xr) (one_norm n a * off_ + lost_by (S n) (2 * n) (one_norm n a * size_))
    (reach_of (S n) (2 * n) (one_norm n a * size_)).
Proof.
  intros Ka Kx B Hs. unfold one_norm in *. rewrite <- !added_scaled in *.
  apply (dot_close n a x xr (fun _ => off_) (fun _ => size_)); auto.
Qed.

End Rows.
