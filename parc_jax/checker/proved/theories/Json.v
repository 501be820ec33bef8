(* Which bytes spell which value of JSON, as docs/certificates.md wants it: numbers are whole, no
   key is there twice, nothing is nested too deep.  A text is its bytes. *)
From Coq Require Import Ascii String List Bool Arith NArith.
Import ListNotations.
Local Open Scope string_scope.

(* Of a whole number its digits are kept. *)
Inductive json :=
  | Null | Bool (b : bool) | Int (digits : string) | Str (s : string)
  | Arr (l : list json) | Obj (l : list (string * json)).

(* ---- Bytes ---- *)
Definition within (lo hi c : ascii) : bool :=
  ((nat_of_ascii lo <=? nat_of_ascii c) && (nat_of_ascii c <=? nat_of_ascii hi))%nat.
Fixpoint every (test : ascii -> bool) (s : string) : bool :=
  match s with "" => true | String c s' => test c && every test s' end.
Definition blank (c : ascii) : bool :=
  (c =? " ")%char || (c =? "010")%char || (c =? "013")%char || (c =? "009")%char.
Definition digit : ascii -> bool := within "0" "9".
Definition size (s : string) : N := N.of_nat (String.length s).

(* ---- Whole numbers ---- *)
Definition max_digits := 4300%N.
Definition unsigned (s : string) : Prop :=
  s <> "" /\ every digit s = true /\ (forall s', s = String "0" s' -> s' = "") /\
  (size s <= max_digits)%N.
Inductive whole : string -> string -> Prop :=
  | not_negative s : unsigned s -> whole s s
  | negative s : unsigned s -> s <> "0" -> whole ("-" ++ s) ("-" ++ s)
  | minus_zero : whole "-0" "0".

(* ---- Texts between quotes ---- *)
Definition quote : ascii := """".
Definition plain (c : ascii) : bool :=
  negb ((c =? quote)%char || (c =? "\")%char || within "000" "031" c).
Definition escaped (c : ascii) : option ascii :=
  if ((c =? quote) || (c =? "\") || (c =? "/"))%char then Some c else
  if (c =? "b")%char then Some "008"%char else if (c =? "f")%char then Some "012"%char else
  if (c =? "n")%char then Some "010"%char else if (c =? "r")%char then Some "013"%char else
  if (c =? "t")%char then Some "009"%char else None.
Definition hex (c : ascii) : option N :=
  let from (first : ascii) n := Some (n + (N_of_ascii c - N_of_ascii first))%N in
  if within "0" "9" c then from "0"%char 0%N else if within "a" "f" c then from "a"%char 10%N else
  if within "A" "F" c then from "A"%char 10%N else None.
Definition four (a b c d : ascii) : option N :=
  match hex a, hex b, hex c, hex d with
  | Some a, Some b, Some c, Some d => Some (((a * 16 + b) * 16 + c) * 16 + d)%N
  | _, _, _, _ => None
  end.
Definition bytes (l : list N) : string := fold_right (fun n s => String (ascii_of_N n) s) "" l.
(* UTF-8; of half a pair too, which no text has that is UTF-8 itself, so it is no known word *)
Definition encoded (n : N) : string :=
  let more k := (128 + n / 2 ^ k mod 64)%N in
  if (n <? 128)%N then bytes [n] else
  if (n <? 2048)%N then bytes [192 + n / 64; more 0]%N else
  if (n <? 65536)%N then bytes [224 + n / 4096; more 6; more 0]%N else
  bytes [240 + n / 262144; more 12; more 6; more 0]%N.
Definition high (n : N) : bool := (55296 <=? n)%N && (n <? 56320)%N.
Definition low (n : N) : bool := (56320 <=? n)%N && (n <? 57344)%N.
Definition joined (h l : N) : N := (65536 + (h - 55296) * 1024 + (l - 56320))%N.
(* Begins with the second half of a pair. *)
Definition second_half (t : string) : option N :=
  match t with
  | String x (String u (String a (String b (String c (String d _))))) =>
      if (x =? "\")%char && (u =? "u")%char then
        match four a b c d with Some n => if low n then Some n else None | None => None end
      else None
  | _ => None
  end.
Inductive spells : string -> string -> Prop :=
  | nothing : spells "" ""
  | itself c t s : plain c = true -> spells t s -> spells (String c t) (String c s)
  | short c d t s : escaped c = Some d -> spells t s ->
      spells (String "\" (String c t)) (String d s)
  | numbered a b c d n t s : four a b c d = Some n -> (high n = true -> second_half t = None) ->
      spells t s ->
      spells (String "\" (String "u" (String a (String b (String c (String d t))))))
             (encoded n ++ s)
  | paired a b c d n e f g h m t s : four a b c d = Some n -> high n = true ->
      four e f g h = Some m -> low m = true -> spells t s ->
      spells (String "\" (String "u" (String a (String b (String c (String d
             (String "\" (String "u" (String e (String f (String g (String h t))))))))))))
             (encoded (joined n m) ++ s).
Definition quoted (t : string) : string := String quote (t ++ String quote "").

(* ---- Values, that hold others at most so deep, with blanks around them or without ---- *)
Inductive value : nat -> string -> json -> Prop :=
  | null n : value n "null" Null
  | true_ n : value n "true" (Bool true)
  | false_ n : value n "false" (Bool false)
  | a_number n t s : whole t s -> value n t (Int s)
  | a_text n t s : spells t s -> value n (quoted t) (Str s)
  | no_list n b : every blank b = true -> value n ("[" ++ b ++ "]") (Arr [])
  | some_list n t l : elements n t l -> value (S n) ("[" ++ t ++ "]") (Arr l)
  | no_object n b : every blank b = true -> value n ("{" ++ b ++ "}") (Obj [])
  | some_object n t l : members n t l -> NoDup (map fst l) ->
      value (S n) ("{" ++ t ++ "}") (Obj l)
with spaced : nat -> string -> json -> Prop :=
  | between_blanks n a t b v : every blank a = true -> every blank b = true -> value n t v ->
      spaced n (a ++ t ++ b) v
with elements : nat -> string -> list json -> Prop :=
  | one n t v : spaced n t v -> elements n t [v]
  | more n t v u l : spaced n t v -> elements n u l -> elements n (t ++ "," ++ u) (v :: l)
with members : nat -> string -> list (string * json) -> Prop :=
  | pair_ n a k b t s v : every blank a = true -> spells k s -> every blank b = true ->
      spaced n t v -> members n (a ++ quoted k ++ b ++ ":" ++ t) [(s, v)]
  | pairs n a k b t s v u l : every blank a = true -> spells k s -> every blank b = true ->
      spaced n t v -> members n u l ->
      members n (a ++ quoted k ++ b ++ ":" ++ t ++ "," ++ u) ((s, v) :: l).

(* ---- Files ---- *)
Definition max_depth : nat := N.to_nat 500.
Definition max_bytes := 67108864%N.
Definition max_marks := 4194304%N.                      (* commas and opening brackets *)
Definition mark (c : ascii) : bool := (c =? ",")%char || (c =? "[")%char || (c =? "{")%char.
Fixpoint count (test : ascii -> bool) (s : string) (n : nat) : nat :=
  match s with "" => n | String c s' => count test s' (if test c then S n else n) end.

(* No overlong form, no half of a pair, nothing above U+10FFFF: so many more bytes of a letter are
   to come, the next one within lo .. hi. *)
Definition letter (c : ascii) : option (nat * ascii * ascii) :=
  if within "000" "127" c then Some (0, "128", "191")%char else
  if within "194" "223" c then Some (1, "128", "191")%char else
  if (c =? "224")%char then Some (2, "160", "191")%char else
  if (c =? "237")%char then Some (2, "128", "159")%char else
  if within "225" "239" c then Some (2, "128", "191")%char else
  if (c =? "240")%char then Some (3, "144", "191")%char else
  if within "241" "243" c then Some (3, "128", "191")%char else
  if (c =? "244")%char then Some (3, "128", "143")%char else None.
Fixpoint utf8 (s : string) (next : nat * ascii * ascii) : bool :=
  let '(n, lo, hi) := next in
  match s, n with
  | "", O => true
  | "", S _ => false
  | String c s', S n' => within lo hi c && utf8 s' (n', "128", "191")%char
  | String c s', O => match letter c with Some next' => utf8 s' next' | None => false end
  end.
Definition between_letters : nat * ascii * ascii := (0, "128", "191")%char.

(* The value that the bytes of a file spell. *)
Definition json_of (s : string) (v : json) : Prop :=
  (size s <= max_bytes)%N /\ (N.of_nat (count mark s 0) <= max_marks)%N /\
  utf8 s between_letters = true /\ spaced max_depth s v.
