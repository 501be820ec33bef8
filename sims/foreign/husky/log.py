"""The log as rollouts: steady driving of every command, in the frame in which it begins."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.runs.batch import RolloutBatch, rollout_batch
from parc_jax.learning.runs.files import read_npz
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import TimeGrid, time_grid
from sims.foreign.husky import params as c
from sims.rectangle import POINTS, centre_and_corners

FILE = Path(__file__).with_name("husky.npz")
NAME = "husky"
K_LABELS = ("left wheels [rad/s]", "right wheels [rad/s]")
_NEEDED = ("t", "p", "yaw", "command", "number")


class Log(NamedTuple):
    """Steps of a recording, one command each.

    t (n_t,) [s] since the command began. p (n, n_t, 2) [m] and yaw (n, n_t) [rad], not wrapped, in
    the frame in which the robot stood when it began. command (n, 2) [rad/s] of the left and the
    right wheels. number (n,) of the command in order of time.
    """

    t: np.ndarray
    p: np.ndarray
    yaw: np.ndarray
    command: np.ndarray
    number: np.ndarray

    def select(self, index) -> "Log":
        """The steps picked by an index array, mask or slice."""
        return Log(self.t, *(part[index] for part in self[1:]))


def read_log(path: Path = FILE) -> Log:
    """The steps in a file of `convert`. Raises InputError."""
    hint = "`python -m sims.foreign.husky.convert` writes such a file."
    arrays = read_arrays(path, _NEEDED, hint)
    t, p, yaw, command = (np.asarray(arrays[name], np.float64) for name in _NEEDED[:4])
    return Log(t, p, yaw, command, np.asarray(arrays["number"], np.int64))


def read_arrays(path: Path, needed: Sequence[str], hint: str) -> dict[str, np.ndarray]:
    """The arrays of an .npz file. Raises InputError, with the hint, where a needed one is
    missing.
    """
    arrays = read_npz(path)
    missing = [name for name in needed if name not in arrays]
    if missing:
        raise InputError(
            f"{path}: expected arrays {', '.join(needed)}; {missing[0]} is missing. {hint}"
        )
    return arrays


def grid() -> TimeGrid:
    """Knots and records of a run."""
    return time_grid(c.PLAN_STEP, c.T_FINAL, c.RECORD)


def domain() -> Box:
    """K: the box from which the commands were drawn."""
    lo, hi = c.COMMANDS
    return box([lo, lo], [hi, hi])


def windows(log: Log, begin: float = c.STEADY) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, n_record + 1, 2) [m] and headings (n, n_record + 1) [rad] at the records of a
    run that begins `begin` seconds after the command, in the frame of its own start.
    """
    at = begin + np.arange(grid().n_record + 1) * grid().dt_record
    if at[-1] > log.t[-1] + 1e-9:
        raise InputError(
            f"husky: expected a window within {log.t[-1]:g} s of a command; got one from {begin:g} "
            f"to {at[-1]:g} s."
        )
    p = np.stack([[np.interp(at, log.t, axis) for axis in run.T] for run in log.p]).swapaxes(1, 2)
    yaw = np.stack([np.interp(at, log.t, run) for run in log.yaw])
    moved = p - p[:, :1]
    cos, sin = np.cos(yaw[:, :1]), np.sin(yaw[:, :1])
    ahead = cos * moved[..., 0] + sin * moved[..., 1]
    left = cos * moved[..., 1] - sin * moved[..., 0]
    return np.stack([ahead, left], axis=-1), yaw - yaw[:, :1]


def recorded(log: Log, begin: float = c.STEADY) -> RolloutBatch:
    """The runs of a log: k = the command, uniform on K, points = the centre and the corners of the
    footprint; every command is a group of its own.
    """
    p, yaw = windows(log, begin)
    places = centre_and_corners(p, yaw, c.LENGTH, c.WIDTH)
    places = places - places[:, :1, :1]
    columns = places.reshape(*p.shape[:2], -1)
    return rollout_batch(
        log.command,
        columns,
        np.zeros((len(p), 0)),
        time=grid(),
        domain=domain(),
        law=law_spec(NAME, domain(), "uniform"),
        rows=log.number,
        groups=log.number,
        points=POINTS,
        labels={"k": K_LABELS},
    )
