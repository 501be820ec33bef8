(* What the code lets pass keeps to a corridor in real numbers, where the tables' margins pay. *)
From Coq Require Import Reals Lra Lia List Arith Bool.
From ParcJax.Onboard Require Import Arithmetic Dot Sums Network Rows Tube Header Bins.
Open Scope R_scope.

Section Sound.
Context {F : arithmetic}.
Variable T : tables F.
Local Notation values := (@values F).

(* What is asked of the tables: that they fit together, that their numbers are finite, and that
   room, for each unit of |a|_1, pays for all rounding of a row. beta: how far the network's outputs
   may be off. most, start: the largest of them, and of where a plan may start. steep, wide, excess:
   of the bases of the tube. paid.py asks the same of a header's numbers, one by one. *)
Variables room beta most start steep wide excess : R.

Let n_out : nat := (n_path T + n_q T - n_p T)%nat.
Let sized : R := most + start. (* a coordinate of a path, before it is rounded *)
Let size : R := sized + (u * sized + eta). (* and after *)
Let off : R := beta + (u * sized + eta). (* how far off it is *)
Let deep : nat := S (n_p T). (* of a sum along a direction: its roundings, one after another *)
Let many : nat := (2 * n_p T)%nat. (* and in all *)
Let g : R := tube_grown (n_p T).
Let least : R := tube_least (n_p T) wide.

Definition fits_together : Prop :=
  (0 < n_p T <= n_path T)%nat /\ (forall j, (j < n_k T)%nat -> (0 < n_bins T j)%nat) /\
  match net T with nil => False | cons L _ => n_in L = n_k T end /\
  (forall run, (run_end T run <= n_steps T)%nat) /\
  (forall pair i, (pair_point T pair i * n_p T + n_p T <= n_c T)%nat).

Definition all_finite : Prop :=
  (forall j i, (j < n_k T)%nat -> (i <= n_bins T j)%nat -> finite F (edge T j i)) /\
  (forall c, (c < n_p T)%nat -> finite F (far T c) /\ value F (far T c) <= start) /\
  (forall row, finite F (start_b T row) /\
     forall c, (c < n_p T)%nat -> finite F (start_A T row c)) /\
  (forall row, (forall bin, finite F (goal_b T bin row)) /\
     forall c, (c < n_c T + n_q T)%nat -> finite F (goal_A T row c)) /\
  (forall run, finite F (run_support T run) /\
     forall c, (c < n_p T)%nat -> finite F (run_w T run c)) /\
  (forall bin t point b, (b < n_bases T)%nat -> basis_finite (n_p T) (errors T bin t point b)).

(* A row of n terms, of numbers that are off and of some size. *)
Definition row_paid (n : nat) (norm off_ size_ : R) : Prop :=
  reach_of (S n) (2 * n) (norm * size_) <= largest /\
  norm * off_ + lost_by (S n) (2 * n) (norm * size_) <= room * norm.

(* A direction: its sums, the support, and how far the errors reach, which is at most of the size of
   the rest where the comparison holds. *)
Definition run_paid (norm support : R) : Prop :=
  let rest := (1 + 2 * u) * (reach_of deep many (norm * size) + eta) + Rabs support + least
    + norm * excess in
  norm * off + lost_by deep many (norm * size) + least
    + g * ((1 + 2 * g) * (rest + least)) + (u * rest + eta) <= room * norm.

Definition used (run : nat) : Prop := exists corridor,
  (corridor < n_corridors T)%nat /\
  (first_run T corridor <= run < first_run T (S corridor))%nat.

Definition margins_pay : Prop :=
  0 <= start /\ 0 <= beta /\ 0 <= most /\ sized <= largest /\ g <= / 2 /\ 0 <= excess /\
  network_bounded (net T) (fun _ => 0) (largest_k T) n_out beta most /\
  (forall row, (row < n_start T)%nat ->
     row_paid (n_p T) (one_norm (n_p T) (start_A T row)) 0 start) /\
  (forall row, (row < n_goal T)%nat ->
     row_paid (n_c T + n_q T) (one_norm (n_c T + n_q T) (goal_A T row)) off size) /\
  (forall run, used run -> let norm := one_norm (n_p T) (run_w T run) in
     reach_of deep many (norm * size) <= largest /\
     run_paid norm (value F (run_support T run)) /\
     face_size (n_p T) steep norm <= largest /\
     Rabs (value F (run_support T run)) + tube_size (n_p T) steep wide norm <= largest) /\
  (forall bin t point b, (b < n_bases T)%nat ->
     basis_within (n_p T) steep wide excess (errors T bin t point b)).

Hypothesis Fits : fits_together.
Hypothesis Finite : all_finite.
Hypothesis Pay : margins_pay.

(* ---- Start, network, path. ---- *)

Lemma start_close p0 :
  (forall c, (c < n_p T)%nat ->
     at_most F (negated F (far T c)) (p0 c) = true /\ at_most F (p0 c) (far T c) = true) ->
  forall c, (c < n_p T)%nat -> close (p0 c) (values p0 c) 0 start.
Proof.
  intros H c Hc. destruct (H c Hc) as [Lo Hi]. destruct Finite as [_ [Ff _]].
  destruct (Ff c Hc) as [Fin Le]. destruct (negated_is F (far T c) Fin) as [Fn Vn].
  assert (Fp : finite F (p0 c)) by (apply (between_is F _ _ _ Fn Fin Lo Hi)).
  apply (at_most_is F) in Lo; auto. apply (at_most_is F) in Hi; auto. rewrite Vn in Lo.
  split; [exact Fp|]. split.
  - apply close_itself, Fp.
  - apply Rabs_le. lra.
Qed.

Lemma sum_close x y z xr yr :
  close x xr beta most -> close y yr 0 start -> sum F x y z -> close z (xr + yr) off size.
Proof.
  intros [Fx [Ex Sx]] [Fy [Ey Sy]] Hz. destruct Pay as [_ [_ [_ [L _]]]].
  assert (S : Rabs (value F x + value F y) <= sized).
  { unfold sized. eapply Rle_trans; [apply Rabs_triang|]. lra. }
  destruct (sum_is F x y z Fx Fy) as [Fz N]; [lra|exact Hz|]. unfold near in N.
  pose proof u_pos. pose proof eta_pos.
  assert (u * Rabs (value F x + value F y) <= u * sized) by (apply Rmult_le_compat_l; lra).
  split; [exact Fz|]. split.
  - replace (value F z - (xr + yr)) with
      ((value F z - (value F x + value F y)) + ((value F x - xr) + (value F y - yr))) by ring.
    unfold off. eapply Rle_trans; [apply Rabs_triang|].
    pose proof (Rabs_triang (value F x - xr) (value F y - yr)). lra.
  - replace (value F z) with
      ((value F z - (value F x + value F y)) + (value F x + value F y)) by ring.
    unfold size. eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.

Lemma path_close p0 k out path : (0 <= beta)%R -> (0 <= most)%R ->
  (forall c, (c < n_p T)%nat -> close (p0 c) (values p0 c) 0 start) ->
  (forall i, (i < n_out)%nat -> close (out i) (network_is (net T) (values k) i) beta most) ->
  moved T p0 out path -> forall at_, (at_ < n_path T + n_q T)%nat ->
  close (path at_) (place T (values p0) (values k) at_) off size.
Proof.
  intros Hb Hm Cp Co [M1 M2] at_ Hat. destruct Fits as [[Hp Hpn] _]. destruct Pay as [Hs _].
  pose proof u_pos. pose proof eta_pos. unfold place.
  destruct (at_ <? n_path T)%nat eqn:E.
  - apply Nat.ltb_lt in E. specialize (M1 at_ E). eapply sum_close; [|apply Cp|exact M1].
    + destruct (at_ <? n_p T)%nat eqn:E'.
      * eapply close_weaker; [apply close_0|lra|lra].
      * apply Nat.ltb_ge in E'. apply Co. unfold n_out. lia.
    + apply Nat.mod_upper_bound. lia.
  - apply Nat.ltb_ge in E. rewrite M2 by lia.
    assert (E' : (at_ <? n_p T)%nat = false) by (apply Nat.ltb_ge; lia). rewrite E', Rplus_0_r.
    assert (0 <= u * sized) by (apply Rmult_le_pos; unfold sized; lra).
    eapply close_weaker; [apply Co; unfold n_out; lia|unfold off; lra|unfold size, sized in *; lra].
Qed.

(* ---- Rows. ---- *)

Lemma row_holds n a x xr off_ size_ b :
  (forall c, (c < n)%nat -> finite F (a c)) -> finite F b ->
  (forall c, (c < n)%nat -> close (x c) (xr c) off_ size_) ->
  row_paid n (one_norm n a) off_ size_ -> row_met n a x b ->
  along n a xr <= value F b + room * one_norm n a.
Proof.
  intros Ka Kb Kx [B P] [s [Hs Hb]].
  destruct (row_close n a x xr off_ size_ s Ka Kx B Hs) as [Fs [Es _]].
  apply (at_most_is F) in Hb; auto.
  pose proof (Rle_abs (- (value F s - along n a xr))) as Q. rewrite Rabs_Ropp in Q. lra.
Qed.

(* ---- Separation. ---- *)

Lemma abs_between x y : Rabs x <= y -> - y <= x <= y.
Proof. unfold Rabs. destruct (Rcase_abs x); lra. Qed.

Lemma before_loss v y b : 0 <= v <= / 2 -> 0 <= y -> y - v * y <= b -> y <= (1 + 2 * v) * b.
Proof.
  intros Hv Hy Hb.
  assert ((1 + 2 * v) * (y - v * y) <= (1 + 2 * v) * b) by (apply Rmult_le_compat_l; lra).
  assert (0 <= v * (1 - 2 * v) * y) by (apply Rmult_le_pos; [apply Rmult_le_pos|]; lra).
  lra.
Qed.

(* The comparison in numbers alone. w: w . p of the model. H: support. L: how far the errors reach,
   Lh as computed, and S the sizes of its terms. *)
Lemma beyond norm H L S Lh lh s w :
  0 <= norm * size -> 0 <= S -> L <= S <= L + norm * excess -> 0 <= g <= / 2 -> 0 <= least ->
  Rabs (Lh - L) <= g * S + least ->
  near (H + Lh) lh ->
  Rabs (s - w) <= norm * off + lost_by deep many (norm * size) ->
  Rabs s <= reach_of deep many (norm * size) ->
  lh < s -> run_paid norm H -> H - room * norm + L < w.
Proof.
  intros Norm S0 SL Hg Hl EL N Es Ss Lt P. unfold run_paid in P.
  set (rest := _ + norm * excess) in P.
  set (reached := reach_of deep many (norm * size)) in *.
  set (lost := lost_by deep many (norm * size)) in *.
  pose proof u_pos as Up. pose proof u_small as Us. pose proof eta_pos as Ep.
  unfold near in N. apply abs_between in EL. apply abs_between in N. apply abs_between in Es.
  apply abs_between in Ss. pose proof (abs_between H _ (Rle_refl _)) as AH.
  assert (gS : g * S <= S) by nra.
  assert (Head : 0 <= (1 + 2 * u) * (reached + eta)) by (apply Rmult_le_pos; lra).
  assert (Sum : Rabs (H + Lh) <= rest /\ Lh <= rest - norm * excess).
  { destruct (Rle_or_lt 0 (H + Lh)) as [Pos|Neg].
    - rewrite (Rabs_right (H + Lh)) in * by lra.
      assert (H + Lh <= (1 + 2 * u) * (reached + eta)) by (apply before_loss; lra).
      unfold rest. lra.
    - rewrite Rabs_left by lra. unfold rest. lra. }
  destruct Sum as [Sum Found].
  assert (Terms : S <= (1 + 2 * g) * (rest + least)) by (apply before_loss; lra).
  assert (g * S <= g * ((1 + 2 * g) * (rest + least))) by (apply Rmult_le_compat_l; lra).
  assert (u * Rabs (H + Lh) <= u * rest) by (apply Rmult_le_compat_l; lra).
  lra.
Qed.

Lemma least_pos (bin t point b : nat) : (b < n_bases T)%nat -> 0 <= least.
Proof.
  intros Hb. destruct Finite as [_ [_ [_ [_ [_ Fb]]]]].
  destruct Pay as [_ [_ [_ [_ [_ [_ [_ [_ [_ [_ Within]]]]]]]]]].
  destruct (Within bin t point b Hb) as [_ [_ [Wide _]]].
  assert (Wide0 : 0 <= wide).
  { eapply Rle_trans; [|exact Wide]. apply added_pos. intros j Hj.
    apply (extent_pos (n_p T)); [apply Fb, Hb|exact Hj]. }
  unfold least, tube_least. apply Rplus_le_le_0_compat; [apply Rmult_le_pos; [|exact Wide0]|];
    apply tiny_pos.
Qed.

Lemma apart_holds p0 k path bin run t i s :
  (0 <= sized)%R ->
  (forall at_, (at_ < n_path T + n_q T)%nat ->
     close (path at_) (place T (values p0) (values k) at_) off size) ->
  used run -> apart T path bin run t -> (t < run_end T run)%nat -> (i < n_part T)%nat ->
  s = t \/ s = S t ->
  let w := run_w T run in
  let point := pair_point T (run_pair T run) i in
  exists b, (b < n_bases T)%nat /\
  value F (run_support T run) - room * one_norm (n_p T) w
    + reach (n_p T) w (errors T bin t point b)
  < along (n_p T) w (fun c => place T (values p0) (values k) (at_knot T s point c)).
Proof.
  intros Sized0 Cp Used Ap Ht Hi Hs w point. destruct (Ap i Hi) as [lost [lh [st [fi G]]]].
  fold w in G. fold point in G. destruct G as [[b [Hb Gl]] [Gs [Gst [Gfi [Lst Lfi]]]]].
  exists b. split; [exact Hb|].
  destruct Fits as [_ [_ [_ [He Hpt]]]]. destruct Finite as [_ [_ [_ [_ [Fr Fb]]]]].
  destruct Pay as [_ [_ [_ [_ [Hg [Ex [_ [_ [_ [Pr Within]]]]]]]]]]. destruct (Fr run) as [FH Fw].
  destruct (Pr run Used) as [B1 [B2 [B3 B4]]]. fold w in B1, B2, B3, B4, Fw.
  pose proof u_pos as Up. pose proof eta_pos as Ep.
  specialize (Fb bin t point b Hb). specialize (Within bin t point b Hb).
  set (norm := one_norm (n_p T) w) in *. set (B := errors T bin t point b) in *.
  set (H := value F (run_support T run)) in *.
  assert (Norm0 : 0 <= norm) by apply one_norm_pos.
  assert (Size0 : 0 <= size).
  { unfold size. assert (0 <= u * sized) by (apply Rmult_le_pos; lra). lra. }
  pose proof (Rabs_pos H) as SupportPos.
  destruct (reach_close (n_p T) steep wide excess w B Fb Within Fw lost) as [Fl [El Sl]].
  { exact B3. }
  { fold norm. lra. }
  { exact Gl. }
  fold norm in Sl. set (L := reach (n_p T) w B) in *. set (S := terms (n_p T) w B) in *.
  assert (LS : Rabs L <= S) by apply (terms_above (n_p T) w B Fb).
  assert (SL : S <= L + norm * excess).
  { apply (terms_excess (n_p T) steep wide excess w B Fb Within). }
  destruct (sum_is F (run_support T run) lost lh FH Fl) as [Flh Nlh].
  { fold H. eapply Rle_trans; [apply Rabs_triang|]. lra. }
  { exact Gs. }
  fold H in Nlh.
  assert (One : forall knot z, (knot <= n_steps T)%nat ->
    row_gives (n_p T) w (fun c => path (at_knot T knot point c)) z -> less F lh z = true ->
    H - room * norm + L
    < along (n_p T) w (fun c => place T (values p0) (values k) (at_knot T knot point c))).
  { intros knot z Hk Gz Lz.
    destruct (row_close (n_p T) w (fun c => path (at_knot T knot point c))
      (fun c => place T (values p0) (values k) (at_knot T knot point c)) off size z Fw)
      as [Fz [Ez Sz]].
    - intros c Hc. apply Cp. unfold at_knot, n_path. specialize (Hpt (run_pair T run) i).
      fold point in Hpt. simpl. nia.
    - exact B1.
    - exact Gz.
    - apply (less_is F) in Lz; auto. pose proof (Rle_abs L). pose proof (Rabs_pos L).
      apply (beyond norm H L S (value F lost) (value F lh) (value F z)); auto; try lra.
      + apply Rmult_le_pos; lra.
      + split; [|exact Hg]. unfold g, tube_grown. pose proof (grown_once (tube_deep (n_p T))). lra.
      + apply (least_pos bin t point b Hb). }
  specialize (He run). destruct Hs as [-> | ->].
  - apply (One t st); auto. lia.
  - apply (One (Datatypes.S t) fi); auto. lia.
Qed.

(* ---- The theorem. ---- *)

(* Where the header gives 1, the plan keeps to one of its corridors in real numbers. *)
Theorem safe_is_kept : forall p0 k, is_safe T p0 k -> keeps T room (values p0) (values k).
Proof.
  intros p0 k [bin [out [path [Hbin [Hp0 [Hstart [Hnet [Hmoved [Hgoal [c [Hc Hruns]]]]]]]]]]].
  pose proof Fits as [Hp [Hb [Hin [He Hpt]]]]. pose proof Finite as [Fe [Ff [Fs [Fg [Fr Fh]]]]].
  pose proof Pay as [S0 [Beta0 [Most0 [SL [Hg [Ex [Nb [Ps [Pg Pr]]]]]]]]].
  destruct (bin_close T k bin Hb Fe Hbin) as [In Ck].
  pose proof (start_close p0 Hp0) as Cp.
  assert (Co : forall i, (i < n_out)%nat ->
    close (out i) (network_is (net T) (values k) i) beta most).
  { apply (network_close (net T) k (values k) (fun _ => 0) (largest_k T) n_out beta most out); auto.
    destruct (net T) as [|L rest]; [destruct Hin|]. rewrite Hin. exact Ck. }
  assert (Cpath := path_close p0 k out path Beta0 Most0 Cp Co Hmoved).
  exists bin. split; [exact In|]. split; [|split].
  - intros row Hr. destruct (Fs row) as [Fb Fa].
    apply (row_holds (n_p T) (start_A T row) p0 (values p0) 0 start); auto.
  - intros row Hr. destruct (Fg row) as [Fb Fa].
    apply (row_holds (n_c T + n_q T) (goal_A T row) (fun c => path (n_steps T * n_c T + c)%nat)
      (end_of T (values p0) (values k)) off size); auto.
    intros j Hj. apply Cpath. unfold n_path. simpl. lia.
  - exists c. split; [exact Hc|]. intros run t i s Hrun Ht Hi Hs.
    apply (apart_holds p0 k path bin run t i s); auto; [unfold sized; lra| |lia].
    exists c. split; assumption.
Qed.

End Sound.
