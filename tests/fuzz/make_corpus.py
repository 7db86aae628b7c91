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


SET, EDIT, TRANSFORM, EVICT, SCAN, SUBTRACT, FILE, COPY, CLEAR, TRACK = 0, 3, 5, 6, 7, 8, 11, 12, 13, 14
FORGET_BEFORE, CAPACITY, FOLLOW, TRACK_OFF, TRACK_AGAIN, TRACK_ON = 3, 4, 5, 0, 1, 6
MIN, MISS, HIT, MAX, ZERO, MINUS_ZERO = range(6)


def edits():
    """See edit.cpp for the layout."""
    rng = random.Random(3)
    key = lambda: bytes(rng.randrange(256) for _ in range(3))
    node = lambda level, value, at=b"\0\0\0": bytes([SET, level]) + at + bytes([value])
    edit = lambda kind, value, number, at=b"\0\0\0": bytes([EDIT]) + at + bytes([kind, value, number])
    scan = lambda what, flags, origin, points: (bytes([what, flags]) + origin + bytes([len(points)]) + b"".join(points))
    track = lambda what: bytes([TRACK, what])
    transform = lambda kind, value=ZERO: bytes([TRANSFORM, kind, value])
    some = [key() for _ in range(11)]

    # Nothing known is left of an octant, in a map that had nothing else.
    write("edit", "octant_forgotten", bytes([0]) + edit(0, HIT, 5) + edit(2, HIT, 5) + edit(2, HIT, 7, key()))
    write("edit", "large_leaves", bytes([0]) + node(5, MISS) + edit(2, HIT, 9) + edit(0, MISS, 9) + edit(4, 0, 0, key()))
    write("edit", "minus_zero", bytes([1]) + edit(5, ZERO, 0) + edit(1, MINUS_ZERO, 3) + edit(7, MINUS_ZERO, 1)
          + node(3, MINUS_ZERO, b"\x10\0\0") + transform(4) + transform(3, MINUS_ZERO))
    write("edit", "log_and_clear", bytes([0]) + track(TRACK_ON) + node(2, HIT) + track(FOLLOW) + bytes([CLEAR])
          + track(FOLLOW) + node(2, MISS) + track(FOLLOW) + track(TRACK_OFF) + node(1, HIT, b"\x14\0\0") + track(TRACK_ON))
    write("edit", "log_off_and_on", bytes([1]) + track(TRACK_ON) + track(CAPACITY | 3 << 3)
          + scan(SCAN, 0, key(), some) + track(FOLLOW) + track(TRACK_AGAIN) + edit(2, HIT, 4, some[0]) + track(FOLLOW)
          + track(FORGET_BEFORE) + scan(SCAN, 1, key(), some) + track(FOLLOW) + transform(1, MISS))
    write("edit", "scan_taken_out", bytes([3]) + node(4, MISS, some[0]) + scan(SCAN, 0, some[1], some)
          + scan(SUBTRACT, 0, some[1], some) + scan(SCAN, 1, some[2], some) + scan(SUBTRACT, 1, some[2], some))
    write("edit", "window_rolls", bytes([0]) + b"".join(
        scan(SCAN, 2, k, some) + bytes([EVICT]) + k + bytes([6, i % 2]) for i, k in enumerate(some[:5])))
    write("edit", "palette_overflows", bytes([5]) + track(TRACK_ON) + b"".join(edit(6, HIT, i, some[i]) for i in range(4))
          + edit(5, HIT, 0, some[0]) + edit(6, HIT, 60, some[0]) + edit(3, HIT, 2, some[1]) + track(FOLLOW))
    write("edit", "decay", bytes([4]) + node(4, MISS, some[0]) + scan(SCAN, 0, some[1], some)
          + b"".join(transform(kind, MISS) for kind in (6, 6, 1, 0, 7, 2, 5)))
    for i in range(3):
        write("edit", f"random_{i}", bytes([i]) + bytes(rng.randrange(256) for _ in range(300)))


def depth_images():
    """See integrate_depth.cpp for the layout."""
    rng = random.Random(4)
    some = lambda n: bytes(rng.randrange(256) for _ in range(n))
    PLAIN = 1  # before: nothing

    def start(resolution=0, depth=0, size=0, focal=0, model=b"\0", base=0, flags=0, range_=0, bounds=b"", before=PLAIN):
        return bytes([resolution, depth, size, size, focal, 0, 0, 0]) + model + bytes([base, flags, range_]) + bounds + bytes([before])

    def shot(kind, how=1, where=5, more=b"", rotation=b"", pattern=None):
        pattern = some(24) if pattern is None else pattern
        near = bytes([3, 250, 9]) if where < 48 else b"\0\0\0"
        return (bytes([where]) + near + more + (rotation or some(4)) + bytes([kind, len(pattern) - 1]) + pattern + bytes([how]))

    write("integrate_depth", "wall", start() + shot(0) + shot(0, how=0))
    write("integrate_depth", "noisy", start(1, 0, 1) + shot(1) + shot(2, how=9) + shot(3))
    write("integrate_depth", "absurd_depths", start() + shot(4) + shot(5) + shot(4, how=4))
    write("integrate_depth", "on_corner", start(3) + shot(2, where=53, rotation=bytes([0, 0, 0, 0])) + shot(1, where=53))
    write("integrate_depth", "settled", start(1, base=3, before=32 | 128) + shot(1, how=0) + shot(3, how=8))
    write("integrate_depth", "discretized", start(0, flags=3, range_=1) + shot(2) + shot(3, how=9))
    write("integrate_depth", "no_rays", start(0, flags=28, range_=2) + shot(4))
    write("integrate_depth", "bounded", start(1, flags=96, bounds=some(6), base=3) + shot(1) + shot(3))
    write("integrate_depth", "at_border", start(1, 3, base=4) + b"".join(shot(2, where=w) for w in (0, 1, 2)))
    write("integrate_depth", "far_away", start(0) + shot(1, where=4, more=b"\1") + shot(1, where=3, more=some(4)))
    write("integrate_depth", "wide", start(7, focal=5, base=2) + shot(3) + shot(1))
    write("integrate_depth", "narrow", start(2, 1, focal=4, base=4) + shot(1) + shot(0, how=0))
    write("integrate_depth", "distorted", start(0, model=bytes([2, 200, 5, 9])) + shot(1) + shot(3))
    write("integrate_depth", "fisheye", start(0, 2, focal=1, model=bytes([3, 12, 250])) + shot(2, how=8) + shot(1))
    write("integrate_depth", "one_pixel", start(0, 0, 4, base=3) + shot(0) + shot(3))


def compressed_depths():
    """Size, then bytes that are a compressed image, or pixels, or both."""
    size = lambda width, height: bytes([width, height])
    rng = random.Random(11)
    write("read_depth", "empty", b"")
    write("read_depth", "no_pixels", size(0, 9) + b"\0")
    write("read_depth", "plain", size(3, 2) + b"\0" + struct.pack("<6H", 0, 1, 2, 1000, 65534, 65535))
    write("read_depth", "plain_short", size(3, 2) + b"\0" + struct.pack("<5H", 0, 1, 2, 1000, 65534))
    no_tables, no_words, states = bytes(27), bytes(4), b"\x80\x80\x04" * 4
    write("read_depth", "no_depth_anywhere", size(40, 30) + b"\1" + no_tables + no_words + states)
    write("read_depth", "list_too_long", size(4, 4) + b"\2\xff\xff\xff\xff\x0f" + b"\1" * 40)
    write("read_depth", "depth_beyond_16_bits", size(4, 4) + b"\2\2\xff\xff\3\1" + no_tables + no_words + states)
    write("read_depth", "rank_beyond_list", size(4, 4) + b"\2\1\5" + (b"\2\0\x80\x20" * 27) + no_words + states)
    write("read_depth", "frequencies_too_large", size(4, 4) + b"\1" + b"\2\x80\x20\1" * 27 + no_words + states)
    write("read_depth", "words_missing", size(4, 4) + b"\1" + no_tables + b"\0\0\0\x7f" + states)
    write("read_depth", "steps", size(37, 29) + bytes(64 + (x // 5 + y // 3) % 128 for y in range(29) for x in range(37)))
    write("read_depth", "noise", size(20, 20) + bytes(rng.randrange(256) for _ in range(700)))
    write("read_depth", "holes", size(33, 21) + bytes(rng.choice((0, 0, 100, 101)) for _ in range(33 * 21)))
    write("read_depth", "one_row", size(63, 1) + bytes(range(64, 127)))
    write("read_depth", "one_column", size(1, 63) + bytes(range(64, 127)))


def pose_graphs():
    def vertex(i, pose="0 0 0 0 0 0 1"):
        return f"VERTEX_SE3:QUAT {i} {pose}\n"

    def edge(a, b, pose="1 0 0 0 0 0 1", information="1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 4 0 0 4 0 4"):
        return f"EDGE_SE3:QUAT {a} {b} {pose} {information}\n"

    def graph(name, *lines):
        write("read_g2o", name, "".join(lines).encode())

    ring = [vertex(i, f"{i} {i % 3} 0 0 0 0.{i} 1") for i in range(8)]
    ring += [edge(i, (i + 1) % 8, "1 0 0 0 0 0.38 0.92") for i in range(8)]
    graph("empty")
    graph("ring", *ring)
    graph("fixed", "FIX 3 5\n", *ring, "FIX 0\n")
    graph("clique", *[vertex(i) for i in range(7)], *[edge(a, b) for a in range(7) for b in range(a)])
    graph("twice_and_back", vertex(1), vertex(2), edge(1, 2), edge(2, 1, "-2 0 0 0 0 0 1"), edge(1, 2, "1.1 0 0 0 0 0 -1"))
    graph("two_pieces", *map(vertex, range(5)), edge(0, 1), edge(2, 3), edge(3, 4))
    graph("loose", vertex(0), vertex(1), edge(0, 1, information="0 " * 6 + "1 0 0 0 0 1 0 0 0 4 0 0 4 0 4"))
    graph("half_turns", vertex(0), vertex(1), edge(0, 1, "0 0 0 0 0 1 0"), edge(0, 1, "0 0 0 0 0 0 1"))
    graph("huge", vertex(0, "1e300 0 0 0 0 0 1"), vertex(1, "-1e300 0 0 0 0 0 1"), edge(0, 1, "1e308 0 0 0 0 0 1"))
    graph("tiny", vertex(0), vertex(1), edge(0, 1, information="1e-300 0 0 0 0 0 " + "1e-300 0 0 0 0 1e-300 0 0 0 1 0 0 1 0 1"))
    graph("itself", vertex(0), vertex(1), edge(1, 1))
    graph("nowhere", vertex(0), edge(0, 7))
    graph("cut", vertex(0), vertex(1), edge(0, 1)[:-9])
    graph("many_fixed", vertex(0), "FIX" + " 0" * 2000)
    graph("others", "# comment\r\n", vertex(0), "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n", "VERTEX_SE2 1 0 0 0\n")


def bundles():
    def camera(i, more="500 -1e-2 1e-3"):
        return f"0.0{i} -0.1 0 {i} 0.5 -1 {more}\n".replace(" ", "\n")

    def problem(name, cameras, points, observations, header=None, more=""):
        counts = header or f"{len(cameras)} {len(points)} {len(observations)}"
        write("read_bal", name, "".join([counts, "\n", *observations, *cameras, *points, more]).encode())

    cameras = [camera(i) for i in range(4)]
    points = [f"{i}\n{i % 3 - 1}\n-{5 + i % 4}\n" for i in range(9)]
    seen = [f"{c} {p}     {-100 * c + 60 * p - 3:e} {40 * (p % 3) - c:e}\n" for p in range(9) for c in range(4)]
    problem("good", cameras, points, seen)
    problem("empty", [], [], [], "0 0 0")
    problem("nothing", [], [], [], " ")
    problem("unseen", cameras, points, [])
    problem("once", cameras[:1], points, seen[::4])
    problem("twice_the_same", cameras, points, seen + seen)
    problem("coincident", cameras[:1] * 3, points[:1] * 5, [f"{c} {p} 1 2\n" for c in range(3) for p in range(5)])
    problem("in_plane_of_centre", ["0 0 0 0 0 0 500 0 0\n"] * 2, ["0 0 0\n", "1 1 0\n"], ["0 0 1 1\n", "1 1 2 2\n"])
    problem("behind", ["0 0 0 0 0 0 500 0 0\n"] * 2, ["0 0 5\n", "1 1 7\n"], ["0 0 1 1\n", "1 1 2 2\n"])
    problem("no_focal_length", [camera(i, "0 0 0") for i in range(4)], points, seen)
    problem("huge", [camera(i, "1e200 1e100 1e300") for i in range(4)], points, seen)
    problem("tiny", cameras, ["1e-320 -5e-324 0\n"] * 9, seen)
    problem("big_angle", ["1e8 -1e8 1e9 0 0 0 5 0 0\n"] * 4, points, seen)
    problem("declares_more", cameras, points, seen, "4 9 4000")
    problem("declares_huge", cameras, points, seen, "4294967295 18446744073709551615 9223372036854775807")
    problem("out_of_range", cameras, points, seen + ["4 0 1 1\n"])
    problem("negative", cameras, points, seen + ["-1 0 1 1\n"])
    problem("not_finite", cameras, points, seen + ["0 0 nan -inf\n"])
    problem("more_than_declared", cameras, points, seen, more="1 2 3\n")
    problem("crlf", cameras, [p.replace("\n", "\r\n") for p in points], seen)
    problem("cut", cameras, points[:-1] + ["1 2"], seen)
    write("read_bal", "bzip2", b"BZh91AY&SY\x93")


def crc32c(data):
    c = 0xffffffff
    for byte in data:
        c ^= byte
        for _ in range(8):
            c = (c >> 1) ^ (0x82f63b78 if c & 1 else 0)
    return c ^ 0xffffffff


def vocabularies():
    """Of descriptors of 64 bits."""
    rng = random.Random(5)

    def compact(name, counts, words, nodes=None, bits=64, weighting=0, version=1, weights=None, cut=0):
        nodes = nodes if nodes is not None else 1 + sum(counts)
        weights = weights if weights is not None else [1.0 + i for i in range(words)]
        body = struct.pack("<5I28x", bits, weighting, nodes, len(counts), words)
        body += bytes(rng.randrange(256) for _ in range(8 * (nodes - 1))) if nodes < 1000 else b""
        body += b"".join(struct.pack("<f", w) for w in weights) + b"".join(struct.pack("<H", c) for c in counts)
        data = b"orbisvoc" + struct.pack("<II", version, crc32c(body)) + body
        write("read_vocabulary", "own_" + name, data[:len(data) - cut])

    compact("empty", [], 0)
    compact("flat", [5], 5)
    compact("two_levels", [3, 2, 2, 2], 6)
    compact("uneven", [3, 0, 2, 0, 0, 4], 7)
    compact("chain", [1] * 20, 1)
    compact("own_ancestor", [1, 0, 2], 2, nodes=4)
    compact("huge", [65535], 5, nodes=0xffffffff)
    compact("words_missing", [3], 2)
    compact("not_a_number", [2], 2, weights=[float("nan"), -1.0])
    compact("other_bits", [2], 2, bits=256)
    compact("version_2", [2], 2, version=2)
    compact("cut", [3, 2], 4, cut=3)

    bits = lambda: " ".join(str(rng.randrange(256)) for _ in range(8))
    tree = [(0, 0), (0, 0), (1, 1), (1, 1), (2, 1), (2, 1), (2, 1)]

    def text(name, lines, head="3 2 0 0"):
        write("read_vocabulary", "text_" + name, (head + "\n" + "".join(lines)).encode())

    nodes = [f"{p} {w} {bits()} {1.25 * w}\n" for p, w in tree]
    text("good", nodes)
    text("crlf", [n.replace("\n", "\r\n") for n in nodes], "3 2 0 3\r")
    text("empty", [])
    text("blank_end", nodes + ["\n \n"])
    text("later_parent", nodes[::-1])
    text("word_with_child", ["0 1 " + bits() + " 1\n", "1 1 " + bits() + " 1\n"])
    text("cut", nodes[:-1] + ["2 1 7 7"])
    text("huge_weight", ["0 1 " + bits() + " 1e308\n"])

    def yaml(name, items, words=None, head="%YAML:1.0\n---\n", more=""):
        body = "vocabulary:\n   k: 3\n   L: 2\n   scoringType: 0\n   weightingType: 0\n   nodes:\n" + "".join(items)
        if words is not None:
            body += "   words:\n" + "".join(f"      - {{ wordId:{i}, nodeId:{n} }}\n" for i, n in enumerate(words))
        write("read_vocabulary", "yaml_" + name, (head + body + more).encode())

    def item(i, parent, weight="1.5", before="", quote='"'):
        return f"      - {{ nodeId:{i}, parentId:{parent}, weight:{weight},\n" \
               f"          descriptor:{quote}{before}{bits()} {quote} }}\n"

    good = [item(i + 1, p, str(1.25 * w)) for i, (p, w) in enumerate(tree)]
    yaml("good", good, [3, 4, 5, 6, 7])
    yaml("no_words", good)
    yaml("dbow3", [item(i + 1, p, "0.", "dbw3 0 8 ", "") for i, (p, w) in enumerate(tree)], [3, 4, 5, 6, 7])
    yaml("backwards", good[::-1], [7, 6, 5, 4, 3])
    yaml("circle", [item(1, 2), item(2, 1), item(3, 0)])
    yaml("beyond", [item(9, 0)])
    yaml("cut", good[:-1] + ["      - { nodeId:7, parentId:2, weight:"])
    yaml("brackets", ["      []\n"])


def slam_maps():
    """Keyframes of a few keypoints; a landmark is a list of (keyframe, keypoint), or what it became."""
    NONE = 0xffffffff
    here_pose = struct.pack("<7d", 0, 0, 0, 0, 0, 0, 1)

    def section(name, content):
        data = name.encode() + struct.pack("<Q", len(content)) + content
        return data + struct.pack("<I", crc32c(data))

    def keypoint(i, octave=0, depth=2.0, ray=(0.1, 0.2)):
        return struct.pack("<5fif2d4Q", 10.0 * i, 20.0, 31.0, 0.5, 7.0, octave, depth, *ray, int(i) & 255, 2, 3, 4)

    def keyframe(keypoints, pose=here_pose, count=None):
        count = len(keypoints) if count is None else count
        return b"\1" + struct.pack("<dQ", 1.5, 3) + pose + struct.pack("<I", count) + b"".join(keypoints)

    def erased(heir, pose=here_pose):
        return b"\0" + struct.pack("<I", heir) + pose

    def parent(k, *loops):
        return struct.pack("<II", k, len(loops)) + b"".join(struct.pack("<I", l) for l in loops)

    def landmark(seen, created=0, position=(1.0, 2.0, 3.0), count=None):
        if not isinstance(seen, list):
            return struct.pack("<II", 0, seen)
        count = len(seen) if count is None else count
        return (struct.pack("<I8d4Q3IB", count, *position, 0, 0, -1, 0.5, 2.0, 1, 2, 3, 4, created, 2, 1, 1)
                + b"".join(struct.pack("<II", *o) for o in seen))

    def slam_map(name, keyframes, parents, landmarks, size=None, sections=("size", "kfrm", "tree", "land"), version=1,
                 cut=0, more=b""):
        size = size or struct.pack("<IIdII", 8, 15, 1.2, len(keyframes), len(landmarks))
        content = dict(size=size, kfrm=b"".join(keyframes), tree=b"".join(parents), land=b"".join(landmarks))
        data = b"orbismap" + struct.pack("<I", version) + b"".join(section(s, content[s]) for s in sections) + more
        write("read_map", name, data[:len(data) - cut])

    def sizes(levels=8, shared=15, factor=1.2, keyframes=3, landmarks=4):
        return struct.pack("<IIdII", levels, shared, factor, keyframes, landmarks)

    three = [keyframe([keypoint(i, i) for i in range(4)]) for _ in range(3)]
    line = [parent(NONE), parent(0), parent(1)]
    seen = [landmark([(0, 0), (1, 1)]), landmark([(1, 0), (2, 3)], 1), landmark(0), landmark([(2, 0)], 2)]
    slam_map("good", three, line, seen)
    slam_map("empty", [], [], [])
    slam_map("all_erased", [erased(1), erased(NONE)], [], [landmark(NONE)])
    slam_map("heirs", [erased(2), three[0], erased(1)], [parent(NONE)], [landmark([(1, 0)])])
    slam_map("own_heir", [erased(2), three[0], erased(0)], [parent(NONE)], [landmark([(1, 0)])])
    slam_map("loops", three, [parent(NONE, 2), parent(0), parent(1, 0)], seen)
    slam_map("loop_one_way", three, [parent(NONE, 2), parent(0), parent(1)], seen)
    slam_map("loop_one_way_back", three, [parent(NONE), parent(0), parent(1, 0)], seen)
    slam_map("loop_with_itself", three, [parent(NONE, 0), parent(0), parent(1)], seen)
    slam_map("two_roots", three, [parent(NONE), parent(NONE), parent(1)], seen)
    slam_map("no_root", three, [parent(1), parent(2), parent(0)], seen)
    slam_map("circle_apart", three, [parent(NONE), parent(2), parent(1)], seen)
    slam_map("own_parent", three, [parent(NONE), parent(1), parent(0)], seen)
    slam_map("parent_missing", three, [parent(NONE), parent(9), parent(0)], seen)
    slam_map("younger_parents", three, [parent(1), parent(2), parent(NONE)], seen)
    slam_map("seen_twice", three, line, seen + [landmark([(0, 0)])])
    slam_map("seen_by_none", three, line, seen + [landmark([(7, 0)])])
    slam_map("no_keypoint", three, line, seen + [landmark([(0, 4)])])
    slam_map("no_order", three, line, [landmark([(1, 1), (0, 0)])])
    slam_map("became_dead", three, line, [landmark([(0, 0)]), landmark(2), landmark(NONE)])
    slam_map("became_itself", three, line, [landmark(0)])
    slam_map("far_away", three, line, [landmark([(0, 0)], position=(1e300, 0.0, 0.0))])
    slam_map("farthest", [keyframe([keypoint(0)], struct.pack("<7d", 9e11, -9e11, 0, 0, 0, 0, 1))] * 2, line[:2],
             [landmark([(0, 0), (1, 0)], position=(9e11, 0.0, -9e11))])
    slam_map("not_a_number", three, line, [landmark([(0, 0)], position=(float("nan"), 0.0, 0.0))])
    slam_map("no_rotation", [keyframe([], struct.pack("<7d", 0, 0, 0, 0, 0, 0, 0))], [parent(NONE)], [])
    slam_map("level_9", [keyframe([keypoint(0, 9)])], [parent(NONE)], [])
    slam_map("no_ray", [keyframe([keypoint(0, 0, 0.0, (float("nan"),) * 2)])], [parent(NONE)], [])
    slam_map("keypoints_apart", [keyframe([keypoint(0), keypoint(1e30)])], [parent(NONE)], [])
    slam_map("many_keypoints", [keyframe([], count=0xffffffff)], [parent(NONE)], [])
    slam_map("many_observations", three, line, [landmark([(0, 0)], count=0xffffffff)])
    slam_map("many_keyframes", three, line, seen, sizes(keyframes=0xffffffff))
    slam_map("many_landmarks", three, line, seen, sizes(landmarks=0xffffffff))
    slam_map("fewer_landmarks", three, line, seen, sizes(landmarks=2))
    slam_map("no_levels", three, line, seen, sizes(levels=0))
    slam_map("scale_factor_1", three, line, seen, sizes(factor=1.0))
    slam_map("all_see_one", [keyframe([keypoint(0)])] * 12, [parent(NONE)] + [parent(0)] * 11,
             [landmark([(k, 0) for k in range(12)])], sizes(shared=0, keyframes=12, landmarks=1))
    slam_map("no_land", three, line, seen, sections=("size", "kfrm", "tree"))
    slam_map("other_order", three, line, seen, sections=("size", "tree", "kfrm", "land"))
    slam_map("version_2", three, line, seen, version=2)
    slam_map("cut", three, line, seen, cut=40)
    slam_map("surplus", three, line, seen, more=b"more")


if __name__ == "__main__":
    slam_maps()
    vocabularies()
    readers()
    bundles()
    pose_graphs()
    scans()
    edits()
    depth_images()
    compressed_depths()
