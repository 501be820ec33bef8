(* The loops of the code, step after step, are among the sums that the theorem is about; each step
   may be fused or not, by itself. *)
From Coq Require Import Reals Lia List PeanoNat Permutation.
Require Import Arithmetic Dot Network Header.
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
      * rewrite Nat.add_1_r. apply Deeper, Skipped; auto. do 2 apply Dearer. exact IH.
Qed.

(* value = 0.0, then every step. *)
Theorem row_in_turn n a x z : loop a x n (zero F) z -> row_gives n a x z.
Proof. apply (loop_computes []), Nothing. Qed.

(* to[i] = bias[i], then every step. *)
Theorem neuron_in_turn (L : layer F) i x z :
  loop (weight L i) x (n_in L) (bias L i) z ->
  computes (S (n_in L)) (2 * n_in L) (Alone (bias L i) :: products (n_in L) (weight L i) x) z.
Proof. apply (loop_computes [Alone (bias L i)]), Number. Qed.

End Loop.
