"""The car as a black box that can be certified."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.system import ONE_POINT, TimeGrid, Trajectory, time_grid
from sims import rectangle
from sims.f110 import params as c
from sims.f110.disturbance import Law, draw, named_law
from sims.f110.scenario import BODIES
from sims.f110.simulate import Run, simulate
from sims.one_run import one_run


@dataclass(frozen=True, eq=False)
class F110:
    """Drifting over k = (line y [m], speed [m/s]); p = (x, y) [m] as the motion capture saw them,
    with points also of the four corners; q = (last heading,).

    Build with `system`. Every run differs: friction, motor, start and the rest are drawn from its
    key (see `law`).
    """

    domain: Box
    time: TimeGrid
    law: Law
    threads: int = 0
    points: tuple[str, ...] = ONE_POINT

    name: ClassVar[str] = "f110"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 1
    q_labels: ClassVar[tuple[str, ...]] = ("last heading [rad]",)
    k_labels: ClassVar[tuple[str, ...]] = ("y of the line [m]", "speed [m/s]")

    def run(self, keys, ks, **options) -> Run:
        """Everything about runs with keys (B, 2), ks (B, 2); options go to `simulate`."""
        ks = np.asarray(ks, np.float64)
        return simulate(
            ks,
            draw(self.law, keys, self.time.n_record),
            self.time.n_record,
            self.threads,
            **options,
        )

    def rollout_batch(self, keys, ks) -> Trajectory:
        """p (B, 589, 2) or (B, 589, 5, 2) relative to the recorded start, q (B, 1). NaN for a run
        on which the physics failed.
        """
        return self._seen(self.run(keys, ks).measured)

    def rollout_from_batch(self, keys, ks, starts) -> Trajectory:
        """The runs with each lab, and with it the start, moved by starts (B, 2) [m]; p is relative
        to the start.
        """
        keys, ks, starts = (
            np.asarray(keys),
            np.asarray(ks, np.float64),
            np.asarray(starts, np.float64),
        )
        runs = [
            self.run(keys[i : i + 1], ks[i : i + 1], origin=start).measured
            for i, start in enumerate(starts)
        ]
        return self._seen(np.concatenate(runs))

    def _seen(self, measured: np.ndarray) -> Trajectory:
        """What is reported of measured poses (B, n + 1, 3)."""
        p = measured[:, :, :2] - measured[:, :1, :2]
        if self.points != ONE_POINT:
            p = rectangle.centre_and_corners(p, measured[..., 2], c.BODY_LENGTH, c.BODY_WIDTH)
        return Trajectory(p, measured[:, -1, 2:])

    rollout = one_run


def system(law: str = "floor", threads: int = 0, body: str = "disc") -> F110:
    """The car. law: "floor", or "none": every run the same. threads: of the C engine, 0 = all.
    body: as of `problem`; with "rectangle" the corners are reference points too. Raises InputError.
    """
    rectangle.require_body(body, BODIES)
    lo, hi = zip(c.LINE_RANGE, c.SPEED_RANGE, strict=True)
    grid = time_grid(c.PLAN_STEP, c.T_FINAL, c.PLAN_STEP / c.TICKS_PER_PLAN_STEP)
    points = rectangle.POINTS if body == rectangle.BODY else ONE_POINT
    return F110(box(lo, hi), grid, named_law(law), threads, points)


def body_of(car: F110) -> str:
    """The body whose reference points the car reports."""
    return "disc" if car.points == ONE_POINT else rectangle.BODY


def seen_as(body: str, runs: RolloutBatch) -> RolloutBatch:
    """Runs of the car with any body, as a car with this one would have reported the same: the disc
    has its centre alone. Raises InputError for runs without the corners that the body needs.
    """
    rectangle.require_body(body, BODIES)
    if body == "disc":
        return replace(runs, p=runs.p[..., : F110.n_p], points=ONE_POINT)
    if runs.points != rectangle.POINTS:
        raise InputError(f"runs: expected the points {rectangle.POINTS}; got {runs.points}.")
    return runs
