#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Compiles the library (orbis::compiled), the quick tests (tests/quick.cmake) and the tests of the vector kernels for
# 64-bit ARM, and runs them under qemu-user. The kernel tests are header-only and compare each kernel with plain code bit
# for bit, here with a compiler that contracts products and sums to FMA.
# "all" runs all tests of all components instead of the quick ones, except those that compare with PCL, Open3D, OMPL, FCL
# or Ceres; this takes hours.
#
# usage: tests/aarch64.sh SYSROOT [all] [Catch2 options]
# SYSROOT contains ARM libraries, unpacked by bench/board/sysroot.sh. Needs g++-aarch64-linux-gnu, qemu-user,
# libeigen3-dev, libexpected-dev, libtomlplusplus-dev, libnanoflann-dev and catch2; `./run test-aarch64` installs them.
# Objects are stored in build/aarch64 and rebuilt only after changes.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [[ -z ${1:-} || ! -e $1/complete ]]; then
  sed -n '10,13s/^# \{0,1\}//p' "$here/tests/aarch64.sh" >&2
  exit 1
fi
root=$(cd "$1" && pwd)
shift
tier=quick
if [[ ${1:-} == all ]]; then
  tier=all
  shift
fi
data=${ORBIS_DATA_DIR:-$here/../shared/data}
data=$(cd "$data" 2>/dev/null && pwd || echo none)
export ORBIS_DATA_DIR=$data  # the tests run in another folder
cd "$here"

compiler=${AARCH64_CXX:-aarch64-linux-gnu-g++}
jobs=${JOBS:-$(nproc)}
out=build/aarch64
mkdir -p "$out/include" "$out/batches"

# Header-only libraries of this machine; the rest of /usr/include is for another architecture.
for library in eigen3/Eigen eigen3/unsupported tl toml++ catch2 nanoflann.hpp; do
  [[ -e /usr/include/$library ]] && ln -sfn "/usr/include/$library" "$out/include/${library##*/}"
done
if [[ ! -e $out/include/catch2/catch.hpp ]]; then
  echo "tests/aarch64.sh: needs the headers of Catch2 2 (catch2/catch.hpp)" >&2
  exit 1
fi
lib=$root/usr/lib/aarch64-linux-gnu
flags=(-std=c++20 -O1 -w -Wno-psabi -Iinclude -Itests -Iexamples -isystem "$out/include" -isystem "$root/usr/include"
  -isystem "$root/usr/include/aarch64-linux-gnu" -isystem "$root/usr/include/opencv4" "-DORBIS_DATA_DIR=\"$data\"")
compiled=(-ffp-contract=off -DORBIS_COMPILED)

makefile=$out/Makefile
rules=$makefile.rules
objects=()
programs=()
: >"$rules"
keep() {  # file: writes stdin to the file; keeps the modification time if the contents are the same
  cat >"$1.new"
  if cmp -s "$1.new" "$1"; then rm "$1.new"; else mv "$1.new" "$1"; fi
}
compile() {  # object, source, options...: writes a rule
  objects+=("$1")
  printf '%s: %s %s\n\t@echo "  %s"\n\t@%s %s -MMD -MP -c -o $@ $<\n' "$1" "$2" "$out/flags" "$2" "$compiler" \
    "$(printf '%q ' "${flags[@]}" "${@:3}")" >>"$rules"
}
program() {  # name, object...: writes a rule; a change of the list of objects also triggers it
  programs+=("$out/$1")
  printf '%s\n' "${@:2}" | keep "$out/$1.list"
  printf '%s: %s %s\n\t@%s -o $@ $(filter %%.o %%.a,$^) -L%q %s\n' "$out/$1" "${*:2}" "$out/$1.list" "$compiler" "$lib" \
    "-lopencv_calib3d -lopencv_features2d -lopencv_imgproc -lopencv_core -loctomap -loctomath -lpng16 -ljpeg -lz \
-Wl,--allow-shlib-undefined" >>"$rules"
}
printf '%s\n' "$compiler" "${flags[@]}" "${compiled[@]}" | keep "$out/flags"

# Components that count allocations have a file allocations.cpp; the kernel tests have it here.
printf '#define CATCH_CONFIG_MAIN\n#include <catch2/catch.hpp>\n' | keep "$out/main.cpp"
printf '#include "support/count_allocations.hpp"\n' | keep "$out/counting.cpp"
compile "$out/main.o" "$out/main.cpp"
compile "$out/counting.o" "$out/counting.cpp"

# The library.
archive=()
for source in cmake/compiled/*.cpp; do
  object=$out/${source//\//_}.o
  compile "$object" "$source" "${compiled[@]}"
  archive+=("$object")
done
printf '%s\n' "${archive[@]}" | keep "$out/liborbis.list"
printf '%s: %s %s\n\t@rm -f $@ && %s rcs $@ $(filter %%.o,$^)\n' "$out/liborbis.a" "${archive[*]}" "$out/liborbis.list" \
  "${AARCH64_AR:-aarch64-linux-gnu-ar}" >>"$rules"

# The folders of the kernel tests.
places=(tests/core/simd.cpp tests/core/simd tests/core/rounded.cpp tests/core/bytes.cpp tests/camera/project_lanes.cpp
  tests/camera/shutter_correction.cpp
  tests/features/detail tests/features/grey_luma_row.cpp tests/places/detail tests/places/vocabulary_descent.cpp
  tests/cloud/detail/knn tests/cloud/detail/rays tests/cloud/detail/voxels
  tests/cloud/cluster_visit_near.cpp tests/cloud/depth_smoothing.cpp tests/cloud/detail/select/local_shape.cpp tests/optimize/pnp.cpp
  tests/optimize/detail/bundle tests/optimize/detail/sparse tests/optimize/detail/pose
  tests/optimize/pose_refinement_pose_pieces.cpp
  tests/optimize/bundle_instances*.cpp  # shared by the tests of bundle adjustment
  tests/octree/detail/storage tests/octree/detail/mark tests/nav/detail/floor
  tests/nav/squared_distances.cpp)
mapfile -t kernels < <(for place in "${places[@]}"; do if [[ -e $place ]]; then find "$place" -name '*.cpp'; fi; done | sort)
parts=()
for source in "${kernels[@]}"; do
  compile "$out/${source//\//_}.o" "$source"
  parts+=("$out/${source//\//_}.o")
done
program kernels "${parts[@]}" "$out/counting.o" "$out/main.o"

# The other tests, one program per component.
if [[ $tier == quick ]]; then
  mapfile -t sources < <(grep -v '^ *#' tests/quick.cmake | grep -oE '[a-z0-9_]+/[a-z0-9_/]+\.cpp')
else
  mapfile -t sources < <(cd tests && find core camera features places optimize cloud octree slam mapping nav eval io \
    interop -name '*.cpp' | sort | grep -vxFf <(printf '%s\n' "${kernels[@]#tests/}" | grep -v bundle_instances))
fi
if ((${#sources[@]} == 0)); then
  echo "tests/aarch64.sh: no tests found" >&2
  exit 1
fi
for component in $(printf '%s\n' "${sources[@]%%/*}" | sort -u); do
  parts=()
  if [[ $tier == all && $component == io ]]; then  # synthetic worlds that several components use
    for source in tests/support/synthetic/*.cpp; do
      compile "$out/${source//\//_}.o" "$source" "${compiled[@]}"
      parts+=("$out/${source//\//_}.o")
    done
  fi
  files=()
  bytes=0
  number=0
  for source in "${sources[@]}" -; do
    if [[ $source == "$component"/* ]]; then
      source=tests/$source
      # Sources that cannot be in a namespace, or depend on macros, are compiled separately (as in batches.cmake).
      if grep -qE '^(namespace [a-z_:]+ *\{|template *<>|struct [a-z_]+::|# *define|#ifdef|# *if defined|int main)' "$source"; then
        compile "$out/${source//\//_}.compiled.o" "$source" "${compiled[@]}"
        parts+=("$out/${source//\//_}.compiled.o")
        continue
      fi
      files+=("$here/$source")  # absolute, for the folder of the batch
      bytes=$((bytes + $(wc -c <"$source")))
    fi
    if ((${#files[@]})) && { ((bytes > 25000)) || [[ $source == - ]]; }; then
      number=$((number + 1))
      awk -f tests/batch.awk "${files[@]}" | keep "$out/batches/${tier}_${component}_$number.cpp"
      compile "$out/${tier}_${component}_$number.o" "$out/batches/${tier}_${component}_$number.cpp" "${compiled[@]}"
      parts+=("$out/${tier}_${component}_$number.o")
      files=()
      bytes=0
    fi
  done
  program "${tier}_$component" "${parts[@]}" "$out/main.o" "$out/liborbis.a"
done

{
  printf 'all: %s\n' "${programs[*]}"
  cat "$rules"
  printf -- '-include %s\n' "${objects[*]/%.o/.d}"
} >"$makefile"
make -f "$makefile" -j "$jobs" --no-print-directory

# Runs one program per core at a time; prints the output of each at its end.
export QEMU_LD_PREFIX=${AARCH64_ROOT:-/usr/aarch64-linux-gnu}
export QEMU_SET_ENV=LD_LIBRARY_PATH=$lib:$root/lib/aarch64-linux-gnu:$lib/blas:$lib/lapack
run() {  # program, Catch2 options...; 0 or 1, as xargs ends at 255
  local status=0
  qemu-aarch64 "$1" "${@:2}" >"$1.log" 2>&1 || status=$?
  printf '%s: %s\n' "${1##*/}" "$(tail -n 2 "$1.log" | tr '\n' ' ')"
  ((status == 0)) && return
  cat "$1.log"
  return 1
}
export -f run
printf '%s\0' "${programs[@]}" | xargs -0 -P "$jobs" -I '{}' bash -c 'run "$@"' run '{}' "$@"
