(* A file: reads it, asks the proved checker about the answer in it, and prints what that says.  Not proved: what it
   prints of an answer is what `accepted` in Statements.v is about. *)
open Check
open Json

(* 0 all that the answer claims is proved, 1 rejected. *)
type t = { code : int; lines : string list; entries : (string * bool list) list }

let kinds = [ "samples"; "sets"; "corridors"; "doubt" ]
let optional = [ "corridors"; "doubt" ]
let hashed = [ "problem"; "network"; "tube"; "claim" ]

let text what = function Str s -> s | _ -> bad "%s is not a text" what

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

(* Tells after each entry how many of so many of its kind are done. *)
let follow progress counts =
  let rec from at counts () =
    match counts with
    | [] -> ()
    | (_, total) :: rest when at = total -> from 0 rest ()
    | (kind, total) :: _ ->
      progress kind (at + 1) total;
      Work.on_told := from (at + 1) counts in
  Work.on_told := from 0 counts

(* A share in per cent, from so many parts of 100,000. *)
let per_cent parts = let m = Reader.Big.to_int parts in Printf.sprintf "%d.%03d %%" (m / 1000) (m mod 1000)

let refused entries =
  let names (kind, marks) =
    let _, found = List.fold_left (fun (i, found) ok ->
        (i + 1, if ok then found else Printf.sprintf "%s[%d]" kind i :: found)) (0, []) marks in
    List.rev found in
  let found = List.concat_map names entries in
  Printf.sprintf "REJECTED: %d entries are not proved, the first is %s" (List.length found) (List.hd found)

let about_the_model without bins =
  if without = 0 then "The tube holds the model's own trajectory in every bin."
  else Printf.sprintf "The tube leaves out the model's own trajectory in %d of %d bins: what is proved there may be about none."
      without bins

(* What it is proved of, by the robot's own points, of which there are so many copies. *)
let longest = 2000
let body copies (p : problem) =
  let listed f l = String.concat ", " (List.map f l) in
  let part (b : part) =
    let points = List.sort_uniq compare (List.map (fun i -> i / copies) b.corners) in
    let hull = (match points with [ _ ] -> "point " | _ -> "hull of points ") ^ listed string_of_int points in
    let corner v = "(" ^ listed Reader.decimal v ^ ")" in
    match b.grown_by with
    | Disc r -> Printf.sprintf "%s grown by %s m" hull (Reader.decimal r)
    | Hull l -> Printf.sprintf "%s grown by the polygon %s m, which never turns" hull (listed corner l) in
  let all = String.concat "; " (List.map part p.parts) in
  let n = String.length all in
  if n <= longest then all else Printf.sprintf "%s... (%d characters)" (String.sub all 0 longest) n

let scene (p : problem) =
  let counted n one many = Printf.sprintf "%d %s" n (if n = 1 then one else many) in
  Printf.sprintf "It is of a body (%s) among %s, from %s." (body 1 p)
    (counted (List.length p.obstacles) "convex obstacle" "convex obstacles")
    (match List.length p.start with 0 -> "any p0" | n -> "p0 within " ^ counted n "half-space" "half-spaces")

(* What is proved, in words: all numbers are the checker's. *)
let proved (p : problem) r =
  let moving = List.length (List.filter (fun (o : obstacle) -> o.last0 - o.first + 1 < p.steps) p.obstacles) in
  let counted n one many what = if n = 0 then [] else [ Printf.sprintf "  %d %s%s" n (if n = 1 then one else many) what ] in
  [ "ACCEPTED. Proved by a checker that is itself proved, for every trajectory inside the tube:" ]
  @ counted r.n_samples "sample" "samples" " (p0, k): the goal is reached, no obstacle touched"
  @ counted r.n_sets "polytope" "polytopes" " of (p0, k): so at every point"
  @ counted r.n_corridors "corridor" "corridors" ": so does every (p0, k) of the domain that meets all conditions of one"
  @ counted r.n_doubts "box" "boxes" " of doubt: so does every execution within the room of one"
  @ (match r.found with
     | Nothing -> []
     | No_plan ->
       [ "  no (p0, k) of the domain is safe: each may not start or fails for a continuous trajectory in the tube" ]
     | Shares (safe, unsafe) ->
       [ "  of the (p0, k) whose first point ends in the file's box z, whatever else";
         Printf.sprintf "    the goal asks, by volume: safe at least %s, unsafe at least %s" (per_cent safe) (per_cent unsafe) ])
  @ [ scene p ]
  @ (if moving = 0 then []
     else
       [ Printf.sprintf "NOT PROVED: %d obstacle%s told of by intervals: nothing is" moving (if moving = 1 then "" else "s");
         "  said of them at other times" ])
  @ [ about_the_model r.n_without r.n_bins ]

(* The marks by kind; none for proofs of no plan where there is none. *)
let named marks = List.filter (fun (kind, l) -> kind <> "no_plan" || l <> []) (List.combine (kinds @ [ "no_plan" ]) marks)

(* What is known of a claim beside this network, tube, K and time step, and its premises. *)
let known_claim claim quoted n_bins domain dt =
  let claim = match claim with
    | Null -> None
    | Obj l as claim ->
      List.iter (fun part ->
          match List.assoc_opt (part ^ "_hash") l with
          | Some h when h = quoted part -> ()
          | _ -> bad "the claim is about another %s" part)
        [ "network"; "tube" ];
      Some claim
    | _ -> bad "the claim is not an object" in
  match claim with
  | None -> (Reader.Assumed "no claim", None)
  | Some o ->
    let same = Reader.same_number in
    let both (a, b) (c, d) = same a c && same b d in
    let about k = List.length k = List.length domain && List.for_all2 both k domain in
    if not (Option.fold ~none:true ~some:about (Reader.domain_of o)) then bad "the claim is about another domain";
    (match List.map Reader.number (Reader.listed [ "subject"; "time" ] o) with
     | step :: _ when not (same step dt) -> bad "the claim is about another time step"
     | _ -> ());
    (Reader.claim n_bins o, Some o)

let premises (known, claim) = (known, Option.map (Reader.premises known) claim)

(* The fields of an object, where it is one. *)
let getter = function
  | Obj l -> (fun k -> match List.assoc_opt k l with Some v -> v | None -> bad "a field is missing: %s" k)
  | _ -> bad "the file is not an object"

(* Hashes that a file quotes of its parts. *)
let compare_hashes get names part =
  let quoted = Reader.fields names (get "hash") in
  List.iter (fun name ->
      if text "a hash" (quoted name) <> Sha256.hex (canonical (part name)) then bad "the hash of the %s does not match" name)
    names;
  quoted

(* What a file says: the answer, what is known of its claim, and the hashes.  Raises Bad, or what the reader was not written for. *)
let read_answer answer =
  let get = getter answer in
  if get "format" <> Str "parc_jax.answer/3" then bad "the format is unknown";
  let quoted = compare_hashes get hashed get in
  let listed kind = match get kind with
    | Arr l -> l
    | exception Bad _ when List.mem kind optional -> []
    | _ -> bad "%s is not a list" kind in
  let asked = Reader.answer answer in
  let dt = Reader.number (getter (get "problem") "dt") in
  let known, claim = known_claim (get "claim") quoted (List.length asked.around.finals) asked.scene.domain dt in
  (match known with
   | Reader.Tests t when t.scene <> Some (quoted "problem") -> bad "the set was tested in another scene"
   | Reader.Tests t ->
     let there = listed "corridors" in
     let hash = Sha256.hex (canonical (Arr [ Arr there; t.within ])) in
     if List.length there <> t.corridors || t.set <> Some (Str hash) then
       bad "another set was tested than the corridors of this file"
   | _ -> ());
  (asked, premises (known, claim), quoted)

let of_episode = [ "network"; "tube"; "manoeuvres"; "claim"; "copies"; "doubt"; "premises" ]

(* The same of an episode.  What it adds to its premises is not read. *)
let read_episode file =
  let get = getter file in
  if get "format" <> Str "parc_jax.episode/3" then bad "the format is unknown";
  let part = function
    | "episode" -> Obj (List.map (fun name -> (name, get name)) of_episode)
    | name -> get name in
  let quoted = compare_hashes get [ "network"; "tube"; "episode" ] part in
  let asked = Reader.episode file in
  let p = (List.hd asked.done0).asked in
  let known, claim = known_claim (get "claim") quoted (List.length asked.its_tube.finals) p.domain asked.tick in
  (match known, Option.bind claim (Reader.field "kind") with
   | Reader.Tests _, _ | _, Some (Str "validated") ->
     bad "its claim is about draws from one set in one scene, and its plans were chosen"
   | _ -> ());
  if asked.turning && not (Option.fold ~none:true ~some:Reader.turns claim) then bad "its claim says that nothing turns";
  (asked, premises (known, claim), quoted, p, Reader.whole 1 p.n_points (get "copies"))

let shown = function
  | Reader.Numbers c when not (Check.check_claim c) -> bad "the claim's runs do not show its eps with its delta"
  | Reader.Tests t when not (List.for_all (fun (_, _, _, c) -> Check.check_claim c) t.steps) ->
    bad "a test does not show the claim's eps with its delta"
  | _ -> ()

let rests (known, premises) quoted names =
  (match known with
   | Reader.Assumed what ->
     let colon = if premises = None then "." else ":" in
     [ Printf.sprintf "The proof rests on the tube, which is ASSUMED (%s)%s" what colon ]
   | Reader.Unchecked why ->
     [ "The proof rests on the tube, ASSUMED: the claim's arithmetic was not checked, since"; "  " ^ why ^ ":" ]
   | Reader.Tests _ ->
     [ "Runs may leave the tube. That each test of the set shows this risk with this delta";
       "  was checked; what is not marked so is the file's word:" ]
   | Reader.Numbers _ ->
     [ "The proof rests on the tube. That so many runs show this eps with this delta was";
       "  checked; what is not marked so is the file's word:" ])
  @ Option.value premises ~default:[]
  @ List.map (fun part -> Printf.sprintf "  sha256 %s %s" part (text "a hash" (quoted part))) names

let rejected lines entries = { code = 1; lines = [ lines ]; entries }

let answered progress file =
  let asked, known, quoted = read_answer file in
  follow progress
    [ ("samples", List.length asked.samples); ("sets", List.length asked.sets);
      ("corridors", List.length asked.corridors); ("doubt", List.length asked.doubts); ("no_plan", 1) ];
  shown (fst known);
  match Check.check_answer asked with
  | Misfit -> rejected "REJECTED: problem, network and tube do not fit each other, or a width is negative" []
  | Refused marks -> let entries = named marks in rejected (refused entries) entries
  | Accepted (marks, r) -> { code = 0; lines = proved asked.scene r @ rests known quoted hashed; entries = named marks }

let driven progress file =
  let asked, known, quoted, p, copies = read_episode file in
  let n = List.length asked.done0 in
  follow progress [ ("manoeuvres", n) ];
  shown (fst known);
  match Check.check_episode asked with
  | Shapeless -> rejected "REJECTED: a manoeuvre began within half a time step of the one before it, or a number has no place" []
  | Stopped marks -> let entries = [ ("manoeuvres", marks) ] in rejected (refused entries) entries
  | Driven (n, bins, without) ->
    let frame = if asked.turning then "in the robot's own frame there" else "in the world" in
    let lines =
      [ "ACCEPTED. Proved by a checker that is itself proved, for every trajectory inside the tube:";
        Printf.sprintf "  %d manoeuvre%s of one body, each told %s from wherever its pose truly was: until" n (if n = 1 then "" else "s") frame;
        "    the next one begins, and at rest where it ends, no point of the body is in an obstacle that its";
        "    problem has then, moved by what the pose was off by";
        Printf.sprintf "The body: %s." (body copies p);
        "Headings that are off are covered where three copies of each point keep to the tube.";
        "NOT PROVED here: that each began where the one before may have been left, that each came to rest,";
        "  and the premises of the file";
        about_the_model without bins ] in
    { code = 0; lines = lines @ rests known quoted [ "network"; "tube"; "episode" ];
      entries = [ ("manoeuvres", List.init n (fun _ -> true)) ] }

let is_episode file = match Reader.field "format" file with
  | Some (Str s) -> Reader.begins_with "parc_jax.episode/" s
  | _ -> false

let check_file ?(progress = fun _ _ _ -> ()) (source : string) : t =
  match
    let file = parse source in
    allow file;
    if is_episode file then driven progress file else answered progress file
  with
  | verdict -> verdict
  | exception Bad why -> rejected ("REJECTED: " ^ why) []
  | exception Work.Exceeded -> rejected "REJECTED: it asks for more work than the size of the file allows" []
  | exception (Stack_overflow | Out_of_memory) ->
    rejected "REJECTED: the file asks for more memory than this program has; nothing was found wrong" []
  | exception (Failure _ | Invalid_argument _ | Not_found | Division_by_zero) -> rejected "REJECTED: the file is malformed" []

(* Of an answer alone, for comparisons. *)
let read source = let file = parse source in allow file; read_answer file

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
