(* What is proved, in full: this file compiles only while every theorem says what stands here.  Read with Spec.v, which
   has the words.  What they take for granted of a problem, a network and a tube is context_ok (Checker.v).  Which plans
   belong to a polytope or a leaf is said by set_rows (Checker.v) and leaves (NoPlan.v), how far errors reach by reach,
   which directions a corridor has by dirs_of: whatever belongs is safe, but how much belongs, these say. *)
From Coq Require Import Reals QArith Qreals List.
Require Import Spec Arithmetic Checker Doubt NoPlan ArithmeticFacts ConditionFacts.
Require Theorems DoubtFacts NoPlanFacts Sanity NotVoid.
Import ListNotations.
Open Scope R_scope.

(* Bins are row-major: the last axis is the fastest. *)
Example order_of_bins : forall i f,
  map box (bins (Tube [[0; 1; 2]; [5; 6; 7]]%Q [i; i; i; i] [f; f; f; f])) =
  [[(0, 1); (5, 6)]; [(0, 1); (6, 7)]; [(1, 2); (5, 6)]; [(1, 2); (6, 7)]]%Q.
Proof. reflexivity. Qed.

(* ---- What is accepted is safe ---- *)
Definition sample_safe : forall P N E H s, context_ok P N E = true -> check_sample P N E H s = true ->
  inBox (domain P) (toR (k s)) /\ safe P N E (toR (p0 s)) (toR (k s))
  := Theorems.sample_safe.

(* All plans that keep to the directions of a corridor, in every closed bin that contains their k; its own is one. *)
Definition in_corridor P N E H sep (u x : rv) : Prop :=
  inBox (domain P) x /\
  forall B h, In (B, h) (hinted E H) -> inBox (box B) x ->
    inPoly (start P) u /\
    (forall i a b, nth_error (goal P) i = Some (a, b) ->
       exists r, reach (final B) (nth i h []) a = Some r /\ dotR a (endR P u (netR N x)) + Q2R r <= Q2R b) /\
    (forall o b d, In ((o, b), d) (combine (tasks P) (dirs_of P sep)) -> forall t, (first o <= t <= last o)%nat ->
       exists w c, dir_at d t = Some (w, c) /\ forall i, In i (corners b) ->
         exists r, reach (nth i (nth t (interval B) []) (Rows [])) [] (vscale (-1) w) = Some r /\
           Q2R c + Q2R r < dotR w (knotR P u (netR N x) t i) /\
           Q2R c + Q2R r < dotR w (knotR P u (netR N x) (S t) i)).
Definition corridor_safe : forall P N E H s, context_ok P N E = true -> check_sample P N E H s = true ->
  in_corridor P N E H (sep s) (toR (p0 s)) (toR (k s)) /\
  forall u x, in_corridor P N E H (sep s) u x -> inBox (domain P) x /\ safe P N E u x
  := Theorems.corridor_safe.

Theorem set_safe : forall P N E H s, context_ok P N E = true -> check_set P N E H s = true ->
  exists B h, nth_error (bins E) (which s) = Some B /\
  let member x := forall strict a c, In (strict, (a, c)) (set_rows P N E B h s) ->
    if strict : bool then 0 < dotR a x + Q2R c else 0 <= dotR a x + Q2R c in
  (forall x, member x -> let k := fun i => x (n_p P + i)%nat in
     inBox (domain P) k /\ inBox (box B) k /\ (forall B', In B' (bins E) -> inBox (box B') k -> B' = B) /\
     safe P N E x k) /\
  exists eps, 0 < eps /\ forall x, (forall i, Rabs (x i - toR (inner s) i) <= eps) -> member x.
Proof.
  intros P N E H s HC HK. destruct (Theorems.set_safe P N E H s HC HK) as (B & h & HB & HS & eps & He & HI).
  exists B, h. split; [exact HB|]. split.
  - intros x Hx. apply HS. intros [st [a c]] Hr. exact (Hx st a c Hr).
  - exists eps. split; [exact He|]. intros x Hx st a c Hr. exact (HI x Hx (st, (a, c)) Hr).
Qed.

Definition box_safe : forall P N E H s, context_ok P N E = true -> check_box P N E H s = true ->
  forall u x, (forall i, (i < n_p P)%nat -> Rabs (u i - toR (middle_p0 s) i) <= toR (room_p0 s) i) ->
  inBox (region s) x -> inBox (domain P) x /\ safe P N E u x
  := DoubtFacts.box_safe.

(* ---- No plan, and volumes ---- *)
Definition no_plan : forall P N E H p, context_ok P N E = true -> check_no_plan P N E H p = true ->
  forall u x, inBox (domain P) x -> fails P N E u x
  := NoPlanFacts.no_plan.

Definition volumes_true : forall P N E H p, context_ok P N E = true -> check_proof P N E H p = true ->
  let boxes pick := map fst (filter (fun l => pick (snd l)) (leaves (z_box p ++ domain P) (root p))) in
  tiles (map fst (leaves (z_box p ++ domain P) (root p))) (z_box p ++ domain P) /\
  (forall B u x, In B (boxes is_safe) -> inside B (place P N u x) -> safe P N E u x) /\
  (forall B u x, In B (boxes is_unsafe) -> inBox B (place P N u x) -> fails P N E u x) /\
  (forall u x, inBox (domain P) x -> ~ inBox (z_box p ++ domain P) (place P N u x) -> fails P N E u x) /\
  let '(safe_, unsafe_, all_) := volumes P p in
  Q2R safe_ = total (boxes is_safe) /\ Q2R unsafe_ = total (boxes is_unsafe) /\
  Q2R all_ = volume (z_box p ++ domain P)
  := NoPlanFacts.volumes_true.

(* ---- The words are not empty ---- *)
Definition failing_is_not_safe : forall P N E u x, fails P N E u x -> ~ safe P N E u x
  := NoPlanFacts.failing_is_not_safe.

(* The model's own trajectory: straight between its knots. *)
Definition model (P : problem) (N : list layer) (u x : rv) : trajectory :=
  let y := netR N x in
  Traj (fun s i a => let t := Z.to_nat (Int_part s) in
          (1 - (s - INR t)) * knotR P u y t i a + (s - INR t) * knotR P u y (S t) i a)
       (fun j => offsetR P y (steps P * (n_points P * n_p P) + (n_points P * n_p P + j))%nat).
Definition zero_allowed (P : problem) (B : bin) : Prop :=
  (forall t i, inError (n_p P) (nth i (nth t (interval B) []) (Rows [])) (fun _ => 0)) /\
  inError (n_points P * n_p P + n_q P) (final B) (fun _ => 0).

Definition tube_not_empty : forall P N B u x, (0 < n_p P)%nat -> zero_allowed P B -> in_tube P N B u x (model P N u x)
  := Sanity.tube_not_empty.

Definition a_hit_is_not_safe : forall P N E B u x o t b i r, (0 < n_p P)%nat ->
  In B (bins E) -> inBox (box B) x -> zero_allowed P B ->
  In o (obstacles P) -> (first o <= t <= last o)%nat -> inPoly (rows o) (knotR P u (netR N x) t i) ->
  In b (parts P) -> In i (corners b) -> grown_by b = Disc r -> ~ safe P N E u x
  := Sanity.a_hit_is_not_safe.

Definition not_void : forall P N E B u x, context_ok P N E = true -> In B (bins E) -> centred B = true ->
  in_tube P N B u x (model P N u x)
  := NotVoid.not_void.

Definition sample_of_something : forall P N E H s, context_ok P N E = true -> forallb centred (bins E) = true ->
  check_sample P N E H s = true -> let u := toR (p0 s) in let x := toR (k s) in
  exists B, In B (bins E) /\ inBox (box B) x /\ in_tube P N B u x (model P N u x) /\ succeeds P (model P N u x)
  := NotVoid.sample_of_something.

Definition body_not_void : forall P N E, context_ok P N E = true ->
  parts P <> [] /\ forall b, In b (parts P) -> forall c : nat -> rv, exists x, inPart (n_p P) b c x
  := NotVoid.body_not_void.
