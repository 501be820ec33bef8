"""Nested certified sets under falling scales of the tube, and tests of them in this order. [T42]"""

import math
from collections.abc import Sequence

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.drive.local.validation import Step, Validate
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.counts import wrong_claim_probability
from parc_jax.learning.bound.declared import stand_in
from parc_jax.learning.bound.tube import Tube, tube_from_json
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.planner import Prepared
from parc_jax.problem.robust.nominal import Query
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.safe_plans import SafePlans, starts_of_ends
from parc_jax.safe_set.corridors.sampling import points
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import predictions
from parc_jax.safe_set.verdict.scene import Scene, lowered, padded

SEEDS = 1000  # plans drawn before any test, one of which each corridor of a set needs inside
AHEAD = 2.0  # times the least number of tests that the first set is expected to hold


def nested_sets(
    query: Query, key: jax.Array, rng: np.random.Generator, settings: Settings, asked: Validate
) -> list[SafePlans]:
    """The nested sets in the order of the scales, fixed before any test: the corridors are those of
    the last one, of which each set has those that hold one of SEEDS plans, under its tube or a
    wider one: its seed there. None where no draw meets the last one.
    """
    scenes = []
    recorded = isinstance(asked.source, RolloutBatch)
    whole = shape_of(query.model.claim) if recorded else query.model.tube
    for scale in asked.scales:
        claim = stand_in(query.model.claim, whole.times(asked.way * scale, scale))
        # all obstacles: those that no plan of one tube comes near may be near plans of another
        scenes.append(padded(lowered(query.of(query.model.replace(claim=claim)).nominal())))
    cover = Prepared(scenes[-1]).solve(key, settings.replace(proof=False)).cover
    last = SafePlans(scenes[-1], Corridors(scenes[-1].model.tube, cover.corridors), cover.within)
    try:
        p0, k = np.split(last.sample(rng, SEEDS), [query.model.n_p], axis=1)
    except InputError:  # without corridors, or hardly a draw meets it
        return []
    waiting, seeded, sets = dict(enumerate(last.corridors.all)), {}, []
    for scene in scenes:
        seeded |= _seeded(scene, waiting, p0, k)
        waiting = {i: one for i, one in waiting.items() if i not in seeded}
        some = [seeded[i] for i in sorted(seeded)]
        sets.append(SafePlans(scene, Corridors(scene.model.tube, some), cover.within))
    return sets


def _seeded(
    scene: Scene, corridors: dict[int, Corridor], p0: np.ndarray, k: np.ndarray
) -> dict[int, Corridor]:
    """The corridors in which one of the plans lies under the tube of the scene, with that plan."""
    tube, e = scene.model.tube, predictions(scene, p0, k)
    safe = points(p0, k, e).at(e.reaches)
    if not (corridors and len(safe.k)):
        return {}
    kept = Corridors(tube, corridors.values()).kept(safe.path, safe.bin)
    seeds = zip(corridors.items(), kept.argmax(axis=0), kept.any(axis=0), strict=True)
    return {i: one._replace(p0=safe.p0[j], k=safe.k[j]) for (i, one), j, held in seeds if held}


def level(sets: Sequence[SafePlans], p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(b,) number of the first of nested sets that holds each plan p0 (b, n_p), k (b, n_k), by
    halving; len(sets) where none does.
    """
    before, first = np.full(len(k), -1), np.full(len(k), len(sets))
    while (first - before > 1).any():
        middle = (before + first) // 2
        for i in np.unique(middle[first - before > 1]):
            rows = np.flatnonzero((middle == i) & (first - before > 1))
            held = sets[i].contains(p0[rows], k[rows])
            first[rows[held]], before[rows[~held]] = i, i
    return first


def first_set(levels: np.ndarray, sets: int, tests: int, least: int) -> int:
    """The set that the sequence begins with: the first that is expected to hold AHEAD times the
    least number of tests, by levels of other draws; or the last one.
    """
    expected = tests * (levels <= np.arange(sets)[:, None]).mean(axis=1)
    return int(np.append(expected[:-1] >= AHEAD * least, True).argmax())


def levels_of(
    sets: Sequence[SafePlans], rng: np.random.Generator, k: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Drawn starts (b, ends, n_p) of k (b, n_k), and their `level` (b, ends)."""
    scene = sets[-1].scene
    p0 = starts_of_ends(scene, rng, k)
    n, ends, n_p = p0.shape
    levels = np.full((n, ends), len(sets))
    known = scene.model.domain.contains(k)
    some = p0[known].reshape(-1, n_p), np.repeat(k[known], ends, axis=0)
    levels[known] = level(sets, *some).reshape(-1, ends)
    return p0, levels


def shape_of(claim: ErrorClaim) -> Tube:
    """The tube that recordings scale: the error shape, which the runs that sized a claim have not
    seen; the tube of a claim that no recordings sized.
    """
    shape = claim.evidence.get("shape")
    return claim.tube if shape is None else tube_from_json(shape)


def fixed_sequence(
    asked: Validate, inside: np.ndarray, failed: np.ndarray, first: int
) -> tuple[tuple[Step, ...], int]:
    """Fixed-sequence testing: the tests that are made, and how many of them pass. [T42]

    inside, failed: (sets, tests) bool, in the order of the scales. first: set to begin with, fixed
    before any of these tests was looked at. The sequence ends with the first that does not pass.
    """
    steps: list[Step] = []
    risk, most = math.nextafter(float(asked.risk), 0.0), 0
    for scale, among, bad in list(zip(asked.scales, inside, failed, strict=True))[first:]:
        # never fewer than before, though recordings that begin elsewhere may: more is careful
        most = max(most, int((among & bad).sum()))
        steps.append(Step(scale, int(among.sum()), most))
        if wrong_claim_probability(steps[-1].n, risk, steps[-1].failed) > asked.delta:
            return tuple(steps), len(steps) - 1
    return tuple(steps), len(steps)
