(* What is accepted is accepted of something: a bin whose errors may be zero holds the model's own
   trajectory, and the body has a point wherever its reference points are. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts ConditionFacts BinFacts NoPlan
  Trajectories Sanity Theorems.
Import ListNotations.
Open Scope R_scope.

Theorem not_void P N E B u k : context_ok P N E = true -> In B (bins E) -> centred B = true ->
  in_tube P N B u k (model P N u k).
Proof.
  intros HC HB Hc. apply andb_prop in HC as [HP HE]. apply tube_not_empty;
    [apply (problem_inv _ _ HP)|].
  assert (OK : bin_ok P B = true).
  { apply andb_prop in HE as [_ HE]. rewrite forallb_forall in HE. apply HE, HB. }
  destruct (open_bin_intro P B OK Hc) as [_ _ HO _ HF]. split; assumption.
Qed.

(* And no other bin does: a row that excludes the error zero excludes the model at every plan. *)
Lemma zero_allowed_none n E : inError n E (fun _ => 0) -> allows_none E = true.
Proof.
  destruct E as [e|A]; simpl; [reflexivity|]. intro H. apply forallb_forall. intros [a b] Hab.
  apply Qle_bool_iff, Rle_Qle.
  specialize (H a b Hab). rewrite dotR_zero in H. cbn [snd]. rewrite R0. exact H.
Qed.
Theorem model_held P N E B : context_ok P N E = true -> In B (bins E) ->
  (centred B = true <-> forall u k, in_tube P N B u k (model P N u k)).
Proof.
  intros HC HB. split; [intros Hc u k; apply (not_void P N E); assumption|]. intro HT.
  assert (OK : bin_ok P B = true).
  { apply andb_prop in HC as [_ HE]. apply andb_prop in HE as [_ HE]. rewrite forallb_forall in HE.
    apply HE, HB. }
  unfold bin_ok in OK. rewrite !andb_true_iff in OK. destruct OK as ((L & S) & _).
  apply Nat.eqb_eq in L.
  destruct (HT (fun _ => 0) (fun _ => 0)) as [HI HF]. apply andb_true_intro. split.
  - apply forallb_forall. intros Es IE. rewrite forallb_forall in S. specialize (S Es IE).
    apply andb_prop in S as [S _]. apply Nat.eqb_eq in S. apply forallb_forall. intros e Ie.
    destruct (In_nth (interval B) Es [] IE) as (t & Ht & Et). destruct (In_nth Es e (Rows []) Ie)
      as (i & Hi & Ei).
    rewrite L in Ht. rewrite S in Hi. assert (H0 : 0 <= 0 <= 1) by lra.
    specialize (HI t i 0 Ht Hi H0).
    rewrite Et, Ei in HI.
    apply (zero_allowed_none (n_p P)). eapply inError_ext; [|exact HI]. intro a. cbv beta.
    rewrite model_at by exact H0. ring.
  - apply (zero_allowed_none (n_points P * n_p P + n_q P)). eapply inError_ext; [|exact HF].
    intro j. cbv beta.
    apply model_end. apply (problem_inv _ _ (proj1 (andb_prop _ _ HC))).
Qed.

Lemma widths_are_centred B : forallb (forallb has_widths) (interval B) = true ->
  has_widths (final B) = true ->
  centred B = true.
Proof.
  intros H F. apply andb_true_intro. split; [|destruct (final B); [reflexivity|discriminate]].
  apply forallb_forall. intros Es IE. rewrite forallb_forall in H. specialize (H Es IE).
  apply forallb_forall. intros e Ie. rewrite forallb_forall in H. specialize (H e Ie).
  destruct e; [reflexivity|discriminate].
Qed.

(* An accepted sample is about at least one trajectory, and that one succeeds. *)
Corollary sample_of_something P N E H s : context_ok P N E = true ->
  forallb centred (bins E) = true ->
  check_sample P N E H s = true -> let u := toR (sample_p0 s) in let x := toR (sample_k s) in
  exists B, In B (bins E) /\ inBox (box B) x /\ in_tube P N B u x (model P N u x) /\
    succeeds P (model P N u x).
Proof.
  intros HC HZ HK u x. destruct (sample_safe P N E H s HC HK) as [_ (_ & (B & IB & XB) & HS)].
  exists B.
  assert (T : in_tube P N B u x (model P N u x)).
  { apply (not_void P N E); auto. rewrite forallb_forall in HZ. auto. }
  split; [exact IB|]. split; [exact XB|]. split; [exact T|]. apply (HS B IB XB _ T).
Qed.

Lemma shape_not_void n b : shape_ok n b = true -> exists g, inShape n b g.
Proof.
  destruct b as [r|vs]; simpl; intro H.
  - exists (fun _ => 0). rewrite sumsq_zero. apply Rle_0_sqr.
  - apply andb_prop in H as [H _]. destruct vs as [|v vs]; [discriminate|].
    destruct (choose (v :: vs) toR v (or_introl eq_refl)) as (lam & W & M).
    exists (toR v), lam. split; [exact W|]. intros a _. symmetry. apply M.
Qed.

Theorem body_not_void P N E : context_ok P N E = true ->
  parts P <> [] /\ forall b, In b (parts P) -> forall c : nat -> rv, exists x, inPart (n_p P) b c x.
Proof.
  intro HC. apply andb_prop in HC as [HP _].
  assert (A : negb (Nat.eqb (length (parts P)) 0) = true /\ forallb (part_ok P) (parts P) = true).
  { unfold problem_ok in HP. rewrite !andb_true_iff in HP. tauto. }
  destruct A as [A B]. split; [intro K; rewrite K in A; discriminate|].
  intros b Hb c. rewrite forallb_forall in B. specialize (B b Hb). unfold part_ok in B.
  rewrite !andb_true_iff in B.
  destruct B as ((S & L) & _). destruct (shape_not_void _ _ S) as [g G].
  destruct (corners b) as [|i l] eqn:EC; [discriminate|].
  destruct (choose (corners b) c i) as (lam & W & M); [rewrite EC; simpl; auto|].
  exists (fun a => mix lam (map c (corners b)) a + g a), lam, g. auto.
Qed.
