#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes include/orbis/places/detail/default_vocabulary.inc, the text of data/default_vocabulary.bin.

usage: default_vocabulary.py [--check]   (--check only verifies the existing text)

Four bytes become five characters in base 85, most significant digit first: the characters from '#' on, except the two with
a special meaning in literals. orbis::append_base85 reads them.
"""
import pathlib
import sys

CHARACTERS = [chr(ord("#") + digit).replace("\\", "x").replace("?", "y") for digit in range(85)]
LITERAL = 64400  # characters; compilers must support literals of 65536

root = pathlib.Path(__file__).resolve().parent.parent
binary = (root / "cmake/data/default_vocabulary.bin").read_bytes()
include = root / "include/orbis/places/detail/default_vocabulary.inc"

padded = binary + bytes(-len(binary) % 4)
text = "".join(CHARACTERS[int.from_bytes(padded[at:at + 4], "big") // 85**place % 85]
               for at in range(0, len(padded), 4) for place in (4, 3, 2, 1, 0))
literals = [f'"{text[at:at + LITERAL]}"' for at in range(0, len(text), LITERAL)]
# Pointers, not views: the compiler would have to count the characters.
made = ("// SPDX-License-Identifier: BSD-3-Clause\n"
        "// Made by cmake/default_vocabulary.py from cmake/data/default_vocabulary.bin.\n"
        f"inline constexpr std::size_t default_vocabulary_size = {len(binary)};\n"
        f"inline constexpr std::array<const char*, {len(literals)}> default_vocabulary_text{{{{\n"
        + ",\n".join(literals) + "}};\n").encode()

if sys.argv[1:] == ["--check"]:
    if not include.is_file() or include.read_bytes() != made:
        sys.exit(f"{include} is not what cmake/default_vocabulary.py makes: run it")
elif len(sys.argv) == 1:
    include.write_bytes(made)
else:
    sys.exit("usage: default_vocabulary.py [--check]")
