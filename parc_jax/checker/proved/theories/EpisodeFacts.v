(* What the checker of episodes proves. [T38] *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan Answer Episode ArithmeticFacts
  ConditionFacts Theorems Sanity NotVoid.
Import ListNotations.
Open Scope R_scope.

(* ---- Equal numbers and bodies ---- *)
Lemma zero_toR v : nonzero v = false -> forall i, toR v i = 0.
Proof.
  induction v as [|a v IH]; intros H i; [apply toR_nil|]. simpl in H.
  apply orb_false_iff in H as [Z N].
  destruct i; [|apply (IH N i)]. unfold toR. simpl. apply negb_false_iff, Z.eqb_eq in Z.
  unfold Q2R. rewrite Z. lra.
Qed.
Lemma same_toR u : forall v, same u v = true -> forall i, toR u i = toR v i.
Proof.
  induction u as [|a u IH]; intros [|b v] H i; try reflexivity.
  - rewrite toR_nil. symmetry. apply zero_toR. simpl in H. apply negb_true_iff in H. exact H.
  - rewrite toR_nil. apply zero_toR. simpl in H. apply negb_true_iff in H. exact H.
  - simpl in H. apply andb_prop in H as [E H]. destruct i; [|exact (IH v H i)].
    unfold toR. simpl. apply Qeq_eqR. apply Qeq_bool_iff. exact E.
Qed.
Lemma all_alike_eq {A} (f : A -> A -> bool) : (forall a b, f a b = true -> a = b) ->
  forall u v, all_alike f u v = true -> u = v.
Proof.
  intro F. induction u as [|a u IH]; intros [|b v] H; try discriminate; [reflexivity|].
  simpl in H. apply andb_prop in H as [E H]. rewrite (F a b E), (IH v H). reflexivity.
Qed.
Lemma spelled_eq a b : spelled_alike a b = true -> a = b.
Proof.
  unfold spelled_alike. intro H. apply andb_prop in H as [N D]. apply Z.eqb_eq in N, D.
  destruct a, b. simpl in N, D. congruence.
Qed.
Lemma part_eq a b : part_alike a b = true -> a = b.
Proof.
  destruct a as [c s], b as [c' s']. unfold part_alike. simpl. intro H.
  apply andb_prop in H as [C S].
  apply (all_alike_eq Nat.eqb (fun a b => proj1 (Nat.eqb_eq a b))) in C. subst c'. f_equal.
  destruct s as [r|u], s' as [r'|u']; simpl in S; try discriminate.
  - rewrite (spelled_eq _ _ S). reflexivity.
  - rewrite (all_alike_eq _ (all_alike_eq _ spelled_eq) _ _ S). reflexivity.
Qed.

(* ---- A trajectory told from elsewhere is the same one, moved ---- *)
Definition moved (d : rv) (tau : trajectory) : trajectory :=
  Traj (fun s i a => at_ tau s i a - d a) (extras tau).
Lemma inError_ext n E x y : (forall i, x i = y i) -> inError n E x -> inError n E y.
Proof.
  intro H. destruct E as [e|A]; simpl; intro F.
  - intros i Hi. rewrite <- H. apply F. exact Hi.
  - intros a b Hab. rewrite (dotR_ext a y x) by (intros; symmetry; apply H). apply F. exact Hab.
Qed.
Lemma in_tube_moved P N B u v k tau : in_tube P N B u k tau ->
  in_tube P N B v k (moved (fun a => u a - v a) tau).
Proof.
  intros [HI HF]. split.
  - intros t i s Ht Hi Hs. eapply inError_ext; [|exact (HI t i s Ht Hi Hs)].
    intro a. unfold moved, knotR. simpl. ring.
  - eapply inError_ext; [|exact HF]. intro j. cbv beta. unfold moved, final_state, endR.
    simpl. destruct (j <? n_points P * n_p P)%nat; ring.
Qed.
Lemma mix_moved (c c' : nat -> rv) (d : rv) a : (forall i, c' i a = c i a - d a) ->
  forall lam l, length lam = length l ->
  mix lam (map c' l) a = mix lam (map c l) a - fold_right Rplus 0 lam * d a.
Proof.
  intro H. induction lam as [|x lam IH]; intros [|i l] L; try discriminate; simpl; [ring|].
  rewrite H, IH by (injection L as L; exact L). ring.
Qed.
Lemma inPart_moved n b (c c' : nat -> rv) (d x : rv) : (forall i a, c' i a = c i a - d a) ->
  inPart n b c x -> inPart n b c' (fun a => x a - d a).
Proof.
  intros H (lam & g & W & S & X). exists lam, g. split; [exact W|]. split; [exact S|].
  intros a Ha. destruct W as (L & _ & One).
  rewrite (mix_moved c c' d a (fun i => H i a) lam (corners b) L), One, X by exact Ha. ring.
Qed.

(* ---- One manoeuvre, told from wherever its pose truly was ---- *)
Lemma manoeuvre_clear e P m : check_manoeuvre e P m = true ->
  forall next u where_, keeps_to e (m, next) u where_ ->
  forall time, under_way (m, next) time ->
  clear_of e m (fun a => u a - toR (start_of e m) a) where_ time.
Proof.
  unfold check_manoeuvre. intros HK next u where_ (s & B & tau & Hs & HB & Hk & HT & Hw) time Hu.
  cbn [fst] in *. rewrite Hs in HK. rewrite !andb_true_iff in HK.
  destruct HK as ((((_ & _) & Hp) & HC) & HS).
  destruct (sample_safe _ _ _ _ _ HC HS) as [_ (_ & _ & Safe)].
  intros o t b x Ho Ht Hc Hb Hx Hin.
  apply (in_tube_moved _ _ _ u (toR (sample_p0 s))) in HT.
  destruct (Safe B HB Hk _ HT) as [_ HN]. apply HN.
  set (c := clock e m time) in *.
  exists o, t, (c - INR t), b, (fun a => x a - (u a - toR (start_of e m) a)).
  split; [exact Ho|]. split; [exact Ht|]. split; [rewrite S_INR in Hc; lra|]. split; [exact Hb|].
  split; [|exact Hin]. replace (INR t + (c - INR t)) with c by ring.
  apply (inPart_moved _ _ (where_ time)); [|exact Hx].
  intros i a. simpl. rewrite (Hw time Hu), (same_toR _ _ Hp). reflexivity.
Qed.

(* ---- Which one is under way ---- *)
Lemma some_turn : forall l m0 time, hd_error l = Some m0 -> Q2R (begin m0) <= time ->
  exists i turn, nth_error (turns l) i = Some turn /\ under_way turn time.
Proof.
  induction l as [|m l IH]; intros m0 time H0 Ht; [discriminate|]. injection H0 as ->.
  destruct l as [|m' l].
  - exists O, (m0, None). simpl. split; [reflexivity|split; simpl; auto].
  - destruct (Rlt_dec time (Q2R (begin m'))) as [C|C].
    + exists O, (m0, Some (begin m')). split; [reflexivity|split; simpl; auto].
    + destruct (IH m' time eq_refl (Rnot_lt_le _ _ C)) as (i & turn & Hi & Hu).
      exists (S i), turn. auto.
Qed.
Lemma later dt : 0 < Q2R dt -> forall l m0, hd_error l = Some m0 -> begins_ok dt l = true ->
  forall i turn, nth_error (turns l) i = Some turn -> Q2R (begin m0) <= Q2R (begin (fst turn)).
Proof.
  intro D. induction l as [|m l IH]; intros m0 H0 HB i turn Hi; [discriminate|]. injection H0 as ->.
  destruct i as [|i]; [injection Hi as <-; simpl; lra|].
  destruct l as [|m' l]; [destruct i; discriminate|].
  simpl in HB. apply andb_prop in HB as [L HB]. specialize (IH m' eq_refl HB i turn Hi).
  apply R_le in L. rewrite R_mul, R_add, Q2R_opp in L.
  replace (Q2R 2) with 2 in L by (unfold Q2R; simpl; lra). lra.
Qed.
Lemma one_turn dt : 0 < Q2R dt -> forall l, begins_ok dt l = true -> forall time i j turn turn',
  nth_error (turns l) i = Some turn -> nth_error (turns l) j = Some turn' ->
  under_way turn time -> under_way turn' time -> i = j.
Proof.
  intro D. induction l as [|m l IH]; intros HB time i j turn turn' Hi Hj Ui Uj;
    [destruct i; discriminate|].
  assert (HB' : begins_ok dt l = true).
  { destruct l; [reflexivity|]. simpl in HB. apply andb_prop in HB as [_ HB]. exact HB. }
  assert (G : forall j' t t', nth_error (turns (m :: l)) O = Some t ->
    nth_error (turns l) j' = Some t' -> under_way t time -> under_way t' time -> False).
  { intros j' t t' H0 H1 [_ U] [U' _]. injection H0 as <-. destruct l as [|m' l];
      [destruct j'; discriminate|].
    pose proof (later dt D (m' :: l) m' eq_refl HB' _ _ H1). simpl in U. lra. }
  destruct i as [|i], j as [|j]; [reflexivity|..].
  - destruct (G j turn turn' Hi Hj Ui Uj).
  - destruct (G i turn' turn Hj Hi Uj Ui).
  - f_equal. exact (IH HB' time i j turn turn' Hi Hj Ui Uj).
Qed.
Lemma turn_in : forall l i turn, nth_error (turns l) i = Some turn -> In (fst turn) l.
Proof.
  induction l as [|m l IH]; intros [|i] turn H; try discriminate; simpl in H.
  - injection H as <-. left. reflexivity.
  - right. eapply IH, H.
Qed.

(* ---- A whole episode ---- *)
Lemma driven_parts e n b w : check_episode e = Driven n b w ->
  exists m0, hd_error (done e) = Some m0 /\ 0 < Q2R (tick e) /\
    begins_ok (tick e) (done e) = true /\ length (doubt e) = n_p (asked m0) /\
    (n = length (done e) /\ b = length (bins (its_tube e)) /\
     w = length (filter (fun B => negb (centred B)) (bins (its_tube e)))) /\
    forall m, In m (done e) -> check_manoeuvre e (asked m0) m = true.
Proof.
  unfold check_episode. destruct (done e) as [|m0 l]; [discriminate|].
  destruct (_ && _) eqn:C; [|discriminate]. set (marks := map _ (m0 :: l)).
  destruct (forallb (fun ok => ok) marks) eqn:F; [|discriminate]. intro X. injection X as X Y Z.
  rewrite !andb_true_iff in C. destruct C as (((T & G) & D) & _). exists m0.
  split; [reflexivity|]. split; [apply R_lt in T; rewrite R0 in T; exact T|]. split; [exact G|].
  split; [apply Nat.eqb_eq; exact D|]. split; [auto|].
  intros m Hm. rewrite forallb_forall in F. apply (F (check_manoeuvre e (asked m0) m)).
  subst marks. apply in_map_iff. exists m. split; [reflexivity|exact Hm].
Qed.

(* `where_ i` are the points of the robot as manoeuvre i tells places: in the world, or in its frame
   there.  u i is where manoeuvre i truly began, told in the same way. *)
Theorem accepted_episode e n b w : check_episode e = Driven n b w ->
  (n = length (done e) /\ b = length (bins (its_tube e)) /\
   w = length (filter (fun B => negb (centred B)) (bins (its_tube e)))) /\
  exists m0, hd_error (done e) = Some m0 /\
  (forall m, In m (done e) -> parts (asked m) = parts (asked m0)) /\
  forall (u : nat -> rv) (where_ : nat -> R -> nat -> rv),
  (forall i turn, nth_error (turns (done e)) i = Some turn -> keeps_to e turn (u i) (where_ i)) ->
  forall time, Q2R (begin m0) <= time ->
  exists i turn, nth_error (turns (done e)) i = Some turn /\ under_way turn time /\
    (forall j other, nth_error (turns (done e)) j = Some other -> under_way other time -> j = i) /\
    clear_of e (fst turn) (fun a => u i a - toR (start_of e (fst turn)) a) (where_ i) time.
Proof.
  intro HA. destruct (driven_parts e n b w HA) as (m0 & H0 & D & HB & _ & HN & HM).
  split; [exact HN|]. exists m0.
  split; [exact H0|]. split.
  { intros m Hm. specialize (HM m Hm). unfold check_manoeuvre in HM.
    destruct (its_plan m); [|discriminate]. unfold robot_alike in HM. rewrite !andb_true_iff in HM.
    symmetry. apply (all_alike_eq _ part_eq). apply HM. }
  intros u where_ HK time Ht. destruct (some_turn _ m0 time H0 Ht) as (i & turn & Hi & Hu).
  exists i, turn. split; [exact Hi|]. split; [exact Hu|]. split.
  { intros j other Hj Uj. exact (one_turn _ D _ HB _ _ _ _ _ Hj Hi Uj Hu). }
  destruct turn as [m next].
  eapply manoeuvre_clear; [apply HM, (turn_in _ _ _ Hi)|exact (HK i _ Hi)|exact Hu].
Qed.

(* The same where places are told in the world: poses are off by their doubt at most, and obstacles
   are those of the file less that doubt. *)
Lemma less_a_box_R d A x y : (forall a b, In (a, b) A -> (length a <= length d)%nat) ->
  (forall a, (a < length d)%nat -> Rabs (y a) <= toR d a) -> inPoly (less_a_box d A) x ->
  inPoly A (fun a => x a - y a).
Proof.
  intros HL Hy Hx a b Hab.
  assert (I : In (a, (b - dotQ (vabs a) d)%Q) (less_a_box d A)).
  { apply in_map_iff. exists (a, b). split; [reflexivity|exact Hab]. }
  specialize (Hx _ _ I). unfold Qminus in Hx. rewrite Q2R_plus, Q2R_opp, dotQ_R in Hx.
  rewrite (dotR_ext a _ (fun i => x i + -1 * y i)) by (intros; ring). rewrite dotR_plus, dotR_mult.
  assert (G : Rabs (dotR a y) <= dotR (vabs a) (toR d)).
  { apply dot_abs. intros i Hi. apply Hy. specialize (HL a b Hab). lia. }
  pose proof (Rle_abs (- dotR a y)) as G'. rewrite Rabs_Ropp in G'. lra.
Qed.
Theorem accepted_place e n b w : check_episode e = Driven n b w -> turning e = false ->
  exists m0, hd_error (done e) = Some m0 /\
  (forall m, In m (done e) -> parts (asked m) = parts (asked m0)) /\
  forall where_ : R -> nat -> rv,
  (forall turn, In turn (turns (done e)) -> exists u,
     (forall a, (a < n_p (asked m0))%nat ->
       Rabs (u a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
     keeps_to e turn u where_) ->
  forall time, Q2R (begin m0) <= time ->
  exists turn, In turn (turns (done e)) /\ under_way turn time /\
    forall o t p x, In o (obstacles (asked (fst turn))) -> (first o <= t <= last o)%nat ->
      INR t <= clock e (fst turn) time <= INR (S t) -> In p (parts (asked m0)) ->
      inPart (n_p (asked m0)) p (where_ time) x -> ~ inPoly (less_a_box (doubt e) (rows o)) x.
Proof.
  intros HA HT. destruct (driven_parts e n b w HA) as (m0 & H0 & D & HB & HL & _ & HM). exists m0.
  split; [exact H0|]. split.
  { destruct (accepted_episode e n b w HA) as (_ & m1 & H1 & HP & _). rewrite H0 in H1.
    injection H1 as <-. exact HP. }
  intros where_ HK time Ht. destruct (some_turn _ m0 time H0 Ht) as (i & turn & Hi & Hu).
  pose proof (nth_error_In _ _ Hi) as Hin. exists turn. split; [exact Hin|]. split; [exact Hu|].
  destruct (HK turn Hin) as (u & Hd & Hk). intros o t p x Ho Hs Hc Hp Hx Hbad.
  destruct turn as [m next]. cbn [fst] in *. pose proof (turn_in _ _ _ Hi) as Im. cbn [fst] in Im.
  pose proof (HM m Im) as HC. assert (HR := HC). unfold check_manoeuvre in HR.
  destruct (its_plan m); [|discriminate]. unfold robot_alike, context_ok in HR.
  rewrite !andb_true_iff in HR.
  assert (Np : Nat.eqb (n_p (asked m0)) (n_p (asked m)) = true) by apply HR.
  assert (Parts : all_alike part_alike (parts (asked m0)) (parts (asked m)) = true) by apply HR.
  assert (HPr : problem_ok (asked m) (its_net e) = true) by apply HR. clear HR.
  apply Nat.eqb_eq in Np. apply (all_alike_eq _ part_eq) in Parts.
  refine (manoeuvre_clear e (asked m0) m HC next u where_ Hk time Hu o t p x Ho Hs Hc _ _ _).
  - rewrite <- Parts. exact Hp.
  - rewrite <- Np. exact Hx.
  - unfold start_of. rewrite HT. apply (less_a_box_R (doubt e)); [| |exact Hbad].
    + intros a c Hac. rewrite HL, Np. apply problem_inv in HPr.
      apply Nat.eq_le_incl. eapply poly_len; [|exact Hac]. destruct HPr. eauto.
    + intros a Ha. apply Hd. rewrite <- HL. exact Ha.
Qed.

(* The same of a robot that turns, with headings as stated: a place of the world is never in the
   body if it is in an obstacle, as that is seen from the stated pose, when moved by any of the
   doubt. *)
Theorem accepted_turning e n b w : check_episode e = Driven n b w -> turning e = true ->
  exists m0, hd_error (done e) = Some m0 /\
  forall where_ : R -> nat -> rv,
  (forall turn, In turn (turns (done e)) -> exists v,
     (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
     keeps_to e turn (fun _ => 0)
       (fun time i => seen_from v (Q2R (heading (fst turn))) (where_ time i))) ->
  forall time, Q2R (begin m0) <= time ->
  exists turn v, In turn (turns (done e)) /\ under_way turn time /\
    (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
    forall o t p x, In o (obstacles (asked (fst turn))) -> (first o <= t <= last o)%nat ->
      INR t <= clock e (fst turn) time <= INR (S t) -> In p (parts (asked m0)) ->
      inPart (n_p (asked (fst turn))) p
        (fun i => seen_from v (Q2R (heading (fst turn))) (where_ time i))
        (seen_from v (Q2R (heading (fst turn))) x) ->
      ~ (forall d, (forall a, (a < n_p (asked m0))%nat -> Rabs (d a) <= toR (doubt e) a) ->
           inPoly (rows o) (seen_from (toR (pose (fst turn))) (Q2R (heading (fst turn)))
             (fun a => x a - d a))).
Proof.
  intros HA HT. destruct (driven_parts e n b w HA) as (m0 & H0 & D & HB & HL & _ & HM). exists m0.
  split; [exact H0|]. intros where_ HK time Ht.
  destruct (accepted_episode e n b w HA) as (_ & m1 & H1 & HP & _). rewrite H0 in H1.
  injection H1 as <-. destruct (some_turn _ m0 time H0 Ht) as (i & turn & Hi & Hu).
  pose proof (nth_error_In _ _ Hi) as Hin. destruct (HK turn Hin) as (v & Hv & Hk).
  exists turn, v. split; [exact Hin|]. split; [exact Hu|]. split; [exact Hv|].
  intros o t p x Ho Hs Hc Hp Hx Hbad. destruct turn as [m next]. cbn [fst] in *.
  pose proof (turn_in _ _ _ Hi) as Im. cbn [fst] in Im. rewrite <- (HP m Im) in Hp.
  refine (manoeuvre_clear e (asked m0) m (HM m Im) next _ _ Hk time Hu o t p _ Ho Hs Hc Hp Hx _).
  specialize (Hbad (fun a => v a - toR (pose m) a) Hv). intros a c Hac.
  rewrite (dotR_ext a _ (seen_from (toR (pose m)) (Q2R (heading m))
    (fun a => x a - (v a - toR (pose m) a)))); [exact (Hbad a c Hac)|].
  intros j _. unfold start_of. rewrite HT, toR_nil. unfold seen_from.
  destruct j as [|[|j]]; ring.
Qed.

(* Nothing of this is about no drive: where every bin allows the error zero, the model's own
   trajectories, one after the other and each to its end, are one. *)
Theorem a_drive_there_is e n b w : check_episode e = Driven n b w ->
  forallb centred (bins (its_tube e)) = true ->
  exists where_ : nat -> R -> nat -> rv,
  forall i turn, nth_error (turns (done e)) i = Some turn ->
    keeps_to e turn (toR (start_of e (fst turn))) (where_ i).
Proof.
  intros HA HZ. destruct (driven_parts e n b w HA) as (m0 & _ & _ & _ & _ & _ & HM).
  set (k := fun m => match its_plan m with Some s => toR (sample_k s) | None => fun _ => 0 end).
  set (tau := fun m => model (asked m) (its_net e) (toR (start_of e m)) (k m)).
  exists (fun i time => match nth_error (turns (done e)) i with
    | Some turn => at_ (tau (fst turn)) (clock e (fst turn) time) | None => fun _ _ => 0 end).
  intros i [m next] Hi. pose proof (HM m (turn_in _ _ _ Hi)) as HC. cbn [fst] in *.
  unfold check_manoeuvre in HC. destruct (its_plan m) as [s|] eqn:Hs; [|discriminate].
  rewrite !andb_true_iff in HC. destruct HC as ((((_ & _) & _) & HO) & HS).
  destruct (sample_safe _ _ _ _ _ HO HS) as [_ (_ & (B & HB & Hk) & _)].
  exists s, B, (tau m). split; [exact Hs|]. split; [exact HB|]. split; [exact Hk|]. split.
  - unfold tau, k. rewrite Hs. apply (not_void _ _ (its_tube e)); [exact HO|exact HB|].
    rewrite forallb_forall in HZ. apply HZ. exact HB.
  - intros time _ j a. rewrite Hi. reflexivity.
Qed.
