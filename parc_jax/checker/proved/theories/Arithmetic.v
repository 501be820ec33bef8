(* Rationals, vectors and affine forms that compute.  Nothing here has to be believed:
   ArithmeticFacts.v proves it. *)
From Coq Require Import ZArith QArith Qabs List Bool.
From ParcJax Require Import Spec.
Import ListNotations.
Open Scope Q_scope.

(* Fractions are reduced rarely, since a greatest common divisor costs more than it saves, and
   denominators here are mostly powers of two, of which one divides the other.  Divisors and
   quotients are tried before they are used, so that fast code which is not proved may compute them
   (Extract.v). *)
Definition red (q : Q) : Q :=
  let g := Z.gcd (Qnum q) (Zpos (Qden q)) in
  match (Zpos (Qden q) / g)%Z with
  | Zpos d => let r := Qmake (Qnum q / g)%Z d in if Qeq_bool r q then r else q
  | _ => q
  end.
Definition short := (2 ^ 3000)%Z.
Definition qadd (a b : Q) : Q :=
  if Z.eqb (Zpos (Qden a)) (Zpos (Qden b)) then Qmake (Qnum a + Qnum b) (Qden a) else
  if Z.eqb (Qnum b) 0 then a else
  let m := (Zpos (Qden b) / Zpos (Qden a))%Z in
  if Z.eqb (Zpos (Qden a) * m) (Zpos (Qden b)) then Qmake (Qnum a * m + Qnum b) (Qden b) else
  let m := (Zpos (Qden a) / Zpos (Qden b))%Z in
  if Z.eqb (Zpos (Qden b) * m) (Zpos (Qden a)) then Qmake (Qnum a + Qnum b * m) (Qden a) else
  let q := a + b in if Z.leb (Zpos (Qden q)) short then q else red q.
Definition qmul (a b : Q) : Q := if Z.eqb (Qnum a) 0 then 0 else if Z.eqb (Qnum b) 0
  then 0 else a * b.
Definition qle := Qle_bool.
Definition qlt a b := negb (Qle_bool b a).
(* at least the root of s; the root taken is tried *)
Definition root_up (s : Q) : Q :=
  let n := (Qnum s * Zpos (Qden s) * 2 ^ 160)%Z in
  let r := Z.sqrt n in
  let u := red (Qmake (if Z.eqb (r * r) n then r else r + 1) (Qden s * 2 ^ 80)) in
  if qle 0 u && qle s (qmul u u) then u else 1 + s.

(* ---- Vectors ---- *)
Fixpoint vadd (u v : vec) : vec :=
  match u, v with [], _ => v | _, [] => u | a :: u', b :: v' => qadd a b :: vadd u' v' end.
Definition vscale (a : Q) (v : vec) : vec := map (qmul a) v.
Definition vabs (v : vec) : vec := map Qabs v.
Fixpoint dotQ (u v : vec) : Q :=
  match u, v with a :: u', b :: v' => qadd (qmul a b) (dotQ u' v') | _, _ => 0 end.
Definition nonzero (v : vec) : bool := existsb (fun a => negb (Z.eqb (Qnum a) 0)) v.
Fixpoint same (u v : vec) : bool :=                     (* missing coordinates are zeros *)
  match u, v with
  | [], _ => negb (nonzero v)
  | _, [] => negb (nonzero u)
  | a :: u', b :: v' => Qeq_bool a b && same u' v'
  end.
Fixpoint inBoxQ (B : list (Q * Q)) (x : vec) : bool :=
  match B, x with
  | [], [] => true | (lo, hi) :: B', a :: x' => qle lo a && qle a hi && inBoxQ B' x' | _, _ => false
  end.

(* Multipliers name rows of a polytope.  If they are not negative, a . x <= b for all rows gives w .
   x <= h. *)
Definition multipliers := list (nat * Q).
Definition combine_rows (A : poly) (m : multipliers) : vec * Q :=
  fold_right (fun im acc => let (a, b) := nth (fst im) A ([], 0) in
                            (vadd (vscale (snd im) a) (fst acc), qadd (qmul (snd im) b) (snd acc)))
                              ([], 0) m.

(* ---- Affine forms (c, d): x -> c . x + d, and conditions on them ---- *)
Definition aff := (vec * Q)%type.
Definition aconst (d : Q) : aff := ([], d).
Definition aadd (f g : aff) : aff := (vadd (fst f) (fst g), qadd (snd f) (snd g)).
Definition ascale (a : Q) (f : aff) : aff := (vscale a (fst f), qmul a (snd f)).
Definition aneg := ascale (-1).
Fixpoint lincomb (w : vec) (X : list aff) : aff :=
  match w, X with a :: w', f :: X' => aadd (ascale a f) (lincomb w' X') | _, _ => aconst 0 end.
Fixpoint zadd (X Y : list aff) : list aff :=
  match X, Y with f :: X', g :: Y' => aadd f g :: zadd X' Y' | _, _ => [] end.
Fixpoint unit_vec (n : nat) : vec := match n with O => [1] | S n' => 0 :: unit_vec n' end.
Definition unit_form (i : nat) : aff := (unit_vec i, 0).

(* (strict, f): f > 0 if strict, else f >= 0 *)
Definition row := (bool * aff)%type.
Definition never : row := (true, aconst 0).
Definition holdsQ (x : vec) (r : row) : bool :=
  let v := qadd (dotQ (fst (snd r)) x) (snd (snd r)) in if fst r then qlt 0 v else qle 0 v.
