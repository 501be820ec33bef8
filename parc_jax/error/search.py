"""Looking for bad runs on purpose: what is found can only make the tube wider. [T8]"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import x64
from parc_jax.error.calibrate import scaled
from parc_jax.error.claim import ErrorClaim, weaker
from parc_jax.error.measure import allowance, measure_arrays, rollout_errors
from parc_jax.error.score import bins_of, check_shape, score_errors
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage, stream
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.simulate import Rows, simulator

_ELITE = 0.1  # share of all runs so far that have children
_FRESH_K, _FRESH_KEY = 0.2, 0.5  # share of children that start anew in K; that meet a new disturbance
_WIDEST, _NARROWEST = 0.2, 0.005  # spread of children around their parent, as a share of K, first and last round


class Attack(NamedTuple):
    """All runs that a search tried: k (m, n_k), keys (m, 2) of the system, score (m,) against the shape, in order."""

    k: np.ndarray
    keys: np.ndarray
    score: np.ndarray

    @property
    def best(self) -> int:
        """Index of the worst finite run."""
        return int(np.argmax(np.where(np.isfinite(self.score), self.score, -np.inf)))


def search_worst(
    net: ReLUNetwork, system, key: jax.Array, shape: Tube, runs: int = 1024, rounds: int = 8, gradients: bool = False
) -> Attack:
    """Cross-entropy search for the largest score over k and the disturbance, from the SEARCH stream of `key`.

    Each round runs a batch on the device: children of the best tenth so far (k perturbed, the spread shrinking from
    round
    to round; half keep their parent's disturbance, half meet a new one) and fresh k. gradients: a third of the children
    step along the derivative of the score in k instead, taken forward through the system, which must be differentiable.
    Proves nothing; see `enlarge`. Raises InputError.
    """
    if runs < rounds or rounds < 1:
        raise InputError(f"search: expected runs >= rounds >= 1; got {runs} runs in {rounds} rounds.")
    check_shape(net, shape, system.time, system.n_p)
    sim, slack = simulator(system), allowance(net, system.domain, system.time, system.n_p)
    slopes = _slope_function(net, system) if gradients else None
    rng = np.random.default_rng(np.asarray(jax.random.key_data(stream(key, Stage.SEARCH)), np.uint32))
    lo, hi = np.asarray(system.domain.lo), np.asarray(system.domain.hi)
    batch, tried = runs // rounds, Attack(np.zeros((0, len(lo))), np.zeros((0, 2), np.uint32), np.zeros(0))
    for number in range(rounds):
        drawn = sim.rows(key, Stage.SEARCH, np.arange(number * batch, (number + 1) * batch))
        k, keys = drawn.k, np.asarray(jax.random.key_data(drawn.keys))
        if number:
            spread = _WIDEST * (_NARROWEST / _WIDEST) ** (number / max(1, rounds - 1))
            k, keys = _children(rng, tried, k, keys, spread * (hi - lo), lo, hi)
            if gradients:
                third = slice(0, batch // 3)
                step = _uphill(slopes, shape, keys[third], k[third]) * spread * (hi - lo)
                k[third] = np.clip(k[third] + step, lo, hi)
        k, keys, score = _run(sim, net, slack, shape, k, keys)
        tried = Attack(*(np.concatenate(pair) for pair in zip(tried, (k, keys, score), strict=True)))
    return tried


def enlarge(claim: ErrorClaim, shape: Tube, attack: Attack) -> ErrorClaim:
    """The claim with its tube widened, bin by bin, to hold every finite run of the attack; all labels stay true. [T8]

    Failed runs cannot be held by any tube; their number is put on record.
    """
    finite = np.isfinite(attack.score)
    scale = np.zeros(shape.n_bins)
    for column in bins_of(shape, attack.k[finite]).T:
        np.maximum.at(scale, column, attack.score[finite])
    held = scaled(shape, scale, np.asarray(claim.intersample))
    wider = tube(shape.edges, np.maximum(claim.tube.interval, held.interval), np.maximum(claim.tube.final, held.final))
    grown = int((wider.interval > claim.tube.interval).any(axis=(1, 2)).sum())
    found = {"runs": len(attack.score), "failed": int((~finite).sum()), "bins_widened": grown}
    if finite.any():
        found |= {"score": float(attack.score[attack.best]).hex(), "k": [float(x).hex() for x in attack.k[attack.best]]}
    return weaker(claim, wider, search=found)


def _children(rng, tried: Attack, k, keys, spread, lo, hi):
    """Replace most of a fresh batch by children of the best runs so far; failed runs are as good as any."""
    elite = np.argsort(-tried.score, kind="stable")[: max(1, int(_ELITE * len(tried.score)))]
    parent = rng.choice(elite, len(k))
    child = np.clip(tried.k[parent] + rng.normal(size=k.shape) * spread, lo, hi)
    is_fresh = rng.random(len(k)) < _FRESH_K
    new_key = is_fresh | (rng.random(len(k)) < _FRESH_KEY)
    return np.where(is_fresh[:, None], k, child), np.where(new_key[:, None], keys, tried.keys[parent])


def _run(sim, net, slack, shape, k, keys):
    k = sim.as_run(k)
    trajectory = sim.run(Rows(jnp.asarray(keys), k))
    errors = measure_arrays(net, slack, sim.system.time, k, trajectory.p, trajectory.q)
    return k, keys, score_errors(errors, shape, k)[0]


def _uphill(slopes, shape, keys, k):
    """Signs (B, n_k) of the derivative of the score in k; zero where it is not finite."""
    numbers = bins_of(shape, k)[:, 0]
    with x64():
        widths = (jnp.asarray(shape.interval[numbers]), jnp.asarray(shape.final[numbers]))
        return np.nan_to_num(np.sign(np.asarray(slopes(jnp.asarray(k), jnp.asarray(keys), widths))))


def _slope_function(net, system):
    """(k (B, n_k), keys (B, 2), widths) -> derivatives (B, n_k) of the scores, taken forward through the system."""

    def score(k, key, widths):
        p, q = system.rollout(key, k)
        errors = rollout_errors(net, k, p, q, stride=system.time.stride)
        return jnp.maximum((errors.interval / widths[0]).max(), (errors.final / widths[1]).max())

    return jax.jit(jax.vmap(jax.jacfwd(score)))
