"""Worlds in step are driven as each of them alone."""

from pathlib import Path

import numpy as np
import pytest

from sims.point import episodes, together


def in_step_as_alone(
    monkeypatch, robot: str, level: int, steps: int, file: Path | None = None
) -> None:
    """By the driver with the map, or by a policy that was saved."""
    for module in (episodes, together):
        monkeypatch.setattr(module, "STEPS", steps)
    worlds, seeds = [17, 18], [np.array([3, i], np.uint32) for i in range(2)]
    law = together.Clear(robot, level)
    how = together.Together(robot, level, False, "", law, (), 2, file)
    for one, world_seed, seed in zip(how.drive(worlds, seeds), worlds, seeds, strict=True):
        alone = episodes.Drive(robot, level, False, False, policy=file)(world_seed, seed)
        assert not one.touched and one.left is False and alone.left is False
        (loop,) = {made.loop for made in one.committed}
        assert len(one.committed) == one.told["committed"] and "claim" in loop
        assert one.told["return"] == pytest.approx(alone.told["return"], abs=2e-3)
        for name in ("cost", "steps", "changed", "committed", "stopped", "nearest"):
            assert one.told[name] == alone.told[name]
