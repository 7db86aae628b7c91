# SPDX-License-Identifier: BSD-3-Clause
# Whether the compiler's messages refuse a program as it wants: some error, with its context and notes, names the program's
# file and matches the regular expression of the file's first line, `// error: <regular expression>`.
# Usage: awk -v source=PROGRAM.cpp -f check.awk MESSAGES
BEGIN {
  getline first < source
  if (first !~ /^\/\/ error: ./) {
    print source ": the first line must be `// error: <regular expression>`"
    broken = 1
    exit 1
  }
  expected = substr(first, 11)
}
function finish() {
  if (error != "" && index(error, source)) {
    refused = 1
    all = all error
    if (error ~ expected) found = 1
  }
  error = ""
}
# What stands before an error and belongs to it: where it was instantiated and included.
/^In file included from|^ +from |: In (instantiation|substitution|function|member function|static member function|constructor|lambda)|: At global scope|:   (recursively )?required / {
  if (error != "" && error ~ /: error: /) finish()
  error = error $0 "\n"
  next
}
/: (fatal )?error: / {
  if (error ~ /: error: /) finish()
}
{ error = error $0 "\n" }
END {
  if (broken) exit 1
  finish()
  if (!refused) print source " compiles, but must not"
  else if (!found) print source " is refused, but not with \"" expected "\":\n" all
  exit !found
}
