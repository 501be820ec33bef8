(* Numbers over one denominator are integers: no denominator is multiplied or compared while they
   are added.  Nothing here has to be believed: IntegerFacts.v proves it. *)
From Coq Require Import ZArith QArith List Bool.
From ParcJax Require Import Spec Arithmetic.
Import ListNotations.
Open Scope Z_scope.

Section All.
  Context {A B : Type} (f : A -> option B).
  Fixpoint all_some (l : list A) : option (list B) :=
    match l with
    | [] => Some []
    | x :: l' => match f x, all_some l' with Some y, Some m => Some (y :: m) | _, _ => None end
    end.
End All.
Definition less (a b : Z) : bool := negb (b <=? a).

(* A denominator that all may have, and a number over it. *)
Definition common (v : vec) : Z :=
  fold_left (fun d q => let n := Zpos (Qden q) in
    if n * (d / n) =? d then d else if d * (n / d) =? n then n else d * n) v 1.
Definition over (d : Z) (q : Q) : option Z :=
  let m := d / Zpos (Qden q) in if Zpos (Qden q) * m =? d then Some (Qnum q * m) else None.
Fixpoint dotZ (u v : list Z) : Z :=
  match u, v with a :: u', b :: v' => a * b + dotZ u' v' | _, _ => 0 end.

(* ---- The network, each layer over a denominator of its own ---- *)
Definition level := (Z * list (list Z * Z))%type.
Definition row_over (d : Z) (r : vec * Q) : option (list Z * Z) :=
  match all_some (over d) (fst r), over d (snd r) with
  | Some w, Some b => Some (w, b) | _, _ => None
  end.
Definition level_of (L : layer) : option level :=
  let d := common (flat_map (fun r => snd r :: fst r) L) in
  option_map (pair d) (all_some (row_over d) L).
(* X is over D, what follows over the product of both *)
Definition layerZ (L : level) (D : Z) (X : list Z) : list Z :=
  map (fun r => dotZ (fst r) X + snd r * D) (snd L).
Fixpoint passZ (bits : list bool) (X : list Z) : list Z :=
  match bits, X with b :: bits', z :: X' => (if b then z else 0) :: passZ bits' X' | _, _ => [] end.
Fixpoint signsZ (bits : list bool) (X : list Z) : bool :=
  match bits, X with
  | b :: bits', z :: X' => (if b then less 0 z else less z 0) && signsZ bits' X' | _, _ => true
  end.
(* whether all neurons are on their side and on no border; the outputs *)
Fixpoint netZ (Ls : list level) (bits : list (list bool)) (D : Z) (X : list Z) : bool * list Z :=
  match Ls with
  | [] => (true, X)
  | L :: Ls' => match Ls' with
    | [] => (true, layerZ L D X)
    | _ => let Z := layerZ L D X in let b := hd [] bits in
           let (ok, Y) := netZ Ls' (tl bits) (fst L * D) (passZ b Z) in (signsZ b Z && ok, Y)
    end
  end.

(* ---- Network and tube ---- *)
(* factor: the product of all layers; unit: what widths are over; widths: by bin, interval and
   point, none of rows *)
Record whole := Whole {
  levels : list level; factor : Z; unit_ : Z; widths : list (list (list (error * list Z))) }.
Definition numbers_of (E : error) : vec := match E with Widths e => e | Rows _ => [] end.
Definition error_over (d : Z) (E : error) : option (error * list Z) :=
  option_map (pair E) (all_some (over d) (numbers_of E)).
Definition whole_of (N : list layer) (E : tube) : option whole :=
  let d := common (flat_map (flat_map (flat_map numbers_of)) (intervals E)) in
  match all_some level_of N, all_some (all_some (all_some (error_over d))) (intervals E) with
  | Some Ls, Some Is => Some (Whole Ls (fold_right (fun L n => fst L * n) 1 Ls) d Is)
  | _, _ => None
  end.
