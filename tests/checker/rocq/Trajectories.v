(* A continuous trajectory in a tube of widths: the model's, nudged by an error around one moment. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
Require Import Spec Arithmetic Checker ArithmeticFacts ConditionFacts NoPlan.
Import ListNotations.
Open Scope R_scope.

(* ---- The straight lines between knots, as one continuous function of time ---- *)
Definition ramp (x : R) : R := (Rabs x - Rabs (x - 1) + 1) / 2.         (* 0 up to 0, x from 0 to 1, then 1 *)
Fixpoint line (p : nat -> R) (T : nat) (s : R) : R :=
  match T with O => p O | S t => line p t s + (p (S t) - p t) * ramp (s - INR t) end.
Definition bump (c r s : R) : R := let y := 1 - Rabs (s - c) / r in (y + Rabs y) / 2.   (* 1 at c, 0 from r on *)

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
Lemma line_at p T : forall t s, (t < T)%nat -> 0 <= s <= 1 -> line p T (INR t + s) = (1 - s) * p t + s * p (S t).
Proof.
  induction T as [|T IH]; intros t s Ht Hs; [lia|]. simpl line. destruct (Nat.eq_dec t T) as [->|N].
  - rewrite line_from, ramp_mid by lra. replace (INR T + s - INR T) with s by ring. ring.
  - assert (t < T)%nat as L by lia. rewrite IH by assumption.
    assert (INR (S t) <= INR T) as LT by (apply le_INR; lia). rewrite S_INR in LT. rewrite ramp_low by lra. ring.
Qed.
Lemma bump_at c r : 0 < r -> bump c r c = 1.
Proof.
  intro H. unfold bump. replace (c - c) with 0 by ring. rewrite Rabs_R0. unfold Rdiv. rewrite Rmult_0_l, Rminus_0_r, Rabs_R1. lra.
Qed.
Lemma bump_range c r s : 0 < r -> 0 <= bump c r s <= 1.
Proof.
  intro H. unfold bump. set (y := 1 - Rabs (s - c) / r).
  assert (y <= 1).
  { unfold y. assert (0 <= Rabs (s - c) / r); [|lra]. apply Rmult_le_pos; [apply Rabs_pos|]. left. apply Rinv_0_lt_compat. exact H. }
  destruct (Rle_dec 0 y); [rewrite Rabs_right by lra|rewrite Rabs_left1 by lra]; lra.
Qed.
Lemma bump_far c r s : 0 < r -> r <= Rabs (s - c) -> bump c r s = 0.
Proof.
  intros H F. unfold bump. set (y := 1 - Rabs (s - c) / r).
  assert (y <= 0).
  { unfold y. assert (1 <= Rabs (s - c) / r); [|lra]. apply (Rmult_le_reg_r r); [exact H|]. unfold Rdiv.
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
  { apply continuity_minus; [apply continuity_const'|]. apply continuity_mult; [|apply continuity_const'].
    apply continuity_abs. apply continuity_minus; [apply continuity_id|apply continuity_const']. }
  apply continuity_mult; [|apply continuity_const']. apply continuity_plus; [exact Y|apply continuity_abs; exact Y].
Qed.

(* ---- The model's trajectory, off by the errors e of the points around the moment c, and by d in the extras ---- *)
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
  intros Hn Hj. unfold endR, knotR. destruct (Nat.ltb_spec j (n_points P * n_p P)) as [_|C]; [|lia]. f_equal. f_equal.
  rewrite Nat.mul_add_distr_r, <- Nat.mul_assoc. pose proof (Nat.div_mod j (n_p P) ltac:(lia)). lia.
Qed.
Lemma nudged_end P u y c r e d j : (0 < n_p P)%nat -> final_state P (nudged P u y c r e d) j = endR P u y j +
  if (j <? n_points P * n_p P)%nat then bump c r (INR (steps P)) * e (j / n_p P)%nat (j mod n_p P)%nat
  else d (j - n_points P * n_p P)%nat.
Proof.
  intro Hn. unfold final_state. destruct (Nat.ltb_spec j (n_points P * n_p P)) as [C|C].
  - simpl. rewrite line_from by lra. rewrite <- end_knot by assumption. reflexivity.
  - simpl. do 2 f_equal; lia.
Qed.

Record wide_bin (P : problem) (B : bin) : Prop := {
  all_points : forall t, (t < steps P)%nat -> length (nth t (interval B) []) = n_points P;
  all_widths : forall t i, (t < steps P)%nat -> (i < n_points P)%nat ->
    exists w, nth i (nth t (interval B) []) (Rows []) = Widths w /\ length w = n_p P /\ forall a, 0 <= toR w a;
  end_width : exists w, final B = Widths w /\ length w = (n_points P * n_p P + n_q P)%nat /\ forall a, 0 <= toR w a }.
Lemma nonneg_R w : forallb (qle 0) w = true -> forall a, 0 <= toR w a.
Proof.
  intros H a. unfold toR. destruct (Nat.lt_ge_cases a (length w)) as [L|L].
  - eapply forallb_forall in H; [|apply nth_In; exact L]. apply R_le in H. rewrite R0 in H. exact H.
  - rewrite nth_overflow by exact L. rewrite R0. lra.
Qed.
Lemma wide_bin_intro P B : bin_ok P B = true -> plain B = true -> wide_bin P B.
Proof.
  unfold bin_ok, plain. rewrite !andb_true_iff. intros ((LT & HI) & HF) (PI & PF). apply Nat.eqb_eq in LT.
  split.
  - intros t Ht. assert (It : In (nth t (interval B) []) (interval B)) by (apply nth_In; lia).
    eapply forallb_forall in HI; [|exact It]. apply andb_prop in HI as [Lm _]. apply Nat.eqb_eq. exact Lm.
  - intros t i Ht Hi. assert (It : In (nth t (interval B) []) (interval B)) by (apply nth_In; lia).
    eapply forallb_forall in HI; [|exact It]. eapply forallb_forall in PI; [|exact It]. apply andb_prop in HI as [Lm HI].
    apply Nat.eqb_eq in Lm. set (Es := nth t (interval B) []) in *.
    assert (Ie : In (nth i Es (Rows [])) Es) by (apply nth_In; lia).
    eapply forallb_forall in HI; [|exact Ie]. eapply forallb_forall in PI; [|exact Ie].
    destruct (nth i Es (Rows [])) as [w|]; [|discriminate]. exists w. simpl in HI. apply andb_prop in HI as [L HI].
    split; [reflexivity|]. split; [apply Nat.eqb_eq; exact L|apply nonneg_R; exact HI].
  - destruct (final B) as [w|]; [|discriminate]. exists w. simpl in HF. apply andb_prop in HF as [L HF].
    split; [reflexivity|]. split; [apply Nat.eqb_eq; exact L|apply nonneg_R; exact HF].
Qed.

(* Where the bump is not zero its errors have to be within the widths. *)
Lemma nudged_in_tube P N B u k c r e d : (0 < n_p P)%nat -> wide_bin P B -> 0 < r ->
  (forall t s i a, (t < steps P)%nat -> (i < n_points P)%nat -> (a < n_p P)%nat -> 0 <= s <= 1 ->
     r <= Rabs (INR t + s - c) \/ Rabs (e i a) <= toR (width (nth i (nth t (interval B) []) (Rows []))) a) ->
  (forall j, (j < n_points P * n_p P)%nat ->
     r <= Rabs (INR (steps P) - c) \/ Rabs (e (j / n_p P) (j mod n_p P))%nat <= toR (width (final B)) j) ->
  (forall j, (n_points P * n_p P <= j < n_points P * n_p P + n_q P)%nat ->
     Rabs (d (j - n_points P * n_p P)%nat) <= toR (width (final B)) j) ->
  in_tube P N B u k (nudged P u (netR N k) c r e d).
Proof.
  intros Hn [_ HI HF] Hr Hin Hend Hex. split.
  - intros t i s Ht Hi Hs. destruct (HI t i Ht Hi) as (w & E & _ & W0). rewrite E. unfold inError. intros a Ha.
    rewrite nudged_at by assumption.
    match goal with |- Rabs ?x <= _ => replace x with (bump c r (INR t + s) * e i a) by ring end.
    destruct (Hin t s i a Ht Hi Ha Hs) as [F|F].
    + rewrite (bump_far _ _ _ Hr F), Rmult_0_l, Rabs_R0. apply W0.
    + rewrite E in F. simpl in F. rewrite Rabs_mult. pose proof (bump_range c r (INR t + s) Hr).
      rewrite (Rabs_right (bump _ _ _)) by lra. pose proof (Rabs_pos (e i a)).
      assert (bump c r (INR t + s) * Rabs (e i a) <= 1 * Rabs (e i a)) by (apply Rmult_le_compat_r; lra). lra.
  - destruct HF as (w & E & _ & W0). rewrite E in *. simpl in Hend, Hex. unfold inError. intros j Hj.
    rewrite nudged_end by exact Hn.
    match goal with |- Rabs (?a + ?b - ?a) <= _ => replace (a + b - a) with b by ring end.
    destruct (Nat.ltb_spec j (n_points P * n_p P)) as [C|C]; [|apply Hex; lia].
    destruct (Hend j C) as [F|F].
    + rewrite (bump_far _ _ _ Hr F), Rmult_0_l, Rabs_R0. apply W0.
    + rewrite Rabs_mult. pose proof (bump_range c r (INR (steps P)) Hr).
      rewrite (Rabs_right (bump _ _ _)) by lra. set (v := Rabs (e _ _)) in *. pose proof (Rabs_pos (e (j / n_p P) (j mod n_p P))%nat).
      fold v in H0. assert (bump c r (INR (steps P)) * v <= 1 * v) by (apply Rmult_le_compat_r; lra). lra.
Qed.
