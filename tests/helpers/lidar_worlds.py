"""Worlds of discs and squares, and a lidar in them whose errors are as bad as it declares."""

from dataclasses import dataclass

import numpy as np
import shapely


@dataclass(frozen=True)
class Lidar:
    """Bounds of its errors [m, rad], as `seen_from` takes them."""

    angles: np.ndarray
    max_range: float = 6.0
    noise: float = 0.02
    angle_error: float = 0.004
    uncertainty: tuple[float, float] = (0.05, 0.02)

    def scan(self, rng, world, truth):
        """(pose as it is believed, ranges): each error is somewhere, often at an end, of what is
        declared.
        """
        off, turn = rng.uniform(0, 2 * np.pi), rng.choice([-1.0, 1.0])
        moved = self.uncertainty[0] * np.array([np.cos(off), np.sin(off)])
        pose = truth - np.array([*moved, turn * self.uncertainty[1]])
        wrong = self.angle_error * rng.choice([-1.0, 0.0, 1.0], len(self.angles))
        ranges = cast(world, truth, truth[2] + self.angles + wrong, self.max_range)
        return pose, np.where(ranges < self.max_range, ranges + self.noise, self.max_range)

    @property
    def declared(self) -> dict:
        return {
            "max_range": self.max_range,
            "noise": self.noise,
            "angle_error": self.angle_error,
            "uncertainty": self.uncertainty,
        }


def cast(world, place, directions, max_range):
    """Ranges (n,) to the first obstacle, by Shapely; each is cut inwards of what it would be."""
    ends = place[:2] + max_range * np.stack([np.cos(directions), np.sin(directions)], axis=1)
    starts = np.broadcast_to(place[:2], ends.shape)
    rays = shapely.linestrings(np.stack([starts, ends], axis=1))
    hits = shapely.intersection(rays, shapely.union_all(world))
    found = shapely.distance(hits, shapely.Point(place[:2]))
    return np.where(np.isnan(found), max_range, found)


def a_world(rng, width: float, n: int = 25):
    """Discs and squares of this width and up to three times it, none at the origin."""
    places = rng.uniform(-4, 4, (n, 2))
    places = places[np.hypot(*places.T) > 0.8 + 2 * width]
    sizes = width * rng.choice([1.0, 1.0, 3.0], len(places))
    found = []
    for place, size in zip(places, sizes, strict=True):
        if rng.uniform() < 0.5:
            # a circle with corners outside of it: no narrower than the disc
            found.append(shapely.Point(place).buffer(size / 2 / np.cos(np.pi / 64), quad_segs=16))
        else:
            half = size / 2
            square = shapely.box(-half, -half, half, half)
            square = shapely.affinity.rotate(square, rng.uniform(0, 90))
            found.append(shapely.affinity.translate(square, *place))
    return found
