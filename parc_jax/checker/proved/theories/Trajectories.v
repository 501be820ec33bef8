(* A continuous trajectory in a tube of widths: the model's, nudged by an error around one moment.
   *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts ConditionFacts NoPlan.
Import ListNotations.
Open Scope R_scope.

(* ---- The straight lines between knots, as one continuous function of time ---- *)
(* 0 up to 0, x from 0 to 1, then 1 *)
Definition ramp (x : R) : R := (Rabs x - Rabs (x - 1) + 1) / 2.
Fixpoint line (p : nat -> R) (T : nat) (s : R) : R :=
  match T with O => p O | S t => line p t s + (p (S t) - p t) * ramp (s - INR t) end.
(* 1 at c, 0 from r on *)
Definition bump (c r s : R) : R := let y := 1 - Rabs (s - c) / r in (y + Rabs y) / 2.

Lemma ramp_low x : x <= 0 -> ramp x = 0.
Proof. intro H. unfold ramp. rewrite !Rabs_left1 by lra. lra. Qed.
Lemma ramp_mid x : 0 <= x <= 1 -> ramp x = x.
Proof. intro H. unfold ramp. rewrite Rabs_right, Rabs_left1 by lra. lra. Qed.
Lemma ramp_high x : 1 <= x -> ramp x = 1.
Proof. intro H. unfold ramp. rewrite !Rabs_right by lra. lra. Qed.
Lemma line_from p T : forall s, INR T <= s -> line p T s = p T.
Proof.
  induction T as [|T IH]; intros s H; [reflexivity|]. simpl line. rewrite S_INR in H.
  rewrite IH, ramp_high by lra. ring.
Qed.
Lemma line_at p T : forall t s, (t < T)%nat -> 0 <= s <= 1 -> line p T (INR t + s) = (1 - s) * p t
  + s * p (S t).
Proof.
  induction T as [|T IH]; intros t s Ht Hs; [lia|]. simpl line. destruct (Nat.eq_dec t T) as [->|N].
  - rewrite line_from, ramp_mid by lra. replace (INR T + s - INR T) with s by ring. ring.
  - assert (t < T)%nat as L by lia. rewrite IH by assumption.
    assert (INR (S t) <= INR T) as LT by (apply le_INR; lia). rewrite S_INR in LT.
    rewrite ramp_low by lra. ring.
Qed.
Lemma bump_at c r : 0 < r -> bump c r c = 1.
Proof.
  intro H. unfold bump. replace (c - c) with 0 by ring. rewrite Rabs_R0. unfold Rdiv.
  rewrite Rmult_0_l, Rminus_0_r, Rabs_R1. lra.
Qed.
Lemma bump_range c r s : 0 < r -> 0 <= bump c r s <= 1.
Proof.
  intro H. unfold bump. set (y := 1 - Rabs (s - c) / r).
  assert (y <= 1).
  { unfold y. assert (0 <= Rabs (s - c) / r); [|lra]. apply Rmult_le_pos; [apply Rabs_pos|]. left.
    apply Rinv_0_lt_compat. exact H. }
  destruct (Rle_dec 0 y); [rewrite Rabs_right by lra|rewrite Rabs_left1 by lra]; lra.
Qed.
Lemma bump_far c r s : 0 < r -> r <= Rabs (s - c) -> bump c r s = 0.
Proof.
  intros H F. unfold bump. set (y := 1 - Rabs (s - c) / r).
  assert (y <= 0).
  { unfold y. assert (1 <= Rabs (s - c) / r); [|lra]. apply (Rmult_le_reg_r r); [exact H|].
    unfold Rdiv.
    rewrite Rmult_assoc, Rinv_l; lra. }
  rewrite Rabs_left1 by lra. lra.
Qed.
Lemma continuity_abs f : continuity f -> continuity (fun s => Rabs (f s)).
Proof. intro H. apply (continuity_comp f Rabs H Rcontinuity_abs). Qed.
Lemma continuity_id : continuity (fun s => s).
Proof. apply derivable_continuous, derivable_id. Qed.
Lemma continuity_const' a : continuity (fun _ => a).
Proof. apply continuity_const. intros x y. reflexivity. Qed.
Lemma continuity_ramp t : continuity (fun s => ramp (s - INR t)).
Proof.
  unfold ramp, Rdiv. apply continuity_mult; [|apply continuity_const'].
  apply continuity_plus; [|apply continuity_const']. apply continuity_minus; apply continuity_abs;
  repeat (apply continuity_minus); try apply continuity_const'; apply continuity_id.
Qed.
Lemma continuity_line p T : continuity (line p T).
Proof.
  induction T as [|T IH]; [apply continuity_const'|]. simpl. apply continuity_plus; [exact IH|].
  apply continuity_mult; [apply continuity_const'|apply continuity_ramp].
Qed.
Lemma continuity_bump c r : continuity (bump c r).
Proof.
  unfold bump, Rdiv. cbv zeta.
  assert (Y : continuity (fun s => 1 - Rabs (s - c) * / r)).
  { apply continuity_minus; [apply continuity_const'|]. apply continuity_mult;
      [|apply continuity_const'].
    apply continuity_abs. apply continuity_minus; [apply continuity_id|apply continuity_const']. }
  apply continuity_mult; [|apply continuity_const']. apply continuity_plus;
    [exact Y|apply continuity_abs; exact Y].
Qed.

(* ---- The model's trajectory, off by the errors e of the points around the moment c, and by d in
   the extras ---- *)
Definition nudged (P : problem) (u y : rv) (c r : R) (e : nat -> rv) (d : rv) : trajectory :=
  Traj (fun s i a => line (fun t => knotR P u y t i a) (steps P) s + bump c r s * e i a)
       (fun j => endR P u y (n_points P * n_p P + j)%nat + d j).
Lemma nudged_continuous P u y c r e d : continuous (nudged P u y c r e d).
Proof.
  intros i a. simpl. apply continuity_plus; [apply continuity_line|].
  apply continuity_mult; [apply continuity_bump|apply continuity_const'].
Qed.
Lemma nudged_at P u y c r e d t s i a : (t < steps P)%nat -> 0 <= s <= 1 ->
  at_ (nudged P u y c r e d) (INR t + s) i a =
  (1 - s) * knotR P u y t i a + s * knotR P u y (S t) i a + bump c r (INR t + s) * e i a.
Proof. intros Ht Hs. simpl. rewrite line_at by assumption. reflexivity. Qed.


Lemma end_knot P u y j : (0 < n_p P)%nat -> (j < n_points P * n_p P)%nat ->
  endR P u y j = knotR P u y (steps P) (j / n_p P)%nat (j mod n_p P)%nat.
Proof.
  intros Hn Hj. unfold endR, knotR. destruct (Nat.ltb_spec j (n_points P * n_p P)) as [_|C]; [|lia].
  f_equal. f_equal.
  rewrite Nat.mul_add_distr_r, <- Nat.mul_assoc. pose proof (Nat.div_mod j (n_p P) ltac:(lia)). lia.
Qed.
Lemma nudged_end P u y c r e d j : (0 < n_p P)%nat -> final_state P (nudged P u y c r e d) j
  = endR P u y j +
  if (j <? n_points P * n_p P)%nat then bump c r (INR (steps P)) * e (j / n_p P)%nat
    (j mod n_p P)%nat
  else d (j - n_points P * n_p P)%nat.
Proof.
  intro Hn. unfold final_state. destruct (Nat.ltb_spec j (n_points P * n_p P)) as [C|C].
  - simpl. rewrite line_from by lra. rewrite <- end_knot by assumption. reflexivity.
  - simpl. do 2 f_equal; lia.
Qed.

(* ---- Sets of errors: convex; those of a centred bin allow none ---- *)
Lemma inError_upto n E x z : error_ok n E = true -> (forall i, (i < n)%nat -> x i = z i) ->
  inError n E x -> inError n E z.
Proof.
  intros F H. destruct E as [e|A]; simpl in *.
  - intros Hx i Hi. rewrite <- H by exact Hi. apply Hx. exact Hi.
  - intros Hx a b Hab. rewrite <- (dotR_ext a x z); [apply Hx; exact Hab|]. intros i Hi. apply H.
    rewrite <- (poly_len _ _ _ _ F Hab). exact Hi.
Qed.
Lemma inError_shrink n E x s : inError n E (fun _ => 0) -> inError n E x -> 0 <= s <= 1 ->
  inError n E (fun i => s * x i).
Proof.
  intros Z H S. destruct E as [e|A]; simpl in *.
  - intros i Hi. rewrite Rabs_mult, (Rabs_right s) by lra. specialize (H i Hi).
    pose proof (Rabs_pos (x i)).
    assert (s * Rabs (x i) <= 1 * Rabs (x i)) by (apply Rmult_le_compat_r; lra). lra.
  - intros a b Hab. rewrite dotR_mult. specialize (Z a b Hab). specialize (H a b Hab).
    rewrite dotR_zero in Z.
    destruct (Rle_dec (dotR a x) 0) as [C|C].
    + assert (s * dotR a x <= s * 0) by (apply Rmult_le_compat_l; lra). lra.
    + assert (s * dotR a x <= 1 * dotR a x) by (apply Rmult_le_compat_r; lra). lra.
Qed.
Lemma nonneg_R w : forallb (qle 0) w = true -> forall a, 0 <= toR w a.
Proof.
  intros H a. unfold toR. destruct (Nat.lt_ge_cases a (length w)) as [L|L].
  - eapply forallb_forall in H; [|apply nth_In; exact L]. apply R_le in H. rewrite R0 in H. exact H.
  - rewrite nth_overflow by exact L. rewrite R0. lra.
Qed.
Lemma allows_none_R n E : error_ok n E = true -> allows_none E = true -> inError n E (fun _ => 0).
Proof.
  destruct E as [e|A]; simpl; intros F H.
  - intros i _. apply andb_prop in F as [_ F]. rewrite Rabs_R0. apply nonneg_R. exact F.
  - intros a b Hab. rewrite dotR_zero. eapply forallb_forall in H; [|exact Hab]. apply R_le in H.
    rewrite R0 in H. exact H.
Qed.

Record open_bin (P : problem) (B : bin) : Prop := {
  all_points : forall t, (t < steps P)%nat -> length (nth t (interval B) []) = n_points P;
  all_fit : forall t i, error_ok (n_p P) (nth i (nth t (interval B) []) (Rows [])) = true;
  all_open : forall t i, inError (n_p P) (nth i (nth t (interval B) []) (Rows [])) (fun _ => 0);
  end_fit : error_ok (n_points P * n_p P + n_q P) (final B) = true;
  end_open : inError (n_points P * n_p P + n_q P) (final B) (fun _ => 0) }.
Lemma open_bin_intro P B : bin_ok P B = true -> centred B = true -> open_bin P B.
Proof.
  unfold bin_ok, centred. rewrite !andb_true_iff. intros ((LT & HI) & HF) (PI & PF).
  apply Nat.eqb_eq in LT.
  assert (G : forall t i, error_ok (n_p P) (nth i (nth t (interval B) []) (Rows [])) = true /\
                          allows_none (nth i (nth t (interval B) []) (Rows [])) = true).
  { intros t i. destruct (Nat.lt_ge_cases t (length (interval B))) as [Ht|Ht];
      [|rewrite (nth_overflow (interval B)) by exact Ht; destruct i; auto].
    pose proof (nth_In (interval B) [] Ht) as It. eapply forallb_forall in HI; [|exact It].
    eapply forallb_forall in PI; [|exact It].
    apply andb_prop in HI as [_ HI]. set (Es := nth t (interval B) []) in *.
    destruct (Nat.lt_ge_cases i (length Es)) as [Hi|Hi]; [|rewrite nth_overflow by exact Hi; auto].
    pose proof (nth_In Es (Rows []) Hi) as Ii. eapply forallb_forall in HI; [|exact Ii].
    eapply forallb_forall in PI; [|exact Ii]. auto. }
  split; [| | |exact HF|apply allows_none_R; assumption].
  - intros t Ht. assert (It : In (nth t (interval B) []) (interval B)) by (apply nth_In; lia).
    eapply forallb_forall in HI; [|exact It]. apply andb_prop in HI as [Lm _].
    apply Nat.eqb_eq. exact Lm.
  - intros t i. apply G.
  - intros t i. apply allows_none_R; apply G.
Qed.

(* Where the bump is not zero its errors have to be allowed; what is left of them at the end, with
   the extras, as well. *)
Lemma nudged_in_tube P N B u k c r e d : (0 < n_p P)%nat -> open_bin P B -> 0 < r ->
  (forall t s i, (t < steps P)%nat -> (i < n_points P)%nat -> 0 <= s <= 1 ->
     r <= Rabs (INR t + s - c) \/ inError (n_p P) (nth i (nth t (interval B) [])
       (Rows [])) (e i)) ->
  inError (n_points P * n_p P + n_q P) (final B) (fun j =>
    if (j <? n_points P * n_p P)%nat then bump c r (INR (steps P)) * e (j / n_p P)%nat
      (j mod n_p P)%nat
    else d (j - n_points P * n_p P)%nat) ->
  in_tube P N B u k (nudged P u (netR N k) c r e d).
Proof.
  intros Hn [_ HI HO HF _] Hr Hin Hend. split.
  - intros t i s Ht Hi Hs. apply (inError_upto _ _ (fun a => bump c r (INR t + s) * e i a)
      _ (HI t i)).
    + intros a _. rewrite nudged_at by assumption. ring.
    + destruct (Hin t s i Ht Hi Hs) as [F|F].
      * apply (inError_upto _ _ (fun _ => 0) _ (HI t i)); [|apply HO]. intros a _.
        rewrite (bump_far _ _ _ Hr F). ring.
      * apply inError_shrink; [apply HO|exact F|apply bump_range; exact Hr].
  - eapply (inError_upto _ _ _ _ HF); [|exact Hend]. intros j _. cbv beta.
    rewrite nudged_end by exact Hn. ring.
Qed.
Lemma nudged_away P N B u k c r e : (0 < n_p P)%nat -> open_bin P B -> 0 < r ->
  r <= Rabs (INR (steps P) - c) ->
  (forall t s i, (t < steps P)%nat -> (i < n_points P)%nat -> 0 <= s <= 1 ->
     r <= Rabs (INR t + s - c) \/ inError (n_p P) (nth i (nth t (interval B) [])
       (Rows [])) (e i)) ->
  in_tube P N B u k (nudged P u (netR N k) c r e (fun _ => 0)).
Proof.
  intros Hn HB Hr Hfar Hin. apply nudged_in_tube; auto.
  apply (inError_upto _ _ (fun _ => 0) _ (end_fit _ _ HB)); [|apply (end_open _ _ HB)].
  intros j _. rewrite (bump_far _ _ _ Hr Hfar). destruct (j <? _)%nat; ring.
Qed.
