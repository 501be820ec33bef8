(* What each leaf of a proof shows about every plan of its box. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts SeparationFacts BinFacts ConditionFacts Doubt DoubtFacts.
Require Import NoPlan Trajectories HullFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Rows at the points of a hull hold in it ---- *)
Lemma hull_row V x r : cone V x 1 -> (forall v, In v V -> holdsQ v r = true) -> rowR x r.
Proof.
  intros H S. destruct r as [st [c d]]. unfold rowR, affR. cbn [fst snd].
  assert (E : forall v, In v V -> if st then 0 < Q2R d + dotR c (toR v) else 0 <= Q2R d + dotR c (toR v)).
  { intros v Hv. pose proof (holds_R _ _ (S v Hv)) as K. unfold rowR, affR in K. cbn [fst snd] in K. destruct st; lra. }
  destruct st; [pose proof (cone_strict V (Q2R d) c x 1 H ltac:(lra) E)|pose proof (cone_positive V (Q2R d) c x 1 H E)]; lra.
Qed.
Lemma not_in_poly A x : ~ inPoly A x -> exists a b, In (a, b) A /\ Q2R b < dotR a x.
Proof.
  induction A as [|[a b] A IH]; intro H; [exfalso; apply H; intros a b []|].
  destruct (Rlt_dec (Q2R b) (dotR a x)) as [L|L]; [exists a, b; simpl; auto|].
  destruct IH as (a' & b' & Hin & HL).
  - intro K. apply H. intros a' b' [[= <- <-]|Hin]; [lra|apply K; exact Hin].
  - exists a', b'. simpl. auto.
Qed.
Lemma combination_fails A m x : fits A m = true -> Q2R (snd (combine_rows A m)) < dotR (fst (combine_rows A m)) x -> ~ inPoly A x.
Proof. unfold fits. rewrite andb_true_iff. intros [Hm _] H K. pose proof (combine_R A m Hm x K). lra. Qed.

(* ---- The frame: u and the outputs of k are forms in z and in what the last hidden layer holds ---- *)
Section Frame.
Variables (P : problem) (N : list layer).
Hypothesis SP : sizes P N.
Variables (u k : rv).
Let kk := cut_off (n_k P) k.
Let xx := join (n_p P) (endR P u (netR N k)) (stateR N kk).

Lemma join_low n x y i : (i < n)%nat -> join n x y i = x i.
Proof. intro H. unfold join. destruct (Nat.ltb_spec i n); [reflexivity|lia]. Qed.
Lemma join_high n x y i : join n x y (n + i)%nat = y i.
Proof. unfold join. destruct (Nat.ltb_spec (n + i) n); [lia|]. f_equal. lia. Qed.
Lemma outs_R : (forall i, at_forms (outs (frame_of P N)) xx i = netR N k i) /\ length (outs (frame_of P N)) = outputs P.
Proof.
  destruct (last_layer_ok N _ _ (net_sizes _ _ SP)) as (w & Hw & Lo). simpl outs. split.
  - intro i. rewrite (net_inputs N _ _ k kk (net_sizes _ _ SP)).
    2: { intros j Hj. unfold kk, cut_off. destruct (Nat.ltb_spec j (n_k P)); [reflexivity|lia]. }
    rewrite state_net by (intro E; pose proof (net_sizes _ _ SP) as K; rewrite E in K; discriminate).
    destruct (last_layer N) as [|[a b] L] eqn:E.
    + unfold at_forms, layerR. destruct i; simpl; rewrite affR_const; apply R0.
    + assert (W : width_in N = w).
      { unfold width_in. rewrite E. simpl in Hw. apply andb_prop in Hw as [Hw _]. apply Nat.eqb_eq. exact Hw. }
      rewrite <- W in Hw. apply (layerA_R _ _ _ _ _ Hw). intros j Hj. rewrite at_units by exact Hj. apply join_high.
  - unfold layerA. rewrite map_length. exact Lo.
Qed.
Lemma start_R : (forall i, (i < n_p P)%nat -> at_forms (start_ (frame_of P N)) xx i = u i) /\ length (start_ (frame_of P N)) = n_p P.
Proof.
  destruct outs_R as [HY LY]. split; [|simpl; rewrite map_length, seq_length; reflexivity].
  intros i Hi. unfold frame_of, start_. simpl in HY, LY. set (Y := layerA _ _) in *. unfold at_forms.
  set (f := fun a => _). rewrite (nth_indep _ _ (f O)) by (rewrite map_length, seq_length; exact Hi).
  rewrite map_nth, seq_nth by exact Hi. subst f. cbv beta. simpl Nat.add. rewrite affR_add, affR_neg, unit_R.
  unfold xx at 1. rewrite join_low by exact Hi.
  pose proof (padded_R P N (map unit_form (seq 0 (n_p P))) Y xx (netR N k) SP ltac:(intros; apply HY)
    ltac:(rewrite map_length, seq_length; reflexivity) LY (steps P * (n_points P * n_p P) + i)) as K.
  unfold at_forms in K. pose proof (some_point _ _ SP). rewrite K.
  2: { assert (n_p P <= n_points P * n_p P)%nat; [|simpl; lia]. rewrite <- (Nat.mul_1_l (n_p P)) at 1. apply Nat.mul_le_mono_r. lia. }
  unfold endR. destruct (Nat.ltb_spec i (n_points P * n_p P)) as [C|C]; [rewrite Nat.mod_small by exact Hi; ring|].
  exfalso. assert (n_p P <= n_points P * n_p P)%nat; [|lia]. rewrite <- (Nat.mul_1_l (n_p P)) at 1. apply Nat.mul_le_mono_r. lia.
Qed.
Lemma knots_R t i : (t <= steps P)%nat -> (i < n_points P)%nat ->
  length (nth (t * n_points P + i) (knots (frame_of P N)) []) = n_p P /\ forall a, (a < n_p P)%nat ->
  at_forms (nth (t * n_points P + i) (knots (frame_of P N)) []) xx a = knotR P u (netR N k) t i a.
Proof.
  intros Ht Hi. destruct outs_R as [HY LY]. destruct start_R as [HX LX].
  assert (HY' : forall j, (j < outputs P)%nat -> at_forms (outs (frame_of P N)) xx j = netR N k j) by (intros; apply HY).
  split; [|intros a Ha; apply (knot_R P N _ _ xx u (netR N k) SP HX HY' LX LY t i Ht Hi a Ha)].
  apply (places_R P N _ _ xx u (netR N k) SP HX HY' LX LY). assert (t * n_points P <= steps P * n_points P)%nat by (apply Nat.mul_le_mono_r; lia).
  simpl. lia.
Qed.
Lemma ends_R' j : (j < n_points P * n_p P + n_q P)%nat -> at_forms (ends_ (frame_of P N)) xx j = endR P u (netR N k) j.
Proof.
  destruct outs_R as [HY LY]. destruct start_R as [HX LX].
  apply (end_R P N _ _ xx u (netR N k) SP HX ltac:(intros; apply HY) LX LY).
Qed.

(* ---- The hulls cover the leaf ---- *)
Lemma everywhere_R cs Z test : everywhere cs Z test = true -> forall ok W, In (ok, W) cs ->
  ok = true /\ forall v, In v (product (corners_of Z) W) -> test v = true.
Proof.
  intros H ok W Hin. eapply forallb_forall in H; [|exact Hin]. cbn [fst snd] in H. apply andb_prop in H as [-> H].
  split; [reflexivity|]. intros v Hv. apply in_flat_map in Hv as (y & Hy & Hv). apply in_map_iff in Hv as (z & <- & Hz).
  eapply forallb_forall in H; [|exact Hy]. eapply forallb_forall in H; [|exact Hz]. exact H.
Qed.
Lemma leaf_hull Z D test : length Z = n_p P -> length D = n_k P -> inBox Z (endR P u (netR N k)) -> inBox D k ->
  everywhere (cells_in N D) Z test = true -> exists V, cone V xx 1 /\ forall v, In v V -> test v = true.
Proof.
  intros LZ LD HZ HD HE. pose proof (corners_R _ _ HD) as CD. rewrite LD in CD. fold kk in CD.
  destruct (hidden_cover N _ _ CD) as (ok & W & Hin & HW). destruct (everywhere_R _ _ _ HE ok W Hin) as [-> HT].
  exists (product (corners_of Z) W). split; [|exact HT]. pose proof (corners_R _ _ HZ) as CZ.
  pose proof (cone_product (n_p P) (corners_of Z) W _ ltac:(intros v Hv; rewrite (corners_len _ _ Hv); exact LZ) CZ _ 1 (HW eq_refl)) as C.
  apply (cone_ext _ _ _ _ _ C); [|reflexivity]. intro i. unfold xx, join. destruct (Nat.ltb_spec i (n_p P)) as [L|L]; [|reflexivity].
  unfold cut_off. rewrite LZ. destruct (Nat.ltb_spec i (n_p P)); [ring|lia].
Qed.

(* ---- A missed goal ---- *)
Lemma vmin_l u' : forall v i, (i < length u')%nat -> toR (vmin u' v) i <= toR u' i.
Proof.
  unfold toR. induction u' as [|a u' IH]; intros [|b v] [|i] H; simpl in *; try lia; try lra; [|apply IH; lia].
  destruct (qle a b) eqn:E; [lra|apply R_nle in E; lra].
Qed.
Lemma vmin_r u' : forall v i, (i < length v)%nat -> toR (vmin u' v) i <= toR v i.
Proof.
  unfold toR. induction u' as [|a u' IH]; intros [|b v] [|i] H; simpl in *; try lia; try lra; [|apply IH; lia].
  destruct (qle a b) eqn:E; [apply R_le in E; lra|lra].
Qed.
Lemma vmin_pos u' : forall v, (forall i, 0 <= toR u' i) -> (forall i, 0 <= toR v i) -> forall i, 0 <= toR (vmin u' v) i.
Proof.
  unfold toR. induction u' as [|a u' IH]; intros [|b v] HU HV i; simpl; [apply HV|apply HV|apply HU|].
  pose proof (HU O) as A. pose proof (HV O) as B. simpl in A, B. destruct i as [|i]; [destruct (qle a b); assumption|].
  apply (IH v); [intro j; apply (HU (S j))|intro j; apply (HV (S j))].
Qed.
Lemma vmin_len u' : forall v, length (vmin u' v) = Nat.max (length u') (length v).
Proof. induction u'; intros [|b v]; simpl; auto. Qed.
Lemma least_R' l n : (forall v, In v l -> length v = n) -> forall v, In v l -> forall i, toR (least_of l) i <= toR v i.
Proof.
  intros HL v Hv i.
  assert (G : (i < n)%nat -> toR (least_of l) i <= toR v i /\ length (least_of l) = n).
  { intro Hi. revert v Hv. induction l as [|a l IH]; intros v Hv; [destruct Hv|].
    destruct l as [|b l]; [destruct Hv as [<-|[]]; simpl; split; [lra|apply HL; simpl; auto]|].
    destruct (IH (fun v Hv => HL v (or_intror Hv)) b (or_introl eq_refl)) as [_ Lb].
    change (least_of (a :: b :: l)) with (vmin a (least_of (b :: l))).
    assert (La : length a = n) by (apply HL; simpl; auto).
    split; [|rewrite vmin_len; lia]. destruct Hv as [<-|Hv]; [apply vmin_l; lia|].
    eapply Rle_trans; [apply vmin_r; lia|]. apply IH; [intros; apply HL; simpl; auto|exact Hv]. }
  destruct (Nat.lt_ge_cases i n) as [C|C]; [apply G; exact C|].
  assert (L : (length (least_of l) <= n)%nat).
  { clear G Hv v. induction l as [|a l IH]; [simpl; lia|]. destruct l as [|b l]; [simpl; rewrite (HL a) by (simpl; auto); lia|].
    change (least_of (a :: b :: l)) with (vmin a (least_of (b :: l))). rewrite vmin_len, (HL a) by (simpl; auto).
    specialize (IH (fun v Hv => HL v (or_intror Hv))). lia. }
  unfold toR. rewrite !nth_overflow by (rewrite ?(HL v Hv); lia). lra.
Qed.
Lemma least_pos l : (forall v, In v l -> forall i, 0 <= toR v i) -> forall i, 0 <= toR (least_of l) i.
Proof.
  induction l as [|a l IH]; intros H i; [rewrite toR_nil; lra|]. destruct l as [|b l]; [apply H; simpl; auto|].
  apply vmin_pos; [apply H; simpl; auto|]. apply IH. intros; apply H; simpl; auto.
Qed.
Definition extreme_error (a : vec) (e : rv) : rv := fun i => if Rle_dec 0 (toR a i) then e i else - e i.
Lemma extreme_R a : forall e, dotR a (extreme_error a e) = dotR (vabs a) e.
Proof.
  induction a as [|c a IH]; intro e; [reflexivity|]. cbn [dotR vabs map].
  change (shift (extreme_error (c :: a) e)) with (extreme_error a (shift e)). rewrite IH. f_equal. rewrite R_abs.
  unfold extreme_error, toR. simpl. destruct (Rle_dec 0 (Q2R c)); [rewrite Rabs_right by lra; ring|rewrite Rabs_left1 by lra; ring].
Qed.
Lemma extreme_abs a e i : 0 <= e i -> Rabs (extreme_error a e i) <= e i.
Proof. intro H. unfold extreme_error. destruct (Rle_dec _ _); [rewrite Rabs_right by lra|rewrite Rabs_Ropp, Rabs_right by lra]; lra. Qed.
Lemma shrunk_fails e A y : ~ inPoly (shrunk e A) y -> exists a b, In (a, b) A /\ Q2R b < dotR a (fun j => y j + extreme_error a (toR e) j).
Proof.
  intro H. destruct (not_in_poly _ _ H) as (a & b & Hin & L). apply in_map_iff in Hin as ([a' b'] & [= <- <-] & Hin).
  exists a', b'. split; [exact Hin|]. cbn [fst snd] in L. rewrite R_add, Q2R_opp, dotQ_R in L. rewrite dotR_plus, extreme_R. lra.
Qed.
Lemma combine_shrunk_fits e A m : fits A m = true -> fits (shrunk e A) m = true.
Proof. unfold fits, shrunk. rewrite map_length. auto. Qed.

Lemma end_widths_R B : wide_bin P B -> length (end_widths P B) = (n_points P * n_p P + n_q P)%nat /\
  (forall j, 0 <= toR (end_widths P B) j) /\
  (forall j, (j < n_points P * n_p P + n_q P)%nat -> toR (end_widths P B) j <= toR (width (final B)) j) /\
  (forall j, (j < n_points P * n_p P)%nat -> toR (end_widths P B) j <=
     toR (width (nth (j / n_p P) (nth (steps P - 1) (interval B) []) (Rows []))) (j mod n_p P)%nat).
Proof.
  intros HW. destruct (end_width _ _ HW) as (w & E & Lw & W0). pose proof (some_step _ _ SP) as ST. pose proof (some_axis _ _ SP) as SA.
  set (l := map width (nth (steps P - 1) (interval B) [])).
  assert (Ll : length l = n_points P) by (unfold l; rewrite map_length; apply (all_points _ _ HW); lia).
  assert (Ll' : @length (list Q) l = n_points P) by exact Ll.
  assert (Hl : forall i, (i < n_points P)%nat -> length (nth i l []) = n_p P /\ forall a, 0 <= toR (nth i l []) a).
  { intros i Hi. destruct (all_widths _ _ HW (steps P - 1)%nat i ltac:(lia) Hi) as (v & Ev & Lv & V0).
    unfold l. change (@nil Q) with (width (Rows [])). rewrite map_nth, Ev. simpl. auto. }
  assert (Hv : forall v, In v l -> length v = n_p P /\ forall a, 0 <= toR v a).
  { intros v Hv. apply (In_nth _ _ []) in Hv as (i & Hi & <-). apply Hl. rewrite <- Ll. exact Hi. }
  assert (Lc : length (concat l) = (n_points P * n_p P)%nat) by (rewrite (concat_len (n_p P)); [rewrite Ll'; reflexivity|apply Hv]).
  unfold end_widths. fold l. rewrite E. simpl width. split; [rewrite vmin_len; lia|]. split; [|split].
  - apply vmin_pos; [|exact W0]. intro j. unfold toR. destruct (Nat.lt_ge_cases j (length (concat l))) as [C|C].
    + rewrite (nth_concat _ (n_p P)) by (try apply Hv; try exact SA; rewrite Ll'; lia). apply Hl. apply Nat.div_lt_upper_bound; lia.
    + rewrite nth_overflow, R0 by exact C. lra.
  - intros j Hj. apply vmin_r. lia.
  - intros j Hj. eapply Rle_trans; [apply vmin_l; lia|]. unfold toR.
    rewrite (nth_concat _ (n_p P)) by (try apply Hv; try exact SA; rewrite Ll'; lia).
    unfold l. change (@nil Q) with (width (Rows [])). rewrite map_nth. simpl. lra.
Qed.

(* The end misses the goal if it does so by more than the widths of its bin. *)
Lemma goal_missed B bs : wide_bin P B -> In B bs -> (forall C, In C bs -> wide_bin P C) ->
  ~ inPoly (goal_rows_of P bs) (endR P u (netR N k)) ->
  exists tau, in_tube P N B u k tau /\ continuous tau /\ misses P tau.
Proof.
  intros HB Hin Hbs HG. destruct (shrunk_fails _ _ _ HG) as (a & b & Hab & L). clear HG.
  pose proof (some_axis _ _ SP) as SA. pose proof (some_step _ _ SP) as ST.
  set (e := least_of (map (end_widths P) bs)) in *.
  assert (He : forall j, toR e j <= toR (end_widths P B) j).
  { apply (least_R' _ (n_points P * n_p P + n_q P)); [|apply in_map; exact Hin].
    intros v Hv. apply in_map_iff in Hv as (C & <- & HC). apply end_widths_R. apply Hbs. exact HC. }
  assert (He0 : forall j, 0 <= toR e j).
  { apply least_pos. intros v Hv. apply in_map_iff in Hv as (C & <- & HC). apply end_widths_R. apply Hbs. exact HC. }
  destruct (end_widths_R B HB) as (_ & _ & Hf & Hi).
  set (x := extreme_error a (toR e)) in *.
  assert (Hx : forall j, Rabs (x j) <= toR (end_widths P B) j).
  { intro j. eapply Rle_trans; [apply extreme_abs, He0|apply He]. }
  set (tau := nudged P u (netR N k) (INR (steps P)) 1 (fun i c => x (i * n_p P + c)%nat)
                (fun j => x (n_points P * n_p P + j)%nat)).
  exists tau. split; [|split; [apply nudged_continuous|]].
  - apply nudged_in_tube; auto; [lra| | |].
    + intros t s i c Ht Hi' Hc Hs. destruct (Nat.eq_dec t (steps P - 1)) as [->|Nt].
      * right. eapply Rle_trans; [apply Hx|].
        assert (Hj : (i * n_p P + c < n_points P * n_p P)%nat).
        { assert (S i * n_p P <= n_points P * n_p P)%nat by (apply Nat.mul_le_mono_r; lia). simpl in *. lia. }
        specialize (Hi _ Hj). replace ((i * n_p P + c) / n_p P)%nat with i in Hi.
        2: { rewrite Nat.add_comm, Nat.div_add by lia. rewrite Nat.div_small by exact Hc. reflexivity. }
        replace ((i * n_p P + c) mod n_p P)%nat with c in Hi; [exact Hi|].
        rewrite Nat.add_comm, Nat.mod_add by lia. rewrite Nat.mod_small by exact Hc. reflexivity.
      * left. assert (INR (S (S t)) <= INR (steps P)) as LT by (apply le_INR; lia). rewrite !S_INR in LT.
        rewrite Rabs_left1 by lra. lra.
    + intros j Hj. right. replace (j / n_p P * n_p P + j mod n_p P)%nat with j.
      * eapply Rle_trans; [apply Hx|apply Hf; lia].
      * pose proof (Nat.div_mod j (n_p P) ltac:(lia)). lia.
    + intros j Hj. replace (n_points P * n_p P + (j - n_points P * n_p P))%nat with j by lia.
      eapply Rle_trans; [apply Hx|apply Hf; lia].
  - intro K. specialize (K a b Hab). rewrite (dotR_ext a _ (fun j => endR P u (netR N k) j + x j)) in K; [lra|].
    intros j Hj. pose proof (poly_len _ _ _ _ (goal_rows _ _ SP) Hab) as La. unfold tau. rewrite nudged_end by exact SA.
    destruct (Nat.ltb_spec j (n_points P * n_p P)) as [C|C]; f_equal.
    + rewrite bump_at, Rmult_1_l by lra. f_equal. pose proof (Nat.div_mod j (n_p P) ltac:(lia)). lia.
    + f_equal. lia.
Qed.
End Frame.
