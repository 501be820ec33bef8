(* What follows where the checker says yes to a claim: its blocks' sums, looks times, are at most
   delta, and so is the probability that what it says of any block is wrong.  [T1, T2, T4] *)
From Coq Require Import Reals ZArith QArith Qreals List Bool Arith Lia Lra.
From ParcJax Require Import ClaimSpec Draws Claim.
Import ListNotations.
Open Scope R_scope.

(* ---- Quotients ---- *)
Lemma at_least_Z a b : (0 < b)%Z -> (a <= b * at_least a b)%Z.
Proof.
  intro H. unfold at_least. destruct (Z.leb_spec a (b * (a / b))) as [K|K]; [exact K|].
  destruct (Z.leb_spec a (b * (a / b + 1))) as [K1|K1]; [exact K1|]. nia.
Qed.
Lemma no_more_Z a b : (0 <= a)%Z -> (0 <= no_more a b /\ b * no_more a b <= a)%Z.
Proof.
  intro H. unfold no_more. destruct (Z.leb_spec 0 (a / b)); simpl; [|lia].
  destruct (Z.leb_spec (b * (a / b)) a); simpl; lia.
Qed.
Lemma one_pos : 0 < IZR one.
Proof. apply (IZR_lt 0). reflexivity. Qed.

(* ---- The binomial sum from its terms ---- *)
Lemma choose_pos : forall n k, 0 <= choose n k.
Proof.
  induction n as [|n IH]; intros [|k]; simpl; try lra. pose proof (IH k).
  pose proof (IH (S k)). lra.
Qed.
Lemma choose_next : forall n k, INR (S k) * choose n (S k) = (INR n - INR k) * choose n k.
Proof.
  induction n as [|n IH]; intros [|k].
  - simpl. lra.
  - simpl. lra.
  - pose proof (IH O) as H. rewrite !S_INR in *. simpl in *. destruct n; simpl in *; lra.
  - pose proof (IH k) as H. pose proof (IH (S k)) as K. rewrite !S_INR in *. simpl choose in *. lra.
Qed.

Lemma climb_R N p rest : (0 <= p)%Z -> (0 < rest)%Z ->
  let c j := choose N j * (IZR p / IZR rest) ^ j in
  forall steps m term sum, IZR one * c m <= IZR term -> IZR one * sum_f_R0 c m <= IZR sum ->
  IZR one * sum_f_R0 c (m + steps) <= IZR (climb (Z.of_nat N) p rest (Z.of_nat m + 1)
    term sum steps).
Proof.
  intros Hp Hr c. induction steps as [|steps IH]; intros m term sum HT HS;
    [rewrite Nat.add_0_r; exact HS|].
  simpl climb. set (t := at_least _ _). replace (m + S steps)%nat with (S m + steps)%nat by lia.
  replace (Z.of_nat m + 1 + 1)%Z with (Z.of_nat (S m) + 1)%Z by lia.
  assert (K : IZR one * c (S m) <= IZR t).
  { pose proof (at_least_Z (term * (Z.max 0 (Z.of_nat N - (Z.of_nat m + 1) + 1) * p))
      ((Z.of_nat m + 1) * rest)) as H.
    fold t in H. replace (Z.of_nat N - (Z.of_nat m + 1) + 1)%Z with (Z.of_nat N - Z.of_nat m)%Z
      in H by lia.
    set (w := Z.max 0 (Z.of_nat N - Z.of_nat m)) in *.
    assert (Hw : INR N - INR m <= IZR w) by (rewrite !INR_IZR_INZ, <- minus_IZR; apply IZR_le;
      unfold w; lia).
    assert (Hw0 : 0 <= IZR w) by (apply (IZR_le 0); unfold w; lia).
    specialize (H ltac:(nia)). apply IZR_le in H. rewrite !mult_IZR, plus_IZR, <- INR_IZR_INZ in H.
    pose proof (choose_next N m) as C. pose proof (choose_pos N m) as Cm. pose proof one_pos as O.
    pose proof (IZR_lt 0 rest Hr) as R0. pose proof (IZR_le 0 p Hp) as P0.
    pose proof (pos_INR m) as M0.
    assert (E : c (S m) * (INR (S m) * IZR rest) <= c m * (IZR w * IZR p)).
    { unfold c. simpl pow. set (x := (IZR p / IZR rest) ^ m).
      assert (X : 0 <= x) by (apply pow_le, Rmult_le_pos; [exact P0|left;
        apply Rinv_0_lt_compat, R0]).
      replace (choose N (S m) * (IZR p / IZR rest * x) * (INR (S m) * IZR rest))
        with ((INR (S m) * choose N (S m)) * x * IZR p) by (field; lra).
      rewrite C. replace (choose N m * x * (IZR w * IZR p)) with (IZR w * choose N m * x *
        IZR p) by ring.
      apply Rmult_le_compat_r; [exact P0|]. apply Rmult_le_compat_r; [exact X|].
      apply Rmult_le_compat_r; [exact Cm|exact Hw]. }
    rewrite S_INR in E. apply Rmult_le_reg_r with ((INR m + 1) * IZR rest);
      [apply Rmult_lt_0_compat; lra|].
    apply Rle_trans with (IZR one * (c m * (IZR w * IZR p))).
    - rewrite Rmult_assoc. apply Rmult_le_compat_l; [lra|exact E].
    - apply Rle_trans with (IZR term * (IZR w * IZR p)); [|lra].
      rewrite <- Rmult_assoc. apply Rmult_le_compat_r; [apply Rmult_le_pos; assumption|exact HT]. }
  apply IH; [exact K|]. rewrite tech5, plus_IZR. lra.
Qed.
Lemma power_R q rest : (0 <= q)%Z -> (0 < rest)%Z -> forall n,
  (0 <= power q rest n)%Z /\ IZR (power q rest n) <= IZR one * (IZR q / IZR rest) ^ Pos.to_nat n.
Proof.
  intros Hq Hr. pose proof one_pos as O. pose proof (IZR_lt 0 rest Hr) as R0.
  pose proof (IZR_le 0 q Hq) as Q0.
  assert (X : 0 <= IZR q / IZR rest) by (apply Rmult_le_pos; [exact Q0|left;
    apply Rinv_0_lt_compat, R0]).
  assert (Step : forall a y, (0 <= a)%Z -> IZR a <= IZR one * y ->
    (0 <= no_more (a * q) rest)%Z /\ IZR (no_more (a * q) rest) <= IZR one * (IZR q /
      IZR rest * y)).
  { intros a y A0 A1. destruct (no_more_Z (a * q) rest ltac:(nia)) as [N0 N1]. split; [exact N0|].
    apply IZR_le in N1. rewrite !mult_IZR in N1. apply Rmult_le_reg_l with (IZR rest); [exact R0|].
    replace (IZR rest * (IZR one * (IZR q / IZR rest * y))) with (IZR one * y * IZR q)
      by (field; lra).
    apply Rle_trans with (IZR a * IZR q); [exact N1|]. apply Rmult_le_compat_r; assumption. }
  assert (Square : forall a y, (0 <= a)%Z -> IZR a <= IZR one * y ->
    (0 <= no_more (a * a) one)%Z /\ IZR (no_more (a * a) one) <= IZR one * (y * y)).
  { intros a y A0 A1. destruct (no_more_Z (a * a) one ltac:(nia)) as [N0 N1]. split; [exact N0|].
    apply IZR_le in N1. rewrite !mult_IZR in N1. pose proof (IZR_le 0 a A0) as A2.
    apply Rmult_le_reg_l with (IZR one); [exact O|].
    replace (IZR one * (IZR one * (y * y))) with ((IZR one * y) * (IZR one * y)) by ring.
    apply Rle_trans with (IZR a * IZR a); [exact N1|]. apply Rmult_le_compat; assumption. }
  induction n as [n [IH0 IH1]|n [IH0 IH1]|]; simpl power.
  - destruct (Square _ _ IH0 IH1) as [S0 S1]. destruct (Step _ _ S0 S1) as [T0 T1].
    split; [exact T0|].
    rewrite Pos2Nat.inj_xI. replace (S (2 * Pos.to_nat n)) with (1 + (Pos.to_nat n + Pos.to_nat
      n))%nat by lia.
    rewrite !pow_add, pow_1. exact T1.
  - destruct (Square _ _ IH0 IH1) as [S0 S1]. split; [exact S0|].
    rewrite Pos2Nat.inj_xO. replace (2 * Pos.to_nat n)%nat with (Pos.to_nat n + Pos.to_nat
      n)%nat by lia.
    rewrite pow_add. exact S1.
  - rewrite Pos2Nat.inj_1, pow_1. destruct (Step one 1) as [T0 T1]; [discriminate|lra|].
    split; [exact T0|]. replace (IZR q / IZR rest) with (IZR q / IZR rest * 1) by ring. exact T1.
Qed.

(* ---- What a block costs ---- *)
Lemma tail_by_odds N r p q : 0 < p -> p < q ->
  tail N r (p / q) = ((q - p) / q) ^ N * sum_f_R0 (fun j => choose N j * (p / (q - p)) ^ j) r.
Proof.
  intros P0 PQ. unfold tail. rewrite scal_sum. apply sum_eq. intros j _.
  destruct (le_lt_dec j N) as [H|H]; [|rewrite choose_beyond by lia; ring].
  replace (1 - p / q) with ((q - p) / q) by (field; lra).
  replace (p / q) with (p / (q - p) * ((q - p) / q)) by (field; lra). rewrite Rpow_mult_distr.
  replace (((q - p) / q) ^ N) with (((q - p) / q) ^ j * ((q - p) / q) ^ (N - j))
    by (rewrite <- pow_add; f_equal; lia). ring.
Qed.
Lemma probable_R x : probable x = true -> (0 < Qnum x)%Z /\ (Qnum x <= Zpos (Qden x))%Z /\
  0 < Q2R x <= 1.
Proof.
  intro H. apply andb_prop in H as [A B]. apply Z.ltb_lt in A. apply Qle_bool_iff in B.
  split; [exact A|]. split; [unfold Qle in B; simpl in B; lia|]. apply Qle_Rle in B.
  unfold Q2R in B at 2. simpl in B.
  split; [|lra]. apply Rmult_lt_0_compat; [apply (IZR_lt 0), A|apply Rinv_0_lt_compat, (IZR_lt 0);
    reflexivity].
Qed.
Lemma cost_R d b x : probable d = true -> probable (bound b) = true -> cost d b = Some x ->
  0 <= IZR x /\ (Q2R (bound b) = 1 \/ tail (Pos.to_nat (runs b)) (discards b) (Q2R (bound b)) <= IZR
    x / IZR one * Q2R d).
Proof.
  intros Hd Hb H. apply probable_R in Hd as (D0 & _ & _). apply probable_R in Hb as (P0 & PQ & _).
  unfold cost in H.
  set (p := Qnum (bound b)) in *. set (q := Zpos (Qden (bound b))) in *. set (n := runs b) in *.
  assert (Hq : Q2R (bound b) = IZR p / IZR q) by reflexivity.
  pose proof (IZR_lt 0 q eq_refl) as Q0. pose proof (IZR_lt 0 p P0) as p0. pose proof one_pos as O.
  destruct (Z.eqb_spec (q - p) 0) as [E|E].
  - injection H as <-. split; [lra|]. left. rewrite Hq. replace q with p by lia. field. lra.
  - destruct (Z.ltb_spec 0 (power q (q - p) n)) as [L0|]; [|discriminate].
    set (low := power q (q - p) n) in *. set (top := climb (Zpos n) p (q - p) 1 one one
      (discards b)) in *.
    assert (Hx : at_least (top * Zpos (Qden d) * one) (low * Qnum d) = x) by congruence. clear H.
    assert (R0 : (0 < q - p)%Z) by lia.
    assert (T : IZR one * sum_f_R0 (fun j => choose (Pos.to_nat n) j * (IZR p / IZR (q - p)) ^ j)
      (discards b) <= IZR top).
    { unfold top. rewrite <- (positive_nat_Z n).
      apply (climb_R (Pos.to_nat n) p (q - p) ltac:(lia) R0 (discards b) 0%nat);
        cbn [sum_f_R0 choose pow];
        [destruct (Pos.to_nat n)|destruct (Pos.to_nat n)]; cbn [choose]; lra. }
    set (s := sum_f_R0 _ (discards b)) in T.
    assert (S0 : 0 <= s).
    { unfold s. apply cond_pos_sum. intro j. apply Rmult_le_pos; [apply choose_pos|].
      apply pow_le, Rmult_le_pos; [lra|].
      left. apply Rinv_0_lt_compat, (IZR_lt 0), R0. }
    destruct (power_R q (q - p) ltac:(lia) R0 n) as [_ U]. fold low in U.
    pose proof (IZR_lt 0 low L0) as L1. pose proof (IZR_lt 0 _ D0) as d0.
    pose proof (IZR_lt 0 (q - p) R0) as r0.
    pose proof (IZR_lt 0 (Zpos (Qden d)) eq_refl) as e0.
    assert (X : IZR top * IZR (Zpos (Qden d)) * IZR one <= IZR low * IZR (Qnum d) * IZR x).
    { rewrite <- !mult_IZR, <- Hx. apply IZR_le. apply at_least_Z. nia. }
    assert (T0 : 0 <= IZR top) by (apply Rle_trans with (IZR one * s); [apply Rmult_le_pos;
      lra|exact T]).
    split.
    + apply Rmult_le_reg_l with (IZR low * IZR (Qnum d)); [apply Rmult_lt_0_compat; lra|].
      rewrite Rmult_0_r.
      apply Rle_trans with (IZR top * IZR (Zpos (Qden d)) * IZR one); [|exact X].
      repeat apply Rmult_le_pos; lra.
    + right. rewrite Hq, tail_by_odds; [|exact p0|apply IZR_lt; lia]. rewrite <- minus_IZR. fold s.
      set (y := (IZR (q - p) / IZR q) ^ Pos.to_nat n).
      assert (Y : y * (IZR q / IZR (q - p)) ^ Pos.to_nat n = 1).
      { unfold y. rewrite <- Rpow_mult_distr. replace (IZR (q - p) / IZR q * (IZR q / IZR (q - p)))
          with 1 by (field; lra). apply pow1. }
      assert (Y0 : 0 < y) by (apply pow_lt, Rmult_lt_0_compat; [lra|apply Rinv_0_lt_compat, Q0]).
      assert (A : IZR low * y <= IZR one).
      { apply Rle_trans with (IZR one * (IZR q / IZR (q - p)) ^ Pos.to_nat n * y).
        - apply Rmult_le_compat_r; lra.
        - rewrite Rmult_assoc, (Rmult_comm _ y), Y. lra. }
      assert (B : IZR low * (y * s) <= IZR top).
      { apply Rle_trans with (IZR one * s); [|exact T]. rewrite <- Rmult_assoc.
        apply Rmult_le_compat_r; assumption. }
      apply Rmult_le_reg_l with (IZR low); [exact L1|]. apply Rle_trans with (IZR top); [exact B|].
      unfold Q2R. apply Rmult_le_reg_r with (IZR (Zpos (Qden d)) * IZR one);
        [apply Rmult_lt_0_compat; lra|].
      replace (IZR low * (IZR x / IZR one * (IZR (Qnum d) * / IZR (Zpos (Qden d)))) *
        (IZR (Zpos (Qden d)) * IZR one))
        with (IZR low * IZR (Qnum d) * IZR x) by (field; lra).
      rewrite <- Rmult_assoc. exact X.
Qed.

(* ---- All blocks together ---- *)
Lemma all_draws_law {A} (l : list (about A)) bs : Forall2 says l bs -> is_law (all_draws l bs).
Proof.
  induction 1 as [|a b l bs [HL _] _ IH]; simpl; [|apply both_law; [apply draws_law, HL|exact IH]].
  split; [intros x w [[= <- <-]|[]]; lra|simpl; lra].
Qed.
Lemma wrong_is_rare {A} d (a : about A) b x : probable d = true -> probable (bound b) = true ->
  says a b ->
  cost d b = Some x -> 0 <= IZR x /\ prob (draws (law_of a) (Pos.to_nat (runs b))) (wrong_of a)
    <= IZR x / IZR one * Q2R d.
Proof.
  intros Hd Hb [HL HW] HC. destruct (cost_R d b x Hd Hb HC) as [X0 [E|T]]; (split; [exact X0|]).
  - apply Rle_trans with 0.
    + apply Rle_trans with (prob (draws (law_of a) (Pos.to_nat (runs b))) (fun _ => false)).
      * apply prob_le; [apply draws_law, HL|]. intros l w _ Hl. destruct (HW l Hl) as (s & _ & Hs).
        pose proof (prob_range (law_of a) (leaves (score_of a) s) HL). lra.
      * unfold prob. rewrite (mean_ext _ _ (fun _ => 0 * 0)), mean_scale by (intro; lra). lra.
    + apply probable_R in Hd as (_ & _ & D0 & _). pose proof one_pos.
      apply Rmult_le_pos; [apply Rmult_le_pos; [exact X0|left; apply Rinv_0_lt_compat,
        one_pos]|lra].
  - apply probable_R in Hb as (_ & _ & B0 & B1).
    eapply Rle_trans; [apply (claim_is_true (law_of a) (score_of a) HL _ (discards b)
      (Q2R (bound b)))|exact T]; [lra|exact HW].
Qed.
Lemma costs_R {A} d (l : list (about A)) bs x : probable d = true -> forallb (fun b =>
  probable (bound b)) bs = true ->
  Forall2 says l bs -> costs d bs = Some x -> prob (all_draws l bs) (some_wrong l) <= IZR x / IZR
    one * Q2R d.
Proof.
  intros Hd HB HF. revert x HB. induction HF as [|a b l bs Hab HF IH]; intros x HB HC;
    simpl in HB, HC.
  - injection HC as <-. unfold prob. simpl. lra.
  - apply andb_prop in HB as [Hb HB]. destruct (cost d b) as [y|] eqn:Ey; [|discriminate].
    destruct (costs d bs) as [z|]; [|discriminate]. injection HC as <-.
    specialize (IH z HB eq_refl).
    destruct (wrong_is_rare d a b y Hd Hb Hab Ey) as [_ Hy]. rewrite plus_IZR.
    pose proof (draws_law (law_of a) (Pos.to_nat (runs b)) (proj1 Hab)) as [WD TD].
    pose proof (all_draws_law l bs HF) as [WR TR].
    apply Rle_trans with (prob (draws (law_of a) (Pos.to_nat (runs b))) (wrong_of a) + prob
      (all_draws l bs) (some_wrong l)).
    + unfold prob. simpl all_draws. rewrite mean_both.
      apply Rle_trans with (mean (draws (law_of a) (Pos.to_nat (runs b))) (fun t =>
        (if wrong_of a t then 1 else 0) + mean (all_draws l bs) (fun u => if some_wrong l u then 1
          else 0) * 1)).
      * apply mean_le; [exact WD|]. intros t w _.
        apply Rle_trans with (mean (all_draws l bs) (fun u => (if wrong_of a t then 1 else 0) * 1
          + (if some_wrong l u then 1 else 0))).
        -- apply mean_le; [exact WR|]. intros u v _. simpl.
        destruct (wrong_of a t), (some_wrong l u); simpl; lra.
        -- rewrite mean_plus, (mean_scale _ (if wrong_of a t then 1 else 0)), TR. lra.
      * rewrite mean_plus, mean_scale, TD. lra.
    + unfold Rdiv in *. lra.
Qed.

Theorem claim_shown {A} c (l : list (about A)) : check_claim c = true ->
  Forall2 says l (blocks c) ->
  prob (all_draws l (blocks c)) (some_wrong l) <= Q2R (delta c) / IZR (Zpos (looks c)).
Proof.
  intros H HF. unfold check_claim in H. rewrite !andb_true_iff in H.
  destruct H as [[[[[_ Hd] _] HB] _] HC].
  destruct (costs (delta c) (blocks c)) as [x|] eqn:E; [|discriminate].
  apply Z.leb_le, IZR_le in HC. rewrite mult_IZR in HC.
  assert (HB' : forallb (fun b => probable (bound b)) (blocks c) = true).
  { rewrite forallb_forall in *. intros b Hb. specialize (HB b Hb). apply andb_prop in HB. tauto. }
  eapply Rle_trans; [apply (costs_R (delta c) l (blocks c) x Hd HB' HF E)|].
  apply probable_R in Hd as (_ & _ & D0 & _). pose proof one_pos as O.
  pose proof (IZR_lt 0 (Zpos (looks c)) eq_refl) as L0.
  apply Rmult_le_reg_r with (IZR one * IZR (Zpos (looks c))); [apply Rmult_lt_0_compat;
    assumption|].
  replace (IZR x / IZR one * Q2R (delta c) * (IZR one * IZR (Zpos (looks c))))
    with (IZR (Zpos (looks c)) * IZR x * Q2R (delta c)) by (field; lra).
  replace (Q2R (delta c) / IZR (Zpos (looks c)) * (IZR one * IZR (Zpos (looks c))))
    with (IZR one * Q2R (delta c)) by (field; lra).
  apply Rmult_le_compat_r; lra.
Qed.
Theorem bounds_shown c : check_claim c = true ->
  blocks c <> [] /\ (forall b, In b (blocks c) -> 0 < Q2R (bound b) <= Q2R (eps c)) /\
    Q2R (eps c) <= 1 /\
  forall e, In (Some e) (in_bins c) -> exists b, In b (blocks c) /\ Q2R e = Q2R (bound b).
Proof.
  intro H. unfold check_claim in H. rewrite !andb_true_iff in H.
  destruct H as [[[[[He _] Hn] HB] HI] _].
  rewrite forallb_forall in HB, HI. apply probable_R in He as (_ & _ & _ & E1).
  split; [|split; [|split; [exact E1|]]].
  - intro K. rewrite K in Hn. discriminate.
  - intros b Hb. specialize (HB b Hb). apply andb_prop in HB as [P Q].
    apply probable_R in P as (_ & _ & P0 & _).
    apply Qle_bool_iff, Qle_Rle in Q. lra.
  - intros e He. specialize (HI _ He). simpl in HI. apply existsb_exists in HI as (b & Hb & K).
    exists b.
    split; [exact Hb|]. apply Qeq_eqR, Qeq_bool_iff, K.
Qed.
