# SPDX-License-Identifier: BSD-3-Clause
#
# Functions of run.sh and lanes.sh for building programs; source this file.

# True if a program is older than one of its sources, which the compiler lists in PROGRAM.d (-MMD -MF PROGRAM.d).
outdated() {  # program
  [[ -e $1 && -e $1.d ]] || return 0
  local source
  for source in $(sed -e 's/^[^:]*://' -e 's/\\$//' "$1.d"); do [[ $source -nt $1 ]] && return 0; done
  return 1
}

build_plugin() {  # output file
  "${CC:-gcc}" -O2 -Wall -Wextra -fPIC -shared -fvisibility=hidden -o "$1" bench/board/count.c
}
