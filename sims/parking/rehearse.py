"""A way tried out before it is driven: as the network leads along it (`aimed`), or by the proofs
themselves (`rehearsed`).
"""

import numpy as np

from sims.parking import car as c
from sims.parking.cases import Case
from sims.parking.kinematics import compose, offset_from, reach_exactly, rolls, steering
from sims.parking.predict import asked, predicted, told, tube_at, ways_of
from sims.parking.prove import NO_LESS, Moving, goal_of, link, starts_for
from sims.parking.space import Space
from sims.parking.way import Tried, Way

# [m, m, rad] beside where it should lead that a manoeuvre of a way may, if more follow
MISSES = np.array([0.06, 0.06, 0.03])


def mended(way: Way, now: Moving, model, tried) -> Tried:
    """A way as the car can drive it, from where it is. A manoeuvre that would begin while the car
    rolls, and is not as tried, begins at rest. tried: of a way, a number and where the car is, the
    manoeuvre (1, 3) and what k has as its start; or None.
    """
    seen, fails, took, i = [now], [], [], 0
    while i < len(way.k):
        now, rolls_on = seen[i], bool(way.rolls_on[i])
        found = tried(way, i, now)
        if found is None and now.speed:
            way, i = way.stopped(i - 1), i - 1
            del seen[i + 1 :], fails[i:], took[i:]
            continue
        fails.append(found is None)
        k, start = found or (way.k[i : i + 1], starts_for(way.k[i : i + 1], now)[-1])
        given = np.concatenate([[now.wheels, start], asked(k, now.speed)[0]])
        took.append(float(c.moments(given)[c.ROLLS_ON * c.EVERY if rolls_on else -1]))
        after = way.poses[i + 1]
        if found is not None:
            after = compose(now.pose, predicted(model, now.wheels, start, rolls_on)(k)[0, 0])
        first, last = (float(x[0]) for x in steering(k))
        wheels = first + (last - first) * float(way.upto[i])
        seen.append(Moving(after, wheels, float(rolls(k, now.speed)[1][0]) if rolls_on else 0.0))
        i += 1
    return Tried(way, sum(fails), sum(took))


def aimed(model, space: Space, way: Way, i: int, now: Moving):
    """What `mended` tries: a manoeuvre that leads about where it should, and is clear."""
    aim, rolls_on = offset_from(now.pose, way.poses[i + 1]), bool(way.rolls_on[i])
    stands = None if way.stands is None else float(way.stands[i])
    for start in starts_for(way.k[i : i + 1], now, stands):
        predict = predicted(model, now.wheels, start, rolls_on)
        k, there = reach_exactly(aim[None], way.k[i : i + 1], predict)
        if there[0]:
            break
    poses = compose(now.pose, ways_of(model, now.wheels, start)(k)[0])
    miss = np.abs(offset_from(way.poses[i + 1], poses[c.ROLLS_ON if rolls_on else -1]))
    near = there[0] or (i < len(way.k) - 1 and (miss < MISSES).all())
    all_of_k = np.column_stack([[[now.wheels, start]], asked(k, now.speed)])
    clear = space.clears(poses, tube_at(model, all_of_k)[0][0])
    enough = not now.speed or abs(k[0, 0]) >= c.stopping(now.speed) + NO_LESS
    return (k, start) if near and clear and enough else None


def rehearsed(spare, around, case: Case, within, known: Tried, now: Moving) -> Tried:
    """As `mended`, by a spare loop: what is tried is proved from where it would begin. A way along
    which the car rests between all of its manoeuvres is left as it is: another can be found then.
    """
    if not known.way.rolls_on.any():
        return known

    def tried(way: Way, i: int, now: Moving):
        spare.restart()
        goal = goal_of(case, now.pose, within) if i == len(way.k) - 1 else None
        step = link(spare, around, now, way, i, goal, 0.0)
        return (told(step.committed.k[None]), float(step.committed.k[1])) if step.new else None

    return mended(known.way, now, spare.model, tried)
