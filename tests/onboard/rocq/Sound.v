(* What the code lets pass keeps to a corridor in real numbers, where the tables' margins pay. *)
From Coq Require Import Reals Lra Lia List Arith Bool.
Require Import Arithmetic Dot Network Header.
Open Scope R_scope.

Section Sound.
Context {F : arithmetic}.
Variable T : tables F.
Local Notation values := (@values F).

(* What is asked of the tables: that they fit together, that their numbers are finite, and that
   room, for each unit of |a|_1, pays for all rounding of a row. beta: how far the network's outputs
   may be off. most, start: the largest of them, and of where a plan may start. paid.py asks the
   same of a header's numbers, one by one. *)
Variables room beta most start : R.

Let n_out : nat := (n_path T + n_q T - n_p T)%nat.
Let largest_k (j : nat) : R :=
  Rmax (Rabs (value F (edge T j 0))) (Rabs (value F (edge T j (n_bins T j)))).
Let sized : R := most + start. (* a coordinate of a path, before it is rounded *)
Let size : R := sized + (u * sized + eta). (* and after *)
Let off : R := beta + (u * sized + eta). (* how far off it is *)
Let deep : nat := S (n_p T). (* of a sum along a direction: its roundings, one after another *)
Let many : nat := (2 * n_p T)%nat. (* and in all *)
Let g : R := (1 + u) ^ deep - 1.
Let least : R := INR many * eta * (1 + u) ^ deep.

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
  (forall bin t point c, finite F (half T bin t point c) /\ 0 <= value F (half T bin t point c)).

(* A row of n terms, of numbers that are off and of some size. *)
Definition row_paid (n : nat) (norm off_ size_ : R) : Prop :=
  reach_of (S n) (2 * n) (norm * size_) <= largest /\
  norm * off_ + lost_by (S n) (2 * n) (norm * size_) <= room * norm.

(* A direction: its sums, the support, and what the errors take, which is at most of the size of
   the rest where the comparison holds. *)
Definition run_paid (norm support : R) : Prop :=
  let rest := (1 + 2 * u) * (reach_of deep many (norm * size) + eta) + Rabs support + least in
  norm * off + lost_by deep many (norm * size) + least
    + g * ((1 + 2 * g) * (rest + least)) + (u * rest + eta) <= room * norm.

Definition used (run : nat) : Prop := exists corridor,
  (corridor < n_corridors T)%nat /\
  (first_run T corridor <= run < first_run T (S corridor))%nat.

Definition margins_pay : Prop :=
  0 <= start /\ 0 <= beta /\ 0 <= most /\ sized <= largest /\ g <= / 2 /\
  network_bounded (net T) (fun _ => 0) largest_k n_out beta most /\
  (forall row, (row < n_start T)%nat ->
     row_paid (n_p T) (one_norm (n_p T) (start_A T row)) 0 start) /\
  (forall row, (row < n_goal T)%nat ->
     row_paid (n_c T + n_q T) (one_norm (n_c T + n_q T) (goal_A T row)) off size) /\
  (forall run, used run -> let norm := one_norm (n_p T) (run_w T run) in
     reach_of deep many (norm * size) <= largest /\
     run_paid norm (value F (run_support T run)) /\
     forall bin t point, Rabs (value F (run_support T run)) + reach_of deep many
       (added (n_p T) (fun c => Rabs (value F (run_w T run c)) * value F (half T bin t point c)))
       <= largest).

Hypothesis Fits : fits_together.
Hypothesis Finite : all_finite.
Hypothesis Pay : margins_pay.

(* ---- The bin: comparisons are exact. ---- *)

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

Lemma bin_close k bin : bin_of T k (n_k T) = Some bin ->
  inside_bin T (values k) bin /\
  forall j, (j < n_k T)%nat -> close (k j) (values k j) 0 (largest_k j).
Proof.
  intros H. destruct Fits as [_ [Hb _]]. destruct Finite as [Fe _].
  destruct (bin_of_inside k (n_k T) bin (le_n _) H) as [place [Hat Hp]].
  assert (In : forall j, (j < n_k T)%nat -> finite F (k j) /\ (place j < n_bins T j)%nat /\
    value F (edge T j 0) <= value F (k j) <= value F (edge T j (n_bins T j)) /\
    (place j = 0%nat \/ value F (edge T j (place j)) < value F (k j)) /\
    (S (place j) = n_bins T j \/ value F (k j) < value F (edge T j (S (place j))))).
  { intros j Hj. apply bin_along_inside; auto. }
  split.
  - exists place. split; [exact Hat|]. intros j Hj. destruct (In j Hj) as [_ Q]. exact Q.
  - intros j Hj. destruct (In j Hj) as [Fk [_ [Q _]]]. split; [exact Fk|]. split.
    + unfold values. rewrite Rminus_diag_eq by reflexivity. rewrite Rabs_R0. lra.
    + unfold largest_k. unfold Rmax, Rabs.
      repeat destruct (Rcase_abs _); repeat destruct (Rle_dec _ _); lra.
Qed.

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
  - unfold values. rewrite Rminus_diag_eq by reflexivity. rewrite Rabs_R0. lra.
  - apply Rabs_le. lra.
Qed.

Lemma close_0 : close (zero F) 0 0 0.
Proof.
  destruct (zero_is F) as [Hf Hv]. split; [exact Hf|].
  rewrite Hv, Rminus_0_r, Rabs_R0. lra.
Qed.

Lemma close_weaker x r a b c d : close (F := F) x r a b -> a <= c -> b <= d -> close x r c d.
Proof. intros [A [B C]] H G. split; [exact A|]. lra. Qed.

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

Lemma row_close n a x xr off_ size_ s :
  (forall c, (c < n)%nat -> finite F (a c)) ->
  (forall c, (c < n)%nat -> close (x c) (xr c) off_ size_) ->
  reach_of (S n) (2 * n) (one_norm n a * size_) <= largest -> row_gives n a x s ->
  close s (along n a xr) (one_norm n a * off_ + lost_by (S n) (2 * n) (one_norm n a * size_))
    (reach_of (S n) (2 * n) (one_norm n a * size_)).
Proof.
  intros Ka Kx B Hs. unfold one_norm in *. rewrite <- !added_scaled in *.
  apply (dot_close n a x xr (fun _ => off_) (fun _ => size_)); auto.
Qed.

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

(* The comparison in numbers alone. w: w . p of the model. H: support. L: what the errors take. *)
Lemma beyond norm H L Lh lh s w :
  0 <= norm * size -> 0 <= L -> 0 <= g <= / 2 -> 0 <= least ->
  Rabs (Lh - L) <= g * L + least ->
  near (H + Lh) lh ->
  Rabs (s - w) <= norm * off + lost_by deep many (norm * size) ->
  Rabs s <= reach_of deep many (norm * size) ->
  lh < s -> run_paid norm H -> H - room * norm + L < w.
Proof.
  intros Hn HL Hg Hl EL N Es Ss Lt P. unfold run_paid in P.
  set (rest := (1 + 2 * u) * (reach_of deep many (norm * size) + eta) + Rabs H + least) in *.
  set (A := reach_of deep many (norm * size)) in *.
  set (lost := lost_by deep many (norm * size)) in *.
  pose proof u_pos as Up. pose proof u_small as Us. pose proof eta_pos as Ep.
  unfold near in N. apply abs_between in EL. apply abs_between in N. apply abs_between in Es.
  apply abs_between in Ss.
  pose proof (Rle_abs H) as H1. pose proof (Rle_abs (- H)) as H2. rewrite Rabs_Ropp in H2.
  assert (A0 : 0 <= A) by lra.
  assert (Lh0 : - least <= Lh) by nra.
  assert (X : Rabs (H + Lh) <= rest).
  { destruct (Rle_or_lt 0 (H + Lh)) as [Pos|Neg].
    - rewrite (Rabs_right (H + Lh)) in * by lra.
      assert (H + Lh <= (1 + 2 * u) * (A + eta)) by (apply before_loss; lra).
      unfold rest. lra.
    - rewrite Rabs_left by lra. assert (0 <= (1 + 2 * u) * (A + eta)) by nra. unfold rest. lra. }
  assert (Y : Lh <= rest).
  { destruct (Rle_or_lt 0 (H + Lh)) as [Pos|Neg].
    - rewrite (Rabs_right (H + Lh)) in N by lra.
      assert (H + Lh <= (1 + 2 * u) * (A + eta)) by (apply before_loss; lra).
      unfold rest. lra.
    - assert (0 <= (1 + 2 * u) * (A + eta)) by nra. unfold rest. lra. }
  assert (Z : L <= (1 + 2 * g) * (rest + least)) by (apply before_loss; lra).
  assert (g * L <= g * ((1 + 2 * g) * (rest + least))) by (apply Rmult_le_compat_l; lra).
  assert (u * Rabs (H + Lh) <= u * rest) by (apply Rmult_le_compat_l; lra).
  lra.
Qed.

Lemma size_close x : finite F x ->
  finite F (size_of x) /\ value F (size_of x) = Rabs (value F x).
Proof.
  intros Fx. destruct (zero_is F) as [F0 V0]. destruct (negated_is F x Fx) as [Fn Vn].
  pose proof (less_is F x (zero F) Fx F0) as L. rewrite V0 in L. unfold size_of.
  destruct (less F x (zero F)) eqn:E.
  - split; [exact Fn|]. rewrite Vn, Rabs_left; [reflexivity|]. apply L. reflexivity.
  - split; [exact Fx|]. rewrite Rabs_right; [reflexivity|].
    destruct (Rlt_or_le (value F x) 0) as [Q|Q]; [|lra]. apply L in Q. discriminate.
Qed.

Lemma apart_holds p0 k path bin run t i s :
  (0 <= sized)%R ->
  (forall at_, (at_ < n_path T + n_q T)%nat ->
     close (path at_) (place T (values p0) (values k) at_) off size) ->
  used run -> apart T path bin run t -> (t < run_end T run)%nat -> (i < n_part T)%nat ->
  s = t \/ s = S t ->
  let w := run_w T run in
  let point := pair_point T (run_pair T run) i in
  value F (run_support T run) - room * one_norm (n_p T) w
    + added (n_p T) (fun c => Rabs (value F (w c)) * value F (half T bin t point c))
  < along (n_p T) w (fun c => place T (values p0) (values k) (at_knot T s point c)).
Proof.
  intros Hsized Cp Used Ap Ht Hi Hs w point. destruct (Ap i Hi) as [lost [lh [st [fi G]]]].
  fold w in G. fold point in G. destruct G as [Gl [Gs [Gst [Gfi [Lst Lfi]]]]].
  destruct Fits as [_ [_ [_ [He Hpt]]]]. destruct Finite as [_ [_ [_ [_ [Fr Fh]]]]].
  destruct Pay as [_ [_ [_ [_ [Hg [_ [_ [_ Pr]]]]]]]]. destruct (Fr run) as [FH Fw].
  destruct (Pr run Used) as [B1 [B2 B3]]. fold w in B1, B2, B3, Fw. specialize (B3 bin t point).
  pose proof u_pos as Up. pose proof eta_pos as Ep. pose proof (grown_once deep) as Gd.
  set (L := added (n_p T) (fun c => Rabs (value F (w c)) * value F (half T bin t point c))) in *.
  set (H := value F (run_support T run)) in *.
  assert (L0 : 0 <= L).
  { apply added_pos. intros c Hc. apply Rmult_le_pos; [apply Rabs_pos|apply Fh]. }
  assert (Size0 : 0 <= size).
  { unfold size. assert (0 <= u * sized) by (apply Rmult_le_pos; lra). lra. }
  assert (Norm0 : 0 <= one_norm (n_p T) w) by (apply added_pos; intros; apply Rabs_pos).
  assert (Lost : close lost L (lost_by deep many L) (reach_of deep many L)).
  { assert (E1 : added (n_p T) (fun c => Rabs (value F (size_of (w c)))
                    * value F (half T bin t point c)) = L).
    { apply added_ext. intros c Hc. destruct (size_close (w c) (Fw c Hc)) as [_ ->].
      rewrite Rabs_Rabsolu. reflexivity. }
    assert (E2 : added (n_p T) (fun c => value F (size_of (w c))
                    * value F (half T bin t point c)) = L).
    { apply added_ext. intros c Hc. destruct (size_close (w c) (Fw c Hc)) as [_ ->]. reflexivity. }
    pose proof (Rabs_pos H).
    destruct (dot_close (n_p T) (fun c => size_of (w c)) (half T bin t point)
      (fun c => value F (half T bin t point c)) (fun _ => 0)
      (fun c => value F (half T bin t point c)) deep many lost) as [D1 [D2 D3]].
    - intros c Hc. apply size_close, Fw, Hc.
    - intros c Hc. destruct (Fh bin t point c) as [Fc Vc]. split; [exact Fc|].
      rewrite Rminus_diag_eq, Rabs_R0, Rabs_right by (reflexivity || lra). lra.
    - exact Gl.
    - rewrite E1. lra.
    - rewrite E1, E2 in *. rewrite added_scaled, Rmult_0_r, Rplus_0_l in D2.
      split; [exact D1|]. split; assumption. }
  destruct Lost as [Fl [El Sl]].
  destruct (sum_is F (run_support T run) lost lh FH Fl) as [Flh Nlh].
  { fold H. eapply Rle_trans; [apply Rabs_triang|]. lra. }
  { exact Gs. }
  fold H in Nlh.
  assert (One : forall knot z, (knot <= n_steps T)%nat ->
    row_gives (n_p T) w (fun c => path (at_knot T knot point c)) z -> less F lh z = true ->
    H - room * one_norm (n_p T) w + L
    < along (n_p T) w (fun c => place T (values p0) (values k) (at_knot T knot point c))).
  { intros knot z Hk Gz Lz.
    destruct (row_close (n_p T) w (fun c => path (at_knot T knot point c))
      (fun c => place T (values p0) (values k) (at_knot T knot point c)) off size z Fw)
      as [Fz [Ez Sz]].
    - intros c Hc. apply Cp. unfold at_knot, n_path. specialize (Hpt (run_pair T run) i).
      fold point in Hpt. simpl. nia.
    - exact B1.
    - exact Gz.
    - apply (less_is F) in Lz; auto.
      eapply (beyond (one_norm (n_p T) w) H L (value F lost) (value F lh) (value F z)); eauto.
      + apply Rmult_le_pos; lra.
      + split; [unfold g; lra|exact Hg].
      + unfold least. apply Rmult_le_pos; [apply Rmult_le_pos; [apply pos_INR|lra]|lra]. }
  specialize (He run). destruct Hs as [-> | ->].
  - apply (One t st); auto. lia.
  - apply (One (S t) fi); auto. lia.
Qed.

(* ---- The theorem. ---- *)

(* Where the header gives 1, the plan keeps to one of its corridors in real numbers. *)
Theorem safe_is_kept : forall p0 k, is_safe T p0 k -> keeps T room (values p0) (values k).
Proof.
  intros p0 k [bin [out [path [Hbin [Hp0 [Hstart [Hnet [Hmoved [Hgoal [c [Hc Hruns]]]]]]]]]]].
  pose proof Fits as [Hp [Hb [Hin [He Hpt]]]]. pose proof Finite as [Fe [Ff [Fs [Fg [Fr Fh]]]]].
  pose proof Pay as [S0 [Beta0 [Most0 [SL [Hg [Nb [Ps [Pg Pr]]]]]]]].
  destruct (bin_close k bin Hbin) as [In Ck].
  pose proof (start_close p0 Hp0) as Cp.
  assert (Co : forall i, (i < n_out)%nat ->
    close (out i) (network_is (net T) (values k) i) beta most).
  { apply (network_close (net T) k (values k) (fun _ => 0) largest_k n_out beta most out); auto.
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
