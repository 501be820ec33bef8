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

try fails "by bounds: the lines below and above swapped" NoPlan.v 'if qle 0 a then (qmul a (under l) :: v, d)' 'if negb (qle 0 a) then (qmul a (under l) :: v, d)'
try fails "by bounds: lines above without their height" NoPlan.v 'qadd (qmul a (height l)) d)' 'd)'
try fails "by bounds: a slope that is not tried" NoPlan.v 'let slope := if qle 0 s && qle hi (qmul s size) then s else 1 in' 'let slope := s in'
try fails "by bounds: the other end of the box of k" NoPlan.v 'qmul a (if qle 0 a then lo else hi)' 'qmul a (if qle 0 a then hi else lo)'
try fails "by bounds: lines of another box of k" NoPlan.v 'else if same_box D (fst lined) then' 'else if true then'
try fails "by bounds: open leaves" NoPlan.v 'thick B && boundable r'"'"' && check_leaf' 'thick B && check_leaf'
exit $wrong
