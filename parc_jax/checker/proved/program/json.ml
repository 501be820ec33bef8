(* Strict JSON, as docs/certificates.md wants it: no floats, no key twice, valid UTF-8, bounded depth.  Not proved. *)
type t = Null | Bool of bool | Int of string | Str of string | Arr of t list | Obj of (string * t) list

exception Bad of string

let bad fmt = Printf.ksprintf (fun m -> raise (Bad m)) fmt
let max_bytes = 1 lsl 26
let max_depth = 500
let max_digits = 4300 (* of a whole number anywhere, also where nobody reads it *)
let max_values = 1 lsl 22 (* commas and opening brackets *)

let utf8 s =
  (* no overlong forms, no surrogates, nothing above U+10FFFF *)
  let n = String.length s in
  let at j = if j < n then Char.code s.[j] else 0 in
  let more j = at j land 0xC0 = 0x80 in
  let rec go j =
    if j < n then
      let c = at j in
      if c < 0x80 then go (j + 1)
      else if c >= 0xC2 && c <= 0xDF && more (j + 1) then go (j + 2)
      else if c land 0xF0 = 0xE0 && more (j + 1) && more (j + 2)
              && (c <> 0xE0 || at (j + 1) >= 0xA0) && (c <> 0xED || at (j + 1) < 0xA0) then go (j + 3)
      else if c >= 0xF0 && c <= 0xF4 && more (j + 1) && more (j + 2) && more (j + 3)
              && (c <> 0xF0 || at (j + 1) >= 0x90) && (c <> 0xF4 || at (j + 1) < 0x90) then go (j + 4)
      else bad "the text is not UTF-8 at byte %d" j in
  go 0

let parse (s : string) : t =
  let n = String.length s and i = ref 0 in
  if n > max_bytes then bad "the file is too large";
  let values = ref 0 in
  String.iter (function ',' | '[' | '{' -> incr values | _ -> ()) s;
  if !values > max_values then bad "the file has too many numbers and lists";
  utf8 s;
  let fail m = bad "not strict JSON: %s at byte %d" m !i in
  let peek () = if !i < n then s.[!i] else '\000' in
  let rec blank () = match peek () with ' ' | '\n' | '\t' | '\r' -> incr i; blank () | _ -> () in
  let word w v =
    let l = String.length w in
    if !i + l <= n && String.sub s !i l = w then (i := !i + l; v) else fail "an unknown word" in
  let hex4 () =
    if !i + 4 > n then fail "an unfinished escape";
    let v = ref 0 in
    for j = !i to !i + 3 do
      let d = match s.[j] with
        | '0' .. '9' as c -> Char.code c - 48
        | 'a' .. 'f' as c -> Char.code c - 87
        | 'A' .. 'F' as c -> Char.code c - 55
        | _ -> fail "an escape that is not four digits" in
      v := (16 * !v) + d
    done;
    i := !i + 4;
    !v in
  let put b c =
    (* UTF-8; a lone surrogate becomes three bytes that no valid text has, so it equals no known key *)
    let add x = Buffer.add_char b (Char.chr x) in
    if c < 0x80 then add c
    else if c < 0x800 then (add (0xC0 lor (c lsr 6)); add (0x80 lor (c land 63)))
    else if c < 0x10000 then (add (0xE0 lor (c lsr 12)); add (0x80 lor ((c lsr 6) land 63)); add (0x80 lor (c land 63)))
    else (add (0xF0 lor (c lsr 18)); add (0x80 lor ((c lsr 12) land 63)); add (0x80 lor ((c lsr 6) land 63));
          add (0x80 lor (c land 63))) in
  let escape b =
    let c = peek () in
    incr i;
    match c with
    | '"' | '\\' | '/' -> Buffer.add_char b c
    | 'b' -> Buffer.add_char b '\b' | 'f' -> Buffer.add_char b '\012' | 'n' -> Buffer.add_char b '\n'
    | 'r' -> Buffer.add_char b '\r' | 't' -> Buffer.add_char b '\t'
    | 'u' ->
      let high = hex4 () in
      if high >= 0xD800 && high < 0xDC00 && !i + 6 <= n && s.[!i] = '\\' && s.[!i + 1] = 'u' then begin
        let back = !i in
        i := !i + 2;
        let low = hex4 () in
        if low >= 0xDC00 && low < 0xE000 then put b (0x10000 + ((high - 0xD800) lsl 10) + (low - 0xDC00))
        else (i := back; put b high)
      end else put b high
    | _ -> fail "an unknown escape" in
  let str () =
    incr i;
    let b = Buffer.create 32 in
    let rec go () =
      if !i >= n then fail "an unfinished text";
      match s.[!i] with
      | '"' -> incr i
      | '\\' -> incr i; escape b; go ()
      | c when Char.code c < 32 -> fail "a control character in a text"
      | c -> Buffer.add_char b c; incr i; go () in
    go ();
    Buffer.contents b in
  let digits () = while (match peek () with '0' .. '9' -> true | _ -> false) do incr i done in
  let whole () =
    let start = !i in
    if peek () = '-' then incr i;
    let first = !i in
    digits ();
    if !i = first then fail "a value is missing";
    if s.[first] = '0' && !i > first + 1 then fail "a number that begins with 0";
    (match peek () with '.' | 'e' | 'E' -> fail "a number that is not whole" | _ -> ());
    if !i - first > max_digits then fail "a number that is too long";
    let text = String.sub s start (!i - start) in
    Int (if text = "-0" then "0" else text) in
  let rec value depth =
    if depth > max_depth then fail "too deep a nesting";
    blank ();
    match peek () with
    | '{' -> incr i; blank (); if peek () = '}' then (incr i; Obj []) else members depth [] (Hashtbl.create 8)
    | '[' -> incr i; blank (); if peek () = ']' then (incr i; Arr []) else elements depth []
    | '"' -> Str (str ())
    | 't' -> word "true" (Bool true)
    | 'f' -> word "false" (Bool false)
    | 'n' -> word "null" Null
    | _ -> whole ()
  and members depth acc seen =
    blank ();
    if peek () <> '"' then fail "a key is missing";
    let key = str () in
    if Hashtbl.mem seen key then fail "a key that appears twice";
    Hashtbl.add seen key ();
    blank ();
    if peek () <> ':' then fail "a colon is missing";
    incr i;
    let v = value (depth + 1) in
    blank ();
    match peek () with
    | ',' -> incr i; members depth ((key, v) :: acc) seen
    | '}' -> incr i; Obj (List.rev ((key, v) :: acc))
    | _ -> fail "a comma is missing"
  and elements depth acc =
    let v = value (depth + 1) in
    blank ();
    match peek () with
    | ',' -> incr i; elements depth (v :: acc)
    | ']' -> incr i; Arr (List.rev (v :: acc))
    | _ -> fail "a comma is missing" in
  let v = value 0 in
  blank ();
  if !i <> n then fail "something follows the value";
  v

(* The number of each letter of a text. *)
let each_letter f s =
  let i = ref 0 in
  let more j = Char.code s.[!i + j] land 63 in
  while !i < String.length s do
    let c = Char.code s.[!i] in
    let length, code =
      if c >= 0xF0 then (4, ((c land 7) lsl 18) lor (more 1 lsl 12) lor (more 2 lsl 6) lor more 3)
      else if c >= 0xE0 then (3, ((c land 15) lsl 12) lor (more 1 lsl 6) lor more 2)
      else if c >= 0xC0 then (2, ((c land 31) lsl 6) lor more 1)
      else (1, c) in
    i := !i + length;
    f code
  done

(* The text whose hash an answer quotes: sorted keys, no blanks, letters beyond ASCII as \uxxxx; of a law with a blank
   after each comma and colon. *)
let canonical ?(blank = "") v =
  let b = Buffer.create 65536 in
  let unit16 x = Buffer.add_string b (Printf.sprintf "\\u%04x" x) in
  let letter x = match Char.unsafe_chr (x land 255) with
    | ('"' | '\\') as c when x < 128 -> Buffer.add_char b '\\'; Buffer.add_char b c
    | ' ' .. '~' as c when x < 128 -> Buffer.add_char b c
    | '\n' when x < 128 -> Buffer.add_string b "\\n"
    | '\r' when x < 128 -> Buffer.add_string b "\\r"
    | '\t' when x < 128 -> Buffer.add_string b "\\t"
    | '\b' when x < 128 -> Buffer.add_string b "\\b"
    | '\012' when x < 128 -> Buffer.add_string b "\\f"
    | _ when x < 0x10000 -> unit16 x
    | _ -> let x = x - 0x10000 in unit16 (0xD800 lor (x lsr 10)); unit16 (0xDC00 lor (x land 0x3FF)) in
  let quote s = Buffer.add_char b '"'; each_letter letter s; Buffer.add_char b '"' in
  let add c = Buffer.add_char b c; Buffer.add_string b blank in
  let separated put = List.iteri (fun i x -> if i > 0 then add ','; put x) in
  let rec go = function
    | Null -> Buffer.add_string b "null"
    | Bool v -> Buffer.add_string b (if v then "true" else "false")
    | Int s -> Buffer.add_string b s
    | Str s -> quote s
    | Arr l -> Buffer.add_char b '['; separated go l; Buffer.add_char b ']'
    | Obj l ->
      Buffer.add_char b '{';
      separated (fun (k, v) -> quote k; add ':'; go v)
        (List.sort (fun (a, _) (c, _) -> compare a c) l);
      Buffer.add_char b '}' in
  go v;
  Buffer.contents b

(* Characters of the shortest spelling in ASCII: white space and ways of writing weigh nothing. *)
let rec characters v =
  let text s =
    let n = ref 2 in
    String.iter (fun c ->
        n := !n + match c with
          | '"' | '\\' | '\n' | '\r' | '\t' | '\b' | '\012' -> 2
          | ' ' .. '~' -> 1
          | '\x80' .. '\xBF' -> 0 (* inside of a letter of several bytes *)
          | '\xF0' .. '\xFF' -> 12
          | _ -> 6) s;
    !n in
  let listed one l = max 2 (List.fold_left (fun n x -> n + 1 + one x) 1 l) in
  match v with
  | Null | Bool true -> 4
  | Bool false -> 5
  | Int s -> String.length s
  | Str s -> text s
  | Arr l -> listed characters l
  | Obj l -> listed (fun (k, v) -> text k + 1 + characters v) l
