#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the hand-made inputs of the fuzz targets into corpus/: make_corpus.py

Valid files, files cut short, files that declare more than they hold, and files made to hurt. What the
fuzzers found besides is kept there as found_*. The JPEG files in read_jpeg are libjpeg's.
"""
import bz2
import pathlib
import random
import struct
import zlib

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
            scan(i | (64 if n == 1 else 0), [near() for _ in range(40)], near()) for n in range(3)))
    faces = [bytes([8 * x % 256, 8 * y % 256, 8 * z % 256]) for x in (-3, 0, 3) for y in (-3, 0, 3) for z in (-3, 0, 3)]
    for mode in (0, 1):
        write("integrate", f"faces_{mode}", bytes([0]) + scan(mode, faces) + scan(mode, faces, bytes([4, 4, 4])))
        write("integrate", f"same_again_{mode}", bytes([0xF9]) + 4 * scan(mode | 64, faces))
        write("integrate", f"zero_range_{mode}", bytes([1]) + scan(mode | 2, faces))
        inf, nan = float("inf"), float("nan")
        strange = [b"\0" + swap(wild(*v)) for v in ((nan, 0, 0), (inf, -inf, 0), (1e30, 0, 0), (0, -1e6, 1e-45))]
        calm = [b"\1" + p for p in faces[:8]]
        for range_ in (0, 4, 6):
            write("integrate", f"strange_{mode}_{range_}", bytes([0]) + scan(mode | range_ | 8, strange + calm))
        far = [b"\0" + swap(wild(*v)) for v in ((1600, -1600, 1600), (-1638.4, 3, 4), (1638.35, 0, 0), (1638.4, 0, 0))]
        write("integrate", f"far_{mode}", bytes([0]) + scan(mode | 8, far + calm))
        write("integrate", f"corner_{mode}", bytes([0xF8]) + scan(mode | 32, faces, near()))
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

    def start(resolution=0, depth=0, size=0, focal=0, model=b"\0", base=0, flags=0, range_=0, before=PLAIN):
        return bytes([resolution, depth, size, size, focal, 0, 0, 0]) + model + bytes([base, flags, range_, before])

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
    write("integrate_depth", "at_border", start(1, 3, base=4) + b"".join(shot(2, where=w) for w in (0, 1, 2)))
    write("integrate_depth", "far_away", start(0) + shot(1, where=4, more=b"\1") + shot(1, where=3, more=some(4)))
    write("integrate_depth", "wide", start(7, focal=5, base=2) + shot(3) + shot(1))
    write("integrate_depth", "narrow", start(2, 1, focal=4, base=4) + shot(1) + shot(0, how=0))
    write("integrate_depth", "distorted", start(0, model=bytes([2, 200, 5, 9])) + shot(1) + shot(3))
    write("integrate_depth", "fisheye", start(0, 2, focal=1, model=bytes([3, 12, 250])) + shot(2, how=8) + shot(1))
    write("integrate_depth", "one_pixel", start(0, 0, 4, base=3) + shot(0) + shot(3))


def compressed_depths():
    """Size, then bytes that are a compressed image, or pixels, or both."""
    size = lambda width, height: bytes([width | 192, height | 192]) if max(width, height) > 23 else bytes([width, height])
    rng = random.Random(11)
    write("read_depth", "empty", b"")
    write("read_depth", "no_pixels", size(0, 9) + b"\0")
    write("read_depth", "plain", size(3, 2) + b"\0" + struct.pack("<6H", 0, 1, 2, 1000, 65534, 65535))
    write("read_depth", "plain_short", size(3, 2) + b"\0" + struct.pack("<5H", 0, 1, 2, 1000, 65534))

    def groups(bits, number):
        """Groups of some bits, the lowest first, each behind a bit that says whether another follows."""
        rest = number >> bits
        return f"{rest != 0:b}{number % (1 << bits):0{bits}b}" + (groups(bits, rest) if rest else "")

    def coded(depths, *runs_and_steps, count=None):
        """The steps between distinct depths, and numbers that are runs and what stands between them in turn."""
        bits = groups(2, len(depths) if count is None else count) + "".join(groups(2, d) for d in depths)
        bits += "".join(groups(1 + i % 2, n) for i, n in enumerate(runs_and_steps))
        bits += "0" * (-len(bits) % 8)
        return b"\1" + int(bits, 2).to_bytes(len(bits) // 8, "big")

    write("read_depth", "no_depth_anywhere", size(40, 30) + coded([], 1200))
    write("read_depth", "coded", size(40, 30) + coded([899, 6], 100, 2, 39, 2, 500, 0, 559))
    write("read_depth", "list_too_long", size(4, 4) + coded([0] * 40, count=65536))
    write("read_depth", "depth_beyond_16_bits", size(4, 4) + coded([65000, 535], 16))
    write("read_depth", "rank_beyond_list", size(4, 4) + coded([99], 3, 4, 12))
    write("read_depth", "rank_below_list", size(4, 4) + coded([99], 3, 1, 12))
    write("read_depth", "run_too_long", size(4, 4) + coded([99], 3, 2, 13))
    write("read_depth", "run_missing", size(4, 4) + coded([99], 3, 2))
    write("read_depth", "number_without_end", size(4, 4) + b"\1" + b"\xff" * 40)
    write("read_depth", "steps", size(37, 29) + bytes(64 + (x // 5 + y // 3) % 128 for y in range(29) for x in range(37)))
    write("read_depth", "noise", bytes([64 + 4, 20]) + bytes(rng.randrange(256) for _ in range(700)))
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
    """Of descriptors of 64 bits and, at the end, of 256."""
    rng = random.Random(5)

    def compact(name, counts, words, nodes=None, bits=64, weighting=0, version=1, weights=None, cut=0, size=8):
        nodes = nodes if nodes is not None else 1 + sum(counts)
        weights = weights if weights is not None else [1.0 + i for i in range(words)]
        body = struct.pack("<5I28x", bits, weighting, nodes, len(counts), words)
        body += bytes(rng.randrange(256) for _ in range(size * (nodes - 1))) if nodes < 1000 else b""
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

    compact("256_two_levels", [3, 2, 2, 2], 6, bits=256, size=32)
    compact("256_uneven", [3, 0, 2, 0, 0, 4], 7, bits=256, size=32)
    bits = lambda: " ".join(str(rng.randrange(256)) for _ in range(32))
    text("256_good", [f"{p} {w} {bits()} {1.25 * w}\n" for p, w in tree])
    yaml("256_good", [item(i + 1, p, str(1.25 * w)) for i, (p, w) in enumerate(tree)], [3, 4, 5, 6, 7])


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

    def gone(count):
        return struct.pack("<II", 0xffffffff, count)

    def forgotten(count):
        return b"\2" + struct.pack("<I", count)

    def slam_map(name, keyframes, parents, landmarks, size=None, sections=("size", "kfrm", "tree", "land"), version=1,
                 cut=0, more=b""):
        size = size or struct.pack("<IIdII", 8, 15, 1.2, len(keyframes), len(landmarks))
        content = dict(size=size, kfrm=b"".join(keyframes), tree=b"".join(parents), land=b"".join(landmarks))
        data = b"orbismap" + struct.pack("<I", version) + b"".join(section(s, content[s]) for s in sections) + more
        write("read_map", name, data[:len(data) - cut])

    def sizes(levels=8, shared=15, factor=1.2, keyframes=3, landmarks=4):
        return struct.pack("<IIdII", levels, shared, factor, keyframes, landmarks)

    def sizes_3(landmarks):
        return sizes(landmarks=landmarks) + struct.pack("<II", 1, 1)

    three = [keyframe([keypoint(i, i) for i in range(4)]) for _ in range(3)]
    line = [parent(NONE), parent(0), parent(1)]
    seen = [landmark([(0, 0), (1, 1)]), landmark([(1, 0), (2, 3)], 1), landmark(0), landmark([(2, 0)], 2)]
    slam_map("good", three, line, seen)
    slam_map("empty", [], [], [])

    def forgetful(name, ids, keyframes, parents=(), version=4):
        slam_map(name, keyframes, parents, [], sizes(keyframes=ids, landmarks=0) + struct.pack("<II", 1, 1),
                 version=version)

    one = [keyframe([keypoint(0)])]
    forgetful("forgotten", 9, [forgotten(2)] + one + [erased(2), forgotten(4)] + one, [parent(NONE), parent(2)])
    forgetful("forgotten_all", 9, [forgotten(9)])
    forgetful("forgotten_many", 1 << 28, [forgotten((1 << 28) - 1)] + one, [parent(NONE)])
    forgetful("forgotten_beyond", (1 << 28) + 1, [forgotten((1 << 28) + 1)])
    forgetful("forgotten_too_many", 9, [forgotten(10)])
    forgetful("forgotten_none", 9, [forgotten(0)])
    forgetful("forgotten_heir", 2, [erased(1), forgotten(1)])
    forgetful("forgotten_version_3", 9, [forgotten(9)], version=3)
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
    slam_map("many_keyframes", three, line, seen, sizes(keyframes=0x7fffffff))
    slam_map("many_landmarks", three, line, seen, sizes(landmarks=0x10000000))
    slam_map("fewer_landmarks", three, line, seen, sizes(landmarks=2))
    slam_map("gone", three, line, seen + [gone(9), landmark([(1, 2)]), landmark(13), gone(1000)], sizes_3(1015), version=3)
    slam_map("gone_ones_one_by_one", three, line, seen + [landmark(NONE), landmark(NONE)], sizes_3(6), version=3)
    slam_map("all_gone", three, line, [gone(0x10000000)], sizes_3(0x10000000), version=3)
    slam_map("none_gone", three, line, seen + [gone(0)], sizes_3(5), version=3)
    slam_map("too_many_gone", three, line, seen + [gone(7)], sizes_3(10), version=3)
    slam_map("became_gone", three, line, seen + [landmark(5), gone(3)], sizes_3(8), version=3)
    slam_map("too_many_ids", three, line, [gone(0x10000001)], sizes_3(0x10000001), version=3)
    slam_map("too_many_keyframes", three, line, seen, sizes(keyframes=0x80000000))
    slam_map("no_levels", three, line, seen, sizes(levels=0))
    slam_map("scale_factor_1", three, line, seen, sizes(factor=1.0))
    slam_map("all_see_one", [keyframe([keypoint(0)])] * 12, [parent(NONE)] + [parent(0)] * 11,
             [landmark([(k, 0) for k in range(12)])], sizes(shared=0, keyframes=12, landmarks=1))
    slam_map("no_land", three, line, seen, sections=("size", "kfrm", "tree"))
    slam_map("other_order", three, line, seen, sections=("size", "tree", "kfrm", "land"))
    slam_map("version_2", three, line, seen, version=2)
    slam_map("cut", three, line, seen, cut=40)
    slam_map("surplus", three, line, seen, more=b"more")


def png(width, height, bits, color, raw, *more, interlace=0, level=9):
    """`raw`: rows as PNG has them; `more`: chunks between the header and the pixels."""
    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, height, bits, color, 0, 0, interlace)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + b"".join(chunk(n, c) for n, c in more)
            + chunk(b"IDAT", zlib.compress(raw, level)) + chunk(b"IEND", b""))


def images():
    rng = random.Random(7)

    def rows(count, length, filters=(0, 1, 2, 3, 4)):
        return b"".join(bytes([filters[y % len(filters)]]) + rng.randbytes(length) for y in range(count))

    depth = png(9, 7, 16, 0, rows(7, 18))
    write("read_png", "depth", depth)
    write("read_png", "color", png(9, 7, 8, 2, rows(7, 27)))
    write("read_png", "color_16", png(5, 4, 16, 2, rows(4, 30)))
    write("read_png", "alpha", png(5, 4, 8, 6, rows(4, 20)))
    write("read_png", "grey_1", png(20, 3, 1, 0, rows(3, 3)))
    write("read_png", "grey_alpha", png(5, 4, 8, 4, rows(4, 10)))
    palette = (b"PLTE", rng.randbytes(12))
    write("read_png", "palette", png(8, 4, 2, 3, rows(4, 2, (0,)), palette))
    write("read_png", "palette_transparent", png(8, 4, 2, 3, rows(4, 2, (0,)), palette, (b"tRNS", b"\0\x80")))
    write("read_png", "palette_too_short", png(8, 4, 8, 3, rows(4, 8, (0,)), palette))
    write("read_png", "no_palette", png(8, 4, 8, 3, rows(4, 8, (0,))))
    # Of 8 x 8 pixels interlaced: seven passes.
    passes = ((1, 2), (1, 2), (1, 4), (2, 4), (2, 8), (4, 8), (4, 16))
    write("read_png", "interlaced", png(8, 8, 16, 0, b"".join(rows(*p) for p in passes), interlace=1))
    text = b"note\0\0" + zlib.compress(b"a" * 20000)
    write("read_png", "texts", png(2, 2, 16, 0, rows(2, 4), *[(b"zTXt", text)] * 6))
    write("read_png", "profile", png(2, 2, 8, 2, rows(2, 6), (b"iCCP", text), (b"gAMA", b"\0\0\0\1")))
    write("read_png", "plain", png(100, 50, 16, 0, bytes(50 * 201)))
    write("read_png", "claims_more", png(1 << 19, 1 << 19, 16, 0, bytes(100)))
    write("read_png", "too_few_rows", png(9, 7, 16, 0, rows(3, 18)))
    write("read_png", "too_many_rows", png(9, 7, 16, 0, rows(300, 18)))
    write("read_png", "bad_filter", png(9, 7, 16, 0, rows(7, 18, (9,))))
    write("read_png", "cut", depth[:-30])
    write("read_png", "signature", depth[:8])


def clouds():
    rng = random.Random(8)
    ply = lambda kind, *lines: ("\n".join(["ply", f"format {kind} 1.0", *lines, "end_header", ""])).encode()
    xyz = ("property float x", "property float y", "property float z")
    rgb = ("property uchar red", "property uchar green", "property uchar blue")
    text = b"".join(b"%g %g %g 1 2 255\n" % (rng.random(), rng.random(), rng.random()) for _ in range(5))
    write("read_ply", "text", ply("ascii", "comment a cloud", "element vertex 5", *xyz, *rgb) + text)
    write("read_ply", "crlf", (ply("ascii", "element vertex 5", *xyz, *rgb) + text).replace(b"\n", b"\r\n"))
    little = struct.pack("<3f3B", 1, 2, 3, 4, 5, 6) * 4
    write("read_ply", "little", ply("binary_little_endian", "element vertex 4", *xyz, *rgb) + little)
    write("read_ply", "big", ply("binary_big_endian", "element vertex 2", "property double x", "property short y",
                                 "property uint z") + struct.pack(">dhI", 1.5, -2, 7) * 2)
    write("read_ply", "bytes", ply("binary_little_endian", "element vertex 64", "property char x", "property uchar y",
                                   "property char z") + bytes(192))
    write("read_ply", "float_colors", ply("ascii", "element vertex 1", *xyz, *(r.replace("uchar", "float") for r in rgb))
          + b"nan inf -1e300 0.5 2 nan\n")
    lists = ("element face 2", "property list uchar int vertex_indices")
    write("read_ply", "lists_first", ply("binary_little_endian", *lists, "element vertex 1", *xyz)
          + struct.pack("<B3iB2i3f", 3, 0, 1, 2, 2, 0, 1, 1, 2, 3))
    write("read_ply", "list_in_vertex", ply("ascii", "element vertex 1", "property list uint float w", *xyz)
          + b"2 1 2 3 4 5\n")
    write("read_ply", "list_without_end", ply("ascii", "element face 1", "property list int int v",
                                              "element vertex 1", *xyz) + b"2147483647 1 2 3\n")
    write("read_ply", "no_properties", ply("ascii", "element nothing 18446744073709551615", "element vertex 1", *xyz)
          + b"1 2 3\n")
    write("read_ply", "declares_more", ply("binary_little_endian", "element vertex 5000000000", *xyz) + bytes(12))
    write("read_ply", "twice", ply("ascii", "element vertex 1", *xyz, *xyz) + b"1 2 3 4 5 6\n")
    write("read_ply", "many_properties", ply("ascii", "element vertex 1", *xyz, *["property char c"] * 300))
    write("read_ply", "fields", ply("binary_big_endian", "element vertex 2", "property uchar diffuse_red", *xyz,
                                    "property float diffuse_blue", "property ushort diffuse_green",
                                    "property list uchar char w", "property int ring")
          + struct.pack(">B4fHB1bi", 9, 1, 2, 3, 200, 999, 1, 5, -7) * 2)
    write("read_ply", "no_z", ply("ascii", "element vertex 1", *xyz[:2]) + b"1 2\n")
    write("read_ply", "header_only", b"ply\nformat ascii 1.0\n")

    def lzf(data):  # literals only
        return b"".join(bytes([len(data[i:i + 32]) - 1]) + data[i:i + 32] for i in range(0, len(data), 32))

    def pcd(fields, sizes, types, counts, width, height, kind, data, points=None):
        points = width * height if points is None else points
        return (f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\nWIDTH {width}\n"
                f"HEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {kind}\n").encode() + data

    xyz = ("x y z", "4 4 4", "F F F", "1 1 1")
    colored = ("x y z rgb", "4 4 4 4", "F F F U", "1 1 1 1")
    raw = struct.pack("<12f", *(rng.random() for _ in range(12)))
    squeezed = lambda packed, size: struct.pack("<II", len(packed), size) + packed
    write("read_pcd", "text", pcd(*colored, 2, 1, "ascii", b"1 2 3 255\nnan -1e9 0 4294967295\n"))
    write("read_pcd", "text_float_color", pcd("x y z rgb", "4 4 4 4", "F F F F", "1 1 1 1", 1, 1, "ascii",
                                              b"1 2 3 1e-39\n"))
    write("read_pcd", "fields", pcd("_ x y rgba z label n", "1 4 4 4 4 1 8", "U F F U F U F", "3 1 1 1 1 1 2", 2, 1, "ascii",
                                    b"0 0 0 1 2 4278190335 3 -1 1e300 nan\n0 0 0 4 5 255 6 300 0 1\n")
          .replace(b"VIEWPOINT 0", b"VIEWPOINT 1e-3"))
    write("read_pcd", "binary", pcd(*xyz, 2, 2, "binary", raw))
    write("read_pcd", "compressed", pcd(*xyz, 2, 2, "binary_compressed", squeezed(lzf(raw), 48)))
    zeros = b"\0\0" + b"\xe0\xff\0" * 8 + b"\xe0\xfe\0"  # 2376 of them
    write("read_pcd", "compresses_well", pcd("x y z", "1 1 1", "I I I", "1 1 1", 2376 // 3, 1, "binary_compressed",
                                             squeezed(zeros, 2376)))
    write("read_pcd", "odd_types", pcd("n x y pad z", "8 8 2 1 8", "U F I U I", "1 1 1 3 1", 1, 1, "binary",
                                       bytes(range(29))))
    write("read_pcd", "bits_left", pcd(*xyz, 2, 2, "binary", raw[:-1]))
    write("read_pcd", "declares_more", pcd(*xyz, 1 << 39, 1, "binary", raw))
    write("read_pcd", "declares_much_text", pcd(*xyz, 1 << 39, 1, "ascii", b"1 2 3\n"))
    write("read_pcd", "declares_compressed", pcd(*xyz, 1 << 28, 1, "binary_compressed", squeezed(zeros, (12 << 28) % 2**32)))
    write("read_pcd", "no_count", pcd("x y z", "4 4 4", "F F F", "0 0 0", 2, 2, "binary", raw))
    write("read_pcd", "large_count", pcd("x y z w", "4 4 4 8", "F F F F", "1 1 1 65535", 2, 2, "binary", raw))
    write("read_pcd", "many_fields", b"FIELDS" + b" x" * 2000 + b"\nDATA ascii\n")
    write("read_pcd", "other_points", pcd(*xyz, 2, 2, "binary", raw, points=5))

    size = lambda n: struct.pack("<H", n)
    write("read_lzf", "literals", size(40) + lzf(b"abcdefgh" * 5))
    write("read_lzf", "copies", size(2 + 264) + b"\1ab\xe0\xff\1")
    write("read_lzf", "short_copy", size(8) + b"\2abc\x60\2")
    write("read_lzf", "before_the_start", size(9) + b"\0a\x3f\xff")
    write("read_lzf", "cut", size(9) + b"\0a\xe0")
    write("read_lzf", "too_much", size(3) + b"\1ab\xe0\xff\1")
    write("read_lzf", "too_little", size(9999) + b"\1ab\xe0\xff\1")


def texts():
    camera = (b'model = "radtan"\nwidth = 640\nheight = 480\nfx = 517.3\nfy = 516.5\ncx = 318.6\ncy = 255.3\n'
              b"distortion = [0.26, -0.95, -0.005, 0.002, 1.16]\ndepth_scale = 5000.0\nfps = 30.0\nbaseline = 0.075\n")
    write("read_camera", "radtan", camera)
    write("read_camera", "pinhole", camera.replace(b"radtan", b"pinhole").replace(b"distortion", b"#"))
    write("read_camera", "kannala_brandt", camera.replace(b"radtan", b"kannala_brandt").replace(b", 1.16", b""))
    write("read_camera", "other_types", camera.replace(b"640", b"0x280").replace(b"30.0", b"1e1_0").replace(b"5000.0", b"inf"))
    write("read_camera", "latin", camera.replace(b"distortion", b"disttroion\xe5"))
    write("read_camera", "dates", b"model = 1979-05-27T07:32:00.5-07:00\nwidth = 07:32:00\n")
    write("read_camera", "strings", b'model = """pin\\\n  hole\\u00e9"""\nname = \'\'\'a\'\'\'\n')
    write("read_camera", "tables", b"[a.b]\nc = {d = [1, 2.0, {e = 1}]}\n[[f]]\ng.h = 1\n[[f]]\n")
    write("read_camera", "nested", b"a = " + b"[" * 255 + b"]" * 255)
    write("read_camera", "dotted", b"a" + b".a" * 2000 + b" = 1\n")
    write("read_camera", "matrix", b"585 0 320\n0 585 240\n0 0 1\n")
    write("read_trajectory", "poses", b"# timestamp tx ty tz qx qy qz qw\n1.5 0 1 2 0 0 0 1\n1.25 1e3 -2 3 0.5 0.5 0.5 0.5\n")
    write("read_trajectory", "long_quaternion", b"1 0 0 0 1e150 1e150 0 1e-9\n")
    write("read_trajectory", "zero_quaternion", b"1 0 0 0 0 0 0 1e-7\n")
    write("read_trajectory", "not_finite", b"1 0 nan 0 0 0 0 1\n")
    write("read_trajectory", "nine_numbers", b"1 0 0 0 0 0 0 1 1\n")
    write("read_trajectory", "mark", b"\xef\xbb\xbf1 0 0 0 0 0 0 1\r\n+2 0 0 0 0 0 0 1")
    write("read_trajectory", "euroc", b"#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
          b"q_RS_y [], q_RS_z []\n1403715529000000000,1,2,3,1,0,0,0,7\n1403715529050000000,1,nan,3,1,0,0,0,7\n")
    write("read_trajectory", "kitti", b"1 0 0 1 0 1 0 2 0 0 1 3\n" + b"inf " * 12 + b"\n1 0 0 4 0 1 0 5 0 0 1 6\n")
    write("read_trajectory", "two_runs", b"".join(b"%d 0 0 %d 0 0 0 1\n" % (i, j) for j in (1, 2) for i in range(40)))
    write("read_trajectory", "repeated", b"1403715529000;1;2;3;0;0;0;1\n" * 2 + b"1403715529000;1;2;4;0;0;0;1\n" * 9)
    write("read_trajectory", "matrix", b"1 0 0 1\n0 0.001 -1 2\n0 1 0 3\n0 0 0 1\n")
    write("read_trajectory", "many_columns", b"x" + b"," * 600 + b"\n1 0 0 0 0 0 0 1\n")
    write("read_trajectory", "mirror", b"1 0 0 1\n0 1 0 2\n0 0 -1 3\n0 0 0 1\n")
    sensor = (b"# General.\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
              b"  data: [0.0, -1.0, 0.0, 0.1,\n         1.0, 0.0, 0.0, -0.06,\n         0, 0, 1, 0.01,\n         0, 0, 0, 1]\n"
              b"rate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\n"
              b"intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv\n"
              b"distortion_model: radial-tangential\ndistortion_coefficients: [-0.283, 0.07, 0.0002, 1.7e-05]\n")
    write("read_stereo", "sensor", sensor)
    write("read_stereo", "equidistant", b"%YAML:1.0\n---\n" + sensor.replace(b"radial-tangential", b'"equidistant"'))
    write("read_stereo", "no_end", sensor.replace(b"1]", b"1"))
    write("read_stereo", "empty_list", sensor.replace(b"[752, 480]", b"[]"))
    write("read_stereo", "open_list", b"a: [")
    write("read_stereo", "huge", sensor.replace(b"458.654", b"1e308").replace(b"0.01,", b"1e300,"))
    write("read_stereo", "asl_list", b"#timestamp [ns],filename\r\n1403636579763555584,1.png\r\n2,\n3,a b.png\n")
    write("read_stereo", "asl_poses", b"#t,p\n1403636579763555584,1,2,3,1,0,0,0,0.1\n5,1,2,3,0,0,0,1e-200\n")
    write("read_stereo", "calibration", b"P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\nP1: 7 0 3.5 -3.5 0 7 2.5 0 0 0 1 0\nTr: 1\n")
    write("read_stereo", "times", b"0.000000e+00\n1.036e-01\n2.073e-01\n")
    write("read_stereo", "poses", b"1 0 0 0 0 1 0 0 0 0 1 0\n0.999 0 0 0.5 0 1 0 0 0 0 1 1\n")
    write("read_list", "images", b"# color images\n1.06 rgb/1.06.png\n1.00 rgb/1.00.png\n1.00 rgb/a b.png\n")
    write("read_list", "pairs", b"1.0 rgb/1.png 1.01 depth/1.png\n2.0 depth/2.png 2.01 rgb/2.png\n")
    write("read_list", "absolute", b"1 /a/../b//c.png 1 ////\n")
    write("read_list", "rubbish", b"x\n" * 400)
    write("read_list", "not_finite", b"nan a.png\ninf a.png\n-1e308 a.png\n")
    write("read_list", "long_path", b"1 " + b"a/" * 900 + b"b\n")


def ros_messages():
    """The first byte is the kind: 0 an image, 1 a compressed one, 2 a camera, 3 transforms, 4 odometry, 5 a pose; with
    8 more ("8", "9", ":" and so on) the message is one of ROS 2."""
    text = lambda t: struct.pack("<I", len(t)) + t
    header = struct.pack("<3I", 7, 100, 250000000) + text(b"camera")

    def image(name, encoding, width, height, data, big_endian=0, step=None, cut=0):
        step = step if step is not None else len(data) // height
        message = header + struct.pack("<2I", height, width) + text(encoding) + struct.pack("<BI", big_endian, step) + text(data)
        write("read_ros", "image_" + name, b"0" + message[:len(message) - cut])

    image("grey", b"mono8", 6, 4, bytes(range(24)))
    image("rgb", b"rgb8", 3, 2, bytes(range(18)))
    image("bgra", b"bgra8", 3, 2, bytes(range(24)))
    image("mosaic", b"bayer_rggb8", 6, 4, bytes(range(24)))
    image("mosaic_of_rows", b"bayer_gbrg8", 9, 1, bytes(range(9)))
    image("depth", b"16UC1", 3, 2, struct.pack("<6H", 0, 1, 1000, 2000, 65534, 65535))
    image("depth_big_endian", b"mono16", 3, 2, struct.pack(">6H", 0, 1, 1000, 2000, 65534, 65535), 1)
    image("metres", b"32FC1", 3, 2, struct.pack("<6f", 0, 1.5, -1, float("nan"), float("inf"), 13.2))
    image("long_rows", b"8UC1", 3, 2, bytes(40))
    image("short_rows", b"rgb8", 3, 2, bytes(18), step=8)
    image("too_few", b"8UC1", 3, 200, bytes(60), step=3)
    image("huge", b"mono8", 2**32 - 1, 2**32 - 1, bytes(60), step=2**32 - 1)
    image("no_pixels", b"mono8", 0, 0, bytes(60), step=0)
    image("other", b"yuv422", 2, 2, bytes(8))
    image("long_name", b"y" * 400, 2, 2, bytes(8))
    image("cut", b"mono8", 6, 4, bytes(24), cut=3)

    def compressed(name, form, data):
        write("read_ros", "compressed_" + name, b"1" + header + text(form) + text(data))

    rows = lambda height, width: b"".join(b"\0" + bytes((7 * x + y) % 256 for x in range(width)) for y in range(height))
    jpeg = (here / "read_jpeg" / "baseline").read_bytes()
    color, depth = png(9, 7, 8, 2, rows(7, 27)), png(9, 7, 16, 0, rows(7, 18))
    compressed("png", b"rgb8; png compressed bgr8", color)
    compressed("jpeg", b"bgr8; jpeg compressed bgr8", jpeg)
    compressed("jpeg_alone", b"jpeg", jpeg)
    compressed("mosaic", b"bayer_rggb8; jpeg compressed ", jpeg)
    compressed("depth", b"16UC1; compressedDepth png", bytes(12) + depth)
    compressed("depth_alone", b"16UC1; png compressed ", depth)
    compressed("metres", b"32FC1; compressedDepth png", struct.pack("<I2f", 0, 800.0, -0.5) + depth)
    compressed("metres_no_scale", b"32FC1; compressedDepth png", struct.pack("<I2f", 0, float("nan"), 0.0) + depth)
    compressed("rvl", b"16UC1; compressedDepth rvl", bytes(40))
    compressed("short", b"16UC1; compressedDepth png", bytes(5))
    compressed("empty", b"", b"")

    def camera(name, model, distortion, width=640, height=480, k=(525.0, 0, 319.5, 0, 525.0, 239.5, 0, 0, 1), p=None):
        p = p if p is not None else (*k[:3], -50.0, *k[3:6], 0, *k[6:], 0)
        message = (header + struct.pack("<2I", height, width) + text(model)
                   + struct.pack(f"<I{len(distortion)}d", len(distortion), *distortion)
                   + struct.pack("<9d9d12d", *k, 1, 0, 0, 0, 1, 0, 0, 0, 1, *p) + struct.pack("<6IB", *6 * [0], 0))
        write("read_ros", "camera_" + name, b"2" + message)

    camera("plumb_bob", b"plumb_bob", (0.1, -0.2, 1e-3, 1e-3, 0.01))
    camera("rational", b"rational_polynomial", (0.1, -0.2, 1e-3, 1e-3, 0.01, 0.1, 0.1, 0.1))
    camera("equidistant", b"equidistant", (0.1, -0.2, 0.01, 1e-3))
    camera("straight", b"plumb_bob", 5 * (0,))
    camera("uncalibrated", b"", (), k=9 * (0,))
    camera("no_size", b"plumb_bob", (), 0, 0)
    camera("huge", b"plumb_bob", (), 2**31 - 1, 2**32 - 1)
    camera("no_number", b"plumb_bob", (float("nan"),), k=(525.0, 0, float("inf"), 0, 525.0, 239.5, 0, 0, 1))
    camera("other", b"m" * 300, (1, 2, 3))

    # Transforms and poses, and the messages of ROS 2: numbers are aligned after four bytes for the byte order.
    class Message:
        def __init__(self, cdr, order="<"):
            self.cdr, self.order, self.bytes = cdr, order, (bytes((0, order == "<", 0, 0)) if cdr else b"")

        def add(self, kinds, *values):
            for kind, value in zip(kinds, values):
                size = struct.calcsize(self.order + kind)
                if self.cdr:
                    self.bytes += bytes(-(len(self.bytes) - 4) % size)
                self.bytes += struct.pack(self.order + kind, value)
            return self

        def text(self, t, end=b"\0"):
            t = t + end if self.cdr else t
            self.add("I", len(t)).bytes += t
            return self

        def header(self, frame=b"map"):
            if not self.cdr:
                self.add("I", 7)
            return self.add("II", 100, 250000000).text(frame)

    pose = (1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8)
    for cdr, order, first in ((False, "<", 48), (True, "<", 56), (True, ">", 56)):
        kind = "ros1" if not cdr else "cdr" if order == "<" else "cdr_big_endian"
        message = lambda: Message(cdr, order)
        save = lambda number, name, m: write("read_ros", f"{name}_{kind}", bytes((first + number,)) + m.bytes)
        seven = "d" * 7

        def transforms(count, *rotations):
            m = message().add("I", count)
            for rotation in rotations:
                m.header().text(b"odom").add(seven, *pose[:3], *rotation)
            return m

        save(3, "transforms", transforms(2, pose[3:], (1, 0, 0, 0)))
        save(3, "transforms_too_many", transforms(2**32 - 1, pose[3:]))
        save(3, "transforms_no_rotation", transforms(1, (0, 0, 0, 0)))
        save(4, "odometry", message().header().text(b"base_link").add(seven, *pose))
        save(5, "pose", message().header().add(seven, *pose))
        save(5, "pose_not_finite", message().header().add(seven, float("nan"), *pose[1:]))
        if not cdr:
            continue
        m = message().header(b"camera").add("II", 2, 3).text(b"rgb8").add("BI", 0, 9).text(bytes(range(18)), b"")
        save(0, "image", m)
        save(0, "image_huge", message().header(b"camera").add("II", 2, 3).text(b"rgb8").add("BII", 0, 9, 2**32 - 1))
        save(0, "image_yuv", message().header().add("II", 2, 4).text(b"yuv422_yuy2").add("BI", 0, 8).text(bytes(range(16)), b""))
        save(1, "compressed", message().header(b"camera").text(b"rgb8; png compressed bgr8").text(color, b""))
        m = message().header(b"camera").add("II", 480, 640).text(b"plumb_bob").add("I" + "d" * 5, 5, 0.1, -0.2, 1e-3, 1e-3, 0.01)
        m.add("d" * 30, 525, 0, 319.5, 0, 525, 239.5, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 525, 0, 319.5, -50, 0, 525, 239.5, 0, 0, 0, 1, 0)
        save(2, "camera", m.add("IIIIIIB", *7 * (0,)))


def bags():
    """MCAP files and ROS 1 bags: with and without chunks and indices, and interrupted."""
    u16, u32, u64 = (lambda n, kind=kind: struct.pack(kind, n) for kind in ("<H", "<I", "<Q"))
    text = lambda t: u32(len(t)) + t
    stored = {  # not compressed, but in a frame
        b"": lambda b: b,
        b"zstd": lambda b: b"\x28\xb5\x2f\xfd\0\x58" + u32(1 | len(b) << 3)[:3] + b,
        b"lz4": lambda b: b"\x04\x22\x4d\x18\x60\x40\x82" + u32(len(b) | 1 << 31) + b + u32(0),
        b"bz2": bz2.compress,
    }
    magic = b"\x89MCAP0\r\n"
    record = lambda code, fields: bytes((code,)) + u64(len(fields)) + fields
    topics = ((1, b"/image", b"sensor_msgs/msg/Image"), (2, b"/chatter", b"std_msgs/msg/String"))
    definitions = lambda: b"".join(record(3, u16(i) + text(kind) + text(b"ros2msg") + text(b""))
                                   + record(4, u16(i) + u16(i) + text(name) + text(b"cdr") + text(b""))
                                   for i, name, kind in topics)
    message = lambda i, time: record(5, u16(i) + u32(0) + u64(time) + u64(time) + b"message %d" % time)
    start, end = magic + record(1, text(b"ros2") + text(b"")), record(15, u32(0))

    def chunk(compression, content, size=None, with_index=False, pack=None):
        packed = (pack or stored[compression])(content)
        size = len(content) if size is None else size
        out = record(6, u64(1) + u64(2) + u64(size) + u32(0) + text(compression) + u64(len(packed)) + packed)
        return out + (record(7, u16(1) + text(u64(1) + u64(0))) if with_index else b"")

    def mcap(name, data, summary=b"", closed=True):
        at = len(start + data + end) if summary else 0
        write("read_bag", "mcap_" + name, start + data + (
            end + summary + record(2, u64(at) + u64(0) + u32(0)) + magic if closed else b""))

    content = definitions() + message(1, 1) + message(2, 2) + message(1, 3)
    mcap("plain", content)
    for method in (b"", b"zstd", b"lz4", b"bz2", b"other"):
        name = "chunk_" + (method.decode() or "none")
        pack = stored.get(method, lambda b: b)
        mcap(name, chunk(method, content, pack=pack))
        mcap(name + "_indexed", chunk(method, message(1, 1), with_index=True, pack=pack), definitions())
        mcap(name + "_not_closed", chunk(method, content, pack=pack), closed=False)
    mcap("chunk_too_long", chunk(b"zstd", content, 2**62))
    mcap("chunk_too_short", chunk(b"zstd", content, 10))
    mcap("chunk_runs", chunk(b"zstd", content, 2**20, pack=lambda b: b"\x28\xb5\x2f\xfd\0\x58" + u32(3 | 0x1ffff << 3)[:3] + b"\0"))
    mcap("index_wrong", chunk(b"lz4", message(1, 1)) + record(7, u16(1) + text(u64(1) + u64(2**63) + u64(1) + u64(5))), definitions())
    mcap("huge_record", b"\x05" + u64(2**64 - 1) + b"abc", closed=False)
    mcap("cut", content[:-3], closed=False)
    write("read_bag", "mcap_empty", magic)

    def fields(**values):
        return b"".join(text(key.encode() + b"=" + value) for key, value in values.items())

    old = lambda head, data: text(head) + text(data)
    connection = lambda i, name, kind: old(fields(op=b"\7", conn=u32(i), topic=name), fields(topic=name, type=kind, md5sum=b"*"))
    connections = connection(0, b"/image", b"sensor_msgs/Image") + connection(1, b"/chatter", b"std_msgs/String")
    said = lambda i, time: old(fields(op=b"\2", conn=u32(i), time=u32(time) + u32(0)), b"message %d" % time)
    content = connections + said(0, 1) + said(1, 2) + said(0, 3)

    def bag(name, data, closed=True):
        head = lambda at: text(fields(op=b"\3", index_pos=u64(at), conn_count=u32(2), chunk_count=u32(1))) + text(b" " * 40)
        before = b"#ROSBAG V2.0\n"
        at = len(before + head(0) + data) if closed else 0
        write("read_bag", "bag_" + name, before + head(at) + data + (connections if closed else b""))

    for method in (b"none", b"bz2", b"lz4", b"other"):
        packed = stored.get(b"" if method == b"none" else method, lambda b: b)(content)
        chunk = lambda size, data: old(fields(op=b"\5", compression=method, size=u32(size)), data)
        name = method.decode()
        index = old(fields(op=b"\4", ver=u32(1), conn=u32(0), count=u32(1)), u32(1) + u32(0) + u32(len(connections)))
        bag(name, chunk(len(content), packed))
        bag(name + "_indexed", chunk(len(content), packed) + index)
        bag(name + "_not_closed", chunk(len(content), packed) + chunk(0, b"") + packed[:-5], False)
    bag("long_header", u32(2**32 - 1) + b"abc", False)
    bag("long_data", text(fields(op=b"\2", conn=u32(0), time=bytes(8))) + u32(2**32 - 1) + b"abc", False)
    bag("long_field", text(u32(2**32 - 1) + b"op=\2") + text(b""), False)
    write("read_bag", "bag_empty", b"#ROSBAG V2.0\n")


def configs():
    """The first byte is the command: 0 run, 1 demo, 2 live, 3 map."""
    def config(name, text, commands="0"):
        for command in commands:
            write("read_config", name + ("_" + command if len(commands) > 1 else ""),
                  command.encode() + (text if isinstance(text, bytes) else text.encode()))

    config("map", 'resolution = 0.02\nmax-depth = 5\nfilter = "radius"\nneighbors = 7\nradius = 0.1\nsigma = 1.5\n'
           'depth-memory = 32\nthreads = 2\nquiet = true\nrobot-radius = 0.3\nrobot-height = 1\n'
           'floor-map = "floor.yaml"\ngravity = "0,1,0"\n', "0123")
    config("slam", 'moving = "off"\ndepth-term = "on"\ndeterministic = true\nlive-map = false\nrealtime = true\n'
           'save-map = "a.map"\nload-map = "b.map"\nread-out-ms = 20\n', "012")
    config("run", 'sensor = "stereo"\nformat = "kitti"\ncamera = "tum_fr1"\nframes = 100\nstride = 2\n'
           'topics = "/left,/right"\nintrinsics = "given"\nread-out-ms = "auto"\n')
    config("demo", "width = 320\nseed = 7\nperson = true\nprofile = \"small\"\n", "1")
    config("origin", 'origin = "1,2,3"\n', "3")
    config("viewer", 'viewer = "web"\nviewer-port = 0\nviewer-hold = true\n')
    config("contradiction", "localize-only = true\nsave-map = 'a'\nload-map = 'b'\n")
    config("unknown", "colour = 1\n")
    config("itself", 'config = "other.toml"\n')
    config("help", "help = true\n")
    config("other_types", "frames = 'many'\nresolution = 1979-05-27T07:32:00Z\n")
    config("out_of_range", "resolution = nan\n")
    config("next_to_nothing", "read-out-ms = 1e-320\nsigma = 1e-320\n")
    config("infinite", "sigma = inf\n")
    config("huge", "frames = 9223372036854775807\n")
    config("negative", "seed = -1\n", "1")
    config("flag_number", "quiet = 3\ndeterministic = -1\n")
    config("table", "[resolution]\nvalue = 1\n")
    config("list", "topics = ['a', 'b']\n")
    config("twice", "frames = 1\nframes = 2\n")
    config("required", "out = ''\nDATASET = 'a'\n")
    config("lines", 'filter = "a\\nb"\n"key\\nwith\\nlines" = 1\n')
    config("letters", "k\u00e4se = 1\n")
    config("letters_quoted", "# k\u00e4se\n'k\u00e4se' = \"\u00e4\\\"\u00e4\"\n")
    config("letters_of_presentation", "\ufec1ing = 'off'\n")
    config("latin", b"out = '\xe4'\n")
    config("broken", "resolution 0.1\n")
    config("empty", "")


if __name__ == "__main__":
    images()
    clouds()
    texts()
    slam_maps()
    vocabularies()
    readers()
    bundles()
    pose_graphs()
    scans()
    edits()
    depth_images()
    compressed_depths()
    ros_messages()
    bags()
    configs()
