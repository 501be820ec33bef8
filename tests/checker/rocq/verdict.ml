(* A whole answer: reads it, asks the proved checker about every entry, and says what was proved.  Not proved. *)
open Check
open Json

(* 0 all that the answer claims is proved, 1 rejected. *)
type t = { code : int; lines : string list; entries : (string * bool list) list }

let kinds = [ "samples"; "sets"; "corridors"; "doubt" ]
let optional = [ "corridors"; "doubt" ]
let hashed = [ "problem"; "network"; "tube" ]

(* What is known about absence: nothing was claimed, or exact volumes (safe, unsafe, all). *)
type absence = Unclaimed | Volumes of Reader.kind * ((q * q) * q)

(* A share in per cent, rounded down. *)
let per_cent part whole =
  let times = Reader.Big.mul in
  let n = times (times part.qnum whole.qden) (Reader.Big.of_int 100_000) and d = times part.qden whole.qnum in
  let m = Reader.Big.to_int (Reader.Big.fdiv n d) in
  Printf.sprintf "%d.%03d %%" (m / 1000) (m mod 1000)

let text what = function Str s -> s | _ -> bad "%s is not a text" what

(* An entry that cannot be read is refused like one that fails. *)
let accepted check x =
  match check x with v -> v | exception (Bad _ | Failure _ | Invalid_argument _ | Not_found | Stack_overflow) -> false

(* Work that an answer may ask for, by the characters of its proofs: what the engine writes needs a tenth of it or less.
   What is not checked buys none. *)
let work_at_least = 200_000_000.
let work_per_character = 1000.
let max_remark = 1 lsl 20

let allow answer =
  let weight = function
    | ("meta" | "claim") as part, v -> if characters v > max_remark then bad "the part %s is too long" part else 0
    | _, v -> characters v in
  let parts = match answer with Obj l -> l | _ -> bad "the file is not an object" in
  let n = List.fold_left (fun n part -> n + weight part) 0 parts in
  Work.allow (work_at_least +. (work_per_character *. float_of_int n))

(* What tells an entry from others that prove as much. *)
let key kind x =
  let rec at path x = match (path, x) with k :: path, Obj l -> at path (List.assoc k l) | _ -> x in
  let numbers path =
    let spelled q = Reader.Big.(to_string q.qnum ^ "/" ^ to_string q.qden) in
    String.concat " " (List.map spelled (Reader.vec (at path x))) in
  match kind with
  | "sets" -> canonical (Arr [ at [ "bin" ] x; at [ "pattern" ] x; at [ "sep" ] x ])
  | "corridors" -> canonical (at [ "sep" ] x)
  | "doubt" -> String.concat "; " (List.map numbers [ [ "p0" ]; [ "k" ]; [ "room"; "p0" ]; [ "room"; "k" ] ])
  | _ -> String.concat "; " (List.map numbers [ [ "p0" ]; [ "k" ] ])

let different kind l = List.length (List.sort_uniq compare (List.rev_map (key kind) l))

let check_answer ?(progress = fun _ _ _ -> ()) (source : string) : t =
  match
    let answer = parse source in
    allow answer;
    let get k = match answer with
      | Obj l -> (match List.assoc_opt k l with Some v -> v | None -> bad "a field is missing: %s" k)
      | _ -> bad "the file is not an object" in
    if get "format" <> Str "parc_jax.answer/2" then bad "the format is unknown";
    let quoted = Reader.fields hashed (get "hash") in
    List.iter (fun part ->
        if text "a hash" (quoted part) <> Sha256.hex (canonical (get part)) then bad "the hash of the %s does not match" part)
      hashed;
    let claim = match get "claim" with
      | Null -> None
      | Obj l as claim ->
        List.iter (fun part ->
            match List.assoc_opt (part ^ "_hash") l with
            | Some h when h = quoted part -> ()
            | _ -> bad "the claim is about another %s" part)
          [ "network"; "tube" ];
        Some claim
      | _ -> bad "the claim is not an object" in
    let p = Reader.problem (get "problem") and n = Reader.network (get "network") in
    let e, h = Reader.tube p (get "tube") in
    if not (context_ok p n e) then bad "problem, network and tube do not fit each other, or a width is negative";
    let one x = check_sample p n e h (Reader.sample p x) in
    let piece x = check_set p n e h (Reader.piece p n x) in
    let box x = check_box p n e h (Reader.boxed p x) in
    let no_plan x =
      let kind, proof = Reader.no_plan p x in
      let ok = if kind = Reader.Proved then check_no_plan p n e h proof else check_proof p n e h proof in
      (ok, Volumes (kind, volumes p proof)) in
    let check = function "sets" -> piece | "doubt" -> box | _ -> one in
    ignore (Reader.fields ("format" :: "claim" :: "no_plan" :: "samples" :: "sets" :: hashed @ [ "hash" ])
              ~optional:("meta" :: optional) answer);
    let listed kind = match get kind with
      | Arr l -> l
      | exception Bad _ when List.mem kind optional -> []
      | _ -> bad "%s is not a list" kind in
    let entries = List.map (fun kind ->
        let l = listed kind in
        let total = List.length l in
        (* not List.mapi: JavaScript's stack ends at some thousand entries *)
        let _, oks = List.fold_left (fun (i, oks) x ->
            let ok = accepted (check kind) x in
            progress kind i total;
            (i + 1, ok :: oks)) (1, []) l in
        (kind, List.rev oks)) kinds in
    let last = function
      | Null -> ([], Unclaimed)
      | x ->
        let ok, found = match no_plan x with
          | v -> v
          | exception (Bad _ | Failure _ | Invalid_argument _ | Not_found) -> (false, Unclaimed) in
        progress "no_plan" 1 1;
        ([ ("no_plan", [ ok ]) ], found) in
    let absent, absence = last (get "no_plan") in
    (absence, claim, quoted, listed, entries @ absent)
  with
  | exception Bad why -> { code = 1; lines = [ "REJECTED: " ^ why ]; entries = [] }
  | exception Work.Exceeded ->
    { code = 1; lines = [ "REJECTED: it asks for more work than the size of the file allows" ]; entries = [] }
  | exception (Stack_overflow | Out_of_memory) ->
    { code = 1; lines = [ "REJECTED: the file asks for more memory than this program has; nothing was found wrong" ]; entries = [] }
  | exception (Failure _ | Invalid_argument _ | Not_found | Division_by_zero) ->
    { code = 1; lines = [ "REJECTED: the file is malformed" ]; entries = [] }
  | absence, claim, quoted, listed, entries ->
    let refused = List.concat_map (fun (kind, l) ->
        let _, found = List.fold_left (fun (i, found) ok ->
            (i + 1, if ok then found else Printf.sprintf "%s[%d]" kind i :: found)) (0, []) l in
        List.rev found) entries in
    if refused <> [] then
      { code = 1; entries; lines = [ Printf.sprintf "REJECTED: %d entries are not proved, the first is %s"
                                       (List.length refused) (List.hd refused) ] }
    else
      let kind = match claim with Some (Obj l) -> (match List.assoc_opt "kind" l with Some (Str s) -> s | _ -> "") | _ -> "" in
      let known = List.mem kind [ "pac"; "conformal"; "cover" ] in
      let lines =
        [ "ACCEPTED. Proved by a checker that is itself proved, for every trajectory inside the tube:" ]
        @ List.concat_map (fun (kind, one, many, what) ->
            match different kind (listed kind) with
            | 0 -> []
            | n -> [ Printf.sprintf "  %d %s%s" n (if n = 1 then one else many) what ])
          [ ("samples", "sample", "samples", " (p0, k): the goal is reached, no obstacle touched");
            ("sets", "polytope", "polytopes", " of (p0, k): so at every point");
            ("corridors", "corridor", "corridors", ": so does every (p0, k) of the domain that meets all conditions of one");
            ("doubt", "box", "boxes", " of doubt: so does every execution within the room of one") ]
        @ (match absence with
           | Unclaimed -> []
           | Volumes (Reader.Proved, _) ->
             [ "  no (p0, k) of the domain is safe: each may not start or fails for a continuous trajectory in the tube" ]
           | Volumes (Reader.Bracket, ((safe, unsafe), whole)) ->
             [ Printf.sprintf "  of the (p0, k) whose end lies in the goal's box by volume: safe at least %s, unsafe at least %s"
                 (per_cent safe whole) (per_cent unsafe whole) ])
        @ [ (if known then "The proof rests on the tube; the file's claim about it is not checked: kind " ^ kind
             else "The proof rests on the tube, which is ASSUMED.") ]
        @ List.map (fun part -> Printf.sprintf "  sha256 %s %s" part (text "a hash" (quoted part))) hashed in
      { code = 0; lines; entries }

(* As JSON, with a digit for every entry: for comparisons and for the page. *)
let to_json (v : t) : string =
  let quote s =
    let b = Buffer.create (String.length s + 2) in
    String.iter (function
        | '"' -> Buffer.add_string b "\\\"" | '\\' -> Buffer.add_string b "\\\\"
        | c when c < ' ' || c > '~' -> Buffer.add_string b (Printf.sprintf "\\u%04x" (Char.code c))
        | c -> Buffer.add_char b c) s;
    "\"" ^ Buffer.contents b ^ "\"" in
  let digits l = quote (String.concat "" (List.rev (List.rev_map (fun ok -> if ok then "1" else "0") l))) in
  let entries = String.concat ", " (List.map (fun (kind, l) -> quote kind ^ ": " ^ digits l) v.entries) in
  Printf.sprintf "{\"code\": %d, \"lines\": [%s], \"entries\": {%s}}" v.code
    (String.concat ", " (List.map quote v.lines)) entries
