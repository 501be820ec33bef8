"""Few recorded runs of real robots, from the log to a proved plan with nothing but defaults:
`python -m benchmarks.few_runs FOLDER`, which holds the files named in CASES; the Husky's log comes
with the package.

A fifth of the recordings is set aside before anything is learned, and replayed against the answer,
and against the set that the held-out ones validate. --bay: of so many times the robot's size and
not the case's own; --runs: no more recordings; --wild: one of them mirrored at twice the size.
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.common.keys import key_of
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.learn import WITH_PRIOR, learn_report
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.safe_set.verdict.outcomes import reached_and_touched
from sims.foreign.husky import log, windows
from sims.foreign.husky.scenario import problem
from sims.recorded import replay_recorded
from sims.rectangle import POINTS, centre_and_corners

UNSEEN = 0.2  # of the recordings
WALL = 0.3  # [m]
CAR = (0.5, 0.3)  # [m] length and width of a car of 1:10
CAR_TIME = pj.learning.time_grid(0.1, 0.9, 0.05)


class Case(NamedTuple):
    """A log and a place to drive. read: from a folder to its runs. size, bay [m]: length and width
    of the robot, and of the bay in which it may stand at the end, walls ahead and on both sides.
    """

    name: str
    read: Callable[[Path], pj.types.RolloutBatch]
    size: tuple[float, float]
    bay: tuple[float, float]


def read_husky(folder: Path) -> pj.types.RolloutBatch:
    """The log of the package; a step is a recording."""
    del folder
    return log.recorded(log.read_log())


def read_windows(
    file: str, size: tuple[float, float], seconds: float, folder: Path
) -> pj.types.RolloutBatch:
    """Steady windows of a file; a command is a recording."""
    return windows.read_windows(folder / file, size, seconds=seconds).runs


def read_car(folder: Path) -> pj.types.RolloutBatch:
    """Pieces with one input of the runs of a car, in the frame in which each begins. k: steering,
    speed that is asked for, speed at the start, which is measured.
    """
    arrays = log.read_arrays(
        folder / "f1tenth_koopman_runs.npz", ("t", "input", "p", "yaw", "v"), "See its README."
    )
    t, given, p, yaw, v = (arrays[name] for name in ("t", "input", "p", "yaw", "v"))
    length = round(CAR_TIME.t_f / (t[1] - t[0]))
    every = round(CAR_TIME.dt_record / (t[1] - t[0]))
    pieces = []
    for run, inputs in enumerate(given):
        at = 0
        while at + length <= len(inputs):
            same = (inputs[at : at + length] == inputs[at]).all()
            if same:
                pieces.append((run, at))
            at += length if same else 1
    rows, first = np.array(pieces).T
    records = first[:, None] + np.arange(0, length + 1, every)
    turn = np.unwrap(yaw, axis=1)[rows[:, None], records]
    way = (p @ np.array([1.0, 1j]))[rows[:, None], records]
    way = (way - way[:, :1]) * np.exp(-1j * turn[:, :1])
    places = centre_and_corners(np.stack([way.real, way.imag], -1), turn - turn[:, :1], *CAR)
    k = np.column_stack([given[rows, first], v[rows, first]])
    domain = pj.box(k.min(axis=0), k.max(axis=0))
    columns = (places - places[:, :1, :1]).reshape(len(k), records.shape[1], -1)
    return rollout_batch(
        k,
        columns,
        np.zeros((len(k), 0)),
        time=CAR_TIME,
        domain=domain,
        law=law_spec("file:f1tenth", domain, "logged"),
        groups=rows,
        points=POINTS,
        labels={"k": ("steering [rad]", "speed asked for [m/s]", "speed at the start [m/s]")},
    )


WARTHOG = (1.52, 1.38)
CASES = (
    Case("Husky on tiles, 4 s", read_husky, (0.84, 0.66), (2.2, 1.6)),
    Case(
        "Husky on tiles, 1.4 s",
        partial(read_windows, "husky_tile_windows.npz", (0.84, 0.66), 1.4),
        (0.84, 0.66),
        (2.2, 1.6),
    ),
    Case(
        "Warthog on asphalt, 1 s",
        partial(read_windows, "warthog_asphalt_a_windows.npz", WARTHOG, 1.0),
        WARTHOG,
        (12.0, 12.0),
    ),
    Case(
        "Warthog on ice, 1 s",
        partial(read_windows, "warthog_ice_windows.npz", WARTHOG, 1.0),
        WARTHOG,
        (12.0, 12.0),
    ),
    Case("car of 1:10, 0.9 s", read_car, CAR, (1.2, 0.8)),
)


def harder(
    runs: pj.types.RolloutBatch, most: int | None, wild: bool, seed: int
) -> pj.types.RolloutBatch:
    """At most so many of the recordings, and one of them mirrored at twice the size."""
    rng = np.random.default_rng(seed)
    groups = np.arange(runs.n) if runs.groups is None else runs.groups
    names = rng.permutation(np.unique(groups))[:most]
    runs = runs.select(np.isin(groups, names))
    if wild:
        odd = np.isin(groups[np.isin(groups, names)], names[:1])
        runs = runs.replace(p=np.where(odd[:, None, None], -2 * np.asarray(runs.p), runs.p))
    return runs


def row(
    case: Case, folder: Path, seed: int, bay: float | None, most: int | None, wild: bool
) -> str:
    """A row of the table. Raises SoundnessError where a run inside the tube failed."""
    known, unseen = harder(case.read(folder), most, wild, seed).split(UNSEEN, seed)
    train, held = known.split(0.5, seed)
    learned = learn_report(train, key_of(seed), WITH_PRIOR, "twist", holdout=held)
    model, claim = learned.model, learned.model.claim
    wide = 100 * float(model.tube.interval.max())
    length, width = case.bay if bay is None else (bay * side for side in case.size)
    scene = problem(width, length)
    settings = pj.Settings(samples=20)
    answer = pj.Planner(model).solve(scene, jax.random.PRNGKey(seed), settings)
    left_out = f"{claim.discard} of {claim.n} {claim.unit.many}"
    told = f"| {case.name} | {_of(known)} | {left_out} | {rounded_up(100 * float(claim.eps), 3)} %"
    told = f"{told} | ±{rounded_up(wide, 3)} cm | {answer.status.label}"
    if answer.status.found:
        told = f"{told}, at least {rounded_down(100 * answer.share_of_k())} % of K "
        told += "(99.9 % confidence) | "
        replayed = replay_recorded(answer, unseen)
        rows = np.zeros(0, int) if replayed is None else replayed.row
        told += f"{_started(unseen, rows, model.domain)}: {len(rows)} replays"
        if replayed is not None:
            n = replayed.counts()
            told += f", {n['left_the_tube']} left, {n['missed_the_goal']} missed"
            told += f", {n['touched']} touched"
    return f"{told} | {validated(answer, unseen, seed)} |\n{learned.prior}"


def _of(runs: pj.types.RolloutBatch) -> str:
    return f"{runs.n} runs of {runs.recordings} recordings"


def _started(unseen: pj.types.RolloutBatch, rows: np.ndarray, domain: pj.types.Box) -> str:
    """Unseen runs with a start, those of `rows`, of all of them."""
    some = unseen.select(np.unique(rows))
    outside = unseen.n - int(domain.contains(unseen.k).sum())
    return f"{_of(some)} with a start, of {_of(unseen)}, {outside} of these runs outside K"


def validated(answer: pj.types.Answer, unseen: pj.types.RolloutBatch, seed: int) -> str:
    """The validated set, and unseen runs from a start that it has for them."""
    found = answer.validation
    if found is None or found.answer is None:
        return "(V) not asked for" if found is None else found.details()
    model = found.answer.model
    known = np.flatnonzero(model.domain.contains(unseen.k))
    starts = found.answer.starts(jax.random.PRNGKey(seed), unseen.k[known], 10)
    rows = np.repeat(known, [len(p0) for p0 in starts])
    failed = np.zeros(0, bool)
    if len(rows):
        p0 = np.concatenate(starts)
        failed = ~np.logical_and(*_went(found.answer.scene, unseen.select(rows), p0))
    step, share = found.steps[-1], rounded_down(100 * found.answer.share.share, 3)
    claim = model.claim
    return (
        f"(V) {claim.discard} of {claim.n} {claim.unit.many} failed at {claim.evidence['scale']}, "
        f"next {step.failed} of {step.n}; {share} % of plans; unseen: "
        f"{_started(unseen, rows, model.domain)}, {failed.sum()} of {len(rows)} replays failed"
    )


def _went(scene, runs, p0) -> tuple[np.ndarray, np.ndarray]:
    reached, touched = reached_and_touched(scene, runs, p0)
    return reached, ~touched


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the logs are")
    parser.add_argument("--only", help="rows whose name has this in it", default="")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bay", type=float, default=None)
    parser.add_argument("--runs", type=int, default=None)
    parser.add_argument("--wild", action="store_true")
    given = parser.parse_args()
    cases = [case for case in CASES if given.only in case.name]
    if not cases:
        names = ", ".join(case.name for case in CASES)
        raise InputError(f"only: expected a part of one of {names}; got {given.only!r}.")
    for case in cases:
        print(row(case, given.folder, given.seed, given.bay, given.runs, given.wild), flush=True)


if __name__ == "__main__":
    main()
