(* The conditions of Checker.v, said over the reals, make a plan safe. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts SeparationFacts
  BinFacts ListFacts.
Import ListNotations.
Open Scope R_scope.

(* What is asked of a plan (u, k) with outputs y, given the directions ds, in bin B
   (docs/certificates.md, Separation). *)
Definition conditionsR (P : problem) (ds : list (list dir)) (B : bin) (H : goal_hints) (u y :
  rv) : Prop :=
  inPoly (start P) u /\
  (forall i a b, nth_error (goal P) i = Some (a, b) ->
     exists r, reach (final B) (nth i H []) a = Some r /\ dotR a (endR P u y) + Q2R r <= Q2R b) /\
  (forall o b d, In ((o, b), d) (combine (tasks P) ds) -> forall t, (first o <= t <= last o)%nat ->
     exists w h, dir_at d t = Some (w, h) /\ forall i, In i (corners b) ->
       exists r, reach (nth i (nth t (interval B) []) (Rows [])) [] (vscale (-1) w) = Some r /\
         Q2R h + Q2R r < dotR w (knotR P u y t i) /\ Q2R h + Q2R r < dotR w (knotR P u y (S t) i)).

(* ---- What the checks of sizes say ---- *)
Record sizes (P : problem) (N : list layer) : Prop := {
  some_axis : (0 < n_p P)%nat;
  some_point : (0 < n_points P)%nat;
  some_step : (0 < steps P)%nat;
  goal_rows : poly_ok (n_points P * n_p P + n_q P) (goal P) = true;
  start_rows : poly_ok (n_p P) (start P) = true;
  last_step : forall o, In o (obstacles P) -> (last o < steps P)%nat;
  obstacle_rows : forall o, In o (obstacles P) -> poly_ok (n_p P) (rows o) = true;
  part_shape : forall b, In b (parts P) -> shape_ok (n_p P) (grown_by b) = true;
  part_points : forall b i, In b (parts P) -> In i (corners b) -> (i < n_points P)%nat;
  net_sizes : net_ok (n_k P) N (outputs P) = true;
  domain_size : length (domain P) = n_k P }.
Lemma problem_inv P N : problem_ok P N = true -> sizes P N.
Proof.
  unfold problem_ok. rewrite !andb_true_iff, !Nat.ltb_lt, Nat.eqb_eq.
  intros ((((((((((A & B) & C) & D) & E) & F) & _) & G) & K) & L) & _).
  constructor; auto.
  - intros o Ho. eapply forallb_forall in F; [|exact Ho]. rewrite !andb_true_iff, Nat.ltb_lt in F.
    apply F.
  - intros o Ho. eapply forallb_forall in F; [|exact Ho]. rewrite !andb_true_iff in F. apply F.
  - intros b Hb. eapply forallb_forall in G; [|exact Hb]. unfold part_ok in G.
    rewrite !andb_true_iff in G. apply G.
  - intros b i Hb Hi. eapply forallb_forall in G; [|exact Hb]. unfold part_ok in G.
    rewrite !andb_true_iff in G.
    destruct G as [_ G]. eapply forallb_forall in G; [|exact Hi]. apply Nat.ltb_lt. exact G.
Qed.
Lemma poly_len n A a b : poly_ok n A = true -> In (a, b) A -> length a = n.
Proof. intros H Hin. eapply forallb_forall in H; [|exact Hin]. apply Nat.eqb_eq in H. exact H. Qed.

(* ---- Directions ---- *)
Lemma dir_at_in ds t d : dir_at ds t = Some d -> exists stop, In (stop, d) ds.
Proof.
  induction ds as [|[s e] ds IH]; simpl; [discriminate|]. destruct (t <? s)%nat.
  - intros [= ->]. eauto.
  - intro H. destruct (IH H) as [s' ?]. eauto.
Qed.
Lemma runs_ok_in n o rs : forall t r, runs_ok n o t rs = true -> In r rs ->
  positive (snd r) = true /\ length (fst (combine_rows (rows o) (snd r))) = n.
Proof.
  induction rs as [|r' rs IH]; intros t r H Hin; [destruct Hin|]. cbn [runs_ok] in H.
  rewrite !andb_true_iff in H.
  destruct H as ((((((A & B) & C) & D) & E) & F) & G).
  destruct Hin as [->|Hin]; [split; [exact D|apply Nat.eqb_eq; exact F]|eapply IH; eauto].
Qed.
Lemma in_dirs : forall bs sep b d,
  In (b, d) (combine bs (map (fun br => map (dir_of (fst br)) (snd br)) (combine bs sep))) ->
  exists rs, In (b, rs) (combine bs sep) /\ d = map (dir_of b) rs.
Proof.
  induction bs as [|b' bs IH]; intros [|r' sep] b d H; simpl in *; try contradiction.
  destruct H as [H|H].
  - injection H as -> <-. eauto.
  - destruct (IH _ _ _ H) as (rs & ? & ?). eauto.
Qed.
Lemma sep_len P sep : sep_ok P sep = true -> length (concat sep) = length (tasks P).
Proof. unfold sep_ok. rewrite !andb_true_iff, !Nat.eqb_eq. tauto. Qed.
Lemma dirs_len P sep : sep_ok P sep = true -> length (dirs_of P sep) = length (tasks P).
Proof. intro H. apply sep_len in H. unfold dirs_of. rewrite map_length, combine_length. lia. Qed.
(* Each direction in use comes from multipliers that are not negative, and has n_p coordinates. *)
Lemma dirs_valid P sep b d w h t : sep_ok P sep = true ->
  In (b, d) (combine (tasks P) (dirs_of P sep)) ->
  dir_at d t = Some (w, h) -> length w = n_p P /\
  exists m h', positive m = true /\ combine_rows (rows (fst b)) m = (w, h') /\
               Q2R h = Q2R h' + Q2R (support (grown_by (snd b)) w).
Proof.
  intros H Hin Hd. apply in_dirs in Hin as (rs & Hrs & ->). unfold sep_ok in H.
  apply andb_prop in H as [_ H].
  eapply forallb_forall in H; [|exact Hrs]. cbn [fst snd] in H. apply dir_at_in in Hd as [stop Hd].
  apply in_map_iff in Hd as (r & Hr & Hin). destruct (runs_ok_in _ _ _ _ _ H Hin) as [Hm L].
  unfold dir_of in Hr.
  destruct (combine_rows (rows (fst b)) (snd r)) as [w' h'] eqn:E. injection Hr as _ -> <-.
  split; [exact L|]. exists (snd r), h'. rewrite R_add. auto.
Qed.
Lemma in_tasks P o b : In o (obstacles P) -> In b (parts P) -> In (o, b) (tasks P).
Proof. intros. apply in_flat_map. exists o. split; [assumption|]. apply in_map. assumption. Qed.
Lemma tasks_in P o b : In (o, b) (tasks P) -> In o (obstacles P) /\ In b (parts P).
Proof. intro H. apply in_flat_map in H as (o' & Ho & H). apply in_map_iff in H as (b' & [= ->
  ->] & H). auto. Qed.

(* ---- The conditions are enough ---- *)
Theorem succeeds_is P tau : succeeds P tau <->
  inPoly (goal P) (final_state P tau) /\
  forall o t s b x, In o (obstacles P) -> (first o <= t <= last o)%nat -> 0 <= s <= 1 ->
    In b (parts P) -> inPart (n_p P) b (at_ tau (INR t + s)) x -> ~ inPoly (rows o) x.
Proof.
  split.
  - intros [Hm Ht]. split.
    + intros a b Hab. apply Rnot_lt_le. intro Hlt. apply Hm. intro Hin. specialize (Hin a b Hab).
      lra.
    + intros o t s b x Ho Hto Hs Hb Hx Hin. apply Ht. exists o, t, s, b, x. auto 10.
  - intros [Hg Ho]. split; [intro Hm; exact (Hm Hg)|].
    intros (o & t & s & b & x & Hin & Hto & Hs & Hb & Hx & Hit).
    exact (Ho o t s b x Hin Hto Hs Hb Hx Hit).
Qed.
Theorem conditions_succeed P N sep B H u k : problem_ok P N = true -> sep_ok P sep = true ->
  conditionsR P (dirs_of P sep) B H u (netR N k) -> forall tau, in_tube P N B u k tau ->
    succeeds P tau.
Proof.
  intros HP HS (_ & Cg & Co) tau [Ht Hf]. apply problem_inv in HP. apply succeeds_is. split.
  - intros a b Hab. pose proof (poly_len _ _ _ _ (goal_rows _ _ HP) Hab) as La.
    apply In_nth_error in Hab as [i Hab]. destruct (Cg i a b Hab) as (r & Hr & Hb).
    pose proof (reach_R _ _ _ _ _ _ La Hr Hf) as D.
    rewrite (dotR_ext a _ (fun j => final_state P tau j + -1 * endR P u (netR N k) j))
      in D by (intros; ring).
    rewrite (dotR_plus a (final_state P tau)), dotR_mult in D. lra.
  - intros o t s b x Ho Hto Hs Hb Hx.
    assert (Hin : In (o, b) (tasks P)) by (apply in_tasks; assumption).
    assert (Hd : exists d, In ((o, b), d) (combine (tasks P) (dirs_of P sep))).
    { apply combine_ex; [|exact Hin]. apply Nat.eq_le_incl. symmetry. apply dirs_len. exact HS. }
    destruct Hd as [d Hd]. destruct (Co _ _ _ Hd t Hto) as (w & h & Hat & Hi).
    destruct (dirs_valid _ _ _ _ _ _ _ HS Hd Hat) as (Lw & m & h' & Hm & Hc & Eh).
    cbn [fst snd] in *.
    pose proof (last_step _ _ HP o Ho) as Ls.
    apply (separation (n_p P) (rows o) m b w h' (at_ tau (INR t + s))); auto;
      [apply (part_shape _ _ HP); exact Hb|].
    intros i Hc'. rewrite <- Eh. destruct (Hi i Hc') as (r & Hr & Hp & Hq).
    apply (point_clear (n_p P) _ w (Q2R h) r (knotR P u (netR N k) t i) (knotR P u (netR N k) (S t)
      i) _ s Lw Hr Hp Hq Hs).
    apply Ht; [lia|apply (part_points _ _ HP b); assumption|exact Hs].
Qed.

(* ---- The rows say what conditionsR says ---- *)
Lemma chunk_nth n : forall T (Y : list aff) t, (t < T)%nat -> nth t (chunk n T Y) [] = firstn n
  (skipn (t * n) Y).
Proof.
  induction T; intros Y t H; [lia|]. destruct t as [|t]; simpl; [reflexivity|].
  rewrite IHT by lia. rewrite skipn_two. reflexivity.
Qed.
Lemma chunk_len n : forall T (Y : list aff), length (chunk n T Y) = T.
Proof. induction T; intros; simpl; auto. Qed.

Lemma clear_on_is P B K points ds n : forall t,
  clear_on P (skipn t (interval B)) (skipn (t * n_points P) K) points ds t n =
  flat_map (fun t => match dir_at ds t with
                     | None => [never] | Some wh => flat_map (clear_at P B K wh t) points
                     end) (seq t n).
Proof.
  induction n as [|n IH]; intro t; [reflexivity|]. cbn [clear_on seq flat_map].
  rewrite skipn_two. replace (t * n_points P + n_points P)%nat with (S t * n_points P)%nat
    by (simpl; lia).
  assert (T : tl (skipn t (interval B)) = skipn (S t) (interval B)).
  { clear. revert t. induction (interval B) as [|E Es IH]; intros [|t]; try reflexivity.
    apply IH. }
  rewrite T, IH. f_equal. destruct (dir_at ds t) as [[w h]|]; [|reflexivity].
  apply flat_map_ext. intro i. unfold clear_here, clear_at.
  assert (D : hd [] (skipn t (interval B)) = nth t (interval B) []).
  { clear. revert t. induction (interval B) as [|E Es IH]; intros [|t]; try reflexivity.
    apply IH. }
  rewrite D, !nth_skipn'. reflexivity.
Qed.
Lemma conditions_on_is P ds B H X Y : conditions_on P ds B H X Y = conditions P ds B H X Y.
Proof.
  unfold conditions_on, conditions. do 2 f_equal. apply flat_map_ext. intros [[o b] d].
  apply clear_on_is.
Qed.

Section Forms.
Variables (P : problem) (N : list layer) (X Y : list aff) (x u y : rv).
Hypothesis HP : sizes P N.
Hypothesis HX : forall i, (i < n_p P)%nat -> at_forms X x i = u i.
Hypothesis HY : forall i, (i < outputs P)%nat -> at_forms Y x i = y i.
Hypothesis LX : length X = n_p P.
Hypothesis LY : length Y = outputs P.
Let n := n_p P. Let m := n_points P. Let T := steps P.

Lemma whole_len : (n + outputs P = S T * (m * n) + n_q P)%nat.
Proof.
  pose proof (some_point _ _ HP) as Hm. unfold outputs. fold n m T. fold m in Hm.
  assert (n <= S T * (m * n))%nat; [|lia]. rewrite <- (Nat.mul_1_l n) at 1. rewrite Nat.mul_assoc.
  apply Nat.mul_le_mono_r. simpl. lia.
Qed.
Lemma padded_R j : (j < S T * (m * n) + n_q P)%nat -> at_forms (padded P Y) x j = offsetR P y j.
Proof.
  intro Hj. pose proof whole_len as W. unfold at_forms, padded, offsetR.
  destruct (Nat.ltb_spec j (n_p P)) as [C|C].
  - rewrite app_nth1 by (rewrite repeat_length; exact C). rewrite nth_repeat, affR_const, R0.
    reflexivity.
  - rewrite app_nth2 by (rewrite repeat_length; exact C). rewrite repeat_length. apply HY.
    fold n in W, C |- *. lia.
Qed.
Lemma padded_len : length (padded P Y) = (S T * (m * n) + n_q P)%nat.
Proof. unfold padded. rewrite app_length, repeat_length, LY. apply whole_len. Qed.
Lemma place_bound j : (j < S T * m)%nat -> (j * n + n <= S T * (m * n))%nat.
Proof. intro H. rewrite Nat.mul_assoc. assert (S j * n <= S T * m * n)%nat
  by (apply Nat.mul_le_mono_r; lia). simpl in *. lia. Qed.
Lemma places_R j : (j < S T * m)%nat -> length (nth j (places P X Y) []) = n /\
  forall a, (a < n)%nat -> at_forms (nth j (places P X Y) []) x a = u a + offsetR P y (j * n + a).
Proof.
  intro Hj. pose proof (place_bound j Hj) as PB. unfold places.
  rewrite (nth_indep _ _ (zadd X [])) by (rewrite map_length, chunk_len; exact Hj).
  rewrite map_nth, chunk_nth by exact Hj.
  assert (L : length (firstn n (skipn (j * n) (padded P Y))) = n).
  { rewrite firstn_length, skipn_length, padded_len. lia. }
  fold n. split; [rewrite len_zadd; [exact LX|]; rewrite L; symmetry; exact LX|].
  intros a Ha. rewrite at_zadd by (rewrite ?L, ?LX; exact Ha). rewrite HX by exact Ha. f_equal.
  rewrite <- padded_R by lia. unfold at_forms. rewrite nth_firstn_lt by exact Ha.
  rewrite nth_skipn'. reflexivity.
Qed.
Lemma knot_R t i : (t <= T)%nat -> (i < m)%nat -> forall a, (a < n)%nat ->
  at_forms (nth (t * m + i) (places P X Y) []) x a = knotR P u y t i a.
Proof.
  intros Ht Hi a Ha. assert (t * m + i < S T * m)%nat by (assert (t * m <= T * m)%nat
    by (apply Nat.mul_le_mono_r; lia); simpl; lia).
  destruct (places_R (t * m + i)) as [_ K]; [assumption|]. apply K. exact Ha.
Qed.
Lemma places_len : length (places P X Y) = (S T * m)%nat.
Proof. unfold places. rewrite map_length, chunk_len. reflexivity. Qed.
Lemma end_R j : (j < m * n + n_q P)%nat -> at_forms (endA P (places P X Y) Y) x j = endR P u y j.
Proof.
  intro Hj. pose proof (some_axis _ _ HP) as Np. fold n in Np. unfold at_forms, endA. fold m T.
  set (L := firstn m (skipn (T * m) (places P X Y))).
  assert (LL : length L = m). { unfold L. rewrite firstn_length, skipn_length, places_len.
    simpl. lia. }
  assert (Ln : forall l, In l L -> length l = n).
  { intros l Hl. apply (In_nth _ _ []) in Hl as (i & Hi & <-). rewrite LL in Hi. unfold L.
    rewrite nth_firstn_lt by exact Hi. rewrite nth_skipn'. apply places_R. simpl. lia. }
  unfold endR. fold m n T. destruct (Nat.ltb_spec j (m * n)) as [C|C].
  - rewrite app_nth1 by (rewrite (concat_len n) by exact Ln; rewrite LL; exact C).
    rewrite (nth_concat _ n) by (auto; rewrite LL; exact C).
    assert (Hi : (j / n < m)%nat) by (apply Nat.div_lt_upper_bound; lia). unfold L.
    rewrite nth_firstn_lt by exact Hi. rewrite nth_skipn'.
    assert (Hm : (j mod n < n)%nat) by (apply Nat.mod_upper_bound; lia).
    assert (Hp : (T * m + j / n < S T * m)%nat) by (simpl; lia).
    destruct (places_R _ Hp) as [_ K]. specialize (K (j mod n)%nat Hm).
    unfold at_forms in K. rewrite K.
    f_equal. f_equal. rewrite Nat.mul_add_distr_r, <- Nat.mul_assoc.
    pose proof (Nat.div_mod j n ltac:(lia)). lia.
  - rewrite app_nth2 by (rewrite (concat_len n) by exact Ln; rewrite LL; exact C).
    rewrite (concat_len n) by exact Ln. rewrite LL. unfold extrasA. fold m n T.
    rewrite nth_firstn_lt by lia. rewrite nth_skipn'. rewrite Rplus_0_l.
    replace (S T * (m * n) + (j - m * n))%nat with (T * (m * n) + j)%nat by (simpl; lia).
    pose proof (padded_R (T * (m * n) + j)) as K. unfold at_forms in K. apply K. simpl. lia.
Qed.
Lemma below_R A bound Z z i a b : nth_error A i = Some (a, b) ->
  (forall j, (j < length a)%nat -> at_forms Z x j = z j) ->
  (forall r, In r (below A bound Z) -> rowR x r) -> exists r, bound i a = Some r /\
    dotR a z + Q2R r <= Q2R b.
Proof.
  intros Hi HZ HR. apply (in_numbered _ O) in Hi. simpl in Hi.
  pose proof (in_map (fun iab => let '(i, (a, b)) := iab in match bound i a with None => never
     | Some r => (false, aadd (aconst (qadd b (- r))) (aneg (lincomb a Z))) end) _ _ Hi) as M.
     cbv beta iota in M.
  apply HR in M. destruct (bound i a) as [r|]; [|exfalso; exact (never_R _ M)]. exists r.
  split; [reflexivity|].
  unfold rowR in M. cbn [fst snd] in M. rewrite affR_add, affR_neg, affR_const, affR_lincomb, R_add,
    Q2R_opp in M.
  rewrite (dotR_ext a _ z HZ) in M. lra.
Qed.
Lemma conditions_R ds B H :
  (forall r, In r (conditions P ds B H X Y) -> rowR x r) ->
  (forall b d w h t, In (b, d) (combine (tasks P) ds) -> dir_at d t = Some (w, h) ->
    length w = n_p P) ->
  conditionsR P ds B H u y.
Proof.
  intros HC HW. unfold conditions in HC. split; [|split].
  - intros a b Hab. pose proof (poly_len _ _ _ _ (start_rows _ _ HP) Hab) as La.
    apply In_nth_error in Hab as [i Hab].
    destruct (below_R (start P) (fun _ _ => Some 0%Q) X u i a b Hab) as (r & [= <-] & R).
    + intros j Hj. apply HX. lia.
    + intros r Hr. apply HC. rewrite !in_app_iff. auto.
    + rewrite R0 in R. lra.
  - intros i a b Hab. pose proof (poly_len _ _ _ _ (goal_rows _ _ HP) (nth_error_In _ _ Hab)) as La.
    apply (below_R (goal P) (fun i a => reach (final B) (nth i H []) a) (endA P (places P X Y) Y)
      (endR P u y) i a b Hab).
    + intros j Hj. apply end_R. unfold m, n. lia.
    + intros r Hr. apply HC. rewrite !in_app_iff. auto.
  - intros o b d Hod t Ht.
    assert (Hob : In (o, b) (tasks P)) by (eapply in_combine_l; eauto).
    apply tasks_in in Hob as [Ho Hb].
    pose proof (last_step _ _ HP o Ho) as Hl.
    assert (HC' : forall r, In r (clear P B (places P X Y) (o, b) d) -> rowR x r).
    { intros r Hr. apply HC. rewrite !in_app_iff. right. right. apply in_flat_map.
      exists ((o, b), d). auto. }
    clear HC. unfold clear in HC'. cbn [fst snd] in HC'.
    assert (Hseq : In t (seq (first o) (S (last o) - first o))) by (apply in_seq; lia).
    destruct (dir_at d t) as [[w h]|] eqn:Ed.
    + exists w, h. split; [reflexivity|]. pose proof (HW _ _ _ _ _ Hod Ed) as Lw. intros i Hi.
      pose proof (part_points _ _ HP b i Hb Hi) as Hm.
      assert (HD : forall r, In r (clear_at P B (places P X Y) (w, h) t i) -> rowR x r).
      { intros r Hr. apply HC'. apply in_flat_map. exists t. split; [exact Hseq|]. rewrite Ed.
        apply in_flat_map. exists i. auto. }
      unfold clear_at in HD.
      destruct (reach (nth i (nth t (interval B) []) (Rows [])) [] (vscale (-1) w)) as [r|].
      2: { exfalso. apply (never_R x). apply HD. simpl. auto. }
      exists r. split; [reflexivity|].
      assert (G : forall s, (s <= T)%nat -> rowR x (apart w (qadd h r) (nth (s * m + i) (places P
        X Y) [])) ->
                  Q2R h + Q2R r < dotR w (knotR P u y s i)).
      { intros s Hs E. unfold rowR, apart in E. cbn [fst snd] in E.
        rewrite affR_add, affR_const, affR_lincomb, Q2R_opp, R_add in E.
        rewrite (dotR_ext w _ (knotR P u y s i)) in E; [lra|]. intros a Ha.
        apply knot_R; [exact Hs|exact Hm|].
        unfold n. lia. }
      split; apply G; try (unfold T; lia); apply HD; simpl; auto.
    + exfalso. apply (never_R x). apply HC'. apply in_flat_map. exists t. split; [exact Hseq|].
      rewrite Ed. simpl. auto.
Qed.
End Forms.
