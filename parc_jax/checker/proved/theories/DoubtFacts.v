(* A box of doubt that is accepted holds safe plans only [T21]. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts BinFacts
  ConditionFacts Doubt.
Import ListNotations.
Open Scope R_scope.

(* ---- Sums of points with weights that are not negative; total weight 1 is the hull ---- *)
Inductive cone (V : list vec) : rv -> R -> Prop :=
| cone_none x w : (forall i, x i = 0) -> w = 0 -> cone V x w
| cone_more v l x w y w' : In v V -> 0 <= l -> cone V x w ->
    (forall i, y i = x i + l * toR v i) -> w' = w + l -> cone V y w'.

Lemma cone_ext V x w y w' : cone V x w -> (forall i, x i = y i) -> w = w' -> cone V y w'.
Proof.
  intros H E ->. revert y E. induction H as [x w Z W|v l x w z w1 Hv Hl H IH Hz W]; intros y E.
  - apply cone_none; [intro i; rewrite <- E; apply Z|exact W].
  - apply (cone_more V v l x w); auto. intro i. rewrite <- E. apply Hz.
Qed.
Lemma cone_add V x w y u : cone V x w -> cone V y u -> cone V (fun i => x i + y i) (w + u).
Proof.
  intros H K. induction H as [x w Z W|v l x w z w1 Hv Hl H IH Hz W].
  - apply (cone_ext V y u); [exact K|intro i; rewrite Z; ring|rewrite W; ring].
  - apply (cone_more V v l (fun i => x i + y i) (w + u)); auto; [intro i; rewrite Hz;
      ring|rewrite W; ring].
Qed.
Lemma cone_scale V c x w : 0 <= c -> cone V x w -> cone V (fun i => c * x i) (c * w).
Proof.
  intros Hc H. induction H as [x w Z W|v l x w z w1 Hv Hl H IH Hz W].
  - apply cone_none; [intro i; rewrite Z; ring|rewrite W; ring].
  - apply (cone_more V v (c * l) (fun i => c * x i) (c * w)); auto; [apply Rmult_le_pos;
      auto|intro i; rewrite Hz; ring|rewrite W; ring].
Qed.
Lemma cone_sub V W x w : (forall v, In v V -> cone W (toR v) 1) -> cone V x w -> cone W x w.
Proof.
  intros S H. induction H as [x w Z E|v l x w z w1 Hv Hl H IH Hz E]; [apply cone_none; auto|].
  apply (cone_ext W (fun i => x i + l * toR v i) (w + l * 1)); [|intro i; symmetry;
    apply Hz|rewrite E; ring].
  apply cone_add; [exact IH|]. apply cone_scale; auto.
Qed.
Lemma cone_one V v : In v V -> cone V (toR v) 1.
Proof. intro H. apply (cone_more V v 1 (fun _ => 0) 0); auto; [lra|apply cone_none; auto|intro;
  ring|ring]. Qed.
Lemma cone_incl V W x w : (forall v, In v V -> In v W) -> cone V x w -> cone W x w.
Proof. intro S. apply cone_sub. intros v Hv. apply cone_one. auto. Qed.
Lemma cone_weight V x w : cone V x w -> 0 <= w.
Proof. induction 1; lra. Qed.
Lemma cone_positive V a c x w : cone V x w -> (forall v, In v V -> 0 <= a + dotR c (toR v)) ->
  0 <= a * w + dotR c x.
Proof.
  intros H S. induction H as [x w Z E|v l x w z w1 Hv Hl H IH Hz E].
  - rewrite (dotR_ext c x (fun _ => 0)), dotR_zero by (intros; apply Z). subst. lra.
  - rewrite (dotR_ext c z (fun i => x i + l * toR v i)) by (intros; apply Hz).
    rewrite (dotR_plus c x), dotR_mult.
    assert (0 <= l * (a + dotR c (toR v))) by (apply Rmult_le_pos; auto). subst. lra.
Qed.
Lemma cone_strict V a c x w : cone V x w -> 0 < w -> (forall v, In v V -> 0 < a + dotR c (toR v)) ->
  0 < a * w + dotR c x.
Proof.
  intros H W S. induction H as [x w Z E|v l x w z w1 Hv Hl H IH Hz E]; [lra|].
  pose proof (cone_weight _ _ _ H) as W0.
  rewrite (dotR_ext c z (fun i => x i + l * toR v i)) by (intros; apply Hz).
  rewrite (dotR_plus c x), dotR_mult. subst w1.
  specialize (S v Hv) as Sv. destruct (Rle_lt_or_eq_dec 0 w W0) as [L|<-].
  - specialize (IH L). assert (0 <= l * (a + dotR c (toR v))) by (apply Rmult_le_pos; lra). lra.
  - assert (0 < l * (a + dotR c (toR v))) by (apply Rmult_lt_0_compat; lra).
    pose proof (cone_positive V a c x 0 H (fun v Hv => Rlt_le _ _ (S v Hv))). lra.
Qed.

(* ---- An affine form cuts a hull into two: the points above with the zeros, and those below with
   the zeros ---- *)
Section Cut.
Variables (c : vec) (d : R) (P M Z : list vec).
Let f (x : rv) (w : R) := dotR c x + d * w.
Hypothesis HP : forall v, In v P -> 0 <= f (toR v) 1.
Hypothesis HM : forall v, In v M -> f (toR v) 1 < 0.
Hypothesis HZ : forall p m, In p P -> In m M -> exists z, cone Z z 1 /\
  forall i, (f (toR p) 1 - f (toR m) 1) * z i = f (toR p) 1 * toR m i - f (toR m) 1 * toR p i.

Lemma f_add x w y u : f (fun i => x i + y i) (w + u) = f x w + f y u.
Proof. unfold f. rewrite dotR_plus. ring. Qed.
Lemma f_more x w l v y w' : (forall i, y i = x i + l * toR v i) -> w' = w + l ->
  f y w' = f x w + l * f (toR v) 1.
Proof.
  intros Hy ->. unfold f. rewrite (dotR_ext c y (fun i => x i + l * toR v i)) by (intros; apply Hy).
  rewrite (dotR_plus c x), dotR_mult. ring.
Qed.
Lemma f_zero x w : (forall i, x i = 0) -> w = 0 -> f x w = 0.
Proof. intros H ->. unfold f. rewrite (dotR_ext c x (fun _ => 0)), dotR_zero by (intros; apply H).
ring. Qed.
Lemma transport_one p b w : In p P -> cone M b w ->
  cone Z (fun i => f (toR p) 1 * b i - f b w * toR p i) (f (toR p) 1 * w - f b w).
Proof.
  intros Hp H. induction H as [x w Hx W|m l x w y w' Hm Hl H IH Hy W].
  - apply cone_none; [intro i|]; rewrite (f_zero x w Hx W), ?Hx, ?W; ring.
  - destruct (HZ p m Hp Hm) as (z & Cz & Ez).
    assert (S : 0 <= l * (f (toR p) 1 - f (toR m) 1)) by (apply Rmult_le_pos;
      [exact Hl|specialize (HP p Hp); specialize (HM m Hm); lra]).
    apply (cone_ext _ _ _ _ _ (cone_add _ _ _ _ _ IH (cone_scale _ _ _ _ S Cz))).
    + intro i. cbv beta. rewrite (f_more x w l m y w' Hy W), Hy, Rmult_assoc, Ez. ring.
    + rewrite (f_more x w l m y w' Hy W), W. ring.
Qed.
Lemma transport a w b u : cone P a w -> cone M b u ->
  cone Z (fun i => f a w * b i - f b u * a i) (f a w * u - f b u * w).
Proof.
  intros H K. induction H as [x w Hx W|p l x w y w' Hp Hl H IH Hy W].
  - apply cone_none; [intro i|]; rewrite (f_zero x w Hx W), ?Hx, ?W; ring.
  - apply (cone_ext _ _ _ _ _ (cone_add _ _ _ _ _ IH (cone_scale _ l _ _ Hl (transport_one p
      b u Hp K)))).
    + intro i. cbv beta. rewrite (f_more x w l p y w' Hy W), Hy. ring.
    + rewrite (f_more x w l p y w' Hy W), W. ring.
Qed.
Lemma below_is_below b w : cone M b w -> f b w < 0 \/ ((forall i, b i = 0) /\ w = 0).
Proof.
  induction 1 as [x w Hx W|m l x w y w' Hm Hl H IH Hy W]; [right; auto|].
  rewrite (f_more x w l m y w' Hy W).
  specialize (HM m Hm). destruct (Rle_lt_or_eq_dec 0 l Hl) as [L|<-].
  - left. assert (l * f (toR m) 1 < 0) by (rewrite <- (Rmult_0_r l); apply Rmult_lt_compat_l; lra).
    destruct IH as [IH|[Hx Hw]]; [lra|]. rewrite (f_zero x w Hx Hw). lra.
  - destruct IH as [IH|[Hx Hw]]; [left; lra|right]. split; [intro i; rewrite Hy, Hx; ring|lra].
Qed.
Lemma parts_of V x w : (forall v, In v V -> In v P \/ In v M) -> cone V x w ->
  exists a wa b wb, cone P a wa /\ cone M b wb /\ (forall i, x i = a i + b i) /\ w = wa + wb.
Proof.
  intros S H. induction H as [x w Hx W|v l x w y w' Hv Hl H (a & wa & b & wb & A & B & E & F) Hy W].
  - exists (fun _ => 0), 0, (fun _ => 0), 0. repeat split; try (apply cone_none; auto); [intro i;
      rewrite Hx; ring|lra].
  - destruct (S v Hv) as [Hp|Hm].
    + exists (fun i => a i + l * toR v i), (wa + l), b, wb. repeat split; auto; [eapply cone_more;
        eauto|intro i; rewrite Hy, E; ring|lra].
    + exists a, wa, (fun i => b i + l * toR v i), (wb + l). repeat split; auto; [eapply cone_more;
        eauto|intro i; rewrite Hy, E; ring|lra].
Qed.
Theorem cut V x w : (forall v, In v V -> In v P \/ In v M) -> cone V x w -> 0 <= f x w ->
  cone (P ++ Z) x w.
Proof.
  intros S H Hf. destruct (parts_of V x w S H) as (a & wa & b & wb & A & B & E & F).
  assert (Ef : f x w = f a wa + f b wb).
  { rewrite <- f_add, <- F. unfold f. rewrite (dotR_ext c x (fun i => a i + b i)) by (intros;
      apply E). reflexivity. }
  assert (I1 : forall y u, cone P y u -> cone (P ++ Z) y u) by (intros y u; apply cone_incl; intros;
    apply in_or_app; auto).
  assert (I2 : forall y u, cone Z y u -> cone (P ++ Z) y u) by (intros y u; apply cone_incl; intros;
    apply in_or_app; auto).
  destruct (below_is_below b wb B) as [Hb|[Hb Hw]].
  - assert (Fa : 0 < f a wa) by lra.
    assert (S1 : 0 <= 1 + f b wb / f a wa).
    { apply (Rmult_le_reg_r (f a wa)); [exact Fa|]. replace ((1 + f b wb / f a wa) * f a wa)
        with (f a wa + f b wb) by (field; lra). lra. }
    assert (S2 : 0 <= / f a wa) by (left; apply Rinv_0_lt_compat; exact Fa).
    apply (cone_ext _ _ _ _ _ (cone_add _ _ _ _ _ (cone_scale _ _ _ _ S1 (I1 _ _ A)) (cone_scale _ _
      _ _ S2 (I2 _ _ (transport a wa b wb A B))))).
    + intro i. cbv beta. rewrite E. field. lra.
    + rewrite F. field. lra.
  - apply (cone_ext _ a wa); [apply I1; exact A|intro i; rewrite E, Hb; ring|lra].
Qed.
End Cut.

(* ---- The cells cover the hull of their first points ---- *)
Lemma value_R f v : Q2R (value f v) = dotR (fst f) (toR v) + Q2R (snd f).
Proof. unfold value. rewrite R_add, dotQ_R. reflexivity. Qed.
Lemma toR_vadd u : forall v i, toR (vadd u v) i = toR u i + toR v i.
Proof.
  unfold toR. induction u as [|a u IH]; intros [|b v] [|i]; simpl; rewrite ?R_add, ?R0; try lra.
  apply IH.
Qed.
Lemma toR_vscale a v : forall i, toR (vscale a v) i = Q2R a * toR v i.
Proof. unfold toR, vscale. induction v as [|b v IH]; intros [|i]; simpl; rewrite ?R_mul, ?R0;
  try lra. apply IH. Qed.
Lemma middle_R s a b i : toR (middle s a b) i = (1 - Q2R s) * toR a i + Q2R s * toR b i.
Proof. unfold middle. rewrite toR_vadd, !toR_vscale, R_add, Q2R_opp, R1. ring. Qed.
Lemma same_toR u : forall v, same u v = true -> forall i, toR u i = toR v i.
Proof.
  assert (Z : forall w, nonzero w = false -> forall i, toR w i = 0).
  { unfold toR. induction w as [|a w IH]; intros H [|i]; simpl in *; try apply R0.
    - apply orb_false_iff in H as [A _]. apply negb_false_iff, Z.eqb_eq in A. unfold Q2R.
      rewrite A. lra.
    - apply orb_false_iff in H as [_ H]. apply (IH H i). }
  induction u as [|a u IH]; intros v H i; [|destruct v as [|b v]].
  - simpl in H. rewrite negb_true_iff in H. rewrite (Z v H), toR_nil. reflexivity.
  - cbn [same] in H. rewrite negb_true_iff in H. rewrite (Z _ H), toR_nil. reflexivity.
  - cbn [same] in H. apply andb_prop in H as [A H]. apply Qeq_bool_eq, Qeq_eqR in A.
    destruct i as [|i]; [exact A|apply (IH v H i)].
Qed.
Lemma segment_cone V s a b y : In a V -> In b V -> 0 <= s <= 1 -> (forall i, y i = (1 - s) * toR a i
  + s * toR b i) -> cone V y 1.
Proof.
  intros Ha Hb Hs Hy.
  apply (cone_ext V (fun i => (1 - s) * toR a i + s * toR b i) ((1 - s) * 1 + s * 1)); [|intro i;
    symmetry; apply Hy|ring].
  apply cone_add; (apply cone_scale; [lra|apply cone_one; assumption]).
Qed.
Lemma ends_R l v : In v l -> cone (ends l) (toR v) 1.
Proof.
  intro H. unfold ends. destruct (forallb _ l) eqn:E; [|apply cone_one; exact H].
  eapply forallb_forall in E; [|exact H]. unfold on_segment in E.
  destruct (find _ _) as [[[x y] z]|]; [|discriminate].
  rewrite !andb_true_iff in E. destruct E as [[S0 S1] E]. apply R_le in S0, S1. rewrite R0 in S0.
  rewrite R1 in S1.
  eapply (segment_cone _ _ (extreme before l) (extreme (fun u v => before v u) l)); [simpl;
    auto|simpl; auto|split; [exact S0|exact S1]|].
  intro i. rewrite (same_toR _ _ E). apply middle_R.
Qed.
Lemma zero_between_R f a b v : zero_between f a b = Some v ->
  forall i, (Q2R (value f a) - Q2R (value f b)) * toR v i = Q2R (value f a) * toR b i - Q2R (value f
    b) * toR a i.
Proof.
  unfold zero_between. set (s := qdiv _ _). set (w := map red _). intros H i.
  destruct (qle 0 s && qle s 1 && Qeq_bool (value f w) 0 && same w (middle s a b)) eqn:E;
    [|discriminate]. injection H as <-.
  rewrite !andb_true_iff in E. destruct E as [[_ Z] E]. apply Qeq_bool_eq, Qeq_eqR in Z.
  rewrite R0, value_R in Z.
  pose proof (same_toR _ _ E) as S. rewrite (dotR_ext _ (toR w) (fun j =>
    (1 - Q2R s) * toR a j + Q2R s * toR b j)) in Z
    by (intros; rewrite S; apply middle_R).
  rewrite (dotR_plus _ (fun j => (1 - Q2R s) * toR a j)), !dotR_mult in Z.
  rewrite S, middle_R, !value_R. set (A := dotR (fst f) (toR a)) in *.
  set (B := dotR (fst f) (toR b)) in *.
  assert (K : Q2R s * (A - B) = A + Q2R (snd f)) by lra.
  replace ((A + Q2R (snd f) - (B + Q2R (snd f))) * ((1 - Q2R s) * toR a i + Q2R s * toR b i))
    with ((A - B) * toR a i + (Q2R s * (A - B)) * (toR b i - toR a i)) by ring.
  rewrite K. ring.
Qed.
Lemma zeros_R f pm : forall l, zeros f pm = Some l -> forall p m, In (p, m) pm ->
  exists v, In v l /\ zero_between f p m = Some v.
Proof.
  induction pm as [|[p' m'] pm IH]; intros l H p m Hin; [destruct Hin|]. cbn [zeros] in H.
  destruct (zero_between f p' m') as [v|] eqn:E; [|discriminate]. destruct (zeros f pm) as [l'|];
    [|discriminate].
  injection H as <-. destruct Hin as [[= -> ->]|Hin].
  - exists v. simpl. auto.
  - destruct (IH l' eq_refl p m Hin) as (u & ? & ?). exists u. simpl. auto.
Qed.
Lemma split_layer_cover Z : forall V x, cone V x 1 -> exists b W, In (b, W) (split_layer Z V) /\
  cone W x 1.
Proof.
  induction Z as [|f Z IH]; intros V x H; [exists [], V; simpl; auto|]. cbn [split_layer].
  assert (G : forall b W, cone W x 1 -> exists c U, In (c, U) (map (fun c => (b :: fst c, snd c))
    (split_layer Z W)) /\ cone U x 1).
  { intros b W HW. destruct (IH W x HW) as (c & U & Hin & HU). exists (b :: c), U.
    split; [|exact HU].
    apply in_map_iff. exists (c, U). auto. }
  destruct (forallb _ V); [apply G; exact H|]. destruct (forallb _ V); [apply G; exact H|].
  destruct (zeros f (list_prod (above f V) (under f V))) as [l|] eqn:E; [|exists [], V;
    simpl; auto].
  set (a := dotR (fst f) x + Q2R (snd f) * 1).
  destruct (Rle_dec 0 a) as [L|L].
  - destruct (G true (above f V ++ ends l)) as (c & U & Hin & HU); [|exists c, U; split;
      [apply in_or_app; auto|exact HU]].
    apply (cut (fst f) (Q2R (snd f)) (above f V) (filter (fun v => qlt (value f v) 0) V) (ends l))
      with (V := V); auto.
    + intros v Hv. apply filter_In in Hv as [_ Hv]. apply R_le in Hv. rewrite R0, value_R in Hv.
      lra.
    + intros v Hv. apply filter_In in Hv as [_ Hv]. apply R_lt in Hv. rewrite R0, value_R in Hv.
      lra.
    + intros p m Hp Hm. apply filter_In in Hm as [Hm1 Hm2].
      assert (Hm : In m (under f V)). { apply filter_In. split; [exact Hm1|]. apply le_complete.
        apply R_lt in Hm2. lra. }
      destruct (zeros_R f _ l E p m) as (z & Hz & Ez); [apply in_prod; assumption|].
      exists (toR z). split; [apply ends_R; exact Hz|]. intro i. rewrite !Rmult_1_r, <- !value_R.
      apply zero_between_R. exact Ez.
    + intros v Hv. destruct (qle 0 (value f v)) eqn:S.
      * left. apply filter_In. auto.
      * right. apply filter_In. split; [exact Hv|]. unfold qlt. unfold qle in S. rewrite S.
        reflexivity.
  - destruct (G false (under f V ++ ends l)) as (c & U & Hin & HU); [|exists c, U; split;
      [apply in_or_app; auto|exact HU]].
    assert (Ng : forall v, dotR (fst (aneg f)) (toR v) + Q2R (snd (aneg f)) * 1 = - Q2R
      (value f v)).
    { intro v. rewrite value_R. pose proof (affR_neg f (toR v)) as A. unfold affR in A. lra. }
    apply (cut (fst (aneg f)) (Q2R (snd (aneg f))) (under f V) (filter (fun v =>
      qlt 0 (value f v)) V) (ends l)) with (V := V); auto.
    + intros v Hv. apply filter_In in Hv as [_ Hv]. apply R_le in Hv. rewrite R0 in Hv.
      rewrite Ng. lra.
    + intros v Hv. apply filter_In in Hv as [_ Hv]. apply R_lt in Hv. rewrite R0 in Hv.
      rewrite Ng. lra.
    + intros p m Hp Hm. apply filter_In in Hm as [Hm1 Hm2].
      assert (Hm : In m (above f V)). { apply filter_In. split; [exact Hm1|]. apply le_complete.
        apply R_lt in Hm2. lra. }
      destruct (zeros_R f _ l E m p) as (z & Hz & Ez); [apply in_prod; assumption|].
      exists (toR z). split; [apply ends_R; exact Hz|]. intro i. rewrite !Ng.
      pose proof (zero_between_R _ _ _ _ Ez i). lra.
    + intros v Hv. destruct (qle (value f v) 0) eqn:S.
      * left. apply filter_In. auto.
      * right. apply filter_In. split; [exact Hv|]. unfold qlt. unfold qle in S. rewrite S.
        reflexivity.
    + pose proof (affR_neg f x) as A. unfold affR in A. unfold a in L. lra.
Qed.
Lemma split_net_cover Ls : forall X V x, cone V x 1 -> exists b W, In (b, W) (split_net Ls X V) /\
  cone W x 1.
Proof.
  induction Ls as [|L Ls IH]; intros X V x H; [exists [], V; simpl; auto|]. cbn [split_net].
  destruct Ls as [|L' Ls]; [exists [], V; simpl; auto|].
  destruct (split_layer_cover (layerA L X) V x H) as (b & W & Hin & HW).
  destruct (IH (passA b (layerA L X)) W x HW) as (c & U & Hc & HU).
  exists (b :: c), U. split; [|exact HU]. apply in_flat_map. exists (b, W). split; [exact Hin|].
  apply in_map_iff. exists (c, U). auto.
Qed.
Definition cut_off (n : nat) (x : rv) : rv := fun i => if (i <? n)%nat then x i else 0.
Lemma cone_cons V a : forall x w, cone V x w -> forall W, (forall v, In v V -> In (a :: v) W) ->
  cone W (fun i => match i with O => Q2R a * w | S j => x j end) w.
Proof.
  intros x w H W S. induction H as [x w Z E|v l x w y w' Hv Hl H IH Hy E].
  - apply cone_none; [|exact E]. intros [|i]; [rewrite E; ring|apply Z].
  - apply (cone_more W (a :: v) l _ w _ w' (S v Hv) Hl IH); [|exact E]. intros [|i]; unfold toR;
      simpl; [rewrite E; ring|apply Hy].
Qed.
Lemma corners_R D : forall x, inBox D x -> cone (corners_of D) (cut_off (length D) x) 1.
Proof.
  induction D as [|[lo hi] D IH]; intros x H.
  - apply (cone_ext _ (toR []) 1); [apply cone_one; simpl; auto|intro i; apply toR_nil|reflexivity].
  - destruct H as [[A B] H]. specialize (IH _ H). cbn [corners_of].
    set (W := flat_map (fun v => [lo :: v; hi :: v]) (corners_of D)).
    assert (K : forall a, a = lo \/ a = hi -> forall v, In v (corners_of D) -> In (a :: v) W).
    { intros a Ha v Hv. apply in_flat_map. exists v. split; [exact Hv|]. simpl. destruct Ha as [->
        | ->]; auto. }
    pose proof (cone_cons _ lo _ _ IH W (K lo (or_introl eq_refl))) as C1.
    pose proof (cone_cons _ hi _ _ IH W (K hi (or_intror eq_refl))) as C2.
    assert (exists s, 0 <= s <= 1 /\ x O = (1 - s) * Q2R lo + s * Q2R hi) as (s & Hs & E).
    { destruct (Rlt_dec (Q2R lo) (Q2R hi)) as [L|L].
      - exists ((x O - Q2R lo) / (Q2R hi - Q2R lo)). split; [split|field; lra].
        + apply Rmult_le_pos; [lra|]. left. apply Rinv_0_lt_compat. lra.
        + apply (Rmult_le_reg_r (Q2R hi - Q2R lo)); [lra|]. unfold Rdiv.
          rewrite Rmult_assoc, Rinv_l; lra.
      - exists 0. split; lra. }
    apply (cone_ext _ _ _ _ _ (cone_add _ _ _ _ _ (cone_scale _ (1 - s) _ _ ltac:(lra) C1)
      (cone_scale _ s _ _ ltac:(lra) C2))); [|ring].
    intros [|i]; unfold cut_off; simpl; [rewrite E; ring|]. unfold shift.
    change (S i <? S (length D))%nat with (i <? length D)%nat. destruct (i <? length D)%nat; ring.
Qed.

(* ---- Rows at the points of a cell hold in its hull, with room for p0 ---- *)
Lemma dotR_split n : forall c y, dotR c y = dotR (firstn n c) y + dotR (skipn n c) (fun i =>
  y (n + i)%nat).
Proof.
  induction n as [|n IH]; intros c y; [simpl; rewrite Rplus_0_l; apply dotR_ext; auto|].
  destruct c as [|a c]; simpl; [lra|]. rewrite (IH c (shift y)). unfold shift.
  rewrite <- Rplus_assoc. reflexivity.
Qed.
Lemma roomy_R n p d V r (y : rv) : (forall i, (i < n)%nat -> Rabs (y i - toR p i) <= toR d i) ->
  cone V (fun i => y (n + i)%nat) 1 -> (forall v, In v V -> roomy n p d v r = true) -> rowR y r.
Proof.
  intros Hy HV Hr. destruct r as [st [c e]]. unfold rowR, affR. cbn [fst snd].
  rewrite (dotR_split n c y).
  set (a := firstn n c) in *. set (b := skipn n c) in *.
  assert (D : dotR a (toR p) - dotR (vabs a) (toR d) <= dotR a y).
  { pose proof (dot_abs a (fun i => y i + -1 * toR p i) (toR d)) as D.
    rewrite (dotR_plus a y), dotR_mult in D.
    assert (Rabs (dotR a y + -1 * dotR a (toR p)) <= dotR (vabs a) (toR d)) as D'.
    { apply D. intros i Hi. replace (y i + -1 * toR p i) with (y i - toR p i) by ring. apply Hy.
      unfold a in Hi. rewrite firstn_length in Hi. lia. }
    pose proof (Rle_abs (- (dotR a y + -1 * dotR a (toR p)))) as G. rewrite Rabs_Ropp in G. lra. }
  set (A := dotR a (toR p) - dotR (vabs a) (toR d) + Q2R e).
  assert (E : forall v, In v V -> if st then 0 < A + dotR b (toR v) else 0 <= A + dotR b (toR v)).
  { intros v Hv. specialize (Hr v Hv). unfold roomy in Hr. cbn [fst snd] in Hr.
    fold a b in Hr. unfold A.
    destruct st; [apply R_lt in Hr|apply R_le in Hr]; rewrite R0, !R_add, Q2R_opp, !dotQ_R
      in Hr; lra. }
  destruct st.
  - pose proof (cone_strict V A b _ 1 HV ltac:(lra) E). unfold A in *. lra.
  - pose proof (cone_positive V A b _ 1 HV E). unfold A in *. lra.
Qed.

(* ---- The theorem ---- *)
Lemma within_R A : forall B, within A B = true -> length A = length B /\
  forall x, inBox A x -> inBox B x.
Proof.
  induction A as [|[a b] A IH]; intros [|[c d] B] H; simpl in H; try discriminate; [auto|].
  rewrite !andb_true_iff in H. destruct H as [[[X Y] Z] H]. destruct (IH B H) as [L K].
  apply R_le in X, Y, Z.
  split; [simpl; lia|]. intros x [[X1 X2] Hx]. simpl. split; [lra|auto].
Qed.
Lemma meets_R A : forall B x, length A = length B -> inBox A x -> inBox B x -> meets A B = true.
Proof.
  induction A as [|[a b] A IH]; intros [|[c d] B] x L HA HB; simpl in *; try discriminate;
    [reflexivity|].
  destruct HA as [[A1 A2] HA], HB as [[B1 B2] HB]. rewrite !andb_true_iff.
  repeat split; try (apply le_complete; lra).
  apply (IH B (shift x)); auto.
Qed.
(* Every execution within the room for p0 and the box of k is safe: executions are (u, x), both
   real. *)
Theorem box_safe P N E H s : context_ok P N E = true -> check_box P N E H s = true ->
  forall u x, (forall i, (i < n_p P)%nat -> Rabs (u i - toR (middle_p0 s) i) <= toR
    (room_p0 s) i) ->
  inBox (region s) x -> inBox (domain P) x /\ safe P N E u x.
Proof.
  intros HC HK u x Hu Hx. apply andb_prop in HC as [HP HE]. unfold check_box in HK.
  rewrite !andb_true_iff in HK.
  destruct HK as ((((_ & _) & Hw) & Hs) & HK). pose proof (problem_inv _ _ HP) as SP.
  destruct (within_R _ _ Hw) as [Lr Hd]. specialize (Hd x Hx). split; [exact Hd|].
  pose proof (domain_size _ _ SP) as Ld.
  pose proof (corners_R _ x Hx) as HV. rewrite Lr, Ld in HV.
  destruct (split_net_cover N (map unit_form (seq 0 (n_k P))) _ _ HV) as (bits & V & Hin & HC).
  clear HV.
  eapply forallb_forall in HK; [|exact Hin]. cbn [fst snd] in HK. apply andb_prop in HK as [Hb HK].
  destruct (netA N bits (map unit_form (seq (n_p P) (n_k P)))) as [r Y] eqn:En.
  apply andb_prop in HK as [HR HB].
  set (y := fun i => if (i <? n_p P)%nat then u i else cut_off (n_k P) x (i - n_p P)%nat).
  assert (Hyu : forall i, (i < n_p P)%nat -> y i = u i).
  { intros i Hi. unfold y. destruct (Nat.ltb_spec i (n_p P)); [reflexivity|lia]. }
  assert (Hyk : forall i, y (n_p P + i)%nat = cut_off (n_k P) x i).
  { intro i. unfold y. destruct (Nat.ltb_spec (n_p P + i) (n_p P)); [lia|]. f_equal. lia. }
  assert (Hrow : forall q, (forall v, In v V -> roomy (n_p P) (middle_p0 s) (room_p0 s) v q = true)
    -> rowR y q).
  { intros q Hq. apply (roomy_R (n_p P) (middle_p0 s) (room_p0 s) V); auto.
    - intros i Hi. rewrite Hyu by exact Hi. apply Hu. exact Hi.
    - apply (cone_ext V _ 1 _ 1 HC); [|reflexivity]. intro i. symmetry. apply Hyk. }
  assert (A : (forall i, at_forms Y y i = netR N x i) /\ length Y = outputs P).
  { pose proof (netA_R N bits (map unit_form (seq (n_p P) (n_k P))) y x (n_k P) _ Hb (net_sizes _
      _ SP)) as A.
    rewrite En in A. apply A.
    - intros i Hi. rewrite at_units by exact Hi. rewrite Hyk. unfold cut_off.
      destruct (Nat.ltb_spec i (n_k P)); [reflexivity|lia].
    - intros q Hq. apply Hrow. intros v Hv. eapply forallb_forall in HR; [|exact Hv].
      eapply forallb_forall in HR; [|exact Hq]. exact HR. }
  destruct A as [HY LY].
  assert (HR' : forall B h, In (B, h) (hinted E H) -> inBox (box B) x ->
    conditionsR P (dirs_of P (boxed_sep s)) B h u (netR N x)).
  { intros B h HBh HBx. eapply forallb_forall in HB.
    2: { apply filter_In. split; [exact HBh|]. cbn [fst]. apply (meets_R _ _ x);
      auto. apply in_combine_l, zip3_box, boxes_len in HBh.
         apply tube_inv in HE as (C & _). apply covers_len in C. congruence. }
    cbn [fst snd] in HB.
    apply (conditions_R P N (map unit_form (seq 0 (n_p P))) Y y); auto.
    - intros i Hi. rewrite at_units by exact Hi. apply Hyu. exact Hi.
    - rewrite map_length, seq_length. reflexivity.
    - intros q Hq. apply Hrow. intros v Hv. eapply forallb_forall in HB; [|exact Hv].
      eapply forallb_forall in HB; [|exact Hq]. exact HB.
    - intros b d w g t Hbd Hd'. eapply dirs_valid; eauto. }
  destruct (every_k_has_a_bin P E x HE Hd) as (B0 & I0 & X0). split; [|split; [eauto|]].
  - destruct (hinted_ex E H B0 I0) as [h Hh]. apply (HR' B0 h Hh X0).
  - intros B HBin Hbx. destruct (hinted_ex E H B HBin) as [h Hh].
    apply (conditions_succeed P N (boxed_sep s) B h u x HP Hs). apply HR'; assumption.
Qed.
