(* A hit: where each corner of a hull has a contact with the obstacle, every plan in it has a trajectory that touches. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts SeparationFacts BinFacts ConditionFacts Doubt DoubtFacts.
Require Import NoPlan Trajectories HullFacts LeafFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Mixtures ---- *)
Definition real (lam : vec) : list R := map Q2R lam.
Lemma mixQ_R lam : forall vs a, toR (mixQ lam vs) a = mix (real lam) (map toR vs) a.
Proof. induction lam as [|l lam IH]; intros [|v vs] a; simpl; try apply toR_nil. rewrite toR_vadd, toR_vscale, IH. reflexivity. Qed.
Lemma mix_ext (lam : list R) {A} (f g : A -> rv) l a : (forall x, In x l -> f x a = g x a) -> mix lam (map f l) a = mix lam (map g l) a.
Proof.
  revert lam. induction l as [|x l IH]; intros [|m lam] H; simpl; try reflexivity.
  rewrite (H x), IH; simpl; auto. intros; apply H; simpl; auto.
Qed.
Lemma mix_plus (lam : list R) {A} (f g : A -> rv) l a :
  mix lam (map (fun x a => f x a + g x a) l) a = mix lam (map f l) a + mix lam (map g l) a.
Proof. revert lam. induction l as [|x l IH]; intros [|m lam]; simpl; try ring. rewrite IH. ring. Qed.
Lemma mix_scale (lam : list R) {A} c (f : A -> rv) l a : mix lam (map (fun x a => c * f x a) l) a = c * mix lam (map f l) a.
Proof. revert lam. induction l as [|x l IH]; intros [|m lam]; simpl; try ring. rewrite IH. ring. Qed.
Lemma mean_mix {A B} (mu : list R) (V : list A) (lam : list R) (f : A -> B -> rv) l a :
  mean mu V (fun v => mix lam (map (f v) l) a) = mix lam (map (fun x a => mean mu V (fun v => f v x a)) l) a.
Proof.
  revert lam. induction l as [|x l IH]; intros [|m lam]; simpl; try apply mean_zero. rewrite mean_plus, mean_scale, IH. reflexivity.
Qed.
Lemma sum_R l : Q2R (fold_right qadd 0%Q l) = fold_right Rplus 0 (real l).
Proof. induction l as [|a l IH]; simpl; [apply R0|]. rewrite R_add, IH. reflexivity. Qed.
Lemma is_mixture_R n lam : is_mixture n lam = true -> weights (real lam) n.
Proof.
  unfold is_mixture. rewrite !andb_true_iff. intros [[L P] S]. unfold real. split; [rewrite map_length; apply Nat.eqb_eq; exact L|]. split.
  - apply Forall_forall. intros x Hx. apply in_map_iff in Hx as (q & <- & Hq). eapply forallb_forall in P; [|exact Hq].
    apply R_le in P. rewrite R0 in P. exact P.
  - change (map Q2R lam) with (real lam). rewrite <- sum_R. apply Qeq_bool_eq, Qeq_eqR in S. rewrite S. apply R1.
Qed.

(* ---- Shapes and widths are convex ---- *)
Lemma mean_weights {A} mu (V : list A) n (w : A -> vec) : weights mu (length V) -> (forall v, In v V -> is_mixture n (w v) = true) ->
  exists lam, weights lam n /\ forall (ps : list rv), length ps = n -> forall a,
    mix lam ps a = mean mu V (fun v => mix (real (w v)) ps a).
Proof.
  intros (L & P & S) H. exists (map (fun j => mean mu V (fun v => Q2R (nth j (w v) 0%Q))) (seq 0 n)). split.
  - split; [rewrite map_length, seq_length; reflexivity|]. split.
    + apply Forall_forall. intros x Hx. apply in_map_iff in Hx as (j & <- & _). rewrite <- (mean_zero mu V). apply mean_le; [exact P|].
      intros v Hv. specialize (H v Hv). unfold is_mixture in H. rewrite !andb_true_iff in H. destruct H as [[_ H] _].
      apply (nonneg_R _ H j).
    + assert (G : forall n (w : A -> vec), (forall v, In v V -> length (w v) = n) ->
        fold_right Rplus 0 (map (fun j => mean mu V (fun v => Q2R (nth j (w v) 0%Q))) (seq 0 n)) =
        mean mu V (fun v => fold_right Rplus 0 (real (w v)))).
      { clear. induction n as [|n IH]; intros w Hw; simpl.
        - rewrite (mean_ext mu V _ (fun _ => 0)), mean_zero; [reflexivity|]. intros v Hv. specialize (Hw v Hv). destruct (w v); [reflexivity|discriminate].
        - rewrite <- seq_shift, map_map. specialize (IH (fun v => tl (w v))).
          rewrite (map_ext _ (fun j => mean mu V (fun v => Q2R (nth j (tl (w v)) 0%Q)))).
          2: { intro j. apply mean_ext. intros v Hv. destruct (w v) as [|x l]; [destruct j; reflexivity|reflexivity]. }
          rewrite IH by (intros v Hv; specialize (Hw v Hv); destruct (w v); simpl in *; [discriminate|lia]).
          rewrite <- mean_plus. apply mean_ext. intros v Hv. specialize (Hw v Hv). destruct (w v); [discriminate|reflexivity]. }
      rewrite G.
      * rewrite (mean_ext mu V _ (fun _ => 1)); [rewrite (mean_const mu V 1 L), S; ring|].
        intros v Hv. destruct (is_mixture_R _ _ (H v Hv)) as (_ & _ & E). exact E.
      * intros v Hv. specialize (H v Hv). unfold is_mixture in H. rewrite !andb_true_iff in H. destruct H as [[H _] _]. apply Nat.eqb_eq. exact H.
  - intros ps Lp a.
    assert (Hl : forall v, In v V -> length (w v) = n).
    { intros v Hv. specialize (H v Hv). unfold is_mixture in H. rewrite !andb_true_iff in H. destruct H as [[H _] _]. apply Nat.eqb_eq. exact H. }
    clear H. revert w ps Lp Hl. clear L P S. induction n as [|n IH]; intros w ps Lp Hl.
    + destruct ps; [|discriminate]. simpl. rewrite (mean_ext mu V _ (fun _ => 0)), mean_zero; [reflexivity|].
      intros v Hv. specialize (Hl v Hv). destruct (w v); [reflexivity|discriminate].
    + destruct ps as [|p ps]; [discriminate|]. simpl seq. rewrite <- seq_shift. simpl map. rewrite map_map. cbn [mix].
      rewrite (map_ext _ (fun j => mean mu V (fun v => Q2R (nth j (tl (w v)) 0%Q)))).
      2: { intro j. apply mean_ext. intros v Hv. destruct (w v) as [|x l]; [destruct j; reflexivity|reflexivity]. }
      assert (Ht : forall v, In v V -> length (tl (w v)) = n).
      { intros v Hv. specialize (Hl v Hv). destruct (w v); simpl in *; [discriminate|lia]. }
      rewrite (IH (fun v => tl (w v)) ps ltac:(simpl in Lp; lia) Ht).
      rewrite Rmult_comm, <- mean_scale, <- mean_plus. apply mean_ext. intros v Hv. specialize (Hl v Hv).
      destruct (w v); [discriminate|]. simpl. ring.
Qed.
Lemma sumsq_dot n : forall v, length v = n -> sumsq n (toR v) = dotR v (toR v).
Proof.
  induction n as [|n IH]; intros [|a v] L; try discriminate; [reflexivity|]. simpl in *.
  change (shift (toR (a :: v))) with (toR v). rewrite IH by lia. reflexivity.
Qed.
Lemma shape_mean {A} mu (V : list A) n b (p : A -> vec) : weights mu (length V) -> shape_ok n b = true ->
  (forall v, In v V -> body_ok n b (p v) = true) -> inShape n b (fun a => mean mu V (fun v => toR (body_point b (p v)) a)).
Proof.
  intros W SO H. destruct b as [r|vs]; simpl.
  - eapply Rle_trans; [apply (mean_sumsq mu V n W)|]. destruct W as (L & P & S).
    replace (Q2R r * Q2R r) with (mean mu V (fun _ => Q2R r * Q2R r)) by (rewrite (mean_const mu V _ L), S; ring).
    apply mean_le; [exact P|]. intros v Hv. specialize (H v Hv). simpl in H. apply andb_prop in H as [Hl Hr].
    apply Nat.eqb_eq in Hl. rewrite sumsq_dot, <- dotQ_R, <- R_mul by exact Hl. apply R_le. exact Hr.
  - destruct (mean_weights mu V (length vs) p W H) as (lam & HW & HM). exists lam. split; [exact HW|]. intros a _.
    rewrite HM by apply map_length. apply mean_ext. intros v _. simpl. apply mixQ_R.
Qed.
Lemma small_R e : forall w, small e w = true -> forall a, Rabs (toR e a) <= toR w a.
Proof.
  unfold toR. induction e as [|x e IH]; intros [|y w] H a; simpl in H; try discriminate.
  - destruct a; simpl; rewrite R0, Rabs_R0; lra.
  - apply andb_prop in H as [X H]. apply R_le in X. rewrite R_abs in X. destruct a as [|a]; [exact X|apply (IH w H a)].
Qed.
Lemma errors_fit_R P c Es : errors_fit P c Es = true -> forall i a, Rabs (toR (nth i (errors c) []) a) <= toR (nth i Es []) a.
Proof.
  unfold errors_fit. rewrite andb_true_iff, Nat.eqb_eq. intros [L H] i a. destruct (Nat.lt_ge_cases i (length (errors c))) as [C|C].
  - assert (I : In (nth i (errors c) [], nth i Es []) (combine (errors c) Es)).
    { rewrite <- (combine_nth (errors c) Es i [] []) by exact L. apply nth_In. rewrite combine_length. lia. }
    eapply forallb_forall in H; [|exact I]. apply small_R. exact H.
  - rewrite !nth_overflow by lia. rewrite toR_nil, Rabs_R0. lra.
Qed.
Lemma widths_nth B t i : nth i (widths_at B t) [] = width (nth i (nth t (interval B) []) (Rows [])).
Proof. unfold widths_at. change (@nil Q) with (width (Rows [])). apply map_nth. Qed.
Lemma chunk_vec_nth n : forall T w i, (i < T)%nat -> nth i (chunk_vec n T w) [] = firstn n (skipn (i * n) w).
Proof.
  induction T; intros w i H; [lia|]. destruct i as [|i]; simpl; [reflexivity|]. rewrite IHT by lia. rewrite skipn_two. reflexivity.
Qed.

(* ---- A moment beside a knot ---- *)
Lemma moment_near (A : poly) (p q : vec -> R) s0 : (forall a b, In (a, b) A -> p a + s0 * q a < Q2R b) ->
  exists eta, 0 < eta /\ forall s, Rabs (s - s0) <= eta -> forall a b, In (a, b) A -> p a + s * q a <= Q2R b.
Proof.
  induction A as [|[a b] A IH]; intro H; [exists 1; split; [lra|intros s _ a b []]|].
  destruct IH as (e & He & IH); [intros; apply H; simpl; auto|]. specialize (H a b (or_introl eq_refl)).
  set (m := Q2R b - (p a + s0 * q a)) in *. assert (Hm : 0 < m) by (unfold m; lra).
  pose proof (Rabs_pos (q a)) as Q0. set (d := m / (1 + Rabs (q a))).
  assert (Hd : 0 < d) by (apply Rdiv_lt_0_compat; lra).
  exists (Rmin e d). split; [apply Rmin_glb_lt; assumption|]. intros s Hs a' b' [[= <- <-]|Hin].
  - assert (Rabs ((s - s0) * q a) <= m).
    { rewrite Rabs_mult. apply Rle_trans with (d * Rabs (q a)).
      - apply Rmult_le_compat_r; [exact Q0|]. eapply Rle_trans; [exact Hs|apply Rmin_r].
      - assert (d * (1 + Rabs (q a)) = m) by (unfold d; field; lra). lra. }
    pose proof (Rle_abs ((s - s0) * q a)). unfold m in *. lra.
  - apply (IH s); [|exact Hin]. eapply Rle_trans; [exact Hs|apply Rmin_l].
Qed.

(* ---- The leaf ---- *)
Lemma len_blended n lam : forall Ps, (forall Q, In Q Ps -> length Q = n) -> length (blended n lam Ps) = n.
Proof.
  induction lam as [|l lam IH]; intros [|Q Ps] H; simpl; try apply repeat_length.
  assert (LQ : length (map (ascale l) Q) = n) by (rewrite map_length; apply H; simpl; auto).
  rewrite len_zadd; [exact LQ|]. rewrite IH, LQ; [reflexivity|]. intros; apply H; simpl; auto.
Qed.
Lemma at_scale l X x i : at_forms (map (ascale l) X) x i = Q2R l * at_forms X x i.
Proof.
  unfold at_forms. destruct (Nat.lt_ge_cases i (length X)) as [H|H].
  - rewrite (nth_indep _ _ (ascale l (aconst 0))) by (rewrite map_length; exact H). rewrite map_nth. apply affR_scale.
  - rewrite !nth_overflow by (rewrite ?map_length; exact H). rewrite affR_const, R0. ring.
Qed.
Lemma blended_R n lam : forall Ps x i, (i < n)%nat -> (forall Q, In Q Ps -> length Q = n) ->
  at_forms (blended n lam Ps) x i = mix (real lam) (map (fun Q => at_forms Q x) Ps) i.
Proof.
  induction lam as [|l lam IH]; intros [|Q Ps] x i Hi H; simpl;
    try (unfold at_forms; rewrite nth_repeat, affR_const; apply R0).
  assert (LQ : length Q = n) by (apply H; simpl; auto).
  assert (HP : forall Q', In Q' Ps -> length Q' = n) by (intros; apply H; simpl; auto).
  rewrite at_zadd by (rewrite ?map_length, ?len_blended; auto; lia). rewrite at_scale, IH by assumption. reflexivity.
Qed.

Section Leaf.
Variables (P : problem) (N : list layer).
Hypothesis SP : sizes P N.
Variables (u k : rv) (B : bin) (bs : list bin) (h : hit) (o : obstacle) (b : part) (V : list vec).
Let y := netR N k.
Let n := n_p P.
Let xx := join n (endR P u y) (stateR N (cut_off (n_k P) k)).
Let F := frame_of P N.
Hypothesis HB : wide_bin P B.
Hypothesis IB : In B bs.
Hypothesis Ho : In o (obstacles P).
Hypothesis Hb : In b (parts P).
Hypothesis Ht : (first o <= step h <= last o)%nat.
Hypothesis Hs : 0 <= Q2R (share h) <= 1.
Hypothesis Hl : is_mixture (length (corners b)) (blend h) = true.
Hypothesis Hc : forallb (contact_ok P bs b h) (contacts h) = true.
Hypothesis HV : cone V xx 1.
Let M := blended n (blend h) (map (fun i => moment P F (step h) i (share h)) (corners b)).
Let strict := negb (loose P bs h).
Hypothesis Ha : forall v, In v V ->
  existsb (forallb (holdsQ v)) (map (fun c => touching strict (rows o) M (offset b h c)) (contacts h)) = true.

Definition picked (v : vec) : contact :=
  match find (fun c => forallb (holdsQ v) (touching strict (rows o) M (offset b h c))) (contacts h) with
  | Some c => c
  | None => Contact [] []
  end.
Lemma picked_ok v : In v V -> In (picked v) (contacts h) /\
  forallb (holdsQ v) (touching strict (rows o) M (offset b h (picked v))) = true.
Proof.
  intro Hv. unfold picked. destruct (find _ _) as [c|] eqn:E; [apply find_some in E; exact E|]. exfalso.
  specialize (Ha v Hv). apply existsb_exists in Ha as (rs & Hin & HR). apply in_map_iff in Hin as (c & <- & Hin).
  pose proof (find_none _ _ E c Hin) as K. cbv beta in K. congruence.
Qed.

Lemma hit_leaf : exists tau, in_tube P N B u k tau /\ continuous tau /\ touches P tau.
Proof.
  destruct (hull_mean V xx HV) as (mu & HW & HX). pose proof HW as (Lm & Pm & Sm).
  pose proof (some_axis _ _ SP) as SA. pose proof (some_step _ _ SP) as ST. pose proof (last_step _ _ SP o Ho) as Hlast.
  set (t := step h) in *. set (al := Q2R (share h)) in *. set (lam := real (blend h)).
  assert (Pick : forall v, In v V -> In (picked v) (contacts h)) by (intros v Hv; apply (picked_ok v Hv)).
  assert (HL : weights lam (length (corners b))) by (apply is_mixture_R; exact Hl).
  set (e := fun (i : nat) (a : nat) => mean mu V (fun v => toR (nth i (errors (picked v)) []) a)).
  set (G := fun a : nat => mean mu V (fun v => toR (body_point (grown_by b) (body (picked v))) a)).
  assert (HG : inShape n (grown_by b) G).
  { apply shape_mean; [exact HW|apply (part_shape _ _ SP); exact Hb|]. intros v Hv. destruct (picked_ok v Hv) as [Hin _].
    eapply forallb_forall in Hc; [|exact Hin]. unfold contact_ok in Hc. apply andb_prop in Hc as [Hc1 _]. exact Hc1. }
  assert (He : forall i a, Rabs (e i a) <= toR (width (nth i (nth t (interval B) []) (Rows []))) a).
  { intros i a. apply mean_abs; [exact HW|]. intros v Hv. destruct (picked_ok v Hv) as [Hin _].
    eapply forallb_forall in Hc; [|exact Hin]. unfold contact_ok in Hc. apply andb_prop in Hc as [_ Hc2].
    eapply forallb_forall in Hc2; [|exact IB]. rewrite <- widths_nth. apply (errors_fit_R P); exact Hc2. }
  set (off := fun a => G a + mix lam (map e (corners b)) a).
  set (mid := fun (s : R) (a : nat) => mix lam (map (fun i a => (1 - s) * knotR P u y t i a + s * knotR P u y (S t) i a) (corners b)) a).
  assert (Hoff : forall a, mean mu V (fun v => toR (offset b h (picked v)) a) = off a).
  { intro a. unfold off, G, offset. rewrite (mean_ext mu V _ (fun v => toR (body_point (grown_by b) (body (picked v))) a +
      mix lam (map (fun i => toR (nth i (errors (picked v)) [])) (corners b)) a)).
    - rewrite mean_plus. f_equal. rewrite (mean_mix mu V lam (fun v i => toR (nth i (errors (picked v)) []))). reflexivity.
    - intros v _. rewrite toR_vadd, mixQ_R, map_map. reflexivity. }
  assert (LM : forall Q, In Q (map (fun i => moment P F t i (share h)) (corners b)) -> length Q = n).
  { intros Q HQ. apply in_map_iff in HQ as (i & <- & Hi). pose proof (part_points _ _ SP b i Hb Hi) as Hm. unfold moment.
    destruct (knots_R P N SP u k t i ltac:(lia) Hm) as [L1 _]. destruct (knots_R P N SP u k (S t) i ltac:(lia) Hm) as [L2 _].
    rewrite len_zadd; rewrite !map_length; [exact L1|]. unfold F. congruence. }
  assert (HM : forall a, (a < n)%nat -> at_forms M xx a = mid al a).
  { intros a Ha'. unfold M. rewrite blended_R by assumption. rewrite map_map. unfold mid. apply mix_ext.
    intros i Hi. cbv beta. pose proof (part_points _ _ SP b i Hb Hi) as Hm. unfold moment.
    destruct (knots_R P N SP u k t i ltac:(lia) Hm) as [L1 K1]. destruct (knots_R P N SP u k (S t) i ltac:(lia) Hm) as [L2 K2].
    rewrite at_zadd by (rewrite map_length; unfold F, n in *; lia). rewrite !at_scale. unfold F, xx, n, y.
    rewrite K1, K2 by exact Ha'. rewrite R_add, Q2R_opp, R1. fold al. reflexivity. }
  assert (Hrow : forall a c, In (a, c) (rows o) ->
     if strict then dotR a (fun j => mid al j + off j) < Q2R c else dotR a (fun j => mid al j + off j) <= Q2R c).
  { intros a c Hac. pose proof (poly_len n (rows o) a c) as La.
    assert (La' : length a = n).
    { apply La; [|exact Hac]. apply (obstacle_rows _ _ SP). exact Ho. }
    rewrite (dotR_plus a (mid al) off).
    rewrite (dotR_ext a off (fun j => mean mu V (fun v => toR (offset b h (picked v)) j))) by (intros; symmetry; apply Hoff).
    rewrite (mean_dot mu V a (fun v => toR (offset b h (picked v)))).
    rewrite <- (dotR_ext a (at_forms M xx) (mid al)) by (intros j Hj; apply HM; lia).
    rewrite <- affR_lincomb. set (f := lincomb a M).
    assert (Ef : affR f xx = mean mu V (fun v => affR f (toR v))).
    { unfold affR at 1. rewrite (dotR_ext (fst f) xx (fun j => mean mu V (fun v => toR v j))) by (intros; apply HX).
      rewrite (mean_dot mu V (fst f) toR). replace (Q2R (snd f)) with (mean mu V (fun _ => Q2R (snd f))) by (rewrite (mean_const mu V _ Lm), Sm; ring).
      rewrite <- mean_plus. reflexivity. }
    rewrite Ef, <- mean_plus. replace (Q2R c) with (mean mu V (fun _ => Q2R c)) by (rewrite (mean_const mu V _ Lm), Sm; ring).
    assert (Hv : forall v, In v V -> if strict then affR f (toR v) + dotR a (toR (offset b h (picked v))) < Q2R c
                                     else affR f (toR v) + dotR a (toR (offset b h (picked v))) <= Q2R c).
    { intros v Hv. destruct (picked_ok v Hv) as [_ K].
      assert (R : holdsQ v (strict, aadd (aneg f) (aconst (qadd c (- dotQ a (offset b h (picked v)))))) = true).
      { eapply forallb_forall in K; [exact K|]. unfold touching. apply in_map_iff. exists (a, c). split; [reflexivity|exact Hac]. }
      apply holds_R in R. unfold rowR in R. cbn [fst snd] in R. rewrite affR_add, affR_neg, affR_const, R_add, Q2R_opp, dotQ_R in R.
      destruct strict; lra. }
    destruct strict; [apply mean_lt; auto; lra|apply mean_le; auto]. }
  assert (Mid : forall s a, mid s a = mid 0 a + s * (mid 1 a - mid 0 a)).
  { intros s a. unfold mid. set (f := fun i => knotR P u y t i). set (g := fun i => knotR P u y (S t) i).
    rewrite (mix_plus lam (fun i a => (1 - s) * f i a) (fun i a => s * g i a)), !mix_scale.
    rewrite (mix_plus lam (fun i a => (1 - 0) * f i a) (fun i a => 0 * g i a)), !mix_scale.
    rewrite (mix_plus lam (fun i a => (1 - 1) * f i a) (fun i a => 1 * g i a)), !mix_scale. ring. }
  (* it is enough to have a moment at which everything fits *)
  assert (Touch : forall s0 c r, c = INR t + s0 -> 0 < r -> 0 <= s0 <= 1 -> (forall a c, In (a, c) (rows o) ->
      dotR a (fun j => mid s0 j + off j) <= Q2R c) -> touches P (nudged P u y c r e (fun _ => 0))).
  { intros s0 c r -> Hr Hs0 Hin. exists o, t, s0, b, (fun j => mid s0 j + off j).
    split; [exact Ho|]. split; [exact Ht|]. split; [exact Hs0|]. split; [exact Hb|]. split; [|intros a c Hac; apply Hin; exact Hac].
    exists lam, G. split; [exact HL|]. split; [exact HG|]. intros a _. unfold off, mid.
    rewrite (mix_ext lam (at_ (nudged P u y (INR t + s0) r e (fun _ => 0)) (INR t + s0))
       (fun i a => ((1 - s0) * knotR P u y t i a + s0 * knotR P u y (S t) i a) + e i a)).
    - rewrite (mix_plus lam (fun i a => (1 - s0) * knotR P u y t i a + s0 * knotR P u y (S t) i a) e). rewrite Rplus_assoc. f_equal. apply Rplus_comm.
    - intros i _. rewrite nudged_at by (try exact Hs0; lia). rewrite bump_at by exact Hr. ring. }
  (* either strictly between two knots ... *)
  assert (Between : forall s0, 0 < s0 < 1 -> (forall a c, In (a, c) (rows o) -> dotR a (fun j => mid s0 j + off j) <= Q2R c) ->
      exists tau, in_tube P N B u k tau /\ continuous tau /\ touches P tau).
  { intros s0 H0 Hin. set (r := Rmin s0 (1 - s0)).
    assert (Hr : 0 < r) by (apply Rmin_glb_lt; lra). assert (r <= s0) by apply Rmin_l. assert (r <= 1 - s0) by apply Rmin_r.
    exists (nudged P u y (INR t + s0) r e (fun _ => 0)).
    split; [|split; [apply nudged_continuous|apply (Touch s0 (INR t + s0) r eq_refl Hr); [lra|exact Hin]]].
    apply nudged_in_tube; auto.
    - intros t' s i a Ht' Hi Ha' Hs'. destruct (Nat.lt_trichotomy t' t) as [C|[->|C]]; [left|right; apply He|left].
      + apply le_INR in C. rewrite S_INR in C. rewrite Rabs_left1 by lra. lra.
      + apply le_INR in C. rewrite S_INR in C. rewrite Rabs_right by lra. lra.
    - intros j _. left. assert (INR (S t) <= INR (steps P)) as C by (apply le_INR; lia). rewrite S_INR in C.
      rewrite Rabs_right by lra. lra.
    - intros j Hj. rewrite Rabs_R0. destruct (end_width _ _ HB) as (w & -> & _ & W0). apply W0. }
  destruct (between h) eqn:EB.
  { apply andb_prop in EB as [E0 E1]. apply R_lt in E0, E1. rewrite R0 in E0. rewrite R1 in E1. apply (Between al); [unfold al; lra|].
    intros a c Hac. specialize (Hrow a c Hac). destruct strict; lra. }
  destruct strict eqn:ES.
  - (* ... or inside the obstacle, so also a moment from the knot ... *)
    destruct (moment_near (rows o) (fun a => dotR a (mid 0) + dotR a off) (fun a => dotR a (mid 1) + -1 * dotR a (mid 0)) al) as (eta & He0 & Hn).
    { intros a c Hac. specialize (Hrow a c Hac). rewrite (dotR_ext a _ (fun j => (mid 0%R j + al * (mid 1%R j + -1 * mid 0%R j)) + off j)) in Hrow
        by (intros i _; cbv beta; rewrite (Mid al i); ring).
      rewrite (dotR_plus a (fun j => mid 0 j + al * (mid 1 j + -1 * mid 0 j)) off), (dotR_plus a (mid 0)), dotR_mult, (dotR_plus a (mid 1)), dotR_mult in Hrow. lra. }
    assert (exists s0, 0 < s0 < 1 /\ Rabs (s0 - al) <= eta) as (s0 & H0 & H1).
    { destruct (Rle_dec al (1 / 2)) as [C|C].
      - exists (al + Rmin eta (1 / 4)). assert (0 < Rmin eta (1 / 4)) by (apply Rmin_glb_lt; lra). pose proof (Rmin_l eta (1 / 4)). pose proof (Rmin_r eta (1 / 4)).
        split; [lra|]. rewrite Rabs_right by lra. lra.
      - exists (al - Rmin eta (1 / 4)). assert (0 < Rmin eta (1 / 4)) by (apply Rmin_glb_lt; lra). pose proof (Rmin_l eta (1 / 4)). pose proof (Rmin_r eta (1 / 4)).
        split; [lra|]. rewrite Rabs_left1 by lra. lra. }
    apply (Between s0 H0). intros a c Hac. specialize (Hn s0 H1 a c Hac).
    rewrite (dotR_ext a _ (fun j => (mid 0%R j + s0 * (mid 1%R j + -1 * mid 0%R j)) + off j)) by (intros i _; cbv beta; rewrite (Mid s0 i); ring).
    rewrite (dotR_plus a (fun j => mid 0 j + s0 * (mid 1 j + -1 * mid 0 j)) off), (dotR_plus a (mid 0)), dotR_mult, (dotR_plus a (mid 1)), dotR_mult. lra.
  - (* ... or the errors fit both neighbours of the knot. *)
    assert (EL : loose P bs h = true) by (unfold strict in ES; apply negb_false_iff; exact ES).
    unfold loose in EL. rewrite EB in EL. simpl in EL. set (j := knot_of h) in *.
    assert (Hj : (j <= steps P)%nat /\ INR j = INR t + al /\ (j = t \/ j = S t)).
    { unfold j, knot_of. fold t. destruct (qle 1 (share h)) eqn:E1.
      - apply R_le in E1. rewrite R1 in E1. fold al in E1. split; [lia|]. split; [|auto]. rewrite S_INR. lra.
      - apply R_nle in E1. rewrite R1 in E1. fold al in E1. split; [lia|]. split; [|auto].
        unfold between in EB. apply andb_false_iff in EB as [E|E].
        + unfold qlt in E. apply negb_false_iff in E. apply R_le in E. rewrite R0 in E. fold al in E. lra.
        + unfold qlt in E. apply negb_false_iff in E. apply R_le in E. rewrite R1 in E. fold al in E. lra. }
    destruct Hj as (Hj & Ej & _).
    assert (Fit : forall Es, In Es (at_knot P B j) -> forall i a, Rabs (e i a) <= toR (nth i Es []) a).
    { intros Es HE i a. apply mean_abs; [exact HW|]. intros v Hv. pose proof (Pick v Hv) as Hin.
      eapply forallb_forall in EL; [|exact Hin]. eapply forallb_forall in EL; [|exact IB]. eapply forallb_forall in EL; [|exact HE].
      apply (errors_fit_R P). exact EL. }
    exists (nudged P u y (INR j) 1 e (fun _ => 0)).
    split; [|split; [apply nudged_continuous|apply (Touch al (INR j) 1 Ej ltac:(lra) Hs); intros; apply Hrow; assumption]].
    apply nudged_in_tube; auto; [lra| | |].
    + intros t' s i a Ht' Hi Ha' Hs'. destruct (Nat.eq_dec t' j) as [->|N1]; [right|destruct (Nat.eq_dec (S t') j) as [<-|N2]; [right|left]].
      * rewrite <- widths_nth. apply Fit. unfold at_knot. destruct (Nat.ltb_spec j (steps P)); [|lia]. apply in_or_app. right. simpl. auto.
      * rewrite <- widths_nth. apply Fit. unfold at_knot. simpl Nat.ltb. apply in_or_app. left. simpl. rewrite Nat.sub_0_r. auto.
      * assert (S t' < j \/ j < t')%nat as [C|C] by lia; apply le_INR in C; rewrite !S_INR in C.
        -- rewrite Rabs_left1 by lra. lra.
        -- rewrite Rabs_right by lra. lra.
    + intros i Hi. destruct (Nat.eq_dec j (steps P)) as [E|E]; [right|left].
      * eapply Rle_trans; [apply (Fit (chunk_vec (n_p P) (n_points P) (width (final B))))|].
        -- unfold at_knot. destruct (Nat.ltb_spec j (steps P)); [lia|]. apply in_or_app. right. simpl. auto.
        -- rewrite chunk_vec_nth by (apply Nat.div_lt_upper_bound; lia). unfold toR.
           rewrite nth_firstn_lt by (apply Nat.mod_upper_bound; lia). rewrite nth_skipn'.
           replace (i / n_p P * n_p P + i mod n_p P)%nat with i; [lra|]. pose proof (Nat.div_mod i (n_p P) ltac:(lia)). lia.
      * assert (S j <= steps P)%nat as C by lia. apply le_INR in C. rewrite S_INR in C. rewrite Rabs_right by lra. lra.
    + intros i Hi. rewrite Rabs_R0. destruct (end_width _ _ HB) as (w & -> & _ & W0). apply W0.
Qed.
End Leaf.
