(* What an accepted proof of no plan, or of volumes, means [T30].  Read with Spec.v. *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts NetworkFacts BinFacts
  ConditionFacts Doubt DoubtFacts.
From ParcJax Require Import NoPlan Trajectories HullFacts BoundFacts LeafFacts HitFacts TilingFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- A plan that fails is not safe ---- *)
Theorem failing_is_not_safe P N E u k : fails P N E u k -> ~ safe P N E u k.
Proof.
  intros [H|(B & tau & HB & Hk & Ht & _ & H)] (S1 & _ & S3); [exact (H S1)|].
  destruct (S3 B HB Hk tau Ht) as [G C].
  destruct H as [H|H]; [exact (G H)|exact (C H)].
Qed.

(* ---- Boxes of (z, k) ---- *)
Lemma inBox_upto B : forall x y, (forall i, (i < length B)%nat -> x i = y i) ->
  inBox B x -> inBox B y.
Proof.
  induction B as [|[lo hi] B IH]; intros x y E H; simpl in *; [exact I|]. rewrite <- (E O) by lia.
  split; [apply H|].
  apply (IH (shift x)); [intros i Hi; apply E; lia|apply H].
Qed.
Lemma inside_upto B : forall x y, (forall i, (i < length B)%nat -> x i = y i) ->
  inside B x -> inside B y.
Proof.
  induction B as [|[lo hi] B IH]; intros x y E H; simpl in *; [exact I|]. rewrite <- (E O) by lia.
  split; [apply H|].
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
  (inBox B (place P N u k) <-> inBox (firstn (n_p P) B) (endR P u (netR N k)) /\
    inBox (skipn (n_p P) B) k).
Proof.
  intro L. assert (LF : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  rewrite <- (firstn_skipn (n_p P) B) at 1. rewrite inBox_app, LF. split; intros [H K]; split.
  - eapply inBox_upto; [|exact H]. intros i Hi. apply place_z. lia.
  - eapply inBox_upto; [|exact K]. intros i _. apply place_k.
  - eapply inBox_upto; [|exact H]. intros i Hi. symmetry. apply place_z. lia.
  - eapply inBox_upto; [|exact K]. intros i _. symmetry. apply place_k.
Qed.
Lemma place_inside B : (n_p P <= length B)%nat -> inside B (place P N u k) ->
  inside (skipn (n_p P) B) k.
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
  rewrite !andb_true_iff in H. destruct H as [[H G] K]. rewrite (Q _ _ H), (Q _ _ G), (IH _ K).
  reflexivity.
Qed.
(* What is checked of each leaf: by bounds, or at the vertices of cells. *)
Definition checked (P : problem) (N : list layer) all (B : area) (r : reason) : Prop :=
  let Z := firstn (n_p P) B in
  let D := skipn (n_p P) B in
  match r with
  | Bounded r' => boundable r' = true /\ exists ls, (needs_cells P r' = true ->
    ls = lines_in N D) /\
      check_leaf P (frame_of P N) all Z D no_cells (lowered (n_p P) D ls) r' = true
  | _ => exists cs, (needs_cells P r = true -> cs = cells_in N D) /\
      check_leaf P (frame_of P N) all Z D cs (fun q => q) r = true
  end.
Lemma check_leaves_R P N all ls : forall kept lined, snd kept = cells_in N (fst kept) ->
  snd lined = lines_in N (fst lined) ->
  check_leaves P N (frame_of P N) all kept lined ls = true ->
  forall B r, In (B, r) ls -> thick B = true /\ checked P N all B r.
Proof.
  induction ls as [|[B' r'] ls IH]; intros kept lined HK HLn H B r Hin; [destruct Hin|].
  assert (Cells : forall r0, let now := if negb (needs_cells P r0) then kept
      else if same_box (skipn (n_p P) B') (fst kept) then kept else (skipn (n_p P) B',
        cells_in N (skipn (n_p P) B')) in
      snd now = cells_in N (fst now) /\ (needs_cells P r0 = true -> fst now = skipn (n_p P) B')).
  { intro r0. destruct (needs_cells P r0); simpl; [|split; [exact HK|discriminate]].
    destruct (same_box _ (fst kept)) eqn:E; [apply same_box_eq in E; auto|simpl; auto]. }
  assert (Lines : forall r0, let now := if negb (needs_cells P r0) then lined
      else if same_box (skipn (n_p P) B') (fst lined) then lined else (skipn (n_p P) B',
        lines_in N (skipn (n_p P) B')) in
      snd now = lines_in N (fst now) /\ (needs_cells P r0 = true -> fst now = skipn (n_p P) B')).
  { intro r0. destruct (needs_cells P r0); simpl; [|split; [exact HLn|discriminate]].
    destruct (same_box _ (fst lined)) eqn:E; [apply same_box_eq in E; auto|simpl; auto]. }
  assert (Plain : (forall r0, r' <> Bounded r0) -> thick B = true /\ checked P N all B r).
  { intro NB. specialize (Cells r'). cbv zeta in Cells. set (now := if negb (needs_cells P r')
      then kept else _) in Cells.
    assert (G : thick B' && check_leaf P (frame_of P N) all (firstn (n_p P) B') (skipn (n_p P) B')
                  (if needs_cells P r' then snd now else []) (fun q => q) r' &&
                check_leaves P N (frame_of P N) all now lined ls = true).
    { destruct r'; try exact H. exfalso. eapply NB. reflexivity. }
    clear H. rewrite !andb_true_iff in G. destruct G as [[HT HL] HR]. destruct Cells as [C1 C2].
    destruct Hin as [[= <- <-]|Hin]; [|apply (IH now lined C1 HLn HR B r Hin)]. split; [exact HT|].
    assert (E : exists cs, (needs_cells P r' = true -> cs = cells_in N (skipn (n_p P) B')) /\
        check_leaf P (frame_of P N) all (firstn (n_p P) B') (skipn (n_p P) B') cs (fun q =>
          q) r' = true).
    { eexists. split; [|exact HL]. intro NC. rewrite NC, C1, (C2 NC). reflexivity. }
    destruct r'; try exact E. exfalso. eapply NB. reflexivity. }
  destruct r' as [us|m|h|s| |r']; try (apply Plain; discriminate).
  clear Plain. cbn [check_leaves] in H. cbv zeta in H. rewrite !andb_true_iff in H.
  destruct H as [[[HT HU] HL] HR].
  specialize (Lines r'). cbv zeta in Lines. set (now := if negb (needs_cells P r') then lined
    else _) in *.
  destruct Lines as [C1 C2]. destruct Hin as [[= <- <-]|Hin];
    [|apply (IH kept now HK C1 HR B r Hin)].
  split; [exact HT|]. split; [exact HU|]. exists (snd now). split; [|exact HL]. intro NC.
  rewrite C1, (C2 NC). reflexivity.
Qed.

(* ---- Leaves ---- *)
(* A combination of rows of the goal that an end misses: it misses one of them. *)
Lemma uses_R P bs us y : forallb (use_ok P bs) us = true ->
  Q2R (snd (combine_uses P bs us)) < dotR (fst (combine_uses P bs us)) y ->
  exists w, In w us /\ use_ok P bs w = true /\ Q2R (snd (use_row P bs w)) < dotR
    (fst (use_row P bs w)) y.
Proof.
  induction us as [|w us IH]; simpl; intros HU H; [rewrite R0 in H; lra|].
  apply andb_prop in HU as [Hw HU].
  destruct (Rlt_dec (Q2R (snd (use_row P bs w))) (dotR (fst (use_row P bs w)) y)) as [C|C];
    [exists w; auto|].
  destruct IH as (w' & Hin & K); [exact HU| |exists w'; auto].
  destruct (use_row P bs w) as [a b]. cbn [fst snd] in *. rewrite R_add, R_mul, dotR_vadd,
    dotR_vscale in H.
  unfold use_ok in Hw. rewrite !andb_true_iff in Hw. destruct Hw as [[_ Hw] _]. apply R_le in Hw.
  rewrite R0 in Hw.
  assert (Q2R (times w) * dotR a y <= Q2R (times w) * Q2R b) by (apply Rmult_le_compat_l; lra). lra.
Qed.
Lemma uses_directions P bs us : fst (combine_uses P bs us) = fst (combine_uses P [] us).
Proof.
  induction us as [|w us IH]; [reflexivity|]. simpl. unfold use_row.
  destruct (nth (which_row w) (goal P) ([], 0%Q)) as [a b].
  cbn [fst snd]. rewrite IH. reflexivity.
Qed.
Lemma vadd_len p : forall q : vec, length (vadd p q) = Nat.max (length p) (length q).
Proof. induction p; intros [|c q]; simpl; auto. Qed.
Lemma uses_len n P bs us : poly_ok n (goal P) = true -> forallb (use_ok P bs) us = true ->
  (length (fst (combine_uses P bs us)) <= n)%nat.
Proof.
  intros HA. induction us as [|w us IH]; intro H; [simpl; lia|]. simpl in *.
  apply andb_prop in H as [Hw H]. specialize (IH H).
  unfold use_ok in Hw. rewrite !andb_true_iff in Hw. destruct Hw as [[Hw _] _].
  apply Nat.ltb_lt in Hw.
  unfold use_row. pose proof (nth_In (goal P) ([], 0%Q) Hw) as K.
  destruct (nth (which_row w) (goal P) ([], 0%Q)) as [a b].
  pose proof (poly_len _ _ _ _ HA K). cbn [fst snd]. rewrite vadd_len. unfold vscale.
  rewrite map_length. lia.
Qed.
Lemma exceeds_R wh X x : rowR x (exceeds wh X) -> Q2R (snd wh) < dotR (fst wh) (at_forms X x).
Proof. unfold exceeds, rowR. cbn [fst snd]. rewrite affR_add, affR_const, affR_lincomb, Q2R_opp.
lra. Qed.
Lemma combine_len n A m : poly_ok n A = true -> fits A m = true ->
  (length (fst (combine_rows A m)) <= n)%nat.
Proof.
  intros HA Hm. apply andb_prop in Hm as [_ Hm]. induction m as [|[i a] m IH]; [simpl; lia|].
  simpl in *. apply andb_prop in Hm as [Hi Hm].
  specialize (IH Hm). apply Nat.ltb_lt in Hi. pose proof (nth_In A ([], 0%Q) Hi) as K.
  destruct (nth i A ([], 0%Q)) as [w b]. pose proof (poly_len _ _ _ _ HA K) as L. simpl.
  assert (V : forall p q : vec, length (vadd p q) = Nat.max (length p) (length q)) by (induction p;
    intros [|c q]; simpl; auto).
  rewrite V. unfold vscale. rewrite map_length. lia.
Qed.

Section Proof.
Variables (P : problem) (N : list layer) (E : tube) (H : list goal_hints) (p : proof).
Hypothesis HC : context_ok P N E = true.
Hypothesis HP : check_proof P N E H p = true.

Let all := bins E.
Lemma HPr : problem_ok P N = true. Proof. apply andb_prop in HC as [G _]. exact G. Qed.
Lemma HE : tube_ok P E = true. Proof. apply andb_prop in HC as [_ G]. exact G. Qed.
Lemma SP : sizes P N. Proof. apply problem_inv, HPr. Qed.
Lemma proof_inv : (forall B, In B all -> open_bin P B) /\ length (z_box p) = n_p P /\
  thick (z_box p ++ domain P) = true /\
  check_faces P (filter (fun B => meets (box B) (domain P)) all) 0 (z_box p) (faces p) = true /\
  splits_ok (z_box p ++ domain P) (root p) = true /\
  check_leaves P N (frame_of P N) (hinted E H) ([], cells_in N []) ([], lines_in N []) (leaves_of
    P p) = true.
Proof.
  pose proof HP as G. unfold check_proof in G. fold all in G. rewrite !andb_true_iff in G.
  destruct G as (((((H1 & H2) & H3) & H4) & H5) & H6). apply Nat.eqb_eq in H2. split; [|auto].
  pose proof HE as T. unfold tube_ok in T. rewrite !andb_true_iff in T. destruct T as [_ T].
  intros B HB.
  apply open_bin_intro; [eapply forallb_forall in T; [exact T|exact HB]|eapply forallb_forall in H1;
    [exact H1|exact HB]].
Qed.
Lemma leaf_size B r : In (B, r) (leaves_of P p) -> length B = (n_p P + n_k P)%nat.
Proof.
  intro Hin. destruct proof_inv as (_ & LZ & _ & _ & HS & _). destruct (leaves_in _ _ _ _ HS Hin)
    as (L & _ & _).
  rewrite L, app_length, LZ, (domain_size _ _ SP). reflexivity.
Qed.
Lemma leaf_ranges B r : In (B, r) (leaves_of P p) -> thick B = true ->
  ranges (skipn (n_p P) B) (domain P).
Proof.
  intros Hin T. pose proof (leaf_size B r Hin) as LB.
  destruct proof_inv as (_ & LZ & _ & _ & HS & _).
  destruct (leaves_in _ _ _ _ HS Hin) as (_ & S & _).
  assert (LF : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  assert (TT : thick (firstn (n_p P) B) = true /\ thick (skipn (n_p P) B) = true).
  { rewrite <- (firstn_skipn (n_p P) B) in T. unfold thick in *. rewrite forallb_app in T.
    apply andb_prop in T. exact T. }
  assert (M : exists y, inBox (firstn (n_p P) B) y).
  { destruct TT as [TT _]. revert TT. generalize (firstn (n_p P) B) as D. clear.
    induction D as [|[a b] D IH]; intro T; [exists (fun _ => 0); exact I|].
    simpl in T. apply andb_prop in T as [T1 T]. apply R_lt in T1. destruct (IH T) as [y Hy].
    exists (fun i => match i with O => Q2R a | S j => y j end). split; [lra|exact Hy]. }
  destruct M as [y Hy]. apply ranges_intro; [apply TT|rewrite skipn_length, (domain_size _ _ SP);
    lia|].
  intros x Hx. specialize (S (join (n_p P) y x)).
  assert (K : inBox (z_box p ++ domain P) (join (n_p P) y x)).
  { apply S. rewrite <- (firstn_skipn (n_p P) B). apply inBox_app. rewrite LF. split.
    - eapply inBox_upto; [|exact Hy]. intros i Hi. symmetry. apply join_low. lia.
    - eapply inBox_upto; [|exact Hx]. intros i _. symmetry. apply join_high. }
  apply inBox_app in K as [_ K]. rewrite LZ in K. eapply inBox_upto; [|exact K]. intros i _.
  apply join_high.
Qed.

(* Either way of asking rows, with low, at points that stand for what the last hidden layer holds,
   shows what it asks. *)
Definition shows (B : area) (u k : rv) (cs : cells) (low : row -> row) : Prop :=
  (forall r, everywhere cs (firstn (n_p P) B) (fun v => holdsQ v (low r)) = true ->
     rowR (join (n_p P) (endR P u (netR N k)) (stateR N (cut_off (n_k P) k))) r) /\
  forall test0, throughout cs test0 = true -> exists W held_at,
    (exists nu, weights nu (length W) /\ forall i, stateR N (cut_off (n_k P) k) i = mean nu W (fun w
      => held_at w i)) /\
    (forall z w r, length z = n_p P -> holdsQ (z ++ w) (low r) = true ->
      rowR (join (n_p P) (toR z) (held_at w)) r) /\
    forall test, throughout cs test = true -> forall w, In w W -> test w = true.
Lemma by_vertices B u k : length (firstn (n_p P) B) = n_p P -> length (skipn (n_p P) B) = n_k P ->
  inBox (firstn (n_p P) B) (endR P u (netR N k)) -> inBox (skipn (n_p P) B) k ->
  shows B u k (cells_in N (skipn (n_p P) B)) (fun q => q).
Proof.
  intros LZ LD HZ HD. split.
  - intros r HE'. destruct (leaf_hull P N u k _ _ _ LZ LD HZ HD HE') as (V & HV & HVt).
    exact (hull_row V _ _ HV HVt).
  - intros test0 H0. destruct (throughout_hull P N k _ _ LD HD H0) as (W & HW & HTh). exists W, toR.
    split; [exact (hull_mean W _ HW)|]. split; [|exact HTh]. intros z w r Lz Hr.
    apply holds_R in Hr.
    destruct r as [st f]. unfold rowR in *. cbn [fst snd] in *.
    rewrite (affR_ext f _ (toR (z ++ w))); [exact Hr|]. intro i. rewrite toR_app, Lz. reflexivity.
Qed.
Lemma by_bounds B u k : length (firstn (n_p P) B) = n_p P -> length (skipn (n_p P) B) = n_k P ->
  inBox (firstn (n_p P) B) (endR P u (netR N k)) -> inBox (skipn (n_p P) B) k ->
  shows B u k no_cells (lowered (n_p P) (skipn (n_p P) B) (lines_in N (skipn (n_p P) B))).
Proof.
  intros LZ LD HZ HD. set (D := skipn (n_p P) B) in *.
  assert (HD' : inBox D (cut_off (n_k P) k)).
  { eapply inBox_upto; [|exact HD]. intros i Hi. unfold cut_off. destruct (Nat.ltb_spec i (n_k P));
      [reflexivity|lia]. }
  assert (HO : forall i, (length D <= i)%nat -> cut_off (n_k P) k i = 0).
  { intros i Hi. unfold cut_off. destruct (Nat.ltb_spec i (n_k P)); [lia|reflexivity]. }
  pose proof (lowered_R D _ HD' HO N (n_p P)) as Low.
  split.
  - intros r HE'. apply Low.
    pose proof (corners_R _ _ HZ) as CZ. rewrite LZ in CZ.
    apply (lowered_upto _ _ _ _ (cut_off (n_p P) (endR P u (netR N k)))).
    { intros i Hi. unfold cut_off. destruct (Nat.ltb_spec i (n_p P)); [reflexivity|lia]. }
    apply (hull_row _ _ _ CZ). intros v Hv. destruct (everywhere_R _ _ _ HE' true [[]] ltac:(simpl;
      auto)) as [_ HT].
    pose proof (HT _ (in_product _ [[]] v [] Hv (or_introl eq_refl))) as G.
    rewrite app_nil_r in G. exact G.
  - intros _ _. exists [[]], (fun _ => stateR N (cut_off (n_k P) k)). split; [|split].
    + exists [1]. split; [|intro i; simpl; ring]. split; [reflexivity|]. split; [repeat constructor;
        lra|simpl; ring].
    + intros z w r Lz Hr. apply Low. apply holds_R in Hr. eapply lowered_upto; [|exact Hr].
      intros i Hi.
      rewrite toR_app, Lz. apply join_low. exact Hi.
    + intros test HT w [<-|[]]. simpl in HT. rewrite !andb_true_r in HT. exact HT.
Qed.
Lemma unsafe_leaf B r : In (B, r) (leaves_of P p) -> is_unsafe r = true ->
  forall u k, inBox B (place P N u k) -> fails P N E u k.
Proof.
  intros Hin Hr u k HB. pose proof SP as SP'. destruct proof_inv as (HW & LZ & HT & HF & HS & HL).
  destruct (check_leaves_R P N _ _ ([], cells_in N []) ([], lines_in N []) eq_refl eq_refl HL B r
    Hin) as (Th & Ch). clear HL.
  pose proof (leaf_size B r Hin) as LB. pose proof (leaf_ranges B r Hin Th) as HR.
  apply place_box in HB as [HZ HD]; [|lia].
  assert (LZ' : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  assert (LD' : length (skipn (n_p P) B) = n_k P) by (rewrite skipn_length; lia).
  assert (exists r' cs low, boundable r' = true /\ (needs_cells P r' = true ->
    shows B u k cs low) /\
    check_leaf P (frame_of P N) (hinted E H) (firstn (n_p P) B) (skipn (n_p P) B) cs low r' = true)
      as (r' & cs & low & Hr' & NC & CL).
  { pose proof (by_vertices B u k LZ' LD' HZ HD) as V.
    pose proof (by_bounds B u k LZ' LD' HZ HD) as L.
    destruct r as [us|m|h|s| |r']; try discriminate; unfold checked in Ch; cbv zeta in Ch;
      try (destruct Ch as (cs & NC & CL); eexists; exists cs, (fun q => q); split; [|split;
        [|exact CL]];
           [reflexivity|intro Y; rewrite (NC Y); exact V]).
    destruct Ch as (Hu & ls & NC & CL). exists r', no_cells, (lowered (n_p P) (skipn (n_p P) B) ls).
    split; [exact Hu|]. split; [|exact CL]. intro Y. rewrite (NC Y). exact L. }
  clear Ch Hr Hin r. rename r' into r. rename Hr' into Hr.
  destruct (bin_met P E H _ k HE HR HD) as (B0 & I0 & I1 & K0). pose proof (HW B0 I1) as W0.
  set (bs := map fst (met (hinted E H) (skipn (n_p P) B))) in *.
  assert (Failed : forall tau, in_tube P N B0 u k tau -> continuous tau -> misses P tau \/
    touches P tau -> fails P N E u k).
  { intros tau A1 A2 A3. right. exists B0, tau. auto. }
  destruct r as [us|m|h|s| |r]; try discriminate; unfold check_leaf in CL; cbv zeta in CL;
    fold bs in CL.
  - apply andb_prop in CL as [Hm CL].
    assert (Lw : (length (fst (combine_uses P bs us)) <= n_points P * n_p P + n_q P)%nat)
      by (apply uses_len; [apply (goal_rows _ _ SP')|exact Hm]).
    assert (G : Q2R (snd (combine_uses P bs us)) < dotR (fst (combine_uses P bs us)) (endR P u
      (netR N k))).
    { destruct (about_z P (fst (combine_uses P bs us))) eqn:AZ.
      - unfold about_z in AZ. apply negb_true_iff in AZ. rewrite (dotR_split (n_p P)),
          (zero_R _ AZ), Rplus_0_r.
        pose proof (corners_R _ _ HZ) as CZ. set (w := firstn (n_p P) (fst (combine_uses P bs us)))
          in *.
        pose proof (cone_strict _ (- Q2R (snd (combine_uses P bs us))) w _ 1 CZ ltac:(lra)) as K.
        rewrite (dotR_ext w (cut_off _ _) (endR P u (netR N k))) in K.
        + enough (0 < - Q2R (snd (combine_uses P bs us)) * 1 + dotR w (endR P u (netR N k))) by lra.
          apply K.
          intros v Hv. eapply forallb_forall in CL; [|exact Hv]. apply R_lt in CL.
          rewrite dotQ_R in CL. lra.
        + intros i Hi. unfold cut_off. rewrite LZ'. unfold w in Hi. rewrite firstn_length in Hi.
          destruct (Nat.ltb_spec i (n_p P)); [reflexivity|lia].
      - assert (NC' : needs_cells P (Misses us) = true) by (unfold needs_cells;
          rewrite <- (uses_directions P bs us), AZ; reflexivity).
        destruct (NC NC') as [S _]. pose proof (S _ CL) as K. apply exceeds_R in K.
        rewrite (dotR_ext _ _ (endR P u (netR N k))) in K; [exact K|]. intros j Hj.
        apply (ends_R' P N SP'). lia. }
    destruct (uses_R P bs us _ Hm G) as (w & _ & Hw & Gw).
    destruct (goal_missed P N SP' u k B0 bs w W0 I0 Hw Gw) as (tau & T1 & T2 & T3).
    apply (Failed tau); auto.
  - left. apply andb_prop in CL as [Hm CL]. destruct (NC eq_refl) as [S _].
    pose proof (S _ CL) as K. apply exceeds_R in K. apply (combination_fails _ _ _ Hm).
    rewrite (dotR_ext _ _ u) in K; [exact K|]. intros j Hj. apply (start_R P N SP').
    pose proof (combine_len _ _ _ (start_rows _ _ SP') Hm). lia.
  - unfold check_hit in CL. destruct (nth_error (obstacles P) (whom h)) as [o|] eqn:Eo;
      [|discriminate].
    destruct (nth_error (parts P) (which_part h)) as [b|] eqn:Eb; [|discriminate].
    rewrite !andb_true_iff in CL.
    destruct CL as (((((T1 & T2) & S1) & S2) & Hg) & CL). apply Nat.leb_le in T1, T2.
    apply R_le in S1, S2.
    rewrite R0 in S1. rewrite R1 in S2. cbv zeta in CL.
    pose proof (corners_R _ _ HZ) as CZ. rewrite LZ' in CZ.
    assert (exists z0, In z0 (corners_of (firstn (n_p P) B))) as [z0 Hz0].
    { destruct (corners_of (firstn (n_p P) B)) as [|z0 Zs]; [|exists z0; simpl; auto].
      pose proof (hull_mean _ _ CZ) as (mu & (L & _ & S) & _). destruct mu; [simpl in S;
        lra|discriminate]. }
    pose proof CL as C0. eapply forallb_forall in C0; [|exact Hz0].
    apply existsb_exists in C0 as (some0 & _ & C0).
    destruct (NC eq_refl) as [_ S]. destruct (S _ C0) as (W & held_at & HW' & HLow & HTh).
    clear some0 C0.
    destruct (hit_leaf P N SP' u k B0 bs h o b (corners_of (firstn (n_p P) B)) W W0 I0 (nth_error_In
      _ _ Eo) (nth_error_In _ _ Eb)
                (conj T1 T2) (conj S1 S2) Hg CZ) with (held_at := held_at) (low :=
                  low) as (tau & A1 & A2 & A3).
    + intros z Hz. rewrite (corners_len _ _ Hz). exact LZ'.
    + exact HW'.
    + exact HLow.
    + intros z Hz. eapply forallb_forall in CL; [|exact Hz].
      apply existsb_exists in CL as (some & Hin' & CL).
      apply existsb_exists. exists some. split; [exact Hin'|]. apply forallb_forall. intros w Hw.
      exact (HTh _ CL w Hw).
    + apply (Failed tau); auto.
Qed.

Lemma safe_leaf B s : In (B, Safe s) (leaves_of P p) -> forall u k, inside B (place P N u k) ->
  safe P N E u k.
Proof.
  intros Hin u k HI. pose proof SP as SP'. destruct proof_inv as (HW & LZ & HT & HF & HS & HL).
  destruct (check_leaves_R P N _ _ ([], cells_in N []) ([], lines_in N []) eq_refl eq_refl HL B _
    Hin) as (Th & cs & NC & CL). clear HL.
  pose proof (leaf_size B _ Hin) as LB. pose proof (place_inside P N u k B ltac:(lia) HI) as HK.
  pose proof (inside_in _ _ HI) as HB. destruct (leaves_in _ _ _ _ HS Hin) as (_ & Sub & _).
  pose proof (Sub _ HB) as HRoot. apply place_box in HRoot as [_ HDom]; [|rewrite app_length; lia].
  rewrite skipn_app, LZ, Nat.sub_diag, skipn_all2 in HDom by lia. simpl in HDom.
  apply place_box in HB as [HZ HD]; [|lia].
  assert (LZ' : length (firstn (n_p P) B) = n_p P) by (rewrite firstn_length; lia).
  assert (LD' : length (skipn (n_p P) B) = n_k P) by (rewrite skipn_length; lia).
  unfold check_leaf in CL. cbv zeta in CL. apply andb_prop in CL as [Hs CL].
  rewrite (NC eq_refl) in CL.
  assert (Cond : forall C hs, In (C, hs) (hinted E H) -> inBox (box C) k ->
    conditionsR P (dirs_of P s) C hs u (netR N k)).
  { intros C hs IC KC. eapply forallb_forall in CL.
    2: { apply filter_In. split; [exact IC|]. apply (inside_met _ _ k HK KC). }
    cbv zeta in CL. cbn [fst snd] in CL. destruct (leaf_hull P N u k _ _ _ LZ' LD' HZ HD CL)
      as (V & HV & HVt).
    destruct (outs_R P N SP' u k) as [HY LY]. destruct (start_R P N SP' u k) as [HX LX].
    apply (conditions_R P N _ _ _ u (netR N k) SP' HX ltac:(intros; apply HY) LX LY).
    - intros q Hq. apply (hull_row V _ _ HV). intros v Hv. specialize (HVt v Hv).
      eapply forallb_forall in HVt; [exact HVt|exact Hq].
    - intros b d w g t Hbd Hd. eapply dirs_valid; eauto. }
  destruct (every_k_has_a_bin P E k HE HDom) as (B0 & I0 & X0). split; [|split; [eauto|]].
  - destruct (hinted_ex E H B0 I0) as [hs Hh]. apply (Cond B0 hs Hh X0).
  - intros C IC KC. destruct (hinted_ex E H C IC) as [hs Hh].
    apply (conditions_succeed P N s C hs u k HPr Hs (Cond C hs Hh KC)).
Qed.

Lemma faces_R bs (e : rv) : forall Z fs i, check_faces P bs i Z fs = true ->
  (exists w, use_ok P bs w = true /\ Q2R (snd (use_row P bs w)) < dotR (fst (use_row P bs w)) e) \/
    inBox Z (fun j => e (i + j)%nat).
Proof.
  induction Z as [|[lo hi] Z IH]; intros [|[l m] fs] i HF; simpl in HF; try discriminate;
    [right; exact I|].
  destruct (combine_uses P bs l) as [w h] eqn:El. destruct (combine_uses P bs m) as [v g] eqn:Em.
  rewrite !andb_true_iff in HF.
  destruct HF as ((((((F1 & F2) & S1) & Q1) & S2) & Q2) & HF).
  assert (Miss : forall us, forallb (use_ok P bs) us = true ->
    (exists w, use_ok P bs w = true /\ Q2R (snd (use_row P bs w)) < dotR (fst (use_row P
      bs w)) e) \/
    dotR (fst (combine_uses P bs us)) e <= Q2R (snd (combine_uses P bs us))).
  { intros us HU. destruct (Rlt_dec (Q2R (snd (combine_uses P bs us))) (dotR (fst (combine_uses P bs
      us)) e)) as [C|C]; [left|right; lra].
    destruct (uses_R P bs us e HU C) as (x & _ & K). exists x. exact K. }
  destruct (Miss l F1) as [K|C1]; [left; exact K|]. destruct (Miss m F2) as [K|C2];
    [left; exact K|].
  destruct (IH fs (S i) HF) as [K|C3]; [left; exact K|]. right. rewrite El in C1. rewrite Em in C2.
  simpl in C1, C2.
  rewrite (same_R _ _ S1), dotR_vscale, Rm1 in C1. rewrite (same_R _ _ S2) in C2.
  apply R_le in Q1, Q2. rewrite Q2R_opp in Q1.
  assert (U : dotR (unit_vec i) e = e i) by (pose proof (unit_R i e) as U; unfold affR, unit_form
    in U; simpl in U; rewrite R0 in U; lra).
  rewrite U in C1, C2. split; [rewrite Nat.add_0_r; lra|].
  eapply inBox_upto; [|exact C3]. intros j _. unfold shift. f_equal. lia.
Qed.
Lemma outside_fails u k : inBox (domain P) k -> ~ inBox (z_box p ++ domain P) (place P N u k) ->
  fails P N E u k.
Proof.
  intros HK HO. pose proof SP as SP'. destruct proof_inv as (HW & LZ & HT & HF & HS & HL).
  destruct (every_k_has_a_bin P E k HE HK) as (B0 & I0 & X0). fold all in I0.
  set (bs := filter (fun B => meets (box B) (domain P)) all) in *.
  assert (I1 : In B0 bs).
  { apply filter_In. split; [exact I0|]. apply (meets_R _ _ k); auto.
    apply zip3_box, boxes_len in I0.
    pose proof HE as T. apply tube_inv in T as (C & _). apply covers_len in C. congruence. }
  destruct (faces_R bs (endR P u (netR N k)) _ _ _ HF) as [(w & Hw & Gw)|C].
  - destruct (goal_missed P N SP' u k B0 bs w (HW B0 I0) I1 Hw Gw) as (tau & T1 & T2 & T3). right.
    exists B0, tau. auto 7.
  - exfalso. apply HO. apply place_box; [rewrite app_length; lia|].
    rewrite firstn_app, skipn_app, LZ, Nat.sub_diag, firstn_all2, skipn_all2 by lia. simpl.
    rewrite app_nil_r.
    split; [exact C|exact HK].
Qed.
End Proof.

(* No plan: every real p0 with every real k of the domain fails. *)
Theorem no_plan P N E H p : context_ok P N E = true -> check_no_plan P N E H p = true ->
  forall u k, inBox (domain P) k -> fails P N E u k.
Proof.
  intros HC HK u k Hk. apply andb_prop in HK as [HU HP].
  destruct (inBox_dec (z_box p ++ domain P) (place P N u k)) as [HB|HB];
    [|apply (outside_fails P N E H p HC HP u k Hk HB)].
  destruct (leaves_cover (root p) _ _ HB) as (B & r & Hin & HB').
  apply (unsafe_leaf P N E H p HC HP B r Hin); [|exact HB']. eapply forallb_forall in HU;
    [|exact Hin]. exact HU.
Qed.

(* Volumes: the leaves tile the box of (z, k); inside the safe ones every plan is safe, in the
   unsafe ones and outside of the whole box every plan fails; the numbers are the sums of their
   volumes. *)
Definition boxes_of (pick : reason -> bool) (P : problem) (p : proof) :=
  map fst (filter (fun l => pick (snd l)) (leaves_of P p)).
Theorem volumes_true P N E H p : context_ok P N E = true -> check_proof P N E H p = true ->
  tiles (map fst (leaves_of P p)) (z_box p ++ domain P) /\
  (forall B u k, In B (boxes_of is_safe P p) -> inside B (place P N u k) -> safe P N E u k) /\
  (forall B u k, In B (boxes_of is_unsafe P p) -> inBox B (place P N u k) -> fails P N E u k) /\
  (forall u k, inBox (domain P) k -> ~ inBox (z_box p ++ domain P) (place P N u k) ->
    fails P N E u k) /\
  let '(safe_, unsafe_, all_) := volumes P p in
  Q2R safe_ = total (boxes_of is_safe P p) /\ Q2R unsafe_ = total (boxes_of is_unsafe P p) /\
  Q2R all_ = volume (z_box p ++ domain P).
Proof.
  intros HC HP. split; [|split; [|split; [|split]]].
  - apply leaves_tile. apply (proof_inv P N E H p HC HP).
  - intros B u k HB HI. apply in_map_iff in HB as ([B' r] & <- & HB).
    apply filter_In in HB as [Hin Hr].
    destruct r as [m|m|h|s| |r]; try discriminate.
    apply (safe_leaf P N E H p HC HP B' s Hin u k HI).
  - intros B u k HB HI. apply in_map_iff in HB as ([B' r] & <- & HB).
    apply filter_In in HB as [Hin Hr].
    apply (unsafe_leaf P N E H p HC HP B' r Hin Hr u k HI).
  - intros u k. apply (outside_fails P N E H p HC HP).
  - unfold volumes. rewrite !sum_of_R, volumeQ_R. auto.
Qed.
