(* Episodes of a robot whose headings are off: what copies of its points stand for. [T22, T38] *)
From Coq Require Import Reals QArith Qabs Qreals List Bool Arith Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan Answer Episode ArithmeticFacts
  EpisodeFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- A turn is a mixture of the three maps ---- *)
Lemma in_the_triangle angle a b g t : hold_turns angle a b g -> Rabs t <= angle ->
  exists x y z, weights [x; y; z] 3 /\ cos t = x * a + y * a + z * g /\ sin t = x * b - y * b.
Proof.
  intros ((A0 & A1) & (P & Q) & B & C & T) Ht.
  assert (Hc : a <= cos t).
  { eapply Rle_trans; [exact C|]. destruct (Rcase_abs t) as [N|N].
    - rewrite Rabs_left in Ht by exact N. rewrite <- (cos_neg t). apply cos_decr_1; lra.
    - rewrite Rabs_right in Ht by exact N. apply cos_decr_1; lra. }
  pose proof (sin2_cos2 t) as U. unfold Rsqr in U.
  set (c := cos t) in *. set (s := sin t) in *.
  assert (L : forall r, r * r = s * s -> b * c + r * (g - a) <= b * g).
  { intros r Hr. apply Rnot_lt_le. intro N.
    assert (0 < b * g) by (apply Rmult_lt_0_compat; lra).
    assert ((b * g) * (b * g) < (b * c + r * (g - a)) * (b * c + r * (g - a)))
      by (apply Rmult_le_0_lt_compat; lra).
    assert ((b * c + r * (g - a)) * (b * c + r * (g - a)) <= b * b + (g - a) * (g - a)).
    { assert (E : (b * b + (g - a) * (g - a)) * (r * r + c * c) -
        (b * c + r * (g - a)) * (b * c + r * (g - a)) =
        (b * r - c * (g - a)) * (b * r - c * (g - a))) by ring.
      rewrite Hr, U in E. pose proof (Rle_0_sqr (b * r - c * (g - a))) as G.
      unfold Rsqr in G. lra. }
    lra. }
  pose proof (L s eq_refl) as L1. pose proof (L (- s) ltac:(ring)) as L2.
  assert (D : 0 < g - a) by lra. assert (DB : 0 < 2 * b * (g - a))
    by (apply Rmult_lt_0_compat; lra).
  assert (W : forall r, b * c + r * (g - a) <= b * g ->
    0 <= (b * (g - c) - r * (g - a)) / (2 * b * (g - a))).
  { intros r Hr. apply Rmult_le_pos; [lra|]. left. apply Rinv_0_lt_compat, DB. }
  exists ((b * (g - c) + s * (g - a)) / (2 * b * (g - a))),
    ((b * (g - c) - s * (g - a)) / (2 * b * (g - a))), ((c - a) / (g - a)).
  split; [split; [reflexivity|split]|split].
  - constructor; [|constructor; [|constructor; [|constructor]]].
    + replace (b * (g - c) + s * (g - a)) with (b * (g - c) - - s * (g - a)) by ring.
      exact (W (- s) L2).
    + exact (W s L1).
    + apply Rmult_le_pos; [lra|]. left. apply Rinv_0_lt_compat, D.
  - simpl. field. lra.
  - field. lra.
  - field. lra.
Qed.
(* There are such maps. *)
Theorem turns_held angle : 0 < angle < PI / 2 ->
  hold_turns angle (cos angle) (sin angle) (/ cos angle).
Proof.
  intros [L H]. pose proof (cos_gt_0 angle ltac:(lra) H) as C.
  pose proof (sin_gt_0 angle L ltac:(lra)) as S.
  pose proof (sin2_cos2 angle) as U. unfold Rsqr in U.
  assert (C1 : cos angle < 1). { pose proof (Rmult_lt_0_compat _ _ S S). nra. }
  repeat split; try lra.
  - apply Rmult_lt_reg_l with (cos angle); [exact C|]. rewrite Rinv_r by lra. nra.
  - replace (sin angle * sin angle) with (1 - cos angle * cos angle) by lra.
    right. field. lra.
Qed.
Lemma turn_is_mixed angle a b g t : hold_turns angle a b g -> Rabs t <= angle ->
  exists x y z, weights [x; y; z] 3 /\ forall p i, mapped (cos t) (sin t) p i =
    x * copy a b g 0 p i + y * copy a b g 1 p i + z * copy a b g 2 p i.
Proof.
  intros H Ht. destruct (in_the_triangle angle a b g t H Ht) as (x & y & z & W & C & S).
  exists x, y, z. split; [exact W|]. intros p i. rewrite C, S. unfold copy, mapped.
  destruct i as [|[|i]]; ring.
Qed.

(* ---- A part of the body is in the part of the copies ---- *)
Lemma inPart_copied n b x y z (c q : nat -> rv) at_ : weights [x; y; z] 3 ->
  (forall i j, c i j = x * q (3 * i)%nat j + y * q (3 * i + 1)%nat j + z * q (3 * i + 2)%nat j) ->
  inPart n b c at_ -> inPart n (copied b) q at_.
Proof.
  intros (_ & Pos & One) H (lam & e & (L & LP & LS) & Sh & Hx).
  exists (flat_map (fun l => [l * x; l * y; l * z]) lam), e. unfold copied. cbn [corners grown_by].
  inversion Pos as [|? ? Px Pos1]. inversion Pos1 as [|? ? Py Pos2]. inversion Pos2 as [|? ? Pz _].
  subst. simpl in One.
  split; [|split; [exact Sh|]].
  - split; [|split].
    + clear - L. revert L. generalize (corners b) as cs. induction lam as [|l lam IH];
        intros [|i cs] L; try discriminate; [reflexivity|]. simpl in *. rewrite (IH cs); lia.
    + clear - LP Px Py Pz. induction LP as [|l lam Hl _ IH]; simpl; [constructor|].
      repeat (constructor; [apply Rmult_le_pos; assumption|]). exact IH.
    + rewrite <- LS. clear - One. induction lam as [|l lam IH]; simpl; [reflexivity|].
      rewrite IH. replace x with (1 - y - z) by lra. ring.
  - intros j Hj. rewrite (Hx j Hj). f_equal. clear - H L. revert L. generalize (corners b) as cs.
    induction lam as [|l lam IH]; intros [|i cs] L; try discriminate; [reflexivity|].
    cbn [flat_map map app mix]. rewrite <- (IH cs) by (injection L as L; exact L).
    rewrite (H i j). ring.
Qed.
Lemma seen_turned v h t x i :
  seen_from v h x i = mapped (cos t) (sin t) (seen_from v (h + t) x) i.
Proof.
  replace h with (h + t - t) at 1 by ring. unfold seen_from, mapped.
  rewrite cos_minus, sin_minus. destruct i as [|[|i]]; ring.
Qed.

(* A robot that turns, whose heading is off by no more than an angle, and whose copies keep to the
   tube: no place of the world is in its body, told by its own points, if it is in an obstacle, as
   that is seen from the stated pose, when moved by any of the doubt. *)
Theorem accepted_heading e n b w : check_episode e = Driven n b w -> turning e = true ->
  exists m0, hd_error (done e) = Some m0 /\
  forall angle ca cb cg (where_ : R -> nat -> rv), hold_turns angle ca cb cg ->
  (forall turn, In turn (turns (done e)) -> exists v t, Rabs t <= angle /\
     (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
     keeps_to e turn (fun _ => 0) (fun time i => copy ca cb cg (i mod 3)
       (seen_from v (Q2R (heading (fst turn)) + t) (where_ time (i / 3)%nat)))) ->
  forall time, Q2R (begin m0) <= time ->
  exists turn v, In turn (turns (done e)) /\ under_way turn time /\
    (forall a, (a < n_p (asked m0))%nat ->
       Rabs (v a - toR (pose (fst turn)) a) <= toR (doubt e) a) /\
    forall o t p x, In o (obstacles (asked (fst turn))) -> (first o <= t <= last o)%nat ->
      INR t <= clock e (fst turn) time <= INR (S t) -> In (copied p) (parts (asked m0)) ->
      inPart (n_p (asked (fst turn))) p
        (fun i => seen_from v (Q2R (heading (fst turn))) (where_ time i))
        (seen_from v (Q2R (heading (fst turn))) x) ->
      ~ (forall d, (forall a, (a < n_p (asked m0))%nat -> Rabs (d a) <= toR (doubt e) a) ->
           inPoly (rows o) (seen_from (toR (pose (fst turn))) (Q2R (heading (fst turn)))
             (fun a => x a - d a))).
Proof.
  intros HA HT. destruct (driven_parts e n b w HA) as (m0 & H0 & D & HB & HL & _ & HM). exists m0.
  split; [exact H0|]. intros angle ca cb cg where_ Hold HK time Ht.
  destruct (accepted_episode e n b w HA) as (_ & m1 & H1 & HP & _). rewrite H0 in H1.
  injection H1 as <-. destruct (some_turn _ m0 time H0 Ht) as (i & turn & Hi & Hu).
  pose proof (nth_error_In _ _ Hi) as Hin. destruct (HK turn Hin) as (v & t & Hang & Hv & Hk).
  exists turn, v. split; [exact Hin|]. split; [exact Hu|]. split; [exact Hv|].
  intros o s p x Ho Hs Hc Hp Hx Hbad. destruct turn as [m next]. cbn [fst] in *.
  pose proof (turn_in _ _ _ Hi) as Im. cbn [fst] in Im. rewrite <- (HP m Im) in Hp.
  refine (manoeuvre_clear e (asked m0) m (HM m Im) next _ _ Hk time Hu o s _ _ Ho Hs Hc Hp _ _).
  - destruct (turn_is_mixed angle ca cb cg t Hold Hang) as (x1 & x2 & x3 & W & E).
    apply (inPart_copied _ _ x1 x2 x3
      (fun i => seen_from v (Q2R (heading m)) (where_ time i))); [exact W| |exact Hx].
    intros k j. cbv beta.
    replace ((3 * k) mod 3)%nat with O by (rewrite Nat.mul_comm, Nat.mod_mul; lia).
    replace ((3 * k + 1) mod 3)%nat with 1%nat
      by (rewrite Nat.add_comm, Nat.mul_comm, Nat.mod_add by lia; reflexivity).
    replace ((3 * k + 2) mod 3)%nat with 2%nat
      by (rewrite Nat.add_comm, Nat.mul_comm, Nat.mod_add by lia; reflexivity).
    replace (3 * k / 3)%nat with k by (rewrite Nat.mul_comm, Nat.div_mul; lia).
    replace ((3 * k + 1) / 3)%nat with k
      by (rewrite Nat.add_comm, Nat.mul_comm, Nat.div_add by lia; reflexivity).
    replace ((3 * k + 2) / 3)%nat with k
      by (rewrite Nat.add_comm, Nat.mul_comm, Nat.div_add by lia; reflexivity).
    rewrite (seen_turned _ _ t). apply E.
  - specialize (Hbad (fun a => v a - toR (pose m) a) Hv). intros a c Hac.
    rewrite (dotR_ext a _ (seen_from (toR (pose m)) (Q2R (heading m))
      (fun a => x a - (v a - toR (pose m) a)))); [exact (Hbad a c Hac)|].
    intros j _. unfold start_of. rewrite HT, toR_nil. unfold seen_from.
    destruct j as [|[|j]]; ring.
Qed.
