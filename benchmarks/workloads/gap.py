"""How narrow may the gap be? Obstacles moved together in steps; all methods at the same eps, on the
same scene.

Share: of the (p0, k) that reach the goal for every trajectory inside the tube, the part that a
method keeps as safe. One set of points is drawn per model, uniform over its goal-reaching set, and
judged at every slack (room left between body and obstacles). Published: outside every projected
avoid set of its region. Ours: the point test in joint space.
PARC: its affine map through the published method. All get the same bins of K, which flatters PARC
and the published method: in the papers one bound holds for all of K. Bounds are Clopper-Pearson at
95 %.

The narrowest gap is then searched downwards: points that were safe one step earlier are perturbed,
and the search ends at the first step at which none is safe. The last plan of ours is proved by the
independent checker.

The true rectangle of the car is learned and asked about on its own (`sims.drift_parking.narrow`):
its corners are reference points, and the cars may stand closer together than the circle is wide.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from benchmarks.bench import Bench
from benchmarks.cases import Case
from benchmarks.curves import GapCurve, GapRoom
from benchmarks.metrics import Metric, exact, metric
from benchmarks.models import PARC, CaseModels, name_of
from benchmarks.published import Partition, kept
from benchmarks.rectangle_gap import narrowest_for_rectangle
from benchmarks.result import Result, Table, percent
from parc_jax.common.errors import InputError
from parc_jax.learning.model import TrajectoryModel
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts
from parc_jax.safe_set.verdict.scene import scene_of

SHARES = (1.0, 0.85, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)  # of the published slack
STEP = 0.02  # [m] of the search for the narrowest gap
NEIGHBOURS = 4096  # points tried per step of that search


class Curve(NamedTuple):
    """One method. slack (g,) [m], reaching points judged, kept (g,) of them as safe; narrowest
    slack [m] with a plan.

    narrowest: None when there is no plan even at the published slack. proved: the checker accepted
        that plan (ours).
    """

    name: str
    slack: np.ndarray
    reaching: int
    kept: np.ndarray
    narrowest: float | None
    proved: bool | None
    why: str = ""

    def bounds(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Share and its 95 % bounds, (g,) each."""
        n, x = max(self.reaching, 1), self.kept
        low = np.where(x == 0, 0.0, beta.ppf(0.025, np.maximum(x, 1), n - x + 1))
        return x / n, low, np.where(x == n, 1.0, beta.ppf(0.975, x + 1, np.maximum(n - x, 1)))


class Points(NamedTuple):
    """p0 (b, n_p), k (b, n_k) that reach the goal."""

    p0: np.ndarray
    k: np.ndarray


def run(bench: Bench) -> Result:
    """PARC, the published method, ours with the same network, ours with a larger one."""
    learned = bench.learned(bench.size("drift", "boat"))
    case = learned.case
    slacks = case.slack * np.array(bench.size(SHARES, SHARES[::4]))
    small, large = case.hidden[-1], case.larger
    wanted = [("PARC", PARC, _published), ("published", small, _published), ("ours", small, _ours)]
    if large in learned.models:
        wanted.append(("ours", large, _ours))
    curves = []
    for method, widths, safe in wanted:
        name = method if widths == PARC else f"{method}, {name_of(widths)}"
        curves.append(_curve(bench, learned, learned.models[widths].honest, name, safe, slacks))
    metrics = [m for c in curves for m in _metrics(c)]
    rows = [
        (f"{s:.2f} m", *(percent(c.kept[i] / max(c.reaching, 1)) for c in curves))
        for i, s in enumerate(slacks)
    ]
    narrow = [(_room(case, c.name, c.narrowest), c.proved, c.why) for c in curves]
    if case.length is not None:
        found = narrowest_for_rectangle(bench.key(0), bench.size(False, True))
        left = None if found.apart is None else found.apart - 2 * case.radius
        metrics += _narrow_metrics("gap.ours.rectangle", left, found.proved)
        narrow.append((_room(case, "ours, true rectangle", left), found.proved, ""))
    return Result(
        metrics,
        [
            Table(
                "Share of the goal-reaching set kept as safe",
                ("slack", *(c.name for c in curves)),
                rows,
            ),
            Table(
                "Narrowest gap with a plan",
                ("method", "room to the circle", "room to the true car", "proved", "remark"),
                [(*_spelled(room), _spell(proved), why) for room, proved, why in narrow],
                f"Published scene: {case.slack:.2f} m. Tubes claimed at eps = {learned.eps:g}.",
            ),
        ],
        {
            "published": case.slack,
            "curves": [_data(c) for c in curves],
            "rooms": [room._asdict() for room, _, _ in narrow],
        },
    )


def figure(data: dict, path) -> None:
    """Draw the curves and the narrowest gaps of `Result.data`."""
    from benchmarks.curves import gap

    curves = [
        GapCurve(c["name"], *(np.array(c[n]) for n in ("slack", "share", "low", "high")))
        for c in data["curves"]
    ]
    rooms = [GapRoom(**room) for room in data["rooms"]]
    label = "slack between the circle around the body and the obstacles [m]"
    gap(curves, path, published=data["published"], label=label, rooms=rooms)


def _curve(
    bench: Bench, learned: CaseModels, model: TrajectoryModel, name: str, safe, slacks: np.ndarray
) -> Curve:
    rng = np.random.default_rng(0)
    try:
        at = _reaching(model, learned.case.problem(), rng, bench.size(1 << 16, 1 << 9))
    except InputError as why:
        return Curve(name, slacks, 0, np.zeros(len(slacks), int), None, None, str(why))
    judge = safe(model)
    masks = [judge(learned.case.narrowed(s), at) for s in slacks]
    count = np.array([int(m.sum()) for m in masks])
    if not count.any():
        return Curve(name, slacks, len(at.k), count, None, None)
    last = int(np.flatnonzero(count)[-1])
    seeds = Points(*(x[masks[last]] for x in at))
    step = bench.size(STEP, 0.2)
    slack, plan = _search(learned, model, judge, float(slacks[last]), seeds, rng, step)
    proved = _prove(model, learned.case.narrowed(slack), plan) if safe is _ours else None
    return Curve(name, slacks, len(at.k), count, slack, proved)


def _reaching(model, problem, rng, n: int) -> Points:
    """Points of the goal-reaching set, uniform by volume."""
    scene = scene_of(problem, model)
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    z = rng.uniform(scene.z_lo, scene.z_hi, (n, model.n_p))
    p0, reaches = anchor(scene, z, k)
    return Points(p0[reaches], k[reaches])


def _ours(model: TrajectoryModel):
    """Judge of points: exact in joint space."""

    def judge(problem, at: Points) -> np.ndarray:
        return (
            verdicts(scene_of(problem, model), at.p0, at.k).safe if len(at.k) else np.zeros(0, bool)
        )

    return judge


def _published(model: TrajectoryModel):
    """Judge of points: outside the projected avoid sets, which hold every unsafe point; so only
    safe ones are asked.
    """
    parts, exactly = Partition(model, enumerate_regions(model.net, model.domain)), _ours(model)

    def judge(problem, at: Points) -> np.ndarray:
        out = exactly(problem, at)
        p0, k = at.p0[out], at.k[out]
        out[out] = kept(parts, problem, p0, k, model.tube.bin_of(k)) if len(k) else out[out]
        return out

    return judge


def _search(
    learned: CaseModels, model, judge, slack: float, seeds: Points, rng, step: float
) -> tuple[float, Points]:
    """Step the obstacles together until no neighbour of the plans of the step before is safe."""
    spread = 0.02 * (model.domain.hi - model.domain.lo)
    while slack - step > 0:
        problem = learned.case.narrowed(slack - step)
        pick = rng.integers(len(seeds.k), size=NEIGHBOURS)
        scale = rng.choice(
            [0.0, 0.1, 0.3, 1.0], (NEIGHBOURS, 1)
        )  # some stay where they are, some move far
        k = np.clip(
            seeds.k[pick] + scale * spread * rng.normal(size=(NEIGHBOURS, model.n_k)),
            *_corners(model),
        )
        p0 = seeds.p0[pick] + scale * 0.1 * rng.normal(size=(NEIGHBOURS, model.n_p))
        fine = judge(problem, Points(p0, k))
        if not fine.any():
            break
        slack, seeds = slack - step, Points(p0[fine], k[fine])
    return slack, Points(seeds.p0[:1], seeds.k[:1])


def _corners(model) -> tuple[np.ndarray, np.ndarray]:
    return model.domain.lo, model.domain.hi


def _prove(model: TrajectoryModel, problem, plan: Points) -> bool:
    """The checker accepts this one plan."""
    scene = scene_of(problem, model)
    e = verdicts(scene, plan.p0, plan.k)
    part = sample_part(scene, model.tube, plan.p0[0], plan.k[0], e.path[0])
    return bool(prove(problem, model, [part])[0].all())


def _metrics(c: Curve) -> list[Metric]:
    key = "gap." + c.name.replace(", ", ".")
    share = c.bounds()[0]
    out = [metric(f"{key}.share_as_published", share[0], "1", "higher", abs_tol=0.1)]
    out.append(metric(f"{key}.plans_at", np.count_nonzero(c.kept), "count", "higher", abs_tol=1))
    return out + _narrow_metrics(key, c.narrowest, c.proved)


def _narrow_metrics(key: str, slack: float | None, proved: bool | None) -> list[Metric]:
    out = []
    if slack is not None:
        out.append(metric(f"{key}.narrowest", slack, "m", "lower", abs_tol=0.1))
    if proved is not None:
        out.append(exact(f"{key}.not_proved", not proved))
    return out


def _room(case: Case, name: str, slack: float | None) -> GapRoom:
    """What the narrowest gap of a method leaves; slack [m] beside the circle."""
    if slack is None or case.length is None:
        return GapRoom(name, slack)
    return GapRoom(name, slack, slack + 2 * case.radius - case.length)


def _spelled(room: GapRoom) -> tuple[str, str, str]:
    circle = "none" if room.circle is None else f"{room.circle:.2f} m"
    return room.name, circle, "" if room.body is None else f"{room.body:.2f} m"


def _data(c: Curve) -> dict:
    share, low, high = c.bounds()
    lists = {"slack": c.slack, "share": share, "low": low, "high": high}
    return {"name": c.name, "narrowest": c.narrowest} | {
        n: [float(x) for x in a] for n, a in lists.items()
    }


def _spell(proved: bool | None) -> str:
    return "" if proved is None else "yes" if proved else "no"
