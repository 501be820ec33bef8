(* Episodes: what a file of one holds, its checker, and the words of `accepted_episode`
   (EpisodeFacts.v) and `accepted_place`, which say what is true of an episode that is accepted. *)
From Coq Require Import Reals QArith Qreals List Bool Arith ZArith.
From ParcJax Require Import Spec Arithmetic Checker Doubt NoPlan Answer.
Import ListNotations.

(* ---- What a file holds ---- *)
Open Scope Q_scope.
(* A plan that could not be read is None.  pose: the place of point 0, in the world; heading [rad]:
   0 where nothing turns. *)
Record manoeuvre := Manoeuvre {
  begin : Q; pose : vec; heading : Q; asked : problem; its_hints : list goal_hints;
  its_plan : option sample }.
(* turning: all of a manoeuvre is told in the frame of the robot as it begins, from the origin.
   doubt: half widths of what the place of a pose may be off by.  tick: seconds of an interval. *)
Record episode := Episode {
  its_net : list layer; its_tube : tube; tick : Q; turning : bool; doubt : vec;
  done : list manoeuvre }.
Definition start_of (e : episode) (m : manoeuvre) : vec := if turning e then [] else pose m.

(* ---- The checker ---- *)
Section Same.
  Context {A : Type} (alike : A -> A -> bool).
  Fixpoint all_alike (u v : list A) : bool :=
    match u, v with
    | [], [] => true | a :: u', b :: v' => alike a b && all_alike u' v' | _, _ => false
    end.
End Same.
Definition spelled_alike (a b : Q) : bool :=
  Z.eqb (Qnum a) (Qnum b) && Z.eqb (Zpos (Qden a)) (Zpos (Qden b)).
Definition shape_alike (a b : shape) : bool :=
  match a, b with
  | Disc r, Disc s => spelled_alike r s
  | Hull u, Hull v => all_alike (all_alike spelled_alike) u v
  | _, _ => false
  end.
Definition part_alike (a b : part) : bool :=
  all_alike Nat.eqb (corners a) (corners b) && shape_alike (grown_by a) (grown_by b).
(* of one robot: sizes and body *)
Definition robot_alike (P Q : problem) : bool :=
  Nat.eqb (n_p P) (n_p Q) && Nat.eqb (n_q P) (n_q Q) && Nat.eqb (n_k P) (n_k Q) &&
  Nat.eqb (n_points P) (n_points Q) && Nat.eqb (steps P) (steps Q) &&
  all_alike part_alike (parts P) (parts Q).
Definition check_manoeuvre (e : episode) (P : problem) (m : manoeuvre) : bool :=
  match its_plan m with
  | None => false
  | Some s => robot_alike P (asked m) && Nat.eqb (length (pose m)) (n_p P) &&
      same (sample_p0 s) (start_of e m) && context_ok (asked m) (its_net e) (its_tube e) &&
      check_sample (asked m) (its_net e) (its_tube e) (its_hints m) s
  end.
(* at least half a tick apart *)
Fixpoint begins_ok (dt : Q) (l : list manoeuvre) : bool :=
  match l with
  | m :: (m' :: _) as l' => qle dt (qmul 2 (qadd (begin m') (- begin m))) && begins_ok dt l'
  | _ => true
  end.
Inductive verdict_of_episode :=
  | Shapeless | Stopped (marks : list bool)
  (* manoeuvres; bins, and those whose tube leaves out the model itself *)
  | Driven (manoeuvres bins_ without : nat).
Definition check_episode (e : episode) : verdict_of_episode :=
  match done e with
  | [] => Shapeless
  | m0 :: _ =>
      if qlt 0 (tick e) && begins_ok (tick e) (done e) &&
         Nat.eqb (length (doubt e)) (n_p (asked m0)) && forallb (qle 0) (doubt e) then
        let marks := map (fun m => told (check_manoeuvre e (asked m0) m)) (done e) in
        if forallb (fun ok => ok) marks then
          Driven (length (done e)) (length (bins (its_tube e)))
                 (length (filter (fun B => negb (centred B)) (bins (its_tube e))))
        else Stopped marks
      else Shapeless
  end.

(* ---- What the theorems speak of: time in seconds, and where the points of a robot are ---- *)
Open Scope R_scope.
(* every manoeuvre, with when the next one begins *)
Fixpoint turns (l : list manoeuvre) : list (manoeuvre * option Q) :=
  match l with
  | [] => []
  | m :: l' => (m, match l' with [] => None | m' :: _ => Some (begin m') end) :: turns l'
  end.
Definition under_way (turn : manoeuvre * option Q) (time : R) : Prop :=
  Q2R (begin (fst turn)) <= time /\ match snd turn with None => True | Some b => time < Q2R b end.
(* the time since its begin, in intervals; who came to the end rests there *)
Definition clock (e : episode) (m : manoeuvre) (time : R) : R :=
  Rmin (INR (steps (asked m))) ((time - Q2R (begin m)) / Q2R (tick e)).
(* While it is under way the points of the robot, `where_`, keep to a trajectory in its tube, told
   from u in place of its stated start, and rest where that ends. *)
Definition keeps_to (e : episode) (turn : manoeuvre * option Q) (u : rv) (where_ : R -> nat -> rv)
  : Prop :=
  exists s B tau, its_plan (fst turn) = Some s /\ In B (bins (its_tube e)) /\
    inBox (box B) (toR (sample_k s)) /\
    in_tube (asked (fst turn)) (its_net e) B u (toR (sample_k s)) tau /\
    forall time, under_way turn time ->
      forall i a, where_ time i a = at_ tau (clock e (fst turn) time) i a.
(* No point of the body is in an obstacle that is there then, moved by `off`.  Of obstacles with
   intervals those are there to whoever rests which are there in the last. *)
Definition clear_of (e : episode) (m : manoeuvre) (off : rv) (where_ : R -> nat -> rv) (time : R)
  : Prop :=
  forall o t b x, In o (obstacles (asked m)) -> (first o <= t <= last o)%nat ->
    INR t <= clock e m time <= INR (S t) ->
    In b (parts (asked m)) -> inPart (n_p (asked m)) b (where_ time) x ->
    ~ inPoly (rows o) (fun a => x a - off a).
(* a place of the plane, as it is seen from another one with a heading h *)
Definition seen_from (from : rv) (h : R) (x : rv) : rv := fun a =>
  match a with
  | O => cos h * (x O - from O) + sin h * (x 1%nat - from 1%nat)
  | 1%nat => cos h * (x 1%nat - from 1%nat) - sin h * (x O - from O)
  | _ => 0
  end.
(* an obstacle less a box of half widths d: what is in it, is in the obstacle when moved by any of
   the box *)
Definition less_a_box (d : vec) (A : poly) : poly :=
  map (fun ab => (fst ab, (snd ab - dotQ (vabs (fst ab)) d)%Q)) A.
(* What three copies of a point stand for where headings are off: the point under three maps of the
   plane, which turn and stretch it as complex numbers do, a + ib, a - ib and g. *)
Definition mapped (re im : R) (x : rv) : rv := fun i =>
  match i with
  | O => re * x O - im * x 1%nat | 1%nat => im * x O + re * x 1%nat | _ => 0
  end.
Definition copy (a b g : R) (c : nat) : rv -> rv :=
  match c with O => mapped a b | 1%nat => mapped a (- b) | _ => mapped g 0 end.
(* every turn by no more than an angle is in their triangle *)
Definition hold_turns (angle a b g : R) : Prop :=
  0 <= angle <= PI /\ 0 < a < g /\ 0 < b /\ a <= cos angle /\
  b * b + (g - a) * (g - a) <= g * g * (b * b).
(* a part of the body, as a file has it that asks about three copies of each point *)
Definition copied (p : part) : part :=
  Part (flat_map (fun i => [3 * i; 3 * i + 1; 3 * i + 2]%nat) (corners p)) (grown_by p).
