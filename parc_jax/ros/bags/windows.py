"""Runs as windows of a recording: each begins with a command and is as long as the time grid."""

from typing import NamedTuple

import numpy as np

from parc_jax.learning.system import TimeGrid
from parc_jax.ros.bags.track import Track


class Windows(NamedTuple):
    """m runs of one recording. k (m, n_k): given parameters, then those of the command. pose (m,
    n_record + 1, 3): x, y, heading [m, rad] from where the run began; NaN where it is not known.
    short, gaps (m,): the next command came, or the recording ended, before the end of the run;
    poses are too far apart in it.
    """

    k: np.ndarray
    pose: np.ndarray
    short: np.ndarray
    gaps: np.ndarray


def windows(
    where: Track,
    times: np.ndarray,
    commands: np.ndarray,
    grid: TimeGrid,
    after: float,
    bridge: float,
) -> Windows:
    """Runs that begin `after` seconds after each new command. times (n,) [ns], commands (n, c): as
    they were sent; one begins where the values differ from those before, or where they come again
    after a pause longer than the run. bridge: [s] between poses, up to which the robot is taken to
    have gone straight.
    """
    new = np.append(True, (np.diff(commands, axis=0) != 0).any(axis=1))
    pause = np.append(True, np.diff(times) > (after + grid.t_f) * 1e9)
    first = np.flatnonzero(new | pause)
    begin = times[first] + round(after * 1e9)
    following = np.append(times[first][1:], np.iinfo(np.int64).max)
    at = begin[:, None] + np.round(np.arange(grid.n_record + 1) * grid.dt_record * 1e9)
    at = at.astype(np.int64)
    pose = _between(where.times, where.pose, at, bridge)
    given = _between(where.times, where.more, begin, bridge)
    ends = np.minimum(following, where.times[-1])
    gaps = (np.isnan(pose).any(axis=2) & (where.times[0] <= at) & (at <= ends[:, None])).any(axis=1)
    pose[at > following[:, None]] = np.nan
    short = at[:, -1] > ends
    return Windows(np.concatenate([given, commands[first]], axis=1), _from_start(pose), short, gaps)


def _between(times: np.ndarray, values: np.ndarray, at: np.ndarray, bridge: float) -> np.ndarray:
    """(..., j) of values (m, j) at times (...) [ns]; NaN outside of them, and between two that are
    farther apart than the bridge [s].
    """
    right = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1))
    if len(times) < 2:
        return np.full((*at.shape, values.shape[1]), np.nan)
    wide = times[right] - times[right - 1]
    share = ((at - times[right - 1]) / wide)[..., None]
    found = (1 - share) * values[right - 1] + share * values[right]
    exact = (at == times[right]) | (at == times[right - 1])
    unknown = (at < times[0]) | (at > times[-1]) | ((wide > bridge * 1e9) & ~exact)
    return np.where(unknown[..., None], np.nan, found)


def _from_start(pose: np.ndarray) -> np.ndarray:
    """Poses (m, t, 3) seen from the first of each run."""
    moved = pose - pose[:, :1]
    cosine, sine = np.cos(pose[:, :1, 2]), np.sin(pose[:, :1, 2])
    ahead = cosine * moved[..., 0] + sine * moved[..., 1]
    left = cosine * moved[..., 1] - sine * moved[..., 0]
    return np.stack([ahead, left, moved[..., 2]], axis=-1)
