#!/usr/bin/env bash
# Unsound checkers must not pass: each change below breaks a proof. Harmless changes must pass.
#     bash tests/checker/compare/seeded.sh [how many of the unsound ones, from the first; default all] [folder of the proofs]
set -uo pipefail
base=$(realpath "${2:-$(dirname "$0")/../../../parc_jax/checker/proved}")
make -s -C "$base" proofs >/dev/null || exit 1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
wrong=0
left=${1:-99}

# try EXPECTED NAME FILE OLD NEW: the first OLD in FILE becomes NEW, wherever its lines end; do all proofs still pass?
# What is left out becomes `true`, so that a proof fails by what is said and not by the shape of a term.
try() {
  if [ "$1" = fails ]; then
    [ "$left" -gt 0 ] || return
    left=$((left - 1))
  fi
  rm -rf "$folder/try" && mkdir "$folder/try"
  cp -pr "$base"/{_CoqProject,Makefile,theories} "$folder/try"   # with their times: make compiles what the change touches
  python3 - "$folder/try/theories/$3" "$4" "$5" <<'PYTHON' || { echo "cannot change: $2"; wrong=1; return; }
import re, sys
from pathlib import Path
path, old, new = Path(sys.argv[1]), *sys.argv[2:]
text, found = re.subn(r"\s+".join(map(re.escape, old.split())), lambda _: new, path.read_text(), count=1)
assert found
path.write_text(text)
PYTHON
  local result verdict="as it must"
  if make -s -C "$folder/try" proofs >"$folder/out" 2>&1; then
    result=passes
  else
    result="fails in $(sed -n 's/^File ".\/theories\/\([A-Za-z]*\).v".*/\1/p' "$folder/out" | head -1)"
  fi
  [ "$1" = "${result%% *}" ] || { verdict="WRONG, must have been: $1"; wrong=1; }
  # an unsound checker that is not even a checker shows nothing
  case $result in "fails in ${3%.v}") verdict="WRONG, the change itself does not compile"; wrong=1 ;; esac
  echo "$2: $result ($verdict)"
}

try passes "harmless: no guesses of multipliers (fewer templates are accepted)" Checker.v '(hints ++ guesses A w)' 'hints'
try fails "only the first knot of an interval" Checker.v 'apart w g (nth (S t * n_points P + i) K [])' 'apart w g (nth (t * n_points P + i) K [])'
try fails "touching allowed" Checker.v '(true, aadd (lincomb w X)' '(false, aadd (lincomb w X)'
try fails "faces between bins closed" Polytopes.v '(negb (Qeq_bool lo (hd lo e))' '(false'
try fails "only one bin at a border" Checker.v '(filter (fun BH => inBoxQ (box (fst BH)) (sample_k s)) (hinted E H))' '(firstn 1 (filter (fun BH => inBoxQ (box (fst BH)) (sample_k s)) (hinted E H)))'
try fails "no tube at obstacles" Checker.v 'let g := qadd h r in' 'let g := h in'
try fails "the tube in the wrong direction" Checker.v '[] (vscale (-1) w)' '[] w'
try fails "negative multipliers" Checker.v '(snd r) && positive (snd r) &&' '(snd r) && true &&'
try fails "no body" Checker.v 'qadd h (support (grown_by (snd b)) w)' 'h'
try fails "a root that is not tried" Arithmetic.v 'if qle 0 u && qle s (qmul u u) then u else 1 + s' 'u'
try fails "widths without absolute values" Checker.v 'Some (dotQ (vabs w) e)' 'Some (dotQ w e)'
try fails "template errors with any multipliers" Checker.v 'if same v w then' 'if true then'
try fails "the last interval left out" Checker.v '(seq (first (fst b)) (S (last (fst b)) - first (fst b)))' '(seq (first (fst b)) (last (fst b) - first (fst b)))'
try fails "only the first point of a part" Checker.v '(corners (snd b))' '(firstn 1 (corners (snd b)))'
try fails "only the first part of the body" Checker.v 'map (pair o) (parts P)' 'map (pair o) (firstn 1 (parts P))'
try fails "signs of neurons left out" Checker.v '(signs b Z ++ r, Y)' '(r, Y)'
try fails "k outside the domain" Checker.v 'inBoxQ (domain P) (sample_k s) && sep_ok' 'true && sep_ok'
try fails "no goal row checked" Checker.v 'combine (seq 0 (length A)) A' 'combine (seq 0 0) A'
try fails "edges in any order" Checker.v 'increasing e && qle a lo' 'true && qle a lo'
try fails "boxes of doubt: one half of a cut cell forgotten" Doubt.v 'go true (above f V ++ zs) ++ go false (under f V ++ zs)' 'go true (above f V ++ zs)'
try fails "boxes of doubt: cells without the points of the cut" Doubt.v 'go true (above f V ++ zs)' 'go true (above f V)'
try fails "boxes of doubt: no room for p0" Doubt.v 'qadd (dotQ a p0) (- dotQ (vabs a) d)' 'dotQ a p0'
try fails "no plan: goal rows shrunk without absolute values" NoPlan.v 'dotQ (vabs a) (end_widths P B)' 'dotQ a (end_widths P B)'
try fails "no plan: the end may leave the widths of the last interval" NoPlan.v 'vmin (concat (map width (last_errors P B))) (width (final B))' 'width (final B)'
try fails "no plan: the widest of the bins" NoPlan.v 'if qle x y then x else y' 'if qle x y then y else x'
try fails "no plan: contacts with any error" NoPlan.v 'qle (Qabs a) b && small' 'true && small'
try fails "no plan: contacts beside the body" NoPlan.v 'Nat.eqb (length v) n && qle (dotQ v v) (qmul r r)' 'Nat.eqb (length v) n && true'
try fails "no plan: weights of a polygon that do not sum to one" NoPlan.v 'Qeq_bool (fold_right qadd 0 lam) 1' 'true'
try fails "no plan: touching at a knot with an error of one side" NoPlan.v '(negb (loose P bs b h))' 'false'
try fails "no plan: a hit while the obstacle is not there" NoPlan.v '(step h <=? last o)%nat' 'true'
try fails "no plan: a goal row with any error" NoPlan.v 'Some x => end_allows P x' 'Some x => fun _ => true'
try fails "no plan: an error of the end that the last interval forbids" NoPlan.v 'forallb (fun Ex => allows (n_p P) (fst Ex) (snd Ex)) (combine (last_errors' 'true || forallb (fun Ex => allows (n_p P) (fst Ex) (snd Ex)) (combine (last_errors'
try fails "no plan: templates allow any error" NoPlan.v 'forallb (fun ab => qle (dotQ (fst ab) x) (snd ab)) A end' 'true end'
try fails "no plan: templates that exclude the model" NoPlan.v 'forallb centred (bins E) && ' 'true && '
try fails "no plan: a negative multiple of a goal row" NoPlan.v '&& qle 0 (times u) &&' '&& true &&'
try fails "no plan: mixtures that change with k" NoPlan.v 'existsb (fun some => throughout cs (fun w => existsb (forallb (holdsQ (z ++ w))) some)) options' 'throughout cs (fun w => existsb (fun some => existsb (forallb (holdsQ (z ++ w))) some) options)'
try fails "no plan: mixtures of which the weights do not sum to one" NoPlan.v 'is_mixture (length (corners b)) (blend g) &&' 'Nat.eqb (length (blend g)) (length (corners b)) &&'
try fails "no plan: combinations that do not exceed" NoPlan.v ': row := (true, aadd (lincomb (fst wh) X)' ': row := (false, aadd (lincomb (fst wh) X)'
try fails "no plan: cells in which a neuron changes its sign" NoPlan.v 'if steady L (snd c)' 'if true'
try fails "no plan: cells of another box of k" NoPlan.v 'else if same_box D (fst kept) then' 'else if true then'
try fails "no plan: one face of z unchecked" NoPlan.v 'qle g hi && check_faces' 'check_faces'
try fails "by bounds: the lines below and above swapped" NoPlan.v 'if qle 0 a then (qmul a (under l) :: v, d)' 'if negb (qle 0 a) then (qmul a (under l) :: v, d)'
try fails "by bounds: lines above without their height" NoPlan.v 'qadd (qmul a (height l)) d)' 'd)'
try fails "by bounds: a slope that is not tried" NoPlan.v 'let slope := if qle 0 s && qle hi (qmul s size) then s else 1 in' 'let slope := s in'
try fails "by bounds: the other end of the box of k" NoPlan.v 'qmul a (if qle 0 a then lo else hi)' 'qmul a (if qle 0 a then hi else lo)'
try fails "by bounds: lines of another box of k" NoPlan.v 'else if same_box D (fst lined) then' 'else if true then'
try fails "volumes: cuts outside of their box" NoPlan.v 'Some (lo, hi) => qlt lo c && qlt c hi' 'Some (lo, hi) => true'
try fails "volumes: safe leaves in one bin only" NoPlan.v 'everywhere cs Z (fun v => forallb (holdsQ v) rows)) bhs' 'everywhere cs Z (fun v => forallb (holdsQ v) rows)) (firstn 1 bhs)'
try fails "volumes: open leaves counted as unsafe" NoPlan.v 'Misses _ | Elsewhere _ | Hits _ => true | _ => false' 'Misses _ | Elsewhere _ | Hits _ | Open => true | _ => false'
try fails "answers: a question that does not fit" Answer.v 'if context_ok P N E then' 'if true then'
try fails "answers: entries that could not be read" Answer.v '| None => false end' '| None => true end'
try fails "answers: the first sample alone" Answer.v 'marked (check_sample P N E H) (samples a)' 'marked (check_sample P N E H) (firstn 1 (samples a))'
try fails "answers: samples not asked" Answer.v 'forallb (forallb (fun ok => ok)) marks' 'forallb (forallb (fun ok => ok)) (tl marks)'
try fails "answers: corridors unchecked" Answer.v '(check_sample P N E H) (corridors a)' '(fun _ => true) (corridors a)'
try fails "answers: volumes taken for a proof that there is no plan" Answer.v 'check_no_plan P N E H p' 'check_proof P N E H p'
try fails "answers: one sample more than there are" Answer.v '(length (samples a))' '(S (length (samples a)))'
try fails "answers: shares that are not tried" Answer.v 'if qle (inject_Z n * all) (part * 100000) then n else 0%Z' 'n'
try fails "answers: the unsafe share told as the safe one" Answer.v '(share_of safe_ all)' '(share_of unsafe_ all)'
try fails "answers: bins without the model not counted" Answer.v '(fun B => negb (centred B))' '(fun _ => false)'
try fails "episodes: manoeuvres unasked" Episode.v 'if forallb (fun ok => ok) marks then' 'if true then'
try fails "episodes: the first manoeuvre alone" Episode.v '(asked m0) m)) (done e) in' '(asked m0) m)) (firstn 1 (done e)) in'
try fails "episodes: a plan that could not be read" Episode.v '| None => false' '| None => true'
try fails "episodes: plans that start elsewhere" Episode.v 'same (sample_p0 s) (start_of e m)' 'true'
try fails "episodes: a question that does not fit" Episode.v 'context_ok (asked m) (its_net e) (its_tube e)' 'true'
try fails "episodes: another body" Episode.v 'all_alike part_alike (parts P) (parts Q)' 'true'
try fails "episodes: begins in any order" Episode.v 'qle dt (qmul 2 (qadd (begin m'"'"') (- begin m)))' 'true'
try fails "episodes: intervals of no time" Episode.v 'qlt 0 (tick e)' 'true'
try fails "episodes: doubt of fewer axes" Episode.v 'Nat.eqb (length (doubt e)) (n_p (asked m0))' 'true'
try fails "claims: looks that cost nothing" Claim.v 'Zpos (looks c) * x <=? one' 'x <=? one'
try fails "claims: discards that cost nothing" Claim.v 'rest 1 one one (discards b) in' 'rest 1 one one O in'
try fails "claims: the first block alone" Claim.v 'Some x, Some y => Some (x + y)' 'Some x, Some y => Some x'
try fails "claims: a quotient that is not tried" Claim.v 'if a <=? b * q then q else' 'if true then q else'
try fails "claims: runs that count double" Claim.v 'let low := power q rest (runs b) in' 'let low := power q rest (xO (runs b)) in'
try fails "claims: a bin with the bound of no block" Claim.v 'existsb (fun b => Qeq_bool e (bound b)) (blocks c)' 'true'
try fails "a theorem that says less: of networks without a layer" NoPlanFacts.v 'failing_is_not_safe P N E u k' 'failing_is_not_safe P (N := []) E u k'
try fails "a set is tested by the runs of other plans" ClaimSpec.v "(length (filter fails (filter has l)))" "(length (filter fails (filter (fun a => negb (has a)) l)))"
try fails "a set is accepted after one that was not" ClaimSpec.v "(riskier L fails has e || accepts_a_bad_one L fails e show others l)" "riskier L fails has e || accepts_a_bad_one L fails e show others l"
try fails "the inner point: without the signs of neurons" Integers.v "signsZ b Z && ok" "ok"
try fails "the inner point: on rows" Polytopes.v "less g a && less g b" "(g <=? a)%Z && less g b"
try fails "the inner point: the first knot of an interval alone" Polytopes.v "less g a && less g b" "less g a && less g a"
try fails "the inner point: widths without absolute values" Polytopes.v "(map Z.abs W)" "W"
try fails "the inner point: errors of the first interval of a run" Polytopes.v "run_clear P A (tl Is) K'" "run_clear P A Is K'"
try fails "the inner point: the first direction for all intervals" Polytopes.v "Nat.min n (stop - t)" "n"
try fails "the inner point: numbers over another denominator" Integers.v "if Zpos (Qden q) * m =? d then Some" "if true then Some"
try fails "along the intervals: the first knot alone" Checker.v "[apart w g (nth i K []); apart w g (nth i K' [])] end. Fixpoint" "[apart w g (nth i K []); apart w g (nth i K [])] end. Fixpoint"
try fails "along the intervals: errors of the first" Checker.v "clear_on P (tl Is) K' points" "clear_on P Is K' points"
try fails "JSON: a key twice" Parse.v "if unique 24 (fold_left (fun names m => fst m :: names) done [key]) then" "if true then"
try fails "JSON: numbers that begin with 0" Parse.v '(here s first =? "0")%char && (S upto <? first)%nat' 'false'
try fails "JSON: half of a pair swallows what follows" Parse.v "if low n then Some n else None | None => None" "Some n | None => None"
try fails "the reader: exponents of decimals ignored" Reader.v "Some (raised 10 z (e - Z.of_nat b))" "Some (raised 10 z (- Z.of_nat b))"
try fails "the reader: obstacles there from the first step on" Reader.v "Fine (Obstacle A first last)" "Fine (Obstacle A 0 last)"
try fails "the reader: errors of the end in the wrong bins" Reader.v "map fst finals" "rev (map fst finals)"
try fails "the reader: halves of a split exchanged" Reader.v "Split axis at_ lower upper" "Split axis at_ upper lower"
try fails "the reader: boxes of doubt from their middle on" Reader.v "(qadd k (Qmake (- Qnum r) (Qden r)), qadd k r)" "(k, qadd k r)"
exit $wrong
