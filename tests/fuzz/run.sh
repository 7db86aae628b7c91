#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# run.sh FOLDER MINUTES [TARGET...]: runs the fuzz targets that were built into FOLDER, as many at once as there are
# processors and each for an equal share of the minutes, from the seeds beside this file and from what earlier runs have
# found (FOLDER/inputs). Prints the executions of each and of all. Ends with 1 if one found something: the input is in
# FOLDER/findings.
set -euo pipefail
seeds=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/corpus
folder=$(cd "$1" && pwd)
minutes=$2
shift 2
[[ $minutes =~ ^[0-9]+([.][0-9]+)?$ ]] || { echo "run.sh: \"$minutes\" is no number of minutes" >&2; exit 1; }

targets=("$@")
if ((${#targets[@]} == 0)); then
  for program in "$folder"/fuzz_*; do
    [[ -x $program && ! -d $program ]] && targets+=("$(basename "$program" | sed s/^fuzz_//)")
  done
fi
for target in "${targets[@]}"; do
  [[ -x $folder/fuzz_$target ]] || { echo "run.sh: $target: no such fuzz target" >&2; exit 1; }
done
((${#targets[@]} > 0)) || { echo "run.sh: $folder: no fuzz targets" >&2; exit 1; }
at_once=$(nproc)
((at_once <= ${#targets[@]})) || at_once=${#targets[@]}
seconds=$(awk -v m="$minutes" -v n="${#targets[@]}" -v p="$at_once" \
  'BEGIN { s = int(60 * m * p / n); print(s > 1 ? s : 1) }')

# Less memory for freed blocks and shorter traces of allocations: two thirds more executions.
export ASAN_OPTIONS=${ASAN_OPTIONS:-quarantine_size_mb=8:thread_local_quarantine_size_kb=64:malloc_context_size=2:allocator_release_to_os_interval_ms=-1}

fuzz_one() {  # target
  local inputs=$folder/inputs/$1 findings=$folder/findings/$1 log=$folder/findings/$1.log status=0 longest
  # No longer than the seeds, which have all that a file may have: length costs executions.
  longest=$(find "$seeds/$1" -type f -printf '%s\n' | sort -n | tail -n 1)
  ((longest >= 512)) || longest=512
  rm -rf "$findings" "$log"
  mkdir -p "$inputs" "$findings"
  # 1 s for each input is the aim of readers; sanitizers and a busy machine get ten times as long.
  # Entropic schedules and searching for leaks after each input take longer than most inputs do. Leaks are found at the
  # end as well.
  "$folder/fuzz_$1" -max_total_time="$seconds" -max_len="$longest" -entropic=0 -detect_leaks=0 -timeout=10 \
    -rss_limit_mb=2560 -print_final_stats=1 -print_funcs=0 -artifact_prefix="$findings/" "$inputs" "$seeds/$1" >"$log" 2>&1 || status=$?
  # One that is killed does not come to its final statistics.
  local count
  count=$(awk '/^stat::number_of_executed_units:/ { n = $2 } /^#[0-9]+\t/ { last = substr($1, 2) }
               END { print(n + 0 > 0 ? n : last + 0) }' "$log")
  printf '%-20s %12d executions%s\n' "$1" "$count" "$( ((status == 0)) || echo "  FOUND something: $findings, $log")"
  echo "$count $status" >"$folder/findings/$1.result"
}
export -f fuzz_one
export folder seeds seconds
mkdir -p "$folder/findings"
rm -f "$folder"/findings/*.result
printf '%s\0' "${targets[@]}" | xargs -0 -P "$at_once" -I {} bash -c 'set -euo pipefail; fuzz_one {}'
cat "$folder"/findings/*.result | awk '{ n += $1; bad += ($2 != 0) }
  END { printf "%-20s %12d executions, %d targets with findings\n", "in all", n, bad; exit bad != 0 }'
