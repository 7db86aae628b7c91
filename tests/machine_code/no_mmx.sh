#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Fails where a program or library uses an MMX register and names the functions that do. These registers are those of the
# x87 unit, which gives NaN after them; g++ 12 takes them for some vectors of eight bytes that it goes through lane by lane.
# usage: no_mmx.sh FILE...
set -u
if ! command -v objdump >/dev/null; then
  echo "[skipped] no objdump (binutils), which shows the machine code"
  exit 0
fi
bad=0
for file in "$@"; do
  read -r uses status < <(
    objdump -d --no-show-raw-insn "$file" | grep -c '%mm[0-7]' | tr '\n' ' '
    echo "${PIPESTATUS[0]}"
  )
  if [[ $status != 0 ]]; then
    echo "$file: objdump cannot read it"
    bad=1
  elif [[ $uses != 0 ]]; then
    echo "$file: MMX registers in"
    objdump -d --no-show-raw-insn -C "$file" |
      awk '/^[0-9a-f]+ <.*>:$/ { name = $0 } /%mm[0-7]/ && name != last { print "  " name; last = name }'
    bad=1
  fi
done
exit $bad
