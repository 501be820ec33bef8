(* Bins: each k of the domain has one, and inside the faces that bins share it has only one. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker Polytopes ArithmeticFacts ListFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Each k has a bin ---- *)
Lemma boxes_len es : forall b, In b (boxes es) -> length b = length es.
Proof.
  induction es as [|e es IH]; intros b H; simpl in *.
  - destruct H as [<-|[]]. reflexivity.
  - apply in_flat_map in H as (I & _ & H). apply in_map_iff in H as (b' & <- & H). simpl.
    f_equal. auto.
Qed.
Lemma zip3_box : forall a b c B, In B (zip3 a b c) -> In (box B) a.
Proof. induction a; intros [|? b] [|? c] B H; simpl in *; try destruct H; subst; simpl; eauto. Qed.
Lemma zip3_ex : forall a b c x, length b = length a -> length c = length a -> In x a ->
  exists B, In B (zip3 a b c) /\ box B = x.
Proof.
  induction a; intros [|? b] [|? c] x H1 H2 H; simpl in *; try discriminate; try destruct H; subst.
  - eexists. split; [left; reflexivity|reflexivity].
  - destruct (IHa b c x ltac:(lia) ltac:(lia) H) as (B & ? & ?). eauto.
Qed.
Lemma gaps_ex e : forall a v, (2 <= length e)%nat -> Q2R (hd a e) <= v <= Q2R (List.last e a) ->
  exists lo hi, In (lo, hi) (gaps e) /\ Q2R lo <= v <= Q2R hi.
Proof.
  induction e as [|b [|c e] IH]; intros a v L H; simpl in *; try lia.
  destruct (Rle_dec v (Q2R c)) as [G|G].
  - exists b, c. split; [auto|lra].
  - destruct e as [|d e]; [simpl in *; lra|].
    destruct (IH a v ltac:(simpl; lia) ltac:(simpl in *; lra)) as (lo & hi & ? & ?). eauto.
Qed.
Lemma covers_ex es : forall D x, covers es D = true -> inBox D x -> length es = length D /\
  exists b, In b (boxes es) /\ inBox b x.
Proof.
  induction es as [|e es IH]; intros [|[lo hi] D] x H Hx; simpl in *; try discriminate.
  - split; [reflexivity|]. exists []. simpl. auto.
  - destruct e; discriminate || (destruct e; discriminate).
  - destruct e as [|a [|b e]]; try discriminate. rewrite !andb_true_iff in H.
    destruct H as [[[A B] C] F].
    destruct Hx as [Hx Hs]. destruct (IH D (shift x) F Hs) as [L (bx & Hb & Hi)].
    split; [simpl; lia|].
    apply R_le in B, C.
    destruct (gaps_ex (a :: b :: e) a (x O) ltac:(simpl; lia) ltac:(simpl hd; lra))
      as (l & h & Hg & Hv).
    exists ((l, h) :: bx). split; [|simpl; auto]. apply in_flat_map. exists (l, h).
    split; [exact Hg|].
    apply in_map_iff. eauto.
Qed.
Lemma covers_len es : forall D, covers es D = true -> length es = length D.
Proof.
  induction es as [|e es IH]; intros [|[lo hi] D] H; simpl in *; try discriminate; auto.
  - destruct e as [|a [|b e]]; discriminate.
  - destruct e as [|a [|b e]]; try discriminate. rewrite !andb_true_iff in H. destruct H as [_ H].
    f_equal. auto.
Qed.
Lemma tube_inv P E : tube_ok P E = true -> covers (edges E) (domain P) = true /\
  length (intervals E) = length (boxes (edges E)) /\ length (finals E) = length (boxes (edges E)).
Proof. unfold tube_ok. rewrite !andb_true_iff, !Nat.eqb_eq. tauto. Qed.
Theorem every_k_has_a_bin P E x : tube_ok P E = true -> inBox (domain P) x ->
  exists B, In B (bins E) /\ inBox (box B) x.
Proof.
  intros H Hx. apply tube_inv in H as (C & L1 & L2).
  destruct (covers_ex _ _ _ C Hx) as [_ (b & Hb & Hi)].
  destruct (zip3_ex _ (intervals E) (finals E) b L1 L2 Hb) as (B & HB & <-). eauto.
Qed.

(* ---- The gaps of increasing edges follow each other ---- *)
Lemma gaps_within e : forall a c d, increasing (a :: e) = true -> In (c, d) (gaps (a :: e)) ->
  Q2R a <= Q2R c /\ Q2R c < Q2R d /\ Q2R d <= Q2R (List.last (a :: e) a).
Proof.
  induction e as [|b e IH]; intros a c d HI Hin; [destruct Hin|].
  change (increasing (a :: b :: e)) with (qlt a b && increasing (b :: e)) in HI.
  apply andb_prop in HI as [AB HI].
  apply R_lt in AB. change (gaps (a :: b :: e)) with ((a, b) :: gaps (b :: e)) in Hin.
  change (List.last (a :: b :: e) a) with (List.last (b :: e) a).
  rewrite (last_default e b a b). destruct Hin as [[= <- <-]|Hin].
  - split; [lra|]. split; [exact AB|]. destruct e as [|b' e]; [simpl; lra|].
    destruct (IH b b b' HI (or_introl eq_refl)) as (_ & X & Y). lra.
  - destruct (IH b c d HI Hin) as (X & Y & Z). lra.
Qed.
Lemma gaps_follow e : forall a i j lo hi lo' hi', increasing (a :: e) = true -> (i < j)%nat ->
  nth_error (gaps (a :: e)) i = Some (lo, hi) -> nth_error (gaps (a :: e)) j = Some (lo', hi') ->
    Q2R hi <= Q2R lo'.
Proof.
  induction e as [|b e IH]; intros a i j lo hi lo' hi' HI L Hi Hj; [destruct i; discriminate|].
  change (gaps (a :: b :: e)) with ((a, b) :: gaps (b :: e)) in *.
  change (increasing (a :: b :: e)) with (qlt a b && increasing (b :: e)) in HI.
  apply andb_prop in HI as [AB HI].
  destruct j as [|j]; [lia|]. simpl in Hj. destruct i as [|i].
  - injection Hi as <- <-. apply nth_error_In in Hj. apply (gaps_within _ _ _ _ HI) in Hj. lra.
  - simpl in Hi. apply (IH b i j lo hi lo' hi'); auto. lia.
Qed.

(* ---- Without the shared faces ---- *)
Fixpoint inOpen (es : list vec) (B : list (Q * Q)) (x : rv) : Prop :=
  match es, B with
  | e :: es', (lo, hi) :: B' =>
      Q2R lo <= x O <= Q2R hi /\ (Q2R lo <> Q2R (hd lo e) -> Q2R lo < x O) /\
      (Q2R hi <> Q2R (List.last e hi) -> x O < Q2R hi) /\ inOpen es' B' (shift x)
  | _, _ => True
  end.
Lemma open_closed es : forall B x, length B = length es -> inOpen es B x -> inBox B x.
Proof.
  induction es as [|e es IH]; intros [|[lo hi] B] x L H; simpl in *; try discriminate; auto.
  destruct H as (A & _ & _ & D). split; [exact A|]. apply IH; [lia|exact D].
Qed.
Lemma gap_unique a e i j lo hi lo' hi' v : increasing (a :: e) = true ->
  nth_error (gaps (a :: e)) i = Some (lo, hi) -> nth_error (gaps (a :: e)) j = Some (lo', hi') ->
  (Q2R lo <> Q2R a -> Q2R lo < v) -> (Q2R hi <> Q2R (List.last (a :: e) a) -> v < Q2R hi) ->
  Q2R lo' <= v <= Q2R hi' -> i = j.
Proof.
  intros HI Hi Hj Hl Hh Hv. pose proof (gaps_within _ _ _ _ HI (nth_error_In _ _ Hi)) as A.
  pose proof (gaps_within _ _ _ _ HI (nth_error_In _ _ Hj)) as B.
  destruct (lt_eq_lt_dec i j) as [[L|E]|L]; [|exact E|]; exfalso.
  - pose proof (gaps_follow _ _ _ _ _ _ _ _ HI L Hi Hj). specialize (Hh ltac:(lra)). lra.
  - pose proof (gaps_follow _ _ _ _ _ _ _ _ HI L Hj Hi). specialize (Hl ltac:(lra)). lra.
Qed.
Lemma covers_increasing es : forall D, covers es D = true -> forall e, In e es ->
  increasing e = true /\ e <> [].
Proof.
  induction es as [|e' es IH]; intros [|[lo hi] D] H e Hin; [destruct Hin|destruct Hin| |].
  - destruct e' as [|a [|b e']]; discriminate.
  - destruct e' as [|a [|b e']]; try discriminate. cbn [covers] in H. rewrite !andb_true_iff in H.
    destruct H as [[[A _] _] F]. destruct Hin as [<-|Hin]; [split; [exact A|discriminate]|apply (IH
      _ F _ Hin)].
Qed.
Lemma box_unique es : (forall e, In e es -> increasing e = true /\ e <> []) -> forall i j B B' x,
  nth_error (boxes es) i = Some B -> nth_error (boxes es) j = Some B' -> inOpen es B x ->
    inBox B' x -> i = j.
Proof.
  induction es as [|e es IH]; intros HI i j B B' x Hi Hj HO HB.
  - simpl in Hi, Hj. destruct i as [|[|i]], j as [|[|j]]; try discriminate; reflexivity.
  - cbn [boxes] in Hi, Hj. apply nth_flat in Hi as (g & l & [lo hi] & b & G & L & -> & ->).
    apply nth_flat in Hj as (g' & l' & [lo' hi'] & b' & G' & L' & -> & ->).
    cbn [inOpen inBox] in HO, HB. destruct HO as (_ & Ol & Oh & Os), HB as (Bv & Bs).
    destruct (HI e (or_introl eq_refl)) as [Ie Ne]. destruct e as [|a e]; [congruence|].
    rewrite (last_default e a hi a) in Oh. cbn [hd] in Ol.
    rewrite (gap_unique a e g g' lo hi lo' hi' (x O) Ie G G' Ol Oh Bv).
    rewrite (IH (fun e He => HI e (or_intror He)) l l' b b' (shift x) L L' Os Bs). reflexivity.
Qed.
Lemma zip3_nth : forall a b c i B, nth_error (zip3 a b c) i = Some B ->
  nth_error a i = Some (box B).
Proof.
  induction a as [|x a IH]; intros [|y b] [|z c] i B H; simpl in H; try (destruct i; discriminate).
  destruct i as [|i]; simpl in *; [injection H as <-; reflexivity|eapply IH; exact H].
Qed.
Theorem only_one_bin P E i B x : tube_ok P E = true -> nth_error (bins E) i = Some B ->
  inOpen (edges E) (box B) x ->
  forall B', In B' (bins E) -> inBox (box B') x -> B' = B.
Proof.
  intros HE Hi HO B' Hin HB. apply tube_inv in HE as (C & _ & _).
  apply In_nth_error in Hin as [j Hj].
  pose proof (zip3_nth _ _ _ _ _ Hi) as Xi. pose proof (zip3_nth _ _ _ _ _ Hj) as Xj.
  pose proof (box_unique (edges E) (covers_increasing _ _ C) i j _ _ x Xi Xj HO HB) as E'.
  subst j. congruence.
Qed.

(* ---- The same with the hints for the goal beside each bin ---- *)
Lemma hinted_ex E H B : In B (bins E) -> exists h, In (B, h) (hinted E H).
Proof. intro HB. apply combine_ex; [|exact HB]. rewrite app_length, repeat_length. lia. Qed.

(* ---- Rows of boxes ---- *)
Lemma inBox_ext D : forall f g : rv, (forall i, f i = g i) -> inBox D f -> inBox D g.
Proof.
  induction D as [|[l h] D IH]; intros f g E H; simpl in *; auto. rewrite <- E. destruct H.
  split; auto.
  apply (IH (shift f)); auto. intro i. apply E.
Qed.
Lemma inOpen_ext es : forall D (f g : rv), (forall i, f i = g i) -> inOpen es D f -> inOpen es D g.
Proof.
  induction es as [|e es IH]; intros [|[l h] D] f g E H; simpl in *; auto. rewrite <- !E.
  destruct H as (A & B & C & F). repeat split; try tauto. apply (IH D (shift f)); auto.
  intro i. apply E.
Qed.
Lemma box_rows_R D : forall j x, (forall r, In r (box_rows j D) -> rowR x r) -> inBox D (fun i =>
  x (j + i)%nat).
Proof.
  induction D as [|[lo hi] D IH]; intros j x H; simpl in *; [exact I|]. rewrite Nat.add_0_r. split.
  - pose proof (H _ (or_introl eq_refl)) as A. pose proof (H _ (or_intror (or_introl eq_refl)))
      as B. unfold rowR in *. simpl in *.
    rewrite affR_add, affR_const, unit_R, Q2R_opp in A. rewrite affR_add, affR_const, affR_neg,
      unit_R in B. lra.
  - specialize (IH (S j) x (fun r Hr => H r (or_intror (or_intror Hr)))).
    eapply inBox_ext; [|exact IH]. intro i. unfold shift. f_equal. lia.
Qed.
Lemma not_Qeq a b : Q2R a <> Q2R b -> Qeq_bool a b = false.
Proof. intro H. destruct (Qeq_bool a b) eqn:E; [|reflexivity]. apply Qeq_bool_eq, Qeq_eqR in E.
contradiction. Qed.
Lemma bin_rows_R es : forall B j x, (forall r, In r (bin_rows j es B) -> rowR x r) ->
  inOpen es B (fun i => x (j + i)%nat).
Proof.
  induction es as [|e es IH]; intros [|[lo hi] B] j x H; simpl in *; auto. rewrite Nat.add_0_r.
  pose proof (H _ (or_introl eq_refl)) as L. pose proof (H _ (or_intror (or_introl eq_refl))) as U.
  unfold rowR in L, U. simpl in L, U.
  rewrite affR_add, affR_const, unit_R, Q2R_opp in L. rewrite affR_add, affR_const, affR_neg,
    unit_R in U.
  split; [|split; [|split]].
  - destruct (negb (Qeq_bool lo (hd lo e))), (negb (Qeq_bool hi (List.last e hi))); lra.
  - intro N. rewrite (not_Qeq _ _ N) in L. simpl in L. lra.
  - intro N. rewrite (not_Qeq _ _ N) in U. simpl in U. lra.
  - specialize (IH B (S j) x (fun r Hr => H r (or_intror (or_intror Hr)))).
    eapply inOpen_ext; [|exact IH]. intro i. unfold shift. f_equal. lia.
Qed.
