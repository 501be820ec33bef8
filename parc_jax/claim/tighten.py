"""Train a network on for the widths that a fitted tube pays for. [T26]

Such a tube holds the errors of every bin between pairs of faces about free centres. So it matters
neither how large errors are nor where their middle lies, only how far they spread within a bin.
Training runs alone are used: whatever network comes out, a claim is made about it as about any.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from parc_jax.arrays import x64
from parc_jax.claim.edges import choose_edges
from parc_jax.claim.fitting import MARGIN, with_principal_axes
from parc_jax.claim.profile import edges_of, training_errors
from parc_jax.claim.tube import zero_tube
from parc_jax.keys import Stage, stream
from parc_jax.network.predict import Layout, features, layout_of, outputs
from parc_jax.network.relu import ReLUNetwork, relu_network
from parc_jax.network.train import training_arrays
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.tolerances import TOLERANCES

POWER = 16.0  # of errors about the centre: close to half their range, and still smooth
TURNS = 3  # directions are learnt anew before each
STEPS = 300  # of one turn
PEAK = 3e-3  # [weights of a layer, root mean square] step at first, falling to zero
TOGETHER = 20  # bins whose widths a step sees
MOST = 512  # runs of a bin that a step sees
_NONE = 1e-30  # [m, 1]
AT_END = 0.2  # [mean over all knots] what the end counts: the goal shrinks by it


class _Runs(NamedTuple):
    """k (n, n_k), targets y (n, n_out); rows (n_bins, m) of them, filled up with the first one;
    counts (n_bins,) of those that are not.
    """

    k: np.ndarray
    y: np.ndarray
    rows: np.ndarray
    counts: np.ndarray


class _Along(NamedTuple):
    """Directions per bin: of all knots that are predicted, point by point (n_bins, S, R, n_p), and
    of the end (n_bins, 1, R, n_e).
    """

    during: np.ndarray
    at_end: np.ndarray


def fit_to_tube(net: ReLUNetwork, train: RolloutBatch, bins, *, key: jax.Array) -> ReLUNetwork:
    """The network trained on, all layers, so that the mean logarithm of the half widths of a fitted
    profile, margin and floor included, becomes small: over bins, knots, points, faces and the end.

    train: the training runs; no others may be used, or the claim's runs would not be fresh. bins:
    of the tube, as in `BoundSettings`; None = cut where the error of this network changes. The
    network that was given comes back if it is not worse. Uses the FIT stream of `key`. Raises
    InputError.
    """
    if bins is None:
        bins = choose_edges(*training_errors(net, train), train.domain)
    layout = layout_of(train)
    runs = _by_bin(train, layout, bins)
    layers = [(w, b) for w, b in zip(net.weights, net.biases, strict=True)]
    sizes = _sizes(net, runs.k)
    keys = jax.random.split(stream(key, Stage.FIT), TURNS)
    with x64(), jax.numpy_dtype_promotion("standard"):
        change = jax.tree.map(np.zeros_like, layers)
        state = _optimiser().init(change)
        for turn in keys:
            along = _directions(_moved(layers, sizes, change), runs, layout)
            change, state = _turn(turn, change, state, layers, sizes, runs, along, layout=layout)
        better = jax.device_get(_moved(layers, sizes, change))
        costs = [
            float(_whole_cost(one, runs, _directions(one, runs, layout), layout=layout))
            for one in (layers, better)
        ]
    if not costs[1] < costs[0]:
        return net
    return relu_network([w for w, _ in better], [b for _, b in better])


def _by_bin(train: RolloutBatch, layout: Layout, bins) -> _Runs:
    """The finite runs of every bin that has two or more: one run has no width."""
    k, y = training_arrays(train)
    n_end = layout.n_c + train.n_q
    frame = zero_tube(
        edges_of(train.domain, bins), layout.n_steps, layout.n_c, n_end, layout.n_points
    )
    order = np.argsort(own := frame.bin_of(k), kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(own[order])) + 1)
    parts = [rows for rows in parts if len(rows) > 1]
    counts = np.array([min(len(rows), MOST) for rows in parts])
    rows = np.array([np.resize(part[:MOST], counts.max()) for part in parts])
    return _Runs(k, y, rows, counts)


def _sizes(net: ReLUNetwork, k: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """The unit of a step of every weight and bias, so that units of k and of outputs do not matter:
    root mean squares of the weights of an input, at the last layer of an output.
    """
    last = len(net.weights) - 1
    found = []
    for number, (w, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        size = np.sqrt((w**2).mean(axis=int(number == last), keepdims=True))
        x = features(net.weights[:number], net.biases[:number], k)
        spread = (x @ w.T + b).std(axis=0)
        found.append((np.broadcast_to(size, w.shape), spread))
    return found


def _moved(layers, sizes, change):
    return jax.tree.map(lambda x, size, step: x + size * step, layers, sizes, change)


def _directions(layers, runs: _Runs, layout: Layout) -> _Along:
    """Axes and principal axes of the errors of every bin, as the profile has them."""
    layers = jax.device_get(layers)
    error = runs.y - outputs(relu_network([w for w, _ in layers], [b for _, b in layers]), runs.k)
    found = []
    for one in _parts(error, layout):
        spread = []
        for rows, count in zip(runs.rows, runs.counts, strict=True):
            seen = one[rows[:count]]
            seen = seen - seen.mean(axis=0)
            spread.append(np.einsum("msa,msb->sab", seen, seen) / count)
        found.append(with_principal_axes(np.array(spread)))
    return _Along(*found)


def _parts(error, layout: Layout):
    """Errors (..., n_out) as those at the knots, point by point (..., S, n_p), and at the end (...,
    1, n_e).
    """
    knots = error[..., : layout.n_offsets].reshape(*error.shape[:-1], -1, layout.n_p)
    return knots, error[..., None, layout.n_offsets - layout.n_c :]


def _optimiser():
    return optax.adam(optax.cosine_decay_schedule(PEAK, TURNS * STEPS))


@partial(jax.jit, static_argnames="layout")
def _turn(key, change, state, layers, sizes, runs: _Runs, along: _Along, *, layout: Layout):
    """Change and state of the optimiser after STEPS steps on bins drawn at random."""
    together = min(TOGETHER, len(runs.counts))

    def loss(change, bins):
        return _cost(_moved(layers, sizes, change), runs, along, bins, layout)

    def step(carry, step_key):
        change, state = carry
        bins = jax.random.choice(step_key, len(runs.counts), (together,), replace=False)
        updates, state = _optimiser().update(jax.grad(loss)(change, bins), state)
        return (optax.apply_updates(change, updates), state), None

    return jax.lax.scan(step, (change, state), jax.random.split(key, STEPS))[0]


@partial(jax.jit, static_argnames="layout")
def _whole_cost(layers, runs: _Runs, along: _Along, *, layout: Layout):
    def of_bin(bin):
        return _cost(layers, runs, along, bin[None], layout)

    return jax.lax.map(of_bin, jnp.arange(len(runs.counts))).mean()


def _cost(layers, runs: _Runs, along: _Along, bins, layout: Layout):
    """Mean logarithm of the half widths in some bins."""
    k, y, rows, counts = (jnp.asarray(x) for x in runs)
    along = [jnp.asarray(u) for u in along]

    def of_bin(rows, count, *along):
        return _cost_of_bin(layers, k[rows], y[rows], jnp.arange(len(rows)) < count, along, layout)

    return jax.vmap(of_bin)(rows[bins], counts[bins], *(u[bins] for u in along)).mean()


def _cost_of_bin(layers, k, y, own, along, layout: Layout):
    """Of runs k (m, n_k), y (m, n_out), of which own (m,) count; along: during (S, R, n_p), at_end
    (1, R, n_e). Kernel.
    """
    for w, b in layers[:-1]:
        k = jax.nn.relu(k @ w.T + b[None])
    error = y - (k @ layers[-1][0].T + layers[-1][1][None])
    total = 0.0
    for u, one, share in zip(along, _parts(error, layout), (1.0, AT_END), strict=True):
        half = _half_widths(u, one, own)
        # the margin of the profile: at knots of the mean over all of them
        width = half[:, : u.shape[-1]].mean(axis=0)
        more = jnp.abs(u) @ (MARGIN * width + TOLERANCES.profile_floor)
        total = total + share * jnp.log(half + more).mean()
    return total


def _half_widths(u, error, own):
    """(S, R) power means, about the middle of their range, of the errors (m, S, n) along u (S, R,
    n). Kernel.
    """
    off = jnp.einsum("srn,msn->msr", u, error)
    off = off - 0.5 * (off.max(axis=0) + off.min(axis=0))[None]
    largest = jax.lax.stop_gradient(jnp.abs(off).max(axis=0)) + _NONE
    powers = jnp.where(own[:, None, None], jnp.abs(off / largest[None]), 0.0) ** POWER
    # errors that are all the same have no width, but their root must have a slope
    return largest * (powers.sum(axis=0) / own.sum(dtype=off.dtype) + _NONE) ** (1 / POWER)
