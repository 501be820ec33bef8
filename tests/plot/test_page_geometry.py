"""The geometry of the page, under node: gaps between convex sets in the plane and in space."""

import json
import subprocess

import numpy as np
import pytest
from scipy.optimize import minimize

from parc_jax.app.plot.page import FILES

pytestmark = pytest.mark.needs("node")


def said(script: str):
    """What a script with the geometry of the page in front prints as JSON."""
    program = f"{(FILES / 'geometry.js').read_text()}\n{script}"
    out = subprocess.run(["node", "-"], input=program, capture_output=True, text=True, check=True)
    return json.loads(out.stdout)


def gaps(pairs) -> list[dict]:
    """Gap and direction of pairs of point sets; in the plane of their hulls."""
    plain = json.dumps([[np.asarray(a).tolist(), np.asarray(b).tolist()] for a, b in pairs])
    script = "const of = (points) => (points[0].length === 2 ? hull(points) : points);"
    return said(
        f"{script} console.log(JSON.stringify({plain}.map((p) => separation(...p.map(of)))))"
    )


def distance(a, b) -> float:
    """Between the hulls of points a (v, n) and b (u, n), by another method."""

    def shares(x):
        x = np.maximum(x, 0)
        return x[: len(a)] / x[: len(a)].sum(), x[len(a) :] / x[len(a) :].sum()

    def size(x):
        u, v = x[: len(a)], x[len(a) :]
        return ((u @ a - v @ b) ** 2).sum()

    sums = [
        {"type": "eq", "fun": lambda x: x[: len(a)].sum() - 1},
        {"type": "eq", "fun": lambda x: x[len(a) :].sum() - 1},
    ]
    first = np.r_[np.full(len(a), 1 / len(a)), np.full(len(b), 1 / len(b))]
    bounds = [(0, 1)] * len(first)
    best = minimize(size, first, bounds=bounds, constraints=sums, method="SLSQP", tol=1e-14)
    u, v = shares(best.x)
    return float(np.linalg.norm(u @ a - v @ b))


@pytest.mark.parametrize("n_p", [2, 3])
def test_a_gap_is_the_distance_and_its_direction_keeps_it(rng, n_p):
    pairs = [
        (rng.normal(size=(8, n_p)), rng.normal(size=(6, n_p)) + rng.uniform(3, 6, n_p))
        for _ in range(40)
    ]
    for (a, b), got in zip(pairs, gaps(pairs), strict=True):
        w = np.array(got["w"])
        assert np.linalg.norm(w) == pytest.approx(1, abs=1e-12)
        assert (a @ w).min() - (b @ w).max() == pytest.approx(got["gap"], abs=1e-12)
        assert got["gap"] == pytest.approx(distance(a, b), abs=2e-6)


@pytest.mark.parametrize("n_p", [2, 3])
def test_sets_that_meet_have_no_gap(rng, n_p):
    pairs = []
    for _ in range(40):
        a, b = rng.normal(size=(7, n_p)), rng.normal(size=(5, n_p))
        pairs.append((a, b + rng.dirichlet(np.ones(7)) @ a - rng.dirichlet(np.ones(5)) @ b))
    assert max(got["gap"] for got in gaps(pairs)) < 1e-9


def test_sets_without_inside():
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    flat = [[*p, 0] for p in square]
    cases = [
        ([[3, 0.5]], square, 2.0),
        ([[0.2, 0.2], [0.8, 0.8]], square, -np.sqrt(0.5)),
        ([[2, -1], [2, 2]], [[0, 0], [1, 0]], 1.0),
        ([[0.5, 0.5, 2]], flat, 2.0),
        ([[2, 2, 0]], flat, np.sqrt(2)),
        ([[0.5, 0.5, 0.25], [0.5, 0.5, 3]], flat, 0.25),
        ([[0.2, 0.2, 1], [0.8, 0.8, 1]], [[0.2, 0.8, 0], [0.8, 0.2, 0]], 1.0),
    ]
    for got, (_, _, gap) in zip(gaps([case[:2] for case in cases]), cases, strict=True):
        assert got["gap"] == pytest.approx(gap, abs=1e-9)
    touching = gaps([(flat, [[0.5, 0.5, 0], [0.5, 0.5, 1]])])[0]
    assert touching["gap"] <= 1e-12
