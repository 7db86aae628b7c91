#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Cost of a vector lane with NEON and with the portable code, relative to AVX2. Builds the programs of this folder for this
# x86-64 machine, counts their instructions with AVX2 and with SSE2 only, and prints them next to the counts of run.sh for
# ARM and the same number of frames. A vector of AVX2 has twice as many lanes. See README.md.
#
# usage: bench/board/lanes.sh
# Needs the requirements and results (build/board) of run.sh, and libopencv-dev, liboctomap-dev, libpng-dev, libjpeg-dev.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
data=${ORBIS_DATA_DIR:-$here/../../../shared/data}/kitchen
fail() {
  printf 'lanes.sh: %s\n' "$1" >&2
  exit 1
}
[[ -d $data ]] || fail "no recording $data (ORBIS_DATA_DIR)"
data=$(cd "$data" && pwd)
for tool in "${CC:-gcc}" "${CXX:-g++}" qemu-x86_64 python3; do
  command -v "$tool" >/dev/null || fail "$tool was not found"
done
cd "$here/../.."
out=build/board
names=(features_1000 octree_5cm slam_kitchen_default)
for name in "${names[@]}"; do [[ -e $out/$name.tsv ]] || fail "no $out/$name.tsv: run bench/board/run.sh first"; done
frames=$(grep -c '^frame' "$out/slam_kitchen_default.tsv")  # the number of frames of run.sh
native=$out/native
mkdir -p "$native"
flags=(-std=c++20 -O3 -DNDEBUG -ffp-contract=off -w -Iinclude -MMD -isystem /usr/include/eigen3
  -isystem /usr/include/opencv4)

. bench/board/programs.sh
build() {
  outdated "$native/$1" || return 0
  echo "compiling $1" >&2
  "${CXX:-g++}" "${flags[@]}" -MF "$native/$1.d" -o "$native/$1" "bench/board/$1.cpp" "${@:2}" -lpng -ljpeg -lz
}
build_plugin "$out/libcount.so"
build features -lopencv_features2d -lopencv_core
build octree -loctomap -loctomath
build slam
count() {  # name of the counts, processor, program and its arguments
  echo "counting $1 ($2)" >&2
  rm -f "$native/$1_$2.tsv"
  qemu-x86_64 -cpu "$2" -plugin "./$out/libcount.so,out=$native/$1_$2.tsv" "$native/$3" "${@:4}" >&2
}
for cpu in max core2duo; do  # QEMU's "max" has AVX2 and no AVX-512
  count features_1000 "$cpu" features "$data" 8 1000 8
  if ! count octree_5cm "$cpu" octree "$data" 6 0.05; then  # the program fails if the map differs from OctoMap's
    [[ $cpu == max && -s $native/octree_5cm_max.tsv ]] || fail "octree failed"
    echo "lanes.sh: the map differs from OctoMap's; see README.md about AVX2 in QEMU 7.2" >&2
  fi
  count slam_kitchen_default "$cpu" slam "$data" 0 "$frames" default
done
for name in "${names[@]}"; do
  stages=()
  [[ $name == slam_* ]] && stages=(--stages)
  python3 bench/board/table.py --lanes "${stages[@]}" "$out/$name.tsv" "$native/${name}_core2duo.tsv" "$native/${name}_max.tsv"
done
