"""Why no plan is safe, or few are: the obstacle or side in the way, by how many centimetres and
when, the tube's part of that, and remedies.

Of plans that aim at the goal, the nearest to a safe one is searched for, and its obstruction is
named. It explains, and proves nothing: all numbers are of plans that were tried.
"""

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from parc_jax.common.climb import Ranked, climb, ranked
from parc_jax.common.spelling import listed, rounded_down, rounded_up
from parc_jax.learning.bound.statement import about_open_bins, probability
from parc_jax.learning.labels import degrees_hint, name_of, named_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.problem.problem import Problem, box_of_rows, goal_box
from parc_jax.safe_set.corridors.sampling import box_of_plans, ends_from, plans_of
from parc_jax.safe_set.separation.pairs import numbered_pairs
from parc_jax.safe_set.verdict.blocked import Rooms, deepest, rooms, without_errors
from parc_jax.safe_set.verdict.infeasible import why_none
from parc_jax.safe_set.verdict.scene import Scene

SMALL = 0.05  # share of safe plans below which the end of a command says what is in the way
DRAWN = 1024  # plans that aim at the goal, uniform in their parameters and ends
KEPT, EACH = 16, 16  # the best so far, and plans around each of them in every round
SPREADS = 0.6 ** np.arange(1, 17)  # [half sides of K and of the goal] of the rounds
AGAINST = -0.5  # cosine from which on two sides squeeze a plan between them
MOST_NAMED = 3
NOTHING = 1e-3  # [of what is missing] a rest that is not worth a word
BESIDES = 0.01  # weight of what all sides lack together, beside what the worst one lacks
ODD = 1000  # a body smaller than all else by this factor gets a question
MOST_CORNERS = 729  # of K, at which the longest way of a model is measured


@dataclass(frozen=True, eq=False)
class Why:
    """The obstruction of plans. Made by `Answer.why`.

    blockers: names, the worst first, as "obstacle 3" or "the goal's side x <= 2". obstacles: the
        numbers of the obstacles among them. times: [s] when each is in the way, None for the goal.
    missing: [unit] by which the nearest plan fails, between two sides that squeeze it by both
        together; where some plans pass, what half of those lack that the first blocker alone holds
        back. bare: the same plans judged without the errors of the tube; negative is to spare.
    blocked: of the plans that one side alone is in the way of, the share of the first blocker.
    safe: share of plans from the start into the goal that are safe. plan: (n_p + n_k,) the nearest.
    sentences: a sure reason or a question about units, the plan, remedies.
    """

    blockers: tuple[str, ...]
    obstacles: tuple[int, ...]
    times: tuple[float | None, ...]
    missing: float
    bare: float
    unit: str
    blocked: float
    safe: float
    plan: np.ndarray
    sentences: tuple[str, ...]

    @property
    def tube(self) -> float:
        """[unit] the part of the tube in the missing room."""
        return self.missing - self.bare

    @property
    def text(self) -> str:
        """All sentences, a line each."""
        return "\n".join(self.sentences)


class _Side(NamedTuple):
    """A condition that a plan may fail: columns of a part of `Rooms`. Of one plan: room, bare
    [unit] that it leaves with and without errors, push (n_p + n_q,) the unit direction out of
    it, time [s].
    """

    name: str
    part: str
    columns: list[int]
    unit: str = "m"
    obstacle: int | None = None
    push: np.ndarray = np.zeros(0)
    time: float | None = None
    room: float = 0.0
    bare: float = 0.0

    def of(self, seen: Rooms) -> np.ndarray:
        """(b,) the margin that it leaves to plans."""
        return getattr(seen, self.part)[:, self.columns].min(axis=1)

    @property
    def when(self) -> str:
        """The name, and when it is in the way."""
        return f"{self.name} at {'the end' if self.time is None else f'{self.time:.3g} s'}"


def why_of(scene: Scene, listed: np.ndarray | None = None) -> Why:
    """The obstruction of the plans of a scene, the same in each call. listed: (b, n_k) parameters,
    for the nearest of these from the one start, which costs milliseconds.
    """
    rng, sides = np.random.default_rng(0), _sides(scene)
    lo, hi = box_of_plans(scene)
    x = rng.uniform(lo, hi, (DRAWN, len(lo))) if listed is None else listed
    x, aims = _aimed(scene, x)
    drawn = rooms(scene, *plans_of(scene, x))

    def children(best: Ranked, spread: float) -> np.ndarray:
        x = np.asarray(best.x)[:, None]
        steps = spread / 2 * (hi - lo) * rng.uniform(-1, 1, (len(x), EACH, len(lo)))
        return np.clip(x + steps, lo, hi).reshape(-1, len(lo))

    def worth(seen: Rooms) -> np.ndarray:
        lack = sum(np.minimum(side.of(seen), 0.0) for side in sides)
        return np.where(seen.known, seen.least + BESIDES * lack, -np.inf)

    spreads = SPREADS if listed is None else ()
    worth_of = lambda x: worth(rooms(scene, *plans_of(scene, np.asarray(x))))  # noqa: E731
    best = climb(ranked(x, worth(drawn)).at(slice(KEPT)), children, worth_of, spreads, KEPT)
    nearest = np.asarray(best.x)[:1]
    aims = aims & drawn.known if (aims & drawn.known).any() else drawn.known
    safe = float((drawn.least[aims] > 0).mean()) if aims.any() else 0.0
    blocked = np.array([side.of(drawn) <= 0 for side in sides])
    only = aims & (blocked.sum(axis=0) == 1)
    alone = (blocked & only).sum(axis=1)
    held = _held(scene, sides, nearest) if best.value[0] > -np.inf else []
    passes = not held and bool(only.any())
    if passes:
        most = int(np.argmax(alone))
        held = [_in_the_way_of_half(scene, sides[most], x[only & blocked[most]])]
    both = [*held[:1], *[one for one in held[1:] if float(one.push @ held[0].push) < AGAINST][:1]]
    missing, bare = -sum(one.room for one in both), -sum(one.bare for one in both)
    first = why_none(scene)
    said = [] if first is None else [f"{first.words[:1].upper()}{first.words[1:]}"]
    names = [side.name for side in sides]
    share = alone[names.index(held[0].name)] / max(only.sum(), 1) if held else 0.0
    pose = scene.nominal.pose
    turned = 0.0 if pose is None or pose.heading is None else pose.heading
    odd = [odd_size(scene.problem, scene.model), degrees_hint("heading [rad]", turned, turned)]
    odd = odd if listed is None else []
    said += [question.strip() for question in odd if question]
    if held and not any(odd):
        # executions, and starts from anywhere, widen it; obstacles have grown by what else is
        tube = "tube" + " (with some of what is uncertain)" * bool(scene.nominal.uncertainty)
        how = _of_many(held[0], share, safe) if passes else _of_nearest(held, both)
        said.append(f"{how} {_of_tube(missing, bare, both[0].unit, tube)}")
        said.append(_next(scene, both, missing, bare, tube))
        said += ["Places are told in the robot's frame."] * scene.nominal.turned
        said += about_open_bins(scene.model.claim.premises)
    elif not safe and best.value[0] > 0:
        said.append("A plan that was tried passes: safe plans are rare, and more work finds them.")
    return Why(
        blockers=tuple(one.name for one in held),
        obstacles=tuple(one.obstacle for one in held if one.obstacle is not None),
        times=tuple(one.time for one in held),
        missing=missing + 0.0,
        bare=bare + 0.0,
        unit=held[0].unit if held else "m",
        blocked=float(share),
        safe=safe,
        plan=np.concatenate(plans_of(scene, nearest), axis=1)[0],
        sentences=tuple(said),
    )


def _aimed(scene: Scene, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends and parameters x (b, n), the ends moved to where the start set leads, and where (b,)
    some of them are in the goal's box.
    """
    if scene.at is not None or scene.problem.start is None:
        return x, np.ones(len(x), bool)
    n_p = scene.model.n_p
    ways = ends_from(0.0, scene.model, x[:, n_p:])
    first, last = box_of_rows(scene.problem.start)
    lo, hi = np.maximum(scene.z_lo, first + ways), np.minimum(scene.z_hi, last + ways)
    fits = (lo <= hi).all(axis=1)
    sides = np.where(scene.z_hi > scene.z_lo, scene.z_hi - scene.z_lo, 1.0)
    z = np.where(fits[:, None], lo + (x[:, :n_p] - scene.z_lo) / sides * (hi - lo), x[:, :n_p])
    return np.concatenate([z, x[:, n_p:]], axis=1), fits


def _sides(scene: Scene) -> list[_Side]:
    """Of the goal, of the start set, and every obstacle that some plan comes near."""
    model, n_p, n_c = scene.model, scene.model.n_p, scene.model.n_c
    p, q = model.labels.p, model.labels.q
    of_points = [named_of(a, f"of {point}") for point in model.points for a in p]
    ends = [*(p if model.n_points == 1 else of_points), *q]
    sides = []
    for i in np.flatnonzero(scene.goal_A.any(axis=1)):
        row = scene.goal_A[i]
        push = -np.r_[row[:n_c].reshape(-1, n_p).sum(axis=0), row[n_c:]]
        name, unit = _spelled("the goal's side", row, scene.goal_b[i], ends)
        push = push / max(float(np.linalg.norm(push)), 1e-300)
        sides.append(_Side(name, "goal", [int(i)], unit, push=push))
    for i in np.flatnonzero(scene.start_A.any(axis=1)):
        row = scene.start_A[i]
        push = np.r_[-row / np.linalg.norm(row), np.zeros(len(q))]
        name, unit = _spelled("the start's side", row, scene.start_b[i], p)
        sides.append(_Side(name, "start", [int(i)], unit, push=push, time=0.0))
    pairs: dict[int, list[int]] = {}
    for o, (j, _) in enumerate(numbered_pairs(scene.problem, scene.apart and scene.apart.kept)):
        pairs.setdefault(j, []).append(o)
    return sides + [_Side(f"obstacle {j}", "gap", own, obstacle=j) for j, own in pairs.items()]


def _spelled(what: str, row: np.ndarray, most: float, labels) -> tuple[str, str]:
    """A side in words, and the unit of its missing room."""
    i, *others = np.flatnonzero(row)
    units = {unit_of(labels[j]) for j in (i, *others)}
    unit = units.pop() if len(units) == 1 else ""
    if others:
        terms = " ".join(f"{row[j]:+.9g} {name_of(labels[j])}" for j in (i, *others))
        return f"{what} {terms} <= {most:.9g}", unit
    return f"{what} {name_of(labels[i])} {'<=' if row[i] > 0 else '>='} {most / row[i]:.9g}", unit


def _held(scene: Scene, sides: list[_Side], x: np.ndarray) -> list[_Side]:
    """The obstruction of one plan x (1, n), the worst first."""
    tubes, plan = (scene.model.tube, without_errors(scene.model.tube)), plans_of(scene, x)
    seen = [rooms(scene, *plan, tube) for tube in tubes]
    held = []
    for side in sides:
        room, bare = (float(side.of(one)[0]) for one in seen)
        if room < 0 and side.obstacle is not None:
            o = side.columns[int(seen[0].gap[0, side.columns].argmin())]
            deep = [deepest(scene, np.concatenate(plan, axis=1)[0], o, tube) for tube in tubes]
            room, bare = max(room, deep[0][0]), max(bare, deep[1][0])
            push = np.r_[deep[0][2], np.zeros(scene.model.n_q)]
            side = side._replace(push=push, time=deep[0][1] * scene.model.time.dt)
        if room < 0:
            held.append(side._replace(room=room, bare=max(room, bare)))
    return sorted(held, key=lambda side: side.room)[:MOST_NAMED]


def _in_the_way_of_half(scene: Scene, side: _Side, x: np.ndarray) -> _Side:
    """One side, with median deficits of the plans that it alone obstructs."""
    seen = rooms(scene, *plans_of(scene, x))
    bare = side.of(rooms(scene, *plans_of(scene, x), without_errors(scene.model.tube)))
    middle = int(np.argsort(side.of(seen))[len(x) // 2])
    if side.obstacle is not None:
        o = side.columns[int(seen.gap[middle, side.columns].argmin())]
        side = side._replace(time=float(seen.when[middle, o]) * scene.model.time.dt)
    room = float(np.median(side.of(seen)))
    return side._replace(room=room, bare=max(room, float(np.median(bare))))


def _size(value: float, unit: str, spelled=rounded_up) -> str:
    """A length in cm below a metre, or another size in its unit: what is missing, rounded up."""
    small = unit == "m" and value < 1
    return f"{spelled(100 * value)} cm" if small else f"{spelled(value, 3)} {unit}".rstrip()


def _of_nearest(held: list[_Side], both: list[_Side]) -> str:
    where = "between " if len(both) > 1 else "to "
    others = [one.name for one in held if not any(one is other for other in both)]
    verb = "is" if len(others) == 1 else "are"
    more = f"; {listed(others)} {verb} in its way too" if others else ""
    missing = _size(-sum(one.room for one in both), both[0].unit)
    where += listed([one.when for one in both])
    return f"The nearest plan of those tried lacks {missing} {where}{more}."


def _of_many(one: _Side, blocked: float, safe: float) -> str:
    return (
        f"Of plans tried from the start into the goal {rounded_down(100 * safe, 3)} % pass. Of "
        f"those that one side alone is in the way of, {rounded_down(100 * blocked, 3)} % fail at "
        f"{one.when}, and half of these lack {_size(-one.room, one.unit, rounded_down)} or more."
    )


def _of_tube(missing: float, bare: float, unit: str, tube: str) -> str:
    more = f"has {_size(-bare, unit, rounded_down)} to spare"
    rest = f"lacks {_size(bare, unit)}" if bare > 0 else more
    rest = "just passes" if abs(bare) < NOTHING * missing else rest
    return f"The {tube} takes {_size(missing - bare, unit)} of it: without errors it {rest}."


def _next(scene: Scene, both: list[_Side], missing: float, bare: float, tube: str) -> str:
    """Remedies, and how much of each."""
    parts = {one.part for one in both}
    what = "that obstacle farther away" if parts == {"gap"} else f"that {'/'.join(parts)} wider"
    if len(both) > 1 and "gap" in parts:
        what = "more room between these two"
    steps = [f"{what} by {_size(missing, both[0].unit)}"]
    p, taken = scene.model.claim.premises, missing - bare
    if taken >= missing > 0:
        share = f"{rounded_up(100 * missing / taken)} %"
        now = f" than {probability(p['eps'], 2)}" if "eps" in p else ""
        bins = "more bins of K, " * ("blocks" not in p)  # else less runs in each
        ways = f"{bins}a better network by more runs, or a larger eps{now}"
        # the direction that separates changes with the tube, so the room that it takes is convex
        steps.append(f"a {tube} narrower by {share} at least ({ways})")
    steps += ["less that is uncertain"] * (tube != "tube")
    told = f"What would help: {', or '.join(steps)}."
    return told + " No narrower tube alone lets this plan pass." * bool(bare > NOTHING * missing)


def odd_size(problem: Problem, model: TrajectoryModel) -> str | None:
    """A question about a body larger than all else, or ODD times smaller, as if its size were given
    in another unit than metres; None for other bodies.
    """
    sides = [row.tolist() for row in (model.domain.lo, model.domain.center, model.domain.hi)]
    k = np.array(list(itertools.product(*np.transpose(sides)))[:MOST_CORNERS])
    way = float(np.abs(outputs(model.net, k, slice(0, model.layout.n_offsets))).max())
    boxes = [box_of_rows(obstacle) for obstacle in problem.obstacles]
    lo, hi = goal_box(problem.goal, model.layout)
    boxes.append((lo[: model.n_p], hi[: model.n_p]))
    wide = [float(side) for lo, hi in boxes for side in hi - lo if np.isfinite(side)]
    body = max(part.shape.size for part in problem.parts)
    most = max([way, *wide])
    if body > most or 0 < body < most / ODD:
        word = "more than all that" if body > most else f"less than a {ODD:,}th of what"
        return (
            f"body: its size of {body:g} m is {word} the ways of this model, the goal and the "
            f"obstacles measure, up to {most:.3g} m; is it in metres?"
        )
    return None
