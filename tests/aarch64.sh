#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# For 64-bit ARM: compiles the library (orbis::compiled, orbis::compiled_io), the quick tests (tests/quick.cmake) and the
# tests of the vector kernels, and runs them under qemu-user. The tests of the kernels are header-only and compare each
# kernel with plain code, bit by bit, here with a compiler that fuses products into sums where it can.
#
# usage: tests/aarch64.sh SYSROOT [Catch2 options]
# SYSROOT holds libraries for ARM, as bench/board/sysroot.sh unpacks them. Needs g++-aarch64-linux-gnu, qemu-user,
# libeigen3-dev, libexpected-dev, libtomlplusplus-dev, libnanoflann-dev and catch2, as `./run test-aarch64` installs them.
# Objects are kept in build/aarch64 and made again only where something has changed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[[ -d ${1:-}/usr/include/octomap ]] || { sed -n '8,11s/^# \{0,1\}//p' tests/aarch64.sh >&2; exit 1; }
root=$(cd "$1" && pwd)
shift

compiler=${AARCH64_CXX:-aarch64-linux-gnu-g++}
jobs=${JOBS:-$(nproc)}
out=build/aarch64
mkdir -p "$out/include" "$out/batches"

# Header-only libraries of this machine; the rest of /usr/include is for another processor.
for library in eigen3/Eigen eigen3/unsupported tl toml++ catch2 nanoflann.hpp; do
  [[ -e /usr/include/$library ]] && ln -sfn "/usr/include/$library" "$out/include/${library##*/}"
done
if [[ ! -e $out/include/catch2/catch.hpp ]]; then
  echo "tests/aarch64.sh: wants Catch2 2 (catch2/catch.hpp), of which only headers are needed" >&2
  exit 1
fi
data=${ORBIS_DATA_DIR:-$PWD/../shared/data}
lib=$root/usr/lib/aarch64-linux-gnu
flags=(-std=c++20 -O1 -w -Wno-psabi -Iinclude -Itests -isystem "$out/include" -isystem "$root/usr/include"
  -isystem "$root/usr/include/aarch64-linux-gnu" -isystem "$root/usr/include/opencv4" "-DORBIS_DATA_DIR=\"$data\"")
compiled=(-ffp-contract=off -DORBIS_COMPILED -DORBIS_COMPILED_IO)

makefile=$out/Makefile
objects=()
programs=()
: >"$makefile.rules"
compile() {  # object, source, options...: a rule
  objects+=("$1")
  printf '%s: %s\n\t@echo "  %s"\n\t@%s %s -MMD -MP -c -o $@ $<\n' "$1" "$2" "$2" "$compiler" \
    "$(printf '%q ' "${flags[@]}" "${@:3}")" >>"$makefile.rules"
}
batch() {  # name, file...: puts the files into one translation unit, if that is not made of them already
  local unit=$out/batches/$1.cpp
  awk -f tests/batch.awk "${@:2}" >"$unit.new"
  if cmp -s "$unit.new" "$unit"; then rm "$unit.new"; else mv "$unit.new" "$unit"; fi
}
program() {  # name, object...: a rule
  programs+=("$out/$1")
  printf '%s: %s\n\t@%s -o $@ $^ -L%s -lopencv_calib3d -lopencv_features2d -lopencv_imgproc -lopencv_core -loctomap %s\n' \
    "$out/$1" "${*:2}" "$compiler" "$lib" "-loctomath -lpng16 -ljpeg -lz -Wl,--allow-shlib-undefined" >>"$makefile.rules"
}

printf '#define CATCH_CONFIG_MAIN\n#include <catch2/catch.hpp>\n\n#include "support/count_allocations.hpp"\n' >"$out/main.cpp.new"
if cmp -s "$out/main.cpp.new" "$out/main.cpp"; then rm "$out/main.cpp.new"; else mv "$out/main.cpp.new" "$out/main.cpp"; fi
compile "$out/main.o" "$out/main.cpp"

# The library.
archive=()
for source in cmake/compiled/*.cpp cmake/compiled_io/*.cpp; do
  object=$out/${source//\//_}.o
  compile "$object" "$source" "${compiled[@]}"
  archive+=("$object")
done
printf '%s: %s\n\t@rm -f $@ && %s rcs $@ $^\n' "$out/liborbis.a" "${archive[*]}" "${AARCH64_AR:-aarch64-linux-gnu-ar}" \
  >>"$makefile.rules"

# The quick tests, a program for each component.
mapfile -t quick < <(grep -oE '[a-z_]+/[a-z_/]+\.cpp' tests/quick.cmake | grep -v '/allocations\.cpp$')
for component in $(printf '%s\n' "${quick[@]%%/*}" | sort -u); do
  parts=()
  files=()
  bytes=0
  number=0
  for source in "${quick[@]}" -; do
    if [[ $source == "$component"/* ]]; then
      source=tests/$source
      # What cannot stand in a namespace, or is switched by the preprocessor, is compiled alone (as in batches.cmake).
      if grep -qE '^(namespace [a-z_:]+ *\{|template *<>|struct [a-z_]+::|# *define|#ifdef|# *if defined|int main)' "$source"; then
        compile "$out/${source//\//_}.quick.o" "$source" "${compiled[@]}"
        parts+=("$out/${source//\//_}.quick.o")
        continue
      fi
      files+=("$PWD/$source")  # found from the folder of the batch, too
      bytes=$((bytes + $(wc -c <"$source")))
    fi
    if ((${#files[@]})) && { ((bytes > 25000)) || [[ $source == - ]]; }; then
      number=$((number + 1))
      batch "${component}_$number" "${files[@]}"
      compile "$out/${component}_$number.o" "$out/batches/${component}_$number.cpp" "${compiled[@]}"
      parts+=("$out/${component}_$number.o")
      files=()
      bytes=0
    fi
  done
  program "test_$component" "${parts[@]}" "$out/main.o" "$out/liborbis.a"
done

# Where the kernels' tests stand; those that compare with a library that is not here are left out.
places=(tests/core/simd.cpp tests/core/simd tests/core/rounded.cpp tests/core/bytes.cpp tests/camera/project_lanes.cpp
  tests/camera/shutter_correction.cpp
  tests/features/detail tests/places/detail tests/cloud/detail/knn tests/cloud/detail/rays
  tests/cloud/detail/select/local_shape.cpp tests/optimize/pnp.cpp
  tests/optimize/detail/bundle tests/optimize/detail/sparse tests/optimize/detail/pose
  tests/optimize/bundle_instances*.cpp  # what those of bundle adjustment share
  tests/octree/detail/storage tests/octree/detail/points tests/octree/detail/depth tests/nav/detail/floor
  tests/nav/squared_distances.cpp)
parts=()
while read -r source; do
  grep -qE 'opencv|octomap|orbis/io|interop' "$source" && continue
  compile "$out/${source//\//_}.o" "$source"
  parts+=("$out/${source//\//_}.o")
done < <(for place in "${places[@]}"; do if [[ -e $place ]]; then find "$place" -name '*.cpp'; fi; done | sort)
program test_kernels "${parts[@]}" "$out/main.o"

{
  printf 'all: %s\n' "${programs[*]}"
  cat "$makefile.rules"
  printf -- '-include %s\n' "${objects[*]/%.o/.d}"
} >"$makefile"
make -f "$makefile" -j "$jobs" --no-print-directory

# As many at a time as there are processors; what each says is kept until it has ended.
export QEMU_LD_PREFIX=${AARCH64_ROOT:-/usr/aarch64-linux-gnu}
export QEMU_SET_ENV=LD_LIBRARY_PATH=$lib:$root/lib/aarch64-linux-gnu:$lib/blas:$lib/lapack
run() {  # program, Catch2 options...
  local status=0
  qemu-aarch64 "$1" "${@:2}" >"$1.log" 2>&1 || status=$?
  printf '%s: %s\n' "${1##*/}" "$(tail -n 2 "$1.log" | tr '\n' ' ')"
  ((status == 0)) || cat "$1.log"
  return "$status"
}
export -f run
printf '%s\0' "${programs[@]}" | xargs -0 -P "$jobs" -I '{}' bash -c 'run "$@"' run '{}' "$@"
