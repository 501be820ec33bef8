(* The checker of boxes of doubt [T21]: all plans within half widths of (p0, k) are safe with the
   same directions. Nothing here has to be believed: DoubtFacts.v says what its answer `true` means.
   *)
From Coq Require Import ZArith QArith Qabs List Bool Arith.
From ParcJax Require Import Spec Arithmetic Checker.
Import ListNotations.
Open Scope Q_scope.

(* ---- Cells of the network in a box of k, as lists of points whose hulls cover the box ---- *)
Definition value (f : aff) (v : vec) : Q := qadd (dotQ (fst f) v) (snd f).
Definition middle (s : Q) (a b : vec) : vec := vadd (vscale (qadd 1 (- s)) a) (vscale s b).
(* the share is guessed from the first axis that tells, then tried *)
Definition on_segment (a b v : vec) : bool :=
  match find (fun ab => negb (Qeq_bool (fst (fst ab)) (snd (fst ab)))) (combine (combine a b) v)
    with
  | None => false
  | Some (x, y, z) => let s := qdiv (qadd z (- x)) (qadd y (- x)) in qle 0 s && qle s 1 &&
    same v (middle s a b)
  end.
Fixpoint before (a b : vec) : bool :=                   (* in the order of the alphabet *)
  match a, b with x :: a', y :: b' => qlt x y || Qeq_bool x y && before a' b' | _, _ => false end.
Definition extreme (pick : vec -> vec -> bool) (l : list vec) : vec :=
  fold_right (fun v best => if pick v best then v else best) (hd [] l) l.
(* all points of a line are between two of them *)
Definition ends (l : list vec) : list vec :=
  let a := extreme before l in let b := extreme (fun u v => before v u) l in
  if forallb (on_segment a b) l then [a; b] else l.
Definition zero_between (f : aff) (a b : vec) : option vec :=
  let x := value f a in
  let s := qdiv x (qadd x (- value f b)) in
  let m := middle s a b in
  let v := map red m in
  if qle 0 s && qle s 1 && Qeq_bool (value f v) 0 && same v m then Some v else None.
Fixpoint zeros (f : aff) (pm : list (vec * vec)) : option (list vec) :=
  match pm with
  | [] => Some []
  | (p, m) :: pm' => match zero_between f p m, zeros f pm' with Some v, Some l => Some (v ::
    l) | _, _ => None end
  end.
Definition above (f : aff) (V : list vec) := filter (fun v => qle 0 (value f v)) V.
Definition under (f : aff) (V : list vec) := filter (fun v => qle (value f v) 0) V.
Fixpoint split_layer (Z : list aff) (V : list vec) : list (list bool * list vec) :=
  match Z with
  | [] => [([], V)]
  | f :: Z' =>
      let go b W := map (fun c => (b :: fst c, snd c)) (split_layer Z' W) in
      if forallb (fun v => qle 0 (value f v)) V then go true V
      else if forallb (fun v => qle (value f v) 0) V then go false V
      else match zeros f (list_prod (above f V) (under f V)) with
           (* does not happen; a leaf with too few bits is refused *)
           | None => [([], V)]
           | Some l => let zs := ends l in go true (above f V ++ zs) ++ go false (under f V ++ zs)
           end
  end.
Fixpoint split_net (Ls : list layer) (X : list aff) (V : list vec) :
  list (list (list bool) * list vec) :=
  match Ls with
  | [] => [([], V)]
  | L :: Ls' => match Ls' with
    | [] => [([], V)]
    | _ => let Z := layerA L X in
           flat_map (fun bV => map (fun c => (fst bV :: fst c, snd c)) (split_net Ls' (passA
             (fst bV) Z) (snd bV)))
                    (split_layer Z V)
    end
  end.
Fixpoint corners_of (D : list (Q * Q)) : list vec :=
  match D with [] => [[]] | (lo, hi) :: D' => flat_map (fun v => [lo :: v; hi ::
    v]) (corners_of D') end.

(* ---- Every row at every point of every cell, with room for p0 ---- *)
Record boxed := Boxed { middle_p0 : vec; room_p0 : vec; region : list (Q * Q); boxed_sep : sepn }.
Definition roomy (n : nat) (p0 d v : vec) (r : row) : bool :=
  let (c, e) := snd r in
  let a := firstn n c in
  let least := qadd (qadd (dotQ a p0) (- dotQ (vabs a) d)) (qadd (dotQ (skipn n c) v) e) in
  if fst r then qlt 0 least else qle 0 least.
Fixpoint meets (A B : list (Q * Q)) : bool :=
  match A, B with
  | (a, b) :: A', (c, d) :: B' => qle a d && qle c b && meets A' B'
  | _, _ => true
  end.
Fixpoint within (A B : list (Q * Q)) : bool :=          (* a box in a box *)
  match A, B with
  | [], [] => true
  | (a, b) :: A', (c, d) :: B' => qle c a && qle a b && qle b d && within A' B'
  | _, _ => false
  end.
Definition check_box (P : problem) (N : list layer) (E : tube) (H : list goal_hints) (s :
  boxed) : bool :=
  Nat.eqb (length (middle_p0 s)) (n_p P) && Nat.eqb (length (room_p0 s)) (n_p P) &&
  within (region s) (domain P) && sep_ok P (boxed_sep s) &&
  let X := map unit_form (seq 0 (n_p P)) in
  let ds := dirs_of P (boxed_sep s) in
  let cells := split_net N (map unit_form (seq 0 (n_k P))) (corners_of (region s)) in
  let hit := filter (fun BH => meets (box (fst BH)) (region s)) (hinted E H) in
  forallb (fun cell => bits_ok N (fst cell) &&
    let (r, Y) := netA N (fst cell) (map unit_form (seq (n_p P) (n_k P))) in
    forallb (fun v => forallb (roomy (n_p P) (middle_p0 s) (room_p0 s) v) r) (snd cell) &&
    forallb (fun BH => let rows := conditions P ds (fst BH) (snd BH) X Y in
      forallb (fun v => forallb (roomy (n_p P) (middle_p0 s) (room_p0 s) v) rows) (snd cell)) hit)
        cells.
