(* A drive without a word of Spec.v: what `accepted_place` says of a robot on a line, that goes for
   two seconds towards a wall at 3 and rests. Made with the proofs by tests/checker/test_rocq.py. *)
From Coq Require Import Reals QArith Qreals List Lra Lia ZArith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan Answer Episode Statements.
Import ListNotations.

Open Scope Q_scope.
Definition asks : problem := Problem 1 0 1 1 1 [(-2, 2)] [] [([1], 100)]
  [Obstacle [([-1], -3)] 0 0] [Part [0%nat] (Disc (1 # 2))].
Definition network : list layer := [[([1], 0)]].
Definition around : tube := Tube [[-2; 2]] [[[Widths [1 # 4]]]] [Widths [1 # 4]].
Definition go (at_time from : Q) : manoeuvre := Manoeuvre at_time [from] 0 asks []
  (Some (Sample [from] [1] [[[(1%nat, [(0%nat, 1)])]]])).
Definition drive : episode := Episode network around 1 false [1 # 8] [go 0 0; go 1 1].
Lemma it_is_accepted : check_episode drive = Driven 2 1 0.
Proof. vm_compute. reflexivity. Qed.

Open Scope R_scope.
Ltac plain := unfold toR, shift in *; simpl in *; unfold Q2R in *; simpl in *.

(* Told from u: while it goes, it is within 1/4 of u + s after s seconds. *)
Lemma told_from u f : (forall s, 0 <= s <= 1 -> Rabs (f s - (u + s)) <= 1 / 4) ->
  in_tube asks network (Bin [(-2, 2)%Q] [[Widths [1 # 4]]] (Widths [1 # 4])) (fun _ => u)
    (toR [1%Q]) (Traj (fun s _ _ => f s) (fun _ => 0)).
Proof.
  intro H. assert (Y : netR network (toR [1%Q]) 0%nat = 1) by (unfold network, netR, layerR; plain; lra). split.
  - intros t i s Ht Hi Hs. simpl in Ht, Hi. assert (t = 0%nat) as -> by lia.
    assert (i = 0%nat) as -> by lia. intros a Ha. simpl in Ha. assert (a = 0%nat) as -> by lia.
    unfold knotR, offsetR. simpl at_. simpl Nat.ltb. simpl Nat.sub. cbv iota. rewrite Y.
    specialize (H s Hs). plain. rewrite Rplus_0_l.
    replace (f s - ((1 - s) * (u + 0) + s * (u + 1))) with (f s - (u + s)) by ring. lra.
  - intros j Hj. simpl in Hj. assert (j = 0%nat) as -> by lia.
    unfold final_state, endR, offsetR. simpl Nat.ltb. simpl Nat.sub. cbv iota. rewrite Y.
    specialize (H 1 ltac:(lra)). simpl at_. simpl steps.
    replace (INR 1) with 1 by reflexivity. plain. lra.
Qed.

Theorem in_plain_words : forall (p : R -> R) (u1 u2 : R),
  (* where it truly was when it was said to be at 0, and at 1 *)
  Rabs u1 <= 1 / 8 -> Rabs (u2 - 1) <= 1 / 8 ->
  (forall s, 0 <= s < 1 -> Rabs (p s - (u1 + s)) <= 1 / 4) ->
  (forall s, 1 <= s <= 2 -> Rabs (p s - (u2 + (s - 1))) <= 1 / 4) ->
  (forall s, 2 <= s -> p s = p 2) ->
  (* then no point of a body of radius 1/2 is ever in the wall less 1/8 *)
  forall s x, 0 <= s -> Rabs (x - p s) <= 1 / 2 -> x < 3 + 1 / 8.
Proof.
  intros p u1 u2 U1 U2 H1 H2 H3 s x Hs Hx.
  destruct (accepted_place drive 2 1 0 it_is_accepted eq_refl) as (m0 & M & _ & H).
  injection M as <-. simpl done in H.
  assert (K : forall turn, In turn (turns [go 0 0; go 1 1]) -> exists u,
    (forall a, (a < n_p (asked (go 0 0)))%nat ->
      Rabs (u a - toR (pose (fst turn)) a) <= toR (doubt drive) a) /\
    keeps_to drive turn u (fun s _ _ => p s)).
  { intros turn [<-|[<-|[]]].
    - exists (fun _ => u1). split.
      + intros a Ha. simpl in Ha. assert (a = 0%nat) as -> by lia. plain.
        replace (u1 - 0 * / 1) with u1 by lra. lra.
      + exists (Sample [0%Q] [1%Q] [[[(1%nat, [(0%nat, 1%Q)])]]]).
        exists (Bin [(-2, 2)%Q] [[Widths [1 # 4]]] (Widths [1 # 4])).
        exists (Traj (fun c _ _ => if Rlt_dec c 1 then p c else u1 + 1) (fun _ => 0)).
        split; [reflexivity|]. split; [left; reflexivity|]. split; [plain; lra|]. split.
        * apply told_from. intros c Hc. destruct (Rlt_dec c 1); [apply H1; lra|].
          replace (u1 + 1 - (u1 + c)) with 0 by lra. rewrite Rabs_R0. lra.
        * intros time [B E] i a. unfold clock. plain.
          rewrite Rmin_right by lra. replace ((time - 0 * / 1) / (1 * / 1)) with time by field.
          destruct (Rlt_dec time 1) as [L|L]; [reflexivity|lra].
    - exists (fun _ => u2). split.
      + intros a Ha. simpl in Ha. assert (a = 0%nat) as -> by lia. plain.
        replace (u2 - 1 * / 1) with (u2 - 1) by lra. lra.
      + exists (Sample [1%Q] [1%Q] [[[(1%nat, [(0%nat, 1%Q)])]]]).
        exists (Bin [(-2, 2)%Q] [[Widths [1 # 4]]] (Widths [1 # 4])).
        exists (Traj (fun c _ _ => p (1 + c)) (fun _ => 0)).
        split; [reflexivity|]. split; [left; reflexivity|]. split; [plain; lra|]. split.
        * apply told_from. intros c Hc. specialize (H2 (1 + c) ltac:(lra)).
          replace (1 + c - 1) with c in H2 by ring. exact H2.
        * intros time [B E] i a. unfold clock. plain.
          replace ((time - 1 * / 1) / (1 * / 1)) with (time - 1) by field.
          destruct (Rle_dec time 2) as [L|L].
          -- rewrite Rmin_right by lra. f_equal; ring.
          -- rewrite Rmin_left by lra. rewrite (H3 time) by lra. f_equal; ring. }
  destruct (Rlt_dec x (3 + 1 / 8)) as [L|L]; [exact L|exfalso].
  destruct (H (fun s _ _ => p s) K s ltac:(plain; lra)) as (turn & Hin & Hu & C).
  assert (A : asked (fst turn) = asks) by (destruct Hin as [<-|[<-|[]]]; reflexivity).
  rewrite A in C. eapply (C _ 0%nat (Part [0%nat] (Disc (1 # 2))) (fun _ => x)).
  - left. reflexivity.
  - simpl. lia.
  - unfold clock. rewrite A. simpl steps. split; [|apply Rmin_l].
    apply Rmin_glb; [simpl; lra|]. destruct Hu as [B _]. simpl.
    apply Rmult_le_pos; [lra|]. left. apply Rinv_0_lt_compat. plain. lra.
  - left. reflexivity.
  - exists [1], (fun _ => x - p s). split; [|split].
    + unfold weights. simpl. repeat split; [|lra]. constructor; [lra|constructor].
    + plain. unfold Rabs in Hx. destruct (Rcase_abs (x - p s)); nra.
    + intros a _. simpl. lra.
  - intros a b [E|[]]. injection E as <- <-. plain. lra.
Qed.
Print Assumptions in_plain_words.
