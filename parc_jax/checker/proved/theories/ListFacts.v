(* Lists: what the library does not have. *)
From Coq Require Import List Arith Lia.
Import ListNotations.

Lemma last_default {A} (e : list A) : forall b d d', List.last (b :: e) d = List.last (b :: e) d'.
Proof. induction e as [|c e IH]; intros b d d'; [reflexivity|]. apply (IH c). Qed.
Lemma nth_flat {A} (L : list (list A)) G : forall i b, nth_error (flat_map (fun I : A =>
  map (cons I) L) G) i = Some b ->
  exists g l I b', nth_error G g = Some I /\ nth_error L l = Some b' /\ b = I :: b' /\
    i = (g * length L + l)%nat.
Proof.
  induction G as [|I G IH]; intros i b H; simpl in H; [destruct i; discriminate|].
  destruct (Nat.lt_ge_cases i (length L)) as [C|C].
  - rewrite nth_error_app1 in H by (rewrite map_length; exact C). rewrite nth_error_map in H.
    destruct (nth_error L i) as [b'|] eqn:E; [|discriminate]. injection H as <-.
    exists O, i, I, b'. auto.
  - rewrite nth_error_app2 in H by (rewrite map_length; exact C). rewrite map_length in H.
    destruct (IH _ _ H) as (g & l & I' & b' & X & Y & Z & W). exists (S g), l, I', b'.
    repeat split; auto. simpl. lia.
Qed.
Lemma combine_nth_error {A B} (l : list A) : forall (m : list B) i a b,
  nth_error (combine l m) i = Some (a, b) -> nth_error l i = Some a.
Proof.
  induction l as [|x l IH]; intros [|y m] i a b H; simpl in H; try (destruct i; discriminate).
  destruct i as [|i]; simpl in *; [injection H as <- <-; reflexivity|eapply IH; exact H].
Qed.
Lemma combine_ex {A B} (l : list A) : forall (m : list B) x, (length l <= length m)%nat -> In x l ->
  exists y, In (x, y) (combine l m).
Proof.
  induction l as [|a l IH]; intros [|b m] x Hl Hin; simpl in *; try contradiction; try lia.
  destruct Hin as [->|Hin]; [eauto|]. destruct (IH m x ltac:(lia) Hin) as [y ?]. eauto.
Qed.
Lemma nth_firstn_lt {A} (d : A) : forall n l i, (i < n)%nat -> nth i (firstn n l) d = nth i l d.
Proof. induction n; intros [|a l] [|i] H; simpl; auto; try lia. apply IHn; lia. Qed.
Lemma nth_skipn' {A} (d : A) : forall n l i, nth i (skipn n l) d = nth (n + i) l d.
Proof. induction n; intros [|a l] i; simpl; auto. destruct i; reflexivity. Qed.
Lemma skipn_two {A} a : forall b (l : list A), skipn a (skipn b l) = skipn (b + a) l.
Proof. induction b; intros; simpl; [reflexivity|]. destruct l; [apply skipn_nil|apply IHb]. Qed.
Lemma nth_concat {A} (d : A) n : forall (L : list (list A)) j, (0 < n)%nat -> (forall l, In l L ->
  length l = n) ->
  (j < length L * n)%nat -> nth j (concat L) d = nth (j mod n) (nth (j / n) L []) d.
Proof.
  induction L as [|l L IH]; intros j Hn HL Hj; simpl in Hj; [lia|]. cbn [concat].
  pose proof (HL l (or_introl eq_refl)) as Ll. destruct (Nat.lt_ge_cases j n) as [C|C].
  - rewrite app_nth1 by lia. rewrite Nat.mod_small, Nat.div_small by lia. reflexivity.
  - rewrite app_nth2 by lia. rewrite Ll, IH; [|exact Hn|intros; apply HL; simpl; auto|lia].
    replace j with (j - n + 1 * n)%nat at 3 4 by lia. rewrite Nat.mod_add, Nat.div_add by lia.
    replace (((j - n) / n) + 1)%nat with (S ((j - n) / n)) by lia. reflexivity.
Qed.
Lemma concat_len {A} n (L : list (list A)) : (forall l, In l L -> length l = n) ->
  length (concat L) = (length L * n)%nat.
Proof. induction L as [|l L IH]; intro H; simpl; [reflexivity|]. rewrite app_length, IH, (H l);
  simpl; auto. intros; apply H; simpl; auto. Qed.
Lemma in_numbered {A} (l : list A) : forall s i a, nth_error l i = Some a ->
  In ((s + i)%nat, a) (combine (seq s (length l)) l).
Proof.
  induction l as [|x l IH]; intros s [|i] a H; simpl in *; try discriminate.
  - injection H as ->. left. f_equal. lia.
  - right. replace (s + S i)%nat with (S s + i)%nat by lia. apply IH. exact H.
Qed.
Lemma filter_le {A} (f g : A -> bool) l : (forall a, f a = true -> g a = true) ->
  (length (filter f l) <= length (filter g l))%nat.
Proof.
  intro H. induction l as [|a l IH]; simpl; [lia|]. specialize (H a).
  destruct (f a); [rewrite H by reflexivity; simpl; lia|]. destruct (g a); simpl; lia.
Qed.
