"""The vertex realisations that stand for all: corners of the box in which k is executed, maps whose
mixtures are all turns, and the words for what a plan withstands. [T21, T22]

In between, the network is the same mixture of its values at the corners, but for its kinks
(`bend`).
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_down, round_up
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import listed
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.system import TURNS
from parc_jax.problem.doubt import FREE, Doubt, Interval, require_once

MOST = 64  # reference points that the checker takes, each execution with its own


class Parameter(NamedTuple):
    """What is known of one parameter when a plan is driven: the one record from which it is solved
    and told.

    known: what was "measured", or is "unknown", within value; None of one that a plan chooses. off:
    half width by which it is executed wrongly.
    """

    name: str
    known: str | None
    value: Interval
    off: float

    @property
    def box(self) -> Interval:
        """What an execution adds to a plan that chooses it, or the values that it has; rounded
        outward.
        """
        (lo, hi), off = self.value, Fraction(self.off)
        return round_down(Fraction(lo) - off), round_up(Fraction(hi) + off)

    @property
    def words(self) -> str:
        """Of one that is known: "every load from 1 to 2 (measured)"."""
        lo, hi = self.value
        if not self.off and lo == hi:
            return f"{self.name} = {told(lo)} ({self.known})"
        values = told(lo) if lo == hi else f"what is from {told(lo)} to {told(hi)}"
        if self.off:
            off = told(self.off)
            return f"every {self.name} within ±{off} of {values} ({self.known}, executed roughly)"
        return f"every {self.name} from {told(lo)} to {told(hi)} ({self.known})"


@dataclass(frozen=True, eq=False)
class Executions:
    """How plans are executed: what is known of each parameter, in the order of k."""

    parameters: tuple[Parameter, ...]

    @cached_property
    def chosen(self) -> tuple[int, ...]:
        """Axes of k that a plan still chooses."""
        return tuple(axis for axis, p in enumerate(self.parameters) if p.known is None)

    @cached_property
    def lo(self) -> np.ndarray:
        """(n_k,) least that an execution adds on the chosen axes, least values of the others."""
        return np.array([p.box[0] for p in self.parameters])

    @cached_property
    def hi(self) -> np.ndarray:
        """(n_k,) the most."""
        return np.array([p.box[1] for p in self.parameters])

    @property
    def plain(self) -> bool:
        """Everything is chosen, and executed as it is."""
        return not any(p.known or p.off for p in self.parameters)

    @property
    def exact(self) -> bool:
        """There is one execution: what is not chosen is known, and all is executed as it is."""
        return bool((self.lo == self.hi).all())

    def whole(self, k: np.ndarray) -> np.ndarray:
        """(n, n_k) all parameters of plans that choose k (n, chosen), where there is one
        execution.
        """
        out = np.tile(self.lo, (len(k), 1))
        out[:, list(self.chosen)] = k
        return out

    @property
    def widths(self) -> np.ndarray:
        """(n_k,) full widths of the box, rounded up."""
        return np.where(self.hi > self.lo, np.nextafter(self.hi - self.lo, np.inf), 0.0)

    @cached_property
    def corners(self) -> np.ndarray:
        """(V, n_k) corners of the box; an axis without width has one end."""
        ends = [(a,) if a == b else (a, b) for a, b in zip(self.lo, self.hi, strict=True)]
        return np.array(list(itertools.product(*ends)))

    @property
    def words(self) -> tuple[list[str], list[str]]:
        """What is executed roughly, and what is known of parameters that no plan chooses."""
        of_chosen = [p for p in self.parameters if p.known is None and p.off]
        off = ", ".join(f"{p.name} off by up to {told(p.off)}" for p in of_chosen)
        known = [p.words for p in self.parameters if p.known is not None]
        return [f"every execution with {off}"] if off else [], known


def executions_of(doubt: Doubt, model: TrajectoryModel) -> Executions:
    """Of a doubt about plans of this model. Raises InputError for parameters that there are not or
    that are named twice, or boxes outside of K.
    """
    names = [name_of(label) for label in model.labels.k]
    off = _by_axis("doubt k", doubt.k, names)
    given = _by_axis("doubt given", doubt.given, names)
    given = {axis: value for axis, value in given.items() if value != FREE}
    unknown = _by_axis("doubt unknown", doubt.unknown, names)
    for axis in given.keys() & unknown.keys():
        raise InputError(
            f"doubt: expected a parameter to be given or unknown; {names[axis]} is both."
        )
    parameters = []
    for axis, name in enumerate(names):
        known = "measured" if axis in given else "unknown" if axis in unknown else None
        value = (given | unknown).get(axis, (0.0, 0.0))
        parameters.append(Parameter(name, known, value, off.get(axis, 0.0)))
        _require_inside(parameters[-1], model.domain.lo[axis], model.domain.hi[axis])
    if all(p.known for p in parameters):
        raise InputError("doubt: expected at least one parameter to choose; all are given.")
    return Executions(tuple(parameters))


def require_given(doubt: Doubt | None, model: TrajectoryModel) -> None:
    """Refuse a question that leaves open what the model's system measures at the start: no plan
    chooses it, unless it is said to be free. [T37] Raises InputError.
    """
    names = [name_of(label) for label in model.labels.k]
    said: set[int] = set()
    if doubt is not None:
        for word in ("given", "unknown"):
            said |= _by_axis(f"doubt {word}", getattr(doubt, word), names).keys()
    missing = [names[axis] for axis in model.given if axis not in said]
    if missing:
        raise InputError(
            f"doubt given: expected {listed(missing)}, which {model.system or 'this robot'} "
            f"measures at the start; got no value. Say Doubt(given={{{missing[0]!r}: 0.5}}), or "
            f'"{FREE}" in place of a value to look for starts too.'
        )


def told(x: float) -> str:
    """The shortest decimal that this float alone is read from."""
    return repr(float(x)).removesuffix(".0")


def require_few(points: int, executions: int) -> None:
    """Raises InputError for more points than a certificate may have."""
    if points * executions > MOST:
        raise InputError(
            f"doubt: expected at most {MOST} reference points, each with all its executions; got "
            f"{points} with {executions}. Bound the doubt of fewer parameters, or use fewer points."
        )


def _by_axis(word: str, pairs: tuple, names: Sequence[str]) -> dict:
    """What is said of parameters, by axis of k."""
    axes = []
    for name, _ in pairs:
        plain = name_of(name) if isinstance(name, str) else name
        axis = names.index(plain) if plain in names else name
        if not (isinstance(axis, int) and 0 <= axis < len(names)):
            raise InputError(
                f"{word}: expected parameters of the model ({', '.join(names)}); got {name!r}."
            )
        axes.append(axis)
    require_once(word, [names[axis] for axis in axes])
    return {axis: value for axis, (_, value) in zip(axes, pairs, strict=True)}


def _require_inside(p: Parameter, lo: float, hi: float) -> None:
    """Raises InputError for executions that leave K, which is [lo, hi] here."""
    low, high = p.box
    if p.known is None and 2 * p.off >= hi - lo:
        raise InputError(
            f"doubt k of {p.name}: expected less than half of the range of K, {(hi - lo) / 2:g}; "
            f"got {p.off:g}."
        )
    if p.known is not None and not (lo <= low and high <= hi):
        rough = f", executed within ±{told(p.off)}" if p.off else ""
        value = ", ".join(told(x) for x in p.value)
        raise InputError(
            f"doubt of {p.name}: expected a box within K, [{lo:g}, {hi:g}]; got [{value}] "
            f"({p.known}{rough}). Narrow it, or learn a model of more."
        )


BITS = 48  # of the entries of the maps
LEAST = 1e-4  # [rad] a smaller angle is taken for this one


class Turn(NamedTuple):
    """maps (R, n_p, n_p): every turn by at most the angle is a mixture of them, for all vectors
    alike. sine: at least that of the angle. of_q (n_q,): what the other goal states turn by.
    """

    maps: np.ndarray
    sine: float
    of_q: np.ndarray

    def widened(self, widths: np.ndarray) -> np.ndarray:
        """Half widths (..., n_p) of errors that turn too."""
        if not self.sine:
            return widths
        return widths + self.sine * widths[..., ::-1]


def no_turn(n_p: int, n_q: int) -> Turn:
    """The heading is known."""
    return Turn(np.eye(n_p)[None], 0.0, np.zeros(n_q))


def turn_by(angle: float, rotation: tuple[str, ...]) -> Turn:
    """All turns of the plane by at most an angle [rad] below 1. rotation: which of the other goal
    states turn.

    As complex numbers, turns are an arc of the unit circle, in the triangle of a + ib, a - ib and
    g: a is no larger than its cosine, and the lines from a ± ib to g miss the circle.
    """
    if not 0 < angle < 1:
        raise InputError(f"heading: expected a half angle between 0 and 1 rad; got {angle:g}.")
    unit = Fraction(1, 2**BITS)
    # less than the cosine, however that was rounded
    a = math.floor((math.cos(max(angle, LEAST)) - 2.0**-46) / unit) * unit
    b = unit * (math.isqrt(math.floor((1 - a * a) / unit**2)) + 2)
    g = math.ceil(a / (1 - b * b) / unit) * unit
    if not (a * a + b * b >= 1 and misses_circle(a, b, g)):
        raise InputError(f"heading: expected an angle that a triangle holds; got {angle:g}.")
    a, b, g = float(a), float(b), float(g)
    maps = np.array([[[a, -b], [b, a]], [[a, b], [-b, a]], [[g, 0.0], [0.0, g]]])
    turns = np.array([word == TURNS for word in rotation], float)
    return Turn(maps, b, turns * math.nextafter(angle, math.inf))


def misses_circle(a: Fraction, b: Fraction, g: Fraction) -> bool:
    """The line through a + ib and g is at least 1 away from the origin, which lies before it."""
    return 0 < a < g and b > 0 and g * g * b * b >= b * b + (g - a) ** 2


OF_COPIES = (
    "Under this doubt of execution or heading a few executions stand for all, and more than all: "
    "what is not safe is a plan that this method cannot show to withstand it."
)


class Withstood(NamedTuple):
    """words: "every start within ..."; for sentences. sensing_eps: probability with which the truth
    may lie outside of what was asked. parameters: (all of k, those chosen); where some are not
    chosen nothing is promised of a drawn plan. k_volume: of K as the claim has it, in units of k
    multiplied, where all of k is chosen. copies: several executions or headings stand for all, by a
    hull that holds more than them; then "no plan" is none that could be shown to withstand it.
    """

    words: str
    sensing_eps: Fraction
    parameters: tuple[int, int]
    k_volume: float
    copies: bool = False

    def volume_of_k(self, domain: Box) -> float:
        """Of K as the claim has it; of the domain of those parameters that are chosen, where not
        all are.
        """
        return self.k_volume if len(set(self.parameters)) == 1 else domain.volume

    def share_of_k(self, domain: Box) -> float:
        """Share of K, as the claim has it, in which plans may be chosen; 1 where some parameters
        are not chosen at all.
        """
        return domain.volume / self.volume_of_k(domain)

    def of_none(self, told: str) -> str:
        """A sentence that no safe plan is there, or how many are, with what safe means in it."""
        about = f"{told} Safe means here: safe for {self.words}."
        return f"{about} {OF_COPIES}" if self.copies else about

    def to_json(self) -> dict:
        """As plain data, for the answer file."""
        return self._asdict() | {"sensing_eps": str(self.sensing_eps)}


def withstood(
    doubt: Doubt, executions: Executions, model: TrajectoryModel, copies: bool
) -> Withstood:
    """Of a doubt about plans of this model, executed so."""
    volume = float(np.prod(model.domain.hi - model.domain.lo))
    parameters = (model.n_k, len(executions.chosen))
    return Withstood(words(doubt, executions), doubt.sensing_eps, parameters, volume, copies)


def words(doubt: Doubt, executions: Executions) -> str:
    """What a robust answer holds for: "every start within ±0.05, ±0.05 m ..."."""
    rough, known = executions.words
    parts = []
    if any(doubt.start):
        parts.append(f"every start within {_spread(doubt.start)} m of the one asked about")
    if doubt.heading:
        parts.append(f"every heading within ±{told(doubt.heading)} rad")
    parts += rough
    if any(doubt.goal):
        parts.append(f"every goal moved by up to {_spread(doubt.goal)}")
    if any(s is not None for s in doubt.obstacles):
        parts.append("every place of the obstacles that fits what was seen of them")
    return "; ".join([*parts, *known])


def _spread(widths: Sequence[float]) -> str:
    return ", ".join(f"±{told(w)}" for w in widths)


def withstood_of_json(data: dict | None) -> Withstood | None:
    """That of `to_json`."""
    if data is None:
        return None
    n_k, chosen = data["parameters"]
    eps = Fraction(data["sensing_eps"])
    copies = data.get("copies", False)
    return Withstood(data["words"], eps, (n_k, chosen), float(data["k_volume"]), copies)
