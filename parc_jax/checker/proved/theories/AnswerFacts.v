(* What an accepted answer is: every entry was read and is accepted. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker Polytopes Doubt NoPlan Answer ArithmeticFacts.
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
  r = Report (length (samples a)) (length (sets a)) (length (corridors a)) (length (doubts a))
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
