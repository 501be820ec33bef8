(* What the reader made of a file, as terms of Coq: tests/checker/compare/two_terms.py says whether that is what the
   file says.  No part of the checker. *)
module Big = Z (* zarith's, before Check's own Z hides it *)
open Check
open Printf

let array f l = "[" ^ String.concat "; " (List.map f l) ^ "]"
let nat i = sprintf "%d%%nat" i
let bool b = if b then "true" else "false"

let number q =
  let g = Big.gcd q.qnum q.qden in
  sprintf "(Qmake (%s) %s)" (Big.to_string (Big.divexact q.qnum g)) (Big.to_string (Big.divexact q.qden g))

let vec = array number
let both f g (a, b) = sprintf "(%s, %s)" (f a) (g b)
let poly = array (both vec number)
let box = array (both number number)
let shape = function Disc r -> sprintf "(Disc %s)" (number r) | Hull vs -> sprintf "(Hull %s)" (array vec vs)
let part b = sprintf "(Part %s %s)" (array nat b.corners) (shape b.grown_by)
let obstacle o = sprintf "(Obstacle %s %s %s)" (poly o.rows) (nat o.first) (nat o.last0)

let problem p =
  sprintf "(Problem %s %s %s %s %s %s %s %s %s %s)" (nat p.n_p) (nat p.n_q) (nat p.n_k) (nat p.n_points) (nat p.steps)
    (box p.domain) (poly p.start) (poly p.goal) (array obstacle p.obstacles) (array part p.parts)

let network = array poly
let error = function Widths e -> sprintf "(Widths %s)" (vec e) | Rows a -> sprintf "(Rows %s)" (poly a)
let tube e =
  sprintf "(Tube %s %s %s)" (array vec e.edges) (array (array (array error)) e.intervals) (array error e.finals)

let multipliers = array (both nat number)
let hints = array (array (array multipliers))
let sep = array (array (array (both nat multipliers)))
let sample s = sprintf "(Sample %s %s %s)" (vec s.sample_p0) (vec s.sample_k) (sep s.sample_sep)
let piece s =
  sprintf "(Piece %s %s %s %s)" (vec s.inner) (nat s.which) (array (array bool) s.pattern) (sep s.piece_sep)
let boxed s = sprintf "(Boxed %s %s %s %s)" (vec s.middle_p0) (vec s.room_p0) (box s.region) (sep s.boxed_sep)

let optional f = function None -> "None" | Some x -> sprintf "(Some %s)" (f x)
let use u = sprintf "(Use %s %s %s)" (nat u.which_row) (number u.times) (optional vec u.shrink)
let contact c = sprintf "(Contact %s %s)" (vec c.body) (array vec c.errors)
let group g = sprintf "(Group %s %s)" (vec g.blend) (array contact g.contacts)

let hit h =
  sprintf "(Hit %s %s %s %s %s)" (nat h.whom) (nat h.which_part) (nat h.step) (number h.share) (array group h.groups)

let rec reason = function
  | Misses us -> sprintf "(Misses %s)" (array use us)
  | Elsewhere m -> sprintf "(Elsewhere %s)" (multipliers m)
  | Hits h -> sprintf "(Hits %s)" (hit h)
  | Safe s -> sprintf "(Safe %s)" (sep s)
  | Open -> "Open"
  | Bounded r -> sprintf "(Bounded %s)" (reason r)

let rec tree = function
  | Leaf r -> sprintf "(Leaf %s)" (reason r)
  | Split (axis, cut, lower, upper) -> sprintf "(Split %s %s %s %s)" (nat axis) (number cut) (tree lower) (tree upper)

let proof p =
  sprintf "(Proof %s %s %s)" (box p.z_box) (array (both (array use) (array use)) p.faces) (tree p.root)

let absence = function
  | Unclaimed -> "Unclaimed"
  | Unread -> "Unread"
  | Proved p -> sprintf "(Proved %s)" (proof p)
  | Bracket p -> sprintf "(Bracket %s)" (proof p)

(* A line of JSON: no term has a character that JSON would escape. *)
let to_json a =
  let one (name, term) = sprintf "\"%s\": \"%s\"" name term in
  let some (name, terms) = sprintf "\"%s\": [%s]" name (String.concat ", " (List.map (sprintf "\"%s\"") terms)) in
  let each f = List.map (optional f) in
  let question =
    [ ("scene", problem a.scene); ("net", network a.net); ("around", tube a.around); ("hints", hints a.hints);
      ("absent", absence a.absent) ] in
  let entries =
    [ ("samples", each sample a.samples); ("sets", each piece a.sets); ("corridors", each sample a.corridors);
      ("doubts", each boxed a.doubts) ] in
  "{" ^ String.concat ", " (List.map one question @ List.map some entries) ^ "}"
