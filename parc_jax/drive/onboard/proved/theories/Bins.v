(* The bin of k that the code finds: comparisons are exact. *)
From Coq Require Import Reals Lra Lia List Arith Bool.
From ParcJax.Onboard Require Import Arithmetic Sums Network Rows Header.
Open Scope R_scope.

Section Bins.
Context {F : arithmetic}.
Variable T : tables F.

Lemma walk_stops (e : nat -> number F) x : forall steps from,
  let to := walk e x steps from in
  (from <= to <= from + steps)%nat /\
  (to = from \/ at_most F (e to) x = true) /\
  (to = (from + steps)%nat \/ at_most F (e (S to)) x = false).
Proof.
  induction steps as [|n IH]; intros from; simpl.
  - repeat split; auto; lia.
  - destruct (at_most F (e (S from)) x) eqn:H.
    + destruct (IH (S from)) as [A [B C]]. repeat split; try lia.
      * right. destruct B as [B|B]; [rewrite B; exact H|exact B].
      * destruct C as [C|C]; [left; lia|right; exact C].
    + repeat split; auto; lia.
Qed.

Lemma bin_along_inside e n x to : (0 < n)%nat -> (forall i, (i <= n)%nat -> finite F (e i)) ->
  bin_along e n x = Some to ->
  finite F x /\ (to < n)%nat /\ value F (e 0%nat) <= value F x <= value F (e n) /\
  (to = 0%nat \/ value F (e to) < value F x) /\
  (S to = n \/ value F x < value F (e (S to))).
Proof.
  intros Hn Fe H. unfold bin_along in H.
  destruct (at_most F (e 0%nat) x) eqn:Lo; simpl in H; [|discriminate].
  destruct (at_most F x (e n)) eqn:Hi; [|discriminate].
  assert (Fx : finite F x).
  { apply (between_is F (e 0%nat) x (e n)); auto; apply Fe; lia. }
  destruct (walk_stops e x (n - 1) 0) as [A [B C]]. set (w := walk e x (n - 1) 0) in *.
  destruct ((0 <? w)%nat && at_most F x (e w)) eqn:Edge; [discriminate|].
  injection H as <-.
  split; [exact Fx|]. split; [lia|]. split; [|split].
  - split; [apply (at_most_is F) in Lo|apply (at_most_is F) in Hi]; auto; apply Fe; lia.
  - destruct B as [B|B]; [left; lia|]. destruct (Nat.eq_dec w 0) as [Z|Z]; [left; exact Z|right].
    assert (P : (0 <? w)%nat = true) by (apply Nat.ltb_lt; lia). rewrite P in Edge. simpl in Edge.
    destruct (Rlt_or_le (value F (e w)) (value F x)) as [L|L]; [exact L|].
    apply (at_most_is F) in L; [congruence|exact Fx|apply Fe; lia].
  - destruct C as [C|C]; [left; lia|].
    destruct (Nat.eq_dec (S w) n) as [Z|Z]; [left; exact Z|right].
    destruct (Rlt_or_le (value F x) (value F (e (S w)))) as [L|L]; [exact L|].
    apply (at_most_is F) in L; [congruence|apply Fe; lia|exact Fx].
Qed.

Lemma bin_of_inside k : forall j bin, (j <= n_k T)%nat -> bin_of T k j = Some bin ->
  exists place, bin_at T place j = bin /\ forall i, (i < j)%nat ->
    bin_along (edge T i) (n_bins T i) (k i) = Some (place i).
Proof.
  induction j as [|j IH]; intros bin Hj H; simpl in H.
  - injection H as <-. exists (fun _ => 0%nat). split; [reflexivity|]. lia.
  - destruct (bin_of T k j) as [b|] eqn:Hb; [|discriminate].
    destruct (bin_along (edge T j) (n_bins T j) (k j)) as [a|] eqn:Ha; [|discriminate].
    injection H as <-. destruct (IH b) as [place [Hat Hp]]; [lia|reflexivity|].
    exists (fun i => if (i =? j)%nat then a else place i). split.
    + simpl. rewrite Nat.eqb_refl. f_equal. f_equal. rewrite <- Hat.
      assert (G : forall m, (m <= j)%nat ->
        bin_at T (fun i => if (i =? j)%nat then a else place i) m = bin_at T place m).
      { induction m as [|m IHm]; intros Hm; simpl; [reflexivity|]. rewrite IHm by lia.
        destruct (m =? j)%nat eqn:E; [apply Nat.eqb_eq in E; lia|reflexivity]. }
      apply G. lia.
    + intros i Hi. simpl. destruct (i =? j)%nat eqn:E.
      * apply Nat.eqb_eq in E. subst. exact Ha.
      * apply Nat.eqb_neq in E. apply Hp. lia.
Qed.

Definition largest_k (j : nat) : R :=
  Rmax (Rabs (value F (edge T j 0))) (Rabs (value F (edge T j (n_bins T j)))).

Lemma bin_close k bin : (forall j, (j < n_k T)%nat -> (0 < n_bins T j)%nat) ->
  (forall j i, (j < n_k T)%nat -> (i <= n_bins T j)%nat -> finite F (edge T j i)) ->
  bin_of T k (n_k T) = Some bin ->
  inside_bin T (values k) bin /\
  forall j, (j < n_k T)%nat -> close (k j) (values k j) 0 (largest_k j).
Proof.
  intros Hb Fe H. destruct (bin_of_inside k (n_k T) bin (le_n _) H) as [place [Hat Hp]].
  assert (In : forall j, (j < n_k T)%nat -> finite F (k j) /\ (place j < n_bins T j)%nat /\
    value F (edge T j 0) <= value F (k j) <= value F (edge T j (n_bins T j)) /\
    (place j = 0%nat \/ value F (edge T j (place j)) < value F (k j)) /\
    (S (place j) = n_bins T j \/ value F (k j) < value F (edge T j (S (place j))))).
  { intros j Hj. apply bin_along_inside; auto. }
  split.
  - exists place. split; [exact Hat|]. intros j Hj. destruct (In j Hj) as [_ Q]. exact Q.
  - intros j Hj. destruct (In j Hj) as [Fk [_ [Q _]]]. split; [exact Fk|]. split.
    + apply close_itself, Fk.
    + unfold largest_k. unfold Rmax, Rabs.
      repeat destruct (Rcase_abs _); repeat destruct (Rle_dec _ _); lra.
Qed.

End Bins.
