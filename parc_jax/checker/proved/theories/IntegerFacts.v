(* The integers of Integers.v, and of the inner point of a polytope, stand for the numbers over
   their denominators. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic Integers Checker Polytopes ArithmeticFacts
  ConditionFacts AlikeFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- One number, over d ---- *)
Definition is (d : Z) (z : Z) (q : Q) : Prop := IZR z = IZR d * Q2R q.
Lemma Q_over a n : Q2R (Qmake a n) * IZR (Zpos n) = IZR a.
Proof. unfold Q2R. simpl. field. apply IZR_neq. discriminate. Qed.
Lemma over_is d q z : over d q = Some z -> is d z q.
Proof.
  unfold over, is. destruct (Z.eqb_spec (Zpos (Qden q) * (d / Zpos (Qden q))) d) as [E|];
    [|discriminate].
  set (m := (d / Zpos (Qden q))%Z) in *. intros [= <-]. rewrite <- E, !mult_IZR.
  pose proof (Q_over (Qnum q) (Qden q)) as G. destruct q as [a n]. simpl in *. rewrite <- G. ring.
Qed.
Lemma all_some_is {A B} (f : A -> option B) l : forall m, all_some f l = Some m ->
  Forall2 (fun b a => f a = Some b) m l.
Proof.
  induction l as [|x l IH]; simpl; intros m H; [injection H as <-; constructor|].
  destruct (f x) eqn:F; [|discriminate]. destruct (all_some f l); [|discriminate].
  injection H as <-. constructor; auto.
Qed.
Lemma all_over d v z : all_some (over d) v = Some z -> Forall2 (is d) z v.
Proof.
  intro H. apply all_some_is in H. induction H; constructor; [apply over_is|]; assumption.
Qed.
Lemma common_from v : forall d, (0 < d)%Z ->
  (0 < fold_left (fun d q => let n := Zpos (Qden q) in
    if n * (d / n) =? d then d else if d * (n / d) =? n then n else d * n)%Z v d)%Z.
Proof.
  induction v as [|q v IH]; intros d Hd; simpl; [exact Hd|]. apply IH.
  destruct (_ =? _)%Z; [exact Hd|]. destruct (_ =? _)%Z; lia.
Qed.
Lemma common_pos v : (0 < common v)%Z.
Proof. apply common_from. lia. Qed.
Lemma less_lt a b : less a b = true -> (a < b)%Z.
Proof. unfold less. rewrite negb_true_iff, Z.leb_gt. auto. Qed.

(* ---- Integers over D for the values of forms at x ---- *)
Section At.
Variable x : rv.
Definition at_x (D z : Z) (f : aff) : Prop := IZR z = IZR D * affR f x.
Lemma dotZ_at S w W : Forall2 (is S) W w -> forall D P X, Forall2 (at_x D) P X ->
  IZR (dotZ W P) = IZR S * IZR D * affR (lincomb w X) x.
Proof.
  induction 1 as [|a q W w Ha _ IH]; intros D P X HP.
  - simpl. rewrite affR_const, R0. ring.
  - destruct HP as [|z f P X Hz HP]; simpl; [rewrite affR_const, R0; ring|].
    rewrite plus_IZR, mult_IZR, affR_add, affR_scale, (IH D P X HP). unfold is, at_x in *.
    rewrite Ha, Hz. ring.
Qed.
Definition for_layer (l : level) (L : layer) : Prop :=
  (0 < fst l)%Z /\ Forall2 (fun r q => Forall2 (is (fst l)) (fst r) (fst q) /\
    is (fst l) (snd r) (snd q)) (snd l) L.
Lemma level_for L l : level_of L = Some l -> for_layer l L.
Proof.
  unfold level_of. set (d := common _). destruct (all_some (row_over d) L) eqn:E; [|discriminate].
  intros [= <-]. split; [apply common_pos|]. simpl. apply all_some_is in E.
  clearbody d. induction E as [|r q rs qs H _ IH]; constructor; [|exact IH]. unfold row_over in H.
  destruct (all_some (over d) (fst q)) eqn:W; [|discriminate].
  destruct (over d (snd q)) eqn:B; [|discriminate]. injection H as <-. simpl.
  split; [apply all_over, W|apply over_is, B].
Qed.
Lemma layer_at l L D P X : for_layer l L -> Forall2 (at_x D) P X ->
  Forall2 (at_x (fst l * D)) (layerZ l D P) (layerA L X).
Proof.
  intros [_ H] HP. unfold layerZ, layerA. induction H as [|r q rs L [W B] _ IH]; simpl; constructor;
    [|exact IH].
  unfold at_x. rewrite plus_IZR, !mult_IZR, affR_add, affR_const, (dotZ_at _ _ _ W _ _ _ HP).
  unfold is in B. rewrite B. unfold vec in *. ring.
Qed.
Lemma pass_at bits : forall D P X, Forall2 (at_x D) P X ->
  Forall2 (at_x D) (passZ bits P) (passA bits X).
Proof.
  induction bits as [|b bits IH]; intros D P X H; [constructor|]. destruct H; simpl; constructor;
    [|apply IH; assumption].
  destruct b; [assumption|]. unfold at_x. rewrite affR_const, R0. ring.
Qed.
Notation above := (above x).
Lemma above_zero D z f : (0 < D)%Z -> at_x D z f -> (0 < z)%Z -> 0 < affR f x.
Proof.
  intros HD H Hz. apply IZR_lt in HD, Hz. unfold at_x in H.
  apply Rmult_lt_reg_l with (IZR D); [exact HD|]. rewrite <- H. lra.
Qed.
Lemma signs_at bits : forall D P X, (0 < D)%Z -> Forall2 (at_x D) P X -> signsZ bits P = true ->
  Forall above (signs bits X).
Proof.
  induction bits as [|b bits IH]; intros D P X HD H S; [constructor|].
  destruct H as [|z f P X Hz H]; simpl in *; [constructor|]. apply andb_prop in S as [Z S].
  constructor; [|eapply IH; eassumption]. unfold AlikeFacts.above. cbn [snd].
  destruct b; apply less_lt in Z.
  - apply (above_zero D z); assumption.
  - apply (above_zero D (- z)); [exact HD| |lia]. unfold at_x in *.
    rewrite opp_IZR, affR_neg, Hz. ring.
Qed.
Definition product (ls : list level) : Z := fold_right (fun l n => fst l * n)%Z 1%Z ls.
Lemma product_pos ls Ls : Forall2 for_layer ls Ls -> (0 < product ls)%Z.
Proof. induction 1 as [|l L ls Ls [H _] _ IH]; simpl; lia. Qed.
Lemma net_at ls Ls : Forall2 for_layer ls Ls -> forall bits D P X, (0 < D)%Z ->
  Forall2 (at_x D) P X ->
  Forall2 (at_x (D * product ls)) (snd (netZ ls bits D P)) (snd (netA Ls bits X)) /\
  (fst (netZ ls bits D P) = true -> Forall above (fst (netA Ls bits X))).
Proof.
  induction 1 as [|l L ls Ls Hl HL IH]; intros bits D P X HD HP.
  { simpl. rewrite Z.mul_1_r. split; [exact HP|constructor]. }
  destruct HL as [|l' L' ls Ls Hl' HL].
  { simpl. replace (D * (fst l * 1))%Z with (fst l * D)%Z by ring.
    split; [apply layer_at; assumption|constructor]. }
  set (Z := layerZ l D P). set (Z' := layerA L X).
  assert (HZ : Forall2 (at_x (fst l * D)) Z Z') by (apply layer_at; assumption).
  assert (HD' : (0 < fst l * D)%Z) by (destruct Hl; lia).
  specialize (IH (tl bits) _ _ _ HD' (pass_at (hd [] bits) _ _ _ HZ)).
  change (netZ (l :: l' :: ls) bits D P) with
    (let (ok, Y) := netZ (l' :: ls) (tl bits) (fst l * D) (passZ (hd [] bits) Z) in
     (signsZ (hd [] bits) Z && ok, Y)).
  change (netA (L :: L' :: Ls) bits X) with
    (let (r, Y) := netA (L' :: Ls) (tl bits) (passA (hd [] bits) Z') in
     (signs (hd [] bits) Z' ++ r, Y)).
  change (product (l :: l' :: ls)) with (fst l * product (l' :: ls))%Z.
  destruct (netZ (l' :: ls) (tl bits) (fst l * D) (passZ (hd [] bits) Z)) as [ok Y].
  destruct (netA (L' :: Ls) (tl bits) (passA (hd [] bits) Z')) as [r Y'].
  cbn [fst snd] in *. destruct IH as [I J].
  replace (D * (fst l * product (l' :: ls)))%Z with (fst l * D * product (l' :: ls))%Z by ring.
  split; [exact I|]. intro S. apply andb_prop in S as [S O]. apply Forall_app.
  split; [apply (signs_at _ _ _ _ HD' HZ S)|apply J, O].
Qed.

(* ---- Places ---- *)
Lemma zadd_at D X X' : Forall2 (at_x D) X X' -> forall Y Y', Forall2 (at_x D) Y Y' ->
  Forall2 (at_x D) (zaddZ X Y) (zadd X' Y').
Proof.
  induction 1 as [|z f X X' Hz _ IH]; intros Y Y' H; simpl; [constructor|].
  destruct H; constructor; [|auto]. unfold at_x in *. rewrite plus_IZR, affR_add. rewrite Hz, H.
  ring.
Qed.
Lemma moved_at D X X' L L' : Forall2 (at_x D) X X' -> Forall2 (Forall2 (at_x D)) L L' ->
  Forall2 (Forall2 (at_x D)) (map (zaddZ X) L) (map (zadd X') L').
Proof. intros HX. induction 1; simpl; constructor; [apply zadd_at|]; assumption. Qed.
Lemma zeros_at D n : Forall2 (at_x D) (repeat 0%Z n) (repeat (aconst 0) n).
Proof.
  induction n; simpl; constructor; [|assumption]. unfold at_x. rewrite affR_const, R0. ring.
Qed.

(* ---- Heights ---- *)
Record aims (unit_ : Z) (wh : vec * Q) (A : aim) : Prop := {
  same_toward : toward A = fst wh; same_offset : offset A = snd wh;
  scale_pos : (0 < scale A)%Z; along_is : Forall2 (is (scale A)) (along_w A) (fst wh);
  across_is : across A = map Z.abs (along_w A);
  height_is : IZR (least_height A) = IZR (scale A) * Q2R (snd wh) * IZR unit_ }.
Lemma aim_aims unit_ wh A : aim_of unit_ wh = Some A -> aims unit_ wh A.
Proof.
  destruct wh as [w h]. unfold aim_of. set (d := common (h :: w)).
  destruct (all_some (over d) w) eqn:W; [|discriminate]. destruct (over d h) eqn:G; [|discriminate].
  intros [= <-]. constructor; simpl; try reflexivity; [apply common_pos|apply all_over, W|].
  apply over_is in G. rewrite mult_IZR, G. ring.
Qed.
Lemma dot_across S W w : (0 < S)%Z -> Forall2 (is S) W w -> forall U Z e, Forall2 (is U) Z e ->
  IZR (dotZ (map Z.abs W) Z) = IZR S * IZR U * Q2R (dotQ (vabs (vscale (-1) w)) e).
Proof.
  intros HS. induction 1 as [|a q W w Ha _ IH]; intros U Z e He; simpl; [rewrite R0; ring|].
  destruct He as [|z f Z e Hz He]; simpl; [rewrite R0; ring|].
  rewrite plus_IZR, mult_IZR, R_add, R_mul, R_abs, R_mul, (IH U Z e He), Rm1.
  unfold is in *. rewrite abs_IZR, Ha, Hz, Rabs_mult.
  apply IZR_lt in HS. rewrite (Rabs_right (IZR S)) by lra.
  replace (-1 * Q2R q) with (- Q2R q) by ring. rewrite Rabs_Ropp. ring.
Qed.

Variables (P : problem) (unit_ rest D : Z).
Hypothesis HU : (0 < unit_)%Z.
Hypothesis HR : (0 < rest)%Z.
Hypothesis HD : D = (rest * unit_)%Z.
Definition for_error (Ez : error * list Z) (E : error) : Prop :=
  fst Ez = E /\ match E with Widths e => Forall2 (is unit_) (snd Ez) e | Rows _ => True end.
Lemma D_pos : (0 < D)%Z. Proof. rewrite HD. lia. Qed.

Section Aimed.
Variables (A : aim) (w : vec) (h : Q).
Hypothesis HA : aims unit_ (w, h) A.
(* heights along the aim *)
Definition high (z : Z) (X : list aff) : Prop :=
  IZR z = IZR (scale A) * IZR D * affR (lincomb w X) x.
Lemma high_apart g z X : high z X -> IZR (scale A) * IZR D * Q2R g < IZR z ->
  above (apart w g X).
Proof.
  intros Hz L. unfold AlikeFacts.above, apart. simpl. rewrite affR_add, affR_const, Q2R_opp.
  pose proof (scale_pos _ _ _ HA) as S. apply IZR_lt in S. pose proof D_pos as G. apply IZR_lt in G.
  unfold high in Hz. rewrite Hz in L.
  assert (0 < IZR (scale A) * IZR D) by (apply Rmult_lt_0_compat; lra).
  apply Rmult_lt_reg_l in L; [lra|assumption].
Qed.
Lemma beyond_above Ez E a b X Y : for_error Ez E -> high a X -> high b Y ->
  beyond rest D A Ez a b = true -> Forall above
    (match reach E [] (vscale (-1) w) with
     | None => [never]
     | Some r => let g := qadd h r in [apart w g X; apart w g Y]
     end).
Proof.
  intros [<- HE] Ha Hb HB. destruct Ez as [E z]. unfold beyond in HB. cbn [fst snd] in *.
  destruct HA as [T O Sp W Ac Lh]. cbn [fst snd] in *.
  assert (G : forall g, IZR (scale A) * IZR D * Q2R g < IZR a ->
    IZR (scale A) * IZR D * Q2R g < IZR b -> Forall above [apart w g X; apart w g Y]).
  { intros g La Lb. repeat constructor; eapply high_apart; eassumption. }
  destruct E as [e|R].
  - cbn [reach]. apply andb_prop in HB as [La Lb]. apply less_lt, IZR_lt in La, Lb.
    rewrite mult_IZR, plus_IZR, Lh, Ac, (dot_across _ _ _ Sp W _ _ _ HE) in La, Lb.
    apply G; rewrite R_add, HD, mult_IZR; [eapply Rle_lt_trans; [|exact La]|
      eapply Rle_lt_trans; [|exact Lb]]; apply Req_le; ring.
  - rewrite T in HB. destruct (reach _ _ _) as [r|]; [|discriminate].
    rewrite O in HB. set (g := qadd h r) in *. apply andb_prop in HB as [La Lb].
    apply less_lt, IZR_lt in La, Lb. rewrite !mult_IZR in La, Lb.
    pose proof (Q_over (Qnum g) (Qden g)) as Q. replace (Qmake (Qnum g) (Qden g)) with g in Q
      by (destruct g; reflexivity).
    rewrite <- Q in La, Lb. assert (0 < IZR (Zpos (Qden g))) by (apply IZR_lt; reflexivity).
    apply G; apply Rmult_lt_reg_r with (IZR (Zpos (Qden g))); lra.
Qed.
Definition places_at (K : list (list Z)) (X : list (list aff)) : Prop :=
  Forall2 (Forall2 (at_x D)) K X.
Lemma height_high K X i : places_at K X ->
  high (dotZ (along_w A) (nth i K [])) (nth i X []).
Proof.
  intro H. unfold high. rewrite (dotZ_at (scale A) w _ (along_is _ _ _ HA) D _ (nth i X []));
    [reflexivity|]. apply all_nth; [constructor|exact H].
Qed.
Lemma all_beyond_above Ez Es K X K' X' points : Forall2 for_error Ez Es -> places_at K X ->
  places_at K' X' ->
  all_beyond rest D A Ez points (heights A K points) (heights A K' points) = true ->
  Forall above (flat_map (clear_here Es X X' (w, h)) points).
Proof.
  intros HE HK HK'. induction points as [|i points IH]; simpl; [constructor|]. intro B.
  apply andb_prop in B as [B C]. apply Forall_app. split; [|apply IH, C].
  eapply beyond_above; [| | |exact B]; try (apply height_high; assumption).
  apply all_nth; [split; [reflexivity|exact I]|exact HE].
Qed.
End Aimed.

Definition errors_for (Iz : list (list (error * list Z))) (Is : list (list error)) : Prop :=
  Forall2 (Forall2 for_error) Iz Is.
Lemma hd_for Iz Is : errors_for Iz Is -> Forall2 for_error (hd [] Iz) (hd [] Is).
Proof. intros []; simpl; [constructor|assumption]. Qed.
Lemma tl_for Iz Is : errors_for Iz Is -> errors_for (tl Iz) (tl Is).
Proof. intros []; simpl; [constructor|assumption]. Qed.

(* one run: m intervals with a direction, then what follows *)
Lemma run_above A w h ds points stop : aims unit_ (w, h) A -> forall m n t Iz Is K X,
  errors_for Iz Is -> places_at K X -> (t + m <= stop)%nat ->
  run_clear rest D P A Iz K points (heights A K points) m = true ->
  Forall above (clear_on P (skipn m Is) (skipn (m * n_points P) X) points
    ((stop, (w, h)) :: ds) (t + m) n) ->
  Forall above (clear_on P Is X points ((stop, (w, h)) :: ds) t (m + n)).
Proof.
  intro HA. induction m as [|m IH]; intros n t Iz Is K X HI HK L R G.
  { simpl in G. rewrite Nat.add_0_r in G. exact G. }
  cbn [run_clear] in R. apply andb_prop in R as [B R].
  change (S m + n)%nat with (S (m + n)). cbn [clear_on dir_at].
  destruct (Nat.ltb_spec t stop) as [_|C]; [|lia]. apply Forall_app. split.
  - eapply all_beyond_above; [exact HA|apply hd_for, HI|exact HK|apply all_skipn, HK|exact B].
  - apply (IH n (S t) (tl Iz) (tl Is) (skipn (n_points P) K)); [apply tl_for, HI|
      apply all_skipn, HK|lia|exact R|].
    replace (S t + m)%nat with (t + S m)%nat by lia.
    assert (E : skipn m (tl Is) = skipn (S m) Is) by (destruct Is; [destruct m|]; reflexivity).
    rewrite E, ListFacts.skipn_two. replace (n_points P + m * n_points P)%nat with
      (S m * n_points P)%nat by (simpl; lia). exact G.
Qed.
Lemma passed_run d ds points stop n : forall t Is X, (stop <= t)%nat ->
  clear_on P Is X points ((stop, d) :: ds) t n = clear_on P Is X points ds t n.
Proof.
  induction n as [|n IH]; intros t Is X L; [reflexivity|]. cbn [clear_on dir_at].
  destruct (Nat.ltb_spec t stop) as [C|_]; [lia|]. rewrite IH by lia. reflexivity.
Qed.
Lemma runs_above points : forall ds t n Iz Is K X, errors_for Iz Is -> places_at K X ->
  runs_clear rest D P unit_ Iz K points ds t n = true ->
  Forall above (clear_on P Is X points ds t n).
Proof.
  induction ds as [|[stop [w h]] ds IH]; intros t n Iz Is K X HI HK R; cbn [runs_clear] in R.
  { apply Nat.eqb_eq in R. subst n. constructor. }
  destruct (aim_of unit_ (w, h)) as [A|] eqn:EA; [|discriminate]. apply aim_aims in EA.
  cbv zeta in R. set (m := Nat.min n (stop - t)) in *. apply andb_prop in R as [R G].
  replace n with (m + (n - m))%nat by lia.
  destruct (Nat.le_gt_cases stop t) as [C|C].
  - replace m with O in * by lia. rewrite passed_run by exact C. simpl. rewrite Nat.sub_0_r in *.
    rewrite Nat.add_0_r in G. simpl in G. eapply IH; eassumption.
  - eapply run_above; [exact EA|exact HI|exact HK|lia|exact R|].
    destruct (Nat.le_gt_cases n (stop - t)) as [F|F].
    + replace (n - m)%nat with O by lia. constructor.
    + rewrite passed_run by lia. eapply IH; [apply all_skipn, HI|apply all_skipn, HK|exact G].
Qed.
End At.

(* ---- A polytope at its inner point ---- *)
Lemma positive_above rs : positive_rows rs = true -> Forall (above (toR [])) rs.
Proof.
  unfold positive_rows. rewrite forallb_forall, Forall_forall. intros H r Hr. specialize (H r Hr).
  apply R_lt in H. rewrite R0 in H. unfold above, affR.
  rewrite (dotR_ext _ (toR []) (fun _ => 0)) by (intros; apply toR_nil).
  rewrite dotR_zero, Rplus_0_l. exact H.
Qed.
Lemma above_alike x y rs qs : Forall2 (rows_alike x y) rs qs -> Forall (above y) qs ->
  Forall (above x) rs.
Proof.
  induction 1 as [|r q rs qs [_ V] _ IH]; intro H; constructor; inversion H; subst.
  - unfold above in *. unfold alike in V. rewrite V. assumption.
  - apply IH. assumption.
Qed.
Lemma errors_are d Is Iz : all_some (all_some (error_over d)) Is = Some Iz -> errors_for d Iz Is.
Proof.
  intro H. apply all_some_is in H. induction H as [|b a Iz Is H _ IH]; constructor; [|exact IH].
  apply all_some_is in H. induction H as [|z E Z Es G _ I]; constructor; [|exact I].
  unfold error_over in G. destruct (all_some (over d) (numbers_of E)) eqn:N; [|discriminate].
  injection G as <-. split; [reflexivity|]. destruct E as [e|R]; [apply all_over, N|exact Logic.I].
Qed.
Lemma whole_is N E M : whole_of N E = Some M -> Forall2 for_layer (levels M) N /\
  factor M = product (levels M) /\ (0 < unit_ M)%Z /\
  Forall2 (errors_for (unit_ M)) (widths M) (intervals E).
Proof.
  unfold whole_of. set (d := common _). destruct (all_some level_of N) eqn:L; [|discriminate].
  destruct (all_some _ (intervals E)) eqn:I; [|discriminate]. intros [= <-].
  split; [|split; [reflexivity|split; [apply common_pos|]]]; simpl.
  - apply all_some_is in L. induction L; constructor; [apply level_for|]; assumption.
  - clearbody d. apply all_some_is in I.
    induction I; constructor; [apply errors_are|]; assumption.
Qed.
Lemma bin_intervals : forall a b c i B, nth_error (zip3 a b c) i = Some B ->
  nth_error b i = Some (interval B).
Proof.
  induction a as [|x a IH]; intros [|y b] [|z c] i B H; simpl in H; try (destruct i; discriminate).
  destruct i as [|i]; simpl in *; [injection H as <-; reflexivity|eapply IH; exact H].
Qed.
Lemma both_there {A B} (R : A -> B -> Prop) l m : Forall2 R l m -> forall i a b,
  nth_error l i = Some a -> nth_error m i = Some b -> R a b.
Proof.
  induction 1 as [|x y l m H _ IH]; intros [|i] a b Ha Hb; try discriminate; simpl in *.
  - congruence.
  - eapply IH; eassumption.
Qed.
Lemma consts_at x d z v : Forall2 (is d) z v -> Forall2 (at_x x d) z (map aconst v).
Proof.
  induction 1; simpl; constructor; [|assumption]. unfold at_x. rewrite affR_const. assumption.
Qed.
Lemma times_at x d f z v : Forall2 (is d) z v ->
  Forall2 (at_x x (d * f)) (map (fun z => z * f)%Z z) (map aconst v).
Proof.
  induction 1 as [|a q z v H _ IH]; simpl; constructor; [|exact IH].
  unfold at_x. rewrite affR_const, !mult_IZR. unfold is in H. rewrite H. ring.
Qed.
Lemma numbers_alike x D Z F : (0 < D)%Z -> Forall2 (at_x x D) Z F ->
  Forall2 (alike x x) F (map (fun z => aconst (Qmake z (Z.to_pos D))) Z).
Proof.
  intros HD. induction 1 as [|z f Z F H _ IH]; simpl; constructor; [|exact IH].
  unfold alike. rewrite affR_const. pose proof (Q_over z (Z.to_pos D)) as G.
  rewrite Z2Pos.id in G by exact HD. unfold at_x in H. rewrite H in G. apply IZR_lt in HD.
  apply Rmult_eq_reg_r with (IZR D); [rewrite G; ring|lra].
Qed.

Lemma clearly_inside_is M P N E B H s : whole_of N E = Some M ->
  nth_error (bins E) (which s) = Some B -> length (inner s) = (n_p P + n_k P)%nat ->
  clearly_inside M P E B H s = true ->
  forallb (insideQ (inner s)) (set_rows P N E B H s) = true.
Proof.
  intros HM HB L C. destruct (whole_is N E M HM) as (HN & HF & HU & HW). unfold clearly_inside in C.
  set (d := (common (inner s) * unit_ M)%Z) in *. set (D := (d * factor M)%Z) in *.
  destruct (nth_error (widths M) (which s)) as [Iz|] eqn:EI; [|discriminate].
  destruct (all_some (over d) (inner s)) as [z|] eqn:EV; [|discriminate].
  assert (HI : errors_for (unit_ M) Iz (interval B)).
  { eapply both_there; [exact HW|exact EI|]. eapply bin_intervals. exact HB. }
  apply all_over in EV. set (v := inner s) in *. set (n := n_p P) in *. set (o := toR []) in *.
  assert (Hc : (0 < common v)%Z) by apply common_pos.
  assert (Hd : (0 < d)%Z) by (unfold d; lia).
  assert (Hf : (0 < factor M)%Z) by (rewrite HF; eapply product_pos; exact HN).
  assert (HD : (0 < D)%Z) by (unfold D; lia).
  assert (HX : Forall2 (alike (toR v) o) (map unit_form (seq 0 n)) (map aconst (firstn n v))).
  { apply units_alike; [rewrite firstn_length; lia|]. intros i Hi. simpl.
    rewrite <- (firstn_skipn n v) at 2. rewrite app_nth1; [reflexivity|].
    rewrite firstn_length. lia. }
  assert (HK : Forall2 (alike (toR v) o) (map unit_form (seq n (n_k P)))
    (map aconst (skipn n v))).
  { apply units_alike; [rewrite skipn_length; lia|]. intros i Hi.
    rewrite <- (firstn_skipn n v) at 2.
    rewrite app_nth2 by (rewrite firstn_length; lia). f_equal. rewrite firstn_length. lia. }
  pose proof (net_alike (toR v) o N (pattern s) _ _ HK) as [AR AY].
  pose proof (net_at o _ _ HN (pattern s) d _ _ Hd (consts_at o _ _ _ (all_skipn _ n _ _ EV)))
    as [GY GR].
  rewrite <- HF in GY. fold D in GY.
  destruct (netZ (levels M) (pattern s) d (skipn n z)) as [ok Y].
  unfold set_rows. fold v n.
  destruct (netA N (pattern s) (map unit_form (seq n (n_k P)))) as [r F].
  destruct (netA N (pattern s) (map aconst (skipn n v))) as [r' F']. cbn [fst snd] in *.
  rewrite !andb_true_iff in C. destruct C as (((((C1 & C2) & C3) & C4) & C5) & C6).
  rewrite !forallb_app, C2, C3, (above_inside v r r' AR (GR C1)). simpl.
  eapply above_inside; [apply conditions_alike; [exact HX|exact AY]|].
  rewrite <- conditions_on_is. unfold conditions_on. fold n.
  assert (GX : Forall2 (at_x o D) (map (fun z => z * factor M)%Z (firstn n z))
    (map aconst (firstn n v))).
  { apply times_at, all_firstn, EV. }
  set (X := map (fun z => z * factor M)%Z (firstn n z)) in *.
  assert (GP : Forall2 (at_x o D) (repeat 0%Z n ++ Y) (padded P F')).
  { apply Forall2_app; [apply zeros_at|exact GY]. }
  set (Y' := repeat 0%Z n ++ Y) in *.
  set (K := map (zaddZ X) (chunk n (S (steps P) * n_points P) Y')) in *.
  assert (GK : places_at o D K (places P (map aconst (firstn n v)) F')).
  { unfold K, places, places_at. fold n.
    apply moved_at; [exact GX|apply all_chunk, GP]. }
  apply Forall_app. split; [apply positive_above, C4|]. apply Forall_app. split.
  - eapply above_alike; [|apply positive_above, C5]. apply below_alike, numbers_alike; [exact HD|].
    unfold endA, extrasA. apply Forall2_app.
    + apply all_concat, all_firstn, all_skipn, GK.
    + apply all_firstn, all_skipn, GP.
  - apply Forall_flat_map. rewrite Forall_forall. intros [[ob b] ds] Hb.
    rewrite forallb_forall in C6. specialize (C6 _ Hb). cbn [fst snd] in *.
    eapply (runs_above o P (unit_ M) (common v * factor M) D);
      [exact HU|lia|unfold D, d; ring|apply all_skipn, HI|apply all_skipn, GK|exact C6].
Qed.
