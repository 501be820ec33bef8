(* What an accepted answer is: every entry was read and is accepted, and what is counted is there.
   *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan Answer ArithmeticFacts.
Import ListNotations.

(* ---- Marks ---- *)
Definition each {A} (l : list (option A)) (holds : A -> Prop) : Prop :=
  forall x, In x l -> exists s, x = Some s /\ holds s.

Lemma all_marked {A} (check : A -> bool) (l : list (option A)) :
  forallb (fun ok => ok) (marked check l) = true -> each l (fun s => check s = true).
Proof.
  unfold marked. rewrite rev_append_rev, app_nil_r. intro H.
  assert (G : forall l oks, (forall b, In b (fold_left (fun oks x =>
      told (match x with Some s => check s | None => false end) :: oks) l oks) -> b = true) ->
      (forall b, In b oks -> b = true) /\ each l (fun s => check s = true)).
  { clear. induction l as [|x l IH]; simpl; intros oks H; [split; [exact H|intros ? []]|].
    destruct (IH _ H) as [K L]. split; [intros b Hb; apply K; right; exact Hb|].
    intros y [<-|Hy]; [|apply L, Hy]. specialize (K _ (or_introl eq_refl)). unfold told in K.
    destruct x as [s|]; [eauto|discriminate]. }
  apply (G l []). intros b Hb. rewrite forallb_forall in H. apply (H b). apply -> in_rev. exact Hb.
Qed.

(* ---- Keys ---- *)
Definition different (u v : key) : Prop := exists i,
  fst (nth i u (O, 0%Q)) <> fst (nth i v (O, 0%Q)) \/ Q2R (snd (nth i u (O, 0%Q))) <> Q2R
    (snd (nth i v (O, 0%Q))).
Definition at_least {A} (n : nat) (key_of : A -> key) (l : list (option A)) : Prop :=
  exists some, length some = n /\ (forall u, In u some -> exists s, In (Some s) l /\
    key_of s = u) /\
    ForallOrdPairs different some.

Lemma same_number_eq x y : same_number x y = true -> x = y.
Proof.
  unfold same_number. intro H. apply andb_prop in H as [A B]. apply Z.eqb_eq in A.
  apply Pos.eqb_eq in B.
  destruct x, y. simpl in *. congruence.
Qed.
Lemma lt_Q x y : qlt x y = true <-> (x < y)%Q.
Proof.
  unfold qlt. rewrite negb_true_iff. split; intro H.
  - apply Qnot_le_lt. intro L. apply Qle_bool_iff in L. unfold qle in *. congruence.
  - destruct (Qle_bool y x) eqn:L; [|reflexivity]. apply Qle_bool_iff in L. exfalso.
    eapply Qlt_not_le; eassumption.
Qed.
Inductive before : key -> key -> Prop :=
  | by_place i j x y a b : (i < j)%nat -> before ((i, x) :: a) ((j, y) :: b)
  | by_number i x y a b : (x < y)%Q -> before ((i, x) :: a) ((i, y) :: b)
  | later i x y a b : (x == y)%Q -> before a b -> before ((i, x) :: a) ((i, y) :: b).
Lemma ahead_before a : forall b, ahead a b = true -> before a b.
Proof.
  induction a as [|[i x] a IH]; intros [|[j y] b]; simpl; try discriminate. intro H.
  apply orb_prop in H as [H|H]; [apply Nat.ltb_lt in H; constructor; exact H|].
  apply andb_prop in H as [E H]. apply Nat.eqb_eq in E. subst j.
  destruct (same_number x y) eqn:S; [apply same_number_eq in S; subst y; apply later;
    [reflexivity|auto]|].
  apply orb_prop in H as [H|H]; [apply by_number, lt_Q, H|].
  apply andb_prop in H as [E H]. apply later; [apply Qeq_bool_iff, E|auto].
Qed.
Lemma before_trans a b : before a b -> forall c, before b c -> before a c.
Proof.
  induction 1 as [i j x y a b L|i x y a b L|i x y a b L _ IH]; intros c K; inversion K; subst;
    try (apply by_place; lia).
  - apply by_number. eapply Qlt_trans; eassumption.
  - apply by_number. eapply Qlt_le_trans; [eassumption|]. apply Qle_lteq. auto.
  - apply by_number. eapply Qle_lt_trans; [|eassumption]. apply Qle_lteq. auto.
  - apply later; [eapply Qeq_trans; eassumption|auto].
Qed.
Lemma before_different a b : before a b -> different a b.
Proof.
  induction 1 as [i j x y a b L|i x y a b L|i x y a b L _ [n IH]]; [exists O|exists O|exists (S n);
    exact IH].
  - left. simpl. lia.
  - right. simpl. apply Rlt_not_eq, Qlt_Rlt, L.
Qed.

Lemma climb_counts l : forall from n, exists some, climb from l n = (n + length some)%nat /\
  incl some l /\
  (forall u, In u some -> before from u) /\ ForallOrdPairs before some.
Proof.
  induction l as [|x l IH]; intros from n; simpl.
  { exists []. split; [simpl; lia|]. split; [intros ? []|]. split; [intros ? []|constructor]. }
  destruct (ahead from x) eqn:A.
  - destruct (IH x (S n)) as (some & L & I & F & P). exists (x :: some). split; [simpl; lia|].
    apply ahead_before in A. split; [intros u [<-|U]; [left; reflexivity|right; apply I, U]|].
    split; [intros u [<-|U]; [exact A|eapply before_trans; [exact A|apply F, U]]|].
    constructor; [apply Forall_forall, F|exact P].
  - destruct (IH from n) as (some & L & I & F & P). exists some. split; [exact L|].
    split; [intros u U; right; apply I, U|]. split; [exact F|exact P].
Qed.
Lemma merge_incl most : forall a b done u, In u (merge most a b done) -> In u (a ++ b ++ done).
Proof.
  induction most as [|m most IH]; intros a b done u; [intro; rewrite !in_app_iff; auto|].
  destruct a as [|x a], b as [|y b]; simpl; [auto|..]; intro H.
  3: destruct (ahead x y).
  all: apply IH in H; repeat (rewrite in_app_iff in *; simpl in *); tauto.
Qed.
Lemma deal_incl l : forall a b u, In u (fst (deal l a b)) \/ In u (snd (deal l a b)) ->
  In u (l ++ a ++ b).
Proof.
  induction l as [|x l IH]; intros a b u; simpl; [rewrite in_app_iff; auto|].
  intro H. apply IH in H. rewrite !in_app_iff in *. simpl in H. tauto.
Qed.
Lemma sort_incl depth : forall l u, In u (sort depth l) -> In u l.
Proof.
  induction depth as [|depth IH]; intros l u; [exact (fun H => H)|].
  destruct l as [|x [|y l]]; try exact (fun H => H). cbn [sort].
  pose proof (deal_incl (x :: y :: l) [] [] u) as D.
  destruct (deal (x :: y :: l) [] []) as [a b]. cbn [fst snd] in D.
  rewrite rev_append_rev, app_nil_r, <- in_rev. intro H. apply merge_incl in H.
  rewrite !app_nil_r in *. rewrite in_app_iff in H. apply D. destruct H as [H|H];
    apply IH in H; auto.
Qed.
Lemma distinct_counts l : exists some, length some = distinct l /\ incl some l /\
  ForallOrdPairs different some.
Proof.
  unfold distinct. pose proof (sort_incl 30 l) as S. destruct (sort 30 l) as [|x l'].
  { exists []. split; [reflexivity|]. split; [intros ? []|constructor]. }
  destruct (climb_counts l' x 1) as (some & L & I & F & P). exists (x :: some).
  split; [simpl; lia|].
  split; [intros u [<-|U]; apply S; [left; reflexivity|right; apply I, U]|].
  constructor.
  - apply Forall_forall. intros u U. apply before_different, F, U.
  - clear - P. induction P as [|y l H P IH]; constructor; [|exact IH].
    eapply Forall_impl; [|exact H]. intros u. apply before_different.
Qed.
Lemma counted {A} (key_of : A -> key) (l : list (option A)) :
  at_least (distinct (keys key_of l)) key_of l.
Proof.
  destruct (distinct_counts (keys key_of l)) as (some & L & I & D). exists some. split; [exact L|].
  split; [|exact D].
  intros u U. specialize (I u U). unfold keys in I.
  assert (G : forall l found, In u (fold_left (fun found x =>
      match x with Some s => key_of s :: found | None => found end) l found) ->
      In u found \/ exists s, In (Some s) l /\ key_of s = u).
  { clear. induction l as [|x l IH]; simpl; intros found H; [auto|].
    destruct x as [s|]; apply IH in H as [H|(t & H & K)].
    - destruct H as [<-|H]; eauto.
    - eauto.
    - auto.
    - eauto. }
  destruct (G l [] I) as [[]|G']. exact G'.
Qed.

(* ---- Shares ---- *)
Lemma share_below part all : share_of part all <> 0%Z ->
  (IZR (share_of part all) * Q2R all <= Q2R part * 100000)%R.
Proof.
  unfold share_of. set (n := (_ / _)%Z). destruct (qle (inject_Z n * all) (part * 100000)) eqn:L;
    [|congruence].
  intros _. apply Qle_bool_iff, Qle_Rle in L. rewrite !Q2R_mult in L.
  replace (Q2R (inject_Z n)) with (IZR n) in L by (unfold Q2R; simpl; rewrite Rinv_1; ring).
  replace (Q2R 100000) with 100000%R in L by (unfold Q2R; simpl; field). exact L.
Qed.

(* ---- What `Accepted` says of the checks ---- *)
Lemma accepted_parts a marks r : check_answer a = Accepted marks r ->
  let P := scene a in let N := net a in let E := around a in let H := hints a in
  context_ok P N E = true /\ each (samples a) (fun s => check_sample P N E H s = true) /\
  each (sets a) (fun s => check_set P N E H s = true) /\ each (corridors a) (fun s =>
    check_sample P N E H s = true) /\
  each (doubts a) (fun s => check_box P N E H s = true) /\
  match absent a with
  | Unclaimed => True | Unread => False
  | Proved p => check_no_plan P N E H p = true | Bracket p => check_proof P N E H p = true
  end /\
  r = Report (distinct (keys key_of_sample (samples a))) (distinct (keys key_of_set (sets a)))
        (distinct (keys key_of_corridor (corridors a))) (distinct (keys key_of_box (doubts a)))
        (finding_of P (absent a)) (length (bins E)) (length (filter (fun B =>
          negb (centred B)) (bins E))).
Proof.
  unfold check_answer. cbv zeta. destruct (context_ok (scene a) (net a) (around a));
    [|discriminate].
  set (marks' := [_; _; _; _; _]). destruct (forallb (forallb (fun ok => ok)) marks') eqn:K;
    [|discriminate].
  intro X. injection X as _ <-. subst marks'. cbn [forallb] in K. rewrite !andb_true_iff in K.
  destruct K as (A & B & C & D & F & _). split; [reflexivity|].
  do 4 (split; [apply all_marked; assumption|]). split; [|reflexivity].
  destruct (absent a); simpl in F; unfold told in F; try discriminate; auto; apply andb_prop
    in F; apply F.
Qed.
