(* What is said of claims, and all that has to be read for it; the theorems are in Statements.v.
   [T1, T2, T4] *)
From Coq Require Import Reals QArith Qreals List Bool Arith.
Import ListNotations.
Open Scope R_scope.

(* ---- A law: finitely many outcomes, each with its probability ---- *)
Definition law (A : Type) := list (A * R).
Fixpoint mean {A} (L : law A) (f : A -> R) : R :=
  match L with [] => 0 | (a, w) :: L' => w * f a + mean L' f end.
Definition is_law {A} (L : law A) : Prop := (forall a w, In (a, w) L -> 0 <= w) /\
  mean L (fun _ => 1) = 1.
Definition prob {A} (L : law A) (E : A -> bool) : R := mean L (fun a => if E a then 1 else 0).

(* Two independent draws of two laws, put together; and N of one law: the product of N copies
   of it. *)
Definition both {A B C} (put : A -> B -> C) (L : law A) (M : law B) : law C :=
  flat_map (fun aw => map (fun bv => (put (fst aw) (fst bv), snd aw * snd bv)) M) L.
Fixpoint draws {A} (L : law A) (N : nat) : law (list A) :=
  match N with O => [([], 1)] | S N' => both cons L (draws L N') end.

(* The binomial sum. *)
Fixpoint choose (n k : nat) : R :=
  match k, n with
  | O, _ => 1
  | S _, O => 0
  | S k', S n' => choose n' k' + choose n' k
  end.
Definition tail (N r : nat) (eps : R) : R :=
  sum_f_R0 (fun i => choose N i * eps ^ i * (1 - eps) ^ (N - i)) r.

(* Runs, the law that they are drawn from, and the score of each: how much the tube must grow to
   hold it, None where none does. *)
Definition leaves {A} (score : A -> option R) (s : R) (a : A) : bool :=
  match score a with Some x => if Rlt_dec s x then true else false | None => true end.
Definition left_out {A} (score : A -> option R) (s : R) (l : list A) : nat :=
  length (filter (leaves score s) l).

(* ---- What a file holds of a claim: runs and how many of them were left outside, in blocks; each
   block's bound; looks; the bound of all, and delta; the bound of each bin, None where there is
   none ---- *)
Record block := Block { runs : positive; discards : nat; bound : Q }.
Record claim := Claim {
  blocks : list block; looks : positive; eps : Q; delta : Q; in_bins : list (option Q) }.

(* What is said of one block: the law of its runs, their scores, and an event. *)
Record about {A : Type} := About {
  law_of : law A; score_of : A -> option R; wrong_of : list A -> bool }.
Arguments about : clear implicits.
(* The event happens only where some number leaves no more runs outside than the block may, and its
   tube is left by more than the block's bound. *)
Definition says {A} (a : about A) (b : block) : Prop :=
  is_law (law_of a) /\
  forall l, wrong_of a l = true ->
    exists s, (left_out (score_of a) s l <= discards b)%nat /\
              Q2R (bound b) < prob (law_of a) (leaves (score_of a) s).
Fixpoint all_draws {A} (l : list (about A)) (bs : list block) : law (list (list A)) :=
  match l, bs with
  | a :: l', b :: bs' => both cons (draws (law_of a) (Pos.to_nat (runs b))) (all_draws l' bs')
  | _, _ => [([], 1)]
  end.
Fixpoint some_wrong {A} (l : list (about A)) (drawn : list (list A)) : bool :=
  match l, drawn with
  | a :: l', d :: drawn' => wrong_of a d || some_wrong l' drawn'
  | _, _ => false
  end.

(* ---- Sets tested one after the other.  Plans are drawn from the widest one, each is run once.  A
   set is accepted while each before it was, and so many runs of plans in it, of which so many
   failed, show enough ---- *)
Definition riskier {A} (L : law A) (fails has : A -> bool) (e : R) : bool :=
  if Rlt_dec (e * prob L has) (prob L (fun a => has a && fails a)) then true else false.
Fixpoint accepts_a_bad_one {A} (L : law A) (fails : A -> bool) (e : R) (show : nat -> nat -> bool)
  (sets : list (A -> bool)) (l : list A) : bool :=
  match sets with
  | [] => false
  | has :: others =>
      show (length (filter has l)) (length (filter fails (filter has l))) &&
      (riskier L fails has e || accepts_a_bad_one L fails e show others l)
  end.
