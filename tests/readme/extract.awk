# SPDX-License-Identifier: BSD-3-Clause
# Writes the n-th ```cpp block of a Markdown file to <directory>/<n>.cpp.
/^```cpp$/ { inside = 1; ++n; file = directory "/" n ".cpp"; next }
/^```$/ && inside { inside = 0; close(file); next }
inside { print > file }
