(* What an accepted proof of no plan, or of volumes, means [T30].  Read with Spec.v. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia ZArith.
Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts BinFacts ConditionFacts Doubt DoubtFacts.
Require Import NoPlan Trajectories HullFacts LeafFacts HitFacts TilingFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- A plan that fails is not safe ---- *)
Theorem failing_is_not_safe P N E u k : fails P N E u k -> ~ safe P N E u k.
Proof.
  intros [H|(B & tau & HB & Hk & Ht & _ & H)] (S1 & _ & S3); [exact (H S1)|]. destruct (S3 B HB Hk tau Ht) as [G C].
  destruct H as [H|(o & t & s & b & x & Ho & Ht' & Hs & Hb & Hx & Hin)]; [exact (H G)|exact (C o t s b x Ho Ht' Hs Hb Hx Hin)].
Qed.

(* ---- Boxes of (z, k) ---- *)
Lemma inBox_upto B : forall x y, (forall i, (i < length B)%nat -> x i = y i) -> inBox B x -> inBox B y.
Proof.
  induction B as [|[lo hi] B IH]; intros x y E H; simpl in *; [exact I|]. rewrite <- (E O) by lia. split; [apply H|].
  apply (IH (shift x)); [intros i Hi; apply E; lia|apply H].
Qed.
Lemma inside_upto B : forall x y, (forall i, (i < length B)%nat -> x i = y i) -> inside B x -> inside B y.
Proof.
  induction B as [|[lo hi] B IH]; intros x y E H; simpl in *; [exact I|]. rewrite <- (E O) by lia. split; [apply H|].
  apply (IH (shift x)); [intros i Hi; apply E; lia|apply H].
Qed.
Lemma inBox_dec B : forall x, inBox B x \/ ~ inBox B x.
Proof.
  induction B as [|[lo hi] B IH]; intro x; simpl; [auto|].
  destruct (Rle_dec (Q2R lo) (x O)), (Rle_dec (x O) (Q2R hi)), (IH (shift x)); tauto.
Qed.
Section Place.
Variables (P : problem) (N : list layer) (u k : rv).
Lemma place_z i : (i < n_p P)%nat -> place P N u k i = endR P u (netR N k) i.
Proof. intro H. unfold place. destruct (Nat.ltb_spec i (n_p P)); [reflexivity|lia]. Qed.
Lemma place_k i : place P N u k (n_p P + i)%nat = k i.
Proof. unfold place. destruct (Nat.ltb_spec (n_p P + i) (n_p P)); [lia|]. f_equal. lia. Qed.
Lemma place_box B : (n_p P <= length B)%nat ->
  (inBox B (place P N u k) <-> inBox (firstn (n_p P) B) (endR P u (netR N k)) /\ inBox (skipn (n_p P) B) k).
Proof.
  intro L. assert (LF : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  rewrite <- (firstn_skipn (n_p P) B) at 1. rewrite inBox_app, LF. split; intros [H K]; split.
  - eapply inBox_upto; [|exact H]. intros i Hi. apply place_z. lia.
  - eapply inBox_upto; [|exact K]. intros i _. apply place_k.
  - eapply inBox_upto; [|exact H]. intros i Hi. symmetry. apply place_z. lia.
  - eapply inBox_upto; [|exact K]. intros i _. symmetry. apply place_k.
Qed.
Lemma place_inside B : (n_p P <= length B)%nat -> inside B (place P N u k) -> inside (skipn (n_p P) B) k.
Proof.
  intros L H. assert (LF : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  rewrite <- (firstn_skipn (n_p P) B) in H. apply inside_app in H as [_ H]. rewrite LF in H.
  eapply inside_upto; [|exact H]. intros i _. apply place_k.
Qed.
End Place.

(* ---- The cells that are kept are those of the box ---- *)
Lemma same_box_eq A : forall B, same_box A B = true -> A = B.
Proof.
  assert (Q : forall a b, same_number a b = true -> a = b).
  { intros [n d] [m e] H. unfold same_number in H. simpl in H. apply andb_prop in H as [H G].
    apply Z.eqb_eq in H. apply Pos.eqb_eq in G. congruence. }
  induction A as [|[a b] A IH]; intros [|[c d] B] H; simpl in H; try discriminate; [reflexivity|].
  rewrite !andb_true_iff in H. destruct H as [[H G] K]. rewrite (Q _ _ H), (Q _ _ G), (IH _ K). reflexivity.
Qed.
Lemma check_leaves_R P N F all ls : forall kept, snd kept = cells_in N (fst kept) -> check_leaves P N F all kept ls = true ->
  forall B r, In (B, r) ls -> thick B = true /\ exists cs, (needs_cells P r = true -> cs = cells_in N (skipn (n_p P) B)) /\
    check_leaf P F all (firstn (n_p P) B) (skipn (n_p P) B) cs r = true.
Proof.
  induction ls as [|[B' r'] ls IH]; intros kept HK H B r Hin; [destruct Hin|]. cbn [check_leaves] in H. cbv zeta in H.
  rewrite !andb_true_iff in H. destruct H as [[HT HL] HR].
  set (now := if negb (needs_cells P r') then kept else _) in *.
  assert (HN : snd now = cells_in N (fst now) /\ (needs_cells P r' = true -> fst now = skipn (n_p P) B')).
  { unfold now. destruct (needs_cells P r'); simpl; [|split; [exact HK|discriminate]].
    destruct (same_box _ (fst kept)) eqn:E; [apply same_box_eq in E; auto|simpl; auto]. }
  destruct Hin as [[= <- <-]|Hin]; [|apply (IH now (proj1 HN) HR B r Hin)].
  split; [exact HT|]. eexists. split; [|exact HL]. intro NC. rewrite NC. destruct HN as [-> HN]. rewrite (HN NC). reflexivity.
Qed.

(* ---- Leaves ---- *)
Lemma shrunk_directions e A m : fst (combine_rows (shrunk e A) m) = fst (combine_rows A m).
Proof.
  induction m as [|[i a] m IH]; [reflexivity|]. simpl.
  assert (G : fst (nth i (shrunk e A) ([], 0%Q)) = fst (nth i A ([], 0%Q))).
  { unfold shrunk. destruct (Nat.lt_ge_cases i (length A)) as [H|H].
    - rewrite (nth_indep _ _ ((fun ab => (fst ab, qadd (snd ab) (- dotQ (vabs (fst ab)) e))) ([], 0%Q))) by (rewrite map_length; exact H).
      rewrite (map_nth (fun ab => (fst ab, qadd (snd ab) (- dotQ (vabs (fst ab)) e)))). reflexivity.
    - rewrite !nth_overflow by (rewrite ?map_length; exact H). reflexivity. }
  destruct (nth i (shrunk e A) ([], 0%Q)) as [w b]. destruct (nth i A ([], 0%Q)) as [w' b']. simpl in *. rewrite G, IH. reflexivity.
Qed.
Lemma exceeds_R wh X x : rowR x (exceeds wh X) -> Q2R (snd wh) < dotR (fst wh) (at_forms X x).
Proof. unfold exceeds, rowR. cbn [fst snd]. rewrite affR_add, affR_const, affR_lincomb, Q2R_opp. lra. Qed.
Lemma combine_len n A m : poly_ok n A = true -> fits A m = true -> (length (fst (combine_rows A m)) <= n)%nat.
Proof.
  intros HA Hm. apply andb_prop in Hm as [_ Hm]. induction m as [|[i a] m IH]; [simpl; lia|]. simpl in *. apply andb_prop in Hm as [Hi Hm].
  specialize (IH Hm). apply Nat.ltb_lt in Hi. pose proof (nth_In A ([], 0%Q) Hi) as K.
  destruct (nth i A ([], 0%Q)) as [w b]. pose proof (poly_len _ _ _ _ HA K) as L. simpl.
  assert (V : forall p q : vec, length (vadd p q) = Nat.max (length p) (length q)) by (induction p; intros [|c q]; simpl; auto).
  rewrite V. unfold vscale. rewrite map_length. lia.
Qed.

Section Proof.
Variables (P : problem) (N : list layer) (E : tube) (p : proof).
Hypothesis HC : context_ok P N E = true.
Hypothesis HP : check_proof P N E p = true.

Let all := bins E.
Lemma HPr : problem_ok P N = true. Proof. apply andb_prop in HC as [H _]. exact H. Qed.
Lemma HE : tube_ok P E = true. Proof. apply andb_prop in HC as [_ H]. exact H. Qed.
Lemma SP : sizes P N. Proof. apply problem_inv, HPr. Qed.
Lemma proof_inv : (forall B, In B all -> wide_bin P B) /\ length (z_box p) = n_p P /\ thick (z_box p ++ domain P) = true /\
  check_faces P (goal_rows_of P (filter (fun B => meets (box B) (domain P)) all)) 0 (z_box p) (faces p) = true /\
  splits_ok (z_box p ++ domain P) (root p) = true /\
  check_leaves P N (frame_of P N) all ([], cells_in N []) (leaves_of P p) = true.
Proof.
  pose proof HP as H. unfold check_proof in H. fold all in H. cbv zeta in H. rewrite !andb_true_iff in H.
  destruct H as (((((H1 & H2) & H3) & H4) & H5) & H6). apply Nat.eqb_eq in H2. split; [|auto].
  pose proof HE as T. unfold tube_ok in T. rewrite !andb_true_iff in T. destruct T as [_ T]. intros B HB.
  apply wide_bin_intro; [eapply forallb_forall in T; [exact T|exact HB]|eapply forallb_forall in H1; [exact H1|exact HB]].
Qed.
Lemma leaf_size B r : In (B, r) (leaves_of P p) -> length B = (n_p P + n_k P)%nat.
Proof.
  intro H. destruct proof_inv as (_ & LZ & _ & _ & HS & _). destruct (leaves_in _ _ _ _ HS H) as (L & _ & _).
  rewrite L, app_length, LZ, (domain_size _ _ SP). reflexivity.
Qed.
Lemma leaf_ranges B r : In (B, r) (leaves_of P p) -> thick B = true -> ranges (skipn (n_p P) B) (domain P).
Proof.
  intros H T. pose proof (leaf_size B r H) as LB. destruct proof_inv as (_ & LZ & _ & _ & HS & _).
  destruct (leaves_in _ _ _ _ HS H) as (_ & S & _).
  assert (LF : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  assert (TT : thick (firstn (n_p P) B) = true /\ thick (skipn (n_p P) B) = true).
  { rewrite <- (firstn_skipn (n_p P) B) in T. unfold thick in *. rewrite forallb_app in T. apply andb_prop in T. exact T. }
  assert (M : exists y, inBox (firstn (n_p P) B) y).
  { destruct TT as [TT _]. revert TT. generalize (firstn (n_p P) B) as D. clear. induction D as [|[a b] D IH]; intro T; [exists (fun _ => 0); exact I|].
    simpl in T. apply andb_prop in T as [T1 T]. apply R_lt in T1. destruct (IH T) as [y Hy].
    exists (fun i => match i with O => Q2R a | S j => y j end). split; [lra|exact Hy]. }
  destruct M as [y Hy]. apply ranges_intro; [apply TT|rewrite skipn_length, (domain_size _ _ SP); lia|].
  intros x Hx. specialize (S (join (n_p P) y x)).
  assert (K : inBox (z_box p ++ domain P) (join (n_p P) y x)).
  { apply S. rewrite <- (firstn_skipn (n_p P) B). apply inBox_app. rewrite LF. split.
    - eapply inBox_upto; [|exact Hy]. intros i Hi. symmetry. apply join_low. lia.
    - eapply inBox_upto; [|exact Hx]. intros i _. symmetry. apply join_high. }
  apply inBox_app in K as [_ K]. rewrite LZ in K. eapply inBox_upto; [|exact K]. intros i _. apply join_high.
Qed.

Lemma unsafe_leaf B r : In (B, r) (leaves_of P p) -> is_unsafe r = true -> forall u k, inBox B (place P N u k) -> fails P N E u k.
Proof.
  intros Hin Hr u k HB. pose proof SP as SP'. destruct proof_inv as (HW & LZ & HT & HF & HS & HL).
  destruct (check_leaves_R P N _ all _ ([], cells_in N []) eq_refl HL B r Hin) as (Th & cs & NC & CL). clear HL.
  pose proof (leaf_size B r Hin) as LB. pose proof (leaf_ranges B r Hin Th) as HR.
  apply place_box in HB as [HZ HD]; [|lia].
  assert (LZ' : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  assert (LD' : length (skipn (n_p P) B) = n_k P) by (rewrite skipn_length; lia).
  destruct (bin_met P E _ k HE HR HD) as (B0 & I0 & K0). fold all in I0.
  assert (I1 : In B0 all) by (apply filter_In in I0; apply I0). pose proof (HW B0 I1) as W0.
  assert (WW : forall C, In C (met all (skipn (n_p P) B)) -> wide_bin P C) by (intros C HC'; apply filter_In in HC' as [HC' _]; auto).
  assert (Failed : forall tau, in_tube P N B0 u k tau -> continuous tau -> misses P tau \/ touches P tau -> fails P N E u k).
  { intros tau A1 A2 A3. right. exists B0, tau. auto. }
  destruct r as [m|m|h|s|]; try discriminate; unfold check_leaf in CL; cbv zeta in CL.
  - apply andb_prop in CL as [Hm CL]. set (A := goal_rows_of P (met all (skipn (n_p P) B))) in *.
    assert (Hm' : fits A m = true) by (apply combine_shrunk_fits; exact Hm).
    assert (Dir : fst (combine_rows A m) = fst (combine_rows (goal P) m)) by apply shrunk_directions.
    assert (Lw : (length (fst (combine_rows A m)) <= n_points P * n_p P + n_q P)%nat).
    { rewrite Dir. apply combine_len; [apply (goal_rows _ _ SP')|exact Hm]. }
    assert (G : Q2R (snd (combine_rows A m)) < dotR (fst (combine_rows A m)) (endR P u (netR N k))).
    { destruct (about_z P (fst (combine_rows A m))) eqn:AZ.
      - unfold about_z in AZ. apply negb_true_iff in AZ. rewrite (dotR_split (n_p P)), (zero_R _ AZ), Rplus_0_r.
        pose proof (corners_R _ _ HZ) as CZ. set (w := firstn (n_p P) (fst (combine_rows A m))) in *.
        pose proof (cone_strict _ (- Q2R (snd (combine_rows A m))) w _ 1 CZ ltac:(lra)) as K.
        rewrite (dotR_ext w (cut_off _ _) (endR P u (netR N k))) in K.
        + enough (0 < - Q2R (snd (combine_rows A m)) * 1 + dotR w (endR P u (netR N k))) by lra. apply K.
          intros v Hv. eapply forallb_forall in CL; [|exact Hv]. apply R_lt in CL. rewrite dotQ_R in CL. lra.
        + intros i Hi. unfold cut_off. rewrite LZ'. unfold w in Hi. rewrite firstn_length in Hi.
          destruct (Nat.ltb_spec i (n_p P)); [reflexivity|lia].
      - assert (NC' : cs = cells_in N (skipn (n_p P) B)).
        { apply NC. unfold needs_cells. rewrite <- Dir, AZ. reflexivity. }
        rewrite NC' in CL. destruct (leaf_hull P N u k _ _ _ LZ' LD' HZ HD CL) as (V & HV & HVt).
        pose proof (hull_row V _ _ HV HVt) as K. apply exceeds_R in K.
        rewrite (dotR_ext _ _ (endR P u (netR N k))) in K; [exact K|]. intros j Hj. apply (ends_R' P N SP'). lia. }
    destruct (goal_missed P N SP' u k B0 _ W0 I0 WW (combination_fails _ _ _ Hm' G)) as (tau & T1 & T2 & T3).
    apply (Failed tau); auto.
  - left. apply andb_prop in CL as [Hm CL]. rewrite (NC eq_refl) in CL.
    destruct (leaf_hull P N u k _ _ _ LZ' LD' HZ HD CL) as (V & HV & HVt). pose proof (hull_row V _ _ HV HVt) as K.
    apply exceeds_R in K. apply (combination_fails _ _ _ Hm).
    rewrite (dotR_ext _ _ u) in K; [exact K|]. intros j Hj. apply (start_R P N SP').
    pose proof (combine_len _ _ _ (start_rows _ _ SP') Hm). lia.
  - unfold check_hit in CL. destruct (nth_error (obstacles P) (whom h)) as [o|] eqn:Eo; [|discriminate].
    destruct (nth_error (parts P) (which_part h)) as [b|] eqn:Eb; [|discriminate]. rewrite !andb_true_iff in CL.
    destruct CL as ((((((T1 & T2) & S1) & S2) & HL) & Hc) & CL). apply Nat.leb_le in T1, T2. apply R_le in S1, S2.
    rewrite R0 in S1. rewrite R1 in S2. rewrite (NC eq_refl) in CL. cbv zeta in CL.
    destruct (leaf_hull P N u k _ _ _ LZ' LD' HZ HD CL) as (V & HV & HVt).
    destruct (hit_leaf P N SP' u k B0 _ h o b V W0 I0 (nth_error_In _ _ Eo) (nth_error_In _ _ Eb) (conj T1 T2) (conj S1 S2) HL Hc HV HVt)
      as (tau & A1 & A2 & A3).
    apply (Failed tau); auto.
Qed.

Lemma safe_leaf B s : In (B, Safe s) (leaves_of P p) -> forall u k, inside B (place P N u k) -> safe P N E u k.
Proof.
  intros Hin u k HI. pose proof SP as SP'. destruct proof_inv as (HW & LZ & HT & HF & HS & HL).
  destruct (check_leaves_R P N _ all _ ([], cells_in N []) eq_refl HL B _ Hin) as (Th & cs & NC & CL). clear HL.
  pose proof (leaf_size B _ Hin) as LB. pose proof (place_inside P N u k B ltac:(lia) HI) as HK.
  pose proof (inside_in _ _ HI) as HB. destruct (leaves_in _ _ _ _ HS Hin) as (_ & Sub & _).
  pose proof (Sub _ HB) as HRoot. apply place_box in HRoot as [_ HDom]; [|rewrite app_length; lia].
  rewrite skipn_app, LZ, Nat.sub_diag, skipn_all2 in HDom by lia. simpl in HDom.
  apply place_box in HB as [HZ HD]; [|lia].
  assert (LZ' : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  assert (LD' : length (skipn (n_p P) B) = n_k P) by (rewrite skipn_length; lia).
  unfold check_leaf in CL. cbv zeta in CL. apply andb_prop in CL as [Hs CL]. rewrite (NC eq_refl) in CL.
  assert (Cond : forall C, In C all -> inBox (box C) k -> conditionsR P (dirs_of P s) C [] u (netR N k)).
  { intros C IC KC. eapply forallb_forall in CL.
    2: { apply filter_In. split; [exact IC|]. apply (inside_met _ _ k HK KC). }
    cbv zeta in CL. destruct (leaf_hull P N u k _ _ _ LZ' LD' HZ HD CL) as (V & HV & HVt).
    destruct (outs_R P N SP' u k) as [HY LY]. destruct (start_R P N SP' u k) as [HX LX].
    apply (conditions_R P N _ _ _ u (netR N k) SP' HX ltac:(intros; apply HY) LX LY).
    - intros q Hq. apply (hull_row V _ _ HV). intros v Hv. specialize (HVt v Hv). eapply forallb_forall in HVt; [exact HVt|exact Hq].
    - intros b d w g t Hbd Hd. eapply dirs_valid; eauto. }
  destruct (every_k_has_a_bin P E k HE HDom) as (B0 & I0 & X0). split; [|split; [eauto|]].
  - apply (Cond B0 I0 X0).
  - intros C IC KC. apply (conditions_succeed P N s C [] u k HPr Hs (Cond C IC KC)).
Qed.

Lemma faces_R A (e : rv) : forall Z fs i, check_faces P A i Z fs = true -> inPoly A e -> inBox Z (fun j => e (i + j)%nat).
Proof.
  induction Z as [|[lo hi] Z IH]; intros [|[l m] fs] i H HA; simpl in H; try discriminate; [exact I|].
  destruct (combine_rows A l) as [w h] eqn:El. destruct (combine_rows A m) as [v g] eqn:Em. rewrite !andb_true_iff in H.
  destruct H as ((((((F1 & F2) & S1) & Q1) & S2) & Q2) & H). apply andb_prop in F1 as [F1 _]. apply andb_prop in F2 as [F2 _].
  pose proof (combine_R A l F1 e HA) as C1. pose proof (combine_R A m F2 e HA) as C2. rewrite El in C1. rewrite Em in C2. simpl in C1, C2.
  rewrite (same_R _ _ S1), dotR_vscale, Rm1 in C1. rewrite (same_R _ _ S2) in C2. apply R_le in Q1, Q2. rewrite Q2R_opp in Q1.
  assert (U : dotR (unit_vec i) e = e i) by (pose proof (unit_R i e) as U; unfold affR, unit_form in U; simpl in U; rewrite R0 in U; lra).
  rewrite U in C1, C2. split; [rewrite Nat.add_0_r; lra|].
  eapply inBox_upto; [|apply (IH fs (S i) H HA)]. intros j _. unfold shift. f_equal. lia.
Qed.
Lemma outside_fails u k : inBox (domain P) k -> ~ inBox (z_box p ++ domain P) (place P N u k) -> fails P N E u k.
Proof.
  intros HK HO. pose proof SP as SP'. destruct proof_inv as (HW & LZ & HT & HF & HS & HL).
  destruct (every_k_has_a_bin P E k HE HK) as (B0 & I0 & X0). fold all in I0.
  set (bs := filter (fun B => meets (box B) (domain P)) all) in *.
  assert (I1 : In B0 bs).
  { apply filter_In. split; [exact I0|]. apply (meets_R _ _ k); auto. apply zip3_box, boxes_len in I0.
    pose proof HE as T. apply tube_inv in T as (C & _). apply covers_len in C. congruence. }
  assert (G : ~ inPoly (goal_rows_of P bs) (endR P u (netR N k))).
  { intro K. apply HO. apply place_box; [rewrite app_length; lia|].
    rewrite firstn_app, skipn_app, LZ, Nat.sub_diag, firstn_all2, skipn_all2 by lia. simpl. rewrite app_nil_r.
    split; [|exact HK]. exact (faces_R _ _ _ _ _ HF K). }
  destruct (goal_missed P N SP' u k B0 bs (HW B0 I0) I1 ltac:(intros C HC'; apply filter_In in HC' as [HC' _]; auto) G) as (tau & T1 & T2 & T3).
  right. exists B0, tau. auto 7.
Qed.
End Proof.

(* No plan: every real p0 with every real k of the domain fails. *)
Theorem no_plan P N E p : context_ok P N E = true -> check_no_plan P N E p = true ->
  forall u k, inBox (domain P) k -> fails P N E u k.
Proof.
  intros HC HK u k Hk. apply andb_prop in HK as [HU HP].
  destruct (inBox_dec (z_box p ++ domain P) (place P N u k)) as [H|H]; [|apply (outside_fails P N E p HC HP u k Hk H)].
  destruct (leaves_cover (root p) _ _ H) as (B & r & Hin & HB).
  apply (unsafe_leaf P N E p HC HP B r Hin); [|exact HB]. eapply forallb_forall in HU; [|exact Hin]. exact HU.
Qed.

(* Volumes: the leaves tile the box of (z, k); inside the safe ones every plan is safe, in the unsafe ones and outside
   of the whole box every plan fails; the numbers are the sums of their volumes. *)
Definition boxes_of (pick : reason -> bool) (P : problem) (p : proof) :=
  map fst (filter (fun l => pick (snd l)) (leaves_of P p)).
Theorem volumes_true P N E p : context_ok P N E = true -> check_proof P N E p = true ->
  tiles (map fst (leaves_of P p)) (z_box p ++ domain P) /\
  (forall B u k, In B (boxes_of is_safe P p) -> inside B (place P N u k) -> safe P N E u k) /\
  (forall B u k, In B (boxes_of is_unsafe P p) -> inBox B (place P N u k) -> fails P N E u k) /\
  (forall u k, inBox (domain P) k -> ~ inBox (z_box p ++ domain P) (place P N u k) -> fails P N E u k) /\
  let '(safe_, unsafe_, all_) := volumes P p in
  Q2R safe_ = total (boxes_of is_safe P p) /\ Q2R unsafe_ = total (boxes_of is_unsafe P p) /\
  Q2R all_ = volume (z_box p ++ domain P).
Proof.
  intros HC HP. split; [|split; [|split; [|split]]].
  - apply leaves_tile. apply (proof_inv P N E p HC HP).
  - intros B u k HB HI. apply in_map_iff in HB as ([B' r] & <- & HB). apply filter_In in HB as [Hin Hr].
    destruct r as [m|m|h|s|]; try discriminate. apply (safe_leaf P N E p HC HP B' s Hin u k HI).
  - intros B u k HB HI. apply in_map_iff in HB as ([B' r] & <- & HB). apply filter_In in HB as [Hin Hr].
    apply (unsafe_leaf P N E p HC HP B' r Hin Hr u k HI).
  - intros u k. apply (outside_fails P N E p HC HP).
  - unfold volumes. rewrite !sum_of_R, volumeQ_R. auto.
Qed.
