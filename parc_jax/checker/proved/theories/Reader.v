(* From a value of JSON to an answer.  Nothing here has to be believed: ReaderFacts.v proves that an
   answer that was read is one that the value tells (Format.v). *)
From Coq Require Import Ascii String ZArith QArith Qabs List Bool Arith NArith.
From ParcJax Require Import Spec Arithmetic Checker Polytopes Doubt NoPlan Answer Episode Json Parse
  Format.
Import ListNotations.
Local Open Scope string_scope.

(* What was read, or what is wrong with it. *)
Inductive result (A : Type) := Fine (x : A) | Faulty (why : string).
Arguments Fine {A}.
Arguments Faulty {A}.
Definition bind {A B} (r : result A) (f : A -> result B) : result B :=
  match r with Fine x => f x | Faulty why => Faulty why end.
Notation "'let*' x := r 'in' f" := (bind r (fun x => f))
  (at level 200, x pattern, right associativity).
Definition check (ok : bool) (why : string) : result unit := if ok then Fine tt else Faulty why.

(* ---- Lists and objects; no recursion is as deep as a list is long ---- *)
Fixpoint onto {A B} (f : A -> result B) (l : list A) (done : list B) : result (list B) :=
  match l with
  | [] => Fine (rev_append done [])
  | x :: l' => match f x with Fine y => onto f l' (y :: done) | Faulty why => Faulty why end
  end.
Definition each {A B} (f : A -> result B) (l : list A) : result (list B) := onto f l [].
Definition many {A} (l : list A) : nat := fold_left (fun n _ => S n) l O.
Definition a_list (v : json) : result (list json) :=
  match v with Arr l => Fine l | _ => Faulty "a list was expected" end.
Definition list_of {A} (f : json -> result A) (v : json) : result (list A) :=
  let* l := a_list v in each f l.
Definition sized {A} (n : nat) (f : json -> result A) (v : json) : result (list A) :=
  let* l := a_list v in
  let* _ := check (many l =? n)%nat "a list has another number of entries" in each f l.
Definition pair_of {A B} (f : json -> result A) (g : json -> result B) (v : json)
  : result (A * B) :=
  match v with
  | Arr [a; b] => let* x := f a in let* y := g b in Fine (x, y)
  | _ => Faulty "a pair was expected"
  end.

Fixpoint look (name : string) (l : list (string * json)) : option json :=
  match l with
  | [] => None
  | (k, v) :: l' => if k =? name then Some v else look name l'
  end.
Definition get (name : string) (l : list (string * json)) : result json :=
  match look name l with Some v => Fine v | None => Faulty ("a field is missing: " ++ name) end.
Definition among (name : string) (names : list string) : bool := existsb (String.eqb name) names.
(* Its fields: all of these names, and none but those and the optional ones. *)
Definition object (names optional : list string) (v : json) : result (list (string * json)) :=
  match v with
  | Obj l =>
      let known k := among k names || among k optional in
      match find (fun m => negb (known (fst m))) l with
      | Some (k, _) => Faulty ("an unknown field: " ++ k)
      | None => let* _ := each (fun name => get name l) names in Fine l
      end
  | _ => Faulty "an object was expected"
  end.

(* ---- Numbers ---- *)

(* So many digits after those that make `done`: pieces of machine integers. *)
Definition piece_limit : nat := N.to_nat 1000000.
Fixpoint digits (base : nat) (s : string) (left n piece weight : nat) (done : Z) : Z :=
  match n with
  | O => (done * Z.of_nat weight + Z.of_nat piece)%Z
  | S n' =>
      let piece' := (piece * base + value_of (here s left))%nat in
      let weight' := (weight * base)%nat in
      if (piece_limit <=? weight')%nat then
        digits base s (pred left) n' O 1 (done * Z.of_nat weight' + Z.of_nat piece')
      else digits base s (pred left) n' piece' weight' done
  end.
Definition ten : nat := 10.
Definition sixteen : nat := 16.

(* Between the least and the most. *)
Definition index (least : nat) (most : N) (v : json) : result nat :=
  match v with
  | Int s =>
      let n := String.length s in
      if (skip digit s n =? 0)%nat then
        if (N.of_nat n <=? 9)%N then
          let v := fold_left (fun v c => (v * ten + value_of c)%nat) (list_ascii_of_string s) O in
          let* _ := check ((least <=? v)%nat && (N.of_nat v <=? most)%N)
            ("a whole number is out of its range: " ++ s) in Fine v
        else Faulty "a whole number is too large"
      else Faulty "a whole number is negative"
  | _ => Faulty "a whole number was expected"
  end.
Fixpoint power (base : Z) (e : BinNums.positive) : Z :=
  match e with
  | xH => base
  | xO e' => let r := power base e' in (r * r)%Z
  | xI e' => let r := power base e' in (base * (r * r))%Z
  end.
(* Numerator and denominator of z base^e. *)
Definition raised (base z e : Z) : Z * Z :=
  match e with
  | Z0 => (z, 1%Z)
  | Zpos p => ((z * power base p)%Z, 1%Z)
  | Zneg p => (z, power base p)
  end.
Definition all_digits (s : string) (left least most : nat) : option Z :=
  if ((least <=? left) && (left <=? most) && (skip digit s left =? 0))%nat then
    Some (digits ten s left left 0 1 0) else None.
Definition exponent (most : nat) (s : string) (left : nat) : option Z :=
  let sign := here s left in
  if (sign =? "-")%char then option_map Z.opp (all_digits s (pred left) 1 most) else
  all_digits s (if (sign =? "+")%char then pred left else left) 1 most.
(* Digits, a point and digits, or no point: all of them as one number, how many follow the point,
   and what is left. *)
Definition read_pointed (test : ascii -> bool) (base : nat) (s : string) (left : nat)
  : nat * nat * Z * nat :=
  let p := skip test s left in
  let q := if (here s p =? ".")%char then pred p else p in
  let r := if (here s p =? ".")%char then skip test s q else q in
  let z := digits base s left (left - p) 0 1 0 in
  (left - p, q - r, digits base s q (q - r) 0 1 z, r)%nat.
Definition read_hex (s : string) (left : nat) : option (Z * Z) :=
  let '(a, b, z, r) := read_pointed hex_digit sixteen s left in
  let most := N.to_nat 40 in
  if ((1 <=? a) && (a <=? most) && (b <=? most))%nat && (here s r =? "p")%char then
    match exponent 4 s (pred r) with
    | Some e => Some (raised 2 z (e - 4 * Z.of_nat b))
    | None => None
    end
  else None.
Definition read_decimal (s : string) (left : nat) : option (Z * Z) :=
  let '(a, b, z, r) := read_pointed digit ten s left in
  if (a =? 0)%nat then None else
  if (here s r =? "/")%char && (a + r =? left)%nat then
    option_map (fun d => (z, d)) (all_digits s (pred r) 1 left)
  else if (a + r <? left)%nat && (b =? 0)%nat then None else
  match r with
  | O => Some (raised 10 z (- Z.of_nat b))
  | S r' =>
      if (here s r =? "e")%char then
        match exponent 3 s r' with
        | Some e => Some (raised 10 z (e - Z.of_nat b))
        | None => None
        end
      else None
  end.
Definition read_number (s : string) : option (Z * Z) :=
  let all := String.length s in
  let minus := (here s all =? "-")%char in
  let i := if minus then pred all else all in
  match (if slice s i (i - 2) =? "0x" then read_hex s (i - 2) else read_decimal s i) with
  | Some (n, d) => Some (if minus then (- n)%Z else n, d)
  | None => None
  end.

Definition max_chars := 1000%N.
Definition longest := (2 ^ 8192)%Z.                     (* denominators are below it *)
Definition largest := (2 ^ 16384)%Z.                    (* and integers over a common one below this
  *)
Definition fraction (n d : Z) : result Q :=
  match d with
  | Zpos p =>
      let q := red (Qmake n p) in
      if Z.leb longest (Zpos (Qden q)) then Faulty "a denominator is too long" else Fine q
  | _ => Faulty "a denominator is zero"
  end.
Definition number (v : json) : result Q :=
  match v with
  | Str s =>
      if (max_chars <? N.of_nat (String.length s))%N then Faulty "a number is too long" else
      match read_number s with
      | Some (n, d) => fraction n d
      | None => Faulty ("not a finite number: " ++ substring 0 (N.to_nat 40) s)
      end
  | _ => Faulty "a number is a text here"
  end.
Definition numbers_of : json -> result vec := list_of number.
Definition numbers_in (n : nat) : json -> result vec := sized n number.

(* Numbers that are used together over one denominator, the least common one, if it and the
   integers over it are short: the checker adds such numbers fastest.  What is found is tried. *)
Definition lcm (a b : Z) : Z := if Z.eqb a b || Z.eqb b 1 then a else (a / Z.gcd a b * b)%Z.
Definition common (ls : list (list Q)) : result Z :=
  let one d x := if Z.leb longest d then d else lcm d (Zpos (Qden x)) in
  let d := fold_left (fun d l => fold_left one l d) ls 1%Z in
  if Z.leb longest d then Faulty "a common denominator is too long" else Fine d.
Definition over (d : Z) (x : Q) : result Q :=
  match d with
  | Zpos p =>
      let m := (d / Zpos (Qden x))%Z in
      let n := (Qnum x * m)%Z in
      if Z.eqb (Zpos (Qden x) * m) d then
        if Z.leb largest (Z.abs n) then Faulty "a number is too large for its denominator"
        else Fine (Qmake n p)
      else Faulty "a quotient is not whole"
  | _ => Faulty "a divisor is not positive"
  end.
Definition leveled (l : list Q) : result vec := let* d := common [l] in each (over d) l.
Definition level (rows : list (vec * Q)) : result poly :=
  let* d := common (fold_left (fun ls r => [snd r] :: fst r :: ls) rows []) in
  each (fun r => let* w := each (over d) (fst r) in let* b := over d (snd r) in Fine (w, b)) rows.
Definition short_numbers (n : nat) (v : json) : result vec :=
  let* l := numbers_in n v in leveled l.

(* ---- Problem, network, tube ---- *)
Definition field {A} (name : string) (f : json -> result A) (l : list (string * json)) : result A :=
  let* v := get name l in f v.
Definition any : N := 999999999.
Definition below (n : nat) (v : json) : result nat :=
  let* i := index 0 any v in
  let* _ := check (i <? n)%nat "a whole number is out of its range" in Fine i.
Definition rows_of (n : nat) (l : list (string * json)) : result poly :=
  let* a := field "A" (list_of (numbers_in n)) l in
  let* b := field "b" (numbers_in (many a)) l in
  level (combine a b).
Definition poly_of (n : nat) (v : json) : result poly :=
  let* l := object ["A"; "b"] [] v in rows_of n l.
Definition box_of (n : nat) (v : json) : result (list (Q * Q)) :=
  let* l := object ["lo"; "hi"] [] v in
  let* lo := field "lo" (numbers_in n) l in
  let* hi := field "hi" (numbers_in n) l in
  Fine (combine lo hi).
Definition obstacle_of (n steps : nat) (v : json) : result obstacle :=
  let* l := object ["A"; "b"] ["steps"] v in
  let* A := rows_of n l in
  match look "steps" l with
  | None => Fine (Obstacle A 0 (pred steps))
  | Some (Arr [a; b]) =>
      let* first := below steps a in
      let* last := below steps b in
      let* _ := check (first <=? last)%nat "an obstacle ends before it begins" in
      Fine (Obstacle A first last)
  | Some _ => Faulty "the steps of an obstacle are a first and a last one"
  end.
Definition part_of (n points : nat) (v : json) : result part :=
  let* l := object ["points"] ["radius"; "vertices"] v in
  let* corners := field "points" (list_of (below points)) l in
  match look "radius" l, look "vertices" l with
  | Some r, None => let* r := number r in Fine (Part corners (Disc r))
  | None, Some vs => let* vs := list_of (numbers_in n) vs in Fine (Part corners (Hull vs))
  | _, _ => Faulty "a body has a radius or vertices"
  end.
Definition positive_number (v : json) : result Q :=
  let* x := number v in
  let* _ := check (negb (Z.leb (Qnum x) 0)) "the time step dt is not positive" in Fine x.
Definition problem_of (v : json) : result problem :=
  let* l := object ["n_p"; "points"; "n_q"; "n_k"; "steps"; "dt"; "domain"; "goal"; "start";
                    "obstacles"; "body"] [] v in
  let* n_p := field "n_p" (index 1 8) l in
  let* n_q := field "n_q" (index 0 64) l in
  let* n_k := field "n_k" (index 1 8) l in
  let* steps := field "steps" (index 1 100000) l in
  let* points := field "points" (index 1 64) l in
  let* domain := field "domain" (box_of n_k) l in
  let* goal := field "goal" (poly_of (points * n_p + n_q)) l in
  let* start := field "start" (fun v => match v with Null => Fine [] | _ => poly_of n_p v end) l in
  let* obstacles := field "obstacles" (list_of (obstacle_of n_p steps)) l in
  let* parts := field "body" (fun v =>
    let* l := object ["parts"] [] v in field "parts" (list_of (part_of n_p points)) l) l in
  let* _ := field "dt" positive_number l in
  Fine (Problem n_p n_q n_k points steps domain start goal obstacles parts).

Definition max_layers : nat := N.to_nat 64.
Definition layer_of (wb : list vec * vec) : result layer :=
  let* _ := check (many (fst wb) =? many (snd wb))%nat "weights and biases do not fit" in
  level (combine (fst wb) (snd wb)).
Definition network_of (v : json) : result (list layer) :=
  let* l := object ["weights"; "biases"] [] v in
  let* w := field "weights" (list_of (list_of numbers_of)) l in
  let* _ := check ((1 <=? many w) && (many w <=? max_layers))%nat "too few or too many layers" in
  let* b := field "biases" (sized (many w) numbers_of) l in
  each layer_of (combine w b).

Definition multipliers_of (n : nat) (v : json) : result multipliers :=
  let* found := list_of (pair_of (below n) number) v in
  let* ms := leveled (map snd found) in
  Fine (combine (map fst found) ms).
Definition error_of (n : nat) (v : json) : result error :=
  match v with
  | Obj _ => let* A := poly_of n v in Fine (Rows A)
  | _ => let* e := short_numbers n v in Fine (Widths e)
  end.
Definition end_size (P : problem) : nat := (n_points P * n_p P + n_q P)%nat.
(* The error of the end; of a polytope with multipliers for each row of the goal. *)
Definition final_of (P : problem) (v : json) : result (error * goal_hints) :=
  match v with
  | Obj _ =>
      let* l := object ["A"; "b"; "goal"] [] v in
      let* A := rows_of (end_size P) l in
      let* hints := field "goal" (sized (many (goal P)) (list_of (multipliers_of (many A)))) l in
      Fine (Rows A, hints)
  | _ => let* e := short_numbers (end_size P) v in Fine (Widths e, [])
  end.
Definition tube_of (P : problem) (v : json) : result (tube * list goal_hints) :=
  let* l := object ["edges"; "interval"; "final"] [] v in
  let* edges := field "edges" (sized (n_k P) numbers_of) l in
  let* intervals := field "interval"
    (list_of (sized (steps P) (sized (n_points P) (error_of (n_p P))))) l in
  let* finals := field "final" (list_of (final_of P)) l in
  Fine (Tube edges intervals (map fst finals), map snd finals).

(* ---- Samples, corridors, polytopes, boxes of doubt ---- *)
Definition run_of (steps rows : nat) : json -> result run :=
  pair_of (index 0 (N.of_nat steps)) (multipliers_of rows).
Definition sep_of (P : problem) (v : json) : result sepn :=
  let* l := sized (many (obstacles P)) (fun v => Fine v) v in
  each (fun ov => sized (many (parts P))
    (list_of (run_of (steps P) (many (rows (fst ov))))) (snd ov)) (combine (obstacles P) l).
Definition sample_of (P : problem) (v : json) : result sample :=
  let* l := object ["p0"; "k"; "sep"] [] v in
  let* p0 := field "p0" (short_numbers (n_p P)) l in
  let* k := field "k" (short_numbers (n_k P)) l in
  let* sep := field "sep" (sep_of P) l in
  Fine (Sample p0 k sep).

(* One digit for each hidden neuron. *)
Fixpoint bits (s : string) (left n : nat) (done : list bool) : result (list bool) :=
  match n with
  | O => Fine (rev_append done [])
  | S n' =>
      let c := here s left in
      if (c =? "1")%char then bits s (pred left) n' (true :: done) else
      if (c =? "0")%char then bits s (pred left) n' (false :: done) else
      Faulty "the pattern does not have one 0 or 1 for each hidden neuron"
  end.
Fixpoint pattern_of (N : list layer) (s : string) (left : nat) : result (list (list bool)) :=
  let done := let* _ := check (left =? 0)%nat "the pattern has digits left over" in Fine [] in
  match N with
  | [] => done
  | L :: N' =>
      match N' with
      | [] => done
      | _ =>
          let* b := bits s left (many L) [] in
          let* bs := pattern_of N' s (left - many L) in
          Fine (b :: bs)
      end
  end.
Definition piece_of (P : problem) (N : list layer) (v : json) : result piece :=
  let* l := object ["p0"; "k"; "bin"; "pattern"; "sep"] [] v in
  let* p0 := field "p0" (numbers_in (n_p P)) l in
  let* k := field "k" (numbers_in (n_k P)) l in
  let* inner := leveled (p0 ++ k)%list in
  let* which := field "bin" (index 0 any) l in
  let* pattern := field "pattern" (fun v => match v with
    | Str s => pattern_of N s (String.length s) | _ => Faulty "the pattern is not a text" end) l in
  let* sep := field "sep" (sep_of P) l in
  Fine (Piece inner which pattern sep).

Definition widths_of (n : nat) (v : json) : result vec :=
  let* e := short_numbers n v in
  let* _ := check (forallb (fun r => Z.leb 0 (Qnum r)) e) "a half width is negative" in Fine e.
Definition side_of (kr : Q * Q) : Q * Q :=
  let (k, r) := kr in (qadd k (Qmake (- Qnum r) (Qden r)), qadd k r).
Definition boxed_of (P : problem) (v : json) : result boxed :=
  let* l := object ["p0"; "k"; "room"; "sep"] [] v in
  let* p0 := field "p0" (short_numbers (n_p P)) l in
  let* k := field "k" (numbers_in (n_k P)) l in
  let* room := field "room" (object ["p0"; "k"] []) l in
  let* r := field "p0" (widths_of (n_p P)) room in
  let* rk := field "k" (widths_of (n_k P)) room in
  let* sep := field "sep" (sep_of P) l in
  Fine (Boxed p0 r (map side_of (combine k rk)) sep).

(* ---- No plan, and volumes ---- *)
Definition group_of (P : problem) (n : nat) (v : json) : result group :=
  let* bc := pair_of (numbers_in n)
    (list_of (fun v => let* c := pair_of numbers_of (sized n (numbers_in (n_p P))) v in
                       Fine (Contact (fst c) (snd c)))) v in
  Fine (Group (fst bc) (snd bc)).
Definition hit_of (P : problem) (v : json) : result hit :=
  match v with
  | Arr [o; b; t; share; groups] =>
      let* o := below (many (obstacles P)) o in
      let* b := below (many (parts P)) b in
      let* t := below (steps P) t in
      let* share := number share in
      let n := many (corners (nth b (parts P) (Part [] (Disc 0)))) in
      let* groups := list_of (group_of P n) groups in
      Fine (Hit o b t share groups)
  | _ => Faulty "a hit has another form"
  end.
(* A row of the goal with its multiplier, and an error of the end where one is named. *)
Definition use_of (P : problem) (v : json) : result use :=
  let row i m := let* i := below (many (goal P)) i in let* m := number m in Fine (i, m) in
  match v with
  | Arr [i; m] => let* r := row i m in Fine (Use (fst r) (snd r) None)
  | Arr [i; m; x] =>
      let* r := row i m in
      let* x := numbers_in (end_size P) x in Fine (Use (fst r) (snd r) (Some x))
  | _ => Faulty "a row of the goal is [row, m] or [row, m, error]"
  end.
Definition uses_of (P : problem) (v : json) : result (list use) :=
  let* us := list_of (use_of P) v in
  let* _ := leveled (map times us) in Fine us.
Definition failure_of (P : problem) (name : string) (v : json) : result reason :=
  if name =? "goal" then let* us := uses_of P v in Fine (Misses us) else
  if name =? "start" then let* m := multipliers_of (many (start P)) v in Fine (Elsewhere m) else
  if name =? "hit" then let* h := hit_of P v in Fine (Hits h) else
  Faulty "a node of the tree is not known".
Definition leaf_of (P : problem) (name : string) (v : json) : result reason :=
  if name =? "safe" then let* s := sep_of P v in Fine (Safe s) else
  if name =? "open" then Fine Open else
  if name =? "bounded" then
    match v with
    | Obj [(name, v)] => let* r := failure_of P name v in Fine (Bounded r)
    | _ => Faulty "a node of the tree is not known"
    end
  else failure_of P name v.
(* From the last node back: a split takes the two trees that begin after it, the lower one first. *)
Fixpoint grown (P : problem) (nodes : list json) (made : list tree) : result tree :=
  match nodes with
  | [] => match made with [t] => Fine t | _ => Faulty "the tree has nodes left over, or none" end
  | Obj [(name, v)] :: nodes' =>
      if name =? "split" then
        match made, pair_of (below (n_p P + n_k P)) number v with
        | lower :: upper :: made', Fine (axis, at_) =>
            grown P nodes' (Split axis at_ lower upper :: made')
        | _, Faulty why => Faulty why
        | _, _ => Faulty "the tree has too few nodes"
        end
      else match leaf_of P name v with
           | Fine r => grown P nodes' (Leaf r :: made)
           | Faulty why => Faulty why
           end
  | _ => Faulty "a node of the tree is not known"
  end.
Definition tree_of (P : problem) (v : json) : result tree :=
  let* l := a_list v in grown P (rev_append l []) [].
Definition proof_of (P : problem) (l : list (string * json)) : result proof :=
  let* z := field "z" (box_of (n_p P)) l in
  let* faces := field "faces" (sized (n_p P) (pair_of (uses_of P) (uses_of P))) l in
  let* root := field "tree" (tree_of P) l in
  Fine (Proof z faces root).
Definition absence_of (P : problem) (v : json) : result absence :=
  let* l := object ["kind"; "z"; "faces"; "tree"] [] v in
  let* p := proof_of P l in
  match look "kind" l with
  | Some (Str kind) =>
      if kind =? "proved" then Fine (Proved p) else
      if kind =? "bracket" then Fine (Bracket p) else
      Faulty "the kind is neither proved nor bracket"
  | _ => Faulty "the kind is not a text"
  end.

(* ---- A whole answer ---- *)
(* An entry that cannot be read is refused like one that fails. *)
Definition tried {A} (r : result A) : option A :=
  match r with Fine x => Some x | Faulty _ => None end.
Definition entries {A} (name : string) (f : json -> result A) (l : list (string * json))
  : result (list (option A)) :=
  match look name l with
  | None => Fine []
  | Some v => list_of (fun v => Fine (tried (f v))) v
  end.
Definition answer_of (v : json) : result answer :=
  let* l := object ["format"; "problem"; "network"; "tube"; "claim"; "hash"; "samples"; "sets";
                    "no_plan"] ["corridors"; "doubt"; "meta"] v in
  let* _ := check (match look "format" l with Some (Str s) => s =? "parc_jax.answer/3"
    | _ => false end) "the format is unknown" in
  let* P := field "problem" problem_of l in
  let* N := field "network" network_of l in
  let* EH := field "tube" (tube_of P) l in
  let* samples := entries "samples" (sample_of P) l in
  let* sets := entries "sets" (piece_of P N) l in
  let* corridors := entries "corridors" (sample_of P) l in
  let* doubts := entries "doubt" (boxed_of P) l in
  let* absent := field "no_plan" (fun v => match v with
    | Null => Fine Unclaimed
    | _ => Fine (match absence_of P v with Fine x => x | Faulty _ => Unread end) end) l in
  Fine (Answer P N (fst EH) (snd EH) samples sets corridors doubts absent).

(* ---- A whole episode ---- *)
(* All copies of a point, or none, are in a part of the body. *)
Definition whole_copies (copies points : nat) (p : part) : bool :=
  let has i := existsb (Nat.eqb i) (corners p) in
  forallb (fun i => Bool.eqb (has i) (has (i / copies * copies)%nat)) (seq 0 (points + copies)).
Definition turns_round (p : part) : bool := match grown_by p with Disc _ => true | Hull _ => false
  end.
Definition most_turn : Q := 8.                          (* [rad] of a heading *)
(* The place of a pose, and its heading where it has one. *)
Definition pose_of (n : nat) (v : json) : result (vec * option Q) :=
  let* l := numbers_of v in
  if (many l =? n)%nat then Fine (l, None) else
  match l with
  | [x; y; h] =>
      let* _ := check (n =? 2)%nat
        "a pose has a number for each axis, in the plane maybe a heading" in
      let* _ := check (Qle_bool (Qabs h) most_turn) "a heading is beyond 8 rad" in
      Fine ([x; y], Some h)
  | _ => Faulty "a pose has a number for each axis, in the plane maybe a heading"
  end.
Definition problem_and_tick (v : json) : result (problem * Q) :=
  let* P := problem_of v in
  match v with
  | Obj l => let* dt := field "dt" number l in Fine (P, dt)
  | _ => Faulty "an object was expected"
  end.
Definition sides_alike (a b : Q * Q) : bool :=
  Qeq_bool (fst a) (fst b) && Qeq_bool (snd a) (snd b).
Definition manoeuvre_fields : json -> result (list (string * json)) :=
  object ["begin"; "pose"; "problem"; "sample"] [].
Definition manoeuvre_of (P : problem) (dt : Q) (copies : nat) (turns : bool)
    (H : list goal_hints) (v : json) : result manoeuvre :=
  let* l := manoeuvre_fields v in
  let* begins := field "begin" number l in
  let* ph := field "pose" (pose_of (n_p P)) l in
  let* Qdt := field "problem" problem_and_tick l in
  let* _ := check (all_alike sides_alike (domain (fst Qdt)) (domain P) && Qeq_bool (snd Qdt) dt)
    "another problem has another domain or time step" in
  let* _ := check (Bool.eqb turns (match snd ph with Some _ => true | None => false end))
    "a manoeuvre is told in another frame than the one before" in
  let* _ := check (forallb (whole_copies copies (n_points P)) (parts (fst Qdt)))
    "a part of the body leaves out copies of a point" in
  let* _ := check (negb turns || forallb turns_round (parts (fst Qdt)))
    "a polygon does not turn with the robot" in
  let* plan := field "sample" (fun v => Fine (tried (sample_of (fst Qdt) v))) l in
  Fine (Manoeuvre begins (fst ph) (match snd ph with Some h => h | None => 0%Q end) (fst Qdt) H
    plan).
Definition episode_of (v : json) : result episode :=
  let* l := object ["format"; "hash"; "network"; "tube"; "manoeuvres"; "claim"; "copies"; "doubt";
                    "premises"] ["meta"] v in
  let* _ := check (match look "format" l with Some (Str s) => s =? "parc_jax.episode/3"
    | _ => false end) "the format is unknown" in
  let* entries := field "manoeuvres" a_list l in
  match entries with
  | [] => Faulty "an episode without a manoeuvre"
  | initial :: _ =>
      let* m := manoeuvre_fields initial in
      let* Pdt := field "problem" problem_and_tick m in
      let P := fst Pdt in
      let* N := field "network" network_of l in
      let* EH := field "tube" (tube_of P) l in
      let* copies := field "copies" (index 1 (N.of_nat (n_points P))) l in
      let* off := field "doubt" (numbers_in (n_p P + 2)) l in
      let* _ := check (forallb (fun r => Z.leb 0 (Qnum r)) off) "a doubt is negative" in
      let* ph := field "pose" (pose_of (n_p P)) m in
      let turns := match snd ph with Some _ => true | None => false end in
      let* _ := check (negb turns || Z.leb (Qnum (nth (n_p P) off 0%Q)) 0 ||
        (copies =? copies / 3 * 3)%nat) "headings are off, and a point has no three copies" in
      let* ms := each (manoeuvre_of P (snd Pdt) copies turns (snd EH)) entries in
      Fine (Episode N (fst EH) (snd Pdt) turns (firstn (n_p P) off) ms)
  end.
