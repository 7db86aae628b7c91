#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the hand-made inputs of the fuzz targets into corpus/: make_corpus.py

Valid files, files cut short, files that declare more than they hold, and files made to hurt. What the
fuzzers found besides is kept there as found_*.
"""
import pathlib
import random
import struct

here = pathlib.Path(__file__).parent / "corpus"
FREE, OCCUPIED = 1, 2


def header(kind, size, resolution="0.05", more=""):
    first = "# Octomap OcTree binary file" if kind == "bt" else "# Octomap OcTree file"
    return (f"{first}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
            f"id OcTree\nsize {size}\nres {resolution}\n{more}data\n").encode()


# A tree is None, a leaf's value, or a list of eight trees.
def nodes(tree):
    if tree is None:
        return 0
    return 1 + sum(map(nodes, tree)) if isinstance(tree, list) else 1


def bt(tree):
    code = lambda c: 0 if c is None else 3 if isinstance(c, list) else OCCUPIED if c >= 0 else FREE
    bits = sum(code(c) << (2 * i) for i, c in enumerate(tree))
    return struct.pack("<H", bits) + b"".join(bt(c) for c in tree if isinstance(c, list))


def ot(tree):
    if not isinstance(tree, list):
        return struct.pack("<fB", tree, 0)
    mask = sum((c is not None) << i for i, c in enumerate(tree))
    return struct.pack("<fB", 0.0, mask) + b"".join(ot(c) for c in tree if c is not None)


def random_tree(rng, depth, values):
    """Narrow at the top, bushy in the last four levels, as maps are."""
    if depth == 16:
        return rng.choice(values)
    children = []
    path = rng.randrange(8)
    for i in range(8):
        if depth < 12:
            children.append(random_tree(rng, depth + 1, values) if i == path else None)
        else:
            kind = rng.random()
            deeper = kind < (0.9 if depth == 15 else 0.4 if depth > 12 else 0.6)
            children.append(random_tree(rng, depth + 1, values) if deeper
                            else rng.choice(values) if kind < 0.7 else None)
    return children if any(c is not None for c in children) else [values[0]] + [None] * 7


def chain(depth, last):
    """One voxel, or a bigger leaf, at `depth`."""
    return last if depth == 0 else [chain(depth - 1, last)] + [None] * 7


def write(target, name, data):
    (here / target).mkdir(parents=True, exist_ok=True)
    (here / target / name).write_bytes(data)


def readers():
    rng = random.Random(1)
    for kind, encode in (("bt", bt), ("ot", ot)):
        target = "read_" + kind
        values = [-2.0, 3.5] if kind == "bt" else [-2.0000279, -0.405465, 0.0, -0.0, 0.847298, 3.511031]
        file = lambda tree: header(kind, nodes(tree)) + encode(tree)
        tree = random_tree(rng, 0, values)
        good = file(tree)
        write(target, "room", good)
        write(target, "empty_map", header(kind, 0))
        write(target, "voxel", file(chain(16, 0.85)))
        write(target, "large_leaf", file(chain(2, -2.0)))
        write(target, "eight_equal_leaves", file([0.85] * 8))
        write(target, "all_inner_equal", file([[0.85] * 8] * 8))
        write(target, "crlf", good.replace(b"\n", b"\r\n", 7))
        write(target, "truncated_in_header", good[:90])
        write(target, "truncated_in_data", good[:-7])
        write(target, "surplus", good + b"surplus")
        write(target, "declares_more", header(kind, nodes(tree) + 1) + encode(tree))
        write(target, "declares_less", header(kind, nodes(tree) - 1) + encode(tree))
        write(target, "declares_huge", header(kind, 2**64 - 1) + encode(tree))
        write(target, "declares_too_huge", header(kind, 2**64) + encode(tree))
        write(target, "other_tree", good.replace(b"id OcTree", b"id ColorOcTree"))
        write(target, "other_kind", header("ot" if kind == "bt" else "bt", nodes(tree)) + encode(tree))
        write(target, "tiny_resolution", header(kind, nodes(tree), "1e-300") + encode(tree))
        write(target, "huge_resolution", header(kind, nodes(tree), "1e308") + encode(tree))
        write(target, "long_words", header(kind, 1, more="word" * 200 + "\n"))
        write(target, "deeper_than_deep", header(kind, 40) + encode(chain(40, 0.85)))
        # The most memory for the fewest bytes: bricks whose octants all hold a little.
        octant = [-2.0] + [None] * 7
        brick = [octant] * 8
        bricks = chain(11, [[brick] * 8] * 8)
        write(target, "many_octants", file(bricks))
        write(target, "many_bricks", file(chain(10, [[[[-2.0] + [None] * 7] * 8] * 8] * 8)))
        write(target, "many_large_leaves", file([[[v, None] * 4 for v in values[:2]] * 4] * 8))
    write("read_bt", "no_children", header("bt", 1) + b"\0\0")
    write("read_ot", "root_is_leaf", header("ot", 1) + ot(0.85))
    write("read_ot", "nan", header("ot", 2) + ot([float("nan")] + [None] * 7))
    write("read_ot", "infinite", header("ot", 2) + ot([float("inf")] + [None] * 7))
    write("read_ot", "tiny_values", header("ot", 3) + ot([1e-45, -1e-45] + [None] * 6))


def scans():
    """See integrate.cpp for the layout."""
    rng = random.Random(2)
    near = lambda: bytes(rng.randrange(256) for _ in range(3))
    wild = lambda *v: struct.pack(">fff", *v)

    def swap(b):  # the target takes the bytes of a float in the order 1, 0, 2, 3
        return b"".join(bytes((b[i + 1], b[i], b[i + 2], b[i + 3])) for i in range(0, len(b), 4))

    def scan(flags, points, origin=b"\0\0\0"):
        return bytes([flags]) + origin + bytes([len(points)]) + b"".join(points)

    for i in range(8):  # all resolutions, modes and ranges
        write("integrate", f"near_{i}", bytes([i]) + b"".join(
            scan(i, [near() for _ in range(40)], near()) for _ in range(3)))
    faces = [bytes([8 * x % 256, 8 * y % 256, 8 * z % 256]) for x in (-3, 0, 3) for y in (-3, 0, 3) for z in (-3, 0, 3)]
    for mode in (0, 1):
        write("integrate", f"faces_{mode}", bytes([0]) + scan(mode, faces) + scan(mode, faces, bytes([4, 4, 4])))
        write("integrate", f"same_again_{mode}", bytes([1]) + 4 * scan(mode, faces))
        write("integrate", f"zero_range_{mode}", bytes([1]) + scan(mode | 2, faces))
        inf, nan = float("inf"), float("nan")
        strange = [b"\0" + swap(wild(*v)) for v in ((nan, 0, 0), (inf, -inf, 0), (1e30, 0, 0), (0, -1e6, 1e-45))]
        calm = [b"\1" + p for p in faces[:8]]
        for range_ in (0, 4, 6):
            write("integrate", f"strange_{mode}_{range_}", bytes([0]) + scan(mode | range_ | 8, strange + calm))
        far = [b"\0" + swap(wild(*v)) for v in ((1600, -1600, 1600), (-1638.4, 3, 4), (1638.35, 0, 0), (1638.4, 0, 0))]
        write("integrate", f"far_{mode}", bytes([0]) + scan(mode | 8, far + calm))
        write("integrate", f"corner_{mode}", bytes([0]) + scan(mode | 32, faces, near()))
        write("integrate", f"no_origin_{mode}", bytes([0]) + scan(mode | 24, calm, swap(wild(nan, 0, 0))))
        write("integrate", f"far_origin_{mode}", bytes([0]) + scan(mode | 24, calm, swap(wild(5e3, 0, 0))))


if __name__ == "__main__":
    readers()
    scans()
