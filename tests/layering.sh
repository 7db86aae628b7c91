#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Holds the layers: which component may include which, and who may name a neighbour library.
# usage: layering.sh INCLUDE_DIR
set -euo pipefail
cd "$1/orbis"
bad=0
complain() { echo "$1"; bad=1; }

# component: what it may include besides itself, core and camera
declare -A allowed=(
  [core]="" [camera]="" [features]="" [places]="" [optimize]="" [cloud]="" [octree]="" [io]=""
  [eval]="" [nav]="octree"
  [interop]="features cloud octree"
  [slam]="features places optimize cloud octree io interop"
  [mapping]="features places optimize cloud octree io interop"
)

while IFS=: read -r file line text; do
  component=${file%%/*}
  included=$(sed -E 's/.*<orbis\/([^>]+)>.*/\1/' <<<"$text")
  target=${included%%/*}
  target=${target%.hpp}
  [[ $target == "$component" ]] && continue
  if [[ $component == core ]]; then
    complain "$file:$line: core includes $included"
  elif [[ $component == camera ]]; then
    [[ $target == core ]] || complain "$file:$line: camera includes $included"
  elif [[ $target != core && $target != camera ]]; then
    [[ " ${allowed[$component]-} " == *" $target "* ]] || complain "$file:$line: $component includes $included"
  fi
  [[ -n ${allowed[$component]+known} ]] || complain "$file:$line: $component is in no layer"
done <<<"$(grep -rnE '^ *# *include *<orbis/' --include='*.hpp' . | sed 's|^\./||' | grep '/.*:.*:')"

# A neighbour's name, and the only files that may include it.
only() {
  local pattern=$1 where=$2 hit
  while IFS= read -r hit; do
    hit=${hit#./}
    [[ -z $hit || ${hit%%:*} =~ $where ]] || complain "$hit: only $where may include this"
  done <<<"$(grep -rnE "^ *# *include *[<\"]($pattern)" --include='*.hpp' . || true)"
}
only 'nanoflann' '^cloud/nanoflann\.hpp$'
only 'octomap/' '^interop/octomap\.hpp$'
only 'opencv2/' '^interop/opencv\.hpp$'
only 'pcl/' '^interop/pcl\.hpp$'
only 'open3d/' '^interop/open3d\.hpp$'
while IFS= read -r hit; do
  [[ -z $hit ]] || complain "${hit#./}: include the parts that are needed instead"
done <<<"$(grep -rnE 'include *<opencv2/opencv\.hpp>' --include='*.hpp' . || true)"

# A header names a component's own macros only with our prefix.
while IFS= read -r hit; do
  [[ -z $hit ]] || complain "${hit#./}: a macro without the ORBIS_ prefix"
done <<<"$(grep -rnE '^ *# *define +' --include='*.hpp' . | grep -vE '# *define +ORBIS_' || true)"

((bad == 0)) && echo "layers hold"
exit $bad
