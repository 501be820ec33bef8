"""Borders between bins: claim, polytope and sample must agree.

The claim is about every closed bin that contains k. So a point of a polytope must pass as a sample
with the polytope's directions, also where its k is on a border or right beside it. Points are made
by moving inner points onto the faces of their bin and 2^-40 to either side; the Python checker's
rows say which of them belong to the polytope (none on a face that two bins share), the proved
checker says which are safe.
"""

import itertools
import json
from fractions import Fraction as F

import answer_files as build
from rows_of_sets import set_rows

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
    rows = set_rows(context, piece)
    n = len(piece["p0"])
    for (axis, edge, shared), step in itertools.product(faces(answer, piece), (-NEAR, F(0), NEAR)):
        x = [build.value(v) for v in piece["p0"] + piece["k"]]
        x[n + axis] = edge + step
        values = [(row[1], build.dot(row[2], x) + row[3]) for row in rows]
        if all(value > 0 if strict else value >= 0 for strict, value in values):
            yield shared and step == 0, x


def batch(rng, left, valid):
    """The members as samples with the directions of their polytopes."""
    context = checker.Context(valid["problem"], valid["network"], valid["tube"])
    n, samples, shared = valid["problem"]["n_p"], [], []
    for piece in valid["sets"]:
        for on, x in members(valid, piece, context):
            shared.append(on)
            place = {"p0": build.text(x[:n]), "k": build.text(x[n:])}
            samples.append({**place, "sep": piece["sep"]})
    if samples:
        only = build.only({**valid, "corridors": []}, "samples", *samples)
        yield shared, json.dumps(only)


def judge(what, text, said):
    """No member is on a shared face, and every one is safe."""
    for i, (on, digit) in enumerate(zip(what, said["entries"]["samples"], strict=True)):
        yield digit == "1", None if digit == "1" and not on else (f"samples[{i}]", on, digit)
