"""Strokes to and fro from a pose in a slot into the goal, searched for some levels ahead. As of the
guide, it only proposes: each stroke is proved before it is driven.
"""

import numpy as np
import shapely

import parc_jax as pj
from sims.parking import car as c
from sims.parking.cases import GOAL, Case
from sims.parking.kinematics import MOST, compose, ends, offset_from
from sims.parking.predict import tube_of

PER_RADIAN = 2.5  # [m] that a wrong heading counts as
# ways, as k has them, and shares of the steering of strokes to shuffle by
STROKES, LOCKS = np.linspace(0.05, 0.36, 24), np.array([-1.0, -0.8, 0.8, 1.0])
STRAIGHT = np.radians(0.4)  # of heading that is not turned back while the car moves sideways
EVERY = 3  # of these ways each third is searched with
LOOKED = 3  # poses along a stroke that are looked at
# poses that are kept of each level, most levels, and [m] of clearance beside a tube's: the next
# where nothing was found with the one before
BEAMS = ((500, 30, 0.006), (500, 30, 0.0))
AT_ONCE = 2000  # strokes that are looked at, the best first
CELL = np.array([0.02, 0.02, 0.01])  # [m, m, rad] of cells of which one pose is followed
TRIES = 3  # searches that find nothing, of a case
AROUND = 9.0  # [m] from the car: obstacles farther than that are reached by no stroke
MOST_ALONE = 26  # strokes that are looked ahead of which each is the best one alone
NONE = 1e-9  # [m, rad] of the goal that a tube leaves which does not fit
OFF = 0.03  # [m] beside its place, as of `apart`, from which the strokes that were found are left


def strokes(gear: float, every: int = 1) -> np.ndarray:
    """Manoeuvres (n, 3) to shuffle by, in a gear (1, -1). every: how many ways one of is taken."""
    way, first, last = (one.ravel() for one in np.meshgrid(STROKES[::every], LOCKS, LOCKS))
    return np.column_stack([gear * c.way_of(way), MOST * first, MOST * last])


def wrong(case: Case, pose: np.ndarray) -> np.ndarray:
    """[m] by which poses (..., 3) are beside the goal, a wrong heading included."""
    return wrong_of(offset_from(case.goal, pose))


def wrong_of(off: np.ndarray) -> np.ndarray:
    """As `wrong`, of poses (..., 3) as told from the goal."""
    off = np.abs(off)
    return off[..., 1] + PER_RADIAN * np.maximum(off[..., 2] - STRAIGHT, 0.0)


def apart(pose: np.ndarray, other: np.ndarray) -> np.ndarray:
    """[m] from poses (..., 3) to another (3,), headings included."""
    off = offset_from(other, pose)
    return np.hypot(off[..., 0], off[..., 1]) + PER_RADIAN * np.abs(off[..., 2])


class Slot:
    """Strokes into the goal of a case. model: of the car; within: [m], [rad] from the middle of the
    goal to its sides; uncertainty: of poses that are measured.
    """

    def __init__(self, case: Case, model, within=GOAL, uncertainty: pj.Uncertainty | None = None):
        uncertainty = uncertainty or pj.Uncertainty()
        self._case, self._next, self._failed = case, [], 0
        self._model, self._within, self._alone = model, within, True
        self._doubt = float(np.linalg.norm(uncertainty.shifts(2))), uncertainty.heading or 0.0
        self._single = {gear: self._known(strokes(gear)) for gear in (1.0, -1.0)}
        k = np.concatenate([strokes(gear, EVERY) for gear in (1.0, -1.0)])
        self._moves, self._width, self._room = self._known(k)

    def _known(self, k: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of manoeuvres (n, 3) poses along them, the width [m] of their tubes, and what these leave
        of the goal (n, 3).
        """
        width, final = tube_of(self._model, k)
        shift, heading = self._doubt
        place = self._within[0] - np.hypot(final[:, 0], final[:, 1]) - shift
        turn = self._within[1] - heading - final[:, -1]
        room = np.maximum(np.column_stack([place, place, turn]), NONE)
        return ends(k, LOOKED), width + shift + heading * c.LENGTH, room

    def alone(self, pose: np.ndarray, gear: float) -> bool:
        """Do strokes of which each is the best one alone lead from a pose (3,) into the goal? gear:
        of the first. Where they once did not, this is not asked again: two poses may lead to each
        other.
        """
        filled = self._filled(pose)
        for _ in range(MOST_ALONE if self._alone else 0):
            for sign in (gear, -gear):
                moves, width, room = self._single[float(sign)]
                along = compose(pose, moves)
                off = offset_from(self._case.goal, along[:, -1])
                fits = clear(along, filled, width)
                if (fits & (np.abs(off) < room).all(axis=1)).any():
                    return True
                if fits.any():
                    break
            else:
                break
            pose = along[np.argmin(np.where(fits, wrong_of(off), np.inf)), -1]
            gear = -sign
        self._alone = False
        return False

    def after(self, pose: np.ndarray) -> np.ndarray | None:
        """The pose (3,) to which the next stroke leads from a pose (3,); None where no strokes into
        the goal were found.
        """
        if not self._next or apart(pose, self._next[0]) > OFF:
            self._next = self._searched(pose)
            self._failed += not self._next
        return self._next[1] if len(self._next) > 1 else None

    def driven(self) -> None:
        """The next stroke is that after the one that was driven."""
        self._next = self._next[1:]

    def left(self) -> None:
        """What was found is not followed."""
        self._next = []

    @property
    def found(self) -> bool:
        """Are there strokes that were found, and not yet driven?"""
        return len(self._next) > 1

    def _searched(self, pose: np.ndarray) -> list[np.ndarray]:
        if self._failed >= TRIES:
            return []
        filled = self._filled(pose)
        found = (self._ahead(pose, filled, *beam) for beam in BEAMS)
        return next(filter(None, found), [])

    def _filled(self, pose: np.ndarray):
        here = shapely.Point(pose[:2])
        return shapely.union_all([one for one in self._case.shapes if one.distance(here) < AROUND])

    def _ahead(self, pose, filled, width: int, levels: int, spare: float) -> list[np.ndarray]:
        """Poses after one another, the first one included, into the goal; none without."""
        ways, seen = [[pose]], set()
        for _ in range(levels):
            along = compose(np.array([way[-1] for way in ways])[:, None, None], self._moves)
            begin, stroke = (one.ravel() for one in np.indices(along.shape[:2]))
            off = offset_from(self._case.goal, along[begin, stroke, -1])
            taken = (np.abs(off) / self._room[stroke]).max(axis=1)  # share of the goal
            order = np.argsort(np.where(taken < 1, -1.0, wrong_of(off)), kind="stable")
            cells, kept = np.floor(off / CELL).astype(int), []
            for some in np.array_split(order, -(-len(order) // AT_ONCE)):
                new = some[[tuple(cells[i]) not in seen or taken[i] < 1 for i in some]]
                need = self._width[stroke[new]] + spare
                for i in new[clear(along[begin[new], stroke[new]], filled, need)]:
                    if taken[i] < 1:
                        return [*ways[begin[i]], along[begin[i], stroke[i], -1]]
                    if tuple(cells[i]) not in seen:
                        seen.add(tuple(cells[i]))
                        kept.append(i)
                if len(kept) >= width:
                    break
            if not kept:
                break
            ways = [[*ways[begin[i]], along[begin[i], stroke[i], -1]] for i in kept[:width]]
        return []


def clear(along: np.ndarray, filled, need: np.ndarray) -> np.ndarray:
    """(n,) whether the car is clear of what is filled by what it needs (n,) [m], at all poses along
    (n, m, 3).
    """
    rows = np.arange(len(along))
    for i in reversed(range(along.shape[1])):  # nearly all that are not are not at their end
        bodies = shapely.polygons(c.corners(*along[rows, i].T)[:, 1:])
        # of nothing that is near the distance is no number
        rows = rows[~(shapely.distance(bodies, filled) < need[rows])]
    return np.isin(np.arange(len(along)), rows)
