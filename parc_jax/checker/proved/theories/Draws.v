(* N independent runs of one law, at most r of them left outside of a tube that grows with one
   number, and a new run leaves that tube with a probability above eps: that is as rare as the
   binomial sum says.  [T1, T2, T5] *)
From Coq Require Import Reals List Bool Arith Lia Lra Permutation Sorted.
From ParcJax Require Import ClaimSpec ListFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Means ---- *)
Lemma mean_le {A} (L : law A) f g : (forall a w, In (a, w) L -> 0 <= w) ->
  (forall a w, In (a, w) L -> f a <= g a) -> mean L f <= mean L g.
Proof.
  induction L as [|[a w] L IH]; intros W H; simpl; [lra|]. apply Rplus_le_compat.
  - apply Rmult_le_compat_l; [exact (W a w (or_introl eq_refl))|exact (H a w (or_introl eq_refl))].
  - apply IH; intros b v Hb; [apply (W b v)|apply (H b v)]; right; exact Hb.
Qed.
Lemma mean_ext {A} (L : law A) f g : (forall a, f a = g a) -> mean L f = mean L g.
Proof. intro H. induction L as [|[a w] L IH]; simpl; [reflexivity|]. rewrite H, IH.
reflexivity. Qed.
Lemma mean_plus {A} (L : law A) f g : mean L (fun a => f a + g a) = mean L f + mean L g.
Proof. induction L as [|[a w] L IH]; simpl; [lra|]. rewrite IH. lra. Qed.
Lemma mean_scale {A} (L : law A) c f : mean L (fun a => c * f a) = c * mean L f.
Proof. induction L as [|[a w] L IH]; simpl; [lra|]. rewrite IH. lra. Qed.
Lemma mean_app {A} (L M : law A) f : mean (L ++ M) f = mean L f + mean M f.
Proof. induction L as [|[a w] L IH]; simpl; [lra|]. rewrite IH. lra. Qed.
Lemma mean_both {A B C} (put : A -> B -> C) L M f : mean (both put L M) f = mean L (fun a =>
  mean M (fun b => f (put a b))).
Proof.
  induction L as [|[a w] L IH]; simpl; [reflexivity|]. unfold both in *. simpl.
  rewrite mean_app, IH. f_equal. clear. induction M as [|[b v] M IH]; simpl; [lra|].
  rewrite IH. simpl. lra.
Qed.
Lemma both_law {A B C} (put : A -> B -> C) L M : is_law L -> is_law M -> is_law (both put L M).
Proof.
  intros [WL TL] [WM TM]. split.
  - intros c w H. apply in_flat_map in H as ([a v] & Ha & H).
    apply in_map_iff in H as ([b u] & [= <- <-] & Hb).
    apply Rmult_le_pos; [exact (WL a v Ha)|exact (WM b u Hb)].
  - rewrite mean_both. rewrite (mean_ext _ _ (fun _ => 1)); [exact TL|]. intro a. exact TM.
Qed.
Lemma draws_law {A} (L : law A) N : is_law L -> is_law (draws L N).
Proof.
  intro H. induction N as [|N IH]; [|apply both_law; assumption].
  split; [intros a w [[= <- <-]|[]]; lra|simpl; lra].
Qed.
Lemma prob_le {A} (L : law A) (E F : A -> bool) : is_law L ->
  (forall a w, In (a, w) L -> E a = true -> F a = true) -> prob L E <= prob L F.
Proof.
  intros [W _] H. apply mean_le; [exact W|]. intros a w Ha. specialize (H a w Ha).
  destruct (E a); [rewrite H by reflexivity; lra|]. destruct (F a); lra.
Qed.
Lemma prob_not {A} (L : law A) (E : A -> bool) : is_law L -> prob L (fun a =>
  negb (E a)) = 1 - prob L E.
Proof.
  intros [_ T]. unfold prob.
  assert (K : mean L (fun a => (if negb (E a) then 1 else 0) + (if E a then 1 else 0)) = 1).
  { rewrite <- T. apply mean_ext. intro a. destruct (E a); simpl; lra. }
  rewrite mean_plus in K. lra.
Qed.
Lemma prob_range {A} (L : law A) (E : A -> bool) : is_law L -> 0 <= prob L E <= 1.
Proof.
  intros [W T]. split.
  - rewrite <- (Rmult_0_l (mean L (fun _ => 1))). rewrite <- mean_scale. apply mean_le; [exact W|].
    intros a w _. destruct (E a); lra.
  - rewrite <- T. apply mean_le; [exact W|]. intros a w _. destruct (E a); lra.
Qed.

(* ---- How many of N draws are of some kind ---- *)
Fixpoint at_most (p : R) (N r : nat) : R :=
  match N with
  | O => 1
  | S N' => (1 - p) * at_most p N' r + p * match r with O => 0 | S r' => at_most p N' r' end
  end.
Lemma counted {A} (L : law A) (h : A -> bool) : is_law L -> forall N r,
  prob (draws L N) (fun l => length (filter h l) <=? r)%nat = at_most (prob L h) N r.
Proof.
  intro HL. induction N as [|N IH]; intro r; [unfold prob; simpl; lra|].
  unfold prob. simpl draws. rewrite mean_both.
  rewrite (mean_ext _ _ (fun a => (if h a then 1 else 0) * match r with O => 0 | S r' =>
    at_most (prob L h) N r' end
                                  + (if negb (h a) then 1 else 0) * at_most (prob L h) N r)).
  - rewrite mean_plus. rewrite (mean_ext L (fun a => (if h a then 1 else 0) * _) (fun a =>
      match r with O => 0 | S r' => at_most (prob L h) N r' end * (if h a then 1 else 0)))
        by (intro; lra).
    rewrite (mean_ext L (fun a => (if negb (h a) then 1 else 0) * _) (fun a =>
      at_most (prob L h) N r * (if negb (h a) then 1 else 0))) by (intro; lra).
    rewrite !mean_scale. pose proof (prob_not L h HL) as Hn. unfold prob in Hn |- *. rewrite Hn.
    simpl. ring.
  - intro a. destruct (h a) eqn:Ha; simpl.
    + rewrite Rmult_1_l, Rmult_0_l, Rplus_0_r. destruct r as [|r].
      * rewrite (mean_ext _ _ (fun _ => 0 * 0)); [rewrite mean_scale; lra|]. intro l. simpl.
        rewrite Ha. simpl. lra.
      * rewrite <- (IH r). apply mean_ext. intro l. simpl. rewrite Ha. reflexivity.
    + rewrite Rmult_0_l, Rmult_1_l, Rplus_0_l. rewrite <- (IH r). apply mean_ext. intro l. simpl.
      rewrite Ha. reflexivity.
Qed.
Lemma at_most_range p : 0 <= p <= 1 -> forall N r, 0 <= at_most p N r /\
  at_most p N r <= at_most p N (S r).
Proof.
  intro Hp. induction N as [|N IH]; intro r; [simpl; lra|].
  assert (K : 0 <= match r with O => 0 | S r' => at_most p N r' end <= at_most p N r)
    by (destruct r; [split; [lra|apply IH]|exact (IH r)]).
  destruct (IH r) as [A B]. simpl. split.
  - apply Rplus_le_le_0_compat; apply Rmult_le_pos; lra.
  - apply Rplus_le_compat; apply Rmult_le_compat_l; lra.
Qed.
Lemma at_most_falls p q : 0 <= p -> p <= q -> q <= 1 -> forall N r, at_most q N r <= at_most p N r.
Proof.
  intros P0 PQ Q1. induction N as [|N IH]; intro r; [simpl; lra|]. simpl.
  set (b := fun x => match r with O => 0 | S r' => at_most x N r' end).
  assert (K : b q <= b p) by (unfold b; destruct r; [lra|apply IH]).
  assert (M : b p <= at_most p N r)
    by (unfold b; destruct r; [|]; [apply at_most_range; lra|apply at_most_range; lra]).
  fold (b q) (b p). specialize (IH r).
  apply Rle_trans with ((1 - q) * at_most p N r + q * b p).
  - apply Rplus_le_compat; apply Rmult_le_compat_l; lra.
  - assert (0 <= (q - p) * (at_most p N r - b p)) by (apply Rmult_le_pos; lra). lra.
Qed.
Lemma choose_beyond : forall n k, (n < k)%nat -> choose n k = 0.
Proof.
  induction n as [|n IH]; intros [|k] H; try lia; simpl; [reflexivity|]. rewrite !IH by lia. lra.
Qed.
Lemma at_most_tail p : forall N r, at_most p N r = tail N r p.
Proof.
  assert (S1 : forall N r, tail (S N) r p = (1 - p) * tail N r p + p * match r with O => 0 | S r' =>
    tail N r' p end).
  { intro N. induction r as [|r IH].
    - unfold tail. simpl. rewrite Nat.sub_0_r. destruct N; simpl; ring.
    - unfold tail in *. rewrite tech5, IH, !tech5.
      assert (T : choose (S N) (S r) * p ^ S r * (1 - p) ^ (S N - S r) =
                  p * (choose N r * p ^ r * (1 - p) ^ (N - r)) + (1 - p) * (choose N (S r) * p ^ S r
                    * (1 - p) ^ (N - S r))).
      { simpl. destruct (le_lt_dec (S r) N) as [H|H].
        - replace (N - r)%nat with (S (N - S r)) by lia. simpl. ring.
        - rewrite (choose_beyond N (S r)) by lia. ring. }
      rewrite T. destruct r as [|r]; [unfold sum_f_R0; ring|]. rewrite (tech5 _ r). ring. }
  induction N as [|N IH]; intro r.
  - simpl. unfold tail. induction r as [|r IHr]; [simpl; ring|]. rewrite tech5, <- IHr. simpl. ring.
  - rewrite S1. simpl. rewrite (IH r). destruct r as [|r]; [|rewrite (IH r)]; ring.
Qed.

(* Runs whose own tube has a number of at most eps by some measure U; of all others one has the
   largest score. *)
Definition high {A} (score : A -> option R) (U : R -> R) (eps : R) (a : A) : bool :=
  match score a with Some x => if Rle_dec (U x) eps then true else false | None => true end.
Lemma worst_of_low {A} (score : A -> option R) U eps (M : law A) :
  (forall a w, In (a, w) M -> high score U eps a = true) \/
  exists x, eps < U x /\ forall a w, In (a, w) M -> high score U eps a = false ->
    leaves score x a = false.
Proof.
  unfold high. induction M as [|[a w] M IH]; [left; intros ? ? []|].
  destruct (score a) as [y|] eqn:Ha; [destruct (Rle_dec (U y) eps) as [Hy|Hy]|].
  - destruct IH as [IH|(x & Hx & IH)]; [left|right; exists x; split; [exact Hx|]].
    + intros b v [[= <- <-]|H]; [rewrite Ha; destruct (Rle_dec (U y) eps);
        [reflexivity|tauto]|exact (IH b v H)].
    + intros b v [[= <- <-]|H]; [rewrite Ha; destruct (Rle_dec (U y) eps);
        [discriminate|tauto]|exact (IH b v H)].
  - right. destruct IH as [IH|(x & Hx & IH)].
    + exists y. split; [lra|]. intros b v [[= <- <-]|H] HB.
      * unfold leaves. rewrite Ha. destruct (Rlt_dec y y); [lra|reflexivity].
      * rewrite (IH b v H) in HB. discriminate.
    + destruct (Rle_dec x y) as [H|H]; [exists y; split; [lra|]|exists x; split; [exact Hx|]].
      * intros b v [[= <- <-]|Hb] HB.
        -- unfold leaves. rewrite Ha. destruct (Rlt_dec y y); [lra|reflexivity].
        -- specialize (IH b v Hb HB). unfold leaves in *. destruct (score b) as [z|];
          [|discriminate].
           destruct (Rlt_dec x z); [discriminate|]. destruct (Rlt_dec y z); [lra|reflexivity].
      * intros b v [[= <- <-]|Hb] HB; [|exact (IH b v Hb HB)].
        unfold leaves. rewrite Ha. destruct (Rlt_dec x y); [lra|reflexivity].
  - destruct IH as [IH|(x & Hx & IH)]; [left|right; exists x; split; [exact Hx|]].
    + intros b v [[= <- <-]|H]; [rewrite Ha; reflexivity|exact (IH b v H)].
    + intros b v [[= <- <-]|H]; [rewrite Ha; discriminate|exact (IH b v H)].
Qed.

(* ---- T1, T2 ---- *)
Section Claim.
Context {A : Type} (L : law A) (score : A -> option R).
Hypothesis HL : is_law L.
Let V s := prob L (leaves score s).

Lemma larger_is_wider s t : s <= t -> V t <= V s.
Proof.
  intro H. apply prob_le; [exact HL|]. intros a w _. unfold leaves. destruct (score a) as [x|];
    [|reflexivity].
  destruct (Rlt_dec t x), (Rlt_dec s x); intros; try reflexivity; try discriminate; lra.
Qed.

Let highV := high score V.

Lemma high_is_likely eps : eps <= 1 -> eps <= prob L (highV eps).
Proof.
  unfold highV. intro H1. assert (N : prob L (fun a => negb (high score V eps a)) <= 1 - eps).
  { destruct (worst_of_low score V eps L) as [H|(x & Hx & H)].
    - apply Rle_trans with (prob L (fun _ => false)).
      + apply prob_le; [exact HL|]. intros a w Ha. rewrite (H a w Ha). discriminate.
      + unfold prob. rewrite (mean_ext _ _ (fun _ => 0 * 0)), mean_scale by (intro; lra). lra.
    - apply Rle_trans with (prob L (fun a => negb (leaves score x a))).
      + apply prob_le; [exact HL|]. intros a w Ha. destruct (high score V eps a) eqn:E;
          [discriminate|]. rewrite (H a w Ha E). auto.
      + rewrite prob_not by exact HL. unfold V in Hx. lra. }
  rewrite prob_not in N by exact HL. lra.
Qed.
Lemma high_leaves eps s a : eps < V s -> highV eps a = true -> leaves score s a = true.
Proof.
  unfold highV, high, leaves. destruct (score a) as [x|]; [|reflexivity]. intros Hs H.
  destruct (Rle_dec (V x) eps); [|discriminate]. destruct (Rlt_dec s x) as [|K]; [reflexivity|].
  pose proof (larger_is_wider x s). lra.
Qed.

(* Whatever number is chosen after the draws, for which at most r of them are left outside: rarely
   is its tube left by more than eps. *)
Theorem claim_is_true N r eps (wrong : list A -> bool) : 0 <= eps <= 1 ->
  (forall l, wrong l = true -> exists s, (left_out score s l <= r)%nat /\
    eps < prob L (leaves score s)) ->
  prob (draws L N) wrong <= tail N r eps.
Proof.
  intros He H. rewrite <- at_most_tail. apply Rle_trans with (at_most (prob L (highV eps)) N r).
  - rewrite <- (counted L (highV eps) HL). apply prob_le; [apply draws_law, HL|]. intros l w _ Hl.
    destruct (H l Hl) as (s & Hs & Hv). apply Nat.leb_le. unfold left_out in Hs.
    pose proof (filter_le (highV eps) (leaves score s) l (fun a => high_leaves eps s a Hv)). lia.
  - apply at_most_falls; [lra|apply high_is_likely; lra|apply prob_range, HL].
Qed.

(* ---- T5: from the law of the runs to the k that is driven ---- *)
Theorem risk_of_a_set (chosen : A -> bool) s eps : 0 < prob L chosen ->
  prob L (leaves score s) <= eps ->
  prob L (fun a => chosen a && leaves score s a) / prob L chosen <= eps / prob L chosen.
Proof.
  intros HC H. apply Rmult_le_compat_r; [left; apply Rinv_0_lt_compat, HC|].
  apply Rle_trans with (prob L (leaves score s)); [|exact H].
  apply prob_le; [exact HL|]. intros a w _ K. apply andb_prop in K. tauto.
Qed.
End Claim.

(* The (r + 1)-th largest of the scores is such a number. *)
Theorem order_statistic {A} (score : A -> option R) (l m : list A) r s : Permutation l m ->
  StronglySorted (fun a b => forall t, leaves score t b = true -> leaves score t a = true) m ->
  nth_error m r <> None -> (forall a, nth_error m r = Some a -> score a = Some s) ->
    (left_out score s l <= r)%nat.
Proof.
  intros HP HS Hr Hs. unfold left_out.
  assert (E : length (filter (leaves score s) l) = length (filter (leaves score s) m)).
  { clear - HP. induction HP; simpl; try congruence.
    - destruct (leaves score s x); simpl; congruence.
    - destruct (leaves score s x), (leaves score s y); reflexivity. }
  rewrite E. clear E HP l. revert r Hr Hs. induction HS as [|a m HS IH HF]; intros r Hr Hs.
  - destruct r; simpl in Hr; tauto.
  - destruct r as [|r]; simpl in *.
    + assert (Ha : leaves score s a = false).
      { unfold leaves. rewrite (Hs a eq_refl). destruct (Rlt_dec s s); [lra|reflexivity]. }
      rewrite Ha. rewrite Forall_forall in HF.
      assert (K : filter (leaves score s) m = []).
      { clear - HF Ha. induction m as [|b m IHm]; [reflexivity|]. simpl.
        destruct (leaves score s b) eqn:Hb.
        - rewrite (HF b (or_introl eq_refl) s Hb) in Ha. discriminate.
        - apply IHm. intros x Hx. apply HF. right. exact Hx. }
      rewrite K. simpl. lia.
    + specialize (IH r Hr Hs). destruct (leaves score s a); simpl; lia.
Qed.

Theorem risk_of_a_density {A} (L : law A) (score : A -> option R) (M : law A) W s eps : 0 <= W ->
  prob L (leaves score s) <= eps ->
  (forall E, prob M E <= W * prob L E) -> prob M (leaves score s) <= W * eps.
Proof.
  intros HW H HM. apply Rle_trans with (W * prob L (leaves score s)); [apply HM|].
  apply Rmult_le_compat_l; assumption.
Qed.
