(* Bounds of forms over a box of k, followed back through the lines of the neurons [T36]. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia Psatz.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts ConditionFacts
  Doubt DoubtFacts NoPlan HullFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- One neuron ---- *)
Definition encloses (l : line) (x : R) : Prop :=
  Q2R (under l) * x <= Rmax 0 x <= Q2R (over l) * x + Q2R (height l).
Lemma line_over_R lo hi x : Q2R lo <= x <= Q2R hi -> encloses (line_over lo hi) x.
Proof.
  intros [Hlo Hhi]. unfold encloses, line_over. destruct (qle 0 lo) eqn:E0.
  { apply R_le in E0. cbn [under over height]. rewrite R0 in *. rewrite R1, Rmax_right by lra. lra.
    }
  apply R_nle in E0. rewrite R0 in E0. destruct (qle hi 0) eqn:E1.
  { apply R_le in E1. rewrite R0 in E1. cbn [under over height]. rewrite R0, Rmax_left by lra. lra.
    }
  apply R_nle in E1. rewrite R0 in E1. cbv zeta. set (size := qadd hi (- lo)).
  set (s := round_up (hi / size)).
  set (slope := if qle 0 s && qle hi (qmul s size) then s else 1%Q).
  set (least := qmul slope (- lo)).
  set (h := round_up least). clearbody h. cbn [under over height].
  assert (HS : 0 <= Q2R slope /\ Q2R hi <= Q2R slope * (Q2R hi - Q2R lo)).
  { unfold slope. destruct (qle 0 s && qle hi (qmul s size)) eqn:E; [|rewrite R1; lra].
    apply andb_prop in E as [A B].
    apply R_le in A, B. rewrite R0 in A. unfold size in B. rewrite R_mul, R_add, Q2R_opp in B. lra.
    }
  assert (HL : - (Q2R slope * Q2R lo) <= Q2R (if qle least h then h else least)).
  { assert (Q2R least = - (Q2R slope * Q2R lo)) as <- by (unfold least; rewrite R_mul,
      Q2R_opp; ring).
    destruct (qle least h) eqn:E; [apply R_le in E; exact E|lra]. }
  destruct HS as [S0 S1]. set (m := Q2R slope) in *. split.
  - pose proof (Rmax_l 0 x). pose proof (Rmax_r 0 x). destruct (qlt (- lo) hi);
      rewrite ?R0, ?R1; lra.
  - enough (Rmax 0 x <= m * (x - Q2R lo)) by lra. apply Rmax_lub; [apply Rmult_le_pos; lra|].
    destruct (Rle_dec 1 m) as [C|C].
    + assert (1 * (x - Q2R lo) <= m * (x - Q2R lo)) by (apply Rmult_le_compat_r; lra). lra.
    + assert (0 <= (1 - m) * (Q2R hi - x)) by (apply Rmult_le_pos; lra).
      replace (m * (x - Q2R lo)) with (m * (Q2R hi - Q2R lo) - Q2R hi + (1 - m) * (Q2R hi - x) + x)
        by ring. lra.
Qed.

(* ---- One layer ---- *)
Definition enclosed (ls : list line) (x : rv) : Prop :=
  (forall i l, nth_error ls i = Some l -> encloses l (x i)) /\ forall i, (length ls <= i)%nat ->
    x i = 0.
Lemma pass_back_R c : forall ls x, enclosed ls x -> affR (pass_back c ls) x <= dotR c (reluR x).
Proof.
  induction c as [|a c IH]; intros [|l ls] x [H Z]; simpl pass_back; try (rewrite affR_const, R0;
    simpl; lra).
  - rewrite affR_const, R0, (dotR_ext _ (reluR x) (fun _ => 0)), dotR_zero; [lra|]. intros i _.
    unfold reluR.
    rewrite Z by (simpl; lia). apply Rmax_left; lra.
  - assert (K : enclosed ls (shift x)).
    { split; [intros i m Hi; apply (H (S i) m Hi)|intros i Hi; apply Z; simpl; lia]. }
    specialize (IH ls (shift x) K). destruct (pass_back c ls) as [v d]. unfold affR in IH.
    cbn [fst snd] in IH.
    pose proof (H O l eq_refl) as [U O_]. cbn [dotR].
    change (shift (reluR x)) with (reluR (shift x)).
    change (reluR x O) with (Rmax 0 (x O)). destruct (qle 0 a) eqn:E; unfold affR;
      cbn [fst snd dotR]; rewrite R_mul.
    + apply R_le in E. rewrite R0 in E. pose proof (Rmult_le_compat_l _ _ _ E U). lra.
    + apply R_nle in E. rewrite R0 in E. rewrite R_add, R_mul.
      assert (Q2R a * (Q2R (over l) * x O + Q2R (height l)) <= Q2R a * Rmax 0 (x O))
        by (apply Rmult_le_compat_neg_l; lra). lra.
Qed.
Lemma layer_forms (L : layer) x i : at_forms L x i = layerR L x i.
Proof.
  unfold at_forms, layerR. destruct (nth_error L i) as [[w b]|] eqn:E.
  - apply nth_error_nth with (d := aconst 0%Q) in E.
    transitivity (affR (w, b) x); [f_equal; exact E|reflexivity].
  - rewrite nth_overflow; [rewrite affR_const; apply R0|]. apply nth_error_None. exact E.
Qed.
Lemma layer_back_R L ls f x : enclosed ls (layerR L x) -> affR (layer_back L ls f) x <= affR f
  (reluR (layerR L x)).
Proof.
  intro H. pose proof (pass_back_R (fst f) ls _ H) as K. unfold layer_back.
  destruct (pass_back (fst f) ls) as [v d].
  rewrite affR_add, affR_lincomb, affR_const, R_add, (dotR_ext v _ (layerR L x)) by (intros;
    apply layer_forms).
  unfold affR in K |- *. cbn [fst snd] in K. lra.
Qed.

(* ---- All layers, down to the box of k ---- *)
Lemma least_in_R D : forall c x, inBox D x -> (forall i, (length D <= i)%nat -> x i = 0) ->
  Q2R (least_in D c) <= dotR c x.
Proof.
  induction D as [|[lo hi] D IH]; intros [|a c] x H Z; simpl least_in; try (rewrite R0; simpl; lra).
  - rewrite R0, (dotR_ext _ x (fun _ => 0)), dotR_zero; [lra|]. intros i _. apply Z. simpl. lia.
  - destruct H as [H0 H]. specialize (IH c (shift x) H ltac:(intros i Hi; apply Z; simpl; lia)).
    rewrite R_add, R_mul. cbn [dotR]. destruct (qle 0 a) eqn:E.
    + apply R_le in E. rewrite R0 in E. assert (Q2R a * Q2R lo <= Q2R a * x O)
        by (apply Rmult_le_compat_l; lra). lra.
    + apply R_nle in E. rewrite R0 in E. assert (Q2R a * Q2R hi <= Q2R a * x O)
        by (apply Rmult_le_compat_neg_l; lra). lra.
Qed.
(* y is what these layers make of x, and their lines enclose it. *)
Fixpoint yields (past : held) (x y : rv) : Prop :=
  match past with
  | [] => y = x
  | (L, ls) :: past' => exists w, yields past' x w /\ enclosed ls (layerR L w) /\
    y = reluR (layerR L w)
  end.
Section Box.
Variables (D : area) (x : rv).
Hypothesis HD : inBox D x.
Hypothesis HZ : forall i, (length D <= i)%nat -> x i = 0.
Lemma at_least_R past : forall f y, yields past x y -> Q2R (at_least D past f) <= affR f y.
Proof.
  induction past as [|[L ls] past IH]; intros f y H; simpl.
  - simpl in H. subst y. rewrite R_add. pose proof (least_in_R D (fst f) x HD HZ). unfold affR. lra.
  - destruct H as (w & Hw & He & ->). eapply Rle_trans; [apply (IH _ w Hw)|apply layer_back_R;
      exact He].
Qed.
Lemma lines_R past L y : yields past x y -> enclosed (map (line_of D past) L) (layerR L y).
Proof.
  intro H. split.
  - intros i l Hi. rewrite nth_error_map in Hi. rewrite <- layer_forms. unfold at_forms.
    destruct (nth_error L i) as [[w b]|] eqn:E; [|discriminate]. injection Hi as <-.
    apply nth_error_nth with (d := aconst 0%Q) in E. rewrite E. apply line_over_R. rewrite Q2R_opp.
    pose proof (at_least_R past (w, b) y H) as A. pose proof (at_least_R past (aneg (w, b)) y H)
      as B. rewrite affR_neg in B.
    unfold affR in A, B |- *. cbn [fst snd] in A, B |- *. lra.
  - intros i Hi. rewrite map_length in Hi. rewrite <- layer_forms. unfold at_forms.
    rewrite nth_overflow by exact Hi. rewrite affR_const. apply R0.
Qed.
Lemma learn_R Ls : forall past y, yields past x y -> yields (learn D Ls past) x (stateR Ls y).
Proof.
  induction Ls as [|L Ls IH]; intros past y H; [exact H|]. destruct Ls as [|L' Ls]; [exact H|].
  change (learn D (L :: L' :: Ls) past) with (learn D (L' :: Ls) ((L, map (line_of D past) L) ::
    past)).
  change (stateR (L :: L' :: Ls) y) with (stateR (L' :: Ls) (reluR (layerR L y))).
  apply IH. exists y. split; [exact H|]. split; [apply lines_R; exact H|reflexivity].
Qed.
(* What makes a row hold for all k in the box, at z. *)
Lemma lowered_R N n (z : rv) r : rowR z (lowered n D (lines_in N D) r) ->
  rowR (join n z (stateR N x)) r.
Proof.
  pose proof (at_least_R (lines_in N D) (skipn n (fst (snd r)), snd (snd r)) _ (learn_R N [] x
    eq_refl)) as K.
  destruct r as [st [c d]]. unfold rowR, lowered, affR in *. cbn [fst snd] in *.
  rewrite (dotR_split n c).
  rewrite (dotR_ext (firstn n c) (join n z (stateR N x)) z).
  2: { intros i Hi. rewrite firstn_length in Hi. unfold join. destruct (Nat.ltb_spec i n);
    [reflexivity|lia]. }
  rewrite (dotR_ext (skipn n c) (fun i => join n z (stateR N x) (n + i)%nat) (stateR N x)).
  2: { intros i _. unfold join. destruct (Nat.ltb_spec (n + i) n); [lia|]. f_equal. lia. }
  destruct st; lra.
Qed.
End Box.
Lemma lowered_upto n D past r x y : (forall i, (i < n)%nat -> x i = y i) ->
  rowR x (lowered n D past r) -> rowR y (lowered n D past r).
Proof.
  intro E. destruct r as [st [c d]]. unfold rowR, lowered, affR. cbn [fst snd].
  rewrite (dotR_ext (firstn n c) x y); [auto|]. intros i Hi. apply E. rewrite firstn_length in Hi.
  lia.
Qed.
