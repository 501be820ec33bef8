(* The checker of proofs that no plan exists, and of bounds on the volume of the safe ones [T30].
   Nothing here has to be believed: NoPlanFacts.v says what its answer `true` means. *)
From Coq Require Import ZArith QArith Qabs List Bool Arith.
Require Import Spec Arithmetic Checker Doubt.
Import ListNotations.
Open Scope Q_scope.

(* ---- What a proof holds: a tree over the boxes of (z, k), each leaf with its reason ---- *)
Record contact := Contact { body : vec; errors : list vec }.    (* a point of the shape (of a polygon its weights), *)
Record hit := Hit {                                             (* and an error for each reference point *)
  whom : nat; which_part : nat; step : nat; share : Q; blend : vec; contacts : list contact }.
Inductive reason := Misses (m : multipliers) | Elsewhere (m : multipliers) | Hits (h : hit) | Safe (s : sepn) | Open.
Inductive tree := Leaf (r : reason) | Split (axis : nat) (cut : Q) (lower upper : tree).
Record proof := Proof { z_box : list (Q * Q); faces : list (multipliers * multipliers); root : tree }.

Definition area := list (Q * Q).
Fixpoint lower_part (i : nat) (c : Q) (B : area) : area :=
  match B, i with [], _ => [] | (lo, _) :: B', O => (lo, c) :: B' | J :: B', S i' => J :: lower_part i' c B' end.
Fixpoint upper_part (i : nat) (c : Q) (B : area) : area :=
  match B, i with [], _ => [] | (_, hi) :: B', O => (c, hi) :: B' | J :: B', S i' => J :: upper_part i' c B' end.
Fixpoint leaves (B : area) (t : tree) : list (area * reason) :=
  match t with
  | Leaf r => [(B, r)]
  | Split i c l u => leaves (lower_part i c B) l ++ leaves (upper_part i c B) u
  end.
Fixpoint splits_ok (B : area) (t : tree) : bool :=
  match t with
  | Leaf _ => true
  | Split i c l u => match nth_error B i with Some (lo, hi) => qlt lo c && qlt c hi | None => false end &&
                     splits_ok (lower_part i c B) l && splits_ok (upper_part i c B) u
  end.
Definition thick (B : area) : bool := forallb (fun I => qlt (fst I) (snd I)) B.

(* ---- What the last hidden layer holds, for the k of a box: in the hull of one of these lists (if marked true) ---- *)
Definition steady (L : layer) (V : list vec) : bool :=
  forallb (fun f => forallb (fun v => qle 0 (value f v)) V || forallb (fun v => qle (value f v) 0) V) L.
Fixpoint hidden (Ls : list layer) (V : list vec) : list (bool * list vec) :=
  match Ls with
  | [] => [(true, V)]
  | L :: Ls' => match Ls' with
    | [] => [(true, V)]
    | _ => flat_map (fun c => if steady L (snd c)
                              then hidden Ls' (map (fun v => reluQ (layerQ L v)) (snd c)) else [(false, [])])
                    (split_layer L V)
    end
  end.
Definition cells := list (bool * list vec).
Definition everywhere (cs : cells) (Z : area) (test : vec -> bool) : bool :=
  forallb (fun c => fst c && forallb (fun h => forallb (fun z => test (z ++ h)) (corners_of Z)) (snd c)) cs.

(* ---- The model as forms in z and the last hidden layer ---- *)
Record frame := Frame { start_ : list aff; outs : list aff; knots : list (list aff); ends_ : list aff }.
Definition last_layer (N : list layer) : layer := List.last N [].
Definition width_in (N : list layer) : nat := match last_layer N with (w, _) :: _ => length w | [] => O end.
Definition frame_of (P : problem) (N : list layer) : frame :=
  let Y := layerA (last_layer N) (map unit_form (seq (n_p P) (width_in N))) in
  let moved a := nth (steps P * (n_points P * n_p P) + a) (padded P Y) (aconst 0) in
  let X := map (fun a => aadd (unit_form a) (aneg (moved a))) (seq 0 (n_p P)) in
  let K := places P X Y in
  Frame X Y K (endA P K Y).

(* ---- Widths ---- *)
Definition width (e : error) : vec := match e with Widths w => w | Rows _ => [] end.
Definition plain (B : bin) : bool :=
  let has e := match e with Widths _ => true | Rows _ => false end in
  forallb (forallb has) (interval B) && has (final B).
Fixpoint vmin (u v : vec) : vec :=
  match u, v with [], _ => v | _, [] => u | a :: u', b :: v' => (if qle a b then a else b) :: vmin u' v' end.
Fixpoint least_of (l : list vec) : vec :=
  match l with [] => [] | [v] => v | v :: l' => vmin v (least_of l') end.
(* A trajectory's end keeps to the final widths and to those of the last interval. *)
Definition end_widths (P : problem) (B : bin) : vec :=
  vmin (concat (map width (nth (steps P - 1) (interval B) []))) (width (final B)).
Definition shrunk (e : vec) (A : poly) : poly := map (fun ab => (fst ab, qadd (snd ab) (- dotQ (vabs (fst ab)) e))) A.
Fixpoint overlaps (A B : area) : bool :=             (* their interiors *)
  match A, B with (a, b) :: A', (c, d) :: B' => qlt a d && qlt c b && overlaps A' B' | _, _ => true end.
Definition met (bs : list bin) (D : area) : list bin := filter (fun B => overlaps (box B) D) bs.

(* ---- A hit: at each point one of the contacts lies in the obstacle ---- *)
Definition fits (A : poly) (m : multipliers) : bool :=
  positive m && forallb (fun im => (fst im <? length A)%nat) m.
Definition is_mixture (n : nat) (lam : vec) : bool :=
  Nat.eqb (length lam) n && forallb (qle 0) lam && Qeq_bool (fold_right qadd 0 lam) 1.
Fixpoint mixQ (lam : vec) (vs : list vec) : vec :=
  match lam, vs with l :: lam', v :: vs' => vadd (vscale l v) (mixQ lam' vs') | _, _ => [] end.
Definition body_ok (n : nat) (b : shape) (v : vec) : bool :=
  match b with Disc r => Nat.eqb (length v) n && qle (dotQ v v) (qmul r r) | Hull vs => is_mixture (length vs) v end.
Definition body_point (b : shape) (v : vec) : vec := match b with Disc _ => v | Hull vs => mixQ v vs end.
Fixpoint small (e w : vec) : bool :=
  match e, w with [], [] => true | a :: e', b :: w' => qle (Qabs a) b && small e' w' | _, _ => false end.
Definition errors_fit (P : problem) (c : contact) (Es : list vec) : bool :=
  Nat.eqb (length (errors c)) (length Es) && forallb (fun ew => small (fst ew) (snd ew)) (combine (errors c) Es).
(* The widths at the time of knot j: of the intervals before and after it, and at the end the final ones. *)
Fixpoint chunk_vec (n T : nat) (w : vec) : list vec :=
  match T with O => [] | S T' => firstn n w :: chunk_vec n T' (skipn n w) end.
Definition widths_at (B : bin) (t : nat) : list vec := map width (nth t (interval B) []).
Definition at_knot (P : problem) (B : bin) (j : nat) : list (list vec) :=
  (if (0 <? j)%nat then [widths_at B (j - 1)] else []) ++
  [if (j <? steps P)%nat then widths_at B j else chunk_vec (n_p P) (n_points P) (width (final B))].
Definition between (h : hit) : bool := qlt 0 (share h) && qlt (share h) 1.
Definition knot_of (h : hit) : nat := if qle 1 (share h) then S (step h) else step h.
Definition contact_ok (P : problem) (bs : list bin) (b : part) (h : hit) (c : contact) : bool :=
  body_ok (n_p P) (grown_by b) (body c) && forallb (fun B => errors_fit P c (widths_at B (step h))) bs.
(* Between knots, or where the errors fit both neighbours of a knot, touching is enough.  Elsewhere the contact has to be
   inside the obstacle, so that there is one a moment from the knot. *)
Definition loose (P : problem) (bs : list bin) (h : hit) : bool :=
  between h ||
  forallb (fun c => forallb (fun B => forallb (errors_fit P c) (at_knot P B (knot_of h))) bs) (contacts h).
Definition moment (P : problem) (F : frame) (t i : nat) (s : Q) : list aff :=
  zadd (map (ascale (qadd 1 (- s))) (nth (t * n_points P + i) (knots F) []))
       (map (ascale s) (nth (S t * n_points P + i) (knots F) [])).
Fixpoint blended (n : nat) (lam : vec) (Ps : list (list aff)) : list aff :=
  match lam, Ps with
  | l :: lam', Q :: Ps' => zadd (map (ascale l) Q) (blended n lam' Ps')
  | _, _ => repeat (aconst 0) n
  end.
Definition offset (b : part) (h : hit) (c : contact) : vec :=
  vadd (body_point (grown_by b) (body c)) (mixQ (blend h) (map (fun i => nth i (errors c) []) (corners b))).
Definition touching (strict : bool) (A : poly) (M : list aff) (d : vec) : list row :=
  map (fun ab => (strict, aadd (aneg (lincomb (fst ab) M)) (aconst (qadd (snd ab) (- dotQ (fst ab) d))))) A.
Definition check_hit (P : problem) (F : frame) (bs : list bin) (Z : area) (cs : cells) (h : hit) : bool :=
  match nth_error (obstacles P) (whom h), nth_error (parts P) (which_part h) with
  | Some o, Some b =>
      (first o <=? step h)%nat && (step h <=? last o)%nat && qle 0 (share h) && qle (share h) 1 &&
      is_mixture (length (corners b)) (blend h) && forallb (contact_ok P bs b h) (contacts h) &&
      let M := blended (n_p P) (blend h) (map (fun i => moment P F (step h) i (share h)) (corners b)) in
      let strict := negb (loose P bs h) in
      let options := map (fun c => touching strict (rows o) M (offset b h c)) (contacts h) in
      everywhere cs Z (fun v => existsb (forallb (holdsQ v)) options)
  | _, _ => false
  end.

(* ---- Leaves ---- *)
Definition exceeds (wh : vec * Q) (X : list aff) : row := (true, aadd (lincomb (fst wh) X) (aconst (- snd wh))).
Definition about_z (P : problem) (w : vec) : bool := negb (nonzero (skipn (n_p P) w)).
Definition goal_rows_of (P : problem) (bs : list bin) : poly := shrunk (least_of (map (end_widths P) bs)) (goal P).
Definition needs_cells (P : problem) (r : reason) : bool :=
  match r with Misses m => negb (about_z P (fst (combine_rows (goal P) m))) | Open => false | _ => true end.
Definition check_leaf (P : problem) (F : frame) (bins_ : list bin) (Z D : area) (cs : cells) (r : reason) : bool :=
  let bs := met bins_ D in
  match r with
  | Misses m =>
      let wh := combine_rows (goal_rows_of P bs) m in
      fits (goal P) m &&
      (if about_z P (fst wh) then forallb (fun z => qlt (snd wh) (dotQ (firstn (n_p P) (fst wh)) z)) (corners_of Z)
       else everywhere cs Z (fun v => holdsQ v (exceeds wh (ends_ F))))
  | Elsewhere m =>
      fits (start P) m && let r := exceeds (combine_rows (start P) m) (start_ F) in everywhere cs Z (fun v => holdsQ v r)
  | Hits h => check_hit P F bs Z cs h
  | Safe s =>
      sep_ok P s && let ds := dirs_of P s in
      forallb (fun B => let rows := conditions P ds B [] (start_ F) (outs F) in
                        everywhere cs Z (fun v => forallb (holdsQ v) rows)) bs
  | Open => true
  end.
(* Neighbouring leaves often share their box of k: its cells are kept. *)
Definition same_number (a b : Q) : bool := Z.eqb (Qnum a) (Qnum b) && Pos.eqb (Qden a) (Qden b).
Fixpoint same_box (A B : area) : bool :=
  match A, B with
  | [], [] => true
  | (a, b) :: A', (c, d) :: B' => same_number a c && same_number b d && same_box A' B'
  | _, _ => false
  end.
Definition cells_in (N : list layer) (D : area) : cells := hidden N (corners_of D).
Fixpoint check_leaves (P : problem) (N : list layer) (F : frame) (bins_ : list bin) (kept : area * cells)
    (ls : list (area * reason)) : bool :=
  match ls with
  | [] => true
  | (B, r) :: ls' =>
      let Z := firstn (n_p P) B in let D := skipn (n_p P) B in
      let now := if negb (needs_cells P r) then kept
                 else if same_box D (fst kept) then kept else (D, cells_in N D) in
      thick B && check_leaf P F bins_ Z D (if needs_cells P r then snd now else []) r &&
      check_leaves P N F bins_ now ls'
  end.
Fixpoint check_faces (P : problem) (A : poly) (i : nat) (Z : area) (fs : list (multipliers * multipliers)) : bool :=
  match Z, fs with
  | [], [] => true
  | (lo, hi) :: Z', (l, u) :: fs' =>
      let (w, h) := combine_rows A l in let (v, g) := combine_rows A u in
      fits A l && fits A u && same w (vscale (-1) (unit_vec i)) && qle h (- lo) &&
      same v (unit_vec i) && qle g hi && check_faces P A (S i) Z' fs'
  | _, _ => false
  end.
Definition leaves_of (P : problem) (p : proof) := leaves (z_box p ++ domain P) (root p).
Definition check_proof (P : problem) (N : list layer) (E : tube) (p : proof) : bool :=
  let all := bins E in
  forallb plain all && Nat.eqb (length (z_box p)) (n_p P) && thick (z_box p ++ domain P) &&
  check_faces P (goal_rows_of P (filter (fun B => meets (box B) (domain P)) all)) 0 (z_box p) (faces p) &&
  splits_ok (z_box p ++ domain P) (root p) && check_leaves P N (frame_of P N) all ([], cells_in N []) (leaves_of P p).

(* ---- What it says ---- *)
Definition is_unsafe (r : reason) : bool := match r with Misses _ | Elsewhere _ | Hits _ => true | _ => false end.
Definition is_safe (r : reason) : bool := match r with Safe _ => true | _ => false end.
Definition check_no_plan P N E p := forallb (fun l => is_unsafe (snd l)) (leaves_of P p) && check_proof P N E p.
Definition volumeQ (B : area) : Q := fold_right (fun I acc => qmul (qadd (snd I) (- fst I)) acc) 1 B.
Definition sum_of (pick : reason -> bool) (ls : list (area * reason)) : Q :=
  fold_right (fun l acc => if pick (snd l) then qadd (volumeQ (fst l)) acc else acc) 0 ls.
Definition volumes (P : problem) (p : proof) : Q * Q * Q :=                     (* safe, unsafe, all *)
  let ls := leaves_of P p in (sum_of is_safe ls, sum_of is_unsafe ls, volumeQ (z_box p ++ domain P)).
