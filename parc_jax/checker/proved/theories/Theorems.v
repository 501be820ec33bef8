(* The theorems: what `true` from the checker means.  Read with Spec.v. *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker Polytopes ArithmeticFacts NetworkFacts
  SeparationFacts BinFacts ConditionFacts ListFacts Integers IntegerFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Corridors and samples ---- *)

(* What a corridor with directions sep stands for: all real (u, x) that meet, in every closed bin
   that contains x, the conditions which a sample with these directions is asked (conditionsR in
   ConditionFacts.v). *)
Definition in_corridor P N E H sep (u x : rv) : Prop :=
  inBox (domain P) x /\
  forall B h, In (B, h) (hinted E H) -> inBox (box B) x -> conditionsR P (dirs_of P sep) B h
    u (netR N x).

Lemma in_corridor_safe P N E H sep u x : context_ok P N E = true -> sep_ok P sep = true ->
  in_corridor P N E H sep u x -> safe P N E u x.
Proof.
  intros HC HS [Hx Hc]. apply andb_prop in HC as [HP HE].
  destruct (every_k_has_a_bin P E x HE Hx) as (B0 & I0 & X0). split; [|split; [eauto|]].
  - destruct (hinted_ex E H B0 I0) as [h Hh]. apply (Hc B0 h Hh X0).
  - intros B HB Hb. destruct (hinted_ex E H B HB) as [h Hh].
    apply (conditions_succeed P N sep B h u x HP HS). apply Hc; assumption.
Qed.
Lemma sample_in_corridor P N E H s : context_ok P N E = true -> check_sample P N E H s = true ->
  sep_ok P (sample_sep s) = true /\ in_corridor P N E H (sample_sep s) (toR (sample_p0 s))
    (toR (sample_k s)).
Proof.
  intros HC HK. apply andb_prop in HC as [HP HE]. unfold check_sample in HK.
  rewrite !andb_true_iff in HK.
  destruct HK as ((((Lp & Lk) & Hk) & Hs) & HK). apply Nat.eqb_eq in Lp, Lk.
  pose proof (problem_inv _ _ HP) as SP. split; [exact Hs|]. split; [apply inBox_R; exact Hk|].
  intros B h HB Hx.
  eapply forallb_forall in HK.
  2: { apply filter_In. split; [exact HB|]. cbn [fst]. apply inBox_complete; [|exact Hx].
       apply in_combine_l, zip3_box, boxes_len in HB. apply tube_inv in HE as (C & _).
       apply covers_len in C.
       pose proof (domain_size _ _ SP). congruence. }
  cbn [fst snd] in HK.
  apply (conditions_R P N (map aconst (sample_p0 s)) (map aconst (netQ N (sample_k s))) (toR []));
    auto.
  - intros i _. apply at_const.
  - intros i _. rewrite at_const. apply netQ_R.
  - rewrite map_length. exact Lp.
  - rewrite map_length. eapply net_out, net_sizes, SP.
  - intros r Hr. apply holds_R. rewrite conditions_on_is in HK. eapply forallb_forall in HK; eauto.
  - intros b d w g t Hb Hd. eapply dirs_valid; eauto.
Qed.

Theorem sample_safe P N E H s : context_ok P N E = true -> check_sample P N E H s = true ->
  inBox (domain P) (toR (sample_k s)) /\ safe P N E (toR (sample_p0 s)) (toR (sample_k s)).
Proof.
  intros HC HK. destruct (sample_in_corridor _ _ _ _ _ HC HK) as [HS HI].
  split; [apply HI|eapply in_corridor_safe; eassumption].
Qed.

(* A corridor is certified by one of its plans, which is checked like a sample. *)
Theorem corridor_safe P N E H s : context_ok P N E = true -> check_sample P N E H s = true ->
  in_corridor P N E H (sample_sep s) (toR (sample_p0 s)) (toR (sample_k s)) /\
  forall u x, in_corridor P N E H (sample_sep s) u x -> inBox (domain P) x /\ safe P N E u x.
Proof.
  intros HC HK. destruct (sample_in_corridor _ _ _ _ _ HC HK) as [HS HI]. split; [exact HI|].
  intros u x Hx. split; [apply Hx|eapply in_corridor_safe; eassumption].
Qed.

(* ---- Polytopes ---- *)
Lemma insideQ_ball v rs : forallb (insideQ v) rs = true ->
  exists eps, 0 < eps /\ forall x, (forall i, Rabs (x i - toR v i) <= eps) ->
    forall r, In r rs -> rowR x r.
Proof.
  induction rs as [|q rs IH]; intro Hin.
  { exists 1. split; [lra|]. intros x _ r []. }
  simpl in Hin. apply andb_prop in Hin as [Hq HQ]. destruct (IH HQ) as (e & He & IHe). clear IH.
  assert (exists e', 0 < e' /\ forall x, (forall i, Rabs (x i - toR v i) <= e') ->
    rowR x q) as (e' & He' & Hx).
  { destruct q as [st [c d]]. unfold insideQ in Hq. cbn [fst snd] in Hq.
    destruct (st || nonzero c) eqn:Z.
    - apply R_lt in Hq. rewrite R0, R_add, dotQ_R in Hq. set (m := dotR c (toR v) + Q2R d) in *.
      set (S := dotR (vabs c) (fun _ => 1)).
      assert (HS : 0 <= S).
      { subst S. clear. induction c as [|a c IH]; simpl; [lra|]. rewrite R_abs.
        change (shift (fun _ => 1)) with (fun _ : nat => 1). pose proof (Rabs_pos (Q2R a)). lra. }
      assert (Hm : 0 < m / (2 * (1 + S))) by (apply Rdiv_lt_0_compat; lra).
      exists (m / (2 * (1 + S))). split; [exact Hm|]. intros x Hx.
      assert (D : Rabs (dotR c (fun i => x i + -1 * toR v i)) <= m / (2 * (1 + S)) * S).
      { subst S. rewrite <- dotR_mult. apply dot_abs. intros i _.
        replace (x i + -1 * toR v i) with (x i - toR v i) by ring. rewrite Rmult_1_r. apply Hx. }
      rewrite (dotR_plus c x), dotR_mult in D.
      assert (m / (2 * (1 + S)) * S < m).
      { apply Rmult_lt_reg_r with (2 * (1 + S)); [lra|].
        replace (m / (2 * (1 + S)) * S * (2 * (1 + S))) with (m * S) by (field; lra). nra. }
      assert (0 < affR (c, d) x).
      { unfold affR. cbn [fst snd]. unfold m in *.
        pose proof (Rle_abs (- (dotR c x + -1 * dotR c (toR v)))) as G. rewrite Rabs_Ropp in G. lra.
        }
      unfold rowR. cbn [fst snd]. destruct st; lra.
    - apply orb_false_iff in Z as [-> Z]. exists 1. split; [lra|]. intros x _. apply holds_R in Hq.
      unfold rowR, affR in *. cbn [fst snd] in *. rewrite (zero_R _ Z) in *. exact Hq. }
  exists (Rmin e e'). split; [apply Rmin_glb_lt; assumption|]. intros x Hd r [<-|Hr].
  - apply Hx. intro i. eapply Rle_trans; [apply Hd|apply Rmin_r].
  - apply (IHe x); auto. intro i. eapply Rle_trans; [apply Hd|apply Rmin_l].
Qed.

(* The polytope of a piece: the solutions x = (p0, k) of its rows.  All of them are safe; their k
   lies in the bin of the piece and in no other; a ball around the inner point belongs to them, so
   the polytope has a volume. *)
Theorem set_safe P N E H s : context_ok P N E = true -> check_set P N E H s = true ->
  exists B h, nth_error (bins E) (which s) = Some B /\
  let member x := forall r, In r (set_rows P N E B h s) -> rowR x r in
  (forall x, member x -> let k := fun i => x (n_p P + i)%nat in
     inBox (domain P) k /\ inBox (box B) k /\ (forall B', In B' (bins E) ->
       inBox (box B') k -> B' = B) /\
     safe P N E x k) /\
  exists eps, 0 < eps /\ forall x, (forall i, Rabs (x i - toR (inner s) i) <= eps) -> member x.
Proof.
  intros HC HK. apply andb_prop in HC as [HP HE]. unfold check_set, check_set_with in HK.
  destruct (nth_error (hinted E H) (which s)) as [[B h]|] eqn:EB; [|discriminate].
  apply combine_nth_error in EB.
  exists B, h. split; [exact EB|]. rewrite !andb_true_iff in HK.
  destruct HK as (((Li & Hb) & Hs) & Hin). apply Nat.eqb_eq in Li.
  assert (Hin' : forallb (insideQ (inner s)) (set_rows P N E B h s) = true).
  { apply orb_prop in Hin as [Hin|Hin]; [|exact Hin].
    destruct (whole_of N E) as [M|] eqn:EM; [|discriminate].
    eapply clearly_inside_is; eassumption. }
  clear Hin. rename Hin' into Hin.
  pose proof (problem_inv _ _ HP) as SP. split; [|exact (insideQ_ball _ _ Hin)].
  intros x Hx k. unfold set_rows in Hx.
  destruct (netA N (pattern s) (map unit_form (seq (n_p P) (n_k P)))) as [r Y] eqn:En.
  assert (A : (forall i, at_forms Y x i = netR N k i) /\ length Y = outputs P).
  { pose proof (netA_R N (pattern s) (map unit_form (seq (n_p P) (n_k P))) x k (n_k P) _ Hb
      (net_sizes _ _ SP)) as A.
    rewrite En in A. apply A; [intros; apply at_units; auto|]. intros q Hq. apply Hx.
    rewrite !in_app_iff. auto. }
  destruct A as [HY LY].
  assert (HD : inBox (domain P) k) by (apply box_rows_R; intros q Hq; apply Hx;
    rewrite !in_app_iff; auto).
  assert (HO : inOpen (edges E) (box B) k) by (apply bin_rows_R; intros q Hq; apply Hx;
    rewrite !in_app_iff; auto).
  assert (HB : inBox (box B) k).
  { apply (open_closed (edges E)); [|exact HO]. apply boxes_len. apply nth_error_In in EB.
    eapply zip3_box. exact EB. }
  pose proof (only_one_bin P E _ B k HE EB HO) as HU.
  assert (HR : conditionsR P (dirs_of P (piece_sep s)) B h x (netR N k)).
  { apply (conditions_R P N (map unit_form (seq 0 (n_p P))) Y x); auto.
    - intros i Hi. rewrite at_units by exact Hi. reflexivity.
    - rewrite map_length, seq_length. reflexivity.
    - intros q Hq. apply Hx. rewrite !in_app_iff. auto.
    - intros b d w g t Hbd Hd. eapply dirs_valid; eauto. }
  split; [exact HD|]. split; [exact HB|]. split; [exact HU|].
  split; [apply HR|]. split; [exists B; split; [eapply nth_error_In; exact EB|exact HB]|].
  intros B' HB' Hk. rewrite (HU B' HB' Hk). apply (conditions_succeed P N (piece_sep s) B h x
    k HP Hs HR).
Qed.
