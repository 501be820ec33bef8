"""Jackals that decide one after the other: a judge of outlines, and two that swap places."""

import jax
import numpy as np
import pytest

import parc_jax as pj
from parc_jax.drive.loop.episode_file import load_episode
from sims.jackal import fleet, learn
from sims.jackal.driven import Driven
from sims.rectangle import centre_and_corners


def test_the_judge_sees_two_outlines_meet_and_one_at_the_border():
    path = np.zeros((3, 2, 3))
    path[:, 1, 0] = 1.0
    size = learn.robot().size
    assert fleet.nearest(path, size) == pytest.approx(1.0 - size[0])
    path[1, 1] = [0.3, 0.3, np.pi / 4]  # for one tick, corner over corner
    assert fleet.nearest(path, size) < 0
    path[1, 1] = [5.9, 0.0, 0.0]
    assert fleet.nearest(path, size) == pytest.approx(fleet.HALF - 5.9 - size[0] / 2)


def test_where_nobody_arrived_no_time_is_told():
    some, none = np.array([1.0, 3.0, np.inf]), np.full(3, np.inf)
    said = [fleet.Yard(np.zeros(0), 1.0, x, 0, [], [0.1]).said for x in (some, none)]
    assert said[0].startswith("2 of 3 arrived, the last after 3.0 s; nearest")
    assert said[1].startswith("0 of 3 arrived; nearest")


@pytest.mark.soundness
def test_a_jackal_stays_in_what_is_reserved_for_it():
    system, loop = learn.robot(), fleet.first_loop().another()
    grid = loop.model.time
    for seed in range(4):
        loop.restart()
        start = np.array([1.0, 2.0, 0.8 * seed])
        robot = Driven(system, start, jax.random.PRNGKey(seed))

        def liked(seen, seed=seed):
            return np.random.default_rng(seed).permutation(len(seen.k))

        step = loop.step(start, robot.measured, (), liked, at=0.0)
        robot.begin(*step.committed.k[-2:])
        robot.drive(1.2)
        path = robot.path
        corners = centre_and_corners(path[:, :2], path[:, 2], *system.size)
        for at in (0.0, 0.2):
            for body, (first, last) in zip(
                *pj.drive.reserved(step.committed, at, grid), strict=True
            ):
                ticks = round(50 * (at + first * grid.dt)) + np.arange(
                    1 + round(50 * (last + 1 - first) * grid.dt)
                )
                inside = corners[np.minimum(ticks, len(corners) - 1)] @ body.A.T <= body.b
                assert inside.all()


@pytest.mark.night
def test_two_that_face_each_other_swap_places_and_never_touch(tmp_path):
    yard = fleet.drive(0, robots=2)
    assert np.isfinite(yard.arrived).all() and yard.nearest > 0 and yard.left == 0
    assert "2 of 2 arrived" in yard.said
    for i, steps in enumerate(yard.steps):
        new = [step.committed for step in steps if step.new]
        assert any(len(one.asked.problem.obstacles) > 5 for one in new)
        pj.drive.save_episode(tmp_path / f"{i}.json", new)
        load_episode(tmp_path / f"{i}.json")  # raises where the checker rejects it


@pytest.mark.soundness
@pytest.mark.parametrize("near", [fleet.NEAR, 9.5], ids=["under way", "arrived"])
def test_everybody_is_looked_at_until_the_end(near, monkeypatch):
    """Also who has arrived, and who stops because another one was seen outside of its tube."""

    class Pushed(Driven):
        @property
        def pose(self):
            return super().pose + np.array([0.0, 0.5 * (self.time >= 1.0), 0.0])

    for name, value in {"Driven": Pushed, "NEAR": near, "TIMEOUT": 1.5}.items():
        monkeypatch.setattr(fleet, name, value)
    yard = fleet.drive(0, robots=2)
    assert np.isfinite(yard.arrived).all() == (near > fleet.HALF)
    for steps in yard.steps:
        last = [step.committed for step in steps if step.new][-1]
        assert last.seen_outside and steps[-1].left and not steps[-1].new
