(* The checker of polytopes.  Nothing here has to be believed: `set_safe` in Theorems.v says what
   its answer `true` means. *)
From Coq Require Import ZArith QArith List Bool Arith.
From ParcJax Require Import Spec Arithmetic Integers Checker.
Import ListNotations.
Open Scope Q_scope.

(* ---- Polytopes: (p0, k) are the variables; the pattern makes the network affine; k is in one bin
   only ---- *)
Record piece := Piece { inner : vec; which : nat; pattern : list (list bool); piece_sep : sepn }.
Fixpoint box_rows (i : nat) (B : list (Q * Q)) : list row :=
  match B with
  | [] => []
  | (lo, hi) :: B' => (false, aadd (unit_form i) (aconst (- lo))) ::
    (false, aadd (aneg (unit_form i)) (aconst hi))
                      :: box_rows (S i) B'
  end.
(* The box of a bin without the faces that it shares with its neighbours: their rows are strict.
   The outermost faces belong to it. *)
Fixpoint bin_rows (i : nat) (es : list vec) (B : list (Q * Q)) : list row :=
  match es, B with
  | e :: es', (lo, hi) :: B' =>
      (negb (Qeq_bool lo (hd lo e)), aadd (unit_form i) (aconst (- lo))) ::
      (negb (Qeq_bool hi (List.last e hi)), aadd (aneg (unit_form i)) (aconst hi)) ::
        bin_rows (S i) es' B'
  | _, _ => []
  end.
Definition set_rows (P : problem) (N : list layer) (E : tube) (B : bin) (H : goal_hints) (s :
  piece) : list row :=
  let X := map unit_form (seq 0 (n_p P)) in
  let (r, Y) := netA N (pattern s) (map unit_form (seq (n_p P) (n_k P))) in
  box_rows (n_p P) (domain P) ++ bin_rows (n_p P) (edges E) (box B) ++ r ++
  conditions P (dirs_of P (piece_sep s)) B H X Y.
(* strictly inside, unless the row is constant *)
Definition insideQ (x : vec) (r : row) : bool :=
  if fst r || nonzero (fst (snd r)) then qlt 0 (qadd (dotQ (fst (snd r)) x) (snd (snd r)))
    else holdsQ x r.

(* ---- The same at the inner point alone, in integers: all rows with forms are above zero there,
   constant ones too ---- *)
(* A direction w with the offset h of the grown obstacle, both over a scale; what the offsets of
   widths are over is the unit, and D = unit times the rest what places are over. *)
Record aim := Aim { toward : vec; offset : Q; scale : Z; along_w : list Z; across : list Z;
                    least_height : Z }.
Definition aim_of (unit_ : Z) (wh : vec * Q) : option aim :=
  let (w, h) := wh in
  let d := common (h :: w) in
  match all_some (over d) w, over d h with
  | Some W, Some g => Some (Aim w h d W (map Z.abs W) (g * unit_)%Z)
  | _, _ => None
  end.
Section Quick.
  Variables (rest D : Z).
  (* two heights of a point, over scale and D, are beyond what its errors take *)
  Definition beyond (A : aim) (Ez : error * list Z) (a b : Z) : bool :=
    match fst Ez with
    | Widths _ =>
        let g := ((least_height A + dotZ (across A) (snd Ez)) * rest)%Z in less g a && less g b
    | Rows _ =>
        match reach (fst Ez) [] (vscale (-1) (toward A)) with
        | None => false
        | Some r =>
            let g := qadd (offset A) r in
            let z := (Qnum g * (scale A * D))%Z in
            less z (a * Zpos (Qden g)) && less z (b * Zpos (Qden g))
        end
    end.
  Definition heights (A : aim) (K : list (list Z)) (points : list nat) : list Z :=
    map (fun i => dotZ (along_w A) (nth i K [])) points.
  Fixpoint all_beyond (A : aim) (Es : list (error * list Z)) (points : list nat) (low high : list Z)
    : bool :=
    match points, low, high with
    | i :: points', a :: low', b :: high' =>
        beyond A (nth i Es (Rows [], [])) a b && all_beyond A Es points' low' high'
    | _, _, _ => true
    end.
  (* n intervals from knot K on, where the heights are low *)
  Fixpoint run_clear (P : problem) (A : aim) (Is : list (list (error * list Z)))
    (K : list (list Z)) (points : list nat) (low : list Z) (n : nat) : bool :=
    match n with
    | O => true
    | S n' =>
        let K' := skipn (n_points P) K in
        let high := heights A K' points in
        all_beyond A (hd [] Is) points low high && run_clear P A (tl Is) K' points high n'
    end.
  Fixpoint runs_clear (P : problem) (unit_ : Z) (Is : list (list (error * list Z)))
    (K : list (list Z)) (points : list nat) (ds : list dir) (t n : nat) : bool :=
    match ds with
    | [] => Nat.eqb n 0
    | (stop, wh) :: ds' =>
        match aim_of unit_ wh with
        | None => false
        | Some A =>
            let m := Nat.min n (stop - t) in
            run_clear P A Is K points (heights A K points) m &&
            runs_clear P unit_ (skipn m Is) (skipn (m * n_points P) K) points ds' (t + m) (n - m)
        end
    end.
End Quick.
Fixpoint zaddZ (X Y : list Z) : list Z :=
  match X, Y with x :: X', y :: Y' => (x + y)%Z :: zaddZ X' Y' | _, _ => [] end.
Definition positive_rows : list row -> bool := forallb (fun q => qlt 0 (snd (snd q))).
Definition clearly_inside (M : whole) (P : problem) (E : tube) (B : bin) (H : goal_hints) (s :
  piece) : bool :=
  let d := (common (inner s) * unit_ M)%Z in let D := (d * factor M)%Z in
  match nth_error (widths M) (which s), all_some (over d) (inner s) with
  | Some Is, Some v =>
      let (ok, Y) := netZ (levels M) (pattern s) d (skipn (n_p P) v) in
      let Y := repeat 0%Z (n_p P) ++ Y in
      let X := map (fun z => (z * factor M)%Z) (firstn (n_p P) v) in
      let K := map (zaddZ X) (chunk (n_p P) (S (steps P) * n_points P) Y) in
      let ends := concat (firstn (n_points P) (skipn (steps P * n_points P) K)) ++
                  firstn (n_q P) (skipn (S (steps P) * (n_points P * n_p P)) Y) in
      ok &&
      forallb (insideQ (inner s)) (box_rows (n_p P) (domain P)) &&
      forallb (insideQ (inner s)) (bin_rows (n_p P) (edges E) (box B)) &&
      positive_rows (below (start P) (fun _ _ => Some 0)
        (map aconst (firstn (n_p P) (inner s)))) &&
      positive_rows (below (goal P) (fun i a => reach (final B) (nth i H []) a)
        (map (fun z => aconst (Qmake z (Z.to_pos D))) ends)) &&
      forallb (fun bd => let '(o, b, ds) := bd in
        runs_clear (common (inner s) * factor M) D P (unit_ M) (skipn (first o) Is)
          (skipn (first o * n_points P) K) (corners b) ds (first o) (S (last o) - first o))
        (combine (tasks P) (dirs_of P (piece_sep s)))
  | _, _ => false
  end.
(* M: whole_of N E *)
Definition check_set_with (M : option whole) (P : problem) (N : list layer) (E : tube)
  (H : list goal_hints) (s : piece) : bool :=
  match nth_error (hinted E H) (which s) with
  | None => false
  | Some (B, h) => Nat.eqb (length (inner s)) (n_p P + n_k P) && bits_ok N (pattern s) &&
    sep_ok P (piece_sep s) &&
    (match M with Some M => clearly_inside M P E B h s | None => false end ||
     forallb (insideQ (inner s)) (set_rows P N E B h s))
  end.
Definition check_set (P : problem) (N : list layer) (E : tube) (H : list goal_hints) (s :
  piece) : bool := check_set_with (whole_of N E) P N E H s.
