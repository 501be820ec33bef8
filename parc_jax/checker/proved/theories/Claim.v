(* The arithmetic of a claim, as the checker does it.  Nothing here has to be believed: what follows
   from its yes is in Statements.v. *)
From Coq Require Import ZArith QArith List Bool.
From ParcJax Require Import ClaimSpec.
Import ListNotations.
Local Open Scope Z_scope.

Definition one : Z := 2 ^ 128.                          (* numbers are counted in parts of it *)

(* Quotients are tried, not trusted: at least, and at most, a / b. *)
Definition at_least (a b : Z) : Z :=
  let q := Z.div a b in if a <=? b * q then q else if a <=? b * (q + 1) then q + 1 else Z.abs a.
Definition no_more (a b : Z) : Z := let q := Z.div a b in if (0 <=? q) && (b * q <=? a)
  then q else 0.

(* At least the sum of choose n j (p / rest)^j, j from 0 to the number of steps; the last term so
   far is that of i - 1. *)
Fixpoint climb (n p rest i term sum : Z) (steps : nat) : Z :=
  match steps with
  | O => sum
  | S steps' =>
      let term := at_least (term * (Z.max 0 (n - i + 1) * p)) (i * rest) in
      climb n p rest (i + 1) term (sum + term) steps'
  end.
(* At most (q / rest)^n. *)
Fixpoint power (q rest : Z) (n : positive) : Z :=
  match n with
  | xH => no_more (one * q) rest
  | xO n' => let x := power q rest n' in no_more (x * x) one
  | xI n' => let x := power q rest n' in no_more (no_more (x * x) one * q) rest
  end.
(* What a block costs of delta, in parts of one.  With p / q = eps and rest = q - p the binomial sum
   is that of choose n j (p / rest)^j, divided by (q / rest)^n. *)
Definition cost (d : Q) (b : block) : option Z :=
  let p := Qnum (bound b) in let q := Zpos (Qden (bound b)) in let rest := q - p in
  (* that at most all runs leave is true of any *)
  if rest =? 0 then Some 0
  else
    let low := power q rest (runs b) in
    let top := climb (Zpos (runs b)) p rest 1 one one (discards b) in
    if 0 <? low then Some (at_least (top * Zpos (Qden d) * one) (low * Qnum d)) else None.
Fixpoint costs (d : Q) (bs : list block) : option Z :=
  match bs with
  | [] => Some 0
  | b :: bs' => match cost d b, costs d bs' with Some x, Some y => Some (x + y) | _, _ => None end
  end.

Definition probable (x : Q) : bool := (0 <? Qnum x) && Qle_bool x 1.
Definition check_claim (c : claim) : bool :=
  probable (eps c) && probable (delta c) &&
  negb (match blocks c with [] => true | _ => false end) &&
  forallb (fun b => probable (bound b) && Qle_bool (bound b) (eps c)) (blocks c) &&
  forallb (fun x => match x with Some e => existsb (fun b => Qeq_bool e (bound b)) (blocks c) | None
    => true end)
          (in_bins c) &&
  match costs (delta c) (blocks c) with Some x => Zpos (looks c) * x <=? one | None => false end.
