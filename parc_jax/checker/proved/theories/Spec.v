(* What the theorems speak of.  What they say of it is in Statements.v, which names what else has
   to be read. *)
From Coq Require Import Reals QArith Qreals List Arith.
Import ListNotations.
Open Scope R_scope.

(* ---- Vectors: rational ones are lists, real ones functions from the number of a coordinate,
   from 0 ---- *)
Definition vec := list Q.
Definition rv := nat -> R.
Definition shift (x : rv) : rv := fun i => x (S i).
Fixpoint dotR (w : vec) (x : rv) : R :=
  match w with [] => 0 | a :: w' => Q2R a * x O + dotR w' (shift x) end.
Definition toR (v : vec) : rv := fun i => Q2R (nth i v 0%Q).
Fixpoint sumsq (n : nat) (x : rv) : R :=
  match n with O => 0 | S n' => x O * x O + sumsq n' (shift x) end.

(* ---- What an answer file holds ---- *)
(* rows (a, b) of the closed set a . x <= b *)
Definition poly := list (vec * Q).
Definition inPoly (A : poly) (x : rv) : Prop := forall a b, In (a, b) A -> dotR a x <= Q2R b.

(* there in the steps first .. last *)
Record obstacle := Obstacle { rows : poly; first : nat; last : nat }.
Inductive shape := Disc (r : Q) | Hull (vertices : list vec).
(* hull of some reference points, grown *)
Record part := Part { corners : list nat; grown_by : shape }.
Record problem := Problem {
  (* sizes of a position, of the goal's extras, of k *)
  n_p : nat; n_q : nat; n_k : nat;
  (* reference points of the robot; intervals of time *)
  n_points : nat; steps : nat;
  domain : list (Q * Q); start : poly; goal : poly;
  obstacles : list obstacle; parts : list part }.

Definition layer := list (vec * Q).                     (* per neuron its weights and its bias *)

(* |error_i| <= e_i, or any polytope of errors *)
Inductive error := Widths (e : vec) | Rows (A : poly).
(* by step, by point *)
Record bin := Bin { box : list (Q * Q); interval : list (list error); final : error }.
Record tube := Tube { edges : list vec; intervals : list (list (list error)); finals : list error }.

Fixpoint inBox (B : list (Q * Q)) (x : rv) : Prop :=
  match B with [] => True | (lo, hi) :: B' => Q2R lo <= x O <= Q2R hi /\ inBox B' (shift x) end.

(* The bins of a tube: closed boxes between neighbouring edges, row-major (the last axis is the
   fastest). *)
Fixpoint gaps (e : vec) : list (Q * Q) :=
  match e with a :: (b :: _) as e' => (a, b) :: gaps e' | _ => [] end.
Fixpoint boxes (es : list vec) : list (list (Q * Q)) :=
  match es with [] => [[]] | e :: es' => flat_map (fun I => map (cons I) (boxes es')) (gaps e) end.
Fixpoint zip3 (a : list (list (Q * Q))) (b : list (list (list error))) (c : list error)
  : list bin :=
  match a, b, c with x :: a', y :: b', z :: c' => Bin x y z :: zip3 a' b' c' | _, _, _ => [] end.
Definition bins (E : tube) : list bin := zip3 (boxes (edges E)) (intervals E) (finals E).

(* ---- The network over the reals: hidden layers end in ReLU, the last is linear ---- *)
Definition layerR (L : layer) (x : rv) : rv :=
  fun i => match nth_error L i with Some (w, b) => dotR w x + Q2R b | None => 0 end.
Definition reluR (x : rv) : rv := fun i => Rmax 0 (x i).
Fixpoint netR (Ls : list layer) (x : rv) : rv :=
  match Ls with
  | [] => x
  | L :: Ls' => match Ls' with [] => layerR L x | _ => netR Ls' (reluR (layerR L x)) end
  end.

(* ---- The model.  Outputs y: the offset from p0 of every reference point at every knot of time,
   knot by knot, without the first n_p of them (point 0 starts at p0 itself), and then the
   extras q. ---- *)
Definition offsetR (P : problem) (y : rv) (j : nat) : R :=
  if (j <? n_p P)%nat then 0 else y (j - n_p P)%nat.
Definition knotR (P : problem) (p0 y : rv) (t i : nat) : rv :=          (* point i at knot t *)
  fun a => p0 a + offsetR P y ((t * n_points P + i) * n_p P + a)%nat.
(* all points at the last knot, then q *)
Definition endR (P : problem) (p0 y : rv) : rv :=
  fun j => (if (j <? n_points P * n_p P)%nat then p0 (j mod n_p P)%nat else 0)
           + offsetR P y (steps P * (n_points P * n_p P) + j)%nat.

(* ---- Trajectories: a place for each time in [0, steps] and each reference point, and the extras
   at the end ---- *)
Record trajectory := Traj { at_ : R -> nat -> rv; extras : rv }.
Definition final_state (P : problem) (tau : trajectory) : rv :=
  fun j => if (j <? n_points P * n_p P)%nat
           then at_ tau (INR (steps P)) (j / n_p P)%nat (j mod n_p P)%nat
           else extras tau (j - n_points P * n_p P)%nat.

Definition inError (n : nat) (E : error) (x : rv) : Prop :=
  match E with
  | Widths e => forall i, (i < n)%nat -> Rabs (x i) <= toR e i
  | Rows A => inPoly A x
  end.

(* The tube of one bin: in every interval every point is off the straight line between the model's
   knots by an error of that interval and point, and the end is off the model's by an error of the
   end.  (Rows []: no bound at all.) *)
Definition in_tube (P : problem) (N : list layer) (B : bin) (p0 k : rv) (tau : trajectory) : Prop :=
  let y := netR N k in
  (forall t i s, (t < steps P)%nat -> (i < n_points P)%nat -> 0 <= s <= 1 ->
     inError (n_p P) (nth i (nth t (interval B) []) (Rows []))
       (fun a => at_ tau (INR t + s) i a
                 - ((1 - s) * knotR P p0 y t i a + s * knotR P p0 y (S t) i a))) /\
  inError (n_points P * n_p P + n_q P) (final B) (fun j => final_state P tau j - endR P p0 y j).

(* ---- The robot's body when its reference points are at c: each part is the hull of some of them,
   grown ---- *)
Fixpoint mix (lam : list R) (c : list rv) : rv :=
  match lam, c with l :: lam', x :: c' => fun a => l * x a + mix lam' c' a | _, _ => fun _ => 0 end.
Definition weights (lam : list R) (n : nat) : Prop :=
  length lam = n /\ Forall (fun l => 0 <= l) lam /\ fold_right Rplus 0 lam = 1.
Definition inShape (n : nat) (b : shape) (x : rv) : Prop :=
  match b with
  | Disc r => sumsq n x <= Q2R r * Q2R r
  | Hull vs => exists lam, weights lam (length vs) /\ forall a, (a < n)%nat ->
    x a = mix lam (map toR vs) a
  end.
Definition inPart (n : nat) (b : part) (c : nat -> rv) (x : rv) : Prop :=
  exists lam g, weights lam (length (corners b)) /\ inShape n (grown_by b) g /\
                forall a, (a < n)%nat -> x a = mix lam (map c (corners b)) a + g a.

(* ---- Sentence (C) ---- *)
Definition misses (P : problem) (tau : trajectory) : Prop := ~ inPoly (goal P) (final_state P tau).
Definition touches (P : problem) (tau : trajectory) : Prop :=
  exists o t s b x, In o (obstacles P) /\ (first o <= t <= last o)%nat /\ 0 <= s <= 1 /\
    In b (parts P) /\ inPart (n_p P) b (at_ tau (INR t + s)) x /\ inPoly (rows o) x.
Definition succeeds (P : problem) (tau : trajectory) : Prop := ~ misses P tau /\ ~ touches P tau.

(* A plan (p0, k) is safe: it may start there, its k lies in a closed bin of the tube, and for every
   closed bin that contains k (on a border there are several) every trajectory in that bin's tube
   succeeds. *)
Definition safe (P : problem) (N : list layer) (E : tube) (p0 k : rv) : Prop :=
  inPoly (start P) p0 /\
  (exists B, In B (bins E) /\ inBox (box B) k) /\
  forall B, In B (bins E) -> inBox (box B) k ->
    forall tau, in_tube P N B p0 k tau -> succeeds P tau.

(* ---- No plan ---- *)
Definition continuous (tau : trajectory) : Prop := forall i a, continuity (fun s => at_ tau s i a).

(* A plan fails: it may not start there, or in the tube of some closed bin that contains k there is
   a continuous trajectory that misses the goal or touches an obstacle. *)
Definition fails (P : problem) (N : list layer) (E : tube) (p0 k : rv) : Prop :=
  ~ inPoly (start P) p0 \/
  exists B tau, In B (bins E) /\ inBox (box B) k /\ in_tube P N B p0 k tau /\ continuous tau /\
    (misses P tau \/ touches P tau).

(* ---- Volumes, in the coordinates (z, k), z = where the model's point 0 ends ---- *)
Definition place (P : problem) (N : list layer) (p0 k : rv) : rv :=
  fun i => if (i <? n_p P)%nat then endR P p0 (netR N k) i else k (i - n_p P)%nat.
Fixpoint inside (B : list (Q * Q)) (x : rv) : Prop :=
  match B with [] => True | (lo, hi) :: B' => Q2R lo < x O < Q2R hi /\ inside B' (shift x) end.
Fixpoint volume (B : list (Q * Q)) : R :=
  match B with [] => 1 | (lo, hi) :: B' => (Q2R hi - Q2R lo) * volume B' end.
Definition total (Bs : list (list (Q * Q))) : R := fold_right (fun B acc => volume B + acc) 0 Bs.
(* Boxes that fill a box and overlap nowhere but at their faces. *)
Definition tiles (Bs : list (list (Q * Q))) (B : list (Q * Q)) : Prop :=
  (forall x, inBox B x -> exists C, In C Bs /\ inBox C x) /\
  (forall C, In C Bs -> forall x, inBox C x -> inBox B x) /\
  ForallOrdPairs (fun C D => forall x, ~ (inside C x /\ inside D x)) Bs /\ total Bs = volume B.
