(* The rows of a polytope at its inner point are those of the numbers there. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker Polytopes ArithmeticFacts ConditionFacts.
Import ListNotations.
Open Scope R_scope.

Section Alike.
Variables x y : rv.
Definition alike (f g : aff) : Prop := affR f x = affR g y.
Definition rows_alike (q r : row) : Prop := fst q = fst r /\ alike (snd q) (snd r).

Lemma all_firstn {A B} (R : A -> B -> Prop) n : forall l m, Forall2 R l m ->
  Forall2 R (firstn n l) (firstn n m).
Proof. induction n; intros l m H; simpl; [constructor|]. destruct H; constructor; auto. Qed.
Lemma all_skipn {A B} (R : A -> B -> Prop) n : forall l m, Forall2 R l m ->
  Forall2 R (skipn n l) (skipn n m).
Proof. induction n; intros l m H; simpl; [exact H|]. destruct H; [constructor|auto]. Qed.
Lemma all_nth {A B} (R : A -> B -> Prop) a b n : R a b -> forall l m, Forall2 R l m ->
  R (nth n l a) (nth n m b).
Proof.
  intro D. induction n; intros l m H; destruct H; simpl; auto.
Qed.
Lemma all_mapped {A B C} (R : B -> C -> Prop) (f : A -> B) g l : (forall a, R (f a) (g a)) ->
  Forall2 R (map f l) (map g l).
Proof. intro H. induction l; simpl; constructor; auto. Qed.
Lemma all_joined {A B C} (R : B -> C -> Prop) (f : A -> list B) g l :
  (forall a, Forall2 R (f a) (g a)) -> Forall2 R (flat_map f l) (flat_map g l).
Proof. intro H. induction l; simpl; [constructor|]. apply Forall2_app; auto. Qed.
Lemma all_concat {A B} (R : A -> B -> Prop) l m : Forall2 (Forall2 R) l m ->
  Forall2 R (concat l) (concat m).
Proof. induction 1; simpl; [constructor|]. apply Forall2_app; assumption. Qed.

Lemma const_alike d : alike (aconst d) (aconst d).
Proof. unfold alike. rewrite !affR_const. reflexivity. Qed.
Lemma add_alike f g f' g' : alike f g -> alike f' g' -> alike (aadd f f') (aadd g g').
Proof. unfold alike. rewrite !affR_add. congruence. Qed.
Lemma scale_alike a f g : alike f g -> alike (ascale a f) (ascale a g).
Proof. unfold alike. rewrite !affR_scale. congruence. Qed.
Lemma lincomb_alike w : forall X Y, Forall2 alike X Y -> alike (lincomb w X) (lincomb w Y).
Proof.
  induction w as [|a w IH]; intros X Y H; [apply const_alike|].
  destruct H; simpl; [apply const_alike|]. apply add_alike; [apply scale_alike; assumption|auto].
Qed.
Lemma zadd_alike X X' : Forall2 alike X X' -> forall Y Y', Forall2 alike Y Y' ->
  Forall2 alike (zadd X Y) (zadd X' Y').
Proof.
  induction 1; intros Y Y' H'; simpl; [constructor|]. destruct H'; constructor; [|auto].
  apply add_alike; assumption.
Qed.
Lemma layer_alike L X Y : Forall2 alike X Y -> Forall2 alike (layerA L X) (layerA L Y).
Proof.
  intro H. apply all_mapped. intro r. apply add_alike; [apply lincomb_alike, H|apply const_alike].
Qed.
Lemma pass_alike bits : forall X Y, Forall2 alike X Y ->
  Forall2 alike (passA bits X) (passA bits Y).
Proof.
  induction bits as [|b bits IH]; intros X Y H; simpl; [constructor|].
  destruct H; constructor; [|auto]. destruct b; [assumption|apply const_alike].
Qed.
Lemma signs_alike bits : forall X Y, Forall2 alike X Y ->
  Forall2 rows_alike (signs bits X) (signs bits Y).
Proof.
  induction bits as [|b bits IH]; intros X Y H; simpl; [constructor|].
  destruct H; constructor; [|auto]. split; [reflexivity|]. simpl.
  destruct b; [assumption|apply scale_alike; assumption].
Qed.
Lemma net_alike Ls : forall bits X Y, Forall2 alike X Y ->
  Forall2 rows_alike (fst (netA Ls bits X)) (fst (netA Ls bits Y)) /\
  Forall2 alike (snd (netA Ls bits X)) (snd (netA Ls bits Y)).
Proof.
  induction Ls as [|L Ls IH]; intros bits X Y H; [split; [constructor|exact H]|].
  destruct Ls as [|L' Ls]; [split; [constructor|apply layer_alike, H]|].
  set (Z := layerA L X). set (Z' := layerA L Y).
  assert (HZ : Forall2 alike Z Z') by (apply layer_alike, H).
  specialize (IH (tl bits) _ _ (pass_alike (hd [] bits) Z Z' HZ)).
  change (netA (L :: L' :: Ls) bits X) with
    (let (r, W) := netA (L' :: Ls) (tl bits) (passA (hd [] bits) Z) in
     (signs (hd [] bits) Z ++ r, W)).
  change (netA (L :: L' :: Ls) bits Y) with
    (let (r, W) := netA (L' :: Ls) (tl bits) (passA (hd [] bits) Z') in
     (signs (hd [] bits) Z' ++ r, W)).
  destruct (netA (L' :: Ls) (tl bits) (passA (hd [] bits) Z)),
    (netA (L' :: Ls) (tl bits) (passA (hd [] bits) Z')). simpl in *.
  split; [apply Forall2_app; [apply signs_alike, HZ|apply IH]|apply IH].
Qed.

(* what is above zero at x *)
Definition above (r : row) : Prop := 0 < affR (snd r) x.

(* ---- The conditions ---- *)
Lemma all_chunk {A B} (R : A -> B -> Prop) n T : forall Y Y', Forall2 R Y Y' ->
  Forall2 (Forall2 R) (chunk n T Y) (chunk n T Y').
Proof.
  induction T; intros Y Y' H; simpl; constructor; [apply all_firstn, H|apply IHT, all_skipn, H].
Qed.
Lemma padded_alike P Y Y' : Forall2 alike Y Y' -> Forall2 alike (padded P Y) (padded P Y').
Proof.
  intro H. apply Forall2_app; [|exact H]. induction (n_p P); simpl; constructor;
    [apply const_alike|assumption].
Qed.
Lemma never_alike : rows_alike never never.
Proof. split; [reflexivity|apply const_alike]. Qed.
Lemma below_alike A bound Z Z' : Forall2 alike Z Z' ->
  Forall2 rows_alike (below A bound Z) (below A bound Z').
Proof.
  intro H. apply all_mapped. intros (i & a & b). destruct (bound i a); [|apply never_alike].
  split; [reflexivity|]. apply add_alike; [apply const_alike|].
  apply scale_alike, lincomb_alike, H.
Qed.
Lemma apart_alike w h Z Z' : Forall2 alike Z Z' -> rows_alike (apart w h Z) (apart w h Z').
Proof.
  intro H. split; [reflexivity|]. apply add_alike; [apply lincomb_alike, H|apply const_alike].
Qed.
Lemma conditions_alike P ds B H X X' Y Y' : Forall2 alike X X' -> Forall2 alike Y Y' ->
  Forall2 rows_alike (conditions P ds B H X Y) (conditions P ds B H X' Y').
Proof.
  intros HX HY. unfold conditions.
  assert (HK : Forall2 (Forall2 alike) (places P X Y) (places P X' Y')).
  { unfold places. pose proof (all_chunk alike (n_p P) (S (steps P) * n_points P) _ _
      (padded_alike P Y Y' HY)) as HC.
    induction HC; simpl; constructor; [apply zadd_alike; assumption|assumption]. }
  apply Forall2_app; [apply below_alike, HX|]. apply Forall2_app.
  - apply below_alike. unfold endA. apply Forall2_app.
    + apply all_concat, all_firstn, all_skipn, HK.
    + apply all_firstn, all_skipn, padded_alike, HY.
  - apply all_joined. intros (b & d). apply all_joined. intro t. simpl.
    destruct (dir_at d t) as [[w h]|]; [|constructor; [apply never_alike|constructor]].
    apply all_joined. intro i. unfold clear_at.
    destruct (reach _ _ _); [|constructor; [apply never_alike|constructor]].
    constructor; [|constructor; [|constructor]]; apply apart_alike, all_nth;
      solve [constructor|exact HK].
Qed.
End Alike.

(* ---- What is clearly inside is inside ---- *)
Lemma units_alike v l n : forall a, length l = n ->
  (forall i, (i < n)%nat -> nth i l 0%Q = nth (a + i) v 0%Q) ->
  Forall2 (alike (toR v) (toR [])) (map unit_form (seq a n)) (map aconst l).
Proof.
  revert l. induction n as [|n IH]; intros [|q l] a L H; try discriminate; simpl; [constructor|].
  constructor.
  - unfold alike. rewrite unit_R, affR_const. unfold toR. specialize (H O ltac:(lia)).
    simpl in H. rewrite Nat.add_0_r in H. congruence.
  - apply IH; [injection L as L; exact L|]. intros i Hi. specialize (H (S i) ltac:(lia)).
    simpl in H. rewrite H. f_equal. lia.
Qed.
Lemma above_inside v rs qs : Forall2 (rows_alike (toR v) (toR [])) rs qs ->
  Forall (above (toR [])) qs -> forallb (insideQ v) rs = true.
Proof.
  induction 1 as [|r q rs qs [S V] _ IH]; intro H; [reflexivity|].
  inversion H as [|? ? A HS]. subst.
  simpl. rewrite IH by exact HS. rewrite andb_true_r.
  destruct r as [strict [c d]], q as [strict' [c' d']]. unfold above, alike in *. simpl in *.
  rewrite <- V in A. unfold affR in A. simpl in A. clear S V H HS IH.
  assert (L : qlt 0 (qadd (dotQ c v) d) = true).
  { unfold qlt. apply negb_true_iff. destruct (Qle_bool _ _) eqn:E; [|reflexivity].
    apply R_le in E. rewrite R0, R_add, dotQ_R in E. lra. }
  unfold insideQ, holdsQ. simpl. destruct strict; simpl; [exact L|].
  destruct (nonzero c); [exact L|]. apply R_lt in L. rewrite R0 in L. apply le_complete.
  rewrite R0. lra.
Qed.
