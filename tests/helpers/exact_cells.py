"""Small exact networks, and what the checker finds in them: no scene."""

import itertools
from fractions import Fraction as F

import answer_files as build

from parc_jax import checker
from parc_jax.checker import cells as found_cells


def context(weights, biases, lo, hi):
    """The checker's context of a network without a scene."""
    n_k, n_y = len(weights[0][0]), len(biases[-1])
    problem = {"n_p": 1, "points": 1, "n_q": n_y - 1, "n_k": n_k, "steps": 1, "dt": "1"}
    problem |= {"domain": {"lo": build.text(lo), "hi": build.text(hi)}}
    problem |= {"goal": {"A": [], "b": []}, "start": None, "obstacles": []}
    problem |= {"body": build.one_part({"radius": "0"})}
    tube = {"edges": build.text([[a, b] for a, b in zip(lo, hi, strict=True)])}
    tube |= {"interval": [[[["0"]]]], "final": [["0"] * n_y]}
    return checker.Context(
        problem, {"weights": build.text(weights), "biases": build.text(biases)}, tube
    )


def cells(weights, biases, lo, hi):
    """Cells as lists of (vertex, outputs) in fractions."""
    scene = context(weights, biases, lo, hi)
    for cell in found_cells.network_cells(scene, [F(v) for v in lo], [F(v) for v in hi]):
        found = []
        for p, (_, hidden, scale) in cell.items():
            (y,), scale = scene.outputs([hidden], scale)
            found.append(([F(x, p[-1]) for x in p[:-1]], [F(v, scale) for v in y]))
        yield found


def random_layers(rng, sizes, bits=8):
    weights = [
        [[build.dyadic(rng, 1, bits) for _ in range(a)] for _ in range(b)]
        for a, b in itertools.pairwise(sizes)
    ]
    return weights, [[build.dyadic(rng, F(1, 2), bits) for _ in range(b)] for b in sizes[1:]]
