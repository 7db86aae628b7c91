#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# paths.sh PROJECT_DIR: every API header has a test at its path: include/orbis/c/h.hpp has tests/c/h.cpp.
set -euo pipefail
cd "$1/include/orbis"
status=0
for header in */*.hpp; do
  [[ $header == *-inl.hpp || -e ../../tests/${header%.hpp}.cpp ]] && continue
  echo "include/orbis/$header: there is no tests/${header%.hpp}.cpp"
  status=1
done
exit $status
