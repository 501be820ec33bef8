"""Policies: observation and files."""

import json

import jax
import numpy as np
import pytest

from sims.asv.policy import (
    HOVER,
    LAYOUTS,
    observe,
    policy_from_file_arrays,
)

seen_from = jax.jit(observe, static_argnums=0)


@pytest.fixture
def arrays():
    with np.load(HOVER, allow_pickle=False) as file:
        return dict(file)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_observation_is_the_definition(layout, rng):
    for _ in range(20):
        position, goal, velocity, yaw = (
            rng.normal(size=2),
            rng.normal(size=2),
            rng.normal(size=3),
            rng.uniform(-9, 9),
        )
        e = goal - position
        alpha, d = np.arctan2(e[1], e[0]) - yaw, np.hypot(*e)
        c, s = np.cos(yaw), np.sin(yaw)
        motion = [
            c * velocity[0] + s * velocity[1],
            -s * velocity[0] + c * velocity[1],
            velocity[2],
        ]
        tail = (
            [d, np.cos(alpha), np.sin(alpha)]
            if layout == "neuralparc"
            else [np.cos(alpha), np.sin(alpha), d]
        )
        expected = np.array(motion + tail + [0.0] * (LAYOUTS[layout] - 6))
        seen = seen_from(layout, position, yaw, velocity, goal)
        np.testing.assert_allclose(seen, expected, atol=1e-12)
        shift = rng.normal(size=2)  # the vessel only knows where the goal is from it
        moved = seen_from(layout, position + shift, yaw, velocity, goal + shift)
        np.testing.assert_allclose(moved, expected, atol=1e-12)


def broken(arrays, **changes):
    return {**arrays, **changes}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: {n: v for n, v in a.items() if n != "W1"}, "W1; they are missing"),
        (lambda a: broken(a, W0=a["W0"][:, :5]), "expected weights"),
        (lambda a: broken(a, b1=np.full_like(a["b1"], np.nan)), "expected finite numbers"),
        (lambda a: broken(a, obs_var=-a["obs_var"]), "variances >= 0"),
        (lambda a: broken(a, activation=np.array("relu")), "expected tanh layers"),
        (lambda a: broken(a, meta=np.array("{}")), "expected meta"),
        (
            lambda a: broken(
                a, meta=np.array(json.dumps({**json.loads(str(a["meta"])), "period": 0.03}))
            ),
            "control period",
        ),
        (
            lambda a: broken(
                a, meta=np.array(json.dumps({**json.loads(str(a["meta"])), "layout": "x"}))
            ),
            "expected a layout",
        ),
    ],
)
def test_bad_arrays_are_refused(arrays, change, message):
    with pytest.raises(ValueError, match=message):
        policy_from_file_arrays(change(arrays))
