(* What the extracted checker reads of an answer or an episode, or an exception.  Not proved: claims and their premises.
   What is not known is refused; limits are those of docs/certificates.md. *)
module Big = Z (* zarith's, before Check's own Z hides it *)
open Check
open Json

let list f = function Arr l -> List.map f l | _ -> bad "a list was expected"

let sized n f v =
  let l = list f v in
  if List.length l <> n then bad "a list of %d entries was expected, got %d" n (List.length l);
  l

let whole least most = function
  | Int s ->
    let v = if String.length s > 9 then bad "a whole number is too large" else int_of_string s in
    if v < least || v > most then bad "the whole number %d is not in %d..%d" v least most;
    v
  | _ -> bad "a whole number was expected"

(* The fields of an object: all of `names`, none but those and the optional ones. *)
let fields ?(optional = []) names = function
  | Obj l ->
    List.iter (fun (k, _) -> if not (List.mem k names || List.mem k optional) then bad "an unknown field: %S" k) l;
    List.iter (fun k -> if not (List.mem_assoc k l) then bad "a field is missing: %s" k) names;
    fun k -> List.assoc k l
  | _ -> bad "an object was expected"

let field k = function Obj l -> List.assoc_opt k l | _ -> None

let cut c s =
  match String.index_opt s c with
  | Some j -> Some (String.sub s 0 j, String.sub s (j + 1) (String.length s - j - 1))
  | None -> None

let is_digit c = c >= '0' && c <= '9'

(* ---- What Check reads ---- *)
let read found = match found with Check.Fine x -> x | Check.Faulty why -> bad "%s" why
let number v = read (Check.number v)
let fraction n d = read (Check.fraction n d)
let vec = list number
let answer v = read (Check.answer_of v)
let episode v = read (Check.episode_of v)

let same_number x y = Big.equal x.qnum y.qnum && Big.equal x.qden y.qden
let less x y = Big.sign (Big.sub (Big.mul y.qnum x.qden) (Big.mul x.qnum y.qden)) > 0
let zero = { qnum = Big.zero; qden = Big.one }

(* ---- The claim ---- *)

(* As Python's unicode_escape spells a text: printable, and on one line. *)
let escaped s =
  let b = Buffer.create (String.length s) in
  let letter x =
    Buffer.add_string b
      (match x with
       | 92 -> "\\\\" | 10 -> "\\n" | 13 -> "\\r" | 9 -> "\\t"
       | x when x >= 32 && x < 127 -> String.make 1 (Char.chr x)
       | x when x < 0x100 -> Printf.sprintf "\\x%02x" x
       | x when x < 0x10000 -> Printf.sprintf "\\u%04x" x
       | x -> Printf.sprintf "\\U%08x" x) in
  each_letter letter s;
  Buffer.contents b

(* As much of a text as is printed. *)
let longest_quote = 500
let quoted s =
  let n = String.length s in
  if n <= longest_quote then s else Printf.sprintf "%s... (%d characters)" (String.sub s 0 longest_quote) n

(* Tests of nested sets, each as a claim of one block: the text of its scale, runs, failed ones; all tests; the scene; how
   many corridors, drawn from where, with their hash. *)
type tests = { steps : (string * int * int * Check.claim) list; tests : int; scene : Json.t option;
               corridors : int; within : Json.t; set : Json.t option }
type claimed = Assumed of string | Unchecked of string | Numbers of Check.claim | Tests of tests

let most_runs = 999_999_999
let most_discards = 1 lsl 20
let numbers_of_claim = [ "n"; "discard"; "looks"; "eps"; "delta"; "bin_eps"; "evidence" ]

let block o =
  let get k = match o with Obj l when List.mem_assoc k l -> List.assoc k l | _ -> bad "a block lacks %s" k in
  let n = whole 1 most_runs (get "n") in
  { runs = Big.of_int n; discards = whole 0 n (get "discard"); bound = number (get "eps") }

(* A field inside of fields, where there is one. *)
let at names o =
  let one part name = match part with
    | None | Some Null -> None
    | Some (Obj l) -> List.assoc_opt name l
    | Some _ -> bad "a part of the claim is not an object" in
  match List.fold_left one (Some o) names with Some Null -> None | found -> found
let listed names o = match at names o with None -> [] | Some l -> list (fun x -> x) l

(* The independent units that a claim counts. *)
let recorded o = at [ "evidence"; "rows" ] o <> None || at [ "evidence"; "tested" ] o <> None
let unit_of o = if recorded o then "recordings" else "runs"
let hash_of v = Str (Sha256.hex (canonical v))

(* Of a set that was tested in its scene [T42]. *)
let tested get =
  let evidence = get "evidence" in
  if get "bin_eps" <> Null then bad "a tested set has no bins";
  ignore (whole 1 1 (get "looks"));
  let eps = number (get "eps") and delta = number (get "delta") in
  let step v = match v with
    | Arr [ scale; n; failed ] ->
      if not (less zero (number scale)) then bad "the scale of a test is not positive";
      let n = whole 1 most_runs n in
      let failed = whole 0 n failed in
      let block = { runs = Big.of_int n; discards = failed; bound = eps } in
      ((match scale with Str s -> s | _ -> bad "a scale is not a text"), n, failed,
       { blocks = [ block ]; looks = Big.one; eps; delta; in_bins = [] })
    | _ -> bad "a list of 3 entries was expected" in
  let steps = List.map step (listed [ "steps" ] evidence) in
  let rec nested = function
    | (s, n, x, _) :: ((s', n', x', _) :: _ as rest) ->
      if not (less (number (Str s')) (number (Str s))) then bad "the scales of tests do not fall";
      if n > n' || x > x' then bad "the sets that were tested are not nested";
      nested rest
    | last :: [] -> last
    | [] -> bad "no set was tested" in
  let scale, n, failed, _ = nested steps in
  let tests = match at [ "tests" ] evidence with Some v -> whole n most_runs v | None -> bad "a whole number was expected" in
  if at [ "scale" ] evidence <> Some (Str scale) || whole 0 most_runs (get "n") <> n || whole 0 most_runs (get "discard") <> failed
  then bad "the claim's numbers are not those of its last test";
  if List.fold_left (fun sum (_, _, x, _) -> sum + x) 0 steps > most_discards then bad "more runs failed than are counted";
  let corridors = match at [ "corridors" ] evidence with Some v -> whole 1 most_runs v | None -> bad "a whole number was expected" in
  (match at [ "tested" ] evidence with
   | Some (Arr ids as v) when List.length ids = tests && at [ "recordings" ] evidence = Some (hash_of v) -> ()
   | None -> ()
   | _ -> bad "other recordings were tested than the claim names");
  Tests { steps; tests; scene = at [ "scene" ] evidence; corridors;
          within = Option.value (at [ "within" ] evidence) ~default:Null; set = at [ "set" ] evidence }

(* Of a tube with so many bins. *)
let claim n_bins o =
  let l = match o with Obj l -> l | _ -> bad "the claim is not an object" in
  let get k = List.assoc k l in
  match List.assoc_opt "kind" l with
  | Some (Str "pac") -> (
    match List.filter (fun k -> not (List.mem_assoc k l)) numbers_of_claim with
    | _ :: _ as missing -> Unchecked ("it lacks " ^ String.concat ", " missing)
    | [] ->
      let evidence = match get "evidence" with Obj e -> e | _ -> bad "the evidence is not an object" in
      let n = whole 1 most_runs (get "n") in
      let numbers blocks in_bins =
        if List.fold_left (fun sum b -> sum + b.discards) 0 blocks > most_discards then
          bad "the claim leaves out more runs than are counted";
        if List.exists (fun b -> not (Big.leq b.runs (Big.of_int n))) blocks then bad "a block has more runs than the claim";
        if whole 0 n (get "discard") <> List.fold_left (fun m b -> max m b.discards) 0 blocks then
          bad "the claim's discards are not those of its blocks";
        Numbers { blocks; looks = Big.of_int (whole 1 most_discards (get "looks"));
                  eps = number (get "eps"); delta = number (get "delta"); in_bins } in
      let failed = match List.assoc_opt "failed" evidence with None | Some Null -> 0 | Some failed -> whole 0 n failed in
      match (get "bin_eps", List.assoc_opt "blocks" evidence) with
      | Null, _ when failed > whole 0 n (get "discard") ->
        Unchecked "more runs failed than are left outside"
      | Null, _ -> numbers [ block o ] []
      | _, (None | Some Null) -> Unchecked "it is about bins, and lacks the runs of each block"
      | by_bin, Some blocks ->
        let strict b = ignore (fields [ "n"; "discard"; "eps" ] b); block b in
        numbers (list strict blocks) (sized n_bins (function Null -> None | x -> Some (number x)) by_bin))
  | Some (Str "validated") -> (
    match List.filter (fun k -> not (List.mem_assoc k l)) numbers_of_claim with
    | _ :: _ as missing -> Unchecked ("it lacks " ^ String.concat ", " missing)
    | [] -> tested get)
  | Some (Str kind) -> Assumed ("kind " ^ quoted (escaped kind))
  | _ -> Assumed "kind unknown"

(* ---- Its premises, all from its own fields: those marked checked are what its numbers are ---- *)
let most_premises = 500

let text_in = function Str s -> s | _ -> bad "a premise of the claim is not a text"

let fraction_text x = Big.to_string x.qnum ^ if Big.equal x.qden Big.one then "" else "/" ^ Big.to_string x.qden

(* To twelve decimals; a fraction where these are all zeros. *)
let decimal x =
  let places = Big.pow (Big.of_int 10) 12 and twice = Big.mul (Big.of_int 2) x.qden in
  let units = Big.fdiv (Big.add (Big.mul (Big.abs x.qnum) (Big.mul (Big.of_int 2) places)) x.qden) twice in
  if Big.sign units = 0 && Big.sign x.qnum <> 0 then fraction_text x
  else begin
    let rest = Big.to_string (Big.rem units places) in
    let digits = String.make (12 - String.length rest) '0' ^ rest in
    let n = ref 12 in
    while !n > 0 && digits.[!n - 1] = '0' do decr n done;
    (if Big.sign x.qnum < 0 then "-" else "") ^ Big.to_string (Big.fdiv units places)
    ^ (if !n > 0 then "." else "") ^ String.sub digits 0 !n
  end

(* The box of k that the claim is about: lower and upper end of each axis. *)
let domain_of o = match at [ "subject"; "domain" ] o with
  | None -> None
  | Some d ->
    let get = fields [ "lo"; "hi" ] d in
    let lo = vec (get "lo") and hi = vec (get "hi") in
    if lo = [] || List.length lo <> List.length hi then bad "the claim's domain is no box";
    Some (List.combine lo hi)

let shown units (c : Check.claim) =
  let least = List.fold_left (fun n b -> if Big.leq n b.runs then n else b.runs) (Big.of_int most_runs) c.blocks in
  let most = List.fold_left (fun m b -> max m b.discards) 0 c.blocks in
  let runs = Printf.sprintf "%s %s" (Big.to_string least) units in
  let numbers each more =
    [ ("eps", fraction_text c.eps); ("delta", fraction_text c.delta); ("n", runs ^ each);
      ("discards", string_of_int most); ("looks", Big.to_string c.looks) ] @ more in
  match (c.in_bins, List.length c.in_bins) with
  | [], _ -> numbers "" []
  | bins, n ->
    let claimed = List.length (List.filter (fun x -> x <> None) bins) in
    numbers " or more in each" [ ("bins", Printf.sprintf "%d of %d with a claim" claimed n) ]

let set_words t =
  let hash = match t.set with Some (Str s) when String.length s > 8 -> String.sub s 0 8 | _ -> bad "a set has no hash" in
  Printf.sprintf "%d corridor%s; %s%s" t.corridors (if t.corridors = 1 then "" else "s") hash
    (if t.within = Null then "" else " around a search")

(* Checked ones, and the file's word. *)
let of_tests units t =
  let told (scale, n, failed, _) = Printf.sprintf "%s (%d of %d)" scale failed n in
  let _, n, failed, (c : Check.claim) = List.nth t.steps (List.length t.steps - 1) in
  [ ("risk", fraction_text c.eps); ("delta", fraction_text c.delta); ("n", Printf.sprintf "%d %s" n units);
    ("failed of them", string_of_int failed); ("set", set_words t) ],
  [ ("tests", string_of_int t.tests); ("scales", String.concat ", " (List.map told t.steps)) ]

(* ---- The law of the runs: where it is stated whole, it is about K, has its hash, and is in the claim's words ---- *)
let law_fields = [ "generator"; "parameters"; "k_law"; "lo"; "hi" ]
let of_part = ", of which K is a part"
let ours = "parc_jax:"
let box_name = ours ^ "box of k"

let begins_with p s = String.length s >= String.length p && String.sub s 0 (String.length p) = p
let without p s = if begins_with p s then let n = String.length p in String.sub s n (String.length s - n) else s
let ends_with p s =
  let n = String.length s - String.length p in
  n >= 0 && String.sub s n (String.length p) = p

let described pairs get hash =
  let how = match text_in (get "k_law") with
    | "uniform" -> "uniform on " ^ List.fold_left (fun name (a, b) -> if a = box_name then b else name) "K" pairs
    | how -> (if how = "logged" || begins_with "given " how then "as " else "by ") ^ how in
  let more (a, b) = if a = box_name then "" else Printf.sprintf ", %s = %s" (without ours a) b in
  Printf.sprintf "%s (k %s%s; %s)" (text_in (get "generator")) how (String.concat "" (List.map more pairs)) (String.sub hash 0 8)

let of_a_recording = "a plan whose k is that of a new recording for which this set has a start, one of 400 that are drawn \
  so as to end in the goal, and whose p0 is the first such start"

(* The same of a set whose plans have one start. *)
let from_one = Printf.sprintf "a plan from (%s) m in the scene's frame whose k is that of a new recording for \
  which this set has such a plan"

(* The words that a claim may have for its law. *)
let words o pairs said =
  if field "kind" o = Some (Str "validated") then
    let start = List.map (fun x -> decimal (number x)) (listed [ "evidence"; "at" ] o) in
    let of_one = if start = [] then of_a_recording else from_one (String.concat ", " start) in
    [ (if recorded o then of_one ^ ", run" else "a plan drawn uniformly from this set, run afresh")
      ^ " in this scene by " ^ said ]
  else if at [ "bin_eps" ] o <> None then
    let about (several, one) =
      Printf.sprintf "in each claimed %s of K, a new rollout drawn from %s with k in that %s" several said one in
    List.map about [ ("bin", "bin"); ("block of bins", "block") ]
  else
    [ Printf.sprintf "%s%s drawn from %s"
        (if recorded o then "any run of a new recording" else "a new rollout")
        (if List.mem_assoc (ours ^ "K") pairs then " whose k lies in K," else "") said ]

let whole_law o = match at [ "law"; "hash" ] o with
  | None -> false
  | Some hash ->
    let get = fields ("hash" :: law_fields) (Option.get (at [ "law" ] o)) in
    let known = Sha256.hex (canonical ~blank:" " (Obj (List.map (fun name -> (name, get name)) law_fields))) in
    if hash <> Str known then bad "the law of the claim has another hash";
    let pairs = list (function Arr [ a; b ] -> (text_in a, text_in b) | _ -> bad "a parameter is a name and a value") (get "parameters") in
    let lo = vec (get "lo") and hi = vec (get "hi") in
    let same a b = not (less a b || less b a) in
    (match domain_of o with
     | Some k when not (ends_with of_part (text_in (get "k_law"))) ->
       let about l side = List.length l = List.length k && List.for_all2 (fun x box -> same x (side box)) l k in
       if not (about lo fst && about hi snd) then bad "the law of the claim is about another K"
     | Some k when List.length lo = List.length k ->
       if List.length hi <> List.length k then bad "the law of the claim has no box";
       let inside (a, b) (c, d) = not (less c a || less d c || less b d) in
       if not (List.for_all2 inside (List.combine lo hi) k) then bad "K is no part of that of the law"
     | _ -> ());
    (match field "kind" o with
     | Some (Str ("pac" | "validated")) ->
       let said = match field "quantifier" o with Some v -> text_in v | None -> bad "a claim has no words" in
       if not (List.mem said (words o pairs (described pairs get known))) then
         bad "the claim's words are about another law than its own"
     | _ -> ());
    true

(* ---- Assumptions with numbers, which are those of the claim's fields ---- *)
type known = Count of q | Rounded of q (* for people, to a hundred-thousandth *)

let told_in text =
  let found = ref [] and part = Buffer.create 16 in
  let close () =
    let s = Buffer.contents part in
    Buffer.clear part;
    if s <> "" && is_digit s.[0] then found := number (Str (String.concat "" (String.split_on_char ',' s))) :: !found in
  String.iter (fun c -> if is_digit c || String.contains ".,e+-" c then Buffer.add_char part c else close ()) text;
  close ();
  List.rev !found

let ratio n d = { qnum = Big.of_int n; qden = Big.of_int d }
let times x y = fraction (Big.mul x.qnum y.qnum) (Big.mul x.qden y.qden)
let over x y = if Big.sign y.qnum <= 0 then bad "a time step is not positive" else times x { qnum = y.qden; qden = y.qnum }

let says told known = match known with
  | Count x -> same_number told x
  | Rounded x ->
    let off = Big.abs (Big.sub (Big.mul told.qnum x.qden) (Big.mul x.qnum told.qden)) in
    Big.leq (Big.mul off (Big.of_int 100_000)) (Big.abs (Big.mul x.qnum told.qden))

let has_its_numbers o name said =
  let told = lazy (told_in said) in
  let count = function Some (Int s) -> [ Count (number (Str s)) ] | _ -> [] in
  let evidence names = at ("evidence" :: names) o in
  let tried effect =
    let field name = match evidence [ "start"; name ] with None -> [] | Some x -> [ Rounded (number x) ] in
    match field "gap" @ field effect with
    | _ :: _ :: _ as both -> both @ [ Count (ratio 8 1) ]
    | found -> found in
  let times_of () = match List.map number (listed [ "subject"; "time" ] o) with _ :: _ :: l -> l | _ -> [] in
  let rounded = List.map (fun x -> Rounded x) in
  let between () = match times_of () with
    | [] -> []
    | h :: _ as l ->
      let slow = begins_with "speed" said in
      let by = if slow then over (ratio 2 1) h else over (over (ratio 8 1) h) h in
      let axes = List.length (Lazy.force told) - (if slow then 1 else 2) in
      let bounds = List.filteri (fun i _ -> i < axes) (List.map number (listed [ "intersample" ] o)) in
      rounded (List.map (times by) bounds) @ (if slow then [] else [ Count (ratio 2 1) ]) @ rounded l in
  let known = match name with
    | "UNSEEN" -> Some (count (field "looks" o))
    | "WORKERS_LOST" -> Some (count (evidence [ "lost" ]))
    | "LEFT_OUT" -> Some (count (evidence [ "left_out" ]))
    | "TRANSLATION_INVARIANCE" -> Some (tried "seen")
    | "ROTATION_INVARIANCE" -> Some (tried "turned")
    | "DISCRETE_TIME" -> Some (rounded (times_of ()))
    | "INTERSAMPLE" -> Some (between ())
    | _ -> None in
  match known with
  | None -> true
  | Some known -> let told = Lazy.force told in List.length known = List.length told && List.for_all2 says told known

(* Fields that say so much of runs that an assumption stands beside them, and what any claim about runs rests on. *)
let implies =
  [ ([ "evidence"; "lost" ], "WORKERS_LOST"); ([ "evidence"; "left_out" ], "LEFT_OUT");
    ([ "subject"; "given" ], "HIDDEN_START"); ([ "subject"; "rotation" ], "ROTATION_INVARIANCE") ]
let always =
  [ [ "IID" ]; [ "TRANSLATION_INVARIANCE" ]; [ "DISCRETE_TIME"; "INTERSAMPLE" ];
    [ "DEPLOYMENT_LAW = CALIBRATION_LAW" ]; [ "UNCHANGED_SYSTEM" ]; [ "UNSEEN" ] ]
let not_stated = "not stated)"

(* The assumptions as stated, and those that are missing. *)
let ledger o =
  let stated = listed [ "assumptions" ] o in
  let about_runs = match field "kind" o with Some (Str ("pac" | "validated")) -> true | _ -> false in
  let name x = let x = text_in x in match cut '(' x with Some (name, _) -> name | None -> x in
  let names = List.map name stated in
  let implied (path, name) = match at path o with
    | None | Some (Arr []) -> ()
    | Some (Int s) when Big.sign (number (Str s)).qnum = 0 -> ()
    | Some _ -> if not (List.mem name names) then bad "a field of the claim comes without the assumption %s" name in
  if about_runs then List.iter implied implies;
  let missing some = not (List.exists (fun x -> List.mem x names) some) in
  let added = if about_runs then List.filter missing always else [] in
  match stated @ List.map (fun some -> Str (List.hd some ^ "(" ^ not_stated)) added with
  | [] -> [ Str ("assumptions(" ^ not_stated) ]
  | all -> all

(* Poses with a heading are of a model whose claim, where it says, lets it turn. *)
let turns claim = match at [ "subject" ] claim with
  | Some (Obj l) -> List.assoc_opt "rotation" l <> Some Null
  | _ -> true

(* As lines, of a claim of which so much is known. *)
let premises known o =
  let line standing (name, value) =
    let value = quoted (escaped value) in
    Printf.sprintf "  %-8s %s%s%s" standing (quoted (escaped name)) (if value = "" then "" else ": ") value in
  let checked, counted = match known with
    | Numbers c -> (shown (unit_of o) c, [])
    | Tests t -> of_tests (unit_of o) t
    | _ -> ([], []) in
  let pac = field "kind" o = Some (Str "pac") and whole_law = whole_law o in
  let evidence names = at ("evidence" :: names) o in
  let count = Option.map (fun x -> string_of_int (whole 0 most_runs x)) and words = Option.map text_in in
  let side (a, b) = Printf.sprintf "[%s, %s]" (decimal a) (decimal b) in
  let law = function "uniform" -> "uniform on K" | "logged" -> "as in the log" | "given" -> "as it was given" 
    | x -> (if String.length x > 5 && String.sub x 0 6 = "given " then "as " else "by ") ^ x in
  let needed =
    [ ("law", words (at [ "quantifier" ] o));
      ("K", Option.map (fun k -> String.concat " x " (List.map side k)) (domain_of o));
      ("k", Option.map law (words (at [ "law"; "k_law" ] o)));
      ("failed", count (evidence [ "failed" ])) ] in
  let more =
    [ ("all", match at [ "bin_eps" ] o with None -> None | Some _ -> count (at [ "n" ] o));
      ("rows", count (evidence [ "rows" ])); ("recordings", words (evidence [ "recordings" ]));
      ("left out", count (evidence [ "left_out" ]));
      ("eps asked", words (evidence [ "eps_asked" ]));
      ("not drawn", match List.map text_in (listed [ "evidence"; "not_drawn" ] o) with
         | [] -> None | names -> match String.concat ", " names with "" -> None | all -> Some all) ] in
  let stated needed (name, value) = match value with
    | Some value ->
      let measured = match name with "law" -> whole_law && pac | "k" -> whole_law | _ -> true in
      [ line (if measured then "measured" else "assumed") (name, value) ]
    | None -> if needed && (pac || name <> "failed") then [ line "assumed" (name, "not stated") ] else [] in
  let assumptions = listed [ "assumptions" ] o in
  if List.length assumptions > most_premises then bad "the claim has too many assumptions";
  let assumed entry =
    let entry = text_in entry in
    let name, said = Option.value (cut '(' entry) ~default:(entry, "") in
    if said <> not_stated && not (has_its_numbers o name said) then bad "the numbers of an assumption are not the claim's";
    match cut '(' entry with
    | None -> line "assumed" (entry, "")
    | Some (name, rest) ->
      let n = String.length rest in
      line "assumed" (name, if n > 0 && rest.[n - 1] = ')' then String.sub rest 0 (n - 1) else rest) in
  List.map (line "checked") checked @ List.map (line "measured") counted
  @ List.concat_map (stated true) needed @ List.concat_map (stated false) more
  @ List.map assumed (ledger o)
