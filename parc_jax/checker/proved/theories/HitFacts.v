(* A hit: where each corner of a hull has a contact with the obstacle, every plan in it has a
   trajectory that touches. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts SeparationFacts
  BinFacts ConditionFacts Doubt DoubtFacts.
From ParcJax Require Import NoPlan Trajectories HullFacts LeafFacts PoolFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- A moment beside a knot ---- *)
Lemma moment_near (A : poly) (p q : vec -> R) s0 : (forall a b, In (a, b) A ->
  p a + s0 * q a < Q2R b) ->
  exists eta, 0 < eta /\ forall s, Rabs (s - s0) <= eta -> forall a b, In (a, b) A ->
    p a + s * q a <= Q2R b.
Proof.
  induction A as [|[a b] A IH]; intro H; [exists 1; split; [lra|intros s _ a b []]|].
  destruct IH as (e & He & IH); [intros; apply H; simpl; auto|].
  specialize (H a b (or_introl eq_refl)).
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
Lemma len_blended n lam : forall Ps, (forall Q, In Q Ps -> length Q = n) ->
  length (blended n lam Ps) = n.
Proof.
  induction lam as [|l lam IH]; intros [|Q Ps] H; simpl; try apply repeat_length.
  assert (LQ : length (map (ascale l) Q) = n) by (rewrite map_length; apply H; simpl; auto).
  rewrite len_zadd; [exact LQ|]. rewrite IH, LQ; [reflexivity|]. intros; apply H; simpl; auto.
Qed.
Lemma at_scale l X x i : at_forms (map (ascale l) X) x i = Q2R l * at_forms X x i.
Proof.
  unfold at_forms. destruct (Nat.lt_ge_cases i (length X)) as [H|H].
  - rewrite (nth_indep _ _ (ascale l (aconst 0))) by (rewrite map_length; exact H). rewrite map_nth.
    apply affR_scale.
  - rewrite !nth_overflow by (rewrite ?map_length; exact H). rewrite affR_const, R0. ring.
Qed.
Lemma blended_R n lam : forall Ps x i, (i < n)%nat -> (forall Q, In Q Ps -> length Q = n) ->
  at_forms (blended n lam Ps) x i = mix (real lam) (map (fun Q => at_forms Q x) Ps) i.
Proof.
  induction lam as [|l lam IH]; intros [|Q Ps] x i Hi H; simpl;
    try (unfold at_forms; rewrite nth_repeat, affR_const; apply R0).
  assert (LQ : length Q = n) by (apply H; simpl; auto).
  assert (HP : forall Q', In Q' Ps -> length Q' = n) by (intros; apply H; simpl; auto).
  rewrite at_zadd by (rewrite ?map_length, ?len_blended; auto; lia).
  rewrite at_scale, IH by assumption. reflexivity.
Qed.

Lemma mix_const (lam : list R) {A} (l : list A) (f : rv) a : weights lam (length l) ->
  mix lam (map (fun _ => f) l) a = f a.
Proof.
  intros (L & _ & S). replace (f a) with (fold_right Rplus 0 lam * f a) by (rewrite S; ring).
  clear S.
  revert lam L. induction l as [|x l IH]; intros [|m lam] L; try discriminate; simpl; [ring|].
  rewrite IH by (simpl in L; lia). ring.
Qed.
Lemma affR_ext f x z : (forall i, x i = z i) -> affR f x = affR f z.
Proof. intro H. unfold affR. rewrite (dotR_ext (fst f) x z) by (intros; apply H). reflexivity. Qed.
Lemma affR_mean {A} mu (V : list A) f (x : A -> rv) : weights mu (length V) ->
  affR f (fun j => mean mu V (fun v => x v j)) = mean mu V (fun v => affR f (x v)).
Proof.
  intros (L & _ & S). unfold affR at 1. rewrite (mean_dot mu V (fst f) x).
  replace (Q2R (snd f)) with (mean mu V (fun _ => Q2R (snd f))) by (rewrite (mean_const mu V _
    L), S; ring).
  rewrite <- mean_plus. reflexivity.
Qed.

Section Leaf.
Variables (P : problem) (N : list layer).
Hypothesis SP : sizes P N.
Variables (u k : rv) (B : bin) (bs : list bin) (h : hit) (o : obstacle) (b :
  part) (Zs W : list vec).
Let y := netR N k.
Let n := n_p P.
Let state := stateR N (cut_off (n_k P) k).
Let F := frame_of P N.
Hypothesis HB : open_bin P B.
Hypothesis IB : In B bs.
Hypothesis Ho : In o (obstacles P).
Hypothesis Hb : In b (parts P).
Hypothesis Ht : (first o <= step h <= last o)%nat.
Hypothesis Hs : 0 <= Q2R (share h) <= 1.
Hypothesis Hg : forallb (fun g => is_mixture (length (corners b)) (blend g) &&
                                  forallb (contact_ok P bs b (step h)) (contacts g))
                                    (groups h) = true.
Hypothesis HZ : cone Zs (cut_off n (endR P u y)) 1.
Hypothesis LZ : forall z, In z Zs -> length z = n.
(* The points of W stand for what the last hidden layer may hold, and rows are asked in another
   form, which is enough. *)
Variables (held_at : vec -> rv) (low : row -> row).
Hypothesis HW : exists nu, weights nu (length W) /\ forall i, state i = mean nu W (fun w =>
  held_at w i).
Hypothesis Hlow : forall z w r, length z = n -> holdsQ (z ++ w) (low r) = true ->
  rowR (join n (toR z) (held_at w)) r.
Let strict := negb (loose P bs b h).
Hypothesis Ha : forall z, In z Zs ->
  existsb (fun some => forallb (fun w => existsb (forallb (holdsQ (z ++ w))) some) W) 
    (map (fun g => map (map low) (ways_to_touch P F h o b strict g)) (groups h)) = true.
Let M (g : group) := blended n (blend g) (map (fun i => moment P F (step h) i (share h))
  (corners b)).

Definition group_at (z : vec) : group :=
  match find (fun g => forallb (fun w => existsb (forallb (holdsQ (z ++ w))) (map (map low)
    (ways_to_touch P F h o b strict g))) W) (groups h) with
  | Some g => g
  | None => Group [] []
  end.
Definition contact_at (v : vec * vec) : contact :=
  let g := group_at (fst v) in
  match find (fun c => forallb (holdsQ (fst v ++ snd v)) (map low (touching strict (rows o) (M g)
    (offset b (blend g) c)))) (contacts g) with
  | Some c => c
  | None => Contact [] []
  end.
Lemma group_at_ok z : In z Zs -> In (group_at z) (groups h) /\
  forall w, In w W -> existsb (forallb (holdsQ (z ++ w))) (map (map low) (ways_to_touch P F h o b
    strict (group_at z))) = true.
Proof.
  intro Hz. unfold group_at. destruct (find _ _) as [g|] eqn:E.
  - apply find_some in E as [E1 E2]. split; [exact E1|]. intros w Hw. eapply forallb_forall in E2;
      [exact E2|exact Hw].
  - exfalso. specialize (Ha z Hz). apply existsb_exists in Ha as (some & Hin & H).
    apply in_map_iff in Hin as (g & <- & Hin).
    pose proof (find_none _ _ E g Hin) as K. cbv beta in K. congruence.
Qed.
Lemma contact_at_ok v : In (fst v) Zs -> In (snd v) W ->
  In (contact_at v) (contacts (group_at (fst v))) /\
  forallb (holdsQ (fst v ++ snd v)) (map low (touching strict (rows o) (M (group_at (fst v)))
    (offset b (blend (group_at (fst v))) (contact_at v)))) = true.
Proof.
  intros Hz Hw. unfold contact_at. destruct (find _ _) as [c|] eqn:E; [apply find_some in E;
    exact E|]. exfalso.
  destruct (group_at_ok (fst v) Hz) as [_ H]. specialize (H (snd v) Hw).
  apply existsb_exists in H as (rs & Hin & HR).
  unfold ways_to_touch in Hin. cbv zeta in Hin. rewrite map_map in Hin.
  apply in_map_iff in Hin as (c & <- & Hin).
  pose proof (find_none _ _ E c Hin) as K. cbv beta in K. unfold M, n in K. congruence.
Qed.
Let line_of (w : rv) (s : R) (i a : nat) : R := (1 - s) * knotR P w y (step h) i a + s * knotR P w y
  (S (step h)) i a.
(* where p0 is if z is the end *)
Let seen (z : vec) : rv := fun a => u a + (toR z a + -1 * endR P u y a).
Lemma seen_end z i : (i < n)%nat -> endR P (seen z) y i = toR z i.
Proof.
  intro Hi. unfold seen, endR. unfold n in Hi. pose proof (some_point _ _ SP).
  assert (i < n_points P * n_p P)%nat by (assert (1 * n_p P <= n_points P * n_p P)%nat
    by (apply Nat.mul_le_mono_r; lia); lia).
  destruct (Nat.ltb_spec i (n_points P * n_p P)) as [_|C]; [|lia].
  rewrite Nat.mod_small by exact Hi. destruct (Nat.ltb_spec i (n_points P * n_p P)) as [_|C];
    [|lia].
  rewrite Nat.mod_small by exact Hi. ring.
Qed.
Lemma seen_line z s i a : line_of (seen z) s i a = line_of u s i a + (toR z a + -1 * endR P u y a).
Proof. unfold line_of, seen, knotR. ring. Qed.
Lemma blend_R g z a : is_mixture (length (corners b)) (blend g) = true -> (a < n)%nat ->
  at_forms (M g) (join n (toR z) state) a =
  mix (real (blend g)) (map (line_of u (Q2R (share h))) (corners b)) a + (toR z a + -1 *
    endR P u y a).
Proof.
  intros Hm Ha'. pose proof (last_step _ _ SP o Ho) as Hlast.
  assert (LM : forall Q, In Q (map (fun i => moment P F (step h) i (share h)) (corners b)) ->
    length Q = n).
  { intros Q HQ. apply in_map_iff in HQ as (i & <- & Hi). pose proof (part_points _ _ SP b i Hb Hi)
      as Hp. unfold moment.
    destruct (knots_R P N SP u k (step h) i ltac:(lia) Hp) as [L1 _].
    destruct (knots_R P N SP u k (S (step h)) i ltac:(lia) Hp) as [L2 _].
    rewrite len_zadd; rewrite !map_length; [exact L1|]. unfold F. congruence. }
  unfold M. rewrite blended_R by assumption. rewrite map_map.
  transitivity (mix (real (blend g)) (map (fun i a => line_of u (Q2R (share h)) i a + (toR z a + -1
    * endR P u y a)) (corners b)) a).
  - apply mix_ext. intros i Hi. cbv beta. rewrite <- seen_line.
    pose proof (part_points _ _ SP b i Hb Hi) as Hp. unfold moment.
    destruct (knots_R P N SP (seen z) k (step h) i ltac:(lia) Hp) as [L1 K1].
    destruct (knots_R P N SP (seen z) k (S (step h)) i ltac:(lia) Hp) as [L2 K2].
    rewrite at_zadd by (rewrite map_length; unfold F, n in *; lia). rewrite !at_scale.
    assert (X : forall G c, at_forms G (join n (toR z) state) c = at_forms G (join (n_p P) (endR P
      (seen z) (netR N k)) (stateR N (cut_off (n_k P) k))) c).
    { intros G c. apply affR_ext. intro j. unfold join. fold n.
      destruct (Nat.ltb_spec j n) as [C|C]; [|reflexivity].
      symmetry. apply (seen_end z j C). }
    rewrite !X. unfold F. rewrite K1, K2 by exact Ha'. rewrite R_add, Q2R_opp, R1.
    unfold line_of, y. ring.
  - rewrite (mix_plus _ (line_of u (Q2R (share h))) (fun _ a => toR z a + -1 * endR P u y a)).
    f_equal.
    apply (mix_const _ _ (fun a => toR z a + -1 * endR P u y a)). apply is_mixture_R. exact Hm.
Qed.

Lemma hit_leaf : exists tau, in_tube P N B u k tau /\ continuous tau /\ touches P tau.
Proof.
  destruct (hull_mean Zs _ HZ) as (mu & HMu & HXz). destruct HW as (nu & HNu & HXw).
  destruct (mean_pairs mu nu Zs W HMu HNu) as (pi & HPi & Nest). set (V := list_prod Zs W) in *.
  pose proof HMu as (Lmu & Pmu & Smu). pose proof HNu as (Lnu & _ & Snu).
  pose proof HPi as (Lpi & Ppi & Spi).
  pose proof (some_axis _ _ SP) as SA. pose proof (some_step _ _ SP) as ST.
  pose proof (last_step _ _ SP o Ho) as Hlast.
  set (t := step h) in *. set (al := Q2R (share h)) in *.
  assert (InV : forall v, In v V -> In (fst v) Zs /\ In (snd v) W) by (intros [z w] Hv;
    apply in_prod_iff in Hv; exact Hv).
  set (bl := fun v : vec * vec => blend (group_at (fst v))).
  assert (Group : forall v, In v V -> In (group_at (fst v)) (groups h)) by (intros v Hv;
    apply group_at_ok, InV, Hv).
  assert (Picked : forall v, In v V -> In (contact_at v) (contacts (group_at (fst v)))).
  { intros v Hv. destruct (InV v Hv). apply contact_at_ok; assumption. }
  assert (Mixture : forall v, In v V -> is_mixture (length (corners b)) (bl v) = true).
  { intros v Hv. eapply forallb_forall in Hg; [|apply Group; exact Hv].
    apply andb_prop in Hg as [Hg1 _]. exact Hg1. }
  assert (Okay : forall v, In v V -> contact_ok P bs b t (contact_at v) = true).
  { intros v Hv. eapply forallb_forall in Hg; [|apply Group; exact Hv].
    apply andb_prop in Hg as [_ Hg1].
    eapply forallb_forall in Hg1; [exact Hg1|apply Picked; exact Hv]. }
  assert (Fits : forall v, In v V -> errors_fit n (errors_at B b t) (contact_at v) = true).
  { intros v Hv. pose proof (Okay v Hv) as K. unfold contact_ok in K. apply andb_prop in K as [_ K].
    eapply forallb_forall in K; eauto. }
  destruct (mean_weights pi V (length (corners b)) bl HPi Mixture) as (lam & HL & Lam).
  destruct (pooled pi V n (n_points P) (corners b) (fun v => real (bl v)) (fun v =>
    map toR (errors (contact_at v))) HPi) as (e & HE & Hpool).
  { intros c Hc. apply (part_points _ _ SP b c Hb Hc). }
  { intros v Hv. split; [apply is_mixture_R, Mixture; exact Hv|].
    destruct (errors_fit_R _ _ _ (Fits v Hv)) as [L _].
    rewrite map_length, L. apply map_length. }
  assert (Allowed : forall Es : nat -> error, (forall i, inError n (Es i) (fun _ => 0)) ->
      (forall v, In v V -> errors_fit n (map Es (corners b)) (contact_at v) = true) ->
        forall i, inError n (Es i) (e i)).
  { intros Es E0 HF. apply HE; [exact E0|]. intros v c x Hv Hin.
    destruct (errors_fit_R _ _ _ (HF v Hv)) as [_ K].
    assert (G : forall cs es, In (c, x) (combine cs (map toR es)) ->
      exists q, In (Es c, q) (combine (map Es cs) es) /\ x = toR q).
    { clear. induction cs as [|d cs IH]; intros [|q es] H; simpl in H; try destruct H as [].
      - injection H as <- <-. exists q. simpl. auto.
      - destruct (IH es H) as (q' & H1 & H2). exists q'. simpl. auto. }
    destruct (G _ _ Hin) as (q & Hq & ->). exact (K _ _ Hq). }
  set (G := fun a : nat => mean pi V (fun v =>
    toR (body_point (grown_by b) (body (contact_at v))) a)).
  assert (HG : inShape n (grown_by b) G).
  { apply (shape_mean pi V n (grown_by b) (fun v => body (contact_at v)));
      [exact HPi|apply (part_shape _ _ SP); exact Hb|].
    intros v Hv. pose proof (Okay v Hv) as K. unfold contact_ok in K. apply andb_prop in K as [K _].
    exact K. }
  assert (He : forall i, inError n (nth i (nth t (interval B) []) (Rows [])) (e i)).
  { apply Allowed; [intro i; apply (all_open _ _ HB)|exact Fits]. }
  set (off := fun a => G a + mix lam (map e (corners b)) a).
  set (mid := fun (s : R) (a : nat) => mix lam (map (fun i a => (1 - s) * knotR P u y t i a + s *
    knotR P u y (S t) i a) (corners b)) a).
  assert (Hoff : forall a, mean pi V (fun v => toR (offset b (bl v) (contact_at v)) a) = off a).
  { intro a. unfold off, G, offset. rewrite (Lam (map e (corners b))) by apply map_length.
    rewrite Hpool, <- mean_plus.
    apply mean_ext. intros v _. rewrite toR_vadd, mixQ_R. reflexivity. }
  assert (Hmid : forall a, (a < n)%nat -> mean mu Zs (fun z =>
    at_forms (M (group_at z)) (join n (toR z) state) a) = mid al a).
  { intros a Ha'. rewrite (mean_ext mu Zs _ (fun z => mix (real (blend (group_at z))) (map (line_of
      u al) (corners b)) a +
      (toR z a + -1 * endR P u y a))).
    - rewrite !mean_plus, (mean_const mu Zs (-1 * endR P u y a) Lmu), Smu, <- HXz.
      replace (cut_off n (endR P u y) a) with (endR P u y a) by (unfold cut_off;
        destruct (Nat.ltb_spec a n); [reflexivity|lia]).
      unfold mid. rewrite (Lam (map _ (corners b))) by apply map_length. rewrite Nest.
      rewrite (mean_ext mu Zs (fun z => mean nu W _) (fun z => mix (real (blend (group_at z)))
        (map (line_of u al) (corners b)) a)); [ring|].
      intros z _. unfold bl. cbn [fst]. rewrite (mean_const nu W _ Lnu), Snu. apply Rmult_1_l.
    - intros z Hz. apply blend_R; [|exact Ha']. eapply forallb_forall in Hg;
        [|apply group_at_ok; exact Hz].
      apply andb_prop in Hg as [Hg1 _]. exact Hg1. }
  assert (Hrow : forall a c, In (a, c) (rows o) ->
     if strict then dotR a (fun j => mid al j + off j) < Q2R c else dotR a (fun j =>
       mid al j + off j) <= Q2R c).
  { intros a c Hac. assert (La : length a = n) by (apply (poly_len n (rows o) a c);
      [apply (obstacle_rows _ _ SP); exact Ho|exact Hac]).
    rewrite (dotR_plus a (mid al) off).
    rewrite (dotR_ext a off (fun j => mean pi V (fun v => toR (offset b (bl v) (contact_at v)) j)))
      by (intros; symmetry; apply Hoff).
    rewrite (mean_dot pi V a (fun v => toR (offset b (bl v) (contact_at v)))).
    rewrite (dotR_ext a (mid al) (fun j => mean mu Zs (fun z =>
      at_forms (M (group_at z)) (join n (toR z) state) j)))
      by (intros j Hj; symmetry; apply Hmid; lia).
    rewrite (mean_dot mu Zs a (fun z => at_forms (M (group_at z)) (join n (toR z) state))).
    set (f := fun z => lincomb a (M (group_at z))).
    assert (Ef : mean mu Zs (fun z => dotR a (at_forms (M (group_at z)) (join n (toR z) state))) =
                 mean pi V (fun v => affR (f (fst v)) (join n (toR (fst v)) (held_at (snd v))))).
    { rewrite Nest. apply mean_ext. intros z Hz. cbn [fst snd]. rewrite <- affR_lincomb. fold (f z).
      rewrite <- (affR_mean nu W (f z) (fun w => join n (toR z) (held_at w)) HNu).
      apply affR_ext. intro j.
      unfold join. destruct (Nat.ltb_spec j n); [rewrite (mean_const nu W _ Lnu), Snu;
        ring|apply HXw]. }
    rewrite Ef, <- mean_plus. replace (Q2R c) with (mean pi V (fun _ => Q2R c))
      by (rewrite (mean_const pi V _ Lpi), Spi; ring).
    assert (Hv : forall v, In v V -> if strict then affR (f (fst v)) (join n (toR (fst v)) (held_at
      (snd v))) + dotR a (toR (offset b (bl v) (contact_at v))) < Q2R c
                 else affR (f (fst v)) (join n (toR (fst v)) (held_at (snd v))) + dotR a
                   (toR (offset b (bl v) (contact_at v))) <= Q2R c).
    { intros v Hv. destruct (InV v Hv) as [Hz Hw]. destruct (contact_at_ok v Hz Hw) as [_ K].
      assert (R : rowR (join n (toR (fst v)) (held_at (snd v)))
                       (strict, aadd (aneg (f (fst v))) (aconst (qadd c (- dotQ a (offset b (bl v)
                         (contact_at v))))))).
      { apply Hlow; [apply LZ; exact Hz|]. eapply forallb_forall in K; [exact K|]. apply in_map.
        unfold touching. apply in_map_iff.
        exists (a, c). split; [reflexivity|exact Hac]. } unfold rowR in R. cbn [fst snd] in R.
        rewrite affR_add, affR_neg, affR_const, R_add, Q2R_opp, dotQ_R in R.
      destruct strict; lra. }
    destruct strict; [apply mean_lt; auto; lra|apply mean_le; auto]. }
  assert (Mid : forall s a, mid s a = mid 0 a + s * (mid 1 a - mid 0 a)).
  { intros s a. unfold mid. set (f := fun i => knotR P u y t i). set (g := fun i =>
      knotR P u y (S t) i).
    rewrite (mix_plus lam (fun i a => (1 - s) * f i a) (fun i a => s * g i a)), !mix_scale.
    rewrite (mix_plus lam (fun i a => (1 - 0) * f i a) (fun i a => 0 * g i a)), !mix_scale.
    rewrite (mix_plus lam (fun i a => (1 - 1) * f i a) (fun i a => 1 * g i a)), !mix_scale. ring. }
  (* it is enough to have a moment at which everything fits *)
  assert (Touch : forall s0 c r, c = INR t + s0 -> 0 < r -> 0 <= s0 <= 1 ->
    (forall a c, In (a, c) (rows o) ->
      dotR a (fun j => mid s0 j + off j) <= Q2R c) -> touches P (nudged P u y c r e (fun _ => 0))).
  { intros s0 c r -> Hr Hs0 Hin. exists o, t, s0, b, (fun j => mid s0 j + off j).
    split; [exact Ho|]. split; [exact Ht|]. split; [exact Hs0|]. split; [exact Hb|].
    split; [|intros a c Hac; apply Hin; exact Hac].
    exists lam, G. split; [exact HL|]. split; [exact HG|]. intros a _. unfold off, mid.
    rewrite (mix_ext lam (at_ (nudged P u y (INR t + s0) r e (fun _ => 0)) (INR t + s0))
       (fun i a => ((1 - s0) * knotR P u y t i a + s0 * knotR P u y (S t) i a) + e i a)).
    - rewrite (mix_plus lam (fun i a => (1 - s0) * knotR P u y t i a + s0 * knotR P u y (S t) i a)
        e). rewrite Rplus_assoc. f_equal. apply Rplus_comm.
    - intros i _. rewrite nudged_at by (try exact Hs0; lia). rewrite bump_at by exact Hr. ring. }
  (* either strictly between two knots ... *)
  assert (Between : forall s0, 0 < s0 < 1 -> (forall a c, In (a, c) (rows o) -> dotR a (fun j =>
    mid s0 j + off j) <= Q2R c) ->
      exists tau, in_tube P N B u k tau /\ continuous tau /\ touches P tau).
  { intros s0 H0 Hin. set (r := Rmin s0 (1 - s0)).
    assert (Hr : 0 < r) by (apply Rmin_glb_lt; lra). assert (r <= s0) by apply Rmin_l.
    assert (r <= 1 - s0) by apply Rmin_r.
    exists (nudged P u y (INR t + s0) r e (fun _ => 0)).
    split; [|split; [apply nudged_continuous|apply (Touch s0 (INR t + s0) r eq_refl Hr);
      [lra|exact Hin]]].
    apply nudged_away; auto.
    - assert (INR (S t) <= INR (steps P)) as C by (apply le_INR; lia). rewrite S_INR in C.
      rewrite Rabs_right by lra. lra.
    - intros t' s i Ht' Hi Hs'. destruct (Nat.lt_trichotomy t' t) as [C|[->|C]]; [left|right;
        apply He|left].
      + apply le_INR in C. rewrite S_INR in C. rewrite Rabs_left1 by lra. lra.
      + apply le_INR in C. rewrite S_INR in C. rewrite Rabs_right by lra. lra. }
  destruct (between h) eqn:EB.
  { apply andb_prop in EB as [E0 E1]. apply R_lt in E0, E1. rewrite R0 in E0. rewrite R1 in E1.
    apply (Between al); [unfold al; lra|].
    intros a c Hac. specialize (Hrow a c Hac). destruct strict; lra. }
  destruct strict eqn:ES.
  - (* ... or inside the obstacle, so also a moment from the knot ... *)
    destruct (moment_near (rows o) (fun a => dotR a (mid 0) + dotR a off) (fun a =>
      dotR a (mid 1) + -1 * dotR a (mid 0)) al) as (eta & He0 & Hn).
    { intros a c Hac. specialize (Hrow a c Hac). rewrite (dotR_ext a _ (fun j =>
        (mid 0%R j + al * (mid 1%R j + -1 * mid 0%R j)) + off j)) in Hrow
        by (intros i _; cbv beta; rewrite (Mid al i); ring).
      rewrite (dotR_plus a (fun j => mid 0 j + al * (mid 1 j + -1 * mid 0 j)) off),
        (dotR_plus a (mid 0)), dotR_mult, (dotR_plus a (mid 1)), dotR_mult in Hrow. lra. }
    assert (exists s0, 0 < s0 < 1 /\ Rabs (s0 - al) <= eta) as (s0 & H0 & H1).
    { destruct (Rle_dec al (1 / 2)) as [C|C].
      - exists (al + Rmin eta (1 / 4)). assert (0 < Rmin eta (1 / 4)) by (apply Rmin_glb_lt; lra).
        pose proof (Rmin_l eta (1 / 4)). pose proof (Rmin_r eta (1 / 4)).
        split; [lra|]. rewrite Rabs_right by lra. lra.
      - exists (al - Rmin eta (1 / 4)). assert (0 < Rmin eta (1 / 4)) by (apply Rmin_glb_lt; lra).
        pose proof (Rmin_l eta (1 / 4)). pose proof (Rmin_r eta (1 / 4)).
        split; [lra|]. rewrite Rabs_left1 by lra. lra. }
    apply (Between s0 H0). intros a c Hac. specialize (Hn s0 H1 a c Hac).
    rewrite (dotR_ext a _ (fun j => (mid 0%R j + s0 * (mid 1%R j + -1 * mid 0%R j)) + off j))
      by (intros i _; cbv beta; rewrite (Mid s0 i); ring).
    rewrite (dotR_plus a (fun j => mid 0 j + s0 * (mid 1 j + -1 * mid 0 j)) off),
      (dotR_plus a (mid 0)), dotR_mult, (dotR_plus a (mid 1)), dotR_mult. lra.
  - (* ... or the errors fit both neighbours of the knot. *)
    assert (EL : loose P bs b h = true) by (unfold strict in ES; apply negb_false_iff; exact ES).
    unfold loose in EL. rewrite EB in EL. simpl in EL. set (j := knot_of h) in *.
    assert (Hj : (j <= steps P)%nat /\ INR j = INR t + al).
    { unfold j, knot_of. fold t. destruct (qle 1 (share h)) eqn:E1.
      - apply R_le in E1. rewrite R1 in E1. fold al in E1. split; [lia|]. rewrite S_INR. lra.
      - apply R_nle in E1. rewrite R1 in E1. fold al in E1. split; [lia|].
        unfold between in EB. apply andb_false_iff in EB as [E|E].
        + unfold qlt in E. apply negb_false_iff in E. apply R_le in E. rewrite R0 in E.
          fold al in E. lra.
        + unfold qlt in E. apply negb_false_iff in E. apply R_le in E. rewrite R1 in E.
          fold al in E. lra. }
    destruct Hj as (Hj & Ej).
    assert (Fit : forall v, In v V -> fits_knot P b j (contact_at v) B = true).
    { intros v Hv. eapply forallb_forall in EL; [|apply Group; exact Hv].
      eapply forallb_forall in EL; [|apply Picked; exact Hv].
      eapply forallb_forall in EL; [exact EL|exact IB]. }
    exists (nudged P u y (INR j) 1 e (fun _ => 0)).
    split; [|split; [apply nudged_continuous|apply (Touch al (INR j) 1 Ej ltac:(lra) Hs); intros;
      apply Hrow; assumption]].
    assert (Hin : forall t' s i, (t' < steps P)%nat -> (i < n_points P)%nat -> 0 <= s <= 1 ->
      1 <= Rabs (INR t' + s - INR j) \/ inError n (nth i (nth t' (interval B) []) (Rows [])) (e i)).
    { intros t' s i Ht' Hi Hs'. destruct (Nat.eq_dec t' j) as [->|N1];
        [right|destruct (Nat.eq_dec (S t') j) as [E|N2]; [right|left]].
      - apply (Allowed (fun i => nth i (nth j (interval B) []) (Rows []))); [intro;
          apply (all_open _ _ HB)|]. intros v Hv. specialize (Fit v Hv). unfold fits_knot in Fit.
        apply andb_prop in Fit as [_ Fit]. destruct (Nat.ltb_spec j (steps P)); [exact Fit|lia].
      - apply (Allowed (fun i => nth i (nth t' (interval B) []) (Rows []))); [intro;
          apply (all_open _ _ HB)|]. intros v Hv. specialize (Fit v Hv). unfold fits_knot in Fit.
        apply andb_prop in Fit as [Fit _]. destruct (Nat.ltb_spec 0 j); [|lia].
        replace (j - 1)%nat with t' in Fit by lia. exact Fit.
      - assert (S t' < j \/ j < t')%nat as [C|C] by lia; apply le_INR in C; rewrite !S_INR in C.
        + rewrite Rabs_left1 by lra. lra.
        + rewrite Rabs_right by lra. lra. }
    destruct (Nat.eq_dec j (steps P)) as [E|E].
    2: { apply nudged_away; auto; [lra|]. assert (S j <= steps P)%nat as C by lia. apply le_INR
      in C. rewrite S_INR in C.
         rewrite Rabs_right by lra. lra. }
    apply nudged_in_tube; auto; [lra|]. rewrite E, bump_at by lra.
    set (ws := chunk_vec (n_p P) (n_points P) (width (final B))).
    assert (Last : forall v, In v V -> has_widths (final B) = true /\ errors_fit n (map (fun i =>
      Widths (nth i ws [])) (corners b)) (contact_at v) = true).
    { intros v Hv. specialize (Fit v Hv). unfold fits_knot in Fit.
      apply andb_prop in Fit as [_ Fit].
      destruct (Nat.ltb_spec j (steps P)); [lia|]. apply andb_prop in Fit. exact Fit. }
    assert (exists v, In v V) as [v0 Hv0].
    { destruct V as [|v0 V0]; [|exists v0; simpl; auto]. destruct pi as [|l pi']; [simpl in Spi;
        lra|discriminate]. }
    destruct (Last v0 Hv0) as [HWf _]. pose proof (end_fit _ _ HB) as EF.
    rewrite (widths_of _ HWf) in EF |- *.
    cbn [error_ok] in EF. apply andb_prop in EF as [Lw W0]. apply Nat.eqb_eq in Lw.
    pose proof (nonneg_R _ W0) as Pw.
    intros i Hi. destruct (Nat.ltb_spec i (n_points P * n_p P)) as [C|C]; [|rewrite Rabs_R0;
      apply Pw]. rewrite Rmult_1_l.
    assert (Hq : (i / n_p P < n_points P)%nat) by (apply Nat.div_lt_upper_bound; lia).
    assert (Hr : (i mod n_p P < n_p P)%nat) by (apply Nat.mod_upper_bound; lia).
    assert (K : inError n (Widths (nth (i / n_p P) ws [])) (e (i / n_p P)%nat)).
    { apply (Allowed (fun i => Widths (nth i ws []))); [|intros v Hv; apply (Last v Hv)].
      intros q c Hc. rewrite Rabs_R0.
      destruct (Nat.lt_ge_cases q (n_points P)) as [Cq|Cq].
      - unfold ws. rewrite chunk_vec_R by assumption. apply Pw.
      - rewrite nth_overflow by (unfold ws; rewrite chunk_vec_len; exact Cq).
        rewrite toR_nil. lra. }
    specialize (K (i mod n_p P)%nat Hr). eapply Rle_trans; [exact K|]. unfold ws.
    rewrite chunk_vec_R by assumption.
    replace (i / n_p P * n_p P + i mod n_p P)%nat with i; [lra|].
    pose proof (Nat.div_mod i (n_p P) ltac:(lia)). lia.
Qed.
End Leaf.
