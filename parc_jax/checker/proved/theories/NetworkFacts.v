(* The network: exact at a point, and an affine map wherever all neurons have the signs of a
   pattern. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- At a point ---- *)
Lemma layerR_ext L x y : (forall i, x i = y i) -> forall i, layerR L x i = layerR L y i.
Proof.
  intros H i. unfold layerR. destruct (nth_error L i) as [[w b]|]; [|reflexivity]. f_equal.
  apply dotR_ext. auto.
Qed.
Lemma netR_ext Ls : forall x y, (forall i, x i = y i) -> forall i, netR Ls x i = netR Ls y i.
Proof.
  induction Ls as [|L Ls IH]; intros x y H i; [simpl; auto|]. simpl. destruct Ls as [|L' Ls].
  - apply layerR_ext; auto.
  - apply IH. intro j. unfold reluR. rewrite (layerR_ext L x y H j). reflexivity.
Qed.
Lemma layerQ_R L x i : toR (layerQ L x) i = layerR L (toR x) i.
Proof.
  unfold toR, layerR, layerQ. destruct (nth_error L i) as [[w b]|] eqn:E.
  - rewrite (nth_indep _ _ (qadd (dotQ w x) b)).
    + erewrite map_nth with (d := (w, b)). apply nth_error_nth with (d := (w, b)) in E.
      rewrite E. simpl.
      rewrite R_add, dotQ_R. reflexivity.
    + rewrite map_length. apply nth_error_Some. congruence.
  - rewrite nth_overflow; [apply R0|]. rewrite map_length. apply nth_error_None. exact E.
Qed.
Lemma reluQ_R x i : toR (reluQ x) i = reluR (toR x) i.
Proof.
  unfold toR, reluR, reluQ. destruct (Nat.lt_ge_cases i (length x)) as [H|H].
  - rewrite (nth_indep _ _ ((fun a => if qle 0%Q a then a else 0%Q) 0%Q)) by (rewrite map_length;
      auto).
    rewrite (map_nth (fun a => if qle 0%Q a then a else 0%Q)).
    destruct (qle 0%Q (nth i x 0%Q)) eqn:E.
    + apply R_le in E. rewrite R0 in E. rewrite Rmax_right; lra.
    + apply R_nle in E. rewrite R0 in *. rewrite Rmax_left; lra.
  - rewrite !nth_overflow by (try rewrite map_length; auto). rewrite R0, Rmax_left; lra.
Qed.
Lemma netQ_R Ls : forall x i, toR (netQ Ls x) i = netR Ls (toR x) i.
Proof.
  induction Ls as [|L Ls IH]; intros x i; [reflexivity|]. simpl. destruct Ls as [|L' Ls].
  - apply layerQ_R.
  - rewrite IH. apply netR_ext. intro j. rewrite reluQ_R. unfold reluR. rewrite layerQ_R.
    reflexivity.
Qed.
Lemma net_out Ls : forall w o x, net_ok w Ls o = true -> length (netQ Ls x) = o.
Proof.
  induction Ls as [|L Ls IH]; intros w o x H; simpl in *; [discriminate|].
  apply andb_prop in H as [_ H]. destruct Ls.
  - unfold layerQ. rewrite map_length. apply Nat.eqb_eq. exact H.
  - eapply IH. exact H.
Qed.

(* ---- Under a pattern [T16] ---- *)
Lemma layerA_R (L : layer) X x z w : forallb (fun r => Nat.eqb (length (fst r)) w) L = true ->
  (forall i, (i < w)%nat -> at_forms X x i = z i) -> forall i, at_forms (layerA L X) x i
    = layerR L z i.
Proof.
  intros HL HX i. unfold at_forms, layerA, layerR. destruct (nth_error L i) as [[a b]|] eqn:E.
  - pose proof (map_nth_error (fun r => aadd (lincomb (fst r) X) (aconst (snd r))) _ _ E) as M.
    apply nth_error_nth with (d := aconst 0%Q) in M. rewrite M. simpl.
    rewrite affR_add, affR_const, affR_lincomb. f_equal. apply dotR_ext. intros j Hj. apply HX.
    apply nth_error_In in E. eapply forallb_forall in HL; [|exact E]. apply Nat.eqb_eq in HL.
    simpl in HL. lia.
  - rewrite nth_overflow; [rewrite affR_const; apply R0|]. rewrite map_length.
    apply nth_error_None. exact E.
Qed.
Lemma pass_R bits : forall Z x, length bits = length Z -> (forall r, In r (signs bits Z) ->
  rowR x r) ->
  forall i, (i < length Z)%nat -> at_forms (passA bits Z) x i = Rmax 0 (at_forms Z x i).
Proof.
  unfold at_forms. induction bits as [|b bits IH]; intros [|f Z] x L H i Hi; simpl in *;
    try discriminate; try lia.
  destruct i as [|i].
  - specialize (H _ (or_introl eq_refl)). unfold rowR in H. simpl in H. destruct b.
    + rewrite Rmax_right; lra.
    + rewrite affR_neg in H. rewrite affR_const, R0, Rmax_left; lra.
  - apply IH; auto; lia.
Qed.
Lemma netA_R Ls : forall bits X x z w o, bits_ok Ls bits = true -> net_ok w Ls o = true ->
  (forall i, (i < w)%nat -> at_forms X x i = z i) -> (forall r, In r (fst (netA Ls bits X)) ->
    rowR x r) ->
  (forall i, at_forms (snd (netA Ls bits X)) x i = netR Ls z i) /\
    length (snd (netA Ls bits X)) = o.
Proof.
  induction Ls as [|L Ls IH]; intros bits X x z w o Hb Hn HX Hr; [discriminate|].
  cbn [net_ok] in Hn. apply andb_prop in Hn as [Hw Hn]. destruct Ls as [|L' Ls].
  - simpl. split; [apply (layerA_R L X x z w); auto|]. unfold layerA. rewrite map_length.
    apply Nat.eqb_eq; exact Hn.
  - destruct bits as [|b bits]; [discriminate|]. 
    change (bits_ok (L :: L' :: Ls) (b :: bits)) with (Nat.eqb (length b) (length L) &&
      bits_ok (L' :: Ls) bits) in Hb.
    apply andb_prop in Hb as [Lb Hb]. apply Nat.eqb_eq in Lb.
    change (netR (L :: L' :: Ls) z) with (netR (L' :: Ls) (reluR (layerR L z))).
    change (netA (L :: L' :: Ls) (b :: bits) X) with
      (let (r, Y) := netA (L' :: Ls) bits (passA b (layerA L X)) in (signs b (layerA L X) ++ r, Y))
        in *.
    destruct (netA (L' :: Ls) bits (passA b (layerA L X))) as [r Y] eqn:E. cbn [fst snd] in *.
    specialize (IH bits (passA b (layerA L X)) x (reluR (layerR L z)) (length L) o Hb Hn).
    rewrite E in IH. cbn [fst snd] in IH.
    apply IH; [|intros q Hq; apply Hr, in_or_app; auto]. intros i Hi. unfold reluR.
    assert (length (layerA L X) = length L) as LL by (unfold layerA; apply map_length).
    rewrite pass_R; [rewrite (layerA_R L X x z w Hw HX); reflexivity| lia | intros; apply Hr,
      in_or_app; auto | lia].
Qed.
