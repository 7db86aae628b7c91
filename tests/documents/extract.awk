# SPDX-License-Identifier: BSD-3-Clause
# Writes the ```cpp blocks of a Markdown file, each a whole program, to <directory>/<name>.cpp as one source whose `main`
# runs the program of the number it is given: each program stands in a namespace of its own, below all their includes. A
# program that specialises something of another namespace cannot stand in one, nor can one whose `main` has arguments; it
# becomes <directory>/<name>_<n>.cpp.
# Usage: awk -v directory=D -v name=N -f extract.awk FILE.md
/^```cpp$/ { inside = 1; ++n; includes = body = ""; alone = 0; next }
/^```$/ && inside {
  inside = 0
  if (alone) {
    print includes body > (directory "/" name "_" n ".cpp")
  } else {
    all_includes = all_includes includes
    bodies = bodies "namespace program_" n " {\n" body "}\n"
    cases = cases "    case " n ": return program_" n "::main();\n"
  }
  next
}
inside && /^#include/ { includes = includes $0 "\n"; next }
inside {
  if (/^namespace (orbis|std)/ || /^template *<> *$/ || /^(template *<> *)?struct orbis::/ || /^int main\(int/) alone = 1
  body = body "#line " FNR " \"" FILENAME "\"\n" $0 "\n"
}
END {
  if (cases != "")
    print "#include <cstdlib>\n" all_includes bodies "int main(int, char** arguments) {\n  switch (std::atoi(arguments[1])) {\n" cases \
          "    default: return 2;\n  }\n}" > (directory "/" name ".cpp")
}
