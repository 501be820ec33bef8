(* Why one direction keeps a part of the body off an obstacle for a whole interval [T14, T19, T26].
   *)
From Coq Require Import Reals QArith Qreals List Bool Arith Lra Lia.
From ParcJax Require Import Spec Arithmetic Checker ArithmeticFacts.
Import ListNotations.
Open Scope R_scope.

(* ---- Points of a hull lie where all its corners lie ---- *)
Lemma mix_le w g cs : forall lam, length lam = length cs -> Forall (fun l => 0 <= l) lam ->
  (forall c, In c cs -> dotR w c <= g) -> dotR w (mix lam cs) <= fold_right Rplus 0 lam * g.
Proof.
  induction cs as [|c cs IH]; intros [|l lam] Hl Hp Hc; simpl in *; try discriminate;
    [rewrite dotR_zero; lra|].
  apply Forall_cons_iff in Hp as [Hl0 Hp]. rewrite (dotR_plus w (fun a =>
    l * c a) (mix lam cs)), dotR_mult.
  specialize (IH lam ltac:(lia) Hp ltac:(intros; apply Hc; auto)).
  specialize (Hc c (or_introl eq_refl)).
  assert (l * dotR w c <= l * g) by (apply Rmult_le_compat_l; assumption). lra.
Qed.
Lemma mix_gt w g cs : forall lam, length lam = length cs -> Forall (fun l => 0 <= l) lam ->
  (forall c, In c cs -> g < dotR w c) ->
  fold_right Rplus 0 lam * g <= dotR w (mix lam cs) /\
  (0 < fold_right Rplus 0 lam -> fold_right Rplus 0 lam * g < dotR w (mix lam cs)).
Proof.
  induction cs as [|c cs IH]; intros [|l lam] Hl Hp Hc; simpl in *; try discriminate;
    [rewrite dotR_zero; split; lra|].
  apply Forall_cons_iff in Hp as [Hl0 Hp]. rewrite (dotR_plus w (fun a =>
    l * c a) (mix lam cs)), dotR_mult.
  destruct (IH lam ltac:(lia) Hp ltac:(intros; apply Hc; auto)) as [A B].
  specialize (Hc c (or_introl eq_refl)).
  assert (l * g <= l * dotR w c) by (apply Rmult_le_compat_l; lra).
  split; [lra|]. intro S. destruct (Rle_lt_or_eq_dec 0 l Hl0) as [L|<-].
  - assert (l * g < l * dotR w c) by (apply Rmult_lt_compat_l; lra). lra.
  - specialize (B ltac:(lra)). lra.
Qed.

(* ---- How far a shape and an error reach ---- *)
Lemma support_R n b w x : shape_ok n b = true -> length w = n -> inShape n b x ->
  - dotR w x <= Q2R (support b w).
Proof.
  intros HB Hn Hx. destruct b as [r|vs]; simpl in *.
  - apply R_le in HB. rewrite R0 in HB. rewrite R_mul.
    destruct (cauchy w x) as [C W]. rewrite Hn in C. rewrite <- dotQ_R in *.
    destruct (root_up_R _ W) as [U0 U]. set (u := Q2R (root_up (dotQ w w))) in *.
    set (V := Q2R (dotQ w w)) in *.
    assert (dotR w x * dotR w x <= (Q2R r * u) * (Q2R r * u)).
    { pose proof (sumsq_pos n x). apply Rle_trans with (V * (Q2R r * Q2R r)).
      - apply Rle_trans with (V * sumsq n x); [lra|]. apply Rmult_le_compat_l; lra.
      - replace ((Q2R r * u) * (Q2R r * u)) with (u * u * (Q2R r * Q2R r)) by ring.
        apply Rmult_le_compat_r; [|lra]. apply Rmult_le_pos; lra. }
    assert (0 <= Q2R r * u) by (apply Rmult_le_pos; lra).
    destruct (Rle_dec (- dotR w x) (Q2R r * u)) as [|G]; [assumption|]. exfalso.
    assert ((Q2R r * u) * (Q2R r * u) < (- dotR w x) * (- dotR w x)) by (apply Rmult_le_0_lt_compat;
      lra). lra.
  - destruct Hx as (lam & (HL & Hpos & Hsum) & Hx). destruct vs as [|v0 vs]; [discriminate|].
    set (S := fold_right _ _ _).
    assert (HS : forall v, In v (v0 :: vs) -> - dotR w (toR v) <= Q2R S).
    { clear. subst S. induction vs as [|u vs IH]; intros v Hv.
      - simpl in *. destruct Hv as [<-|[]]. rewrite Q2R_opp, dotQ_R. lra.
      - simpl fold_right. destruct (qle _ _) eqn:E.
        + apply R_le in E. simpl in Hv. destruct Hv as [<-|[<-|Hv]].
          * eapply Rle_trans; [apply IH; left; reflexivity|exact E].
          * rewrite Q2R_opp, dotQ_R. lra.
          * eapply Rle_trans; [apply IH; right; exact Hv|exact E].
        + apply R_nle in E. simpl in Hv. destruct Hv as [<-|[<-|Hv]].
          * apply IH; left; reflexivity.
          * rewrite Q2R_opp, dotQ_R in E. lra.
          * apply IH; right; exact Hv. }
    rewrite (dotR_ext w x (mix lam (map toR (v0 :: vs)))) by (intros i Hi; apply Hx; lia).
    assert (G : dotR (vscale (-1) w) (mix lam (map toR (v0 :: vs))) <= fold_right Rplus 0
      lam * Q2R S).
    { apply mix_le; [rewrite map_length; exact HL|exact Hpos|]. intros c Hc.
      apply in_map_iff in Hc as (v & <- & Hv).
      rewrite dotR_vscale, Rm1. specialize (HS v Hv). lra. }
    rewrite Hsum, dotR_vscale, Rm1 in G. lra.
Qed.
Lemma least_R A w x : inPoly A x -> forall tries h, least A w tries = Some h -> dotR w x <= Q2R h.
Proof.
  intro Hx. induction tries as [|m tries IH]; intros h H; [discriminate|]. cbn [least] in H.
  destruct (positive m) eqn:Pm; [|apply IH; exact H].
  pose proof (combine_R A m Pm x Hx) as C. destruct (combine_rows A m) as [v g] eqn:E. simpl in C.
  destruct (same v w) eqn:V; [|apply IH; exact H]. rewrite (same_R _ _ V) in C.
  destruct (least A w tries) as [g'|]; [destruct (qle g' g)|]; injection H as <-; auto.
Qed.
Lemma reach_R n E hints w h x : length w = n -> reach E hints w = Some h -> inError n E x ->
  dotR w x <= Q2R h.
Proof.
  intros Hn H Hx. destruct E as [e|A]; simpl in *; [|eapply least_R; eassumption].
  injection H as <-. rewrite dotQ_R. eapply Rle_trans; [apply Rle_abs|]. apply dot_abs. intros i Hi.
  apply Hx. lia.
Qed.

(* ---- One point, one interval: beyond the offset g at both knots, so beyond it throughout ---- *)
Lemma point_clear n E w g r p q (c : rv) s :
  length w = n -> reach E [] (vscale (-1) w) = Some r ->
  g + Q2R r < dotR w p -> g + Q2R r < dotR w q -> 0 <= s <= 1 ->
  inError n E (fun a => c a - ((1 - s) * p a + s * q a)) -> g < dotR w c.
Proof.
  intros Hn Hr Hp Hq Hs He.
  assert (Hn' : length (vscale (-1) w) = n) by (unfold vscale; rewrite map_length; exact Hn).
  pose proof (reach_R n _ _ _ _ _ Hn' Hr He) as D.
  rewrite dotR_vscale, Rm1 in D.
  rewrite (dotR_ext w _ (fun a => c a + -1 * ((1 - s) * p a + s * q a))) in D by (intros; ring).
  rewrite (dotR_plus w c), dotR_mult, (dotR_plus w (fun i => (1 - s) * p i)), !dotR_mult in D.
  assert (g + Q2R r < (1 - s) * dotR w p + s * dotR w q); [|lra].
  destruct (Rle_dec (dotR w p) (dotR w q)).
  - assert (0 <= s * (dotR w q - dotR w p)) by (apply Rmult_le_pos; lra). lra.
  - assert (0 <= (1 - s) * (dotR w p - dotR w q)) by (apply Rmult_le_pos; lra). lra.
Qed.

(* ---- A part of the body: one direction for all its points [T19] ---- *)
Theorem separation n A m b w h (c : nat -> rv) x :
  positive m = true -> combine_rows A m = (w, h) -> length w = n ->
    shape_ok n (grown_by b) = true ->
  (forall i, In i (corners b) -> Q2R h + Q2R (support (grown_by b) w) < dotR w (c i)) ->
  inPart n b c x -> ~ inPoly A x.
Proof.
  intros Hm Hc Hn Hb Hi (lam & y & (HL & Hp & Hs) & Hy & Hx) Hin.
  pose proof (combine_R A m Hm _ Hin) as C. rewrite Hc in C. simpl in C.
  rewrite (dotR_ext w x (fun a => mix lam (map c (corners b)) a + y a)) in C by (intros i L;
    apply Hx; lia).
  rewrite (dotR_plus w (mix lam _)) in C.
  pose proof (support_R n (grown_by b) w y Hb Hn Hy) as S.
  destruct (mix_gt w (Q2R h + Q2R (support (grown_by b) w)) (map c (corners b)) lam) as [_ G].
  - rewrite map_length. exact HL.
  - exact Hp.
  - intros d Hd. apply in_map_iff in Hd as (i & <- & Hd). apply Hi. exact Hd.
  - specialize (G ltac:(lra)). rewrite Hs in G. lra.
Qed.
