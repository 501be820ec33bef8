(* How far the errors of a tube reach: between pairs of faces, some of which make a basis; a box is
   one basis, of the axes. T26 *)
From Coq Require Import Reals Lra Lia List PeanoNat.
From ParcJax.Onboard Require Import Arithmetic Dot Sums Network Rows.
Open Scope R_scope.

Section Tube.
Context {F : arithmetic}.

(* The errors between the faces of one basis: those sums of the rows of dual by some numbers nu
   which are about the centre, each up to half. *)
Record basis := {
  dual : nat -> nat -> number F; (* of a face and an axis *)
  centre : nat -> number F;
  half : nat -> number F
}.

Variable n : nat. (* axes of the workspace, and faces of a basis *)

Definition between_faces (B : basis) (e : nat -> R) : Prop := exists nu : nat -> R,
  (forall c, (c < n)%nat -> e c = added n (fun j => nu j * value F (dual B j c))) /\
  forall j, (j < n)%nat -> Rabs (nu j - value F (centre B j)) <= value F (half B j).

(* How far they reach against w, as computed: mu = dual . w, then for each face
   far -= centre * mu and far += half * |mu|. x - y z is x + y (- z), fused or not. *)
Definition reaches (w : nat -> number F) (B : basis) (far : number F) : Prop := exists mu,
  (forall j, (j < n)%nat -> row_gives n (dual B j) w (mu j)) /\
  row_gives (2 * n) (in_turn (centre B) (half B))
    (in_turn (fun j => negated F (mu j)) (fun j => size_of (mu j))) far.

(* And in real numbers. *)
Definition across (w : nat -> number F) (B : basis) (j : nat) : R := along n (dual B j) (values w).
Definition reach (w : nat -> number F) (B : basis) : R := added n (fun j =>
  value F (half B j) * Rabs (across w B j) - value F (centre B j) * across w B j).

(* No error of a basis reaches farther. *)
Theorem reach_holds w B e : between_faces B e -> - along n w e <= reach w B.
Proof.
  intros [nu [He Hnu]]. unfold reach.
  assert (E : along n w e = added n (fun j => nu j * across w B j)).
  { unfold along, across, along, values.
    rewrite (added_ext n _ (fun c => added n (fun j =>
      value F (w c) * (nu j * value F (dual B j c))))).
    - rewrite added_exchanged. apply added_ext. intros j _.
      rewrite Rmult_comm, <- added_scaled. apply added_ext. intros c _. ring.
    - intros c Hc. rewrite (He c Hc), Rmult_comm, <- added_scaled. apply added_ext.
      intros j _. ring. }
  rewrite E. replace (- added n (fun j => nu j * across w B j))
    with (added n (fun j => nu j * across w B j * -1)) by (rewrite added_scaled; ring).
  apply added_le. intros j Hj. specialize (Hnu j Hj).
  set (m := across w B j). set (c := value F (centre B j)) in *.
  assert (Bound : (c - nu j) * m <= value F (half B j) * Rabs m).
  { eapply Rle_trans; [apply Rle_abs|]. rewrite Rabs_mult, <- Rabs_Ropp.
    replace (- (c - nu j)) with (nu j - c) by ring.
    apply Rmult_le_compat_r; [apply Rabs_pos|exact Hnu]. }
  lra.
Qed.

(* What is asked of a basis: finite numbers; no entry of dual above steep; its faces in all at most
   wide; and no more than excess may cancel, for each unit of |w|_1: nothing of the half of a face
   whose row of dual is along an axis. *)
Variables steep wide excess : R.

Definition basis_finite (B : basis) : Prop := forall j, (j < n)%nat ->
  (forall c, (c < n)%nat -> finite F (dual B j c)) /\ finite F (centre B j) /\
  finite F (half B j) /\ 0 <= value F (half B j).

Definition along_an_axis (row : nat -> number F) : Prop := exists axis,
  forall c, (c < n)%nat -> c <> axis -> value F (row c) = 0.

Definition extent (B : basis) (j : nat) : R := Rabs (value F (centre B j)) + value F (half B j).

Definition basis_within (B : basis) : Prop :=
  0 <= steep /\ (forall j c, (j < n)%nat -> (c < n)%nat -> Rabs (value F (dual B j c)) <= steep) /\
  added n (extent B) <= wide /\
  exists slanted : nat -> R,
    (forall j, (j < n)%nat -> 0 <= slanted j /\
       (value F (half B j) <= slanted j \/ along_an_axis (dual B j))) /\
    added n (fun j => steep * (2 * Rabs (value F (centre B j)) + slanted j)) <= excess.

(* Roundings of a face, and of all of them. *)
Definition face_deep : nat := S n.
Definition face_many : nat := (2 * n)%nat.
Definition faces_deep : nat := S (2 * n).
Definition faces_many : nat := (2 * (2 * n))%nat.
Definition tube_deep : nat := (face_deep + faces_deep)%nat.
Definition tube_grown : R := (1 + u) ^ tube_deep - 1.
Definition tube_least : R := INR face_many * eta * (1 + u) ^ tube_deep * wide
  + INR faces_many * eta * (1 + u) ^ faces_deep.

Definition face_size (norm : R) : R := reach_of face_deep face_many (norm * steep).
Definition tube_size (norm : R) : R := reach_of faces_deep faces_many (wide * face_size norm).

Lemma added_turns a b (x y : nat -> R) :
  added (2 * n) (fun i => value F (in_turn a b i) * in_turn x y i)
  = added n (fun j => value F (a j) * x j + value F (b j) * y j).
Proof.
  rewrite added_in_turn. apply added_ext. intros j _. rewrite !turn_even, !turn_odd. reflexivity.
Qed.

Lemma added_turns_abs a b (x y : nat -> R) :
  added (2 * n) (fun i => Rabs (value F (in_turn a b i)) * in_turn x y i)
  = added n (fun j => Rabs (value F (a j)) * x j + Rabs (value F (b j)) * y j).
Proof.
  rewrite added_in_turn. apply added_ext. intros j _. rewrite !turn_even, !turn_odd. reflexivity.
Qed.

Section One.
Variables (w : nat -> number F) (B : basis).
Hypothesis Finite : basis_finite B.
Hypothesis Within : basis_within B.
Hypothesis Known : forall c, (c < n)%nat -> finite F (w c).
Let norm : R := one_norm n w.

Let spread (j : nat) : R := added n (fun c => Rabs (value F (dual B j c)) * Rabs (value F (w c))).
Definition terms : R := added n (fun j => extent B j * spread j).

Lemma spread_pos j : 0 <= spread j.
Proof. apply added_pos. intros c _. apply Rmult_le_pos; apply Rabs_pos. Qed.

Lemma across_spread j : Rabs (across w B j) <= spread j.
Proof.
  eapply Rle_trans; [apply added_abs|]. apply added_le. intros c _. unfold values.
  rewrite Rabs_mult. lra.
Qed.

Lemma spread_steep j : (j < n)%nat -> spread j <= norm * steep.
Proof.
  intros Hj. destruct Within as [_ [Steep _]]. unfold norm, one_norm. rewrite <- added_scaled.
  apply added_le. intros c Hc. rewrite Rmult_comm.
  apply Rmult_le_compat_l; [apply Rabs_pos|]. apply Steep; assumption.
Qed.

Lemma extent_pos j : (j < n)%nat -> 0 <= extent B j.
Proof.
  intros Hj. destruct (Finite j Hj) as [_ [_ [_ Pos]]]. unfold extent.
  pose proof (Rabs_pos (value F (centre B j))). lra.
Qed.

Lemma terms_pos : 0 <= terms.
Proof.
  apply added_pos. intros j Hj. apply Rmult_le_pos; [apply extent_pos, Hj|apply spread_pos].
Qed.

Lemma spread_along_an_axis j : along_an_axis (dual B j) -> spread j = Rabs (across w B j).
Proof.
  intros [axis Zero]. unfold spread, across, along, values.
  rewrite !(added_one n _ axis).
  - destruct (axis <? n)%nat; [symmetry; apply Rabs_mult|rewrite Rabs_R0; reflexivity].
  - intros c Hc Other. rewrite (Zero c Hc Other). ring.
  - intros c Hc Other. rewrite (Zero c Hc Other), Rabs_R0. ring.
Qed.

Lemma terms_excess : terms <= reach w B + norm * excess.
Proof.
  destruct Within as [_ [_ [_ [slanted [Slanted Excess]]]]].
  assert (Norm : 0 <= norm) by apply one_norm_pos.
  apply Rle_trans with (reach w B
    + norm * added n (fun j => steep * (2 * Rabs (value F (centre B j)) + slanted j))).
  2: { apply Rplus_le_compat_l, Rmult_le_compat_l; assumption. }
  rewrite Rmult_comm, <- added_scaled. unfold reach, terms. rewrite <- added_plus.
  apply added_le. intros j Hj. destruct (Finite j Hj) as [_ [_ [_ Half]]].
  destruct (Slanted j Hj) as [Pos Either].
  pose proof (spread_pos j) as S0. pose proof (across_spread j) as Sa.
  pose proof (spread_steep j Hj) as Ss. unfold extent.
  set (c := value F (centre B j)) in *. set (h := value F (half B j)) in *.
  set (m := across w B j) in *. set (s := spread j) in *.
  assert (Middle : Rabs c * s <= - (c * m) + 2 * Rabs c * s).
  { assert (c * m <= Rabs c * s); [|lra].
    eapply Rle_trans; [apply Rle_abs|]. rewrite Rabs_mult.
    apply Rmult_le_compat_l; [apply Rabs_pos|exact Sa]. }
  assert (Width : h * s <= h * Rabs m + slanted j * s).
  { destruct Either as [Le|Axis].
    - assert (h * s <= slanted j * s) by (apply Rmult_le_compat_r; assumption).
      assert (0 <= h * Rabs m) by (apply Rmult_le_pos; [exact Half|apply Rabs_pos]). lra.
    - unfold s, m. rewrite (spread_along_an_axis j Axis).
      assert (0 <= slanted j * Rabs (across w B j)); [|lra].
      apply Rmult_le_pos; [exact Pos|apply Rabs_pos]. }
  assert (All : (2 * Rabs c + slanted j) * s <= (2 * Rabs c + slanted j) * (norm * steep)).
  { apply Rmult_le_compat_l; [|exact Ss]. pose proof (Rabs_pos c). lra. }
  lra.
Qed.

Lemma terms_above : Rabs (reach w B) <= terms.
Proof.
  eapply Rle_trans; [apply added_abs|]. apply added_le. intros j Hj.
  destruct (Finite j Hj) as [_ [_ [_ Half]]]. unfold Rminus. unfold extent.
  eapply Rle_trans; [apply Rabs_triang|].
  rewrite Rabs_Ropp, !Rabs_mult, Rabs_Rabsolu, (Rabs_right (value F (half B j))) by lra.
  rewrite Rmult_plus_distr_r. rewrite Rplus_comm. pose proof (across_spread j) as Sa.
  apply Rplus_le_compat; apply Rmult_le_compat_l; auto using Rabs_pos.
Qed.

Lemma face_close j mu : (j < n)%nat -> face_size norm <= largest ->
  row_gives n (dual B j) w mu ->
  close mu (across w B j) (lost_by face_deep face_many (spread j))
    (reach_of face_deep face_many (spread j)).
Proof.
  intros Hj Fits Gives. destruct (Finite j Hj) as [Fd _].
  assert (Close : close mu (across w B j)
    (added n (fun c => Rabs (value F (dual B j c)) * 0)
     + lost_by face_deep face_many (spread j)) (reach_of face_deep face_many (spread j))).
  { apply (dot_close n (dual B j) w (values w) (fun _ => 0) (fun c => Rabs (value F (w c)))).
    - exact Fd.
    - intros c Hc. apply close_itself, Known, Hc.
    - exact Gives.
    - eapply Rle_trans; [|exact Fits]. apply reach_more; [apply le_n|apply spread_steep, Hj]. }
  rewrite added_scaled, Rmult_0_r, Rplus_0_l in Close. exact Close.
Qed.

Lemma turns_close m (a b : nat -> number F) ar br off_ size_ :
  (forall j, (j < m)%nat -> close (a j) (ar j) (off_ j) (size_ j)) ->
  (forall j, (j < m)%nat -> close (b j) (br j) (off_ j) (size_ j)) ->
  forall i, (i < 2 * m)%nat ->
  close (in_turn a b i) (in_turn ar br i) (in_turn off_ off_ i) (in_turn size_ size_ i).
Proof.
  intros Ka Kb i Hi. destruct (turn_cases i) as [j [-> | ->]].
  - rewrite !turn_even. apply Ka. lia.
  - rewrite !turn_odd. apply Kb. lia.
Qed.

Lemma added_extents f : added (2 * n)
    (fun i => Rabs (value F (in_turn (centre B) (half B) i)) * in_turn f f i)
  = added n (fun j => extent B j * f j).
Proof.
  rewrite added_turns_abs. apply added_ext. intros j Hj. destruct (Finite j Hj) as [_ [_ [_ Half]]].
  rewrite (Rabs_right (value F (half B j))) by lra. unfold extent. ring.
Qed.

(* What the code finds is the reach up to its rounding, of which all but the least is in
   proportion to the sizes of its terms. *)
Theorem reach_close far : face_size norm <= largest -> tube_size norm <= largest ->
  reaches w B far ->
  close far (reach w B) (tube_grown * terms + tube_least) (tube_size norm).
Proof.
  intros FaceFits TubeFits [mu [Mu Far]]. destruct Within as [Steep0 [_ [Wide _]]].
  set (off j := lost_by face_deep face_many (spread j)).
  set (sized j := reach_of face_deep face_many (spread j)).
  set (all := added n (fun j => extent B j * sized j)).
  assert (Sized : all <= wide * face_size norm).
  { apply Rle_trans with (added n (extent B) * face_size norm).
    - rewrite <- added_scaled. apply added_le. intros j Hj.
      apply Rmult_le_compat_l; [apply extent_pos, Hj|].
      apply reach_more; [apply le_n|apply spread_steep, Hj].
    - apply Rmult_le_compat_r; [|exact Wide]. apply reach_pos.
      apply Rmult_le_pos; [apply one_norm_pos|exact Steep0]. }
  assert (Faces : forall j, (j < n)%nat -> close (mu j) (across w B j) (off j) (sized j)).
  { intros j Hj. apply face_close; auto. }
  assert (Close : close far (reach w B)
    (added n (fun j => extent B j * off j) + lost_by faces_deep faces_many all)
    (reach_of faces_deep faces_many all)).
  { unfold all. rewrite <- !added_extents.
    replace (reach w B) with (added (2 * n) (fun i => value F (in_turn (centre B) (half B) i)
      * in_turn (fun j => - across w B j) (fun j => Rabs (across w B j)) i)).
    - apply (dot_close (2 * n)) with (x := in_turn (fun j => negated F (mu j))
        (fun j => size_of (mu j))).
      + intros i Hi. destruct (turn_cases i) as [j [-> | ->]];
          rewrite ?turn_even, ?turn_odd; apply Finite; lia.
      + apply turns_close; intros j Hj; [apply negated_close|apply size_close]; apply Faces, Hj.
      + exact Far.
      + rewrite added_extents. eapply Rle_trans; [|exact TubeFits].
        apply reach_more; [apply le_n|exact Sized].
    - rewrite added_turns. apply added_ext. intros j _. ring. }
  eapply close_weaker; [exact Close| |apply reach_more; [apply le_n|exact Sized]].
  assert (Off : added n (fun j => extent B j * off j) = ((1 + u) ^ face_deep - 1) * terms
    + INR face_many * eta * (1 + u) ^ face_deep * added n (extent B)).
  { unfold terms. rewrite (Rmult_comm (_ - 1)), (Rmult_comm (INR face_many * eta * _)).
    rewrite <- !added_scaled, <- added_plus. apply added_ext. intros j _.
    unfold off, lost_by. ring. }
  assert (All : all = added n (fun j => extent B j * off j) + terms).
  { unfold all, terms. rewrite <- added_plus. apply added_ext. intros j _.
    unfold sized, off. rewrite <- lost_is_reach. ring. }
  assert (Tiny : INR face_many * eta * (1 + u) ^ tube_deep * added n (extent B)
    <= INR face_many * eta * (1 + u) ^ tube_deep * wide).
  { apply Rmult_le_compat_l; [apply tiny_pos|exact Wide]. }
  rewrite All. unfold lost_by. rewrite Off. unfold tube_grown, tube_least.
  unfold tube_deep in *. rewrite pow_add in *. lra.
Qed.

End One.
End Tube.
Arguments basis : clear implicits.
