# SPDX-License-Identifier: BSD-3-Clause
#
# What run.sh and lanes.sh share of making programs; to be sourced.

# Whether a program is older than what it was made of, as the compiler has listed it beside it (-MMD -MF PROGRAM.d).
outdated() {  # program
  [[ -e $1 && -e $1.d ]] || return 0
  local source
  for source in $(sed -e 's/^[^:]*://' -e 's/\\$//' "$1.d"); do [[ $source -nt $1 ]] && return 0; done
  return 1
}

build_plugin() {  # where it goes
  "${CC:-gcc}" -O2 -Wall -Wextra -fPIC -shared -fvisibility=hidden -o "$1" bench/board/count.c
}
