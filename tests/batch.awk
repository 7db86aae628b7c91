# SPDX-License-Identifier: BSD-3-Clause
# Puts several test files into one translation unit: all their includes first, then each file in a namespace of its own,
# so that helpers of the same name do not meet. Messages name the files and lines as they are.
# Usage: awk -f batch.awk FILE.cpp... > BATCH.cpp
FNR == 1 {
  if (inside) bodies = bodies "}  // namespace\n"
  bodies = bodies "namespace file_" ++files " {\n"
  inside = 1
  line_known = 0
}
/^#include "/ {  # what stands beside the file is no longer beside the batch
  split($0, quoted, "\"")
  folder = FILENAME
  sub(/[^\/]*$/, "", folder)
  if ((getline line < (folder quoted[2])) >= 0) {
    close(folder quoted[2])
    $0 = "#include \"" folder quoted[2] "\""
  }
}
/^#include / {
  if (!($0 in seen)) includes = includes $0 "\n"
  seen[$0] = 1
  line_known = 0
  next
}
{
  if (!line_known) bodies = bodies "#line " FNR " \"" FILENAME "\"\n"
  line_known = 1
  bodies = bodies $0 "\n"
}
END { printf "%s%s}  // namespace\n", includes, bodies }
