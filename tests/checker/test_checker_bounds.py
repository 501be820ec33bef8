"""Bounds of the network over a box, exact: below everything it says there, and as good as the
search believes.
"""

import itertools
import json
import random
from fractions import Fraction as F

import answer_files as build
import jax
import known
import numpy as np
import pytest
from exact_cells import cells, context, random_layers

from parc_jax import checker
from parc_jax.checker.bounds import LINE_BITS, OverBox, line
from parc_jax.common.arrays import x64
from parc_jax.proof.absence.bounds import ranges_of_rows


def bounds(weights, biases, lo, hi, row):
    """Exact lower bound of a row of the outputs."""
    over_box = OverBox(context(weights, biases, [-2] * len(lo), [2] * len(lo)))
    over_box.enter([F(v) for v in lo], [F(v) for v in hi])
    return F(*over_box.least(row))


def random_case(seed):
    """A network with two outputs, a box in [-2, 2]^n_k, and a row."""
    rng = random.Random(seed)
    n_k = rng.randint(1, 3)
    sizes = [n_k, *[rng.randint(2, 4) for _ in range(rng.randint(0, 3))], 2]
    weights, biases = random_layers(rng, sizes, bits=4)
    ends = [sorted((build.dyadic(rng, 2), build.dyadic(rng, 2))) for _ in range(n_k)]
    lo, hi = zip(*ends, strict=True)
    return weights, biases, lo, hi, [rng.randint(-3, 3), rng.randint(-3, 3)]


@pytest.mark.soundness
@pytest.mark.parametrize("seed", range(60))
def test_nothing_in_the_box_is_below_the_bound(seed):
    """The least over all vertices of all cells is the truth, exactly."""
    weights, biases, lo, hi, row = random_case(seed)
    values = [build.dot(row, y) for cell in cells(weights, biases, lo, hi) for _, y in cell]
    bound = bounds(weights, biases, lo, hi, row)
    assert bound <= min(values)
    if len(weights) == 1:  # no neuron: the bound is the truth
        assert bound == min(values)


@pytest.mark.parametrize(("lo", "hi"), [*itertools.combinations((-7, -3, -1, 0, 2, 5, 9), 2)])
@pytest.mark.parametrize("scale", [1, 3, 1 << 50])
def test_lines_enclose_a_neuron_at_the_ends_and_at_its_bend(lo, hi, scale):
    below, above, height = line(lo, hi, scale)
    for x in {F(lo, scale), F(hi, scale), F(max(lo, min(hi, 0)), scale)}:
        assert below * x <= max(x, 0)
        assert above * x + height >= max(x, 0) * 2**LINE_BITS


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_the_search_and_the_checker_find_the_same_bounds(seed):
    """Up to float64 and the binary digits of lines."""
    weights, biases, lo, hi, row = random_case(seed)
    arrays = [np.array(W, float) for W in weights], [np.array(b, float) for b in biases]
    layers = list(zip(arrays[0][:-1], arrays[1][:-1], strict=True))
    with x64():
        rows = np.array([row], float) @ arrays[0][-1]
        constant = np.array([row], float) @ arrays[1][-1]
        ends = np.array(lo, float), np.array(hi, float)
        least, most = jax.jit(ranges_of_rows)(layers, rows, constant, *ends)
    assert float(least[0]) == pytest.approx(float(bounds(weights, biases, lo, hi, row)), abs=1e-9)
    negative = bounds(weights, biases, lo, hi, [-x for x in row])
    assert float(most[0]) == pytest.approx(-float(negative), abs=1e-9)


@pytest.mark.parametrize(("b", "holds"), [("-11.7500001", True), ("-11.75", False)])
def test_a_bound_that_is_known_by_hand(b, holds):
    """See `known.folded`: a plan that starts at b itself is not excluded."""
    answer = json.loads(json.dumps(known.folded(b)))
    if holds:
        assert checker.check_answer(answer).no_plan["undecided"] == "0"
    else:
        with pytest.raises(checker.Rejected, match="fails at one of its vertices"):
            checker.check_answer(answer)


def test_bounds_cost_work():
    """A small file cannot ask for long work by bounds either."""
    weights, biases, lo, hi, _ = random_case(7)
    scene = context(weights, biases, [-2] * len(lo), [2] * len(lo))
    scene.work_left = 10
    with pytest.raises(checker.Rejected, match="more work"):
        OverBox(scene).enter(list(lo), list(hi))
