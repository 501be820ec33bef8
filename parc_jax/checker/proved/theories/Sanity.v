(* The definitions of Spec.v are not void.  A tube whose errors may be zero holds the model's own
   trajectory; and a plan whose model runs a reference point of a part into an obstacle is not safe.
   *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic ArithmeticFacts.
Import ListNotations.
Open Scope R_scope.

Definition floor (s : R) : nat := Z.to_nat (Int_part s).
Definition model (P : problem) (N : list layer) (u k : rv) : trajectory :=
  let y := netR N k in
  Traj (fun s i a => let t := floor s in
          (1 - (s - INR t)) * knotR P u y t i a + (s - INR t) * knotR P u y (S t) i a)
       (fun j => offsetR P y (steps P * (n_points P * n_p P) + (n_points P * n_p P + j))%nat).

Lemma floor_at t s : 0 <= s < 1 -> floor (INR t + s) = t.
Proof.
  intro H. unfold floor. rewrite <- (Nat2Z.id t) at 2. f_equal. symmetry.
  destruct (base_Int_part (INR t + s)) as [A B]. rewrite INR_IZR_INZ in *.
  assert (Up : IZR (Z.of_nat t) < IZR (Int_part (IZR (Z.of_nat t) + s)) + 1) by lra.
  assert (Down : IZR (Int_part (IZR (Z.of_nat t) + s)) < IZR (Z.of_nat t) + 1) by lra.
  rewrite <- plus_IZR in *. apply lt_IZR in Up, Down. lia.
Qed.
Lemma model_at P N u k t s i a : 0 <= s <= 1 -> at_ (model P N u k) (INR t + s) i a =
  (1 - s) * knotR P u (netR N k) t i a + s * knotR P u (netR N k) (S t) i a.
Proof.
  intros H. simpl at_. destruct (Rlt_dec s 1) as [L|L].
  - rewrite floor_at by lra. replace (INR t + s - INR t) with s by ring. reflexivity.
  - assert (s = 1) as -> by lra. replace (INR t + 1) with (INR (S t) + 0) by (rewrite S_INR; ring).
    rewrite floor_at by lra. replace (INR (S t) + 0 - INR (S t)) with 0 by ring. ring.
Qed.
Lemma inError_ext n E x z : (forall i, x i = z i) -> inError n E x -> inError n E z.
Proof.
  intros H. destruct E as [e|A]; simpl.
  - intros Hx i Hi. rewrite <- H. apply Hx. exact Hi.
  - intros Hx a b Hab. rewrite <- (dotR_ext a x z) by (intros; apply H). apply Hx. exact Hab.
Qed.
Definition zero_allowed (P : problem) (B : bin) : Prop :=
  (forall t i, inError (n_p P) (nth i (nth t (interval B) []) (Rows [])) (fun _ => 0)) /\
  inError (n_points P * n_p P + n_q P) (final B) (fun _ => 0).

Lemma model_end P N u k j : (0 < n_p P)%nat ->
  final_state P (model P N u k) j - endR P u (netR N k) j = 0.
Proof.
  intro Hn. unfold final_state, endR. destruct (Nat.ltb_spec j (n_points P * n_p P)) as [C|C].
  - replace (INR (steps P)) with (INR (steps P) + 0) by ring. rewrite model_at by lra. unfold knotR.
    assert (E : ((steps P * n_points P + j / n_p P) * n_p P + j mod n_p P)%nat
                = (steps P * (n_points P * n_p P) + j)%nat).
    { rewrite Nat.mul_add_distr_r, <- Nat.mul_assoc. pose proof (Nat.div_mod j (n_p P) ltac:(lia)).
      lia. }
    rewrite E. ring.
  - simpl extras. replace (n_points P * n_p P + (j - n_points P * n_p P))%nat with j by lia. ring.
Qed.
Theorem tube_not_empty P N B u k : (0 < n_p P)%nat -> zero_allowed P B ->
  in_tube P N B u k (model P N u k).
Proof.
  intros Hn [HI HF]. split.
  - intros t i s Ht Hi Hs. eapply inError_ext; [|apply (HI t i)]. intro a. cbv beta.
    rewrite model_at by exact Hs. ring.
  - eapply inError_ext; [|exact HF]. intro j. cbv beta. symmetry. apply model_end, Hn.
Qed.

Lemma choose {A} (l : list A) (f : A -> rv) i : In i l ->
  exists lam, weights lam (length l) /\ forall a, mix lam (map f l) a = f i a.
Proof.
  assert (Z : forall l : list A, exists lam, length lam = length l /\ Forall (fun x =>
    0 <= x) lam /\
              fold_right Rplus 0 lam = 0 /\ forall a, mix lam (map f l) a = 0).
  { clear. induction l as [|b l (lam & L & F & S & M)]; [exists []; simpl; auto|].
    exists (0 :: lam). simpl. rewrite L, S. split; [reflexivity|].
    split; [constructor; [lra|exact F]|].
    split; [lra|]. intro a. rewrite M. ring. }
  induction l as [|b l IH]; intro H; [destruct H|]. destruct H as [->|H].
  - destruct (Z l) as (lam & L & F & S & M). exists (1 :: lam). unfold weights. simpl.
    rewrite L, S. split.
    + split; [reflexivity|]. split; [constructor; [lra|exact F]|lra].
    + intro a. rewrite M. ring.
  - destruct (IH H) as (lam & (L & F & S) & M). exists (0 :: lam). unfold weights. simpl.
    rewrite L, S. split.
    + split; [reflexivity|]. split; [constructor; [lra|exact F]|lra].
    + intro a. rewrite M. ring.
Qed.
Lemma sumsq_zero n : sumsq n (fun _ => 0) = 0.
Proof. induction n; simpl; [reflexivity|]. change (shift (fun _ => 0)) with (fun _ : nat => 0).
rewrite IHn. ring. Qed.

Theorem a_hit_is_not_safe P N E B u k o t b i r : (0 < n_p P)%nat ->
  In B (bins E) -> inBox (box B) k -> zero_allowed P B ->
  In o (obstacles P) -> (first o <= t <= last o)%nat ->
    inPoly (rows o) (knotR P u (netR N k) t i) ->
  In b (parts P) -> In i (corners b) -> grown_by b = Disc r -> ~ safe P N E u k.
Proof.
  intros Hn HB Hk HZ Ho Ht Hin Hb Hi Hr (_ & _ & HS).
  destruct (HS B HB Hk _ (tube_not_empty P N B u k Hn HZ)) as [_ HC].
  destruct (choose (corners b) (at_ (model P N u k) (INR t + 0)) i Hi) as (lam & HL & HM).
  apply HC. exists o, t, 0, b, (knotR P u (netR N k) t i). repeat (split; [assumption || lra|]).
  split; [|exact Hin].
  exists lam, (fun _ => 0). split; [exact HL|]. split.
  - rewrite Hr. simpl. rewrite sumsq_zero. apply Rle_0_sqr.
  - intros a _. rewrite HM, model_at by lra. ring.
Qed.
