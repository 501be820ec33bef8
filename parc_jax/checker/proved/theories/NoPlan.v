(* The checker of proofs that no plan exists, and of bounds on the volume of the safe ones [T30].
   Nothing here has to be believed: NoPlanFacts.v says what its answer `true` means. *)
From Coq Require Import ZArith QArith Qabs List Bool Arith.
From ParcJax Require Import Spec Arithmetic Checker Doubt.
Import ListNotations.
Open Scope Q_scope.

(* ---- What a proof holds: a tree over the boxes of (z, k), each leaf with its reason ---- *)
(* a point of the shape (of a polygon its weights), and an *)
Record contact := Contact { body : vec; errors : list vec }.
(* error for each point of the part; contacts of one mixture *)
Record group := Group { blend : vec; contacts : list contact }.
Record hit := Hit { whom : nat; which_part : nat; step : nat; share : Q; groups : list group }.
(* of a row of the goal, and with which error *)
Record use := Use { which_row : nat; times : Q; shrink : option vec }.
Inductive reason := Misses (us : list use) | Elsewhere (m : multipliers) | Hits (h :
  hit) | Safe (s : sepn) | Open
  (* the same, by bounds of the network over the box of k *)
  | Bounded (r : reason).
Inductive tree := Leaf (r : reason) | Split (axis : nat) (cut : Q) (lower upper : tree).
Record proof := Proof { z_box : list (Q * Q); faces : list (list use * list use); root : tree }.

Definition area := list (Q * Q).
Fixpoint lower_part (i : nat) (c : Q) (B : area) : area :=
  match B, i with [], _ => [] | (lo, _) :: B', O => (lo, c) :: B' | J :: B', S i' => J ::
    lower_part i' c B' end.
Fixpoint upper_part (i : nat) (c : Q) (B : area) : area :=
  match B, i with [], _ => [] | (_, hi) :: B', O => (c, hi) :: B' | J :: B', S i' => J ::
    upper_part i' c B' end.
Fixpoint leaves (B : area) (t : tree) : list (area * reason) :=
  match t with
  | Leaf r => [(B, r)]
  | Split i c l u => leaves (lower_part i c B) l ++ leaves (upper_part i c B) u
  end.
Fixpoint splits_ok (B : area) (t : tree) : bool :=
  match t with
  | Leaf _ => true
  | Split i c l u => match nth_error B i with Some (lo, hi) => qlt lo c && qlt c hi | None =>
    false end &&
                     splits_ok (lower_part i c B) l && splits_ok (upper_part i c B) u
  end.
Definition thick (B : area) : bool := forallb (fun I => qlt (fst I) (snd I)) B.

(* ---- What the last hidden layer holds, for the k of a box: in the hull of one of these lists (if
   marked true) ---- *)
Definition steady (L : layer) (V : list vec) : bool :=
  forallb (fun f => forallb (fun v => qle 0 (value f v)) V || forallb (fun v =>
    qle (value f v) 0) V) L.
Fixpoint hidden (Ls : list layer) (V : list vec) : list (bool * list vec) :=
  match Ls with
  | [] => [(true, V)]
  | L :: Ls' => match Ls' with
    | [] => [(true, V)]
    | _ => flat_map (fun c => if steady L (snd c)
                              then hidden Ls' (map (fun v => reluQ (layerQ L v)) (snd c))
                                else [(false, [])])
                    (split_layer L V)
    end
  end.
Definition cells := list (bool * list vec).
Definition everywhere (cs : cells) (Z : area) (test : vec -> bool) : bool :=
  forallb (fun c => fst c && forallb (fun h => forallb (fun z => test (z ++ h)) (corners_of Z))
    (snd c)) cs.

(* ---- The same by bounds: of what the neurons hold for all k of a box D.  What one makes of its
   input lies between two lines; a form in what a layer holds is followed back through them, layer
   by layer, to k [T36] ---- *)
(* under x <= max(x, 0) <= over x + height *)
Record line := Line { under : Q; over : Q; height : Q }.
(* hidden layers and their neurons' lines, the last first *)
Definition held := list (layer * list line).
(* 2^40 *)
Definition round_up (q : Q) : Q := Qmake (- ((- Qnum q * 2 ^ 40) / Zpos (Qden q))) 1099511627776.
Definition line_over (lo hi : Q) : line :=
  if qle 0 lo then Line 1 1 0 else if qle hi 0 then Line 0 0 0 else
  let size := qadd hi (- lo) in
  let s := round_up (hi / size) in
  let slope := if qle 0 s && qle hi (qmul s size) then s else 1 in
  let least := qmul slope (- lo) in
  let h := round_up least in
  Line (if qlt (- lo) hi then 1 else 0) slope (if qle least h then h else least).
Fixpoint pass_back (c : vec) (ls : list line) : aff :=          (* a form in the neurons' inputs *)
  match c, ls with
  | a :: c', l :: ls' => let (v, d) := pass_back c' ls' in
      if qle 0 a then (qmul a (under l) :: v, d) else (qmul a (over l) ::
        v, qadd (qmul a (height l)) d)
  | _, _ => ([], 0)
  end.
Definition layer_back (L : layer) (ls : list line) (f : aff) : aff :=
  let (v, d) := pass_back (fst f) ls in aadd (lincomb v L) (aconst (qadd d (snd f))).
Fixpoint least_in (D : area) (c : vec) : Q :=
  match D, c with (lo, hi) :: D', a :: c' => qadd (qmul a (if qle 0 a then lo else hi)) (least_in D'
    c') | _, _ => 0 end.
Fixpoint at_least (D : area) (past : held) (f : aff) : Q :=
  match past with [] => qadd (least_in D (fst f)) (snd f) | (L, ls) :: past' =>
    at_least D past' (layer_back L ls f) end.
Definition line_of (D : area) (past : held) (f : aff) : line :=
  line_over (at_least D past f) (- at_least D past (aneg f)).
Fixpoint learn (D : area) (Ls : list layer) (past : held) : held :=
  match Ls with
  | [] => past
  | L :: Ls' => match Ls' with [] => past | _ => learn D Ls' ((L, map (line_of D past) L) ::
    past) end
  end.
Definition lines_in (N : list layer) (D : area) : held := learn D N [].
(* A condition on z alone that makes one on z and the last hidden layer hold for every k in D.  It
   is asked at no point of that layer: there is one list of nothing. *)
Definition lowered (n : nat) (D : area) (past : held) (r : row) : row :=
  let (c, d) := snd r in (fst r, (firstn n c, at_least D past (skipn n c, d))).
Definition no_cells : cells := [(true, [[]])].

(* ---- The model as forms in z and the last hidden layer ---- *)
Record frame := Frame { start_ : list aff; outs : list aff; knots : list (list aff);
  ends_ : list aff }.
Definition last_layer (N : list layer) : layer := List.last N [].
Definition width_in (N : list layer) : nat := match last_layer N with (w, _) :: _ =>
  length w | [] => O end.
Definition frame_of (P : problem) (N : list layer) : frame :=
  let Y := layerA (last_layer N) (map unit_form (seq (n_p P) (width_in N))) in
  let moved a := nth (steps P * (n_points P * n_p P) + a) (padded P Y) (aconst 0) in
  let X := map (fun a => aadd (unit_form a) (aneg (moved a))) (seq 0 (n_p P)) in
  let K := places P X Y in
  Frame X Y K (endA P K Y).

(* ---- Errors: every bin has to allow none, so that the model's own trajectory is in the tube ----
   *)
Fixpoint small (e w : vec) : bool :=
  match e, w with [], [] => true | a :: e', b :: w' => qle (Qabs a) b && small e' w' | _,
    _ => false end.
Definition allows (n : nat) (E : error) (x : vec) : bool :=
  Nat.eqb (length x) n &&
  match E with Widths w => small x w | Rows A => forallb (fun ab =>
    qle (dotQ (fst ab) x) (snd ab)) A end.
Definition allows_none (E : error) : bool :=
  match E with Widths _ => true | Rows A => forallb (fun ab => qle 0 (snd ab)) A end.
Definition centred (B : bin) : bool := forallb (forallb allows_none) (interval B) &&
  allows_none (final B).
Fixpoint overlaps (A B : area) : bool :=             (* their interiors *)
  match A, B with (a, b) :: A', (c, d) :: B' => qlt a d && qlt c b && overlaps A' B' | _,
    _ => true end.
Definition met (bs : list (bin * goal_hints)) (D : area) : list (bin * goal_hints) :=
  filter (fun BH => overlaps (box (fst BH)) D) bs.

(* ---- Rows of the goal, shrunken by an error that all of some bins allow at the end: there a
   trajectory keeps to the errors of the end and to those of the last interval.  Where these are
   widths, the farthest error needs no name. ---- *)
Fixpoint chunk_vec (n T : nat) (w : vec) : list vec :=
  match T with O => [] | S T' => firstn n w :: chunk_vec n T' (skipn n w) end.
Definition last_errors (P : problem) (B : bin) : list error := nth (steps P - 1) (interval B) [].
Definition end_allows (P : problem) (x : vec) (B : bin) : bool :=
  allows (n_points P * n_p P + n_q P) (final B) x &&
  forallb (fun Ex => allows (n_p P) (fst Ex) (snd Ex)) (combine (last_errors P B) (chunk_vec (n_p P)
    (n_points P) x)).
Definition has_widths (e : error) : bool := match e with Widths _ => true | Rows _ => false end.
Definition width (e : error) : vec := match e with Widths w => w | Rows _ => [] end.
Definition plain_end (P : problem) (B : bin) : bool := has_widths (final B) &&
  forallb has_widths (last_errors P B).
Fixpoint vmin (u v : vec) : vec :=
  match u, v with [], _ => v | _, [] => u | a :: u', b :: v' => (if qle a b then a else b) ::
    vmin u' v' end.
Definition end_widths (P : problem) (B : bin) : vec := vmin (concat (map width (last_errors P B)))
  (width (final B)).
Fixpoint least_of (l : list Q) : Q :=
  match l with [] => 0 | [x] => x | x :: l' => let y := least_of l' in if qle x y then x else y end.
Definition use_ok (P : problem) (bs : list bin) (u : use) : bool :=
  (which_row u <? length (goal P))%nat && qle 0 (times u) &&
  forallb (match shrink u with Some x => end_allows P x | None => plain_end P end) bs.
Definition use_row (P : problem) (bs : list bin) (u : use) : vec * Q :=
  let (a, b) := nth (which_row u) (goal P) ([], 0) in
  (a, qadd b (- match shrink u with
                | Some x => dotQ a x
                | None => least_of (map (fun B => dotQ (vabs a) (end_widths P B)) bs)
                end)).
Definition combine_uses (P : problem) (bs : list bin) (us : list use) : vec * Q :=
  fold_right (fun u acc => let (a, b) := use_row P bs u in
                           (vadd (vscale (times u) a) (fst acc), qadd (qmul (times u) b) (snd acc)))
                             ([], 0) us.

(* ---- A hit: at each corner of the box of z there is a group, of which at each point one contact
   lies in the obstacle ---- *)
Definition fits (A : poly) (m : multipliers) : bool :=
  positive m && forallb (fun im => (fst im <? length A)%nat) m.
Definition is_mixture (n : nat) (lam : vec) : bool :=
  Nat.eqb (length lam) n && forallb (qle 0) lam && Qeq_bool (fold_right qadd 0 lam) 1.
Fixpoint mixQ (lam : vec) (vs : list vec) : vec :=
  match lam, vs with l :: lam', v :: vs' => vadd (vscale l v) (mixQ lam' vs') | _, _ => [] end.
Definition body_ok (n : nat) (b : shape) (v : vec) : bool :=
  match b with Disc r => Nat.eqb (length v) n && qle (dotQ v v) (qmul r r) | Hull vs =>
    is_mixture (length vs) v end.
Definition body_point (b : shape) (v : vec) : vec := match b with Disc _ => v | Hull vs =>
  mixQ v vs end.
Definition errors_fit (n : nat) (Es : list error) (c : contact) : bool :=
  Nat.eqb (length (errors c)) (length Es) && forallb (fun Ex => allows n (fst Ex) (snd Ex)) (combine
    Es (errors c)).
Definition errors_at (B : bin) (b : part) (t : nat) : list error :=
  map (fun i => nth i (nth t (interval B) []) (Rows [])) (corners b).
Definition contact_ok (P : problem) (bs : list bin) (b : part) (t : nat) (c : contact) : bool :=
  body_ok (n_p P) (grown_by b) (body c) && forallb (fun B =>
    errors_fit (n_p P) (errors_at B b t) c) bs.
(* Whether the errors of a contact fit a knot: the intervals before and after it, and at the end the
   final widths. *)
Definition fits_knot (P : problem) (b : part) (j : nat) (c : contact) (B : bin) : bool :=
  (if (0 <? j)%nat then errors_fit (n_p P) (errors_at B b (j - 1)) c else true) &&
  (if (j <? steps P)%nat then errors_fit (n_p P) (errors_at B b j) c else
   has_widths (final B) &&
   let ws := chunk_vec (n_p P) (n_points P) (width (final B)) in
   errors_fit (n_p P) (map (fun i => Widths (nth i ws [])) (corners b)) c).
Definition between (h : hit) : bool := qlt 0 (share h) && qlt (share h) 1.
Definition knot_of (h : hit) : nat := if qle 1 (share h) then S (step h) else step h.
(* Between knots, or where the errors of all contacts fit a knot, touching is enough.  Elsewhere the
   contacts have to be inside the obstacle, so that there is one a moment from the knot. *)
Definition loose (P : problem) (bs : list bin) (b : part) (h : hit) : bool :=
  between h || forallb (fun g => forallb (fun c => forallb (fits_knot P b (knot_of h) c) bs)
    (contacts g)) (groups h).
Definition moment (P : problem) (F : frame) (t i : nat) (s : Q) : list aff :=
  zadd (map (ascale (qadd 1 (- s))) (nth (t * n_points P + i) (knots F) []))
       (map (ascale s) (nth (S t * n_points P + i) (knots F) [])).
Fixpoint blended (n : nat) (lam : vec) (Ps : list (list aff)) : list aff :=
  match lam, Ps with
  | l :: lam', Q :: Ps' => zadd (map (ascale l) Q) (blended n lam' Ps')
  | _, _ => repeat (aconst 0) n
  end.
Definition offset (b : part) (lam : vec) (c : contact) : vec :=
  vadd (body_point (grown_by b) (body c)) (mixQ lam (errors c)).
Definition touching (strict : bool) (A : poly) (M : list aff) (d : vec) : list row :=
  map (fun ab => (strict, aadd (aneg (lincomb (fst ab) M)) (aconst (qadd (snd ab) (- dotQ
    (fst ab) d))))) A.
Definition ways_to_touch (P : problem) (F : frame) (h : hit) (o : obstacle) (b : part) (strict :
  bool) (g : group) : list (list row) :=
  let M := blended (n_p P) (blend g) (map (fun i => moment P F (step h) i (share h)) (corners b)) in
  map (fun c => touching strict (rows o) M (offset b (blend g) c)) (contacts g).
Definition throughout (cs : cells) (test : vec -> bool) : bool := forallb (fun c => fst c &&
  forallb test (snd c)) cs.
Definition check_hit (P : problem) (F : frame) (bs : list bin) (Z : area) (cs : cells) (low : row ->
  row) (h : hit) : bool :=
  match nth_error (obstacles P) (whom h), nth_error (parts P) (which_part h) with
  | Some o, Some b =>
      (first o <=? step h)%nat && (step h <=? last o)%nat && qle 0 (share h) && qle (share h) 1 &&
      forallb (fun g => is_mixture (length (corners b)) (blend g) &&
                        forallb (contact_ok P bs b (step h)) (contacts g)) (groups h) &&
      let options := map (fun g => map (map low) (ways_to_touch P F h o b (negb (loose P bs b h))
        g)) (groups h) in
      forallb (fun z => existsb (fun some => throughout cs (fun w =>
        existsb (forallb (holdsQ (z ++ w))) some)) options)
              (corners_of Z)
  | _, _ => false
  end.

(* ---- Leaves ---- *)
Definition exceeds (wh : vec * Q) (X : list aff) : row :=
  (true, aadd (lincomb (fst wh) X) (aconst (- snd wh))).
Definition about_z (P : problem) (w : vec) : bool := negb (nonzero (skipn (n_p P) w)).
Definition needs_cells (P : problem) (r : reason) : bool :=
  match r with Misses us => negb (about_z P (fst (combine_uses P [] us))) | Open =>
    false | _ => true end.
(* By vertices of cells nothing is lowered, by bounds there are no cells. *)
Definition check_leaf (P : problem) (F : frame) (all : list (bin * goal_hints)) (Z D : area) (cs :
  cells) (low : row -> row)
    (r : reason) : bool :=
  let bhs := met all D in
  let bs := map fst bhs in
  match r with
  | Misses us =>
      let wh := combine_uses P bs us in
      forallb (use_ok P bs) us &&
      (if about_z P (fst wh) then forallb (fun z => qlt (snd wh) (dotQ (firstn (n_p P) (fst wh)) z))
        (corners_of Z)
       else let r := low (exceeds wh (ends_ F)) in everywhere cs Z (fun v => holdsQ v r))
  | Elsewhere m =>
      fits (start P) m && let r := low (exceeds (combine_rows (start P) m) (start_ F)) in everywhere
        cs Z (fun v => holdsQ v r)
  | Hits h => check_hit P F bs Z cs low h
  | Safe s =>
      sep_ok P s && let ds := dirs_of P s in
      forallb (fun BH => let rows := conditions P ds (fst BH) (snd BH) (start_ F) (outs F) in
                         everywhere cs Z (fun v => forallb (holdsQ v) rows)) bhs
  | Open => true
  | Bounded _ => false
  end.
Definition boundable (r : reason) : bool := match r with Misses _ | Elsewhere _ | Hits _ =>
  true | _ => false end.
(* Neighbouring leaves often share their box of k: its cells are kept, and its lines. *)
Definition same_number (a b : Q) : bool := Z.eqb (Qnum a) (Qnum b) && Pos.eqb (Qden a) (Qden b).
Fixpoint same_box (A B : area) : bool :=
  match A, B with
  | [], [] => true
  | (a, b) :: A', (c, d) :: B' => same_number a c && same_number b d && same_box A' B'
  | _, _ => false
  end.
Definition cells_in (N : list layer) (D : area) : cells := hidden N (corners_of D).
Fixpoint check_leaves (P : problem) (N : list layer) (F : frame) (all : list (bin * goal_hints))
  (kept : area * cells)
    (lined : area * held) (ls : list (area * reason)) : bool :=
  match ls with
  | [] => true
  | (B, r) :: ls' =>
      let Z := firstn (n_p P) B in let D := skipn (n_p P) B in
      match r with
      | Bounded r' =>
          let now := if negb (needs_cells P r') then lined
                     else if same_box D (fst lined) then lined else (D, lines_in N D) in
          thick B && boundable r' && check_leaf P F all Z D no_cells (lowered (n_p P) D
            (snd now)) r' &&
          check_leaves P N F all kept now ls'
      | _ =>
          let now := if negb (needs_cells P r) then kept
                     else if same_box D (fst kept) then kept else (D, cells_in N D) in
          thick B && check_leaf P F all Z D (if needs_cells P r then snd now else []) (fun q =>
            q) r &&
          check_leaves P N F all now lined ls'
      end
  end.
Fixpoint check_faces (P : problem) (bs : list bin) (i : nat) (Z : area) (fs :
  list (list use * list use)) : bool :=
  match Z, fs with
  | [], [] => true
  | (lo, hi) :: Z', (l, u) :: fs' =>
      let (w, h) := combine_uses P bs l in let (v, g) := combine_uses P bs u in
      forallb (use_ok P bs) l && forallb (use_ok P bs) u && same w (vscale (-1) (unit_vec i)) &&
        qle h (- lo) &&
      same v (unit_vec i) && qle g hi && check_faces P bs (S i) Z' fs'
  | _, _ => false
  end.
Definition leaves_of (P : problem) (p : proof) := leaves (z_box p ++ domain P) (root p).
Definition check_proof (P : problem) (N : list layer) (E : tube) (H : list goal_hints) (p :
  proof) : bool :=
  forallb centred (bins E) && Nat.eqb (length (z_box p)) (n_p P) && thick (z_box p ++ domain P) &&
  check_faces P (filter (fun B => meets (box B) (domain P)) (bins E)) 0 (z_box p) (faces p) &&
  splits_ok (z_box p ++ domain P) (root p) &&
  check_leaves P N (frame_of P N) (hinted E H) ([], cells_in N []) ([], lines_in N [])
    (leaves_of P p).

(* ---- What it says ---- *)
Definition is_unsafe (r : reason) : bool := match r with Bounded r' => boundable r' | _ =>
  boundable r end.
Definition is_safe (r : reason) : bool := match r with Safe _ => true | _ => false end.
Definition check_no_plan P N E H p := forallb (fun l => is_unsafe (snd l)) (leaves_of P p) &&
  check_proof P N E H p.
Definition volumeQ (B : area) : Q := fold_right (fun I acc =>
  qmul (qadd (snd I) (- fst I)) acc) 1 B.
Definition sum_of (pick : reason -> bool) (ls : list (area * reason)) : Q :=
  fold_right (fun l acc => if pick (snd l) then qadd (volumeQ (fst l)) acc else acc) 0 ls.
(* safe, unsafe, all *)
Definition volumes (P : problem) (p : proof) : Q * Q * Q :=
  let ls := leaves_of P p in (sum_of is_safe ls, sum_of is_unsafe ls,
    volumeQ (z_box p ++ domain P)).
