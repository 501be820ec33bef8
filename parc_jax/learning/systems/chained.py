"""Runs that begin while the robot moves: a chain of manoeuvres with random commands, each left for
the next while it is under way, of which the last is recorded. [T37]
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.spelling import counted, exact
from parc_jax.learning.labels import labels_of
from parc_jax.learning.runs.law import CHAIN, given_of
from parc_jax.learning.system import check_system
from parc_jax.learning.systems.user_code import blamed

LEFT = "each left after "  # before the times [s] in a law of k
METHODS = ("start_state", "measured", "rollout_from_state")


@dataclass(frozen=True, eq=False)
class Chained:
    """A system whose runs begin as the last of a chain of manoeuvres. Build with `chained`, which
    validates. All else is that of the system, runs of given k as well.

    before: manoeuvres before the recorded one. hand_over: [s] first and last time at which a
        manoeuvre is left for the next.
    """

    system: Any
    before: int
    hand_over: tuple[float, float]

    def __getattr__(self, name: str):
        if name == "system" or name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.system, name)

    @property
    def k_law(self) -> str:
        """How k is drawn, for a LawSpec."""
        begin, end = self.hand_over
        manoeuvres = counted(self.before, "manoeuvre")
        return f"{CHAIN}{manoeuvres} before it, {LEFT}{exact(begin)} to {exact(end)} s"

    @cached_property
    def leaves(self) -> np.ndarray:
        """(n_record + 1,) bool: the records at which a manoeuvre may be left."""
        record, step = np.arange(self.system.time.n_record + 1), self.system.time.dt_record
        begin, end = (round(at / step, 6) for at in self.hand_over)
        return (begin <= record) & (record <= end)


class ToRun(NamedTuple):
    """Runs to be made: keys (B, 2) of the systems and k (B, n_k) float64, exactly as the system
    gets it. states: begins of the last manoeuvres of chains; None = at rest, as k says. lost (B,):
    as of `Retried`, of the manoeuvres before; None = no run of theirs was made again.
    """

    keys: jax.Array
    k: np.ndarray
    states: Any = None
    lost: np.ndarray | None = None


def lost_in(out: Any, before: np.ndarray | None) -> np.ndarray | None:
    """`ToRun.lost` after further runs."""
    now = getattr(out, "lost", None)
    if now is None or before is None:
        return before if now is None else now
    return np.where((now < 0) | (before < 0), -1, now + before)


class Links(NamedTuple):
    """The parts of a chain, many at once: begin(keys) -> (states, g); go_on(keys, states, k) ->
    (Trajectory, states, g) with states and g at all records.
    """

    begin: Callable
    go_on: Callable


def chained(system, before: int = 3, hand_over: tuple[float, float] | None = None) -> Chained:
    """The system with runs that begin in states that manoeuvres leave behind, for `collect`,
    `bound_error` and all others that take a system. [T37]

    Each run is the last of a separate chain, so runs are independent: `before` manoeuvres with
    commands uniform on K follow a start at rest, each left at a record drawn uniformly among those
    whose measured parameters lie in K. hand_over: [s] the first and last time at which one is left;
    None = from the first record to its end.

    The system declares `given`, and offers, as JAX functions of one run,
        start_state(key) -> state: at rest; any pytree of arrays,
        measured(state) -> g (n_given,): in the order of `given`,
        rollout_from_state(key, state, k) -> (Trajectory, states): a manoeuvre from a state, in
            the frame of its pose, and the states at all n_record + 1 records, along a leading axis.
    One with `rollout_batch` offers them for batches: keys, states and k have a leading axis, states
    at records a second one. Raises InputError.
    """
    check_system(system)
    missing = [name for name in METHODS if not callable(getattr(system, name, None))]
    if missing or not given_of(system):
        raise InputError(
            f"chained: expected {system.name} to declare `given` and to offer "
            f"{', '.join(METHODS)}; it lacks {', '.join(missing) or 'given'}."
        )
    check_count("chained: before", before, 1, "3, the default")
    step, t_f = system.time.dt_record, system.time.t_f
    times = (step, t_f) if hand_over is None else hand_over
    begin, end = (float(at) for at in as_float64("chained hand_over", times, (2,)))
    made = Chained(system, int(before), (begin, end))
    if not (0 < begin and end <= t_f and made.leaves.any()):
        raise InputError(
            f"chained: expected hand_over, two times in (0, {t_f:g}] s with a record between them, "
            f"which come every {step:g} s; got {begin:g} and {end:g}."
        )
    return made


def hand_over_of(k_law: str) -> tuple[Fraction, Fraction] | None:
    """[s] `hand_over` of the chains that a law of k names, None where it names none."""
    said = re.match(rf"{CHAIN}.*{LEFT}(\S+) to (\S+) s", k_law)
    return None if said is None else (Fraction(said[1]), Fraction(said[2]))


def links_of(chain: Chained, traceable: bool) -> Links:
    """The parts, compiled where the system is JAX."""
    system = chain.system
    measured = jax.vmap(system.measured) if traceable else system.measured

    def go_on(keys, states, k):
        trajectory, states = system.rollout_from_state(keys, states, k)
        return trajectory, states, measured(states)

    def begin(keys):
        states = system.start_state(keys)
        return states, system.measured(states)

    if traceable:
        return Links(jax.jit(jax.vmap(begin)), jax.jit(jax.vmap(go_on)))
    return Links(begin, go_on)


def begun(chain: Chained, links: Links, k_keys, keys, lo: np.ndarray, hi: np.ndarray) -> ToRun:
    """Run all of a chain but its last manoeuvre, from keys (B, 2) of its commands and of its
    systems. lo, hi (n_k,): corners of K. Raises InputError where measured parameters leave K.
    """
    given = list(given_of(chain.system))
    with blamed(f"{chain.name}: expected start_state and measured to run"):
        states, g = links.begin(keys)
    inside, lost = partial(_inside, chain, lo[given], hi[given]), None
    _pick(chain, inside(np.asarray(g)[:, None], 1), np.zeros(len(keys)))
    for turn in range(chain.before + 1):
        drawn, share, run_keys = map(np.asarray, _draws(k_keys, keys, np.uint32(turn), lo, hi))
        k = np.array(drawn, np.float64)
        k[:, given] = np.asarray(g, np.float64)
        if turn == chain.before:
            break
        with blamed(f"{chain.name}: expected rollout_from_state(key, state, k) to run"):
            made, along, measured = links.go_on(run_keys, states, k)
        lost = lost_in(made, lost)
        measured = np.asarray(measured)
        record = _pick(chain, inside(measured, len(chain.leaves)) & chain.leaves, share)
        rows = np.arange(len(record))
        states = jax.tree.map(lambda x, at=(rows, record): np.asarray(x)[at], along)
        g = measured[rows, record]
    return ToRun(run_keys, k, states, lost)


def _inside(chain: Chained, lo, hi, g: np.ndarray, n: int) -> np.ndarray:
    """(B, n) bool: whether g (B, n, n_given) at n records lies in K. Raises InputError."""
    if g.shape[1:] != (n, len(lo)):
        raise InputError(
            f"{chain.name}: expected measured(state) to give {len(lo)} numbers, as many as `given` "
            f"has, of states at {counted(n, 'record')}; got shape {g.shape[1:]}."
        )
    return ((lo <= g) & (g <= hi)).all(axis=2)


def _pick(chain: Chained, fits: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(B,) a record of each row of fits (B, R), the one at a share in [0, 1) of those that fit.
    Raises InputError for a row without any.
    """
    count = fits.sum(axis=1)
    if not count.all():
        names = [labels_of(chain.system).k[axis] for axis in given_of(chain.system)]
        raise InputError(
            f"{chain.name}: expected what is measured ({', '.join(names)}) to be in K whenever a "
            f"manoeuvre may be left; {int((count == 0).sum())} of {len(fits)} chains never came "
            "back to it. Widen K, or leave manoeuvres later."
        )
    which = np.minimum((share * count).astype(int), count - 1)
    return np.argmax(np.cumsum(fits, axis=1) > which[:, None], axis=1)


@jax.jit
def _draws(k_keys, keys, turn, lo, hi):
    """Of one manoeuvre of chains: k (B, n_k) uniform on K, shares (B,) of [0, 1), keys (B, 2)."""

    def one(k_key, key):
        drawn = jax.random.uniform(jax.random.fold_in(k_key, turn), (len(lo) + 1,), lo.dtype)
        k = jnp.clip(lo + drawn[1:] * (hi - lo), lo, hi)
        return k, drawn[0], jax.random.fold_in(key, turn)

    return jax.vmap(one)(k_keys, keys)
