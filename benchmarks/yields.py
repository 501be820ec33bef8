"""The systems and settings whose yields are compared: what a study asks today, and what it asked
before.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import GAP
from parc_jax.problem.problem import Problem


@dataclass(frozen=True)
class Setting:
    """One way of spending the runs of a task. key: for metrics. study: one network, fresh runs
    named.
    """

    key: str
    name: str
    study: Study

    @property
    def runs(self) -> int:
        """On training, profile and claims."""
        return self.study.rollouts + self.study.bound.profile_runs + self.study.bound.fresh


@dataclass(frozen=True)
class Task:
    """A system with its scene. chance: whether two runs of a plan may differ. plans: values of k
    whose truth is asked; repeats: runs of each; both for systems with chance only. gap: [m or rad]
    declared of the start.
    """

    name: str
    title: str
    system: Callable
    problem: Callable[[], Problem]
    settings: tuple[Setting, ...]
    chance: bool = True
    plans: int = 400
    repeats: int = 200
    gap: float = GAP


def tasks(quick: bool) -> tuple[Task, ...]:
    """All of them; tiny settings for a quick look."""
    every = (_boat(), _drift("disc"), _drift("rectangle"), _car())
    return tuple(_quick(task) for task in every[:2]) if quick else every


def _quick(task: Task) -> Task:
    few = {"rollouts": 64, "profile_runs": 64, "fresh": 96, "eps": 0.2, "delta": 0.2, "seeds": 1}
    one = {"blocks": None, "steps": 50, "tail": None}
    settings = tuple(
        replace(
            s, study=s.study.replace(bins=(1,) * len(s.study.bound.bins or (1, 1)), **few, **one)
        )
        for s in task.settings[-2:]
    )
    return replace(task, settings=settings)


def _one_bin(study: Study) -> tuple[int, ...]:
    return (1,) * len(study.bound.bins or (1, 1))


def _boat() -> Task:
    import sims
    from sims.asv import scenario, study

    fitted, boxes = study.STUDY, study.BOXES
    faces = boxes.replace(shape="fitted", tail=None)
    finer = faces.replace(bins=fitted.bound.bins, blocks=fitted.bound.blocks)
    return Task(
        "boat",
        "boat",
        lambda: sims.load("asv", plant="ode"),
        scenario.problem,
        (
            Setting("boxes", "boxes, 27 bins", boxes),
            Setting("fitted", "fitted, 27 bins", faces),
            Setting("blocks", "fitted, 216 bins in 27 blocks", finer),
            Setting("study", "the same, trained on all", fitted),
        ),
    )


def _drift(body: str) -> Task:
    import sims
    from sims.drift_parking import scenario, study

    # so many fresh runs that three may be left outside: one jump does not decide
    boxes = study.STUDY.replace(rollouts=10_000, profile_runs=13_000, fresh=14_000, body=body)
    return Task(
        f"drift_{body}",
        f"drift, {body}",
        lambda: sims.load("drift_parking", plant="ode", body=body),
        lambda: scenario.problem(body),
        (
            Setting("boxes", "boxes, bins cut", boxes),
            Setting("boxes_20x4", "boxes, 20 x 4 bins", boxes.replace(bins=(20, 4))),
            Setting(
                "fitted_20x4", "fitted, 20 x 4 bins", boxes.replace(bins=(20, 4), shape="fitted")
            ),
        ),
        chance=False,
    )


def _car() -> Task:
    import sims
    from sims.f110 import scenario
    from sims.f110.lesson import DELTA, EPS
    from sims.f110.study import STUDY

    asked = {"eps": EPS, "delta": DELTA, "rollouts": 500, "profile_runs": 0, "fresh": 500}
    boxes = STUDY.replace(**asked)
    return Task(
        "car",
        "model car",
        lambda: sims.load("f110"),
        scenario.problem,
        (
            Setting("boxes", "boxes, one bin", boxes),
            Setting("fitted", "fitted, one bin", boxes.replace(shape="fitted")),
            Setting("fitted_3x3", "fitted, 3 x 3 bins", boxes.replace(shape="fitted", bins=(3, 3))),
        ),
        plans=48,
        repeats=100,
        gap=STUDY.bound.gap,
    )
