"""A robot that changes in mid-run: the alarm, the stop, a new claim, and on it goes. [T32]"""

import jax
import numpy as np
import pytest
from needs import need

import parc_jax as pj

need("gymnasium")
from platform_env import Platform, PlatformSystem, platform_net, shielded  # noqa: E402


def test_a_robot_that_changes_rings_stops_and_goes_on_with_a_new_model():
    """It goes two fifths farther from the 11th step on, in the midst of an episode."""
    (key, later), net, grip = jax.random.split(jax.random.PRNGKey(0)), platform_net(), {"off": 0.02}
    as_it_was, slick = PlatformSystem(**grip), PlatformSystem(1.4, **grip)
    claim = pj.learning.bound_error(net, as_it_was, key, eps=0.02, delta=1e-3, quiet=True)
    bare, draw, told = Platform(posts=[[2.0, -0.1]]), np.random.default_rng(0), []

    def drive(env, watch, steps):
        for _ in range(steps):
            seen, *_, info = env.step(draw.uniform(-0.6, 0.6, 2))
            told.append(info["shield"])
            if "left" in told[-1]:
                watch = watch.bet(told[-1]["left"], told[-1]["followed"])
        return seen, watch

    env = shielded(bare, pj.learning.trajectory_model(net, claim), system=as_it_was)
    env.reset()
    _, watch = drive(env, pj.monitor(claim, net), 10)
    assert (watch.seen, watch.left, watch.alarm) == (9, 0, False)
    part = 100 * env.every / float(env.loop.lasts)  # of each another took over after a step
    assert f"9 that stayed followed for {part:.3g} % of their time alone" in watch.details()
    bare.heavier, rests = 1.4, 0
    while not watch.alarm:
        seen, watch = drive(env, watch, 4)
        if told[-1]["reason"]:  # at rest; of a tube that was left it is told once
            assert "beyond what tube" in told[-1]["reason"] and (told[-1]["driven"] == 0).all()
            env.restart(seen)
            rests += 1
    assert 2 <= watch.left == rests < 9 and np.linalg.norm(bare.speed) < 0.1

    runs = [pj.learning.collect(slick, later, 400, stage, quiet=True) for stage in (1, 2)]
    net, new = pj.learning.update(claim, net, *runs)
    place = bare.place
    env = shielded(bare, pj.learning.trajectory_model(net, new), system=slick)
    assert env.restart(seen)["shield"]["certified_until"] == pytest.approx(1.2)
    assert (bare.place == place).all()  # nothing was reset
    told.clear()
    _, watch = drive(env, pj.monitor(new, net), 20)
    assert (watch.left, watch.alarm) == (0, False) and not any(one["reason"] for one in told)
    assert watch.seen == 19 and len(env.commitments) == 20
