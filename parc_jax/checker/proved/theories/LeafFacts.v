(* What each leaf of a proof shows about every plan of its box. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts SeparationFacts
  BinFacts ConditionFacts Doubt DoubtFacts ListFacts.
From ParcJax Require Import NoPlan Trajectories HullFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Rows at the points of a hull hold in it ---- *)
Lemma hull_row V x r : cone V x 1 -> (forall v, In v V -> holdsQ v r = true) -> rowR x r.
Proof.
  intros H S. destruct r as [st [c d]]. unfold rowR, affR. cbn [fst snd].
  assert (E : forall v, In v V -> if st then 0 < Q2R d + dotR c (toR v) else 0 <= Q2R d
    + dotR c (toR v)).
  { intros v Hv. pose proof (holds_R _ _ (S v Hv)) as K. unfold rowR, affR in K. cbn [fst snd] in K.
    destruct st; lra. }
  destruct st; [pose proof (cone_strict V (Q2R d) c x 1 H ltac:(lra) E)|pose proof (cone_positive V
    (Q2R d) c x 1 H E)]; lra.
Qed.
Lemma not_in_poly A x : ~ inPoly A x -> exists a b, In (a, b) A /\ Q2R b < dotR a x.
Proof.
  induction A as [|[a b] A IH]; intro H; [exfalso; apply H; intros a b []|].
  destruct (Rlt_dec (Q2R b) (dotR a x)) as [L|L]; [exists a, b; simpl; auto|].
  destruct IH as (a' & b' & Hin & HL).
  - intro K. apply H. intros a' b' [[= <- <-]|Hin]; [lra|apply K; exact Hin].
  - exists a', b'. simpl. auto.
Qed.
Lemma combination_fails A m x : fits A m = true -> Q2R (snd (combine_rows A m)) < dotR
  (fst (combine_rows A m)) x -> ~ inPoly A x.
Proof. unfold fits. rewrite andb_true_iff. intros [Hm _] H K. pose proof (combine_R A m Hm x K).
lra. Qed.

(* ---- The frame: u and the outputs of k are forms in z and in what the last hidden layer holds
   ---- *)
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
Lemma outs_R : (forall i, at_forms (outs (frame_of P N)) xx i = netR N k i) /\
  length (outs (frame_of P N)) = outputs P.
Proof.
  destruct (last_layer_ok N _ _ (net_sizes _ _ SP)) as (w & Hw & Lo). simpl outs. split.
  - intro i. rewrite (net_inputs N _ _ k kk (net_sizes _ _ SP)).
    2: { intros j Hj. unfold kk, cut_off. destruct (Nat.ltb_spec j (n_k P)); [reflexivity|lia]. }
    rewrite state_net by (intro E; pose proof (net_sizes _ _ SP) as K; rewrite E in K;
      discriminate).
    destruct (last_layer N) as [|[a b] L] eqn:E.
    + unfold at_forms, layerR. destruct i; simpl; rewrite affR_const; apply R0.
    + assert (W : width_in N = w).
      { unfold width_in. rewrite E. simpl in Hw. apply andb_prop in Hw as [Hw _].
        apply Nat.eqb_eq. exact Hw. }
      rewrite <- W in Hw. apply (layerA_R _ _ _ _ _ Hw). intros j Hj. rewrite at_units by exact Hj.
      apply join_high.
  - unfold layerA. rewrite map_length. exact Lo.
Qed.
Lemma start_R : (forall i, (i < n_p P)%nat -> at_forms (start_ (frame_of P N)) xx i = u i) /\
  length (start_ (frame_of P N)) = n_p P.
Proof.
  destruct outs_R as [HY LY]. split; [|simpl; rewrite map_length, seq_length; reflexivity].
  intros i Hi. unfold frame_of, start_. simpl in HY, LY. set (Y := layerA _ _) in *.
  unfold at_forms.
  set (f := fun a => _). rewrite (nth_indep _ _ (f O)) by (rewrite map_length,
    seq_length; exact Hi).
  rewrite map_nth, seq_nth by exact Hi. subst f. cbv beta. simpl Nat.add.
  rewrite affR_add, affR_neg, unit_R.
  unfold xx at 1. rewrite join_low by exact Hi.
  pose proof (padded_R P N (map unit_form (seq 0 (n_p P))) Y xx (netR N k) SP ltac:(intros;
    apply HY)
    ltac:(rewrite map_length, seq_length; reflexivity) LY (steps P * (n_points P * n_p P) + i))
      as K.
  unfold at_forms in K. pose proof (some_point _ _ SP). rewrite K.
  2: { assert (n_p P <= n_points P * n_p P)%nat; [|simpl; lia]. rewrite <- (Nat.mul_1_l (n_p P)) at
    1. apply Nat.mul_le_mono_r. lia. }
  unfold endR. destruct (Nat.ltb_spec i (n_points P * n_p P)) as [C|C]; [rewrite Nat.mod_small
    by exact Hi; ring|].
  exfalso. assert (n_p P <= n_points P * n_p P)%nat; [|lia]. rewrite <- (Nat.mul_1_l (n_p P)) at 1.
  apply Nat.mul_le_mono_r. lia.
Qed.
Lemma knots_R t i : (t <= steps P)%nat -> (i < n_points P)%nat ->
  length (nth (t * n_points P + i) (knots (frame_of P N)) []) = n_p P /\
    forall a, (a < n_p P)%nat ->
  at_forms (nth (t * n_points P + i) (knots (frame_of P N)) []) xx a = knotR P u (netR N k) t i a.
Proof.
  intros Ht Hi. destruct outs_R as [HY LY]. destruct start_R as [HX LX].
  assert (HY' : forall j, (j < outputs P)%nat -> at_forms (outs (frame_of P N)) xx j = netR N k j)
    by (intros; apply HY).
  split; [|intros a Ha; apply (knot_R P N _ _ xx u (netR N k) SP HX HY' LX LY t i Ht Hi a Ha)].
  apply (places_R P N _ _ xx u (netR N k) SP HX HY' LX LY).
  assert (t * n_points P <= steps P * n_points P)%nat by (apply Nat.mul_le_mono_r; lia).
  simpl. lia.
Qed.
Lemma ends_R' j : (j < n_points P * n_p P + n_q P)%nat -> at_forms (ends_ (frame_of P N)) xx j
  = endR P u (netR N k) j.
Proof.
  destruct outs_R as [HY LY]. destruct start_R as [HX LX].
  apply (end_R P N _ _ xx u (netR N k) SP HX ltac:(intros; apply HY) LX LY).
Qed.

(* ---- The hulls cover the leaf ---- *)
Lemma everywhere_R cs Z test : everywhere cs Z test = true -> forall ok W, In (ok, W) cs ->
  ok = true /\ forall v, In v (product (corners_of Z) W) -> test v = true.
Proof.
  intros H ok W Hin. eapply forallb_forall in H; [|exact Hin]. cbn [fst snd] in H.
  apply andb_prop in H as [-> H].
  split; [reflexivity|]. intros v Hv. apply in_flat_map in Hv as (y & Hy & Hv).
  apply in_map_iff in Hv as (z & <- & Hz).
  eapply forallb_forall in H; [|exact Hy]. eapply forallb_forall in H; [|exact Hz]. exact H.
Qed.
Lemma leaf_hull Z D test : length Z = n_p P -> length D = n_k P -> inBox Z (endR P u (netR N k)) ->
  inBox D k ->
  everywhere (cells_in N D) Z test = true -> exists V, cone V xx 1 /\ forall v, In v V ->
    test v = true.
Proof.
  intros LZ LD HZ HD HE. pose proof (corners_R _ _ HD) as CD. rewrite LD in CD. fold kk in CD.
  destruct (hidden_cover N _ _ CD) as (ok & W & Hin & HW).
  destruct (everywhere_R _ _ _ HE ok W Hin) as [-> HT].
  exists (product (corners_of Z) W). split; [|exact HT]. pose proof (corners_R _ _ HZ) as CZ.
  pose proof (cone_product (n_p P) (corners_of Z) W _ ltac:(intros v Hv;
    rewrite (corners_len _ _ Hv); exact LZ) CZ _ 1 (HW eq_refl)) as C.
  apply (cone_ext _ _ _ _ _ C); [|reflexivity]. intro i. unfold xx, join.
  destruct (Nat.ltb_spec i (n_p P)) as [L|L]; [|reflexivity].
  unfold cut_off. rewrite LZ. destruct (Nat.ltb_spec i (n_p P)); [ring|lia].
Qed.

(* What holds throughout the cells holds at the points of a hull that covers what the last hidden
   layer gives. *)
Lemma throughout_hull D test : length D = n_k P -> inBox D k ->
  throughout (cells_in N D) test = true ->
  exists W, cone W (stateR N kk) 1 /\ forall test, throughout (cells_in N D) test = true ->
    forall w, In w W -> test w = true.
Proof.
  intros LD HD H0. pose proof (corners_R _ _ HD) as CD. rewrite LD in CD. fold kk in CD.
  destruct (hidden_cover N _ _ CD) as (ok & W & Hin & HW).
  assert (G : forall test, throughout (cells_in N D) test = true -> ok = true /\ forall w, In w W ->
    test w = true).
  { intros f HT. eapply forallb_forall in HT; [|exact Hin]. cbn [fst snd] in HT.
    apply andb_prop in HT as [HT1 HT].
    split; [exact HT1|]. intros w Hw. eapply forallb_forall in HT; eauto. }
  exists W. split; [apply HW; apply (G _ H0)|]. intros f HT. apply (G f HT).
Qed.

(* ---- Errors ---- *)
Lemma small_R e : forall w, small e w = true -> forall a, Rabs (toR e a) <= toR w a.
Proof.
  unfold toR. induction e as [|x e IH]; intros [|y w] H a; simpl in H; try discriminate.
  - destruct a; simpl; rewrite R0, Rabs_R0; lra.
  - apply andb_prop in H as [X H]. apply R_le in X. rewrite R_abs in X. destruct a as [|a];
      [exact X|apply (IH w H a)].
Qed.
Lemma allows_R n E x : allows n E x = true -> length x = n /\ inError n E (toR x).
Proof.
  unfold allows. rewrite andb_true_iff, Nat.eqb_eq. intros [L H]. split; [exact L|].
  destruct E as [w|A]; simpl.
  - intros i _. apply small_R. exact H.
  - intros a b Hab. eapply forallb_forall in H; [|exact Hab]. apply R_le in H.
    rewrite dotQ_R in H. exact H.
Qed.
Lemma chunk_vec_nth n : forall T w i, (i < T)%nat -> nth i (chunk_vec n T w) [] = firstn n
  (skipn (i * n) w).
Proof.
  induction T; intros w i H; [lia|]. destruct i as [|i]; simpl; [reflexivity|]. rewrite IHT by lia.
  rewrite skipn_two. reflexivity.
Qed.
Lemma chunk_vec_len n : forall T w, length (chunk_vec n T w) = T.
Proof. induction T; intro w; simpl; [reflexivity|]. rewrite IHT. reflexivity. Qed.
Lemma chunk_vec_R n T w i a : (i < T)%nat -> (a < n)%nat -> toR (nth i (chunk_vec n T w) []) a = toR
  w (i * n + a)%nat.
Proof.
  intros Hi Ha. rewrite chunk_vec_nth by exact Hi. unfold toR. rewrite nth_firstn_lt by exact Ha.
  rewrite nth_skipn'. reflexivity.
Qed.

(* ---- A missed goal ---- *)
Lemma vmin_l u' : forall v i, (i < length u')%nat -> toR (vmin u' v) i <= toR u' i.
Proof.
  unfold toR. induction u' as [|a u' IH]; intros [|b v] [|i] H; simpl in *; try lia; try lra;
    [|apply IH; lia].
  destruct (qle a b) eqn:E; [lra|apply R_nle in E; lra].
Qed.
Lemma vmin_r u' : forall v i, (i < length v)%nat -> toR (vmin u' v) i <= toR v i.
Proof.
  unfold toR. induction u' as [|a u' IH]; intros [|b v] [|i] H; simpl in *; try lia; try lra;
    [|apply IH; lia].
  destruct (qle a b) eqn:E; [apply R_le in E; lra|lra].
Qed.
Lemma vmin_pos u' : forall v, (forall i, 0 <= toR u' i) -> (forall i, 0 <= toR v i) ->
  forall i, 0 <= toR (vmin u' v) i.
Proof.
  unfold toR. induction u' as [|a u' IH]; intros [|b v] HU HV i; simpl;
    [apply HV|apply HV|apply HU|].
  pose proof (HU O) as A. pose proof (HV O) as B. simpl in A, B. destruct i as [|i];
    [destruct (qle a b); assumption|].
  apply (IH v); [intro j; apply (HU (S j))|intro j; apply (HV (S j))].
Qed.
Lemma vmin_len u' : forall v, length (vmin u' v) = Nat.max (length u') (length v).
Proof. induction u'; intros [|b v]; simpl; auto. Qed.
Lemma least_of_R l x : In x l -> Q2R (least_of l) <= Q2R x.
Proof.
  induction l as [|y l IH]; intro H; [destruct H|]. destruct l as [|z l]; [destruct H as [<-|[]];
    simpl; lra|].
  change (least_of (y :: z :: l)) with (let m := least_of (z :: l) in if qle y m then y else m).
  cbv zeta.
  destruct (qle y (least_of (z :: l))) eqn:E.
  - apply R_le in E. destruct H as [<-|H]; [lra|specialize (IH H); lra].
  - apply R_nle in E. destruct H as [<-|H]; [lra|apply IH; exact H].
Qed.
Definition extreme_error (a : vec) (e : rv) : rv := fun i => if Rle_dec 0 (toR a i)
  then e i else - e i.
Lemma extreme_R a : forall e, dotR a (extreme_error a e) = dotR (vabs a) e.
Proof.
  induction a as [|c a IH]; intro e; [reflexivity|]. cbn [dotR vabs map].
  change (shift (extreme_error (c :: a) e)) with (extreme_error a (shift e)). rewrite IH. f_equal.
  rewrite R_abs.
  unfold extreme_error, toR. simpl. destruct (Rle_dec 0 (Q2R c)); [rewrite Rabs_right by lra;
    ring|rewrite Rabs_left1 by lra; ring].
Qed.
Lemma extreme_abs a e i : 0 <= e i -> Rabs (extreme_error a e i) <= e i.
Proof. intro H. unfold extreme_error. destruct (Rle_dec _ _); [rewrite Rabs_right by lra|rewrite
  Rabs_Ropp, Rabs_right by lra]; lra. Qed.

Lemma widths_of E : has_widths E = true -> E = Widths (width E).
Proof. destruct E; [reflexivity|discriminate]. Qed.
Lemma last_fit B : open_bin P B -> length (last_errors P B) = n_points P /\
  forall i, error_ok (n_p P) (nth i (last_errors P B) (Rows [])) = true.
Proof. intro HB. pose proof (some_step _ _ SP). split; [apply (all_points _ _ HB); lia|intro i;
  apply (all_fit _ _ HB)]. Qed.
Lemma end_widths_R B : open_bin P B -> plain_end P B = true ->
  (forall j, 0 <= toR (end_widths P B) j) /\
  (forall j, (j < n_points P * n_p P + n_q P)%nat -> toR (end_widths P B) j <= toR (width
    (final B)) j) /\
  (forall i a, (i < n_points P)%nat -> (a < n_p P)%nat ->
     toR (end_widths P B) (i * n_p P + a)%nat <= toR (width (nth i (last_errors P B) (Rows []))) a).
Proof.
  intros HB HP. apply andb_prop in HP as [HP1 HP2]. pose proof (end_fit _ _ HB) as HF.
  rewrite (widths_of _ HP1) in HF.
  cbn [error_ok] in HF. apply andb_prop in HF as [Lf Pf]. apply Nat.eqb_eq in Lf.
  destruct (last_fit B HB) as [Ll Hl]. pose proof (some_axis _ _ SP) as SA.
  set (l := map width (last_errors P B)).
  assert (Ll' : @length (list Q) l = n_points P) by (unfold l; rewrite map_length; exact Ll).
  assert (Nl : forall i, nth i l [] = width (nth i (last_errors P B) (Rows []))) by (intro i;
    unfold l; change (@nil Q) with (width (Rows [])); apply map_nth).
  assert (Hw : forall v, In v l -> length v = n_p P /\ forallb (qle 0) v = true).
  { intros v Hv. apply (In_nth _ _ []) in Hv as (i & Hi & <-). rewrite Nl. specialize (Hl i).
    assert (Hi' : (i < length (last_errors P B))%nat) by (unfold l in Hi; rewrite map_length
      in Hi; exact Hi).
    eapply forallb_forall in HP2; [|apply (@nth_In _ i _ (Rows [])); exact Hi'].
    rewrite (widths_of _ HP2) in Hl. cbn [error_ok] in Hl.
    apply andb_prop in Hl as [H1 H2]. apply Nat.eqb_eq in H1. auto. }
  assert (Lc : length (concat l) = (n_points P * n_p P)%nat) by (rewrite (concat_len (n_p P));
    [rewrite Ll'; reflexivity|apply Hw]).
  unfold end_widths. fold l. split; [|split].
  - apply vmin_pos; apply nonneg_R; [|exact Pf]. apply forallb_forall. intros x Hx.
    apply in_concat in Hx as (v & Hv & Hx).
    destruct (Hw v Hv) as [_ H]. eapply forallb_forall in H; eauto.
  - intros j Hj. apply vmin_r. rewrite Lf. exact Hj.
  - intros i a Hi Ha.
    assert (Hj : (i * n_p P + a < n_points P * n_p P)%nat).
    { assert (S i * n_p P <= n_points P * n_p P)%nat by (apply Nat.mul_le_mono_r; lia).
      simpl in *. lia. }
    eapply Rle_trans; [apply vmin_l; lia|]. unfold toR.
    rewrite (nth_concat _ (n_p P)) by (try apply Hw; try exact SA; rewrite Ll'; exact Hj).
    replace ((i * n_p P + a) / n_p P)%nat with i by (rewrite Nat.add_comm, Nat.div_add by lia;
      rewrite Nat.div_small by exact Ha; reflexivity).
    replace ((i * n_p P + a) mod n_p P)%nat with a by (rewrite Nat.add_comm, Nat.mod_add by lia;
      rewrite Nat.mod_small by exact Ha; reflexivity).
    rewrite Nl. lra.
Qed.

(* A row that an end misses by more than an error which a bin allows there. *)
Lemma use_error B bs us : open_bin P B -> In B bs -> use_ok P bs us = true ->
  exists a b x, In (a, b) (goal P) /\ fst (use_row P bs us) = a /\
    Q2R b <= Q2R (snd (use_row P bs us)) + dotR a x /\
    inError (n_points P * n_p P + n_q P) (final B) x /\
    forall i, (i < n_points P)%nat -> inError (n_p P) (nth i (last_errors P B) (Rows [])) (fun c =>
      x (i * n_p P + c)%nat).
Proof.
  intros HB IB H. unfold use_ok in H. rewrite !andb_true_iff in H. destruct H as [[Hr _] H].
  apply Nat.ltb_lt in Hr.
  pose proof (nth_In (goal P) ([], 0%Q) Hr) as Ha. unfold use_row.
  destruct (nth (which_row us) (goal P) ([], 0%Q)) as [a b].
  cbn [fst snd]. eapply forallb_forall in H; [|exact IB]. destruct (last_fit B HB) as [Ll Hl].
  destruct (shrink us) as [x|].
  - exists a, b, (toR x). unfold end_allows in H. apply andb_prop in H as [H1 H2].
    apply allows_R in H1 as [Lx H1].
    split; [exact Ha|]. split; [reflexivity|]. split; [rewrite R_add, Q2R_opp, dotQ_R; lra|].
    split; [exact H1|].
    intros i Hi.
    assert (I : In (nth i (last_errors P B) (Rows []), nth i (chunk_vec (n_p P) (n_points P) x) [])
                   (combine (last_errors P B) (chunk_vec (n_p P) (n_points P) x))).
    { rewrite <- combine_nth by (rewrite chunk_vec_len; exact Ll). apply nth_In.
      rewrite combine_length, chunk_vec_len, Ll. lia. }
    eapply forallb_forall in H2; [|exact I]. apply allows_R in H2 as [_ H2]. cbn [fst snd] in H2.
    eapply (inError_upto _ _ _ _ (Hl i)); [|exact H2]. intros c Hc. apply chunk_vec_R; assumption.
  - destruct (end_widths_R B HB H) as (E0 & Ef & Ei).
    exists a, b, (extreme_error a (toR (end_widths P B))).
    pose proof H as HP. apply andb_prop in HP as [HP1 HP2].
    split; [exact Ha|]. split; [reflexivity|]. split; [|split].
    + rewrite R_add, Q2R_opp, extreme_R, <- dotQ_R.
      pose proof (least_of_R _ _ (in_map (fun B => dotQ (vabs a) (end_widths P B)) bs B IB)) as K.
      cbv beta in K. lra.
    + rewrite (widths_of _ HP1). simpl. intros j Hj. eapply Rle_trans; [apply extreme_abs,
        E0|apply Ef; exact Hj].
    + intros i Hi. assert (Hi' : (i < length (last_errors P B))%nat) by (rewrite Ll; exact Hi).
      eapply forallb_forall in HP2; [|apply (@nth_In _ i _ (Rows [])); exact Hi'].
      rewrite (widths_of _ HP2). simpl.
      intros c Hc. eapply Rle_trans; [apply extreme_abs, E0|apply Ei; assumption].
Qed.
Lemma goal_missed B bs us : open_bin P B -> In B bs -> use_ok P bs us = true ->
  Q2R (snd (use_row P bs us)) < dotR (fst (use_row P bs us)) (endR P u (netR N k)) ->
  exists tau, in_tube P N B u k tau /\ continuous tau /\ misses P tau.
Proof.
  intros HB IB HU HG. destruct (use_error B bs us HB IB HU) as (a & b & x & Hab & Ea & Eb & Hf &
    Hi). rewrite Ea in HG.
  pose proof (some_axis _ _ SP) as SA. pose proof (some_step _ _ SP) as ST.
  set (tau := nudged P u (netR N k) (INR (steps P)) 1 (fun i c => x (i * n_p P + c)%nat)
                (fun j => x (n_points P * n_p P + j)%nat)).
  assert (Hx : forall j, (if (j <? n_points P * n_p P)%nat
      then bump (INR (steps P)) 1 (INR (steps P)) * x (j / n_p P * n_p P + j mod n_p P)%nat
      else x (n_points P * n_p P + (j - n_points P * n_p P))%nat) = x j).
  { intro j. destruct (Nat.ltb_spec j (n_points P * n_p P)) as [C|C].
    - rewrite bump_at, Rmult_1_l by lra. f_equal. pose proof (Nat.div_mod j (n_p P) ltac:(lia)).
      lia.
    - f_equal. lia. }
  exists tau. split; [|split; [apply nudged_continuous|]].
  - apply nudged_in_tube; auto; [lra| |].
    + intros t s i Ht Hi' Hs. destruct (Nat.eq_dec t (steps P - 1)) as [->|Nt]; [right; apply Hi;
        exact Hi'|].
      left. assert (INR (S (S t)) <= INR (steps P)) as LT by (apply le_INR; lia).
      rewrite !S_INR in LT.
      rewrite Rabs_left1 by lra. lra.
    + apply (inError_upto _ _ x _ (end_fit _ _ HB)); [|exact Hf]. intros j _. symmetry. apply Hx.
  - intro K. specialize (K a b Hab). rewrite (dotR_ext a _ (fun j => endR P u (netR N k) j + x j))
      in K.
    + rewrite dotR_plus in K. lra.
    + intros j _. unfold tau. rewrite nudged_end by exact SA. f_equal. apply Hx.
Qed.
End Frame.
