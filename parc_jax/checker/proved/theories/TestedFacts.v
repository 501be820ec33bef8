(* Sets that are tested one after the other: whatever is accepted is bad with a small probability.
   [T42] *)
From Coq Require Import Reals ZArith QArith Qreals List Bool Arith Lia Lra.
From ParcJax Require Import ClaimSpec Draws Claim ClaimFacts.
Import ListNotations.
Open Scope R_scope.

Lemma mean_swap {A B} (L : law A) (M : law B) f :
  mean L (fun a => mean M (fun b => f a b)) = mean M (fun b => mean L (fun a => f a b)).
Proof.
  induction L as [|[a w] L IH]; simpl.
  - rewrite (mean_ext M _ (fun _ => 0 * 0)), mean_scale by (intro; lra). lra.
  - rewrite IH, mean_plus, mean_scale. reflexivity.
Qed.
Lemma drawn_length {A} (L : law A) N : forall l w, In (l, w) (draws L N) -> length l = N.
Proof.
  induction N as [|N IH]; intros l w H; simpl in H.
  - destruct H as [[= <- _]|[]]. reflexivity.
  - apply in_flat_map in H as ([a v] & _ & H). apply in_map_iff in H as ([m u] & [= <- _] & H).
    simpl. f_equal. exact (IH m u H).
Qed.

(* ---- The law of those in a set ---- *)
Section Within.
Context {A : Type} (L : law A) (has : A -> bool).
Hypothesis HL : is_law L.
Hypothesis Some_ : 0 < prob L has.
Definition within : law A :=
  map (fun aw => (fst aw, snd aw / prob L has)) (filter (fun aw => has (fst aw)) L).
Lemma mean_within f : prob L has * mean within f = mean L (fun a => if has a then f a else 0).
Proof.
  unfold within. generalize Some_. generalize (prob L has). intros s Hs. clear - Hs.
  induction L as [|[a w] M IH]; simpl; [lra|]. destruct (has a); simpl; [|lra].
  rewrite Rmult_plus_distr_l, IH. field_simplify_eq; lra.
Qed.
Lemma within_law : is_law within.
Proof.
  split.
  - intros a w H. apply in_map_iff in H as ([b v] & [= <- <-] & H). apply filter_In in H as [H _].
    apply Rmult_le_pos; [exact (proj1 HL b v H)|left; apply Rinv_0_lt_compat, Some_].
  - apply Rmult_eq_reg_l with (prob L has); [|lra]. rewrite mean_within. unfold prob. lra.
Qed.
(* However many of N draws fall into the set, they are draws of its law. *)
Lemma mean_of_those_in d : forall N g, (forall n, (n <= N)%nat -> mean (draws within n) g <= d) ->
  mean (draws L N) (fun l => g (filter has l)) <= d.
Proof.
  induction N as [|N IH]; intros g H; [exact (H O (le_n O))|].
  simpl draws. rewrite mean_both.
  set (c := mean (draws L N) (fun l => g (filter has l))).
  set (h := fun a => mean (draws L N) (fun l => g (a :: filter has l))).
  rewrite (mean_ext L _ (fun a =>
    (if has a then h a else 0) + c * (if negb (has a) then 1 else 0))).
  2: { intro a. unfold h, c. destruct (has a) eqn:E; simpl.
       - rewrite Rmult_0_r, Rplus_0_r. apply mean_ext. intro l. rewrite E. reflexivity.
       - rewrite Rmult_1_r, Rplus_0_l. apply mean_ext. intro l. rewrite E. reflexivity. }
  rewrite mean_plus, mean_scale, <- mean_within.
  pose proof (prob_not L has HL) as Not. unfold prob in Not at 1. rewrite Not.
  assert (C : c <= d) by (apply IH; intros n Hn; apply H; lia).
  assert (Hh : mean within h <= d).
  { unfold h. rewrite mean_swap. apply (IH (fun l => mean within (fun a => g (a :: l)))).
    intros n Hn. specialize (H (S n) ltac:(lia)). simpl draws in H. rewrite mean_both in H.
    rewrite mean_swap. exact H. }
  pose proof (prob_range L has HL) as P.
  apply Rle_trans with (prob L has * d + d * (1 - prob L has)); [|lra].
  apply Rplus_le_compat; [apply Rmult_le_compat_l; lra|apply Rmult_le_compat_r; lra].
Qed.
End Within.

(* ---- One test ---- *)
Definition shown_by (e d : Q) (n x : nat) : bool :=
  (0 <? n)%nat && check_claim (Claim [Block (Pos.of_nat n) x e] 1 e d []).
Lemma most_shown (p : nat -> bool) n : (forall x, (x <= n)%nat -> p x = false) \/
  exists r, p r = true /\ forall x, (x <= n)%nat -> p x = true -> (x <= r)%nat.
Proof.
  induction n as [|n IH].
  - destruct (p O) eqn:Z; [right; exists O; split; [exact Z|intros; lia]|left; intros x Hx].
    replace x with O by lia. exact Z.
  - destruct (p (S n)) eqn:E; [right; exists (S n); split; [exact E|intros; assumption]|].
    assert (K : forall x, (x <= S n)%nat -> p x = true -> (x <= n)%nat).
    { intros x Hx Px. destruct (Nat.eq_dec x (S n)) as [->|]; [congruence|lia]. }
    destruct IH as [IH|(r & R & IH)].
    + left. intros x Hx. destruct (p x) eqn:Px; [|reflexivity].
      rewrite (IH x (K x Hx Px)) in Px. discriminate.
    + right. exists r. split; [exact R|]. intros x Hx Px. exact (IH x (K x Hx Px) Px).
Qed.
Lemma one_test {A} (M : law A) (fails : A -> bool) e d n : is_law M -> 0 <= Q2R d ->
  Q2R e < prob M fails ->
  prob (draws M n) (fun l => shown_by e d (length l) (length (filter fails l))) <= Q2R d.
Proof.
  intros HM D0 HR. destruct (most_shown (shown_by e d n) n) as [No|(r & Sh & Most)].
  - apply Rle_trans with (prob (draws M n) (fun _ => false)).
    + apply prob_le; [apply draws_law, HM|]. intros l w Hl. rewrite (drawn_length M n l w Hl).
      rewrite No; [discriminate|]. rewrite <- (drawn_length M n l w Hl).
      clear. induction l as [|a l IH]; simpl; [lia|]. destruct (fails a); simpl; lia.
    + unfold prob. rewrite (mean_ext _ _ (fun _ => 0 * 0)), mean_scale by (intro; lra). lra.
  - unfold shown_by in Sh. apply andb_prop in Sh as [N0 Sh]. apply Nat.ltb_lt in N0.
    set (score := fun a => if fails a then None else Some 0 : option R).
    set (wrong := fun l : list A => (length (filter fails l) <=? r)%nat).
    assert (Lf : forall a, leaves score 0 a = fails a).
    { intro a. unfold leaves, score. destruct (fails a); [reflexivity|].
      destruct (Rlt_dec 0 0); [lra|reflexivity]. }
    assert (S : Forall2 says [{| law_of := M; score_of := score; wrong_of := wrong |}]
      [Block (Pos.of_nat n) r e]).
    { constructor; [|constructor]. split; [exact HM|]. intros l W. exists 0. split.
      - unfold left_out. rewrite (filter_ext _ _ Lf). apply Nat.leb_le, W.
      - unfold prob. rewrite (mean_ext _ _ (fun a => if fails a then 1 else 0)); [exact HR|].
        intro a. rewrite Lf. reflexivity. }
    pose proof (claim_shown _ _ Sh S) as C. cbn [blocks delta looks] in C.
    unfold Rdiv in C. rewrite Rinv_1, Rmult_1_r in C.
    eapply Rle_trans; [|exact C]. cbn [all_draws law_of runs]. rewrite Nat2Pos.id by lia.
    unfold prob. rewrite mean_both. cbn [mean]. apply mean_le; [apply draws_law, HM|].
    intros l w Hl. pose proof (drawn_length M n l w Hl) as Ln. cbn [some_wrong wrong_of].
    rewrite orb_false_r. destruct (shown_by e d (length l) _) eqn:E.
    + replace (wrong l) with true; [lra|]. symmetry. apply Nat.leb_le. apply Most.
      * rewrite <- Ln. clear. induction l as [|a l IH]; simpl; [lia|].
        destruct (fails a); simpl; lia.
      * rewrite <- Ln. exact E.
    + destruct (wrong l); lra.
Qed.

(* ---- All of them, in order ---- *)
Theorem sets_tested {A} (L : law A) (fails : A -> bool) (sets : list (A -> bool)) N e d :
  is_law L -> 0 <= Q2R d ->
  prob (draws L N) (accepts_a_bad_one L fails (Q2R e) (shown_by e d) sets) <= Q2R d.
Proof.
  intros HL D0. induction sets as [|has sets IH].
  - unfold prob. simpl. rewrite (mean_ext _ _ (fun _ => 0 * 0)), mean_scale by (intro; lra). lra.
  - destruct (riskier L fails has (Q2R e)) eqn:Bad.
    + unfold riskier in Bad. destruct (Rlt_dec _ _) as [B|]; [clear Bad|discriminate].
      assert (S : 0 < prob L has).
      { destruct (prob_range L has HL) as [[P|P] _]; [exact P|]. exfalso.
        assert (prob L (fun a => has a && fails a) <= prob L has).
        { apply prob_le; [exact HL|]. intros a w _ H. apply andb_prop in H. tauto. }
        rewrite <- P in *. lra. }
      set (g := fun m => if shown_by e d (length m) (length (filter fails m)) then 1 else 0).
      apply Rle_trans with (mean (draws L N) (fun l => g (filter has l))).
      * apply mean_le; [apply draws_law, HL|]. intros l w _. unfold g. cbn [accepts_a_bad_one].
        destruct (shown_by _ _ _ _); simpl; [|lra]. destruct (_ || _); lra.
      * apply (mean_of_those_in L has HL S). intros n _.
        apply (one_test (within L has) fails e d n); [apply within_law; assumption|exact D0|].
        apply Rmult_lt_reg_l with (prob L has); [exact S|].
        unfold prob at 3. rewrite mean_within by exact S. rewrite Rmult_comm.
        eapply Rlt_le_trans; [exact B|]. right. unfold prob. apply mean_ext. intro a.
        destruct (has a), (fails a); reflexivity.
    + eapply Rle_trans; [|exact IH]. apply prob_le; [apply draws_law, HL|]. intros l w _ H.
      cbn [accepts_a_bad_one] in H. rewrite Bad in H. apply andb_prop in H. simpl in H. tauto.
Qed.
