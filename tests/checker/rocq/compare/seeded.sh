#!/usr/bin/env bash
# Unsound checkers must not pass: each change below breaks a proof. Harmless changes must pass.
#     bash tests/checker/rocq/compare/seeded.sh [how many of the unsound ones, from the first; default all]
set -uo pipefail
cd "$(dirname "$0")/.."
make -s proofs || exit 1
base=$(pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
wrong=0
left=${1:-99}

# try EXPECTED NAME FILE OLD NEW: the first OLD in FILE becomes NEW; do all proofs still pass?
try() {
  if [ "$1" = fails ]; then
    [ "$left" -gt 0 ] || return
    left=$((left - 1))
  fi
  rm -rf "$folder/try" && mkdir "$folder/try"
  cp -p "$base"/*.v "$base"/*.vo "$base"/Makefile "$folder/try"   # with their times: make compiles what the change touches
  python3 - "$folder/try/$3" "$4" "$5" <<'PYTHON' || { echo "cannot change: $2"; wrong=1; return; }
import sys
from pathlib import Path
path, old, new = Path(sys.argv[1]), *sys.argv[2:]
text = path.read_text()
assert old in text
path.write_text(text.replace(old, new, 1))
PYTHON
  local result verdict="as it must"
  if make -s -C "$folder/try" proofs >"$folder/out" 2>&1; then
    result=passes
  else
    result="fails in $(sed -n 's/^File ".\/\([A-Za-z]*\).v".*/\1/p' "$folder/out" | head -1)"
  fi
  [ "$1" = "${result%% *}" ] || { verdict="WRONG, must have been: $1"; wrong=1; }
  # an unsound checker that is not even a checker shows nothing
  case $result in "fails in ${3%.v}") verdict="WRONG, the change itself does not compile"; wrong=1 ;; esac
  echo "$2: $result ($verdict)"
}

try passes "harmless: no guesses of multipliers (fewer templates are accepted)" Checker.v '(hints ++ guesses A w)' 'hints'
try fails "only the first knot of an interval" Checker.v 'apart w g (nth (S t * n_points P + i) K [])' 'apart w g (nth (t * n_points P + i) K [])'
try fails "touching allowed" Checker.v '(true, aadd (lincomb w X)' '(false, aadd (lincomb w X)'
try fails "faces between bins closed" Checker.v '(negb (Qeq_bool lo (hd lo e))' '(false'
try fails "only one bin at a border" Checker.v '(filter (fun BH => inBoxQ (box (fst BH)) (k s)) (hinted E H))' '(firstn 1 (filter (fun BH => inBoxQ (box (fst BH)) (k s)) (hinted E H)))'
try fails "no tube at obstacles" Checker.v 'let g := qadd h r in' 'let g := h in'
try fails "the tube in the wrong direction" Checker.v '[] (vscale (-1) w)' '[] w'
try fails "negative multipliers" Checker.v '(snd r) && positive (snd r) &&' '(snd r) &&'
try fails "no body" Checker.v 'qadd h (support (grown_by (snd b)) w)' 'h'
try fails "a root that is not tried" Arithmetic.v 'if qle 0 u && qle s (qmul u u) then u else 1 + s' 'u'
try fails "widths without absolute values" Checker.v 'Some (dotQ (vabs w) e)' 'Some (dotQ w e)'
try fails "template errors with any multipliers" Checker.v 'if same v w then' 'if true then'
try fails "the last interval left out" Checker.v '(seq (first (fst b)) (S (last (fst b)) - first (fst b)))' '(seq (first (fst b)) (last (fst b) - first (fst b)))'
try fails "only the first point of a part" Checker.v '(corners (snd b))' '(firstn 1 (corners (snd b)))'
try fails "only the first part of the body" Checker.v 'map (pair o) (parts P)' 'map (pair o) (firstn 1 (parts P))'
try fails "signs of neurons left out" Checker.v '(signs b Z ++ r, Y)' '(r, Y)'
try fails "k outside the domain" Checker.v 'inBoxQ (domain P) (k s) && sep_ok' 'sep_ok'
try fails "no goal row checked" Checker.v 'combine (seq 0 (length A)) A' 'combine (seq 0 0) A'
try fails "edges in any order" Checker.v 'increasing e && qle a lo' 'qle a lo'
try fails "boxes of doubt: one half of a cut cell forgotten" Doubt.v 'go true (above f V ++ zs) ++ go false (under f V ++ zs)' 'go true (above f V ++ zs)'
try fails "boxes of doubt: cells without the points of the cut" Doubt.v 'go true (above f V ++ zs)' 'go true (above f V)'
try fails "boxes of doubt: no room for p0" Doubt.v 'qadd (dotQ a p0) (- dotQ (vabs a) d)' 'dotQ a p0'
exit $wrong
