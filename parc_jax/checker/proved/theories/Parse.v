(* From bytes to a value of JSON.  Nothing here has to be believed: ParseFacts.v proves that it
   finds the value of Json.v where there is one, and no other.  A place in a text is told by how
   many bytes are left.  No recursion is deeper than values are nested: JavaScript's stack would
   end. *)
From Coq Require Import Ascii String List Bool Arith NArith.
From ParcJax Require Import Json.
Import ListNotations.
Local Open Scope string_scope.

(* What was read and what is left, or what is wrong and where. *)
Inductive outcome (A : Type) := Read (x : A) (left : nat) | Wrong (why : string) (left : nat).
Arguments Read {A}.
Arguments Wrong {A}.

Definition here (s : string) (left : nat) : ascii :=
  match get (String.length s - left) s with Some c => c | None => "000"%char end.
Definition slice (s : string) (left upto : nat) : string :=
  substring (String.length s - left) (left - upto) s.
Fixpoint skip (test : ascii -> bool) (s : string) (left : nat) : nat :=
  match left with O => O | S left' => if test (here s left) then skip test s left' else left end.

(* ---- Numbers and texts ---- *)
Definition read_whole (s : string) (left : nat) : outcome json :=
  let first := if (here s left =? "-")%char then pred left else left in
  let upto := skip digit s first in
  if (first =? upto)%nat then Wrong "a value is missing" left else
  if (here s first =? "0")%char && (S upto <? first)%nat then
    Wrong "a number that begins with 0" left else
  if let c := here s upto in ((c =? ".") || (c =? "e") || (c =? "E"))%char then
    Wrong "a number that is not whole" left else
  if (max_digits <? N.of_nat (first - upto))%N then Wrong "a number that is too long" left else
  let t := slice s left upto in Read (Int (if t =? "-0" then "0" else t)) upto.

Definition four_at (s : string) (left : nat) : option N :=
  match left with
  | S (S (S (S _))) => four (here s left) (here s (left - 1)) (here s (left - 2)) (here s (left -
    3))
  | _ => None
  end.
Definition second_at (s : string) (left : nat) : option N :=
  if (here s left =? "\")%char && (here s (left - 1) =? "u")%char then
    match four_at s (left - 2) with Some n => if low n then Some n else None | None => None end
  else None.
(* What follows a backslash. *)
Definition read_escape (s : string) (left : nat) : option (string * nat) :=
  match left with
  | O => None
  | S left' =>
      let c := here s left in
      if (c =? "u")%char then
        match four_at s left' with
        | None => None
        | Some n =>
            match (if high n then second_at s (left' - 4) else None) with
            | Some m => Some (encoded (joined n m), left' - 10)
            | None => Some (encoded n, left' - 4)
            end
        end
      else match escaped c with Some d => Some (String d "", left') | None => None end
  end.
Definition glued (pieces : list string) : string :=
  match pieces with [s] => s | _ => String.concat "" (rev_append pieces []) end.
Fixpoint read_text (fuel : nat) (s : string) (left : nat) (pieces : list string)
  : outcome string :=
  match fuel with
  | O => Wrong "an unfinished text" left
  | S fuel' =>
      let upto := skip plain s left in
      let pieces' := if (left =? upto)%nat then pieces else slice s left upto :: pieces in
      match upto with
      | O => Wrong "an unfinished text" upto
      | S next =>
          if (here s upto =? quote)%char then Read (glued pieces') next else
          if (here s upto =? "\")%char then
            match read_escape s next with
            | Some (piece, next') => read_text fuel' s next' (piece :: pieces')
            | None => Wrong "an unknown escape" next
            end
          else Wrong "a control character in a text" upto
      end
  end.

(* ---- No key twice: keys are dealt out by any bits of theirs (Extract.v) until few are left ----
  *)
Definition bit (level : nat) (s : string) : bool := Nat.odd (String.length s / 2 ^ level)%nat.
Fixpoint few {A} (most : nat) (l : list A) : bool :=
  match l, most with [], _ => true | _ :: _, O => false | _ :: l', S n => few n l' end.
Fixpoint differ (l : list string) : bool :=
  match l with [] => true | s :: l' => negb (existsb (String.eqb s) l') && differ l' end.
Fixpoint deal (test : string -> bool) (l a b : list string) : list string * list string :=
  match l with
  | [] => (a, b)
  | s :: l' => if test s then deal test l' (s :: a) b else deal test l' a (s :: b)
  end.
Fixpoint unique (level : nat) (l : list string) : bool :=
  match level with
  | O => differ l
  | S level' =>
      if few 8 l then differ l else
      let (a, b) := deal (bit level') l [] [] in unique level' a && unique level' b
  end.

(* ---- Values ---- *)
Section Inside.
Variable inner : nat -> outcome json.
Variable s : string.
Fixpoint read_elements (fuel left : nat) (done : list json) : outcome (list json) :=
  match fuel with
  | O => Wrong "a value is missing" left
  | S fuel' =>
      match inner left with
      | Wrong why left' => Wrong why left'
      | Read v after =>
          let next := skip blank s after in
          if (here s next =? ",")%char then read_elements fuel' (pred next) (v :: done) else
          if (here s next =? "]")%char then Read (rev_append done [v]) (pred next) else
          Wrong "a comma is missing" next
      end
  end.
Fixpoint read_members (fuel left : nat) (done : list (string * json))
  : outcome (list (string * json)) :=
  match fuel with
  | O => Wrong "a key is missing" left
  | S fuel' =>
      let first := skip blank s left in
      if negb (here s first =? quote)%char then Wrong "a key is missing" first else
      match read_text first s (pred first) [] with
      | Wrong why left' => Wrong why left'
      | Read key after =>
          let colon := skip blank s after in
          if negb (here s colon =? ":")%char then Wrong "a colon is missing" colon else
          match inner (pred colon) with
          | Wrong why left' => Wrong why left'
          | Read v after =>
              let next := skip blank s after in
              if (here s next =? ",")%char then
                read_members fuel' (pred next) ((key, v) :: done) else
              if (here s next =? "}")%char then
                if unique 24 (fold_left (fun names m => fst m :: names) done [key]) then
                  Read (rev_append done [(key, v)]) (pred next)
                else Wrong "a key that appears twice" next
              else Wrong "a comma is missing" next
          end
      end
  end.
End Inside.

Definition as_json {A} (f : A -> json) (o : outcome A) : outcome json :=
  match o with Read x rest => Read (f x) rest | Wrong why rest => Wrong why rest end.
Definition read_word (w : string) (v : json) (s : string) (left : nat) : outcome json :=
  let upto := left - String.length w in
  if slice s left upto =? w then Read v upto else Wrong "an unknown word" left.
Fixpoint read_value (depth : nat) (s : string) (from : nat) : outcome json :=
  let left := skip blank s from in
  let c := here s left in
  if (c =? quote)%char then as_json Str (read_text left s (pred left) []) else
  if (c =? "[")%char then
    let next := skip blank s (pred left) in
    if (here s next =? "]")%char then Read (Arr []) (pred next) else
    match depth with
    | O => Wrong "too deep a nesting" next
    | S depth' => as_json Arr (read_elements (read_value depth' s) s left (pred left) [])
    end
  else if (c =? "{")%char then
    let next := skip blank s (pred left) in
    if (here s next =? "}")%char then Read (Obj []) (pred next) else
    match depth with
    | O => Wrong "too deep a nesting" next
    | S depth' => as_json Obj (read_members (read_value depth' s) s left (pred left) [])
    end
  else if (c =? "t")%char then read_word "true" (Bool true) s left
  else if (c =? "f")%char then read_word "false" (Bool false) s left
  else if (c =? "n")%char then read_word "null" Null s left
  else read_whole s left.

(* ---- Files ---- *)
Fixpoint counted (test : ascii -> bool) (s : string) (left n : nat) : nat :=
  match left with
  | O => n
  | S left' => counted test s left' (if test (here s left) then S n else n)
  end.
(* Where the text stops being UTF-8. *)
Fixpoint not_utf8 (s : string) (left : nat) (next : nat * ascii * ascii) : option nat :=
  let '(n, lo, hi) := next in
  match left, n with
  | O, O => None
  | O, S _ => Some left
  | S left', S n' =>
      if within lo hi (here s left) then not_utf8 s left' (n', "128", "191")%char else Some left
  | S left', O =>
      match letter (here s left) with Some next' => not_utf8 s left' next' | None => Some left end
  end.
Definition parse (s : string) : outcome json :=
  let all := String.length s in
  if (max_bytes <? N.of_nat all)%N then Wrong "the file is too large" all else
  if (max_marks <? N.of_nat (counted mark s all 0))%N then
    Wrong "the file has too many numbers and lists" all else
  match not_utf8 s all between_letters with
  | Some rest => Wrong "the text is not UTF-8" rest
  | None =>
      match read_value max_depth s all with
      | Wrong why rest => Wrong why rest
      | Read v after =>
          let rest := skip blank s after in
          match rest with O => Read v O | S _ => Wrong "something follows the value" rest end
      end
  end.
