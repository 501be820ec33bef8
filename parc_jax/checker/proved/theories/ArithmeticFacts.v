(* What Arithmetic.v computes, said over the reals. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia Psatz ZArith.
From ParcJax Require Import Spec Arithmetic.
Import ListNotations.
Open Scope R_scope.

(* ---- Numbers ---- *)
Lemma red_eq q : (red q == q)%Q.
Proof.
  unfold red. destruct (_ / _)%Z; try reflexivity.
  destruct (Qeq_bool _ q) eqn:E; [apply Qeq_bool_eq; exact E | reflexivity].
Qed.
Lemma R_add a b : Q2R (qadd a b) = Q2R a + Q2R b.
Proof.
  rewrite <- Q2R_plus. apply Qeq_eqR. unfold qadd. destruct a as [na da], b as [nb db];
    simpl Qnum; simpl Qden.
  destruct (Z.eqb_spec (Zpos da) (Zpos db)) as [H|H].
  { injection H as ->. unfold Qeq, Qplus; simpl. rewrite Pos2Z.inj_mul. ring. }
  destruct (Z.eqb_spec nb 0) as [->|_].
  { unfold Qeq, Qplus; simpl. rewrite Pos2Z.inj_mul. ring. }
  cbv zeta. set (m := (Zpos db / Zpos da)%Z). set (m' := (Zpos da / Zpos db)%Z). clearbody m m'.
  destruct (Z.eqb_spec (Zpos da * m) (Zpos db)) as [G|G].
  { unfold Qeq, Qplus; simpl Qnum; simpl Qden. rewrite Pos2Z.inj_mul, <- G. ring. }
  destruct (Z.eqb_spec (Zpos db * m') (Zpos da)) as [K|K]; [|destruct (Z.leb _ short);
    [reflexivity|apply red_eq]].
  unfold Qeq, Qplus; simpl Qnum; simpl Qden. rewrite Pos2Z.inj_mul, <- K. ring.
Qed.
Lemma R_mul a b : Q2R (qmul a b) = Q2R a * Q2R b.
Proof.
  rewrite <- Q2R_mult. apply Qeq_eqR. unfold qmul.
  destruct (Z.eqb_spec (Qnum a) 0) as [H|H].
  { destruct a as [na da]; simpl in H; subst. unfold Qeq, Qmult; simpl. reflexivity. }
  destruct (Z.eqb_spec (Qnum b) 0) as [G|G]; [|reflexivity].
  destruct b as [nb db]; simpl in G; subst. unfold Qeq, Qmult; simpl. rewrite Z.mul_0_r.
  reflexivity.
Qed.
Lemma R_le a b : qle a b = true -> Q2R a <= Q2R b.
Proof. intro H. apply Qle_Rle. apply Qle_bool_iff. exact H. Qed.
Lemma R_lt a b : qlt a b = true -> Q2R a < Q2R b.
Proof.
  unfold qlt. intro H. apply Qlt_Rlt. apply Qnot_le_lt. intro G. apply Qle_bool_iff in G.
  rewrite G in H. discriminate.
Qed.
Lemma R_nle a b : qle a b = false -> Q2R b < Q2R a.
Proof. intro H. apply R_lt. unfold qlt. unfold qle in H. rewrite H. reflexivity. Qed.
Lemma R0 : Q2R 0 = 0. Proof. unfold Q2R; simpl; lra. Qed.
Lemma R1 : Q2R 1 = 1. Proof. unfold Q2R; simpl; lra. Qed.
Lemma Rm1 : Q2R (-1) = -1. Proof. unfold Q2R; simpl; lra. Qed.
Lemma R_abs a : Q2R (Qabs a) = Rabs (Q2R a).
Proof.
  apply Qabs_case; intro H.
  - apply Qle_Rle in H. rewrite R0 in H. rewrite Rabs_right; lra.
  - apply Qle_Rle in H. rewrite R0 in H. rewrite Rabs_left1, Q2R_opp; lra.
Qed.
#[export] Hint Rewrite R_add R_mul R0 R1 Rm1 Q2R_opp Q2R_plus Q2R_minus : q.
Lemma le_complete a b : Q2R a <= Q2R b -> qle a b = true.
Proof. intro H. apply Qle_bool_iff. apply Rle_Qle. exact H. Qed.
Lemma root_up_R s : 0 <= Q2R s -> 0 <= Q2R (root_up s) /\ Q2R s <= Q2R (root_up s) * Q2R
  (root_up s).
Proof.
  intro H. unfold root_up. set (u := red _). destruct (qle 0 u && qle s (qmul u u)) eqn:E.
  - apply andb_prop in E as [E1 E2]. apply R_le in E1, E2. rewrite R0 in E1.
    rewrite R_mul in E2. lra.
  - autorewrite with q. nra.
Qed.

(* ---- Vectors ---- *)
Lemma dotR_ext w : forall x y, (forall i, (i < length w)%nat -> x i = y i) -> dotR w x = dotR w y.
Proof.
  induction w as [|a w IH]; intros x y H; simpl; [reflexivity|].
  rewrite (H O) by (simpl; lia). f_equal. apply IH. intros i Hi. apply H. simpl. lia.
Qed.
Lemma dotR_plus w : forall x y, dotR w (fun i => x i + y i) = dotR w x + dotR w y.
Proof. induction w as [|a w IH]; intros; simpl; [lra|]. change (shift (fun i => x i + y i))
  with (fun i => shift x i + shift y i). rewrite IH. lra. Qed.
Lemma dotR_mult w : forall c x, dotR w (fun i => c * x i) = c * dotR w x.
Proof. induction w as [|a w IH]; intros; simpl; [lra|]. change (shift (fun i => c * x i))
  with (fun i => c * shift x i). rewrite IH. lra. Qed.
Lemma dotR_zero w : dotR w (fun _ => 0) = 0.
Proof. induction w as [|a w IH]; simpl; [lra|]. change (shift (fun _ => 0)) with (fun _ : nat => 0).
rewrite IH. lra. Qed.
Lemma dotR_vadd u : forall v x, dotR (vadd u v) x = dotR u x + dotR v x.
Proof.
  induction u as [|a u IH]; intros [|b v] x; simpl; try lra. rewrite IH, R_add. lra.
Qed.
Lemma dotR_vscale a v : forall x, dotR (vscale a v) x = Q2R a * dotR v x.
Proof. induction v as [|b v IH]; intros; simpl; [lra|]. unfold vscale in IH.
rewrite IH, R_mul. lra. Qed.
Lemma toR_nil i : toR [] i = 0. Proof. unfold toR. destruct i; simpl; apply R0. Qed.
Lemma dotQ_R u : forall v, Q2R (dotQ u v) = dotR u (toR v).
Proof.
  induction u as [|a u IH]; intros v; [simpl; apply R0|].
  destruct v as [|b v].
  - simpl dotQ. rewrite R0. rewrite (dotR_ext _ _ (fun _ => 0)); [rewrite dotR_zero; reflexivity|].
    intros; apply toR_nil.
  - simpl. rewrite R_add, R_mul, IH. reflexivity.
Qed.
Lemma dot_abs w : forall x e, (forall i, (i < length w)%nat -> Rabs (x i) <= e i) ->
  Rabs (dotR w x) <= dotR (vabs w) e.
Proof.
  induction w as [|a w IH]; intros x e H; simpl; [rewrite Rabs_R0; lra|].
  rewrite R_abs. eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat.
  - rewrite Rabs_mult. apply Rmult_le_compat_l; [apply Rabs_pos|]. apply H. simpl; lia.
  - apply IH. intros i Hi. apply H. simpl; lia.
Qed.
Lemma sumsq_pos n : forall x, 0 <= sumsq n x.
Proof. induction n; intros; simpl; [lra|]. specialize (IHn (shift x)). nra. Qed.
Lemma cauchy w : forall x, dotR w x * dotR w x <= dotR w (toR w) * sumsq (length w) x /\
  0 <= dotR w (toR w).
Proof.
  induction w as [|a w IH]; intros x; simpl; [lra|].
  destruct (IH (shift x)) as [H W]. replace (shift (toR (a :: w))) with (toR w) by reflexivity.
  replace (toR (a :: w) O) with (Q2R a) by reflexivity.
  set (A := Q2R a) in *. set (X := x O) in *. set (D := dotR w (shift x)) in *.
  set (V := dotR w (toR w)) in *. pose proof (sumsq_pos (length w) (shift x)) as S0.
  set (S := sumsq (length w) (shift x)) in *. split; [|nra].
  assert (K : 2 * (A * X) * D <= A * A * S + V * (X * X)).
  { apply Rsqr_incr_0_var; [|nra]. unfold Rsqr.
    assert (4 * ((A * X) * (A * X)) * (D * D) <= 4 * ((A * X) * (A * X)) * (V * S))
      by (apply Rmult_le_compat_l; nra).
    pose proof (Rle_0_sqr (A * A * S - V * (X * X))) as Q. unfold Rsqr in Q. nra. }
  nra.
Qed.
Lemma zero_R u : nonzero u = false -> forall x, dotR u x = 0.
Proof.
  induction u as [|a u IH]; intros H x; simpl in *; [reflexivity|].
  apply orb_false_iff in H as [A H].
  rewrite (IH H). apply negb_false_iff, Z.eqb_eq in A. unfold Q2R. rewrite A. lra.
Qed.
Lemma same_R u : forall v, same u v = true -> forall x, dotR u x = dotR v x.
Proof.
  induction u as [|a u IH]; intros v H x; [|destruct v as [|b v]].
  - simpl in H. rewrite negb_true_iff in H. rewrite (zero_R v H). reflexivity.
  - cbn [same] in H. rewrite negb_true_iff in H. rewrite (zero_R _ H). reflexivity.
  - cbn [same] in H. apply andb_prop in H as [A H]. apply Qeq_bool_eq, Qeq_eqR in A. simpl.
    rewrite A, (IH v H). reflexivity.
Qed.
Lemma inBox_R D : forall v, inBoxQ D v = true -> inBox D (toR v).
Proof.
  induction D as [|[lo hi] D IH]; intros [|a v] H; simpl in *; try discriminate; auto.
  rewrite !andb_true_iff in H. destruct H as [[A B] C].
  split; [split; [exact (R_le _ _ A)|exact (R_le _ _ B)]|apply (IH v C)].
Qed.
Lemma inBox_complete D : forall v, length v = length D -> inBox D (toR v) -> inBoxQ D v = true.
Proof.
  induction D as [|[lo hi] D IH]; intros [|a v] L H; simpl in *; try discriminate; auto.
  destruct H as [[A B] C]. rewrite !andb_true_iff. repeat split; try (apply le_complete;
    assumption). apply IH; [lia|exact C].
Qed.

(* ---- Multipliers of rows ---- *)
Lemma combine_R A m : forallb (fun im => qle 0 (snd im)) m = true -> forall x, inPoly A x ->
  dotR (fst (combine_rows A m)) x <= Q2R (snd (combine_rows A m)).
Proof.
  intros Hm x Hx. induction m as [|[i a] m IH]; [simpl; rewrite R0; lra|].
  simpl in Hm. apply andb_prop in Hm as [Ha Hm]. specialize (IH Hm). apply R_le in Ha.
  rewrite R0 in Ha. simpl.
  destruct (nth i A ([], 0%Q)) as [w b] eqn:E. simpl. rewrite dotR_vadd, dotR_vscale, R_add, R_mul.
  assert (dotR w x <= Q2R b).
  { destruct (Nat.lt_ge_cases i (length A)) as [H|H].
    - apply Hx. rewrite <- E. apply nth_In. exact H.
    - rewrite nth_overflow in E by exact H. injection E as <- <-. simpl. rewrite R0. lra. }
  simpl in Ha. nra.
Qed.

(* ---- Affine forms ---- *)
Definition affR (f : aff) (x : rv) : R := dotR (fst f) x + Q2R (snd f).
Lemma affR_const d x : affR (aconst d) x = Q2R d. Proof. unfold affR; simpl; lra. Qed.
Lemma affR_add f g x : affR (aadd f g) x = affR f x + affR g x.
Proof. unfold affR, aadd; simpl. rewrite dotR_vadd, R_add. lra. Qed.
Lemma affR_scale a f x : affR (ascale a f) x = Q2R a * affR f x.
Proof. unfold affR, ascale; simpl. rewrite dotR_vscale, R_mul. lra. Qed.
Lemma affR_neg f x : affR (aneg f) x = - affR f x.
Proof. unfold aneg. rewrite affR_scale, Rm1. lra. Qed.
Definition at_forms (X : list aff) (x : rv) : rv := fun i => affR (nth i X (aconst 0)) x.
Lemma at_nil x i : at_forms [] x i = 0.
Proof. unfold at_forms. destruct i; simpl; rewrite affR_const; apply R0. Qed.
Lemma affR_lincomb w : forall X x, affR (lincomb w X) x = dotR w (at_forms X x).
Proof.
  induction w as [|a w IH]; intros X x; [simpl; rewrite affR_const; apply R0|].
  destruct X as [|f X].
  - simpl lincomb. rewrite affR_const, R0, (dotR_ext _ _ (fun _ => 0)), dotR_zero; [reflexivity|].
    intros; apply at_nil.
  - simpl. rewrite affR_add, affR_scale, IH. reflexivity.
Qed.
#[export] Hint Rewrite affR_const affR_add affR_scale affR_neg affR_lincomb : q.
Lemma unit_R i : forall x, affR (unit_form i) x = x i.
Proof.
  unfold affR, unit_form. simpl. intros x. rewrite R0, Rplus_0_r. revert x.
  induction i as [|i IH]; intros x; simpl; rewrite ?R0, ?R1; [lra|]. rewrite IH. unfold shift. lra.
Qed.
Lemma at_units n : forall a x i, (i < n)%nat -> at_forms (map unit_form (seq a n)) x i = x
  (a + i)%nat.
Proof.
  intros a x i H. unfold at_forms. rewrite nth_indep with (d' :=
    unit_form 0) by (rewrite map_length, seq_length; lia).
  rewrite map_nth, seq_nth by lia. apply unit_R.
Qed.
Lemma at_const v x i : at_forms (map aconst v) x i = toR v i.
Proof.
  unfold at_forms, toR. destruct (Nat.lt_ge_cases i (length v)) as [H|H].
  - rewrite map_nth. apply affR_const.
  - rewrite !nth_overflow by (try rewrite map_length; auto). apply affR_const.
Qed.
Lemma at_zadd X : forall Y x i, (i < length X)%nat -> (i < length Y)%nat ->
  at_forms (zadd X Y) x i = at_forms X x i + at_forms Y x i.
Proof.
  unfold at_forms. induction X as [|f X IH]; intros [|g Y] x i H1 H2; simpl in *; try lia.
  destruct i; [apply affR_add|apply IH; lia].
Qed.
Lemma len_zadd X : forall Y, length Y = length X -> length (zadd X Y) = length X.
Proof. induction X; intros [|g Y] H; simpl in *; try discriminate; auto. Qed.

(* ---- Conditions ---- *)
Definition rowR (x : rv) (r : row) : Prop := if fst r then 0 < affR (snd r) x
  else 0 <= affR (snd r) x.
Lemma never_R x : ~ rowR x never.
Proof. unfold rowR, never. simpl. rewrite affR_const, R0. lra. Qed.
Lemma holds_R v r : holdsQ v r = true -> rowR (toR v) r.
Proof.
  unfold holdsQ, rowR, affR. destruct r as [[|] [c d]]; simpl; intro H;
    [apply R_lt in H|apply R_le in H];
  rewrite R0, R_add, dotQ_R in H; exact H.
Qed.
