"""Worlds in step are driven as each of them alone."""

from pathlib import Path

import numpy as np
import pytest

from sims.point import episodes, together


def in_step_as_alone(
    monkeypatch, robot: str, level: int, steps: int, file: Path | None = None, without: int = 0
) -> None:
    """By the driver with the map, or by a policy that was saved. without: the seed of a world where
    no stop is certified, which is driven beside them.
    """
    for module in (episodes, together):
        monkeypatch.setattr(module, "STEPS", steps)
    worlds = [17, 18] + [without] * (without > 0)
    seeds = [np.array([3, i], np.uint32) for i in range(len(worlds))]
    law = together.Clear(robot, level)
    how = together.Together(robot, level, False, False, "", law, (), len(worlds), file)
    found = how.drive(worlds, seeds)
    assert not any(found[2:])
    for one, world_seed, seed in zip(found[:2], worlds, seeds, strict=False):
        alone = episodes.Drive(robot, level, False, False, False, policy=file)(world_seed, seed)
        assert not one.touched and one.left is False and alone.left is False
        (loop,) = {made.loop for made in one.committed}
        assert len(one.committed) == one.told["committed"] and "claim" in loop
        assert one.told["return"] == pytest.approx(alone.told["return"], abs=2e-3)
        for name in ("cost", "steps", "changed", "committed", "stopped", "nearest"):
            assert one.told[name] == alone.told[name]
