"""Measured errors against a loop over records, and against exact arithmetic."""

import itertools
from fractions import Fraction

import jax
import numpy as np
import pytest
from synthetic_plants import (
    exact,
    failing,
    noisy,
    plant,
    straight_network,
)
from turning_bar import Bar

from parc_jax.common.errors import InputError
from parc_jax.learning.bound.measure import (
    CHUNK,
    FEW,
    allowance,
    chunk_size,
    measure,
    rollout_errors,
)
from parc_jax.learning.network.predict import Layout, layout_of, trajectories
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.runs.collect import collect

KEY = jax.random.PRNGKey(0)
pytestmark = pytest.mark.soundness


def random_network(rng, sizes):
    weights = [rng.normal(size=(m, n)) for n, m in itertools.pairwise(sizes)]
    return relu_network(weights, [rng.normal(size=m) for m in sizes[1:]])


def textbook_errors(net, k, p, q, stride):
    """The definition, record by record."""
    T, n_p = (len(p) - 1) // stride, p.shape[1]
    out = k
    for i, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        out = W @ out + b
        out = np.maximum(out, 0) if i + 1 < len(net.weights) else out
    c = np.concatenate([np.zeros((1, n_p)), out[: T * n_p].reshape(T, n_p)])
    interval = np.zeros((T, n_p))
    for t in range(T):
        for j in range(stride + 1):  # both ends belong to the interval
            predicted = c[t] + (c[t + 1] - c[t]) * (j / stride)
            interval[t] = np.maximum(interval[t], np.abs(p[t * stride + j] - predicted))
    return interval, np.concatenate([np.abs(p[-1] - c[-1]), np.abs(q - out[T * n_p :])])


@pytest.mark.parametrize(("T", "stride"), [(4, 5), (1, 3), (7, 1)])
def test_errors_are_the_definition(rng, T, stride):
    batch = collect(plant(noisy, T, stride), KEY, 20, quiet=True)
    net = random_network(rng, (2, 5, 6, 2 * T + 1))
    errors, slack = measure(net, batch, chunk=8), allowance(net, batch.domain, layout_of(batch))
    for i in range(batch.n):
        interval, final = textbook_errors(net, batch.k[i], batch.p[i], batch.q[i], stride)
        np.testing.assert_allclose(errors.interval[i], interval + slack.interval, rtol=1e-12)
        np.testing.assert_allclose(errors.final[i], final + slack.final, rtol=1e-12)


def test_an_end_knot_counts_in_both_intervals():
    net, p = straight_network(4), np.zeros((21, 2))
    p[10] = [0.7, 0.0]  # the knot between intervals 1 and 2, and nowhere else
    errors_of = jax.jit(rollout_errors, static_argnames="layout")
    interval, _ = errors_of(net, np.zeros(2), p, np.zeros(1), layout=Layout(4, 2))
    np.testing.assert_allclose(interval[:, 0], [0, 0.7, 0.7, 0])
    half_open = np.abs(p[:-1].reshape(4, 5, 2)).max(axis=1)  # the mistake this guards against
    assert half_open[1, 0] == 0


def test_the_allowance_covers_the_rounding_of_the_network(rng):
    batch = collect(plant(exact), KEY, 12, quiet=True)
    net = random_network(rng, (2, 8, 8, 9))
    slack = allowance(net, batch.domain, layout_of(batch))
    compiled = jax.jit(lambda net, k: net(k))
    assert 0 < slack.interval.max() < 1e-12
    for k in batch.k:
        x = [Fraction(v) for v in k]
        for i, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
            x = [
                sum((Fraction(w) * v for w, v in zip(row, x, strict=True)), Fraction(c))
                for row, c in zip(W, b, strict=True)
            ]
            x = [max(v, Fraction(0)) for v in x] if i + 1 < len(net.weights) else x
        rounded = np.asarray(compiled(net, k))
        true_gap = np.array(
            [float(abs(Fraction(float(r)) - v)) for r, v in zip(rounded, x, strict=True)]
        )
        assert (true_gap[:8].reshape(4, 2) <= slack.interval).all() and (
            true_gap[6:] <= slack.final
        ).all()


def test_failed_runs_have_infinite_errors():
    batch = collect(plant(failing), KEY, 200, quiet=True)
    errors = measure(straight_network(4), batch)
    assert batch.failed.any() and np.isinf(errors.interval[batch.failed]).all()
    assert np.isfinite(errors.interval[~batch.failed]).all()


def test_float32_storage_is_paid_for():
    wide = collect(plant(noisy), KEY, 50, quiet=True)
    narrow = collect(plant(noisy), KEY, 50, dtype=np.float32, quiet=True)
    net = straight_network(4)
    assert (measure(net, narrow).interval >= measure(net, wide).interval - 1e-16).all()
    unpaid = np.abs(narrow.p[:, -1].astype(float) - wide.p[:, -1])
    assert unpaid.max() > 1e-9  # there is something to pay


def test_a_network_of_the_wrong_shape_is_refused():
    batch = collect(plant(exact), KEY, 5, quiet=True)
    with pytest.raises(InputError, match="at least 8 outputs"):
        measure(straight_network(2), batch)


def test_errors_of_several_points_are_those_of_each(rng):
    runs = collect(Bar(), KEY, 12, quiet=True)
    layout = layout_of(runs)
    assert (layout.n_c, layout.n_offsets) == (4, 5 * 4 - 2)
    net = random_network(rng, (2, 6, layout.n_offsets + 1))
    errors, slack = measure(net, runs), allowance(net, runs.domain, layout)
    offsets, q = trajectories(net, layout, runs.k)
    knots, stride = np.arange(5) * runs.time.stride, runs.time.stride
    records = np.arange(runs.time.n_record + 1)
    for i in range(runs.n):
        for column in range(4):
            predicted = np.interp(records, knots, offsets[i, :, column])
            gap = np.abs(runs.p[i, :, column] - predicted)
            worst = [gap[t * stride : (t + 1) * stride + 1].max() for t in range(4)]
            want = worst + slack.interval[:, column]
            np.testing.assert_allclose(errors.interval[i, :, column], want, rtol=1e-12)
        last = np.abs(np.concatenate([runs.p[i, -1] - offsets[i, -1], runs.q[i] - q[i]]))
        np.testing.assert_allclose(errors.final[i], last + slack.final, rtol=1e-12)
    # the first point starts where the plan says; the others only where the network says
    assert (offsets[:, 0, :2] == 0).all() and (offsets[:, 0, 2:] != 0).all()


def test_however_many_runs_there_are_two_programs_measure_them():
    assert {chunk_size(n) for n in range(1, 1000)} == {FEW, CHUNK}
