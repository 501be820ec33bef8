(* What is done with values of JSON beside reading them, which Check.parse does.  Not proved. *)
type t = Check.json = Null | Bool of bool | Int of string | Str of string | Arr of t list | Obj of (string * t) list

exception Bad of string

let bad fmt = Printf.ksprintf (fun m -> raise (Bad m)) fmt

(* The value that a text spells; where it spells none, why, and at which byte. *)
let parse s =
  match Check.parse s with
  | Check.Read (v, _) -> v
  | Check.Wrong (why, left) -> bad "not strict JSON: %s at byte %d" why (String.length s - left)

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
