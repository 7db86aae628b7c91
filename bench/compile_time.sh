#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Compile time of the library: each umbrella header alone, and typical programs header-only and with orbis::compiled.
# Prints processor seconds (the minimum of the runs, as disturbances only add time), peak memory of the compiler, and the
# number of lines after preprocessing; then the slowest translation units of the existing builds, from their .ninja_log.
# usage: [CXX=g++] [CXXFLAGS=-O2] [RUNS=3] compile_time.sh [HEADER | FILE.cpp]...
#        HEADER as after #include, e.g. orbis/features.hpp; without arguments: all of the above
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
read -ra command <<< "${CXX:-g++} -std=c++20 ${CXXFLAGS:--O2} -I$root/include"
for package in eigen3 opencv4; do
  flags=$(pkg-config --cflags-only-I "$package" 2> /dev/null) && command+=(${flags//-I/-isystem })
done
runs=${RUNS:-3}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

everything=0
if (($# == 0)); then
  everything=1
  set -- vector Eigen/Core
  while read -r header; do set -- "$@" "orbis/${header##*/}"; done < <(printf '%s\n' "$root"/include/orbis/*.hpp | sort)
fi

# measure SOURCE [OPTION]...: processor seconds (minimum of the runs) and megabytes.
measure() {
  local run seconds megabytes best=''
  for ((run = 0; run < runs; ++run)); do
    read -r seconds megabytes < <(python3 "$scratch/cost.py" "${command[@]}" "${@:2}" -c "$1" -o "$scratch/out.o") || return 1
    best=$(awk -v s="$seconds" -v b="$best" 'BEGIN { print b == "" || s < b ? s : b }')
  done
  echo "$best $megabytes"
}
cat > "$scratch/cost.py" <<'EOF_COST'
import resource, subprocess, sys
status = subprocess.run(sys.argv[1:], stderr=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(f"{used.ru_utime + used.ru_stime:.2f} {used.ru_maxrss // 1024}" if status == 0 else "")
sys.exit(status)
EOF_COST

failed=0
printf '%-42s %9s %7s %10s\n' "$("${command[0]}" -dumpversion | sed "s/^/${command[0]} /"), ${CXXFLAGS:--O2}" seconds MB lines
row() {  # <name> <source> [option]...
  local cost
  if cost=$(measure "${@:2}"); then
    printf '%-42s %9.2f %7d %10d\n' "$1" $cost "$("${command[@]}" "${@:3}" -E -P "$2" 2> /dev/null | wc -l)"
  else
    printf '%-42s %9s   %s\n' "$1" - "does not compile"
    failed=1
  fi
}
for what in "$@"; do
  source=$scratch/one.cpp
  if [[ $what == *.cpp ]]; then source=$what; else echo "#include <$what>" > "$source"; fi
  row "$what" "$source"
done
((everything)) || exit $failed

cat > "$scratch/octree_from_points.cpp" <<'EOF_PROGRAM'
#include <array>
#include <vector>
#include <orbis/octree.hpp>
int main() {
  std::vector<std::array<float, 3>> points{{1, 2, 3}};
  orbis::octree::occupancy_octree<> map{0.05};
  map.integrate(points, std::array{0.0F, 0.0F, 0.0F}, {.max_range = 5.0});
}
EOF_PROGRAM
cat > "$scratch/octree_from_depth.cpp" <<'EOF_PROGRAM'
#include <orbis/camera.hpp>
#include <orbis/octree.hpp>
int main() {
  const orbis::camera::pinhole camera{320, 240, 260.0, 260.0, 159.5, 119.5};
  const orbis::image<float> depth(320, 240, 2.0F);
  orbis::octree::occupancy_octree<> map{0.05};
  map.integrate(orbis::par, orbis::camera::depth_view{depth}, camera, orbis::se3{}, {.max_range = 5.0});
}
EOF_PROGRAM
cat > "$scratch/automatic_filter.cpp" <<'EOF_PROGRAM'
#include <array>
#include <vector>
#include <orbis/cloud.hpp>
int main() {
  std::vector<std::array<float, 3>> points(100);
  return static_cast<int>(orbis::cloud::filter_automatically(orbis::par, points).inliers.size());
}
EOF_PROGRAM
cat > "$scratch/slam_in_three_lines.cpp" <<'EOF_PROGRAM'
#include <orbis/camera/any.hpp>
#include <orbis/slam.hpp>
int main() {
  orbis::slam::rgbd_system slam{orbis::camera::any_camera{orbis::camera::pinhole{320, 240, 260, 260, 159.5, 119.5}}};
  slam.track(orbis::camera::rgbd_frame{});
  return static_cast<int>(slam.trajectory().size());
}
EOF_PROGRAM
echo
for program in octree_from_points octree_from_depth automatic_filter slam_in_three_lines; do
  row "$program" "$scratch/$program.cpp"
  row "$program, compiled flavour" "$scratch/$program.cpp" -DORBIS_COMPILED
done

for log in "$root"/build/*/.ninja_log; do
  [[ -f $log ]] || continue
  printf '\nslowest of %s (seconds of wall time)\n' "${log#"$root"/}"
  awk '!/^#/ && $4 ~ /\.o$/ { t[$4] = ($2 - $1) / 1000 } END { for (o in t) printf "%9.1f  %s\n", t[o], o }' "$log" | sort -rn | head -10
done
exit $failed
