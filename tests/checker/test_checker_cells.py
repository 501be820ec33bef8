"""Cells of the network, exact: they tile the box, the network is affine on each, and volumes add
up.
"""

import random
from fractions import Fraction as F

import answer_files as build
import known
import numpy as np
import pytest
import tree_search
from exact_cells import cells, random_layers

from parc_jax import checker


def area(points):
    """Exact area of a convex polygon given by its vertices in any order."""
    centre = [sum(x) / len(points) for x in zip(*points, strict=True)]
    points = sorted(
        points, key=lambda p: np.arctan2(float(p[1] - centre[1]), float(p[0] - centre[0]))
    )
    return (
        sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, points[1:] + points[:1], strict=True))
        / 2
    )


def duplicates(rng):
    weights, biases = random_layers(rng, (2, 4, 4, 2))
    weights[0][1], biases[0][1] = weights[0][0], biases[0][0]
    weights[0][2], biases[0][2] = [-x for x in weights[0][0]], -biases[0][0]
    return weights, biases


def constants(rng):
    weights, biases = random_layers(rng, (2, 5, 3, 2))
    for i, bias in enumerate((F(1), F(-1), F(0))):
        weights[0][i], biases[0][i] = [F(0), F(0)], bias
    return weights, biases


def concurrent(rng):
    weights, biases = random_layers(rng, (2, 6, 3, 2))
    return weights, [[F(0)] * 6, *biases[1:]]


def integral(rng):
    draw = lambda n: [F(rng.randint(-1, 1)) for _ in range(n)]  # noqa: E731
    return [[draw(2) for _ in range(6)], [draw(6) for _ in range(4)], [draw(4)] * 2], [
        draw(6),
        draw(4),
        draw(2),
    ]


def nearly_parallel(rng):
    weights, biases = random_layers(rng, (2, 4, 3, 2))
    weights[0][1] = [x + F(1, 2**40) for x in weights[0][0]]
    biases[0][1] = biases[0][0]
    return weights, biases


def tiny(rng):
    weights, biases = random_layers(rng, (2, 4, 4, 2))
    weights[0] = [[x / 10**9 for x in row] for row in weights[0]]
    weights[1] = [[x * 10**9 for x in row] for row in weights[1]]
    biases[0] = [x / 10**9 for x in biases[0]]
    return weights, biases


def ordinary(rng):
    return random_layers(rng, (2, 6, 6, 2))


FAMILIES = [ordinary, duplicates, constants, concurrent, integral, nearly_parallel, tiny]


@pytest.mark.parametrize("family", FAMILIES)
def test_cells_tile_the_box_and_the_network_is_affine_on_each(family):
    """Areas are positive and add up exactly; at random mixtures of vertices the network is the
    mixture [T16, T17].
    """
    for seed in range(4):
        rng = random.Random(seed)
        weights, biases = family(rng)
        network, total = {"weights": build.text(weights), "biases": build.text(biases)}, F(0)
        for cell in cells(weights, biases, (-1, -1), (1, 1)):
            vertices = [p for p, _ in cell]
            size = area(vertices)
            assert size > 0
            total += size
            share = [F(rng.randint(1, 9)) for _ in cell]
            share = [v / sum(share) for v in share]
            mixed = [build.dot(share, column) for column in zip(*vertices, strict=True)]
            outputs = [
                build.dot(share, column) for column in zip(*(y for _, y in cell), strict=True)
            ]
            assert build.evaluate(network, mixed)[1] == outputs
        assert total == 4


def test_cells_of_known_networks():
    """|x| + |y| has four cells; n lines in general position that cross inside the box 1 + n + n (n
    - 1) / 2.
    """
    unit = [[F(1), F(0)], [F(-1), F(0)], [F(0), F(1)], [F(0), F(-1)]]
    found = list(cells([unit, [[F(1)] * 4]], [[F(0)] * 4, [F(0)]], (-1, -1), (1, 1)))
    assert len(found) == 4
    assert {tuple(p): y for cell in found for p, y in cell} == {
        (x, y): [abs(x) + abs(y)] for x in (F(-1), F(0), F(1)) for y in (F(-1), F(0), F(1))
    }
    for n in (1, 2, 5, 9):
        slopes = [(F(1), F(i, n)) for i in range(n)]
        biases = [[-F(i * i, 4 * n * n) for i in range(n)], [F(0)]]
        assert (
            len(list(cells([slopes, [[F(1)] * n]], biases, (-2, -2), (2, 2))))
            == 1 + n + n * (n - 1) // 2
        )


@pytest.mark.parametrize("n_k, bits", [(1, 8), (3, 8), (4, 8), (3, 0), (4, 0)])
def test_cells_in_other_dimensions_tile_the_box(n_k, bits):
    """Volumes by an independent float hull add up, also with weights -1, 0, 1, and the network is
    affine on each.
    """
    from scipy.spatial import ConvexHull

    rng = random.Random(n_k)
    weights, biases = random_layers(rng, (n_k, 5, 4, 1), bits)
    network, total = {"weights": build.text(weights), "biases": build.text(biases)}, 0.0
    for cell in cells(weights, biases, [-1] * n_k, [1] * n_k):
        points = np.array([[float(x) for x in p] for p, _ in cell])
        total += np.ptp(points) if n_k == 1 else ConvexHull(points, qhull_options="QJ Pp").volume
        middle = [sum(x) / len(cell) for x in zip(*(p for p, _ in cell), strict=True)]
        mean = [sum(y) / len(cell) for y in zip(*(y for _, y in cell), strict=True)]
        assert build.evaluate(network, middle)[1] == mean
    assert total == pytest.approx(2**n_k, rel=1e-6)


@pytest.mark.slow
def test_volumes_of_a_bracket_add_up():
    answer, names = build.scene(1, T=4, hidden=(3,), counts=(0, 0, 0)), set()
    answer["no_plan"] = tree_search.grow(
        answer["problem"], answer["network"], answer["tube"], depth=5
    )
    for case in (answer, known.bracket()):
        report, plan, sizes = checker.check_answer(case).no_plan, case["no_plan"], {}
        root = [
            build.value(plan["z"][side] + case["problem"]["domain"][side]) for side in ("lo", "hi")
        ]
        for name, lo, hi in tree_search.boxes(plan, *root):
            sizes[name] = sizes.get(name, 0) + tree_search.volume(lo, hi)
        unsafe = sum(sizes.get(name, 0) for name in ("goal", "start", "hit"))
        expected = [sizes.get("safe", 0), unsafe, sizes["open"]]
        assert [F(report[key]) for key in ("safe", "unsafe", "undecided")] == expected
        assert sum(sizes.values()) == tree_search.volume(*root)
        names |= set(sizes)
    assert names == {"goal", "start", "hit", "safe", "open"}


def test_a_proof_does_not_depend_on_how_boxes_are_cut():
    """Further cuts of any leaf of the hand-made bracket keep it valid, with the same volumes."""
    fresh = known.bracket()
    volumes = checker.check_answer(fresh).no_plan
    root = [
        build.value(fresh["no_plan"]["z"][side] + fresh["problem"]["domain"][side])
        for side in ("lo", "hi")
    ]
    leaves = [i for i, node in enumerate(fresh["no_plan"]["tree"]) if "split" not in node]
    for (_, lo, hi), place in zip(
        list(tree_search.boxes(fresh["no_plan"], *root)), leaves, strict=True
    ):
        for axis in range(3):
            tree = list(fresh["no_plan"]["tree"])
            at = build.text((lo[axis] + 2 * hi[axis]) / 3)
            tree[place : place + 1] = [{"split": [axis, at]}, tree[place], tree[place]]
            assert (
                checker.check_answer(fresh | {"no_plan": fresh["no_plan"] | {"tree": tree}}).no_plan
                == volumes
            )
