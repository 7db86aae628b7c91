#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# style.sh PROJECT_DIR: rejects the words that docs/style.md names as the worst, in headers, examples and documents.
set -euo pipefail
cd "$1"
status=0
reject() {  # what is wrong, pattern
  local found
  found=$(grep -rniE "$2" include examples docs README.md CONTRIBUTING.md \
    --include='*.hpp' --include='*.cpp' --include='*.md' --include='*.html' --exclude=style.md) || return 0
  printf '%s\n%s\n' "$1:" "$found"
  status=1
}
reject "words that docs/style.md rejects" '\b(so many|afresh|want of|told|is to be|are to be|seen to|what it tells)\b'
briefs=$(find include examples -name '*.[ch]pp' -print0 | xargs -0 awk '
  { line = tolower($0); is_doc = line ~ /^ *\/\/\/ / }
  (is_doc && !in_doc && line ~ /^ *\/\/\/ (what|whether|who|which)[^a-z]/) || line ~ /\/\/\/< (what|whether|who|which)[^a-z]/ {
    print FILENAME ":" FNR ":" $0
  }
  { in_doc = is_doc }')
if [[ -n $briefs ]]; then
  printf '%s\n%s\n' "briefs that begin with a question:" "$briefs"
  status=1
fi
exit $status
