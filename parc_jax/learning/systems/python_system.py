"""A plain Python callable as a black box: worker processes, row by row, failures stay failures."""

import pickle
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import key_data
from parc_jax.common.sets.box import Box
from parc_jax.learning.runs.chunks import cores
from parc_jax.learning.system import ONE_POINT, Retried, TimeGrid, Trajectory, check_points
from parc_jax.learning.systems.fleet import Fleet, Processes
from parc_jax.learning.systems.python_worker import run_many
from parc_jax.learning.systems.user_code import said

# per chunk: the progress bar moves and finished work is kept this often
RUNS_PER_WORKER, ELSEWHERE = 16, 4
LOST = ("failed", "again")
AT_ONCE = 3  # chunks that a fleet works on, so that the slowest run delays none


@dataclass(eq=False, repr=False)
class PythonSystem:
    """A black box around simulate(rng, k) -> (p, q). Build with `python_system`, which validates.

    name, domain, time, n_p, n_q, law, points: as of any black box. chunk: runs per step of the
    progress bar. at_once: chunks worked on side by side.
    """

    simulate: Callable
    simulate_from: Any  # a function, or None
    name: str
    law: Mapping | None
    domain: Box
    time: TimeGrid
    n_p: int
    n_q: int
    workers: int
    points: tuple[str, ...]
    q_labels: Sequence[str] | None
    k_labels: Sequence[str] | None
    _fleet: Fleet | None

    def __post_init__(self) -> None:
        self.chunk, self.at_once = RUNS_PER_WORKER * max(1, self.workers), 1
        if self._fleet is not None and not self._fleet.own:
            self.chunk, self.at_once = ELSEWHERE * self._fleet.workers, AT_ONCE
        self._has_worked = False
        if self.simulate_from is not None:
            self.rollout_from_batch = self._rollout_from_batch

    def rollout_batch(self, keys: jax.Array, ks: np.ndarray) -> Trajectory | Retried:
        """Runs (B, ...) of keys (B, 2) and ks (B, n_k), in float64. A run that raised or ended its
        process is NaN.

        Raises InputError with file and line of the fault while no run has worked.
        """
        return self._run(0, keys, [(k,) for k in np.asarray(ks, np.float64)])

    def close(self) -> None:
        """End the worker processes; they start again when needed."""
        if self._fleet is not None:
            self._fleet.close()

    def _rollout_from_batch(self, keys, ks, starts) -> Trajectory | Retried:
        pairs = zip(np.asarray(ks, np.float64), np.asarray(starts, np.float64), strict=True)
        return self._run(1, keys, list(pairs))

    def _run(self, which: int, keys, arguments: list[tuple]) -> Trajectory | Retried:
        seeds = [tuple(int(v) for v in row) for row in key_data(keys)]
        each = (self.n_p,) if len(self.points) == 1 else (len(self.points), self.n_p)
        shapes = (self.time.n_record + 1, *each), (self.n_q,)
        both = self.simulate, self.simulate_from
        run = run_many if self._fleet is None else self._fleet.run
        try:
            runs = run(both, which, seeds, arguments, *shapes)
        except ImportError as error:
            raise InputError(
                f"{self.name}: expected simulate to find what it imports; {said(error)}. Install "
                "it where the runs are made."
            ) from None
        self._has_worked |= not all(run.why for run in runs)
        if not self._has_worked:
            raise InputError(
                f"{self.name}: expected simulate(rng, k) to work; all {len(runs)} runs of a batch "
                f"failed, the first {runs[0].why}."
            )
        p, q = np.stack([run.p for run in runs]), np.stack([run.q for run in runs])
        lost = np.array([run.lost for run in runs])
        return Retried(p, q, lost) if lost.any() else Trajectory(p, q)


def python_system(
    simulate: Callable,
    domain: Box,
    time: TimeGrid,
    *,
    name: str,
    n_p: int,
    n_q: int = 0,
    workers: int | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
    lost: str = "failed",
    law: Mapping | None = None,
    simulate_from: Callable | None = None,
    points: Sequence[str] = ONE_POINT,
    q_labels: Sequence[str] | None = None,
    k_labels: Sequence[str] | None = None,
) -> PythonSystem:
    """A black box around a plain Python function.

    simulate: (rng, k (n_k,)) -> (p (n_record + 1, n_p) [m], q (n_q,)). All randomness comes from
        rng, a NumPy generator seeded by the row alone. Positions are made relative to the first
        one. An exception counts as a failed run.
    points: names of the reference points; with m of them p is (n_record + 1, m, n_p).
    simulate_from: (rng, k, p0) -> the same from another start, to measure translation invariance.
    workers: processes, None = one per core, 0 = none (runs in this process, of any callable). With
        workers the function is pickled: define it at the top level of a module, and guard the
        start of a script with `if __name__ == "__main__":`, since every worker imports it.
    executor: runs are made there instead: any `concurrent.futures.Executor`, of other packages too,
        or a function that makes one, which is called again when one broke. workers: their number,
        None = as it reports. Workers with other code or globals are refused, own ones for globals.
    lost: of an executor, fate of a run whose worker was lost: "failed", since the run may have
        ended it, with all that were under way where workers go down together; or "again", where
        machines go away independently of their runs. Claims list `WORKERS_LOST`, with how many
        were, or uncounted: also of executors of other packages, which may make calls again.
    law: parameters of the disturbances, for the record. q_labels, k_labels: names with units, such
        as "speed [m/s]". Raises InputError.
    """
    if lost not in LOST or (lost == "again" and executor is None):
        raise InputError(
            f'{name}: expected lost = "failed", or "again" beside an executor whose machines go '
            f"away; got {lost!r}. A run that ends a process of this machine has failed."
        )
    fleet: Fleet | None = None
    if executor is not None:
        if not (hasattr(executor, "submit") or callable(executor)) or workers == 0:
            raise InputError(
                f"{name}: expected an executor with `submit`, or a function that makes one, and "
                f"one or more workers; got {type(executor).__name__} and {workers}."
            )
        fleet = Fleet(name, executor, workers, lost == "again")
    workers = cores() if workers is None else workers
    if n_p < 1 or n_q < 0 or workers < 0:
        raise InputError(
            f"{name}: expected n_p >= 1, n_q >= 0 and workers >= 0; got {n_p}, {n_q}, {workers}."
        )
    for function in (simulate, simulate_from):
        if function is not None and not callable(function):
            raise InputError(f"{name}: expected a function; got {type(function).__name__}.")
        try:
            pickle.loads(pickle.dumps(function if workers and executor is None else None))
        except Exception as error:  # the hooks of an object raise anything
            raise InputError(
                f"{name}: expected a function that can be sent to worker processes; {error}. "
                "Define it at the top level of a module, or pass workers=0."
            ) from None
    if executor is None and workers:
        fleet = Fleet(name, partial(Processes, workers), workers, again=False)
    named = check_points(name, points)
    black_box = name, law, domain, time, n_p, n_q, workers, named, q_labels, k_labels
    return PythonSystem(simulate, simulate_from, *black_box, fleet)
