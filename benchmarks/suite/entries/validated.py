"""Learn, then test: polytopes under falling scales of a tube, of which runs first show where plans
fail and how far the tube may be scaled down, and fresh runs then bear out eps. [T42]
"""

import time
from types import SimpleNamespace
from typing import NamedTuple

import jax
import numpy as np
from scipy.stats import gamma

import parc_jax as pj
from benchmarks.suite.answer import ROWS, Sets
from benchmarks.suite.entries import engine, kit
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.drive.local.nested import first_set, fixed_sequence
from parc_jax.learning.bound.calibrate import scaled
from parc_jax.learning.bound.counts import most_discards, required_runs
from parc_jax.learning.bound.declared import stand_in
from parc_jax.learning.bound.pipeline import learn_profile
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.planner import answered
from parc_jax.safe_set.corridors.build import greedy
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.polytopes import SafePolytope, cut_around
from parc_jax.safe_set.corridors.sampling import Points, joined, points
from parc_jax.safe_set.corridors.search import Cover, corridors_around
from parc_jax.safe_set.corridors.stopping import nothing_covered
from parc_jax.safe_set.verdict.pointwise import predictions, verdicts
from parc_jax.safe_set.verdict.scene import Scene, lowered, padded

SCALES = tuple(round(1.3 * 0.9**i, 3) for i in range(20))  # of the tube, falling to 0.18
TRAIN, PROFILE, DESIGN = 0.2, 0.2, 0.3  # of the budget; the rest tests
MOST = 8000  # runs of training and of the profile, each
BINS = {1: 8, 2: 4, 3: 2, 4: 2, 5: 1, 6: 1}  # per axis of what a network reads
MATTERS = 0.1  # share of a network's error that the start explains, from which it reads that too
FAR_OFF = 0.005  # of the runs of a profile are left out, the farthest from the network
# by the dimensions of plans: layers of a network, the smaller the fewer polytopes hold them; safe
# plans around which there are corridors
HIDDEN = {4: (16, 16), 5: (6, 6), 6: (6,)}
SEEDS = {4: 16000, 5: 500, 6: 500}
PER_RUN = 2  # of these for each run that is allowed, at most: runs show no more
MANY = 4000  # plans in corridors, around which polytopes are cut, at least
AT_ONCE = 512  # judged together
DRAWS, RARE, LONGEST = 1 << 13, 8, 80  # plans drawn together; times where none is safe, at most
PIECES = 1500  # polytopes: the largest
POOL = 20_000  # plans drawn to tell which polytopes and which scales hold what
EVEN = 0.8  # of the runs of the design are of plans as they are drawn
# chance that more tests of a set fail than may, by what the design expects: of the largest, and of
# smaller ones that are tested before it
UNSURE = (0.05, 0.005, 0.0005)
PROVED = 2000  # plans that the corridors of a certificate hold
PART = 0.1  # of the set of a scale must be left in cells
CUTS, FEWEST = 6, 30  # between plans in a row; plans of a side
WORTH, WIDE = (6.0, 3.0), 2.0  # log-likelihood that a cut must gain; may lose to be careful


class Learnt(NamedTuple):
    """A model; whether it reads the start too: then its k is (p0, k); how far runs may be from the
    straight way between records (n_c,) [m]; and the number of evenly drawn plans whose runs it is
    learnt from, none of which succeeded; 0 where one did.
    """

    model: pj.types.TrajectoryModel
    anchored: bool
    between: np.ndarray
    failed: int = 0


def learn(task: kit.Task, scene, rng: np.random.Generator) -> Learnt:
    """From runs that begin where the scene's plans do."""
    sizes = [min(MOST, max(30, int(share * task.budget))) for share in (TRAIN, PROFILE)]
    drawn = [(rng.uniform(*scene.start, (n, task.n_p)), task.draw(rng, n)) for n in sizes]
    seen = [task.runs(*plans) for plans in drawn]

    def batches(anchored: bool) -> list[RolloutBatch]:
        return [
            engine.batch(task, np.hstack([p0, k]) if anchored else k, p - p0[:, None, None], q, box)
            for (p0, k), (p, q) in zip(drawn, seen, strict=True)
        ]

    k_box = engine.domain(task)
    for anchored in (False, True):
        both = np.array([[*scene.start[0], *k_box.lo], [*scene.start[1], *k_box.hi]])
        box = pj.box(*both) if anchored else k_box
        train, profile = batches(anchored)
        net = pj.learning.train(
            train, hidden=HIDDEN[task.n_p + k_box.n], key=engine.KEY, seeds=2, steps=3000
        )
        if anchored or not _start_matters(net, profile, drawn[1][0]):
            break
    profile = profile.select(_near(net, profile))
    bins = (BINS[train.n_k],) * train.n_k
    tube = learn_profile(net, train, [profile], bins, shape="fitted")
    why = "a scale for sets that are tested: nothing is claimed of it"
    about = {"system": task.told["name"], "points": tuple(task.told["points"])}
    claim = pj.learning.declared_claim(tube, why, net, engine.grid(task), **about)
    reach, steps = (task.told["speed"] or 0.0) * task.told["dt"], np.diff(profile.p, axis=1)
    between = 0.5 * np.maximum(0.0, reach - np.abs(steps).min(axis=(0, 1)))
    failed = 0 if any(scene.succeeds(*runs).any() for runs in seen) else sum(sizes)
    return Learnt(pj.learning.trajectory_model(net, claim), anchored, between, failed)


def _off(net, runs: RolloutBatch) -> np.ndarray:
    """(n, n_c) what a network is off by at the end of runs."""
    ends = np.asarray(jax.vmap(net)(runs.k))[:, : -runs.q.shape[1] or None]
    return runs.p[:, -1] - ends[:, -runs.p.shape[2] :]


def _near(net, runs: RolloutBatch) -> np.ndarray:
    """Numbers of the runs without the farthest, which are told apart by tests, not by a tube."""
    off = np.abs(_off(net, runs))
    score = np.nan_to_num((off / (np.nanmedian(off, axis=0) + 1e-12)).max(axis=1), nan=np.inf)
    return np.sort(np.argsort(score, kind="stable")[: len(score) - int(FAR_OFF * len(score))])


def _start_matters(net, runs: RolloutBatch, p0: np.ndarray) -> bool:
    """Whether squares of the start explain what a network is off by at the end."""
    off = _off(net, runs)
    x = (p0 - p0.mean(axis=0)) / (p0.std(axis=0) + 1e-12)
    features = np.hstack([np.ones((len(x), 1)), x, x**2])
    fine = np.isfinite(off).all(axis=1)
    off, features = off[fine], features[fine]
    left = off - features @ np.linalg.lstsq(features, off, rcond=None)[0]
    explained = 1 - left.var(axis=0) / (off.var(axis=0) + 1e-18)
    return bool(explained.max() > MATTERS + 2 * features.shape[1] / len(off))


class Nested:
    """Polytopes around safe plans under the smallest scale, and their rows under each."""

    def __init__(self, learnt: Learnt, asked: pj.types.Problem, task: kit.Task, scene, rng):
        self.learnt, self.n_p, self.most = learnt, task.n_p, PER_RUN * task.budget
        query = pj.Planner(learnt.model).prepare(asked).scene.nominal.query
        self.scenes = [_at_scale(query, scale, learnt.between) for scale in SCALES]
        self.cut: list[SafePolytope] = []
        self.first: np.ndarray | None = None
        bounds, small = task.bounds(scene), self.scenes[-1]
        plans = self._safe(rng, *bounds)
        if not len(plans.k):
            return
        self.first = np.append(plans.p0[0], plans.k[0][-len(task.k_lo) :])
        corridors = Corridors(small.model.tube, corridors_around(small, rng, plans))
        for _ in range(RARE):  # what is in a corridor is safe, and need not be judged
            if len(plans.k) >= MANY:
                break
            more = self._reaching(rng, *bounds)
            kept = corridors.kept(more.path, more.bin).any(axis=1)
            plans = joined([plans, more.at(np.flatnonzero(kept)[: MANY - len(plans.k)])])
        cut = cut_around(small, corridors, np.zeros(len(corridors)), plans)
        spelled = [engine.spelled(self._rows(one, small), self._inner(one)) for one in cut]
        some = [i for i, one in enumerate(spelled) if one is not None]
        size = [np.prod(np.subtract(spelled[i]["hi"], spelled[i]["lo"])) for i in some]
        some = [some[i] for i in np.argsort(size)[::-1][:PIECES]]
        self.cut = [cut[i] for i in some]
        self.pieces = [engine.piece(spelled[i]) for i in some]
        self.rows = [[self._rows(one, scene) for scene in self.scenes] for one in self.cut]

    def level(self, plans: np.ndarray) -> np.ndarray:
        """(pieces, n) the first scale at which each piece holds each plan; all of them where none
        does.
        """
        found = np.full((len(self.cut), len(plans)), len(SCALES))
        for i, rows in enumerate(self.rows):
            here = np.flatnonzero(self.pieces[i].holds(plans))
            for j in reversed(range(len(SCALES))):
                inside = (plans[here] @ rows[j].A.T <= rows[j].b).all(axis=1)
                found[i, here[inside]] = j
        return found

    def at(self, scale: int, cells, plans: np.ndarray, of_piece: np.ndarray) -> list[dict]:
        """The polytopes of a scale in cells of plans that hold some of these. of_piece: `level`."""
        found = []
        for lo, hi in cells:
            here = ((lo <= plans) & (plans <= hi)).all(axis=1)
            for rows, level in zip(self.rows, of_piece, strict=True):
                own = here & (level <= scale)
                if own.any():
                    cut = _within(rows[scale], lo, hi)
                    found.append((own.sum(), engine.spelled(cut, plans[own].mean(axis=0))))
        found = [one for _, one in sorted(found, key=lambda one: -one[0]) if one is not None]
        rows = np.cumsum([len(one["b"]) for one in found])
        return [one for one, n in zip(found, rows, strict=True) if n <= ROWS][: kit.SETS]

    def certificate(self, scale: int, plans: np.ndarray, rng) -> pj.types.Answer:
        """What the exact checker takes of corridors that hold all of some plans (n, d) under the
        tube of a scale: no run inside of it touches anything or misses the goal.
        """
        scene, p0, k = self.scenes[scale], *self._split(plans)
        seen = predictions(scene, p0, k)
        safe = points(p0, k, seen).at(seen.reaches)
        own = {id(one.corridor): one.corridor for one in self.cut}
        kept = Corridors(scene.model.tube, own.values()).kept(safe.path, safe.bin)
        some, corridors = [], list(own.values())
        for c in greedy(kept):
            j = int(kept[:, c].argmax())
            some.append(corridors[c]._replace(p0=safe.p0[j], k=safe.k[j]))
        inside = safe.at(kept.any(axis=1))
        cover = Cover(0, 0, 0, 0.0, inside, nothing_covered(0.99), some).pick(rng, 1)
        return answered(scene, cover, None, pj.Settings(), time.perf_counter())

    def _split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """p0 and what the network reads of plans z (n, d)."""
        return z[:, : self.n_p], z if self.learnt.anchored else z[:, self.n_p :]

    def _inner(self, one: SafePolytope) -> np.ndarray:
        return one.k if self.learnt.anchored else np.concatenate([one.p0, one.k])

    def _rows(self, one: SafePolytope, scene: Scene) -> HPolytope:
        """Of a polytope under the tube of a scene, over plans."""
        cut = SafePolytope(scene, one.p0, one.k, one.pattern, one.bin, one.corridor).halfspaces
        if not self.learnt.anchored:
            return cut
        A = cut.A[:, self.n_p :].copy()  # where the start that it reads is the start
        A[:, : self.n_p] += cut.A[:, : self.n_p]
        return HPolytope(A, cut.b)

    def _safe(self, rng, lo: np.ndarray, hi: np.ndarray) -> Points:
        """Plans that are safe under the smallest tube, evenly drawn; none where they are rare."""
        small, most, draws = self.scenes[-1], min(SEEDS[len(lo)], self.most), 0
        found = [self._reaching(rng, lo, hi).at(slice(0))]
        while draws < RARE or (sum(len(one.k) for one in found) and draws < LONGEST):
            z = self._reaching(rng, lo, hi)
            for first in range(0, len(z.k), AT_ONCE):
                some = z.at(slice(first, first + AT_ONCE))
                found.append(some.at(verdicts(small, some.p0, some.k).safe))
                if sum(len(one.k) for one in found) >= most:
                    return joined(found).at(slice(most))
            draws += 1
        return joined(found)

    def _reaching(self, rng, lo: np.ndarray, hi: np.ndarray) -> Points:
        """What of evenly drawn plans reaches the goal: most of what is not safe does not."""
        p0, k = self._split(rng.uniform(lo, hi, (DRAWS, len(lo))))
        seen = predictions(self.scenes[-1], p0, k)
        return points(p0, k, seen).at(seen.reaches)


def _within(rows: HPolytope, lo: np.ndarray, hi: np.ndarray) -> HPolytope:
    """Rows over plans, and those of a cell."""
    own = np.eye(len(lo))
    return HPolytope(np.vstack([rows.A, own, -own]), np.concatenate([rows.b, hi, -lo]))


def _at_scale(query, scale: float, more: np.ndarray) -> Scene:
    """The problem under the scaled tube, and so much (n_c,) [m] more during intervals, scaled too
    where that is less.
    """
    claim, more = query.model.claim, min(1.0, scale) * more
    tube = scaled(claim.tube, np.full(claim.tube.n_bins, scale), more)
    return padded(lowered(query.of(query.model.replace(claim=stand_in(claim, tube))).nominal()))


def answer(nested: Nested, scene, succeed, task: kit.Task, rng) -> tuple[list[dict], int]:
    """Polytopes whose plans, drawn evenly, fail with probability at most eps, but with delta, and
    the number of their scale. succeed: plans -> bool (n,), one fresh run each.
    """
    n = int(DESIGN * task.budget)
    pool = Sets(tuple(nested.pieces), rng).draw(max(POOL, 3 * n))
    of_piece = nested.level(pool)
    bounds = task.bounds(scene)
    levels = of_piece.min(axis=0)
    inner, last = _designed(pool, levels, n, bounds, succeed, task, rng)
    found = nested.at(last, inner[-1], pool, of_piece) if inner else []
    union = Sets(tuple(engine.piece(one) for one in found), rng) if found else None
    if not union:
        return [], 0
    tests = union.draw(task.budget - task.used)
    of_piece = nested.level(tests)
    # falling scales in the fewest cells, then more of them; all lie in the last set, though rows
    # that were rounded may say otherwise
    sets = [(j, inner[0]) for j in range(last)] + [(last, cells) for cells in inner]

    def among(plans, level):
        held = [(level <= j) & _in_cells(cells, plans) for j, cells in sets]
        return np.array([*held[:-1], np.ones(len(plans), bool)])

    # where to begin is settled by the pool, of which no plan is a test
    kept = _in_cells(inner[-1], pool) & (levels <= last)
    expected = len(sets) - among(pool[kept], levels[kept]).sum(axis=0)
    least = required_runs(task.eps, task.delta)
    first = first_set(expected, len(sets), len(tests), least)
    inside = among(tests, of_piece.min(axis=0))
    about = SimpleNamespace(risk=task.eps, delta=task.delta, scales=range(len(sets)))
    failed = np.broadcast_to(~succeed(tests), inside.shape)
    steps, passed = fixed_sequence(about, inside, failed, first)
    if not passed:
        return [], 0
    chosen, cells = sets[steps[passed - 1].scale]
    if cells is not inner[-1] or chosen != last:
        found = nested.at(chosen, cells, tests, of_piece)
    return found, chosen


def _in_cells(cells, plans: np.ndarray) -> np.ndarray:
    """(n,) bool: plans (n, d) in one of some cells."""
    return np.any([((lo <= plans) & (plans <= hi)).all(axis=1) for lo, hi in cells], axis=0)


def _designed(pool, level, n: int, bounds, succeed, task: kit.Task, rng):
    """Growing lists of cells of K in which plans fail rarely, and the number of the smallest scale
    whose plans there are expected to bear out eps, by n runs: half of them nearly as even as the
    pool, some of these as many between every two scales; half of plans of what seemed best then.

    pool (m, d): plans, even over the largest set. level (m,): the first scale that holds each.
    """
    between = [np.flatnonzero(level == j) for j in range(len(SCALES))]
    share = [EVEN * len(b) / len(pool) + (1 - EVEN) / len(SCALES) for b in between]
    some = zip(between, share, strict=True)
    rows = np.concatenate([rng.permutation(b)[: int(0.5 * n * s)] for b, s in some])
    failed = ~succeed(pool[rows])
    found = _best(pool, level, level, rows, failed, bounds, task)
    if found[0]:
        inside = _in_cells(found[0][-1], pool) & (level <= found[1])
        more = rng.permutation(np.setdiff1d(np.flatnonzero(inside), rows))[: n // 2]
        rows, failed = np.append(rows, more), np.append(failed, ~succeed(pool[more]))
        part = level + len(SCALES) * inside
        found = _best(pool, level, part, rows, failed, bounds, task)
    return found


def _best(pool, level, part, rows, failed, bounds, task: kit.Task) -> tuple[list, int]:
    """As `_designed`, by runs of some rows of the pool, even in each part, that failed or not."""
    counts = [np.bincount(x, minlength=2 * len(SCALES)) for x in (part, part[rows])]
    weight = (counts[0] / np.maximum(1, counts[1]))[part[rows]]
    start, of_k = np.split(np.asarray(bounds), [task.n_p], axis=1)
    found = []
    for worth in WORTH:
        for j in range(len(SCALES)):
            own = level[rows] <= j
            if not own.any():
                continue
            k, bad, w = pool[rows[own], task.n_p :], failed[own], weight[own]
            kept = []
            for lo, hi, leaf in kit.cells(k, bad, *of_k, FEWEST, worth, CUTS, wide=WIDE):
                # as Jeffreys has it: a cell where none of a few failed is not known to be safe
                more = w[leaf].mean()
                fails, size = (w[leaf] * bad[leaf]).sum() + 0.5 * more, w[leaf].sum() + more
                if fails <= 2 * task.eps * size:
                    cell = np.append(start[0], lo), np.append(start[1], hi)
                    kept.append((fails / size, size, cell))
            found += _rarest(kept, PART * w.sum(), w.mean(), j, task)
        if any(rank[0] for rank, _, _ in found):
            break
    if not found:
        return [], 0
    _, inner, last = max(found, key=lambda one: one[0])
    return inner, last


def _rarest(kept: list[tuple], least: float, one: float, scale: int, task: kit.Task) -> list[tuple]:
    """Of cells (share that fails, size, cell) those where fewest fail, as many as are expected to
    bear out eps, by how sure that shall be, the surest first, with their rank among those of other
    scales. least: size that they must have in all. one: size of a plan.
    """
    kept = sorted(kept, key=lambda cell: cell[0])
    size = np.cumsum([cell[1] for cell in kept])
    lost = np.cumsum([cell[0] * cell[1] for cell in kept])
    if not kept or size[-1] < least:
        return []
    inner, outer = [], len(kept)
    for unsure in UNSURE:
        # all tests are of the largest, and of a smaller one its share of them
        tests = (task.budget - task.used) * (
            size / size[outer - 1] if inner else np.ones(len(size))
        )
        may = [max(0, most_discards(int(n), task.eps, task.delta)) for n in tests]
        sure = lost / size <= gamma.ppf(unsure, 1 + np.array(may)) / tests
        ends = np.flatnonzero((sure & (size >= least))[:outer])
        if not len(ends):
            break
        if not inner or ends[-1] + 1 < len(inner[0]):
            inner.insert(0, [cell for *_, cell in kept[: ends[-1] + 1]])
            outer = len(inner[-1])
    # of those that may be borne out the largest; else the one that fails most rarely
    if inner:
        return [((True, size[len(inner[-1]) - 1]), inner, scale)]
    return [((False, -(lost[-1] + one) / size[-1]), [[cell for *_, cell in kept]], scale)]
