(* The loops of the code, step after step, are among the sums that the theorem is about; each step
   may be fused or not, by itself. So is the shorter loop of a tube of boxes. *)
From Coq Require Import Reals Lra Lia List PeanoNat Permutation.
From ParcJax.Onboard Require Import Arithmetic Dot Sums Network Rows Tube.
Import ListNotations.

Section Loop.
Context {F : arithmetic}.

(* to += a * x; with x == 0.0 the network's loop goes on at once. *)
Inductive step (a x s : number F) : number F -> Prop :=
| Apart p z : product F a x p -> sum F s p z -> step a x s z
| Together z : fused F a x s z -> step a x s z
| Zero : value F x = 0%R -> step a x s s.

Inductive loop (a x : nat -> number F) : nat -> number F -> number F -> Prop :=
| Begin s : loop a x 0 s s
| Next n s t z : loop a x n s t -> step (a n) (x n) t z -> loop a x (S n) s z.

Lemma deeper d e n l z : (d <= e)%nat -> computes (F := F) d n l z -> computes e n l z.
Proof. induction 1; auto using Deeper. Qed.

Lemma products_next n (a x : nat -> number F) :
  products (S n) a x = products n a x ++ [Times (a n) (x n)].
Proof. unfold products. rewrite seq_S, map_app. reflexivity. Qed.

Lemma loop_computes l a x n s z : computes 0 0 l s -> loop a x n s z ->
  computes (S n) (2 * n) (l ++ products n a x) z.
Proof.
  intros Hs H. induction H as [s|n s t z H IH St].
  - simpl. rewrite app_nil_r. apply Deeper, Hs.
  - specialize (IH Hs). rewrite products_next, app_assoc.
    replace (2 * S n)%nat with (S (2 * n + 1)) by lia.
    destruct St as [p z Hp Hz|z Hz|Hx].
    + apply (Sum (S n) (2 * n) 1 _ _ t p); auto. apply (deeper 1); [lia|]. apply Product, Hp.
    + apply Reordered with (Times (a n) (x n) :: l ++ products n a x).
      * apply Permutation_cons_append.
      * rewrite Nat.add_1_r. apply (Fused (S n) (S (2 * n)) _ _ _ t); auto. apply Dearer, IH.
    + apply Reordered with (Times (a n) (x n) :: l ++ products n a x).
      * apply Permutation_cons_append.
      * rewrite Nat.add_1_r. apply Deeper, Skipped; [do 2 apply Dearer; exact IH|].
        simpl. rewrite Hx. ring.
Qed.

(* value = 0.0, then every step. *)
Theorem row_in_turn n a x z : loop a x n (zero F) z -> row_gives n a x z.
Proof. apply (loop_computes []), Nothing. Qed.

(* to[i] = bias[i], then every step. *)
Theorem neuron_in_turn (L : layer F) i x z :
  loop (weight L i) x (n_in L) (bias L i) z ->
  computes (S (n_in L)) (2 * n_in L) (Alone (bias L i) :: products (n_in L) (weight L i) x) z.
Proof.
  apply (loop_computes [Alone (bias L i)]), Exact. intros Known. split; [exact Known|reflexivity].
Qed.

(* ---- A box: far += half[c] * |w[c]|. ---- *)

(* A basis of the axes about no error. *)
Definition box (n : nat) (B : basis F) : Prop := forall j, (j < n)%nat -> value F (centre B j) = 0%R
  /\ forall c, (c < n)%nat -> value F (dual B j c) = if (c =? j)%nat then 1%R else 0%R.

Lemma dearer d n m l z : (n <= m)%nat -> computes (F := F) d n l z -> computes d m l z.
Proof. induction 1; auto using Dearer. Qed.

Lemma skipped d n l r z : (forall t, In t l -> exact t = 0%R) ->
  computes (F := F) d n r z -> computes d n (l ++ r) z.
Proof.
  intros Zero Hr. induction l as [|t l IH]; simpl; [exact Hr|].
  apply Skipped; [apply IH|apply Zero; left; reflexivity].
  intros s Hs. apply Zero. right. exact Hs.
Qed.

Lemma axis_gives n (B : basis F) (w : nat -> number F) j : box n B -> (j < n)%nat ->
  row_gives n (dual B j) w (w j).
Proof.
  intros Box Hj. destruct (Box j Hj) as [_ Dual].
  apply (deeper 0); [lia|]. apply (dearer 0 0); [lia|]. unfold products.
  destruct (in_split j (seq 0 n)) as [l [r Split]]; [apply in_seq; lia|].
  assert (Once : NoDup (l ++ j :: r)) by (rewrite <- Split; apply seq_NoDup).
  assert (Below : forall c, In c (l ++ j :: r) -> (c < n)%nat).
  { intros c Hc. rewrite <- Split in Hc. apply in_seq in Hc. lia. }
  rewrite Split.
  set (product c := Times (dual B j c) (w c)).
  apply Reordered with (map product (l ++ r) ++ [product j]).
  - change [product j] with (map product [j]). rewrite <- map_app.
    apply Permutation_map. rewrite <- app_assoc. apply Permutation_app_head, Permutation_sym, Permutation_cons_append.
  - apply skipped.
    + intros t Ht. apply in_map_iff in Ht as [c [<- Hc]]. simpl.
      rewrite Dual by (apply Below; apply in_app_or in Hc as [Hc|Hc]; apply in_or_app;
        [left|right; right]; exact Hc).
      destruct (Nat.eqb_spec c j) as [->|_]; [|ring].
      apply NoDup_remove_2 in Once. contradiction.
    + apply Exact. intros [_ Known]. split; [exact Known|]. simpl.
      rewrite Dual, Nat.eqb_refl by exact Hj. ring.
Qed.

Lemma turns_permuted n (a b x y : nat -> number F) : Permutation
  (products n a x ++ products n b y) (products (2 * n) (in_turn a b) (in_turn x y)).
Proof.
  induction n as [|n IH]; [apply perm_nil|].
  replace (2 * S n)%nat with (S (S (2 * n))) by lia.
  rewrite !products_next, !turn_even, !turn_odd, <- !app_assoc.
  rewrite <- IH, <- app_assoc. apply Permutation_app_head.
  rewrite !app_assoc. apply Permutation_app_tail, Permutation_app_comm.
Qed.

Theorem box_in_turn n (B : basis F) (w : nat -> number F) far : box n B ->
  row_gives n (half B) (fun c => size_of (w c)) far -> reaches n w B far.
Proof.
  intros Box Far. exists w. split; [intros j Hj; apply axis_gives; assumption|].
  apply (Reordered _ _ _ _ _ (turns_permuted _ _ _ _ _)). apply skipped.
  - intros t Ht. apply in_map_iff in Ht as [j [<- Hj]]. apply in_seq in Hj. simpl.
    destruct (Box j) as [-> _]; [lia|]. ring.
  - apply (deeper (S n)); [lia|]. apply (dearer _ (2 * n)); [lia|]. exact Far.
Qed.

End Loop.
