#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Converts the counts of count.c to a table of work and estimated times on a Raspberry Pi 4.

usage: table.py COUNTS.tsv... [--stages]
       table.py --lanes [--stages] NEON.tsv PORTABLE.tsv AVX2.tsv

Each file is the output of one program. Without --stages a row is the mean over the pieces between a label and "end"; with
--stages (slam.cpp) frames are split into the stages of `track`. With --lanes, the table shows the instructions of the same
program with three kinds of vector code, and those per lane relative to AVX2, whose vectors have 256 bits instead of 128.
"""
import csv
import sys

HERTZ = 1.5e9
# Cycles (fast, likely, slow). README.md states the sources.
MODEL = {
    "per instruction": (1 / 2.0, 1 / 1.5, 1 / 1.1),
    "wide": (0.0, 0.25, 0.5),  # a vector of 128 bits occupies its pipe for longer
    "slow": (5, 10, 18),  # divisions and roots
    "mispredicted": (11, 14, 17),
    "l2 hit": (6, 12, 19),
    "l2 hit, ahead": (1, 3, 7),
    "memory": (110, 150, 225),
    "memory, ahead": (20, 35, 75),
}


def milliseconds(c):
    l2_hits, l2_hits_ahead = c["l1"] - c["l2"], c["l2_hit_ahead"]
    amounts = {
        "per instruction": c["instructions"],
        "wide": c["wide"],
        "slow": c["slow"],
        "mispredicted": c["mispredicted"],
        "l2 hit": l2_hits - l2_hits_ahead,
        "l2 hit, ahead": l2_hits_ahead,
        "memory": c["l2"] - c["l2_ahead"],
        "memory, ahead": c["l2_ahead"],
    }
    return [1e3 / HERTZ * sum(amounts[k] * MODEL[k][i] for k in MODEL) for i in range(3)]


def read(name):
    with open(name, newline="") as file:
        rows = [(r.pop("label"), {k: int(v) for k, v in r.items()}) for r in csv.DictReader(file, delimiter="\t")]
    return rows


def difference(a, b):
    return {k: b[k] - a[k] for k in a}


def pieces(rows):
    """By label, the counts between it and the next "end"; nested pieces count for both."""
    found, begun = {}, []
    for label, counts in rows:
        if label == "end":
            name, before = begun.pop()
            found.setdefault(name, []).append(difference(before, counts))
        elif label not in ("clock", "exit"):
            begun.append((label, counts))
    found.pop("first", None)
    return found


def stages(rows):
    """The same for slam.cpp, which reads the clock before and after extraction, after tracking, and at the end of a frame.

    The first frame starts the map and has nothing to track or adjust: it is omitted. The insertion of its depth image
    into an empty octree has a separate row.
    """
    found = {}
    first = True
    frame, adjusting, clocks, adjusted = None, None, [], None
    other = []
    for label, counts in rows:
        if label == "frame":
            frame, clocks, adjusted = counts, [], None
        elif frame is not None:
            if label == "clock":
                clocks.append(counts)
            elif label == "adjust":
                adjusting = counts
            elif label == "end" and adjusting is not None:
                adjusted, adjusting = difference(adjusting, counts), None
            elif label == "end" and first:
                frame, first = None, False
            elif label == "end":
                found.setdefault("features", []).append(difference(clocks[0], clocks[1]))
                found.setdefault("tracking", []).append(difference(clocks[1], clocks[2]))
                rest = difference(clocks[2], counts)
                if adjusted is not None:
                    found.setdefault("keyframe: adjustment", []).append(adjusted)
                    found.setdefault("keyframe: rest of mapping", []).append(difference(adjusted, rest))
                else:
                    found.setdefault("no keyframe", []).append(rest)
                frame = None
        else:
            other.append((label, counts))
    for name, all_of in pieces(other).items():
        if name in ("insert", "correct"):
            found["live map: first " + name] = all_of[:1]
            all_of = all_of[1:]
        if all_of:
            found["live map: " + name] = all_of
    return found


def lanes(names, taken_apart):
    """Prints instructions of NEON, portable and AVX2 code, and the cost per lane relative to AVX2."""
    neon, portable, avx2 = (taken_apart(read(name)) for name in names)
    mean = lambda all_of: sum(c["instructions"] for c in all_of) / len(all_of) / 1e6
    print(f"{'':32} {'NEON':>9} {'portable':>9} {'AVX2':>9}   of a lane: {'NEON':>6} {'portable':>9}")
    for label in neon:
        if label in portable and label in avx2:
            n, p, a = mean(neon[label]), mean(portable[label]), mean(avx2[label])
            print(f"{label:32} {n:8.2f}M {p:8.2f}M {a:8.2f}M   {'':10} {n / a / 2:6.2f} {p / a / 2:9.2f}")


def main():
    names = [a for a in sys.argv[1:] if not a.startswith("--")]
    by_stage = "--stages" in sys.argv
    if not names:
        sys.exit(__doc__)
    if "--lanes" in sys.argv:
        if len(names) != 3:
            sys.exit("table.py: --lanes takes three files: NEON, portable, AVX2")
        return lanes(names, stages if by_stage else pieces)
    print(f"{'':32} {'pieces':>6} {'instr.':>8} {'vector':>7} {'wide':>7} {'slow':>6} {'mispr.':>7} "
          f"{'L1':>8} {'ahead':>6} {'L2':>8} {'ahead':>6} {'ms':>8} {'fast':>8} {'slow':>8}")
    for name in names:
        print(name)
        for label, all_of in (stages if by_stage else pieces)(read(name)).items():
            mean = {k: sum(c[k] for c in all_of) / len(all_of) for k in all_of[0]}
            fast, likely, slow = milliseconds(mean)
            share = lambda part, whole: f"{100 * mean[part] / max(1, mean[whole]):.0f} %"
            thousands = lambda k: f"{mean[k] / 1e3:.1f}k"
            print(f"  {label:30} {len(all_of):6} {mean['instructions'] / 1e6:7.2f}M {share('vector', 'instructions'):>7} "
                  f"{share('wide', 'instructions'):>7} {thousands('slow'):>6} {thousands('mispredicted'):>7} "
                  f"{thousands('l1'):>8} {share('l2_hit_ahead', 'l1'):>6} {thousands('l2'):>8} {share('l2_ahead', 'l2'):>6} "
                  f"{likely:8.1f} {fast:8.1f} {slow:8.1f}")


main()
