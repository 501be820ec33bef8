"""The scorer: frozen answers against fresh simulations, with NumPy alone; of toys the truth is a
sum over all that chance may do.

The seed of an instance comes from what all its answers contain and from chance that was drawn after
they were frozen; the result names both, so anybody scores again, with this chance or with other.
"""

import hashlib
import math

import numpy as np

from benchmarks.suite.answer import NONE, SOME, UNKNOWN, Answer, Sets, read
from benchmarks.suite.bad import Refused
from benchmarks.suite.binomial import interval, tail
from benchmarks.suite.instances import Instance

WRONG = 1e-6  # an answer is refuted where a right one would look as bad so rarely
LOST, STANDS, WHOLE = -150, 2, 10  # points: refuted; a plan that holds, or a right none; all plans
PER_EPS = 40  # runs of plans drawn from an answer, expected failures of one that fails with eps
FEWEST = 400  # runs of them at least
TRIED = 3  # plans that are tried against the answer that there is none
CHUNK = 4096  # runs simulated together
AT_ONCE = 16  # nodes of a box's chance that are looked at together
NOTHING_IN_IT = "answer: expected a plan, or a set that meets start x K and fills its own lo, hi."
BEYOND = 1e-6  # what a plan's share of failures may exceed eps by: rounding


def seed_of(instance: Instance, answers: dict[str, bytes], chance: str) -> int:
    """Of the answers that were frozen, by entry, and chance drawn after that."""
    text = [chance, instance.id]
    text += [f"{name} {hashlib.sha256(answers[name]).hexdigest()}" for name in sorted(answers)]
    return int.from_bytes(hashlib.sha256("\n".join(text).encode()).digest()[:16], "big")


def score(instance: Instance, answers: dict[str, bytes], chance: str) -> dict:
    """What came of the answers to an instance, by entry, and what is true of it."""
    truth, *streams = np.random.SeedSequence(seed_of(instance, answers, chance)).spawn(
        1 + len(answers)
    )
    plans, good, best = _truth(instance, np.random.default_rng(truth))
    told = {"plans": len(plans), "good": int(good.sum())}
    found = {}
    for name, stream in zip(sorted(answers), streams, strict=True):
        rng = np.random.default_rng(stream)
        try:
            answer = read(answers[name], *instance.bounds)
            if answer.verdict == SOME:
                found[name] = _some(instance, answer, plans[good], rng)
            elif answer.verdict == NONE:
                found[name] = _none(instance, plans[best], rng)
            else:
                found[name] = {"status": UNKNOWN, "points": 0}
        except Refused as why:
            found[name] = {"status": "invalid", "points": 0, "why": str(why)}
    return {"truth": told, "entries": found}


def succeed(instance: Instance, plans: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Whether one fresh run of each plan (n, d) succeeds."""
    box, found = instance.black_box, []
    for first in range(0, len(plans), CHUNK):
        p0, k = np.split(plans[first : first + CHUNK], [box.n_p], axis=1)
        found.append(instance.scene.succeeds(*box.rollout(p0, k, int(rng.integers(2**62)))))
    return np.concatenate([np.empty(0, bool), *found])


def _truth(instance: Instance, rng: np.random.Generator):
    """Plans (n, d) drawn evenly, which of them truly succeed, and the numbers of the best ones. A
    plan does where it fails in no more than a share eps of its runs.
    """
    plans = rng.uniform(*instance.bounds, (instance.plans, instance.bounds.shape[1]))
    if instance.black_box.nodes is not None:
        failing = share_failing(instance, plans, instance.eps + BEYOND)
        return plans, failing <= instance.eps + BEYOND, np.argsort(failing, kind="stable")[:TRIED]
    failures = np.zeros(len(plans), int)
    allowed = math.floor(instance.eps * instance.repeats + BEYOND)
    runs = 0
    while runs < instance.repeats:
        more = max(1, min(3 * runs, instance.repeats - runs))
        left = np.flatnonzero(failures <= allowed)
        failed = ~succeed(instance, plans[left].repeat(more, axis=0), rng)
        failures[left] += failed.reshape(len(left), more).sum(axis=1)
        runs += more
    return plans, failures <= allowed, np.argsort(failures, kind="stable")[:TRIED]


def share_failing(instance: Instance, plans: np.ndarray, most: float = 1.0) -> np.ndarray:
    """(n,) of all runs of plans (n, d), by the nodes of a box that has them; where it is more than
    `most`, something that is more.
    """
    box, found = instance.black_box, np.zeros(len(plans))
    nodes, weights = box.nodes
    # the dearest first, which is the sooner more than most; a few at a time
    order = np.argsort(-weights, kind="stable")
    for some in np.array_split(order, max(1, len(order) // AT_ONCE)):
        left = np.flatnonzero(found <= most)
        for first in range(0, len(left), CHUNK):
            rows = left[first : first + CHUNK]
            p0, k = np.split(plans[rows].repeat(len(some), axis=0), [box.n_p], axis=1)
            good = instance.scene.succeeds(*box.told(p0, k, np.tile(nodes[some], (len(rows), 1))))
            found[rows] += np.where(good.reshape(len(rows), -1), 0.0, weights[some]).sum(axis=1)
    return found


def _some(instance: Instance, answer: Answer, good: np.ndarray, rng) -> dict:
    sets = Sets(answer.pieces, rng) if answer.pieces else None
    tests = {}
    n = max(FEWEST, math.ceil(PER_EPS / instance.eps))
    if len(answer.plans):
        tests["plans"] = answer.plans[rng.integers(len(answer.plans), size=n)]
    if sets:
        tests["sets"] = sets.draw(n)
    if not tests:
        return {"status": "empty", "points": 0, "why": NOTHING_IN_IT}
    failures = {kind: int((~succeed(instance, plans, rng)).sum()) for kind, plans in tests.items()}
    chances = [tail(n, x, instance.eps) for x in failures.values()]
    told = {"failures": failures, "of": n, "chance": min(chances)}
    if min(chances) < WRONG / len(chances):
        return {"status": "refuted", "points": LOST, **told}
    held = int(sets.holds(good).sum()) if sets and not sets.flat else 0
    share = held / len(good) if len(good) else 0.0
    low, high = interval(len(good), held) if len(good) else (0.0, 1.0)
    points = STANDS + (WHOLE - STANDS) * share
    told |= {"yield": [share, low, high], "held": [held, len(good)]}
    return {"status": "stands", "points": round(points, 3), **told}


def _none(instance: Instance, best: np.ndarray, rng) -> dict:
    """That there is no plan is refuted by one that fails more rarely than with eps."""
    level = WRONG / TRIED
    n = math.ceil(1.5 * math.log(level) / math.log1p(-instance.eps))
    for plan in best:
        failures = int((~succeed(instance, plan[None].repeat(n, axis=0), rng)).sum())
        if 1 - tail(n, failures + 1, instance.eps) < level:
            told = {"plan": plan.tolist(), "failures": failures, "of": n}
            return {"status": "refuted", "points": LOST, **told}
    if instance.known == NONE:
        return {"status": "right", "points": STANDS}
    return {"status": "open", "points": 0}
