"""A corridor again from its certificate."""

import numpy as np

from parc_jax.checker import number
from parc_jax.common.spelling import nearest_floats
from parc_jax.proof.certificate.write import by_pair
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.separation.directions import Multiplier
from parc_jax.safe_set.verdict.scene import Scene


def corridor_of(scene: Scene, part: dict) -> Corridor:
    """The corridor of a certificate, each direction rounded as when it was chosen."""
    table = scene.directions
    assert table is not None  # the scene of an answer has them
    n = len(table.multipliers)
    active = scene.obstacles.active[:n]
    w = np.zeros((*active.shape, table.w.shape[2]))
    support = np.full(active.shape, -np.inf)
    multipliers = np.empty(active.shape, object)
    said = by_pair(part["sep"])
    own = said if scene.apart is None else [said[pair] for pair in scene.apart.kept]
    for o, runs in enumerate(own):
        first = int(np.argmax(active[o]))
        for end, terms in runs:
            m = Multiplier(tuple(row for row, _ in terms), tuple(number(v) for _, v in terms))
            along, exact = table.direction(o, m)
            w[o, first:end] = along
            support[o, first:end] = exact + scene.slack * np.abs(along).sum()
            for t in range(first, end):
                multipliers[o, t] = m
            first = end
    p0, k = (np.array(nearest_floats(part[name])) for name in ("p0", "k"))
    points = scene.obstacles.points[:n]
    return Corridor(w, support, multipliers, points, p0, k, scene.apart)
