"""The vertex realisations that stand for all: corners of the box in which k is executed, maps whose
mixtures are all turns, and the words for what a plan withstands. [T21, T22]

Between them the network is the same mixture of its values there, but for its kinks (`bend`).
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
from parc_jax.common.spelling import exact, listed, rounded_up
from parc_jax.learning.labels import axes_of, name_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.system import TURNS
from parc_jax.problem.problem import finite_box
from parc_jax.problem.uncertainty import FREE, Each, Interval, Uncertainty


class Parameter(NamedTuple):
    """One parameter while a plan is executed; queries and sentences both come from this record.

    source: "measured" or "unknown" within value; None of a parameter that a plan chooses.
    value: its lowest and highest value; (0, 0) of a chosen one.
    off: half width of its execution error.
    """

    name: str
    source: str | None
    value: Interval
    off: float
    unit: str = ""

    @property
    def box(self) -> Interval:
        """Values that an execution adds to a chosen parameter, or another has; rounded outward."""
        (lo, hi), off = self.value, Fraction(self.off)
        return round_down(Fraction(lo) - off), round_up(Fraction(hi) + off)

    @property
    def words(self) -> str:
        """Of a parameter that no plan chooses: "every load from 1 to 2 (measured)"."""
        (lo, hi), off = map(exact, self.value), f"{exact(self.off)} {self.unit}".rstrip()
        values = f"{hi} {self.unit}".rstrip() if lo == hi else f"{lo} to {hi} {self.unit}".rstrip()
        if self.off:
            values = values if lo == hi else f"what is from {values}"
            return f"every {self.name} within ±{off} of {values} ({self.source}, executed roughly)"
        if lo == hi:
            return f"{self.name} = {values} ({self.source})"
        return f"every {self.name} from {values} ({self.source})"


@dataclass(frozen=True, eq=False)
class Executions:
    """The execution of plans: one `Parameter` per axis of k."""

    parameters: tuple[Parameter, ...]

    @cached_property
    def chosen(self) -> tuple[int, ...]:
        """Axes of k that a plan chooses."""
        return tuple(axis for axis, p in enumerate(self.parameters) if p.source is None)

    @cached_property
    def lo(self) -> np.ndarray:
        """(n_k,) least value that an execution adds on chosen axes, least values on others."""
        return np.array([p.box[0] for p in self.parameters])

    @cached_property
    def hi(self) -> np.ndarray:
        """(n_k,) the largest, likewise."""
        return np.array([p.box[1] for p in self.parameters])

    @property
    def nominal(self) -> bool:
        """All parameters are chosen, and executed exactly."""
        return not any(p.source or p.off for p in self.parameters)

    @property
    def exact(self) -> bool:
        """There is one execution: each parameter has one value."""
        return bool((self.lo == self.hi).all())

    def whole(self, k: np.ndarray) -> np.ndarray:
        """(n, n_k) parameters of plans that choose k (n, chosen), where there is one execution."""
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


def executions_of(uncertainty: Uncertainty, model: TrajectoryModel) -> Executions:
    """The executions of a model's plans under an uncertainty. Raises InputError for parameters that
    are missing or named twice, and for boxes outside of K.
    """
    names = [name_of(label) for label in model.labels.k]
    off = _by_axis("uncertainty k", uncertainty.k, model.labels.k)
    if isinstance(uncertainty.k, Each) and len(off) not in (0, len(names)):
        raise InputError(
            f"uncertainty k: expected a list of {len(names)} half widths, one per parameter "
            f"({', '.join(names)}), or some by name; got {len(off)}."
        )
    given = _by_axis("uncertainty given", uncertainty.given, model.labels.k)
    given = {axis: value for axis, value in given.items() if value != FREE}
    unknown = _by_axis("uncertainty unknown", uncertainty.unknown, model.labels.k)
    for axis in given.keys() & unknown.keys():
        raise InputError(
            f"uncertainty: expected a parameter to be given or unknown; {names[axis]} is both."
        )
    parameters = []
    for axis, name in enumerate(names):
        source = "measured" if axis in given else "unknown" if axis in unknown else None
        value = (given | unknown).get(axis, (0.0, 0.0))
        unit = unit_of(model.labels.k[axis])
        parameters.append(Parameter(name, source, value, off.get(axis, 0.0), unit))
        _require_inside(parameters[-1], model.domain.lo[axis], model.domain.hi[axis])
    if all(p.source for p in parameters):
        raise InputError("uncertainty: expected at least one parameter to choose; all are given.")
    return Executions(tuple(parameters))


def require_given(uncertainty: Uncertainty | None, model: TrajectoryModel) -> None:
    """Raises InputError for a query without a value of a parameter that the model's system measures
    at the start: no plan chooses it, unless the query calls it free. [T37]
    """
    names = [name_of(label) for label in model.labels.k]
    known = uncertainty or Uncertainty()
    stated = _by_axis("uncertainty given", known.given, model.labels.k)
    stated = stated | _by_axis("uncertainty unknown", known.unknown, model.labels.k)
    if missing := [axis for axis in model.given if axis not in stated]:
        name, middle = names[missing[0]], model.domain.center[missing[0]]
        raise InputError(
            f"uncertainty given: expected {listed([names[axis] for axis in missing])}, which "
            f"{model.system or 'this robot'} measures at the start; got no value. Say "
            f"Uncertainty(given={{{name!r}: {exact(middle)}}}), "
            f'or "{FREE}" in place of a value to look for starts too.'
        )


def _by_axis(word: str, pairs: tuple, labels: Sequence[str]) -> dict:
    """Values of named parameters, by axis of k."""
    axes = axes_of([name for name, _ in pairs], labels)
    if axes is None:
        raise InputError(
            f"{word}: expected parameters of the model ({', '.join(labels)}), each once; got "
            f"{listed([repr(name) for name, _ in pairs])}."
        )
    return {axis: value for axis, (_, value) in zip(axes, pairs, strict=True)}


def _require_inside(p: Parameter, lo: float, hi: float) -> None:
    """Raises InputError for executions that leave K, which is [lo, hi] here."""
    low, high = p.box
    if p.source is None and 2 * p.off >= hi - lo:
        raise InputError(
            f"uncertainty k of {p.name}: expected less than half of the range of K, "
            f"{(hi - lo) / 2:g}; got {p.off:g}."
        )
    if p.source is not None and not (lo <= low and high <= hi):
        rough = f", executed within ±{exact(p.off)}" if p.off else ""
        value = ", ".join(exact(x) for x in p.value)
        raise InputError(
            f"uncertainty of {p.name}: expected a box within K, [{lo:g}, {hi:g}]; got [{value}] "
            f"({p.source}{rough}). Narrow it, or learn a model of more."
        )


BITS = 48  # of the entries of the maps
LEAST = 1e-4  # [rad] a smaller angle is taken for this one


class Turn(NamedTuple):
    """Vertex realisations of a heading.

    maps: (R, n_p, n_p) every turn by at most the angle is a mixture of them.
    sine: an upper bound of the angle's.
    of_q: (n_q,) [rad] turns of the further goal states.
    """

    maps: np.ndarray
    sine: float
    of_q: np.ndarray

    def widened(self, widths: np.ndarray) -> np.ndarray:
        """Half widths (..., n_p) [m] of errors that turn with the robot."""
        return widths + self.sine * widths[..., ::-1] if self.sine else widths


def turn_by(angle: float, rotation: tuple[str, ...]) -> Turn:
    """All turns of the plane by at most an angle [rad] below 1.

    rotation: a word per further goal state, TURNS for one that turns. Raises InputError.
    """
    if not 0 < angle < 1:
        raise InputError(f"heading: expected a half angle between 0 and 1 rad; got {angle:g}.")
    # as complex numbers, turns are an arc of the unit circle, in the triangle of a + ib, a - ib and
    # g: a is no larger than the cosine, and the lines from a ± ib to g miss the circle
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


OF_MORE = (
    "What stands here for all that this uncertainty allows is more than all: what is not safe is "
    "a plan that this method cannot show to withstand it."
)


class Robustness(NamedTuple):
    """The uncertainty that an answer is robust to.

    words: "every start within ...", for sentences.
    sensing_eps: probability that the truth lies outside of the measured boxes.
    parameters: (all of k, chosen ones); where they differ nothing is promised of a drawn plan.
    k_volume: of the claim's K, in units of k multiplied, where all of k is chosen.
    more: what stands for all realisations is larger than all: "no plan" then says that none was
        shown to be robust.
    """

    words: str
    sensing_eps: Fraction
    parameters: tuple[int, int]
    k_volume: float
    more: bool

    @property
    def meaning(self) -> str:
        """What "safe" means under it, for sentences about all plans."""
        return f"Safe means here: safe for {self.words}." + f" {OF_MORE}" * self.more

    def to_json(self) -> dict:
        """As plain data, for the answer file."""
        return self._asdict() | {"sensing_eps": str(self.sensing_eps)}


def words(
    uncertainty: Uncertainty, executions: Executions, model: TrajectoryModel, turned: bool = False
) -> str:
    """The realisations that an answer withstands: "every start within ±0.05, ±0.05 m of ...".
    turned: the question has a heading, and is told in a frame that turns with the robot.
    """
    q = [name_of(label) for label in model.labels.q]
    chosen = [p for p in executions.parameters if p.source is None and p.off]
    off = ", ".join(f"{p.name} off by up to {exact(p.off)} {p.unit}".rstrip() for p in chosen)
    start = ", ".join(f"±{exact(w)}" for w in uncertainty.start)
    axes = zip(uncertainty.goal, map(unit_of, model.labels.goal), strict=False)
    goal = ", ".join(f"±{exact(w)} {unit}".rstrip() for w, unit in axes)
    parts = []
    if any(uncertainty.start):
        parts.append(f"every start within {start} m of the one asked about")
    if uncertainty.heading:
        turn = [name for name, word in zip(q, model.rotation or (), strict=False) if word == TURNS]
        of = f"that of the model's runs, each turned about its start{', with its ' * bool(turn)}"
        of = "the one asked about" if turned else of + ", ".join(turn)
        parts.append(f"every heading within ±{exact(uncertainty.heading)} rad of {of}")
    parts += [f"every execution with {off}"] if off else []
    if any(uncertainty.goal):
        alone = q and len(uncertainty.goal) < len(model.labels.p) + len(q)
        sure = f" in place, its {', '.join(q)} exactly as told" if alone else ""
        parts.append(f"every goal moved by up to {goal}{sure}")
    for i, s in enumerate(uncertainty.obstacles):
        if s is not None:
            ends = zip(*finite_box(s, "uncertainty of obstacles"), strict=True)
            of = "every obstacle" if len(uncertainty.obstacles) == 1 else f"obstacle {i}"
            within = ", ".join(f"{exact(lo)} to {exact(hi)}" for lo, hi in ends)
            parts.append(f"{of} moved by an error of its set, which lies within {within} m")
    parts += [p.words for p in executions.parameters if p.source is not None]
    said = "; ".join(parts) or "everything exactly as it was told"
    if turned and any([*uncertainty.start, *uncertainty.goal, *uncertainty.obstacles]):
        said += ", errors of place along the axes of the world, not of the robot"
    if eps := uncertainty.sensing_eps:
        most = f"but for a probability of at most {rounded_up(eps)} each time"
        said += f", {most} that what is measured is off by more"
    return said


def robustness_of_json(data: dict | None) -> Robustness | None:
    """The record that `to_json` wrote."""
    if data is None:
        return None
    rest = tuple(data["parameters"]), float(data["k_volume"]), data.get("more", True)
    return Robustness(data["words"], Fraction(data["sensing_eps"]), *rest)
