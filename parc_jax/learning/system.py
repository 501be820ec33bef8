"""Interface of a black box: a domain of manoeuvre parameters, a time grid, and a rollout."""

from typing import NamedTuple, Protocol, runtime_checkable

import jax
import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, is_text
from parc_jax.common.sets.box import Box


class Trajectory(NamedTuple):
    """One recorded run, relative to its start: p[0] = 0.

    p: (n_record + 1, n_p) workspace positions [m] on the record grid; of a robot with m reference
        points (n_record + 1, m, n_p), where only the first starts at 0. q: (n_q,) others, at t_f.
    """

    p: jax.Array | np.ndarray
    q: jax.Array | np.ndarray


class Retried(NamedTuple):
    """A `Trajectory` with a leading axis, of runs that may have been made again. lost: (B,) number
    of times that each was lost with its worker, or sent again for being slow; -1 for unknown.
    """

    p: np.ndarray
    q: np.ndarray
    lost: np.ndarray


@struct.dataclass
class TimeGrid:
    """Model knots every dt, records every dt_record to t_f. Built by `time_grid`, which validates.

    dt, t_f, dt_record: [s], static.
    """

    dt: float = struct.field(pytree_node=False)
    t_f: float = struct.field(pytree_node=False)
    dt_record: float = struct.field(pytree_node=False)

    @property
    def n_steps(self) -> int:
        """Number of intervals T between the T + 1 model knots."""
        return round(self.t_f / self.dt)

    @property
    def stride(self) -> int:
        """Records per model interval."""
        return round(self.dt / self.dt_record)

    @property
    def n_record(self) -> int:
        """Number of record steps; a trajectory has n_record + 1 samples."""
        return self.n_steps * self.stride


def time_grid(dt: float, t_f: float, dt_record: float | None = None) -> TimeGrid:
    """Validated grid: t_f a multiple of dt, dt a multiple of dt_record. Raises InputError."""
    dt, t_f, dt_record = as_float64(
        "time grid", [dt, t_f, dt if dt_record is None else dt_record], (3,)
    ).tolist()
    if not (0 < dt_record <= dt <= t_f):
        raise InputError(
            f"time grid: expected 0 < dt_record <= dt <= t_f; got {dt_record}, {dt}, {t_f} s."
        )
    for name, ratio in (("t_f / dt", t_f / dt), ("dt / dt_record", dt / dt_record)):
        if abs(ratio - round(ratio)) > 1e-9 * ratio:
            raise InputError(f"time grid: expected {name} to be a whole number; got {ratio:g}.")
    return TimeGrid(dt, t_f, dt_record)


class Layout(NamedTuple):
    """Order of the outputs of a network: offsets from p0 of n_points reference points in n_p
    dimensions at the knots 0 .. n_steps, knot by knot, point by point, without the first n_p (the
    first point starts at p0 itself); then further states q.
    """

    n_steps: int
    n_p: int
    n_points: int = 1

    @property
    def n_c(self) -> int:
        """Number of columns: the coordinates of all points at one knot."""
        return self.n_points * self.n_p

    @property
    def n_offsets(self) -> int:
        """Number of outputs before q."""
        return (self.n_steps + 1) * self.n_c - self.n_p


@runtime_checkable
class System(Protocol):
    """A black box, whether it offers `rollout` or `rollout_batch`: see `BlackBoxSystem`."""

    name: str
    domain: Box
    time: TimeGrid
    n_p: int
    n_q: int


@runtime_checkable
class BlackBoxSystem(System, Protocol):
    """Anything with these attributes can be certified. `rollout` takes one k and is vmapped here.

    A system is immutable: for another gust make another object. Attributes (nested), closures and
    the globals that its code names, of modules that it imports as it runs too, are compared at
    every call, and a system that was changed in place is compiled anew; a change that no object
    shows (a C library, `os.environ`, a file) or of a name made as it runs is missed.

    A system that is not JAX, or has a faster batch path, offers, instead of or beside `rollout`,
    `rollout_batch(keys (B, 2), ks (B, n_k)) -> Trajectory` with a leading batch axis.

    A body that turns, or has several parts, is described by reference points fixed to it: corners,
    rotor tips, the ends of a trailer. A system with several has `points`, a tuple of their names,
    and returns the places of all of them.

    A system in the plane whose runs turn with the heading at their start (about the start, with the
    same k and disturbance) may declare it: `rotation`, one word per state of q, TURNS for an angle
    that turns too, STAYS for all others. `rollout_headed(key, k, heading) -> Trajectory` tries it.

    A system whose manoeuvres begin while it moves has parameters that are measured at the start and
    not chosen, such as its speed: `given`, a tuple of their labels, names or numbers. Problems for
    its models must give their values, and its claims list HIDDEN_START; `chained` makes runs that
    begin where others were left. [T37]

    Pictures and messages use its p_labels (n_p,), q_labels (n_q,) and k_labels (n_k,), where it has
    them: names with units, such as "speed [m/s]".
    """

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """Run from rest at the origin, heading along x if it has one, with parameters k (n_k,).
        All randomness comes from `key`.
        """
        ...


TURNS = "turns"  # a goal state that is an angle from a fixed direction
STAYS = "stays"  # a goal state that does not depend on the heading at the start
LARGEST = 1e100  # number of a run or a parameter: squares and sums of larger ones overflow
ONE_POINT = ("reference",)  # name of the point of a system without names


def points_of(system) -> tuple[str, ...]:
    """Names of the reference points of a system. Raises InputError."""
    return check_points(getattr(system, "name", "system"), getattr(system, "points", ONE_POINT))


def check_points(owner: str, names) -> tuple[str, ...]:
    """Validated names of reference points. owner: for messages. Raises InputError."""
    fine = isinstance(names, tuple | list) and all(is_text(n) and n for n in names)
    if not fine or len(names) == 0 or len(set(names)) < len(names):
        raise InputError(
            f"{owner}: expected points, a tuple of distinct names on one line; got {names!r}."
        )
    return tuple(names)


def rotation_of(system) -> tuple[str, ...] | None:
    """Declared heading behaviour: a word per goal state; None for nothing. Raises InputError."""
    words = getattr(system, "rotation", None)
    return None if words is None else check_rotation(system.name, words, system.n_p, system.n_q)


def check_rotation(owner: str, words, n_p: int, n_q: int) -> tuple[str, ...]:
    """Validated words about the heading. Raises InputError."""
    fine = isinstance(words, tuple | list) and len(words) == n_q and {*words} <= {TURNS, STAYS}
    if not fine or n_p != 2:
        raise InputError(
            f"{owner}: expected rotation of a system in the plane, a tuple of {TURNS!r} or "
            f"{STAYS!r} for each of {n_q} goal states; got {words!r:.60} in {n_p}-D."
        )
    return tuple(words)


def check_system(system) -> None:
    """Refuse an object that is no black box. Raises InputError with the missing attribute."""
    if isinstance(system, type):
        name = system.__name__
        raise InputError(f"{name}: expected a system; got a class of them. Try {name}().")
    kinds = {"name": str, "domain": Box, "time": TimeGrid, "n_p": int, "n_q": int}
    for attribute, kind in kinds.items():
        value = getattr(system, attribute, None)
        if not isinstance(value, kind):
            raise InputError(
                f"{type(system).__name__}: expected a system with {attribute}, a {kind.__name__}; "
                f"got {type(value).__name__}. See `BlackBoxSystem`; logs come by `load_rollouts`."
            )
    if system.n_p < 1 or system.n_q < 0:
        raise InputError(
            f"{system.name}: expected n_p >= 1 and n_q >= 0; got {system.n_p} and {system.n_q}."
        )
    if system.name.startswith("file:"):
        raise InputError(f"{system.name}: expected a name that no log has, as file:…. Rename it.")
    largest = np.abs([system.domain.lo, system.domain.hi]).max()
    if not largest <= LARGEST:
        raise InputError(
            f"{system.name}: expected a domain with numbers up to {LARGEST:g}; got {largest:g}. "
            "Tell the parameters in a larger unit."
        )
    if not any(callable(getattr(system, name, None)) for name in ("rollout", "rollout_batch")):
        raise InputError(
            f"{system.name}: expected rollout(key, k) or rollout_batch(keys, ks); it has neither."
        )
    points_of(system)
