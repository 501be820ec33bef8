"""A world that changes while the packaged Jackal drives: who appears and stays is not driven into,
and false returns cost no drive. [T44]
"""

import numpy as np
import pytest
from needs import need

import parc_jax as pj
from sims.barn.changing import Changing, driven
from sims.jackal import learn
from sims.lidar import lidar
from sims.rectangle import rectangle

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def loop():
    need("shapely")
    v, w = np.linspace(-0.8, 1.6, 17), np.linspace(-1.3, 1.3, 15)
    return pj.drive.Loop(
        learn.model(),
        rectangle(),
        leave=learn.HELD,
        candidates=np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2),
        thinking=learn.thinking(),
        effort=pj.drive.Effort(judged=255, looks=4096, room=0.05, deadline=learn.THINKS),
        clock=lambda: 0.0,
    )


@pytest.mark.soundness
@pytest.mark.parametrize("odometry", [False, True])
@pytest.mark.parametrize("person", [(2.0, 0.0, 0.25), (1.5, 0.6, 0.3)])
def test_who_appears_in_full_view_and_stays_is_driven_around(loop, odometry, person):
    import shapely

    sight = Changing(lidar(beams=541), person, cycle=12)
    done = driven(loop, 1, sight, odometry)
    assert sight.gap_of(done) > 0 and not done.touched and not done.drifted and done.reached
    off = 0.1 if odometry else 1e-6  # [m] that the frame of what is known is off, at most
    stands = shapely.Point(sight.there[:2]).buffer(sight.there[2] - off)
    assert not any(free.region.intersects(stands) for free in done.free[sight.cycle :])


@pytest.mark.parametrize("odometry", [False, True])
def test_false_returns_of_a_hundredth_of_the_beams_cost_no_drive(loop, odometry):
    sight = Changing(lidar(beams=541), short=0.01)
    done = driven(loop, 1, sight, odometry)
    assert done.reached and not done.touched and done.seconds < 12.0
