(* What the emitted code does (is_safe of safe_set.h) in any arithmetic, and what it is to mean. *)
From Coq Require Import Reals Lra List Arith Bool.
From ParcJax.Onboard Require Import Arithmetic Sums Network Rows Tube.
Open Scope R_scope.

Section Header.
Context {F : arithmetic}.

(* The tables of a header, by the names that they have there. *)
Record tables := {
  n_p : nat;
  n_c : nat;
  n_q : nat;
  n_k : nat;
  n_steps : nat;
  net : list (layer F);
  n_bins : nat -> nat; (* along an axis of K *)
  edge : nat -> nat -> number F; (* of an axis *)
  far : nat -> number F;
  n_start : nat;
  start_A : nat -> nat -> number F;
  start_b : nat -> number F;
  n_goal : nat;
  goal_A : nat -> nat -> number F;
  goal_b : nat -> nat -> number F; (* of a bin and a row *)
  n_bases : nat;
  errors : nat -> nat -> nat -> nat -> basis F; (* of a bin, an interval, a point and a basis *)
  n_part : nat;
  pair_point : nat -> nat -> nat;
  n_corridors : nat;
  first_run : nat -> nat;
  run_pair : nat -> nat;
  run_first : nat -> nat;
  run_end : nat -> nat;
  run_w : nat -> nat -> number F;
  run_support : nat -> number F
}.

Variable T : tables.

Definition n_path : nat := S (n_steps T) * n_c T.
Definition at_knot (t point c : nat) : nat := t * n_c T + point * n_p T + c.

(* ---- The code. ---- *)

Fixpoint walk (e : nat -> number F) (x : number F) (steps along : nat) : nat :=
  match steps with
  | O => along
  | S more => if at_most F (e (S along)) x then walk e x more (S along) else along
  end.

(* x == edge[along] of the code is x <= edge[along] here, as the other half is known. *)
Definition bin_along (e : nat -> number F) (n : nat) (x : number F) : option nat :=
  if at_most F (e 0%nat) x && at_most F x (e n) then
    let along := walk e x (n - 1) 0 in
    if (0 <? along)%nat && at_most F x (e along) then None else Some along
  else None.

Fixpoint bin_of (k : nat -> number F) (j : nat) : option nat :=
  match j with
  | O => Some 0%nat
  | S i =>
      match bin_of k i, bin_along (edge T i) (n_bins T i) (k i) with
      | Some bin, Some along => Some (bin * n_bins T i + along)%nat
      | _, _ => None
      end
  end.

Definition row_met (n : nat) (a x : nat -> number F) (b : number F) : Prop :=
  exists s, row_gives n a x s /\ at_most F s b = true.

Definition moved (p0 out path : nat -> number F) : Prop :=
  (forall at_, (at_ < n_path)%nat ->
     sum F (if (at_ <? n_p T)%nat then zero F else out (at_ - n_p T)%nat)
           (p0 (at_ mod n_p T)) (path at_)) /\
  (forall at_, (n_path <= at_ < n_path + n_q T)%nat -> path at_ = out (at_ - n_p T)%nat).

(* Which basis reaches least is left open: each bounds the errors. *)
Definition lost_gives (w : nat -> number F) (bin t point : nat) (lost : number F) : Prop :=
  exists b, (b < n_bases T)%nat /\ reaches (n_p T) w (errors T bin t point b) lost.

Definition apart (path : nat -> number F) (bin run t : nat) : Prop :=
  let w := run_w T run in
  forall i, (i < n_part T)%nat -> exists lost least start finish,
    let point := pair_point T (run_pair T run) i in
    lost_gives w bin t point lost /\
    sum F (run_support T run) lost least /\
    row_gives (n_p T) w (fun c => path (at_knot t point c)) start /\
    row_gives (n_p T) w (fun c => path (at_knot (S t) point c)) finish /\
    less F least start = true /\ less F least finish = true.

(* is_safe gives 1. The intervals that it tries first are left out: they can only make it 0. *)
Definition is_safe (p0 k : nat -> number F) : Prop := exists bin out path,
  bin_of k (n_k T) = Some bin /\
  (forall c, (c < n_p T)%nat ->
     at_most F (negated F (far T c)) (p0 c) = true /\ at_most F (p0 c) (far T c) = true) /\
  (forall row, (row < n_start T)%nat -> row_met (n_p T) (start_A T row) p0 (start_b T row)) /\
  network_gives (net T) k out /\
  moved p0 out path /\
  (forall row, (row < n_goal T)%nat ->
     row_met (n_c T + n_q T) (goal_A T row) (fun c => path (n_steps T * n_c T + c)%nat)
       (goal_b T bin row)) /\
  exists corridor, (corridor < n_corridors T)%nat /\
    forall run t, (first_run T corridor <= run < first_run T (S corridor))%nat ->
      (run_first T run <= t < run_end T run)%nat -> apart path bin run t.

(* ---- The meaning, in real numbers. ---- *)

Fixpoint bin_at (place : nat -> nat) (j : nat) : nat :=
  match j with
  | O => 0%nat
  | S i => (bin_at place i * n_bins T i + place i)%nat
  end.

(* k is in K and in this bin, and on no border between two. *)
Definition inside_bin (k : nat -> R) (bin : nat) : Prop := exists place : nat -> nat,
  bin_at place (n_k T) = bin /\
  forall j, (j < n_k T)%nat -> let e i := value F (edge T j i) in
    (place j < n_bins T j)%nat /\
    e 0%nat <= k j <= e (n_bins T j) /\
    (place j = 0%nat \/ e (place j) < k j) /\
    (S (place j) = n_bins T j \/ k j < e (S (place j))).

(* Where the model says that the robot is, and its q. *)
Definition place (p0 k : nat -> R) (at_ : nat) : R :=
  (if (at_ <? n_p T)%nat then 0 else network_is (net T) k (at_ - n_p T)%nat)
  + (if (at_ <? n_path)%nat then p0 (at_ mod n_p T) else 0).

Definition end_of (p0 k : nat -> R) (c : nat) : R := place p0 k (n_steps T * n_c T + c)%nat.

(* [T27] The plan keeps to a corridor, with the tables' thresholds less room for each unit of |w|_1:
   along w each point of the part is beyond the obstacle's support and what its errors reach. *)
Definition kept (room : R) (p0 k : nat -> R) (bin corridor : nat) : Prop :=
  forall run t i s, (first_run T corridor <= run < first_run T (S corridor))%nat ->
    (run_first T run <= t < run_end T run)%nat -> (i < n_part T)%nat -> s = t \/ s = S t ->
    let w := run_w T run in
    let point := pair_point T (run_pair T run) i in
    exists b, (b < n_bases T)%nat /\
    value F (run_support T run) - room * one_norm (n_p T) w
      + reach (n_p T) w (errors T bin t point b)
    < along (n_p T) w (fun c => place p0 k (at_knot s point c)).

Definition keeps (room : R) (p0 k : nat -> R) : Prop := exists bin,
  inside_bin k bin /\
  (forall row, (row < n_start T)%nat ->
     along (n_p T) (start_A T row) p0
       <= value F (start_b T row) + room * one_norm (n_p T) (start_A T row)) /\
  (forall row, (row < n_goal T)%nat ->
     along (n_c T + n_q T) (goal_A T row) (end_of p0 k)
       <= value F (goal_b T bin row) + room * one_norm (n_c T + n_q T) (goal_A T row)) /\
  exists corridor, (corridor < n_corridors T)%nat /\ kept room p0 k bin corridor.

(* The same, told of every error that the tube allows. *)
Definition in_tube (bin t point : nat) (e : nat -> R) : Prop := forall b, (b < n_bases T)%nat ->
  between_faces (n_p T) (errors T bin t point b) e.

Theorem kept_whatever_the_error : forall room p0 k bin corridor, kept room p0 k bin corridor ->
  forall run t i s e, (first_run T corridor <= run < first_run T (S corridor))%nat ->
    (run_first T run <= t < run_end T run)%nat -> (i < n_part T)%nat -> s = t \/ s = S t ->
    let w := run_w T run in
    let point := pair_point T (run_pair T run) i in
    in_tube bin t point e ->
    value F (run_support T run) - room * one_norm (n_p T) w
    < along (n_p T) w (fun c => place p0 k (at_knot s point c) + e c).
Proof.
  intros room p0 k bin corridor Kept run t i s e Hrun Ht Hi Hs w point In.
  destruct (Kept run t i s Hrun Ht Hi Hs) as [b [Hb Beyond]]. fold w point in Beyond.
  pose proof (reach_holds (n_p T) w _ e (In b Hb)) as Reach.
  assert (Moved : along (n_p T) w (fun c => place p0 k (at_knot s point c) + e c)
    = along (n_p T) w (fun c => place p0 k (at_knot s point c)) + along (n_p T) w e).
  { unfold along. rewrite <- added_plus. apply added_ext. intros c _. ring. }
  lra.
Qed.

End Header.
Arguments tables : clear implicits.
