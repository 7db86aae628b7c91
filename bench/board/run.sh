#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Cost of a frame on a Raspberry Pi 4, counted under emulation: builds the plugin and the programs of this folder and
# prints the table. See README.md.
#
# usage: bench/board/run.sh SYSROOT [FRAMES]
# Needs gcc, g++-aarch64-linux-gnu, qemu-user (6 to 8, as in Debian 12; later versions have another plugin API), python3,
# libeigen3-dev, libexpected-dev and libtomlplusplus-dev, the recordings of ORBIS_DATA_DIR (../shared/data), and SYSROOT,
# which bench/board/sysroot.sh creates. The first run takes ten minutes, most of it for one compiler run with 4 GB.
# Results are stored in build/board.
set -euo pipefail
usage() {
  sed -n '4,12s/^# \{0,1\}//p' "$here/run.sh" >&2
  printf 'run.sh: %s\n' "$1" >&2
  exit 1
}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
[[ $# -ge 1 ]] || usage "SYSROOT is missing"
[[ -d $1/usr/include/octomap ]] || usage "$1 has no usr/include/octomap: bench/board/sysroot.sh makes a SYSROOT"
root=$(cd "$1" && pwd)
data=${ORBIS_DATA_DIR:-$here/../../../shared/data}
for recording in kitchen livingroom; do
  [[ -d $data/$recording ]] || usage "no recording $data/$recording (ORBIS_DATA_DIR)"
done
data=$(cd "$data" && pwd)
for tool in "${CC:-gcc}" "${AARCH64_CXX:-aarch64-linux-gnu-g++}" qemu-aarch64 python3; do
  command -v "$tool" >/dev/null || usage "$tool is not here"
done
cd "$here/../.."
frames=${2:-120}
out=build/board
mkdir -p "$out/include"

lib=$root/usr/lib/aarch64-linux-gnu
for library in eigen3/Eigen eigen3/unsupported tl toml++; do
  ln -sfn "/usr/include/$library" "$out/include/${library##*/}"
done
flags=(-std=c++20 -O3 -DNDEBUG -ffp-contract=off -w -Wno-psabi -Iinclude -MMD -isystem "$root/usr/include"
  -isystem "$root/usr/include/aarch64-linux-gnu" -isystem "$root/usr/include/opencv4" -isystem "$out/include")

. bench/board/programs.sh
build() {
  outdated "$out/$1" || return 0
  echo "compiling $1" >&2
  "${AARCH64_CXX:-aarch64-linux-gnu-g++}" "${flags[@]}" -MF "$out/$1.d" -o "$out/$1" "bench/board/$1.cpp" -L"$lib" \
    "${@:2}" -lpng16 -ljpeg -lz -Wl,--allow-shlib-undefined
}
build_plugin "$out/libcount.so"
build features -lopencv_features2d -lopencv_core
build octree -loctomap -loctomath
build slam

libraries=$lib:$root/lib/aarch64-linux-gnu:$lib/blas:$lib/lapack
count() {  # name of the counts, program and its arguments
  echo "counting $*" >&2
  qemu-aarch64 -cpu cortex-a72 -L "${AARCH64_ROOT:-/usr/aarch64-linux-gnu}" -E "LD_LIBRARY_PATH=$libraries" \
    -plugin "./$out/libcount.so,out=$out/$1.tsv" "$out/$2" "${@:3}" >&2
}
count features_1000 features "$data/kitchen" 8 1000 8
count features_600 features "$data/kitchen" 8 600 6
count octree_5cm octree "$data/kitchen" 6 0.05
count octree_10cm octree "$data/kitchen" 6 0.1
for profile in default small; do
  for recording in kitchen livingroom; do
    count "slam_${recording}_$profile" slam "$data/$recording" 0 "$frames" "$profile"
  done
done
python3 bench/board/table.py "$out"/features_*.tsv "$out"/octree_*.tsv
python3 bench/board/table.py --stages "$out"/slam_*.tsv
