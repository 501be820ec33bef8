(* The network of a header, layer by layer, and how far its outputs can be off: T10. *)
From Coq Require Import Reals Lra Lia List.
From ParcJax.Onboard Require Import Arithmetic Dot Sums.
Import ListNotations.
Open Scope R_scope.

Section Network.
Context {F : arithmetic}.

(* The products of two rows of n numbers. *)
Definition products (n : nat) (a x : nat -> number F) : list (term F) :=
  map (fun j => Times (a j) (x j)) (seq 0 n).

Record layer := {
  n_in : nat;
  n_out : nat;
  weight : nat -> nat -> number F; (* of output i and input j *)
  bias : nat -> number F
}.

Definition layer_known (L : layer) : Prop :=
  forall i, (i < n_out L)%nat -> finite F (bias L i) /\
  forall j, (j < n_in L)%nat -> finite F (weight L i j).

(* As computed: any order, fused or not. *)
Definition layer_gives (L : layer) (x z : nat -> number F) : Prop := forall i, (i < n_out L)%nat ->
  computes (S (n_in L)) (2 * n_in L) (Alone (bias L i) :: products (n_in L) (weight L i) x) (z i).

Definition relu (z : number F) : number F := if less F (zero F) z then z else zero F.

Fixpoint network_gives (net : list layer) (x out : nat -> number F) : Prop :=
  match net with
  | [] => False
  | [L] => layer_gives L x out
  | L :: rest => exists z, layer_gives L x z /\ network_gives rest (fun i => relu (z i)) out
  end.

(* In real numbers. *)
Definition layer_is (L : layer) (x : nat -> R) (i : nat) : R :=
  value F (bias L i) + added (n_in L) (fun j => value F (weight L i j) * x j).

Fixpoint network_is (net : list layer) (x : nat -> R) : nat -> R :=
  match net with
  | [] => x
  | [L] => layer_is L x
  | L :: rest => network_is rest (fun i => Rmax (layer_is L x i) 0)
  end.

(* The bounds of T10: off, size >= |x^ - x|, |x^| of the inputs; the same of the outputs. *)
Definition layer_size (L : layer) (size : nat -> R) (i : nat) : R :=
  Rabs (value F (bias L i)) + added (n_in L) (fun j => Rabs (value F (weight L i j)) * size j).

Definition off_after (L : layer) (off size : nat -> R) (i : nat) : R :=
  added (n_in L) (fun j => Rabs (value F (weight L i j)) * off j)
  + lost_by (S (n_in L)) (2 * n_in L) (layer_size L size i).

Definition size_after (L : layer) (size : nat -> R) (i : nat) : R :=
  reach_of (S (n_in L)) (2 * n_in L) (layer_size L size i).

(* beta and most bound what comes out; nothing on the way overflows. *)
Fixpoint network_bounded (net : list layer) (off size : nat -> R) (n : nat) (beta most : R)
  : Prop :=
  match net with
  | [] => False
  | [L] => layer_known L /\ n_out L = n /\ forall i, (i < n)%nat ->
      size_after L size i <= largest /\ off_after L off size i <= beta /\
      size_after L size i <= most
  | L :: (M :: _) as rest => layer_known L /\ n_out L = n_in M /\
      (forall i, (i < n_out L)%nat -> size_after L size i <= largest) /\
      network_bounded rest (off_after L off size) (size_after L size) n beta most
  end.

Lemma total_products n a x :
  total (products n a x) = added n (fun j => value F (a j) * value F (x j)).
Proof.
  unfold products, added. induction (seq 0 n) as [|j l IH]; simpl; [reflexivity|].
  rewrite IH. reflexivity.
Qed.

Lemma size_products n a x :
  size (products n a x) = added n (fun j => Rabs (value F (a j)) * Rabs (value F (x j))).
Proof.
  unfold products, added. induction (seq 0 n) as [|j l IH]; simpl; [reflexivity|].
  rewrite IH, Rabs_mult. reflexivity.
Qed.

Lemma known_products n a x : (forall j, (j < n)%nat -> finite F (a j) /\ finite F (x j)) ->
  Forall known (products n a x).
Proof.
  intros H. apply Forall_forall. intros t Ht. apply in_map_iff in Ht as [j [<- Hj]].
  apply in_seq in Hj. simpl. apply H. lia.
Qed.

(* A number known up to some error. *)
Definition close (x : number F) (r off size : R) : Prop :=
  finite F x /\ Rabs (value F x - r) <= off /\ Rabs (value F x) <= size.

(* A dot product of numbers, of which those of x are off by themselves. *)
Lemma dot_close n a (x : nat -> number F) xr off sized d m z :
  (forall j, (j < n)%nat -> finite F (a j)) ->
  (forall j, (j < n)%nat -> close (x j) (xr j) (off j) (sized j)) ->
  computes d m (products n a x) z ->
  reach_of d m (added n (fun j => Rabs (value F (a j)) * sized j)) <= largest ->
  close z (added n (fun j => value F (a j) * xr j))
    (added n (fun j => Rabs (value F (a j)) * off j)
     + lost_by d m (added n (fun j => Rabs (value F (a j)) * sized j)))
    (reach_of d m (added n (fun j => Rabs (value F (a j)) * sized j))).
Proof.
  intros Ka Kx Hz B. set (S := added n (fun j => Rabs (value F (a j)) * sized j)) in *.
  assert (HS : size (products n a x) <= S).
  { rewrite size_products. apply added_le. intros j Hj. destruct (Kx j Hj) as [_ [_ Hs]].
    apply Rmult_le_compat_l; [apply Rabs_pos|exact Hs]. }
  destruct (computed_near d m _ _ Hz) as [Fz Ez].
  - apply known_products. intros j Hj. split; [apply Ka, Hj|apply (Kx j Hj)].
  - eapply Rle_trans; [apply reach_more; [apply le_n|exact HS]|exact B].
  - pose proof (lost_more d m _ _ HS) as HL. split; [exact Fz|]. split.
    + rewrite total_products in Ez.
      replace (value F z - added n (fun j => value F (a j) * xr j)) with
        ((value F z - added n (fun j => value F (a j) * value F (x j)))
         + (added n (fun j => value F (a j) * value F (x j))
            - added n (fun j => value F (a j) * xr j))) by ring.
      eapply Rle_trans; [apply Rabs_triang|]. rewrite Rplus_comm. apply Rplus_le_compat; [|lra].
      rewrite added_minus. eapply Rle_trans; [apply added_abs|]. apply added_le. intros j Hj.
      rewrite <- Rmult_minus_distr_l, Rabs_mult.
      apply Rmult_le_compat_l; [apply Rabs_pos|apply (Kx j Hj)].
    + replace (value F z)
        with (value F z - total (products n a x) + total (products n a x)) by ring.
      eapply Rle_trans; [apply Rabs_triang|]. rewrite <- lost_is_reach.
      pose proof (total_at_most_size (products n a x)). lra.
Qed.

Lemma layer_close L x xr off sized z :
  layer_known L -> (forall j, (j < n_in L)%nat -> close (x j) (xr j) (off j) (sized j)) ->
  layer_gives L x z -> (forall i, (i < n_out L)%nat -> size_after L sized i <= largest) ->
  forall i, (i < n_out L)%nat ->
  close (z i) (layer_is L xr i) (off_after L off sized i) (size_after L sized i).
Proof.
  intros K Kx Hz B i Hi. destruct (K i Hi) as [Kb Kw]. specialize (B i Hi). specialize (Hz i Hi).
  unfold off_after, size_after in *. set (d := S (n_in L)) in *. set (m := (2 * n_in L)%nat) in *.
  set (l := Alone (bias L i) :: products (n_in L) (weight L i) x) in *.
  assert (HS : size l <= layer_size L sized i).
  { unfold l, layer_size. simpl. rewrite size_products. apply Rplus_le_compat_l.
    apply added_le. intros j Hj. apply Rmult_le_compat_l; [apply Rabs_pos|apply (Kx j Hj)]. }
  assert (Kl : Forall known l).
  { constructor; [exact Kb|]. apply known_products. intros j Hj.
    split; [apply Kw, Hj|apply (Kx j Hj)]. }
  destruct (computed_near d m l (z i) Hz Kl) as [Fz Ez].
  { eapply Rle_trans; [apply reach_more; [apply le_n|exact HS]|exact B]. }
  pose proof (lost_more d m _ _ HS) as HL. split; [exact Fz|]. split.
  - replace (value F (z i) - layer_is L xr i) with
      ((value F (z i) - total l) + (total l - layer_is L xr i)) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. rewrite Rplus_comm. apply Rplus_le_compat; [|lra].
    unfold l, layer_is. simpl. rewrite total_products.
    replace (value F (bias L i) + added (n_in L) (fun j => value F (weight L i j) * value F (x j))
             - (value F (bias L i) + added (n_in L) (fun j => value F (weight L i j) * xr j)))
      with (added (n_in L) (fun j => value F (weight L i j) * value F (x j))
            - added (n_in L) (fun j => value F (weight L i j) * xr j)) by ring.
    rewrite added_minus. eapply Rle_trans; [apply added_abs|]. apply added_le. intros j Hj.
    rewrite <- Rmult_minus_distr_l, Rabs_mult.
    apply Rmult_le_compat_l; [apply Rabs_pos|apply (Kx j Hj)].
  - replace (value F (z i)) with (value F (z i) - total l + total l) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. rewrite <- lost_is_reach.
    pose proof (total_at_most_size l). lra.
Qed.

(* ReLU makes no error larger: no sign has to be decided. *)
Lemma relu_close z r off sized : close z r off sized -> close (relu z) (Rmax r 0) off sized.
Proof.
  intros [Fz [E S]]. destruct (zero_is F) as [F0 V0]. unfold relu.
  pose proof (less_is F (zero F) z F0 Fz) as L. rewrite V0 in L.
  assert (Hmax : Rabs (Rmax (value F z) 0 - Rmax r 0) <= Rabs (value F z - r)).
  { unfold Rmax. repeat destruct (Rle_dec _ _); unfold Rabs; repeat destruct (Rcase_abs _); lra. }
  destruct (less F (zero F) z) eqn:Hl.
  - destruct L as [L _]. specialize (L eq_refl). rewrite Rmax_left in Hmax by lra.
    split; [exact Fz|]. split; [lra|exact S].
  - assert (value F z <= 0).
    { destruct (Rle_or_lt (value F z) 0) as [H|H]; [exact H|]. apply L in H. discriminate. }
    rewrite (Rmax_right (value F z)) in Hmax by lra. split; [exact F0|]. rewrite V0. split; [lra|].
    rewrite Rabs_R0. pose proof (Rabs_pos (value F z)). lra.
Qed.

(* [T10] *)
Theorem network_close : forall net x xr off sized n beta most out,
  network_bounded net off sized n beta most ->
  (forall j, (j < match net with [] => 0 | L :: _ => n_in L end)%nat ->
    close (x j) (xr j) (off j) (sized j)) ->
  network_gives net x out ->
  forall i, (i < n)%nat -> close (out i) (network_is net xr i) beta most.
Proof.
  induction net as [|L rest IH]; intros x xr off sized n beta most out B Kx G i Hi; [destruct G|].
  destruct rest as [|M rest].
  - simpl in B, G, Kx |- *. destruct B as [K [Hn B]]. rewrite <- Hn in *.
    destruct (layer_close L x xr off sized out K Kx G) with (i := i) as [A1 [A2 A3]]; auto.
    { intros j Hj. apply B, Hj. }
    destruct (B i Hi) as [_ [B2 B3]]. split; [exact A1|]. split; lra.
  - destruct B as [K [Hn [Bl B]]]. destruct G as [z [Gz G]].
    assert (C := layer_close L x xr off sized z K Kx Gz Bl).
    apply (IH (fun j => relu (z j)) (fun j => Rmax (layer_is L xr j) 0)
              (off_after L off sized) (size_after L sized) n beta most out B); auto.
    intros j Hj. apply relu_close, C. rewrite Hn. exact Hj.
Qed.

End Network.
Arguments layer : clear implicits.
