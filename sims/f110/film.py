"""A rendered film of the car drifting into the space, without a screen: `python -m sims.f110.film
--out film.gif`.
"""

from pathlib import Path

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.film import require_kind
from parc_jax.app.plot.shapes import shadow
from parc_jax.common.sets.extent import bounding_box
from parc_jax.problem.problem import Problem
from sims import film as films
from sims.f110 import params as c
from sims.f110.car import XML
from sims.f110.scenario import SPACE, problem
from sims.f110.system import system

EVERY = 4  # ticks per frame: 30 frames a second
VIEW = films.View((5.0, -0.85, 0.0), distance=3.8, elevation=-38.0)
ENTERS = 2.4  # [m] where the car comes into view, and the film begins
RED, GREEN = [0.55, 0.1, 0.12, 1], [0.0, 0.62, 0.45, 0.5]
BLUE = [0.34, 0.62, 0.85, 1]


def film(
    out: Path,
    k: tuple[float, float] = (-1.45, 2.6),
    start: tuple[float, float] | None = None,
    seed: int = 0,
    size: tuple[int, int] = (1280, 720),
    answer: Path | None = None,
) -> Path:
    """Drive once in the scene of the study and write the film. Raises InputError when it cannot be
    rendered here.

    Args:
        out: A .gif file, or a folder for .png files.
        k: Line [m] and speed [m/s].
        start: [m]; by default the one from which the car without disturbance stops in the middle of
            the space.
        seed: Of the run's disturbances.
        size: Width and height [pixels].
        answer: A saved answer, whose first sample is driven in its own scene in place of k and
            start, over its tube.
    """
    if answer is not None:
        return film_of(load_answer(answer), out, 0, False, size, seed)
    require_kind(out)
    films.headless_mujoco()  # before the engine imports it
    if start is None:
        still = system(law="none").run(np.zeros((1, 2), np.uint32), np.array([k], np.float64))
        start = np.array(SPACE) - still.pose[0, -1, :2]
    return _film(out, problem(), start, k, seed, size, quiet=False)


def film_of(
    answer: Answer,
    out: Path,
    sample: int = 0,
    quiet: bool = True,
    size: tuple[int, int] = (1280, 720),
    seed: int = 0,
) -> Path:
    """Drive one safe sample of an answer once, in its scene, and write the film. Blue on the floor:
    the tube of every reference point. Raises InputError.
    """
    from parc_jax.app.plot.shapes import predicted

    films.require_film(out, answer, sample)
    plan = answer.samples[sample]
    path, _, error = predicted(answer.model, plan[None])
    tube = path[0], error[0]
    return _film(Path(out), answer.problem, plan[:2], plan[2:], seed, size, quiet, tube)


def _film(
    out: Path,
    scene: Problem,
    start,
    k,
    seed: int,
    size: tuple[int, int],
    quiet: bool,
    tube: tuple[np.ndarray, np.ndarray] | None = None,
) -> Path:
    run = system().run(
        jax.random.PRNGKey(seed)[None], np.array([k], np.float64), origin=start, keep_qpos=True
    )
    first = int(np.argmax(run.qpos[0, :, 0] > ENTERS))
    poses = run.qpos[0, first::EVERY]
    seconds = (first + EVERY * np.arange(len(poses))) * c.TICK
    legend = [("parked", RED), ("space", GREEN), *([] if tube is None else [("tube", BLUE)])]
    caption = f"f110: one run, line {k[0]:.3g} m, speed {k[1]:.3g} m/s"
    rate, model = 1 / (EVERY * c.TICK), stage(scene, tube)
    return films.film_of_poses(out, model, poses, VIEW, size, rate, seconds, caption, legend, quiet)


def stage(scene: Problem, tube: tuple[np.ndarray, np.ndarray] | None = None):
    """The car's model with the parked cars of a scene, and its goal painted on the floor, with the
    tube: predicted path (T + 1, n_c) and half widths (T, n_c) [m].
    """
    spec = films.headless_mujoco().MjSpec.from_file(str(XML))
    for number, car in enumerate(scene.obstacles):
        around = bounding_box(car)
        middle, span = (around.lo + around.hi) / 2, around.hi - around.lo
        films.add_car(spec.worldbody, f"parked_{number}", *span, RED, at=middle)
    goal = shadow(scene.goal)
    films.paint(spec, "space", goal.min(axis=0), goal.max(axis=0), GREEN)
    if tube is not None:
        films.paint_tube(spec, *tube, BLUE, z=0.001)
        spec.visual.quality.shadowsize = 0  # its boxes would shade each other in streaks
    return spec.compile()


if __name__ == "__main__":
    import tyro

    tyro.cli(film)
