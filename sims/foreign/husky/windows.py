"""Other recordings of the same kind, from a path that the user gives: windows of 2 s, two of them
under each command, with poses that come when they come.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.common.sets.box import box
from parc_jax.learning.runs.batch import RolloutBatch, rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import TimeGrid, time_grid
from sims.foreign.husky.log import K_LABELS, read_arrays
from sims.rectangle import POINTS, centre_and_corners

_NEEDED = ("t", "p", "yaw", "fresh", "cmd_wheel", "cmd_const", "command_id", "window", "suspect")
SECONDS, STEP, RECORD = 1.4, 0.2, 0.1  # [s] of a run at most, between its knots, its records

SAME_TIME = 1e-9  # [s] rounding of times


class Cut(NamedTuple):
    """Runs cut from windows: places p (n, n_record + 1, 2) [m] and headings yaw (n, n_record + 1)
    [rad] in the frame of each start, and the same as rollouts.
    """

    p: np.ndarray
    yaw: np.ndarray
    runs: RolloutBatch

    def select(self, index) -> "Cut":
        """The runs picked by an index array or mask."""
        return Cut(self.p[index], self.yaw[index], self.runs.select(index))


def grid(seconds: float = SECONDS) -> TimeGrid:
    """Knots and records of a run."""
    return time_grid(STEP, seconds, RECORD)


def read_windows(
    path: Path, size: tuple[float, float], suspects: bool = True, seconds: float = SECONDS
) -> Cut:
    """Steady windows of a file as runs, each from its first pose on; rows of one command are one
    group. A window whose poses end too early is a failed run.

    The file holds t (n_t,) [s], p (n, n_t, 2) [m], yaw (n, n_t) [rad], fresh (n, n_t): a pose came
    at this record, in between it is held; cmd_wheel (n, 2) [rad/s], cmd_const (n,): one command
    throughout, command_id (n,), window (n,): 0 is the one right after a change, and suspect (n,).
    size: (length, width) [m] of the robot. suspects: keep windows in which the poses jump or pause;
    who leaves them out makes the claim about the others.
    seconds: length of a run. Raises InputError.
    """
    arrays = read_arrays(path, _NEEDED, "Is it a file of windows?")
    keep = arrays["cmd_const"] & (arrays["window"] > 0) & (suspects | ~arrays["suspect"])
    p, yaw, fresh, k, command = (arrays[name][keep] for name in (*_NEEDED[1:5], "command_id"))
    at = np.arange(grid(seconds).n_record + 1) * RECORD
    cut = [
        _moved(arrays["t"][f], q[f], turn[f], at) for f, q, turn in zip(fresh, p, yaw, strict=True)
    ]
    places, headings = (np.stack(part) for part in zip(*cut, strict=True))
    corners = centre_and_corners(places, headings, *size)
    columns = (corners - corners[:, :1, :1]).reshape(len(k), len(at), -1)
    domain = box(k.min(axis=0), k.max(axis=0))
    runs = rollout_batch(
        k,
        columns,
        np.zeros((len(k), 0)),
        time=grid(seconds),
        domain=domain,
        law=law_spec(f"file:{path.name}", domain, "logged"),
        groups=command,
        points=POINTS,
        labels={"k": K_LABELS},
    )
    return Cut(places, headings, runs)


def _moved(t, p, yaw, at) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) and headings (n,) at times `at` after the first pose, in its frame; NaN after
    the last.
    """
    since = t - t[0]
    at = np.where(np.abs(at - since[-1]) < SAME_TIME, since[-1], at)
    x, y, turn = (np.interp(at, since, part, right=np.nan) for part in (*p.T, np.unwrap(yaw)))
    turned = ((x - x[0]) + 1j * (y - y[0])) * np.exp(-1j * turn[0])
    return np.stack([turned.real, turned.imag], axis=1), turn - turn[0]
