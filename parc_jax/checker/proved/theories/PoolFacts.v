(* Mixtures, and what contacts of several mixtures have in common: one mixture of the points, one
   error for each. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts ConditionFacts Doubt DoubtFacts
  NoPlan Trajectories HullFacts LeafFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Mixtures ---- *)
Definition real (lam : vec) : list R := map Q2R lam.
Lemma mixQ_R lam : forall vs a, toR (mixQ lam vs) a = mix (real lam) (map toR vs) a.
Proof. induction lam as [|l lam IH]; intros [|v vs] a; simpl; try apply toR_nil.
rewrite toR_vadd, toR_vscale, IH. reflexivity. Qed.
Lemma mix_ext (lam : list R) {A} (f g : A -> rv) l a : (forall x, In x l -> f x a = g x a) ->
  mix lam (map f l) a = mix lam (map g l) a.
Proof.
  revert lam. induction l as [|x l IH]; intros [|m lam] H; simpl; try reflexivity.
  rewrite (H x), IH; simpl; auto. intros; apply H; simpl; auto.
Qed.
Lemma mix_plus (lam : list R) {A} (f g : A -> rv) l a :
  mix lam (map (fun x a => f x a + g x a) l) a = mix lam (map f l) a + mix lam (map g l) a.
Proof. revert lam. induction l as [|x l IH]; intros [|m lam]; simpl; try ring.
rewrite IH. ring. Qed.
Lemma mix_scale (lam : list R) {A} c (f : A -> rv) l a : mix lam (map (fun x a => c * f x a) l) a
  = c * mix lam (map f l) a.
Proof. revert lam. induction l as [|x l IH]; intros [|m lam]; simpl; try ring.
rewrite IH. ring. Qed.
Lemma mean_mix {A B} (mu : list R) (V : list A) (lam : list R) (f : A -> B -> rv) l a :
  mean mu V (fun v => mix lam (map (f v) l) a) = mix lam (map (fun x a => mean mu V (fun v =>
    f v x a)) l) a.
Proof.
  revert lam. induction l as [|x l IH]; intros [|m lam]; simpl; try apply mean_zero.
  rewrite mean_plus, mean_scale, IH. reflexivity.
Qed.
Lemma sum_R l : Q2R (fold_right qadd 0%Q l) = fold_right Rplus 0 (real l).
Proof. induction l as [|a l IH]; simpl; [apply R0|]. rewrite R_add, IH. reflexivity. Qed.
Lemma is_mixture_R n lam : is_mixture n lam = true -> weights (real lam) n.
Proof.
  unfold is_mixture. rewrite !andb_true_iff. intros [[L P] S]. unfold real.
  split; [rewrite map_length; apply Nat.eqb_eq; exact L|]. split.
  - apply Forall_forall. intros x Hx. apply in_map_iff in Hx as (q & <- & Hq).
    eapply forallb_forall in P; [|exact Hq].
    apply R_le in P. rewrite R0 in P. exact P.
  - change (map Q2R lam) with (real lam). rewrite <- sum_R. apply Qeq_bool_eq, Qeq_eqR in S.
    rewrite S. apply R1.
Qed.

(* ---- Shapes and widths are convex ---- *)
Lemma mean_weights {A} mu (V : list A) n (w : A -> vec) : weights mu (length V) ->
  (forall v, In v V -> is_mixture n (w v) = true) ->
  exists lam, weights lam n /\ forall (ps : list rv), length ps = n -> forall a,
    mix lam ps a = mean mu V (fun v => mix (real (w v)) ps a).
Proof.
  intros (L & P & S) H. exists (map (fun j => mean mu V (fun v => Q2R (nth j (w v) 0%Q)))
    (seq 0 n)). split.
  - split; [rewrite map_length, seq_length; reflexivity|]. split.
    + apply Forall_forall. intros x Hx. apply in_map_iff in Hx as (j & <- & _).
      rewrite <- (mean_zero mu V). apply mean_le; [exact P|].
      intros v Hv. specialize (H v Hv). unfold is_mixture in H. rewrite !andb_true_iff in H.
      destruct H as [[_ H] _].
      apply (nonneg_R _ H j).
    + assert (G : forall n (w : A -> vec), (forall v, In v V -> length (w v) = n) ->
        fold_right Rplus 0 (map (fun j => mean mu V (fun v => Q2R (nth j (w v) 0%Q))) (seq 0 n)) =
        mean mu V (fun v => fold_right Rplus 0 (real (w v)))).
      { clear. induction n as [|n IH]; intros w Hw; simpl.
        - rewrite (mean_ext mu V _ (fun _ => 0)), mean_zero; [reflexivity|]. intros v Hv.
          specialize (Hw v Hv). destruct (w v); [reflexivity|discriminate].
        - rewrite <- seq_shift, map_map. specialize (IH (fun v => tl (w v))).
          rewrite (map_ext _ (fun j => mean mu V (fun v => Q2R (nth j (tl (w v)) 0%Q)))).
          2: { intro j. apply mean_ext. intros v Hv. destruct (w v) as [|x l]; [destruct j;
            reflexivity|reflexivity]. }
          rewrite IH by (intros v Hv; specialize (Hw v Hv); destruct (w v); simpl in *;
            [discriminate|lia]).
          rewrite <- mean_plus. apply mean_ext. intros v Hv. specialize (Hw v Hv).
          destruct (w v); [discriminate|reflexivity]. }
      rewrite G.
      * rewrite (mean_ext mu V _ (fun _ => 1)); [rewrite (mean_const mu V 1 L), S; ring|].
        intros v Hv. destruct (is_mixture_R _ _ (H v Hv)) as (_ & _ & E). exact E.
      * intros v Hv. specialize (H v Hv). unfold is_mixture in H. rewrite !andb_true_iff in H.
        destruct H as [[H _] _]. apply Nat.eqb_eq. exact H.
  - intros ps Lp a.
    assert (Hl : forall v, In v V -> length (w v) = n).
    { intros v Hv. specialize (H v Hv). unfold is_mixture in H. rewrite !andb_true_iff in H.
      destruct H as [[H _] _]. apply Nat.eqb_eq. exact H. }
    clear H. revert w ps Lp Hl. clear L P S. induction n as [|n IH]; intros w ps Lp Hl.
    + destruct ps; [|discriminate]. simpl. rewrite (mean_ext mu V _ (fun _ => 0)), mean_zero;
        [reflexivity|].
      intros v Hv. specialize (Hl v Hv). destruct (w v); [reflexivity|discriminate].
    + destruct ps as [|p ps]; [discriminate|]. simpl seq. rewrite <- seq_shift. simpl map.
      rewrite map_map. cbn [mix].
      rewrite (map_ext _ (fun j => mean mu V (fun v => Q2R (nth j (tl (w v)) 0%Q)))).
      2: { intro j. apply mean_ext. intros v Hv. destruct (w v) as [|x l]; [destruct j;
        reflexivity|reflexivity]. }
      assert (Ht : forall v, In v V -> length (tl (w v)) = n).
      { intros v Hv. specialize (Hl v Hv). destruct (w v); simpl in *; [discriminate|lia]. }
      rewrite (IH (fun v => tl (w v)) ps ltac:(simpl in Lp; lia) Ht).
      rewrite Rmult_comm, <- mean_scale, <- mean_plus. apply mean_ext. intros v Hv.
      specialize (Hl v Hv).
      destruct (w v); [discriminate|]. simpl. ring.
Qed.
Lemma sumsq_dot n : forall v, length v = n -> sumsq n (toR v) = dotR v (toR v).
Proof.
  induction n as [|n IH]; intros [|a v] L; try discriminate; [reflexivity|]. simpl in *.
  change (shift (toR (a :: v))) with (toR v). rewrite IH by lia. reflexivity.
Qed.
Lemma shape_mean {A} mu (V : list A) n b (p : A -> vec) : weights mu (length V) ->
  shape_ok n b = true ->
  (forall v, In v V -> body_ok n b (p v) = true) -> inShape n b (fun a => mean mu V (fun v =>
    toR (body_point b (p v)) a)).
Proof.
  intros W SO H. destruct b as [r|vs]; simpl.
  - eapply Rle_trans; [apply (mean_sumsq mu V n W)|]. destruct W as (L & P & S).
    replace (Q2R r * Q2R r) with (mean mu V (fun _ => Q2R r * Q2R r)) by (rewrite (mean_const mu V _
      L), S; ring).
    apply mean_le; [exact P|]. intros v Hv. specialize (H v Hv). simpl in H.
    apply andb_prop in H as [Hl Hr].
    apply Nat.eqb_eq in Hl. rewrite sumsq_dot, <- dotQ_R, <- R_mul by exact Hl.
    apply R_le. exact Hr.
  - destruct (mean_weights mu V (length vs) p W H) as (lam & HW & HM). exists lam.
    split; [exact HW|]. intros a _.
    rewrite HM by apply map_length. apply mean_ext. intros v _. simpl. apply mixQ_R.
Qed.
Lemma errors_fit_R n Es c : errors_fit n Es c = true -> length (errors c) = length Es /\
  forall E x, In (E, x) (combine Es (errors c)) -> inError n E (toR x).
Proof.
  unfold errors_fit. rewrite andb_true_iff, Nat.eqb_eq. intros [L H]. split; [exact L|].
  intros E x Hin.
  eapply forallb_forall in H; [|exact Hin]. apply allows_R in H. apply H.
Qed.

(* ---- The errors of a point, pooled from all contacts: a convex set keeps what is weighted with
   the shares of the point ---- *)
Definition scaledError (n : nat) (E : error) (d : R) (x : rv) : Prop :=
  match E with
  | Widths e => forall i, (i < n)%nat -> Rabs (x i) <= d * toR e i
  | Rows A => forall a b, In (a, b) A -> dotR a x <= d * Q2R b
  end.
Lemma scaled_one n E l x : 0 <= l -> inError n E x -> scaledError n E l (fun a => l * x a).
Proof.
  intros Hl. destruct E as [e|A]; simpl; intros H.
  - intros i Hi. rewrite Rabs_mult, (Rabs_right l) by lra. apply Rmult_le_compat_l; auto.
  - intros a b Hab. rewrite dotR_mult. apply Rmult_le_compat_l; [exact Hl|apply H; exact Hab].
Qed.
Lemma scaled_zero n E : scaledError n E 0 (fun _ => 0).
Proof.
  destruct E as [e|A]; simpl; intros; [rewrite Rabs_R0; lra|]. rewrite dotR_zero. lra.
Qed.
Lemma scaled_plus n E d x d' x' : scaledError n E d x -> scaledError n E d' x' ->
  scaledError n E (d + d') (fun a => x a + x' a).
Proof.
  destruct E as [e|A]; simpl; intros H H'.
  - intros i Hi. eapply Rle_trans; [apply Rabs_triang|]. specialize (H i Hi).
    specialize (H' i Hi). lra.
  - intros a b Hab. rewrite dotR_plus. specialize (H a b Hab). specialize (H' a b Hab). lra.
Qed.
Lemma scaled_scale n E l d x : 0 <= l -> scaledError n E d x -> scaledError n E (l * d) (fun a =>
  l * x a).
Proof.
  intros Hl. destruct E as [e|A]; simpl; intros H.
  - intros i Hi. rewrite Rabs_mult, (Rabs_right l), Rmult_assoc by lra.
    apply Rmult_le_compat_l; auto.
  - intros a b Hab. rewrite dotR_mult, Rmult_assoc. apply Rmult_le_compat_l;
      [exact Hl|apply H; exact Hab].
Qed.
Lemma scaled_mean {A} mu (V : list A) n E (d : A -> R) (x : A -> rv) : Forall (fun l =>
  0 <= l) mu ->
  (forall v, In v V -> scaledError n E (d v) (x v)) -> scaledError n E (mean mu V d) (fun a =>
    mean mu V (fun v => x v a)).
Proof.
  intro Hp. revert V. induction Hp as [|l mu Hl _ IH]; intros [|v V] H; try apply scaled_zero.
  simpl.
  apply scaled_plus; [apply scaled_scale; [exact Hl|apply H; simpl; auto]|]. apply (IH V).
  intros w Hw. apply H. simpl. auto.
Qed.
Lemma scaled_divide n E d x : 0 < d -> scaledError n E d x -> inError n E (fun a => x a / d).
Proof.
  intros Hd H. apply (scaled_scale n E (/ d) d x) in H; [|left; apply Rinv_0_lt_compat; exact Hd].
  rewrite Rinv_l in H by lra. destruct E as [e|A]; simpl in *.
  - intros i Hi. specialize (H i Hi). rewrite Rmult_1_l in H. replace (x i / d) with (/ d * x i)
      by (unfold Rdiv; ring). exact H.
  - intros a b Hab. specialize (H a b Hab). rewrite Rmult_1_l in H.
    rewrite (dotR_ext a _ (fun j => / d * x j)) by (intros; unfold Rdiv; ring). exact H.
Qed.

Fixpoint share_of (i : nat) (cs : list nat) (lam : list R) : R :=
  match cs, lam with c :: cs', l :: lam' => (if Nat.eqb c i then l else 0) + share_of i cs' lam' |
    _, _ => 0 end.
Fixpoint part_of (i : nat) (cs : list nat) (lam : list R) (es : list rv) : rv :=
  match cs, lam, es with
  | c :: cs', l :: lam', e :: es' => fun a => (if Nat.eqb c i then l * e a else 0) + part_of i
    cs' lam' es' a
  | _, _, _ => fun _ => 0
  end.
Fixpoint upto (m : nat) (f : nat -> R) : R := match m with O => 0 | S m' => upto m' f + f m' end.
Lemma upto_ext m f g : (forall i, (i < m)%nat -> f i = g i) -> upto m f = upto m g.
Proof. induction m as [|m IH]; intro H; simpl; [reflexivity|]. rewrite IH, H by (intros;
  try apply H; lia). reflexivity. Qed.
Lemma upto_plus m f g : upto m (fun i => f i + g i) = upto m f + upto m g.
Proof. induction m as [|m IH]; simpl; [ring|]. rewrite IH. ring. Qed.
Lemma upto_one m c x : (c < m)%nat -> upto m (fun i => if Nat.eqb c i then x else 0) = x.
Proof.
  induction m as [|m IH]; intro H; [lia|]. simpl. destruct (Nat.eqb_spec c m) as [->|C].
  - rewrite (upto_ext m _ (fun _ => 0)).
    + assert (Z : upto m (fun _ => 0) = 0) by (clear; induction m; simpl; lra). rewrite Z. ring.
    + intros i Hi. destruct (Nat.eqb_spec m i); [lia|reflexivity].
  - rewrite IH by lia. ring.
Qed.
Lemma mean_upto {A} mu (V : list A) m f : mean mu V (fun v => upto m (f v)) = upto m (fun i =>
  mean mu V (fun v => f v i)).
Proof. induction m as [|m IH]; simpl; [apply mean_zero|]. rewrite mean_plus, IH. reflexivity. Qed.
Lemma mix_parts m a cs : (forall c, In c cs -> (c < m)%nat) ->
  forall lam es, length es = length cs ->
  mix lam es a = upto m (fun i => part_of i cs lam es a).
Proof.
  assert (Z : upto m (fun _ => 0) = 0) by (clear; induction m; simpl; lra).
  induction cs as [|c cs IH]; intros H [|l lam] [|e es] L; try discriminate; simpl;
    try (symmetry; exact Z).
  rewrite upto_plus, upto_one by (apply H; simpl; auto).
  rewrite <- IH; [reflexivity| |simpl in L; lia].
  intros; apply H; simpl; auto.
Qed.
Lemma mix_shares m a (f : nat -> rv) cs : (forall c, In c cs -> (c < m)%nat) -> forall lam,
  mix lam (map f cs) a = upto m (fun i => share_of i cs lam * f i a).
Proof.
  assert (Z : upto m (fun i => 0 * f i a) = 0) by (clear; induction m; simpl; lra).
  induction cs as [|c cs IH]; intros H [|l lam]; simpl; try (symmetry; exact Z).
  rewrite (upto_ext m _ (fun i => (if Nat.eqb c i then l * f c a else 0) + share_of i cs
    lam * f i a)).
  - rewrite upto_plus, upto_one by (apply H; simpl; auto). rewrite <- IH; [reflexivity|].
    intros; apply H; simpl; auto.
  - intros i _. destruct (Nat.eqb_spec c i) as [->|_]; ring.
Qed.
Lemma share_pos i cs : forall lam, Forall (fun l => 0 <= l) lam -> 0 <= share_of i cs lam.
Proof.
  induction cs as [|c cs IH]; intros [|l lam] H; simpl; try lra.
  apply Forall_cons_iff in H as [Hl H]. specialize (IH lam H).
  destruct (Nat.eqb c i); lra.
Qed.
Lemma part_vanishes i a cs : forall lam es, Forall (fun l => 0 <= l) lam -> share_of i cs lam = 0 ->
  part_of i cs lam es a = 0.
Proof.
  induction cs as [|c cs IH]; intros [|l lam] [|e es] H S; simpl in *; try reflexivity.
  apply Forall_cons_iff in H as [Hl H].
  pose proof (share_pos i cs lam H). destruct (Nat.eqb c i).
  - rewrite IH by (try assumption; lra). replace l with 0 by lra. ring.
  - rewrite IH by (try assumption; lra). ring.
Qed.
Lemma part_scaled n (E : nat -> error) i cs : forall lam es, Forall (fun l => 0 <= l) lam ->
  (forall c e, In (c, e) (combine cs es) -> inError n (E c) e) -> length es = length cs ->
    length lam = length cs ->
  scaledError n (E i) (share_of i cs lam) (part_of i cs lam es).
Proof.
  induction cs as [|c cs IH]; intros [|l lam] [|e es] H HE L L'; try discriminate;
    try apply scaled_zero. simpl.
  apply Forall_cons_iff in H as [Hl H].
  apply (scaled_plus n (E i) _ (fun a => if Nat.eqb c i then l * e a else 0)).
  - destruct (Nat.eqb_spec c i) as [<-|_]; [|apply scaled_zero]. apply scaled_one; [assumption|].
    apply HE. simpl. auto.
  - apply IH; auto. intros c' e' Hin. apply HE. simpl. auto.
Qed.
Lemma mean_vanishes {A} mu (V : list A) f g : Forall (fun l => 0 <= l) mu -> (forall v, In v V ->
  0 <= f v) ->
  mean mu V f = 0 -> (forall v, In v V -> f v = 0 -> g v = 0) -> mean mu V g = 0.
Proof.
  intro Hp. revert V. induction Hp as [|l mu Hl Hp IH]; intros [|v V] Hf S Hg; simpl in *;
    try reflexivity.
  assert (M : 0 <= mean mu V f) by (rewrite <- (mean_zero mu V); apply mean_le; auto).
  pose proof (Hf v (or_introl eq_refl)) as F. assert (0 <= l * f v) by (apply Rmult_le_pos;
    assumption).
  rewrite (IH V) by (auto; lra). assert (Z : l * f v = 0) by lra.
  apply Rmult_integral in Z as [->|Z]; [ring|].
  rewrite (Hg v (or_introl eq_refl) Z). ring.
Qed.
Lemma pooled {A} mu (V : list A) n m cs (lam : A -> list R) (es : A -> list rv) :
  weights mu (length V) -> (forall c, In c cs -> (c < m)%nat) ->
  (forall v, In v V -> weights (lam v) (length cs) /\ length (es v) = length cs) ->
  exists e : nat -> rv,
    (forall E, (forall i, inError n (E i) (fun _ => 0)) ->
       (forall v c x, In v V -> In (c, x) (combine cs (es v)) -> inError n (E c) x) ->
         forall i, inError n (E i) (e i)) /\
    forall a, mean mu V (fun v => mix (lam v) (map e cs) a) = mean mu V (fun v =>
      mix (lam v) (es v) a).
Proof.
  intros (Lm & Pm & Sm) Hcs Hv.
  set (D := fun i => mean mu V (fun v => share_of i cs (lam v))).
  set (X := fun i a => mean mu V (fun v => part_of i cs (lam v) (es v) a)).
  assert (Pos : forall v, In v V -> Forall (fun l => 0 <= l) (lam v)) by (intros v Hin;
    apply (Hv v Hin)).
  assert (HD : forall i, 0 <= D i).
  { intro i. unfold D. rewrite <- (mean_zero mu V). apply mean_le; [exact Pm|]. intros v Hin.
    apply share_pos. auto. }
  assert (HX : forall i a, D i = 0 -> X i a = 0).
  { intros i a Z. unfold X. apply (mean_vanishes mu V (fun v => share_of i cs (lam v))); auto.
    - intros v Hin. apply share_pos. auto.
    - intros v Hin. apply part_vanishes. auto. }
  exists (fun i a => if Req_EM_T (D i) 0 then 0 else X i a / D i). split.
  - intros E E0 HE i. destruct (Req_EM_T (D i) 0) as [Z|Z].
    + exact (E0 i).
    + apply (scaled_divide n (E i) (D i) (X i)); [specialize (HD i); lra|]. apply scaled_mean;
        [exact Pm|].
      intros v Hin. destruct (Hv v Hin) as ((L & P & _) & L'). apply part_scaled; auto. intros c x.
      apply (HE v c x Hin).
  - intro a. assert (R : mean mu V (fun v => mix (lam v) (es v) a) = upto m (fun i => X i a)).
    { rewrite (mean_ext mu V _ (fun v => upto m (fun i => part_of i cs (lam v) (es v) a)));
        [apply mean_upto|].
      intros v Hin. apply mix_parts; [exact Hcs|]. apply (Hv v Hin). }
    rewrite R. clear R. rewrite (mean_ext mu V _ (fun v => upto m (fun i =>
      share_of i cs (lam v) * (if Req_EM_T (D i) 0 then 0 else X i a / D i)))).
    2: { intros v Hin. apply (mix_shares m a (fun i a => if Req_EM_T (D i) 0 then 0 else X i a / D
      i) cs Hcs). }
    rewrite mean_upto. apply upto_ext. intros i _.
    rewrite (mean_ext mu V _ (fun v => (if Req_EM_T (D i) 0 then 0 else X i a / D i) * share_of i cs
      (lam v))) by (intros; ring).
    rewrite mean_scale. fold (D i). destruct (Req_EM_T (D i) 0) as [Z|Z]; [|change (mean mu V _)
      with (X i a); field; exact Z].
    rewrite Z. symmetry. rewrite Rmult_0_r. apply (HX i a Z).
Qed.

(* ---- Means over pairs ---- *)
Lemma mean_map {A B} (mu : list R) (V : list A) (g : A -> B) f : mean mu (map g V) f = mean mu V
  (fun v => f (g v)).
Proof. revert V. induction mu; intros [|v V]; simpl; try reflexivity. rewrite IHmu.
reflexivity. Qed.
Lemma mean_app {A} (mu nu : list R) (V W : list A) f : length mu = length V ->
  mean (mu ++ nu) (V ++ W) f = mean mu V f + mean nu W f.
Proof. revert V. induction mu; intros [|v V] L; simpl in *; try discriminate; [ring|].
rewrite IHmu by lia. ring. Qed.
Lemma mean_weigh {A} (l : R) (nu : list R) (W : list A) f : mean (map (Rmult l) nu) W f = l *
  mean nu W f.
Proof. revert W. induction nu; intros [|v W]; simpl; try ring. rewrite IHnu. ring. Qed.
Lemma sum_app l l' : fold_right Rplus 0 (l ++ l') = fold_right Rplus 0 l + fold_right Rplus 0 l'.
Proof. induction l; simpl; [ring|]. rewrite IHl. ring. Qed.
Lemma sum_weigh l nu : fold_right Rplus 0 (map (Rmult l) nu) = l * fold_right Rplus 0 nu.
Proof. induction nu; simpl; [ring|]. rewrite IHnu. ring. Qed.
Lemma mean_pairs {A B} mu nu (V : list A) (W : list B) : weights mu (length V) ->
  weights nu (length W) ->
  exists pi, weights pi (length (list_prod V W)) /\
    forall f, mean pi (list_prod V W) f = mean mu V (fun v => mean nu W (fun w => f (v, w))).
Proof.
  intros (L & P & S) (L' & P' & S'). exists (flat_map (fun l => map (Rmult l) nu) mu).
  assert (G : length (flat_map (fun l => map (Rmult l) nu) mu) = length (list_prod V W) /\
    Forall (fun l => 0 <= l) (flat_map (fun l => map (Rmult l) nu) mu) /\
    fold_right Rplus 0 (flat_map (fun l => map (Rmult l) nu) mu) = fold_right Rplus 0 mu *
      fold_right Rplus 0 nu /\
    forall f, mean (flat_map (fun l => map (Rmult l) nu) mu) (list_prod V W) f = mean mu V (fun v =>
      mean nu W (fun w => f (v, w)))).
  { clear S S'. revert mu L P. induction V as [|v V IH]; intros [|l mu] L P;
      try discriminate; simpl.
    - repeat split; auto; lra.
    - apply Forall_cons_iff in P as [Pl P]. destruct (IH mu ltac:(simpl in L; lia) P)
        as (I1 & I2 & I3 & I4).
      rewrite !app_length, !map_length, I1, L'. split; [reflexivity|]. split; [|split].
      + apply Forall_app. split; [|exact I2]. apply Forall_forall. intros x Hx.
        apply in_map_iff in Hx as (y & <- & Hy).
        apply Rmult_le_pos; [assumption|]. eapply Forall_forall in P'; eauto.
      + rewrite sum_app, sum_weigh, I3. ring.
      + intro f. rewrite mean_app by (rewrite !map_length; exact L'). rewrite mean_weigh, mean_map,
          I4. reflexivity. }
  destruct G as (G1 & G2 & G3 & G4). split; [|exact G4]. split; [exact G1|]. split; [exact G2|].
  rewrite G3, S, S'. ring.
Qed.
