(* From JSON to what the extracted checker takes.  Not proved: it refuses what it does not know, and its limits are
   those of docs/certificates.md. *)
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
let has k o = field k o <> None

(* ---- Numbers: hex floats, p/q, decimals; exactly what they spell ---- *)
let max_chars = 1000
let longest = Big.shift_left Big.one 8192 (* denominators are below it *)
let largest = Big.shift_left Big.one 16384 (* and integers over a common one below this *)
let is_digit c = c >= '0' && c <= '9'
let is_hex c = is_digit c || (c >= 'a' && c <= 'f')
let all test s = let ok = ref true in String.iter (fun c -> if not (test c) then ok := false) s; !ok

(* a / b, which is tried: so greatest common divisors are not trusted here either. *)
let exactly a b =
  if Big.sign b <= 0 then bad "a divisor is not positive";
  let q = Big.divexact a b in
  if not (Big.equal (Big.mul q b) a) then bad "a quotient is not whole";
  q

let fraction n d =
  if Big.sign d <= 0 then bad "a denominator is zero";
  let g = Big.gcd n d in
  let d = exactly d g in
  if Big.leq longest d then bad "a denominator is too long";
  { qnum = exactly n g; qden = d }

let cut c s =
  match String.index_opt s c with
  | Some j -> Some (String.sub s 0 j, String.sub s (j + 1) (String.length s - j - 1))
  | None -> None

let number = function
  | Str s ->
    let wrong () = bad "not a finite number: %S" (if String.length s > 40 then String.sub s 0 40 else s) in
    if String.length s > max_chars then bad "a number is too long";
    let negative = String.length s > 0 && s.[0] = '-' in
    let t = if negative then String.sub s 1 (String.length s - 1) else s in
    let signed z = if negative then Big.neg z else z in
    let some test least most x = if String.length x < least || String.length x > most || not (all test x) then wrong () in
    let exponent most e =
      let sign, e =
        if e <> "" && e.[0] = '-' then (-1, String.sub e 1 (String.length e - 1))
        else if e <> "" && e.[0] = '+' then (1, String.sub e 1 (String.length e - 1))
        else (1, e) in
      some is_digit 1 most e;
      sign * int_of_string ("0u" ^ e) in
    let power base z e = if e >= 0 then fraction (Big.mul z (Big.pow base e)) Big.one else fraction z (Big.pow base (-e)) in
    if String.length t > 2 && String.sub t 0 2 = "0x" then begin
      match cut 'p' (String.sub t 2 (String.length t - 2)) with
      | None -> wrong ()
      | Some (m, e) ->
        let a, b = match cut '.' m with Some (a, b) -> (a, b) | None -> (m, "") in
        some is_hex 1 40 a; some is_hex 0 40 b;
        power (Big.of_int 2) (signed (Big.of_string_base 16 (a ^ b))) (exponent 4 e - (4 * String.length b))
    end else begin
      match cut '/' t with
      | Some (a, b) ->
        some is_digit 1 max_chars a; some is_digit 1 max_chars b;
        fraction (signed (Big.of_string a)) (Big.of_string b)
      | None ->
        let m, e = match cut 'e' t with Some (m, e) -> (m, exponent 3 e) | None -> (t, 0) in
        let a, b = match cut '.' m with Some (a, b) -> some is_digit 1 max_chars b; (a, b) | None -> (m, "") in
        some is_digit 1 max_chars a;
        power (Big.of_int 10) (signed (Big.of_string (a ^ b))) (e - String.length b)
    end
  | _ -> bad "a number is a text here"

let vec = list number
let vecn n = sized n number

(* The least common denominator of numbers that are used together, if it and the integers over it are short. *)
let common numbers =
  let lcm a b = if Big.equal a b || Big.equal b Big.one then a else Big.mul (exactly a (Big.gcd a b)) b in
  let d = List.fold_left (fun d x -> if Big.leq longest d then d else lcm d x.qden) Big.one numbers in
  if Big.leq longest d then bad "a common denominator is too long";
  let over x = Big.abs (Big.mul x.qnum (exactly d x.qden)) in
  if List.exists (fun x -> Big.leq largest (over x)) numbers then bad "a number is too large for its denominator";
  d
(* The same numbers over one denominator: the checker adds such numbers fastest. *)
let over d x = { qnum = Big.mul x.qnum (exactly d x.qden); qden = d }
let short numbers = let d = common numbers in List.map (over d) numbers
let level (rows : (q list * q) list) =
  let d = common (List.concat_map (fun (w, b) -> b :: w) rows) in
  List.map (fun (w, b) -> (List.map (over d) w, over d b)) rows

let less x y = Big.sign (Big.sub (Big.mul y.qnum x.qden) (Big.mul x.qnum y.qden)) > 0
let zero = { qnum = Big.zero; qden = Big.one }

(* ---- Problem, network, tube ---- *)
let rows_of get n =
  let a = list (vecn n) (get "A") in
  let b = vecn (List.length a) (get "b") in
  level (List.combine a b)
let poly n o = rows_of (fields [ "A"; "b" ] o) n

let problem o =
  let sizes = [ "n_p"; "points"; "n_q"; "n_k"; "steps"; "dt" ] in
  let get = fields (sizes @ [ "domain"; "goal"; "start"; "obstacles"; "body" ]) o in
  let n_p = whole 1 8 (get "n_p") and n_q = whole 0 64 (get "n_q") and n_k = whole 1 8 (get "n_k") in
  let steps = whole 1 100_000 (get "steps") in
  let n_points = whole 1 64 (get "points") in
  let d = fields [ "lo"; "hi" ] (get "domain") in
  let obstacle x =
    let get = fields ~optional:[ "steps" ] [ "A"; "b" ] x in
    let first, last0 =
      if not (has "steps" x) then (0, steps - 1)
      else match get "steps" with
        | Arr [ a; b ] -> let first = whole 0 (steps - 1) a in (first, whole first (steps - 1) b)
        | _ -> bad "the steps of an obstacle are a first and a last one" in
    { rows = rows_of get n_p; first; last0 } in
  let shape x get =
    match (has "radius" x, has "vertices" x) with
    | true, false -> Disc (number (get "radius"))
    | false, true -> Hull (list (vecn n_p) (get "vertices"))
    | _ -> bad "a body has a radius or vertices" in
  let optional = [ "radius"; "vertices" ] in
  let part x =
    let get = fields ~optional [ "points" ] x in
    { corners = list (whole 0 (n_points - 1)) (get "points"); grown_by = shape x get } in
  let parts = list part (fields [ "parts" ] (get "body") "parts") in
  if Big.sign (number (get "dt")).qnum <= 0 then bad "the time step dt is not positive";
  { n_p; n_q; n_k; n_points; steps; parts;
    domain = List.combine (vecn n_k (d "lo")) (vecn n_k (d "hi"));
    goal = poly ((n_points * n_p) + n_q) (get "goal");
    start = (match get "start" with Null -> [] | x -> poly n_p x);
    obstacles = list obstacle (get "obstacles") }

let max_layers = 64

let network o =
  let get = fields [ "weights"; "biases" ] o in
  let w = list (list vec) (get "weights") and b = list vec (get "biases") in
  if w = [] || List.length w > max_layers then bad "too few or too many layers";
  if List.map List.length w <> List.map List.length b then bad "weights and biases do not fit";
  List.map level (List.map2 List.combine w b)

(* An error is a list of widths or a polytope; for the end with multipliers for each row of the goal. *)
let multipliers_of n v =
  let found = list (function Arr [ row; m ] -> (whole 0 (n - 1) row, number m) | _ -> bad "a multiplier is [row, m]") v in
  List.combine (List.map fst found) (short (List.map snd found))

let tube p o =
  let get = fields [ "edges"; "interval"; "final" ] o in
  let error n = function
    | Obj _ as x -> Rows (poly n x)
    | x -> Widths (short (vecn n x)) in
  let step = sized p.n_points (error p.n_p) in
  let size = (p.n_points * p.n_p) + p.n_q in
  let final = function
    | Obj _ as x ->
      let get = fields [ "A"; "b"; "goal" ] x in
      let rows = rows_of get size in
      (Rows rows, sized (List.length p.goal) (list (multipliers_of (List.length rows))) (get "goal"))
    | x -> (Widths (short (vecn size x)), []) in
  let finals = list final (get "final") in
  ( { edges = sized p.n_k vec (get "edges"); intervals = list (sized p.steps step) (get "interval");
      finals = List.map fst finals },
    List.map snd finals )

(* ---- Samples, corridors, polytopes ---- *)
let sep p v =
  let run o = function
    | Arr [ stop; m ] -> (whole 0 p.steps stop, multipliers_of (List.length o.rows) m)
    | _ -> bad "a run is [stop, multipliers]" in
  let of_obstacle o = sized (List.length p.parts) (list (run o)) in
  List.map2 of_obstacle p.obstacles (sized (List.length p.obstacles) (fun x -> x) v)

let sample p o =
  let get = fields [ "p0"; "k"; "sep" ] o in
  { sample_p0 = short (vecn p.n_p (get "p0")); sample_k = short (vecn p.n_k (get "k")); sample_sep = sep p (get "sep") }

let piece p net o =
  let get = fields [ "p0"; "k"; "bin"; "pattern"; "sep" ] o in
  let digits = match get "pattern" with Str s -> s | _ -> bad "the pattern is not a text" in
  let hidden = List.filteri (fun i _ -> i < List.length net - 1) (List.map List.length net) in
  if String.length digits <> List.fold_left ( + ) 0 hidden then
    bad "the pattern does not have one digit for each hidden neuron";
  let bit j = match digits.[j] with '1' -> true | '0' -> false | _ -> bad "the pattern is not of 0 and 1" in
  let _, layers = List.fold_left (fun (at, l) n -> (at + n, List.init n (fun j -> bit (at + j)) :: l)) (0, []) hidden in
  { inner = short (vecn p.n_p (get "p0") @ vecn p.n_k (get "k")); which = whole 0 999_999_999 (get "bin");
    pattern = List.rev layers; piece_sep = sep p (get "sep") }

(* A box of doubt. Half widths around p0 and k within which a plan may be executed. *)
let boxed p o =
  let get = fields [ "p0"; "k"; "room"; "sep" ] o in
  let room = fields [ "p0"; "k" ] (get "room") in
  let widths n name =
    let found = short (vecn n (room name)) in
    if List.exists (fun r -> Big.sign r.qnum < 0) found then bad "a half width is negative";
    found in
  let side k r = (qadd k { r with qnum = Big.neg r.qnum }, qadd k r) in
  { middle_p0 = short (vecn p.n_p (get "p0")); room_p0 = widths p.n_p "p0";
    region = List.map2 side (vecn p.n_k (get "k")) (widths p.n_k "k"); boxed_sep = sep p (get "sep") }

(* ---- No plan, and volumes ---- *)

let pair f g = function Arr [ a; b ] -> (f a, g b) | _ -> bad "a pair was expected"

let hit p v =
  let some_obstacle = whole 0 (List.length p.obstacles - 1) and interval = whole 0 (p.steps - 1) in
  let of_part which_part (o, t, share, groups) =
    let n = List.length (List.nth p.parts which_part).corners in
    let contact x = let body, errors = pair vec (sized n (vecn p.n_p)) x in { body; errors } in
    let group x = let blend, contacts = pair (vecn n) (list contact) x in { blend; contacts } in
    { whom = some_obstacle o; which_part; step = interval t; share = number share; groups = list group groups } in
  match v with
  | Arr [ o; part; t; share; groups ] -> of_part (whole 0 (List.length p.parts - 1) part) (o, t, share, groups)
  | _ -> bad "a hit has another form"

(* A row of the goal with its multiplier, and an error of the end where one is named. *)
let uses p =
  let row = whole 0 (List.length p.goal - 1) in
  let checked l = ignore (common (List.map (fun u -> u.times) l)); l in
  fun v -> checked (list (function
    | Arr [ i; m ] -> { which_row = row i; times = number m; shrink = None }
    | Arr [ i; m; x ] -> { which_row = row i; times = number m; shrink = Some (vecn ((p.n_points * p.n_p) + p.n_q) x) }
    | _ -> bad "a row of the goal is [row, m] or [row, m, error]") v)

let rec reason p = function
  | Obj [ ("goal", m) ] -> Misses (uses p m)
  | Obj [ ("start", m) ] -> Elsewhere (multipliers_of (List.length p.start) m)
  | Obj [ ("hit", h) ] -> Hits (hit p h)
  | Obj [ ("safe", s) ] -> Safe (sep p s)
  | Obj [ ("open", _) ] -> Open
  | Obj [ ("bounded", (Obj [ (("goal" | "start" | "hit"), _) ] as leaf)) ] -> Bounded (reason p leaf)
  | _ -> bad "a node of the tree is not known"

(* The flat list of nodes, the lower part before the upper one, without a recursion as deep as the tree. *)
let tree p nodes =
  let split = function
    | Obj [ ("split", at) ] -> Some (pair (whole 0 (p.n_p + p.n_k - 1)) number at)
    | _ -> None in
  (* from the last node back: a split takes the two trees that begin after it *)
  match List.fold_left (fun made node ->
      match (split node, made) with
      | Some (axis, at), lower :: upper :: made -> Split (axis, at, lower, upper) :: made
      | Some _, _ -> bad "the tree has too few nodes"
      | None, made -> Leaf (reason p node) :: made) [] (List.rev nodes)
  with
  | [ tree ] -> tree
  | _ -> bad "the tree has nodes left over, or none"

let no_plan p o =
  let get = fields [ "kind"; "z"; "faces"; "tree" ] o in
  let claimed = match get "kind" with
    | Str "proved" -> fun proof -> Proved proof
    | Str "bracket" -> fun proof -> Bracket proof
    | _ -> bad "the kind is neither proved nor bracket" in
  let z = fields [ "lo"; "hi" ] (get "z") in
  claimed { z_box = List.combine (vecn p.n_p (z "lo")) (vecn p.n_p (z "hi"));
            faces = sized p.n_p (pair (uses p) (uses p)) (get "faces");
            root = tree p (match get "tree" with Arr l -> l | _ -> bad "the tree is not a list") }

(* ---- A whole answer ---- *)

(* An entry that cannot be read is refused like one that fails. *)
let readable f x =
  match f x with v -> Some v | exception (Bad _ | Failure _ | Invalid_argument _ | Not_found | Stack_overflow) -> None

(* The question first: whatever is wrong with it is told before entries are read. *)
let answer get listed =
  let p = problem (get "problem") and n = network (get "network") in
  let e, h = tube p (get "tube") in
  (* not List.map: JavaScript's stack ends at some thousand entries *)
  let entries name f = List.rev (List.rev_map (readable f) (listed name)) in
  { scene = p; net = n; around = e; hints = h;
    samples = entries "samples" (sample p); sets = entries "sets" (piece p n);
    corridors = entries "corridors" (sample p); doubts = entries "doubt" (boxed p);
    absent = (match get "no_plan" with
              | Null -> Unclaimed
              | x -> match readable (no_plan p) x with Some found -> found | None -> Unread) }

(* ---- An episode ---- *)
let same_number x y = Big.equal x.qnum y.qnum && Big.equal x.qden y.qden

(* All copies of a point, or none, are in a part of the body. *)
let whole_copies copies b =
  let every = List.concat_map (fun i -> List.init copies (fun c -> (i / copies * copies) + c)) b.corners in
  if List.sort_uniq compare every <> List.sort_uniq compare b.corners then bad "a part of the body leaves out copies of a point"

let most_turn = { qnum = Big.of_int 8; qden = Big.one } (* [rad] of a heading *)

let episode get =
  let entries = match get "manoeuvres" with Arr (_ :: _ as l) -> l | _ -> bad "an episode without a manoeuvre" in
  let entries = List.map (fields [ "begin"; "pose"; "problem"; "sample" ]) entries in
  let dt_of o = number (Option.get (field "dt" o)) in
  let first = List.hd entries "problem" in
  let p = problem first and n = network (get "network") in
  let e, h = tube p (get "tube") in
  let copies = whole 1 p.n_points (get "copies") in
  let off = vecn (p.n_p + 2) (get "doubt") in
  if List.exists (fun x -> Big.sign x.qnum < 0) off then bad "a doubt is negative";
  let turned o = match list number (o "pose") with
    | pose when List.length pose = p.n_p -> false
    | [ _; _; heading ] when p.n_p = 2 ->
      if less most_turn { heading with qnum = Big.abs heading.qnum } then bad "a heading is beyond 8 rad";
      true
    | _ -> bad "a pose has a number for each axis, in the plane maybe a heading" in
  let turning = turned (List.hd entries) in
  if turning && Big.sign (List.nth off p.n_p).qnum > 0 && copies mod 3 <> 0 then bad "headings are off, and a point has no three copies";
  let manoeuvre o =
    let q = problem (o "problem") in
    let side (a, b) (c, d) = same_number a c && same_number b d in
    if not (List.length q.domain = List.length p.domain && List.for_all2 side q.domain p.domain
            && same_number (dt_of (o "problem")) (dt_of first)) then bad "another problem has another domain or time step";
    if turned o <> turning then bad "a manoeuvre is told in another frame than the one before";
    List.iter (whole_copies copies) q.parts;
    let turns b = match b.grown_by with Disc _ -> true | Hull _ -> false in
    if turning && not (List.for_all turns q.parts) then bad "a polygon does not turn with the robot";
    { begin0 = number (o "begin"); pose = List.filteri (fun i _ -> i < p.n_p) (list number (o "pose")); asked = q;
      heading = (if turning then List.nth (list number (o "pose")) p.n_p else zero);
      its_hints = h; its_plan = readable (sample q) (o "sample") } in
  ( { its_net = n; its_tube = e; tick = dt_of first; turning; doubt = List.filteri (fun i _ -> i < p.n_p) off;
      done0 = List.map manoeuvre entries }, p )

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

(* The words that a claim may have for its law. *)
let words o pairs said =
  if field "kind" o = Some (Str "validated") then
    [ (if recorded o then of_a_recording ^ ", run" else "a plan drawn uniformly from this set, run afresh")
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
    if not (has_its_numbers o name said) then bad "the numbers of an assumption are not the claim's";
    match cut '(' entry with
    | None -> line "assumed" (entry, "")
    | Some (name, rest) ->
      let n = String.length rest in
      line "assumed" (name, if n > 0 && rest.[n - 1] = ')' then String.sub rest 0 (n - 1) else rest) in
  List.map (line "checked") checked @ List.map (line "measured") counted
  @ List.concat_map (stated true) needed @ List.concat_map (stated false) more
  @ List.map assumed (if assumptions = [] then [ Str "assumptions(not stated)" ] else assumptions)
