"""Borders between bins: claim, polytope and sample must agree.

    python tests/checker/compare/two_borders.py answer.json \\
        [--program parc_jax/checker/proved/check]

The claim is about every closed bin that contains k. So a point of a polytope must pass as a sample
with the polytope's directions, also where its k is on a border or right beside it. Points are made
by moving inner points onto the faces of their bin and 2^-40 to either side; the Python checker's
rows say which of them belong to the polytope (none on a face that two bins share), the proved
checker says which are safe.
"""

import argparse
import itertools
import json
import sys
from fractions import Fraction as F
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

import answer_files as build
import two

from parc_jax import checker

NEAR = F(1, 2**40)


def faces(answer, piece):
    """(axis, edge, whether a neighbour shares it) of the bin of a piece."""
    number = piece["bin"]
    for axis, edges in reversed(list(enumerate(answer["tube"]["edges"]))):
        number, place = divmod(number, len(edges) - 1)
        for at in (place, place + 1):
            yield axis, build.value(edges[at]), 0 < at < len(edges) - 1


def members(answer, piece, context):
    """Points (p0, k) of a polytope on the faces of its bin and beside them, by the Python rows."""
    rows = context.set_rows(piece)
    n = len(piece["p0"])
    for (axis, edge, shared), step in itertools.product(faces(answer, piece), (-NEAR, F(0), NEAR)):
        x = [build.value(v) for v in piece["p0"] + piece["k"]]
        x[n + axis] = edge + step
        values = [(row[1], build.dot(row[2], x) + row[3]) for row in rows]
        if all(value > 0 if strict else value >= 0 for strict, value in values):
            yield shared and step == 0, x


def compare(program, answer):
    """(members on shared faces, members elsewhere, those that are refused as samples)."""
    context = checker.Context(answer["problem"], answer["network"], answer["tube"])
    found = [
        (piece, on, x) for piece in answer["sets"] for on, x in members(answer, piece, context)
    ]
    n = answer["problem"]["n_p"]
    samples = [
        {"p0": build.text(x[:n]), "k": build.text(x[n:]), "sep": piece["sep"]}
        for piece, _, x in found
    ]
    only = build.only({**answer, "corridors": []}, "samples", *samples)
    digits = two.Proved(program).verdicts([json.dumps(only)])[0]["entries"]["samples"]
    return sum(on for _, on, _ in found), sum(not on for _, on, _ in found), digits.count("0")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("answer", type=Path)
    parser.add_argument("--program", default=str(two.PROGRAM))
    arguments = parser.parse_args()
    answer = json.loads(arguments.answer.read_text())
    on, beside, refused = compare(arguments.program.split(), answer)
    print(f"{on} members on shared faces, {beside} others; refused as samples: {refused}")
    return 1 if refused or on else 0


if __name__ == "__main__":
    sys.exit(main())
