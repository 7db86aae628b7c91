#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Checks the layers: the includes between components, of a component's detail/, and of optional libraries.
# usage: layering.sh PROJECT_DIR
set -euo pipefail
cd "$1/include/orbis"
bad=0
complain() { echo "$1"; bad=1; }

# component: components that it may include in addition to itself, core and camera
declare -A allowed=(
  [core]="" [camera]="" [features]="" [places]="" [optimize]="" [cloud]="" [octree]="" [io]=""
  [eval]="" [nav]="octree"
  [interop]="features cloud octree nav"
  [slam]="features places optimize"
  [mapping]="cloud octree"
)

while IFS=: read -r file line text; do
  component=${file%%/*}
  [[ $text =~ \<orbis/([^\>]+)\> ]] || continue
  included=${BASH_REMATCH[1]}
  target=${included%%/*}
  target=${target%.hpp}
  [[ $target == "$component" ]] && continue
  # An -inl header makes programs that link orbis::compiled compile code that the library already contains.
  [[ $included == *-inl.hpp && $file =~ /detail/|-inl\.hpp$ ]] &&
    complain "$file:$line: includes the implementation $included instead of its declaration"
  if [[ $component == core ]]; then
    complain "$file:$line: core includes $included"
  elif [[ $component == camera ]]; then
    [[ $target == core ]] || complain "$file:$line: camera includes $included"
  elif [[ $target != core && $target != camera ]]; then
    [[ " ${allowed[$component]-} " == *" $target "* ]] || complain "$file:$line: $component includes $included"
  fi
  [[ -n ${allowed[$component]+known} ]] || complain "$file:$line: $component is in no layer"
done <<<"$(grep -rnE '^ *# *include *<orbis/' --include='*.hpp' . | sed 's|^\./||' | grep '/.*:.*:')"

# Folders of octree/detail: each includes only those before it.
order=(storage mark/rays mark/depth mark/windows mark/organised mark)
for ((i = 0; i != ${#order[@]}; ++i)); do
  for ((j = i + 1; j != ${#order[@]}; ++j)); do
    hits=$(grep -nE "^ *# *include *<orbis/octree/detail/${order[j]}/[^/>]*>" "octree/detail/${order[i]}"/*.hpp || true)
    [[ -z $hits ]] || complain "$hits: included by a folder that comes before"
  done
done

# The detail/ of a component is private: no umbrella header, other component, document or example includes it, and no
# document mentions it.
private() {  # <pattern, whose first group is the component> <where>...
  local pattern=$1 hit file component
  while IFS= read -r hit; do
    [[ $hit =~ $pattern ]] || continue
    component=${BASH_REMATCH[1]} file=${hit%%:*}
    [[ $file == include/orbis/$component/* ]] && continue
    complain "$hit: the detail/ of $component is used outside of it"
  done <<<"$(cd ../.. && grep -rnE "$pattern" "${@:2}" 2>/dev/null)"
}
private '# *include *[<"]orbis/([a-z]+)/([a-z]+/)*detail/' include/orbis README.md docs examples
private 'orbis::([a-z]+)::detail' README.md docs

# An optional library, and the only files that may include it.
only() {
  local pattern=$1 where=$2 hit
  while IFS= read -r hit; do
    hit=${hit#./}
    [[ -z $hit || ${hit%%:*} =~ $where ]] || complain "$hit: only $where may include this"
  done <<<"$(grep -rnE "^ *# *include *[<\"]($pattern)" --include='*.hpp' . || true)"
}
only 'nanoflann' '^cloud/nanoflann\.hpp$'
only 'octomap/' '^interop/(octomap|detail/octomap_nodes)\.hpp$'
only 'opencv2/' '^interop/opencv\.hpp$'
only 'pcl/' '^interop/pcl\.hpp$'
only 'open3d/' '^interop/open3d\.hpp$'
only 'ompl/' '^interop/ompl\.hpp$'
only 'fcl/' '^interop/fcl\.hpp$'
while IFS= read -r hit; do
  [[ -z $hit ]] || complain "${hit#./}: include the required headers instead"
done <<<"$(grep -rnE 'include *<opencv2/opencv\.hpp>' --include='*.hpp' . || true)"

# All macros have the prefix ORBIS_.
while IFS= read -r hit; do
  [[ -z $hit ]] || complain "${hit#./}: macro without the prefix ORBIS_"
done <<<"$(grep -rnE '^ *# *define +' --include='*.hpp' . | grep -vE '# *define +ORBIS_' || true)"

((bad == 0)) && echo "layers hold"
exit $bad
