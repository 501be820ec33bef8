#!/usr/bin/env bash
# What a GPU is worth, in one call of at most ten minutes: batches to 2^20 scenes, rollouts, single
# queries and covers. From the root of a checkout, in the environment that has JAX for that GPU:
#
#   benchmarks/gpu.sh runs/gpu
#
# Each workload is a process with a share of the time, and what it measured is kept whatever becomes
# of the others: FOLDER/NAME.json, and one page of all of them, FOLDER/report.md. DEVICE=cpu measures
# the same things on the processor, for comparison; --quick after the folder tries the script. The exit
# code is 2 where there is no such device, 1 where something was not finished.
set -euo pipefail
out=${1:?folder for the report}
shift
mkdir -p "$out"
begin=$SECONDS
unfinished=0

measure() { # seconds, workload, options
  local most=$1 name=$2 code=0
  shift 2
  echo "$name: at most $most s" >&2
  timeout "$most" python -m benchmarks --device "${DEVICE:-gpu}" --only "$name" \
    --json "$out/$name.json" "$@" >"$out/$name.md" || code=$?
  ((code != 2)) || exit 2 # no such device: it has been said
  ((code == 0)) || {
    unfinished=1
    echo "$name: not finished, exit code $code" | tee -a "$out/$name.md" >&2
  }
  cat "$out/$name.md" >>"$out/report.md"
}

: >"$out/report.md"
measure 30 control "$@"
measure 190 batch_query "$@"
measure 190 rollouts "$@"
measure 180 query "$@"
echo "$out/report.md, after $((SECONDS - begin)) s" >&2
exit "$unfinished"
