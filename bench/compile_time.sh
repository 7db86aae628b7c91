#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# What each umbrella header costs whoever includes it: processor time to compile a file of that one line, and the
# lines that the compiler sees. Beside them what they are made of. Sources may be named as well: what a program costs.
# usage: [CXX=g++] [CXXFLAGS=-O2] [RUNS=3] compile_time.sh [HEADER | FILE.cpp]...
#        HEADER as after #include, e.g. orbis/features.hpp
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
read -ra command <<< "${CXX:-g++} -std=c++20 ${CXXFLAGS:--O2} -I$root/include"
for package in eigen3 opencv4; do
  flags=$(pkg-config --cflags-only-I "$package" 2> /dev/null) && command+=(${flags//-I/-isystem })
done
runs=${RUNS:-3}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

if (($# == 0)); then
  set -- vector Eigen/Core
  while read -r header; do set -- "$@" "orbis/${header##*/}"; done < <(printf '%s\n' "$root"/include/orbis/*.hpp | sort)
fi

# Seconds of processor time, the least of the runs: what disturbs only adds.
seconds_of() {
  local TIMEFORMAT='%U %S' best='' user system
  for ((i = 0; i < runs; ++i)); do
    read -r user system < <({ time "${command[@]}" -c "$1" -o "$scratch/out.o" 2> "$scratch/errors"; } 2>&1) || return 1
    [[ -f $scratch/out.o ]] || return 1
    rm "$scratch/out.o"
    best=$(awk -v a="$user" -v b="$system" -v best="$best" 'BEGIN { s = a + b; print best == "" || s < best ? s : best }')
  done
  echo "$best"
}

failed=0
printf '%-34s %9s %12s\n' "$("${command[0]}" -dumpversion | sed "s/^/${command[0]} /"), ${CXXFLAGS:--O2}" 'seconds' 'lines'
for what in "$@"; do
  if [[ $what == *.cpp ]]; then
    source=$what
  else
    source=$scratch/one.cpp
    echo "#include <$what>" > "$source"
  fi
  if seconds=$(seconds_of "$source"); then
    lines=$("${command[@]}" -E -P "$source" 2> /dev/null | wc -l)
    printf '%-34s %9.2f %12d\n' "$what" "$seconds" "$lines"
  else
    printf '%-34s %9s   %s\n' "$what" '-' "$(grep -m1 -E 'error' "$scratch/errors" || echo failed)"
    failed=1
  fi
done
exit $failed
