(* Sums of products as a compiler may compute them, and how far off they are: T10 for one neuron. *)
From Coq Require Import Reals Lra Lia List Permutation.
From ParcJax.Onboard Require Import Arithmetic.
Import ListNotations.
Open Scope R_scope.

Section Dot.
Context {F : arithmetic}.

Inductive term :=
| Alone (x : number F)
| Times (a x : number F).

Definition exact (t : term) : R :=
  match t with
  | Alone x => value F x
  | Times a x => value F a * value F x
  end.

Definition known (t : term) : Prop :=
  match t with
  | Alone x => finite F x
  | Times a x => finite F a /\ finite F x
  end.

Definition total (l : list term) : R := fold_right (fun t s => exact t + s) 0 l.
Definition size (l : list term) : R := fold_right (fun t s => Rabs (exact t) + s) 0 l.

(* computes d n l z: z is what some order of sums, each fused with a product or not, may make of the
   terms l; no term passes through more than d roundings, and there are at most n of them. A term
   that is a number needs none, nor does a product with one; what is nothing may be left out. *)
Inductive computes : nat -> nat -> list term -> number F -> Prop :=
| Nothing : computes 0 0 [] (zero F)
| Exact t z : (known t -> finite F z /\ value F z = exact t) -> computes 0 0 [t] z
| Product a x z : product F a x z -> computes 1 1 [Times a x] z
| Sum d n m l r s t z : computes d n l s -> computes d m r t -> sum F s t z ->
    computes (S d) (S (n + m)) (l ++ r) z
| Fused d n a x l s z : computes d n l s -> fused F a x s z ->
    computes (S d) (S n) (Times a x :: l) z
| Skipped d n t l s : computes d n l s -> exact t = 0 -> computes d n (t :: l) s
| Reordered d n l r z : Permutation l r -> computes d n l z -> computes d n r z
| Deeper d n l z : computes d n l z -> computes (S d) n l z
| Dearer d n l z : computes d n l z -> computes d (S n) l z.

(* What n roundings along d deep may lose of terms of a size. *)
Definition lost_by (d n : nat) (s : R) : R := ((1 + u) ^ d - 1) * s + INR n * eta * (1 + u) ^ d.
Definition reach_of (d n : nat) (s : R) : R := (1 + u) ^ d * s + INR n * eta * (1 + u) ^ d.

Lemma size_pos l : 0 <= size l.
Proof. induction l as [|t l IH]; simpl; [lra|]. pose proof (Rabs_pos (exact t)). lra. Qed.

Lemma total_at_most_size l : Rabs (total l) <= size l.
Proof.
  induction l as [|t l IH]; simpl; [rewrite Rabs_R0; lra|].
  eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.

Lemma total_app l r : total (l ++ r) = total l + total r.
Proof. induction l as [|t l IH]; simpl; [lra|]. rewrite IH. lra. Qed.

Lemma size_app l r : size (l ++ r) = size l + size r.
Proof. induction l as [|t l IH]; simpl; [lra|]. rewrite IH. lra. Qed.

Lemma total_permuted l r : Permutation l r -> total l = total r.
Proof. induction 1; simpl; lra. Qed.

Lemma size_permuted l r : Permutation l r -> size l = size r.
Proof. induction 1; simpl; lra. Qed.

(* One rounding more, of something that is off already. *)
Lemma off_once_more q c e off exact_sum sized rounded :
  1 <= q -> Rabs (c - exact_sum) <= (q - 1) * sized + e * q -> Rabs exact_sum <= sized ->
  0 <= e -> near c rounded -> off = eta ->
  Rabs (rounded - exact_sum) <= ((1 + u) * q - 1) * sized + (e + off) * ((1 + u) * q).
Proof.
  intros Hq Hc Hs He Hn ->. unfold near in Hn. pose proof u_pos as Hu. pose proof eta_pos as Ht.
  assert (Hcs : Rabs c <= sized + (q - 1) * sized + e * q).
  { replace c with (exact_sum + (c - exact_sum)) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. lra. }
  replace (rounded - exact_sum) with ((rounded - c) + (c - exact_sum)) by ring.
  eapply Rle_trans; [apply Rabs_triang|].
  assert (u * Rabs c <= u * (sized + (q - 1) * sized + e * q)) by (apply Rmult_le_compat_l; lra).
  assert (0 <= u * q) by nra.
  assert (eta <= eta * ((1 + u) * q)) by nra.
  nra.
Qed.

Lemma tiny_pos d n : 0 <= INR n * eta * (1 + u) ^ d.
Proof.
  pose proof (grown_once d). pose proof eta_pos.
  apply Rmult_le_pos; [apply Rmult_le_pos; [apply pos_INR|]|]; lra.
Qed.

Lemma fits d n s : 0 <= s -> reach_of d n s <= reach_of (S d) n s.
Proof.
  intros Hs. unfold reach_of. simpl.
  pose proof (grown_once d). pose proof u_pos. pose proof eta_pos. pose proof (pos_INR n).
  assert ((1 + u) ^ d <= (1 + u) * (1 + u) ^ d) by nra.
  apply Rplus_le_compat.
  - apply Rmult_le_compat_r; lra.
  - apply Rmult_le_compat_l; [apply Rmult_le_pos; lra|lra].
Qed.

Lemma reach_more d n m s r : (n <= m)%nat -> s <= r -> reach_of d n s <= reach_of d m r.
Proof.
  intros Hn Hs. unfold reach_of. pose proof (grown_once d). pose proof eta_pos.
  apply le_INR in Hn. apply Rplus_le_compat.
  - apply Rmult_le_compat_l; lra.
  - apply Rmult_le_compat_r; [lra|]. apply Rmult_le_compat_r; lra.
Qed.

Lemma reach_pos d n s : 0 <= s -> 0 <= reach_of d n s.
Proof.
  intros Hs. pose proof (reach_more d 0 n 0 s (Nat.le_0_l n) Hs) as More.
  unfold reach_of at 1 in More. simpl in More. lra.
Qed.

Lemma lost_deeper d n s : 0 <= s -> lost_by d n s <= lost_by (S d) n s.
Proof. intros Hs. pose proof (fits d n s Hs). unfold lost_by, reach_of in *. lra. Qed.

Lemma lost_more d n s r : s <= r -> lost_by d n s <= lost_by d n r.
Proof.
  intros Hs. unfold lost_by. pose proof (grown_once d).
  apply Rplus_le_compat_r. apply Rmult_le_compat_l; lra.
Qed.

Lemma lost_is_reach d n s : lost_by d n s + s = reach_of d n s.
Proof. unfold lost_by, reach_of. ring. Qed.

(* [T10] for one sum. *)
Theorem computed_near : forall d n l z, computes d n l z -> Forall known l ->
  reach_of d n (size l) <= largest ->
  finite F z /\ Rabs (value F z - total l) <= lost_by d n (size l).
Proof.
  intros d n l z H. pose proof u_pos as Hu. pose proof eta_pos as Ht.
  induction H as [ | t z Hz | a x z Hz | d n m l r s t z Hl IHl Hr IHr Hz | d n a x l s z Hl IHl Hz
                 | d n t l s Hl IHl Hx | d n l r z Hp Hl IHl | d n l z Hl IHl | d n l z Hl IHl];
    intros K B.
  - destruct (zero_is F) as [Hf Hv]. split; [exact Hf|].
    unfold lost_by; simpl. rewrite Hv, Rminus_0_r, Rabs_R0. lra.
  - apply Forall_cons_iff in K as [Kt _]. destruct (Hz Kt) as [Fz Vz]. split; [exact Fz|].
    unfold lost_by; simpl. rewrite Vz, Rplus_0_r, Rminus_diag_eq by reflexivity.
    rewrite Rabs_R0. lra.
  - apply Forall_cons_iff in K as [[Ka Kx] _]. unfold reach_of in B; simpl in B.
    pose proof (Rabs_pos (value F a * value F x)).
    destruct (product_is F a x z Ka Kx) as [Hf Hn]; [nra|exact Hz|]. split; [exact Hf|].
    unfold near in Hn. unfold lost_by; simpl. rewrite Rplus_0_r. nra.
  - apply Forall_app in K as [Kl Kr].
    pose proof (size_pos l) as Pl. pose proof (size_pos r) as Pr. rewrite size_app in B.
    assert (Bl : reach_of d n (size l) <= largest).
    { eapply Rle_trans; [apply fits; lra|]. eapply Rle_trans; [|exact B].
      apply reach_more; [lia|lra]. }
    assert (Br : reach_of d m (size r) <= largest).
    { eapply Rle_trans; [apply fits; lra|]. eapply Rle_trans; [|exact B].
      apply reach_more; [lia|lra]. }
    destruct (IHl Kl Bl) as [Fs Es]. destruct (IHr Kr Br) as [Ft Et].
    assert (Ec : Rabs ((value F s + value F t) - total (l ++ r))
                 <= lost_by d (n + m) (size l + size r)).
    { rewrite total_app.
      replace (value F s + value F t - (total l + total r))
        with ((value F s - total l) + (value F t - total r)) by ring.
      eapply Rle_trans; [apply Rabs_triang|].
      unfold lost_by in *. rewrite plus_INR. lra. }
    pose proof (total_at_most_size (l ++ r)) as Ts. rewrite size_app in Ts.
    assert (Bc : Rabs (value F s + value F t) <= largest).
    { replace (value F s + value F t)
        with (value F s + value F t - total (l ++ r) + total (l ++ r)) by ring.
      eapply Rle_trans; [apply Rabs_triang|].
      apply Rle_trans with (reach_of d (n + m) (size l + size r)).
      - rewrite <- lost_is_reach. lra.
      - eapply Rle_trans; [apply fits; lra|]. eapply Rle_trans; [|exact B].
        apply reach_more; [lia|lra]. }
    destruct (sum_is F s t z Fs Ft Bc Hz) as [Fz Nz]. split; [exact Fz|].
    rewrite size_app. unfold lost_by in *. rewrite S_INR. simpl pow.
    replace ((INR (n + m) + 1) * eta * ((1 + u) * (1 + u) ^ d))
      with ((INR (n + m) * eta + eta) * ((1 + u) * (1 + u) ^ d)) by ring.
    eapply off_once_more; eauto using grown_once.
    apply Rmult_le_pos; [apply pos_INR|lra].
  - apply Forall_cons_iff in K as [[Ka Kx] Kl]. simpl size in B.
    pose proof (size_pos l) as Pl. pose proof (Rabs_pos (value F a * value F x)) as Pa.
    assert (Bl : reach_of d n (size l) <= largest).
    { eapply Rle_trans; [apply fits; lra|]. eapply Rle_trans; [|exact B].
      apply reach_more; [lia|lra]. }
    destruct (IHl Kl Bl) as [Fs Es].
    assert (Ec : Rabs ((value F a * value F x + value F s) - total (Times a x :: l))
                 <= lost_by d n (size (Times a x :: l))).
    { simpl. replace (value F a * value F x + value F s - (value F a * value F x + total l))
        with (value F s - total l) by ring.
      eapply Rle_trans; [exact Es|]. apply lost_more. lra. }
    pose proof (total_at_most_size (Times a x :: l)) as Ts.
    assert (Bc : Rabs (value F a * value F x + value F s) <= largest).
    { replace (value F a * value F x + value F s)
        with (value F a * value F x + value F s - total (Times a x :: l) + total (Times a x :: l))
        by ring.
      eapply Rle_trans; [apply Rabs_triang|].
      apply Rle_trans with (reach_of d n (size (Times a x :: l))).
      - rewrite <- lost_is_reach. lra.
      - eapply Rle_trans; [apply fits; simpl; lra|]. eapply Rle_trans; [|exact B].
        apply reach_more; [lia|simpl; lra]. }
    destruct (fused_is F a x s z Ka Kx Fs Bc Hz) as [Fz Nz]. split; [exact Fz|].
    unfold lost_by in *. rewrite S_INR. simpl pow.
    replace ((INR n + 1) * eta * ((1 + u) * (1 + u) ^ d))
      with ((INR n * eta + eta) * ((1 + u) * (1 + u) ^ d)) by ring.
    eapply off_once_more; eauto using grown_once.
    apply Rmult_le_pos; [apply pos_INR|lra].
  - apply Forall_cons_iff in K as [_ Kl]. simpl in *.
    rewrite Hx, Rabs_R0, Rplus_0_l in *. rewrite Rplus_0_l. apply IHl; assumption.
  - rewrite <- (size_permuted l r Hp) in *. rewrite <- (total_permuted l r Hp).
    apply IHl; [|exact B]. eapply Permutation_Forall; [apply Permutation_sym; exact Hp|exact K].
  - destruct IHl as [Hf He]; [exact K| |].
    + eapply Rle_trans; [apply fits, size_pos|exact B].
    + split; [exact Hf|]. eapply Rle_trans; [exact He|]. apply lost_deeper, size_pos.
  - pose proof (reach_more d n (S n) (size l) (size l) (le_S _ _ (le_n n)) (Rle_refl _)) as More.
    destruct IHl as [Hf He]; [exact K|lra|]. rewrite <- !lost_is_reach in More.
    split; [exact Hf|]. lra.
Qed.

End Dot.
Arguments term : clear implicits.
