"""Training: Flax features, Optax steps, and the last layer in closed form (variable projection).

The outputs are linear in the last hidden features, so that layer is solved exactly inside the loss.
By the envelope theorem the gradient needs no derivative of the solve.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import flax.linen as nn
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Float

from parc_jax.common.errors import InputError, check_count, expected
from parc_jax.common.keys import Stage, stream
from parc_jax.common.shapes import Key
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.network.relu import Normalisation, ReLUNetwork, features, fold, outputs
from parc_jax.learning.runs.batch import RolloutBatch

# [mean feature power] keeps dead and twin features from making the last layer singular
RIDGE = 1e-5
LEARNING_RATE = 2e-2  # [normalised weights] peak step at width 8; wider layers take smaller ones
BATCH = 1000  # runs of a step
# initial biases spread the kinks over the data instead of stacking them at its mean
SPREAD = partial(jax.random.uniform, minval=-1.0, maxval=1.0)
HELD = 0.15  # share of the runs held out, by which the best network is chosen
# principal directions of the outputs in training; the final solve uses every output
COMPONENTS = 24


class Features(nn.Module):
    """The hidden layers: (B, n_k) normalised parameters -> (B, width) features."""

    hidden: tuple[int, ...]

    @nn.compact
    def __call__(self, x: Float[jax.Array, "b n_k"]):
        """Apply the hidden layers."""
        for width in self.hidden:
            dense = nn.Dense(width, kernel_init=nn.initializers.he_uniform(), bias_init=SPREAD)
            x = nn.relu(dense(x))
        return x


def train(
    data: RolloutBatch,
    hidden: Sequence[int] = (8, 8, 8, 8),
    *,
    key: Key,
    seeds: int = 8,
    steps: int = 3000,
) -> ReLUNetwork:
    """A ReLUNetwork k -> (c_1 ... c_T, q) fitted to `data` (RolloutBatch). [paper Sec. III-B]

    Trains `seeds` networks and returns the one with the smallest held-out tail error, which decides
    the width of the tube. The FIT stream of `key` is used.
    """
    if not isinstance(data, RolloutBatch):
        raise InputError(expected("train", "a RolloutBatch", data, "collect(system, key, n=1000)"))
    if not isinstance(hidden, tuple | list) or not hidden:
        widths = "the widths of at least one hidden layer"
        raise InputError(expected("train", widths, hidden, "hidden=(8, 8, 8, 8)"))
    counts = (*(("hidden", width) for width in hidden), ("seeds", seeds))
    for name, count in counts:
        check_count(f"train: {name}", count, 1, "hidden=(8, 8, 8, 8), seeds=8")
    k, y = training_arrays(data)
    n_fit = max(1, round(len(k) * (1 - HELD)))
    names = data.subject.labels.k
    norm = Normalisation.of(k[:n_fit], y[:n_fit], layout_of(data).n_offsets, names)
    x, targets = norm.inputs(k).astype(np.float32), norm.outputs(y[:n_fit])
    # along their leading principal directions, unwhitened (metres stay metres)
    _, vectors = np.linalg.eigh(targets.T @ targets / len(targets))
    targets = (targets @ vectors[:, ::-1][:, :COMPONENTS]).astype(np.float32)
    keys = jax.random.split(stream(key, Stage.FIT), seeds)
    batch = min(BATCH, n_fit)

    def one_seed(seed_key: jax.Array):
        # Optax mixes dtypes that a strict caller would refuse
        with jax.numpy_dtype_promotion("standard"):
            params = _fit_features(seed_key, x[:n_fit], targets, tuple(hidden), steps, batch)
        return _finish(jax.device_get(params), norm, k[:n_fit], y[:n_fit])

    with ThreadPoolExecutor(max_workers=min(seeds, os.cpu_count() or 1)) as pool:
        nets = list(pool.map(one_seed, list(keys)))
    held = slice(n_fit, None) if n_fit < len(k) else slice(None)
    return nets[int(np.argmin([tail_of(net, k[held], y[held]) for net in nets]))]


def training_arrays(data: RolloutBatch) -> tuple[np.ndarray, np.ndarray]:
    """k (n, n_k), targets (n, n_out) as in `Layout`, of finite runs. Raises InputError."""
    knots = np.asarray(data.p[:, :: data.time.stride], np.float64)
    offsets = knots.reshape(len(knots), -1)[:, data.n_p :]
    y = np.concatenate([offsets, np.asarray(data.q, np.float64)], axis=1)
    finite = np.isfinite(y).all(axis=1)
    if finite.sum() < 10:
        raise InputError(
            f"train: expected at least 10 finite rollouts; got {int(finite.sum())} of {len(y)}."
        )
    return np.asarray(data.k, np.float64)[finite], y[finite]


@partial(jax.jit, static_argnames=("hidden", "steps", "batch"))
def _fit_features(
    key: jax.Array,
    x: Float[jax.Array, "n n_k"],
    targets: Float[jax.Array, "n m"],
    hidden: tuple[int, ...],
    steps: int,
    batch: int,
):
    """Hidden parameters after `steps` minibatch updates. x (n, n_k), targets (n, m)."""
    model = Features(hidden)
    key_init, key_rows = jax.random.split(key)
    params = model.init(key_init, x[:1])
    peak = LEARNING_RATE * (8 / max(8, *hidden)) ** 0.5
    schedule = optax.cosine_onecycle_schedule(steps, peak, pct_start=0.1)
    optimiser = optax.chain(optax.clip_by_global_norm(1.0), optax.adam(schedule))

    def loss(params, xb, tb):
        hidden = jnp.asarray(model.apply(params, xb))
        hidden = jnp.concatenate([hidden, jnp.ones((len(hidden), 1), hidden.dtype)], axis=1)
        # the loss is at its minimum over the last layer: its derivative there is zero
        return jnp.mean((hidden @ jax.lax.stop_gradient(_solve_last(hidden, tb)) - tb) ** 2)

    def step(carry, step_key):
        params, state = carry
        rows = jax.random.randint(step_key, (batch,), 0, x.shape[0])
        grads = jax.grad(loss)(params, x[rows], targets[rows])
        updates, state = optimiser.update(grads, state)
        return (optax.apply_updates(params, updates), state), None

    (params, _), _ = jax.lax.scan(
        step, (params, optimiser.init(params)), jax.random.split(key_rows, steps)
    )
    return params


def _solve_last(features: Float[jax.Array, "n width"], targets: Float[jax.Array, "n m"]):
    gram = features.T @ features / features.shape[0]
    gram += RIDGE * (jnp.trace(gram) / len(gram) + 1) * jnp.eye(len(gram), dtype=gram.dtype)
    return jax.scipy.linalg.cho_solve(
        jax.scipy.linalg.cho_factor(gram), features.T @ targets / features.shape[0]
    )


def _finish(
    params: dict,
    norm: Normalisation,
    k: Float[np.ndarray, "n n_k"],
    y: Float[np.ndarray, "n n_out"],
) -> ReLUNetwork:
    """The last layer by float64 least squares on all rows, then the normalisation folded in."""
    layers = params["params"]
    weights = [np.asarray(layers[f"Dense_{i}"]["kernel"], np.float64).T for i in range(len(layers))]
    biases = [np.asarray(layers[f"Dense_{i}"]["bias"], np.float64) for i in range(len(layers))]
    h = features(weights, biases, norm.inputs(k))
    h = np.concatenate([h, np.ones((len(h), 1))], axis=1)
    last = np.linalg.lstsq(h, norm.outputs(y), rcond=1e-10)[0]
    return fold([*weights, last[:-1].T], [*biases, last[-1]], norm)


def tail_of(net: ReLUNetwork, k: np.ndarray, y: np.ndarray) -> float:
    """Mean over a grid of K of the largest error [m] in each cell, so that one jump does not
    decide; of targets y (n, n_out) at k (n, n_k).
    """
    worst = np.abs(outputs(net, k) - y).max(axis=1)
    bins = 6  # along every axis
    span = np.ptp(k, axis=0)
    share = (k - k.min(axis=0)) / np.where(span > 0, span, 1)
    cell = np.minimum((share * bins).astype(int), bins - 1)
    number = np.ravel_multi_index(cell.T, (bins,) * k.shape[1])
    largest = np.full(bins ** k.shape[1], -np.inf)
    np.maximum.at(largest, number, worst)
    return float(largest[np.isfinite(largest)].mean())
