"""A way made quicker still: all poses along it are moved at once, as the network leads between
them, and where the car rests between manoeuvres of one gear it is tried to roll.
"""

from typing import NamedTuple

import numpy as np

from sims.parking import car as c
from sims.parking.kinematics import (
    LONGEST,
    MOST,
    UPTO,
    compose,
    ends,
    leaves,
    offset_from,
    reach_exactly,
    rolls,
    seconds,
    standing,
    steering,
)
from sims.parking.known import Learned
from sims.parking.predict import asked, poses_of, tube_at
from sims.parking.prove import LITTLE
from sims.parking.quicker import AVOIDED, BEYOND, ROLLED, ROLLING, SHORTEST, SINGLE, costs
from sims.parking.space import LIKED, Space
from sims.parking.way import Tried, Way

# ways drawn in each round, and those of them that the next ones are like; rounds until one way is
# told from another, and until the best is told; how fast the spread becomes that of the best ones
DRAWN, ELITE, SHORTLY, ROUNDS, LEARNS = 128, 20, 45, 100, 0.4
SPREAD = np.array([0.3, 0.15, 0.08, 0.2])  # [m, m, rad] of poses at first, and share of `stands`
STEPS = 3  # times that the network is asked where a manoeuvre leads; the last is not corrected
MISSED = 3e-3  # [m, rad] beside its pose that a manoeuvre may lead
ASKED = 0.88  # share of the steering that it may ask for: what is left corrects where it begins
# [s] that it costs to miss it by more [m, rad], to be too close by [m], too short by [m], to ask
# for a share more of steering, and to do any of these at all
AMISS, CLOSE, SHORT, STEERS, ANY = 50.0, 100.0, 50.0, 50.0, 2.0
MOST_POLISHED = 9  # manoeuvres of a way: of more, too much is drawn


class Judged(NamedTuple):
    """Of d ways [s] that each takes, [s] that are said against it, its manoeuvres k (d, n, 3), and
    stands (d, n), as of a `Way`.
    """

    takes: np.ndarray
    against: np.ndarray
    k: np.ndarray
    stands: np.ndarray

    @property
    def costs(self) -> np.ndarray:
        """(d,) [s]."""
        return self.takes + self.against


class Polish:
    """Polishes ways that begin at a pose (3,), at rest, the wheels [rad] as they are. space: of a
    case; known: of the car.
    """

    def __init__(self, space: Space, known: Learned, start, wheels: float):
        self._space, self._known = space, known
        self._start, self._wheels, self._room = start, wheels, space.room(start, True)

    def _mend(self, way: Way) -> Tried:
        """A way as the car can drive it."""
        return self._known.mend(way, self._start, self._wheels, self._space)

    def polished(self, way: Way, seed: int, rolling: bool = True) -> Tried:
        """The quickest that was found, as the car can drive it. seed: of what is drawn."""
        found = [self._mend(way)]
        if not 1 < len(way.k) <= MOST_POLISHED:
            return found[0]
        form, (settled, least) = way, self._settled(way, seed, SHORTLY)
        found.append(self._mend(settled))
        for i in range((len(way.k) - 1) * rolling):
            if form.rolls_on[i] or form.k[i, 0] * form.k[i + 1, 0] < 0:
                continue
            tried = rolled(form, i)
            settled, cost = self._settled(tried, seed, SHORTLY)
            if cost < least:
                form, least = tried, cost
                found.append(self._mend(settled))
        found.append(self._mend(self._settled(form, seed, ROUNDS)[0]))
        return min(found, key=costs)

    def _settled(self, way: Way, seed: int, rounds: int) -> tuple[Way, float]:
        """The best of ways drawn around one, then around the best ones, and so on; its cost [s]."""
        draw, n, least = np.random.default_rng(seed), len(way.k), np.inf
        best, mean, cov = way, np.zeros(4 * n), np.diag(np.tile(SPREAD**2, n))
        for _ in range(rounds):
            drawn = draw.multivariate_normal(mean, cov, DRAWN, method="cholesky")
            drawn[0] = mean
            each = drawn.reshape(DRAWN, n, 4)
            poses = np.repeat(way.poses[None], DRAWN, axis=0)
            poses[:, 1:-1] = compose(poses[:, 1:-1], each[:, :-1, :3])
            near = np.repeat(best.k[None], DRAWN, axis=0)
            judged = self._judged(poses, near, way.rolls_on, each[..., 3])
            elite = np.argsort(judged.costs)[:ELITE]
            one = elite[0]
            if judged.costs[one] < least:
                least = float(judged.costs[one])
                best = Way(judged.k[one], poses[one], way.rolls_on, judged.stands[one])
            off = drawn[elite] - mean
            mean = mean + off.mean(axis=0)
            cov = (1 - LEARNS) * cov + LEARNS * (off.T @ off) / ELITE + 1e-10 * np.eye(4 * n)
        return best, least

    def _judged(self, poses, near, rolls_on, longer) -> Judged:
        """Ways by poses (d, n + 1, 3), of manoeuvres near (d, n, 3). longer (d, n): share of the
        turn of its wheels for which the car stands more than usual.
        """
        d, n = near.shape[:2]
        takes, against, broken = np.zeros(d), np.zeros(d), np.zeros(d)
        ks, stands = [], []
        wheels, begins = np.full(d, self._wheels), np.zeros(d)
        target = offset_from(poses[:, :-1], poses[:, 1:])
        for i in range(n):
            on, rolling = bool(rolls_on[i]), i > 0 and bool(rolls_on[i - 1])
            upto, record = (UPTO, c.ROLLS_ON) if on else (1.0, -1)
            k = reach_exactly(target[:, i], near[:, i], lambda k, upto=upto: ends(k, 1, upto))[0]
            slopes = slopes_of(k, upto)
            usual = standing(steering(k)[0] - wheels, k[:, 0])
            share = np.clip(usual + (0.0 if rolling else longer[:, i]), LITTLE, 1.0)
            start = c.start_of(begins) if rolling else c.starts_at(share)
            for step in range(STEPS):
                all_of_k = np.column_stack([wheels, start, asked(k, begins)])
                path = poses_of(self._known.model, all_of_k)
                off = path[:, record] - target[:, i]
                if step < STEPS - 1:
                    k = moved(k, np.linalg.solve(slopes, off[..., None])[..., 0])
            width, final = tube_at(self._known.model, all_of_k)
            size, first = np.abs(k[:, 0]), steering(k)[0]
            broken += AMISS * np.maximum(np.abs(off) - MISSED, 0.0).sum(axis=1)
            clear = self._space.around(compose(poses[:, i, None], path).reshape(-1, 3), True)
            clear = clear.reshape(d, -1).min(axis=1)
            needed = self._space.needed(width, self._room)
            broken += CLOSE * np.maximum(needed - clear, 0.0)
            against += AVOIDED * (LIKED - clear)
            if rolling:
                broken += SHORT * np.maximum(c.stopping(begins) + BEYOND - size, 0.0)
                broken += SHORT * np.maximum(ROLLING - begins, 0.0)
                broken += SHORT * (np.sign(k[:, 0]) != np.sign(ks[-1][:, 0]))
                against += ROLLED
            else:
                takes += share * (np.abs(first - wheels) / (c.MARGIN * c.RATE) + c.SETTLE)
                against += SINGLE
            broken += SHORT * np.maximum(SHORTEST - size, 0.0)
            broken += STEERS * np.maximum(np.abs(k[:, 1:]).max(axis=1) - ASKED, 0.0)
            if i == n - 1:
                lacks = self._known.wants(k, final, poses[0, -1])
                broken += np.maximum(lacks, 0.0) @ [CLOSE, CLOSE, STEERS]
            took, speed = rolls(k, begins)
            takes += took if on else seconds(k, begins)
            wheels, begins = leaves(k, np.full(d, on)), speed if on else np.zeros(d)
            ks.append(k)
            stands.append(share)
        against += broken + ANY * (broken > 0)
        return Judged(takes, against, np.stack(ks, axis=1), np.stack(stands, axis=1))


def moved(k: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Manoeuvres (b, 3) less a change (b, 3), each step of which is little."""
    most = np.array([LONGEST, MOST, MOST])
    return np.clip(k - np.clip(change, -0.8, 0.8), -most, most)


def slopes_of(k: np.ndarray, upto: float) -> np.ndarray:
    """(b, 3, 3) of where manoeuvres k (b, 3) lead after a share of their way, by k."""
    around = k[:, None] + np.concatenate([np.zeros((1, 3)), 1e-3 * np.eye(3)])
    end = ends(around.reshape(-1, 3), 1, upto)[:, 0].reshape(-1, 4, 3)
    return np.moveaxis((end[:, 1:] - end[:, :1]) / 1e-3, 1, 2) + 1e-6 * np.eye(3)


def rolled(way: Way, i: int) -> Way:
    """The way on which the car rolls on after manoeuvre number i, where it rested; its poses are
    the same.
    """
    k, rolls_on = way.k.copy(), way.rolls_on.copy()
    size, first, last = k[i]
    longer = np.clip(size / UPTO, -LONGEST, LONGEST)
    share = c.most_steering(size) / c.most_steering(longer)
    steered = share * np.array([first, first + (last - first) / UPTO])
    k[i], rolls_on[i] = [longer, *np.clip(steered, -MOST, MOST)], True
    return way._replace(k=k, rolls_on=rolls_on)
