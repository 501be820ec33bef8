"""The observation of a policy is its definition, wherever the boat is."""

import jax
import numpy as np
import pytest

from sims.asv.policy import (
    LAYOUTS,
    observe,
)

seen_from = jax.jit(observe, static_argnums=0)


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
