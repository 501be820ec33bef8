"""A rendered film of drift parking: the simulated run of one safe plan, over the tube that was
proved for it.
"""

from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.plot.shapes import shadow
from parc_jax.common.arrays import x64
from parc_jax.common.sets.extent import bounding_box
from parc_jax.problem.problem import Problem
from sims import film
from sims.drift_parking import params as c
from sims.drift_parking.system import system

RATE = 25  # [frames/s]
REST = 0.6  # [s] shown after the car has stopped
NEARNESS = (
    0.74  # distance of the camera over the width of the scene; at 0.68 the scene fills the picture
)
ROOM, LINE = 0.45, 0.12  # [m] between a parked car and the line around it, width of the line
RED, GREY, WHITE = [0.85, 0.13, 0.12, 1], [0.62, 0.65, 0.7, 1], [0.92, 0.92, 0.9, 1]
BLUE, GREEN, ASPHALT = [0.34, 0.62, 0.85, 1], [0.1, 0.72, 0.5, 1], [0.27, 0.28, 0.3, 1]


def film_of(
    answer: Answer,
    out: Path,
    sample: int = 0,
    quiet: bool = True,
    size: tuple[int, int] = (960, 480),
) -> Path:
    """Simulate one safe sample of an answer and write the film: .gif, or a folder of .png
    files.

    On the floor: the goal (green) and, for every reference point, the boxes around its predicted
    positions that hold its whole run (blue). Raises InputError when there is no such sample or
    nothing can be rendered here.
    """
    from parc_jax.app.plot.shapes import predicted

    film.require_film(out, answer, sample)
    plan = answer.samples[sample]
    path, _, error = predicted(answer.model, plan[None])
    poses = run(plan)
    model = stage(answer.problem, path[0], error[0])
    several = " of every reference point" if answer.model.n_points > 1 else ""
    legend = [("car", RED), ("parked", GREY), ("goal", GREEN), (f"tube{several}", BLUE)]
    seconds, camera = np.arange(len(poses)) / RATE, view(answer.problem, poses, size)
    caption = f"{answer.model.system}: true run, sample {sample}"
    return film.film_of_poses(
        out, model, poses, camera, size, RATE, seconds, caption, legend, quiet
    )


def run(plan: np.ndarray) -> np.ndarray:
    """Poses (n, 5) of the car at RATE until it has stopped: x, y [m], yaw [rad], steering of both
    front wheels [rad].

    plan: (p0, k). The closed-form body: it moves as the MuJoCo body does, to rounding, and compiles
    faster. The front wheels are drawn into the slip, as the braking law steers them.
    """
    with x64():
        import jax.numpy as jnp

        states = system("ode").run(jnp.asarray(plan[2:], jnp.float64)).states
    x, y, yaw, speed, slip = (
        np.asarray(s) for s in (states.x, states.y, states.yaw, states.speed, states.sideslip)
    )
    moving = np.flatnonzero(np.hypot(np.diff(x), np.diff(y)) > 0.05 * c.STEP)
    every = np.arange(
        0, min(len(x), moving[-1] + round(REST / c.STEP)), 1 / (RATE * c.STEP)
    ).astype(int)
    steer = np.where(speed > 0.5, np.clip(slip, -c.STEER_MAX, c.STEER_MAX), 0.0)
    return np.stack([plan[0] + x, plan[1] + y, yaw, steer, steer], axis=-1)[every]


def stage(problem: Problem, path: np.ndarray, error: np.ndarray):
    """The compiled scene: the plant's body dressed as a car, parked cars, goal, tube. path (T + 1,
    n_c), error (T, n_c).
    """
    from sims.drift_parking.plant_mjx import MODEL

    mujoco = film.headless_mujoco()
    spec = mujoco.MjSpec.from_string(MODEL)
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.4] * 3, [0.2] * 3
    spec.worldbody.add_light(
        pos=[0, 0, 40],
        dir=[0.3, 0.4, -1],
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.6] * 3,
        castshadow=False,  # where boxes of the tube lie in one plane, shadows flicker
    )
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[200, 200, 1], rgba=ASPHALT)
    for number, obstacle in enumerate(problem.obstacles):
        around = bounding_box(obstacle)
        middle, span = (around.lo + around.hi) / 2, around.hi - around.lo
        film.add_car(spec.worldbody, f"parked_{number}", *span, GREY, at=middle)
        _mark(spec, f"space_{number}", around.lo - ROOM, around.hi + ROOM)
    goal = shadow(problem.goal)
    film.paint(spec, "goal", goal.min(axis=0), goal.max(axis=0), GREEN, z=0.008)
    film.paint_tube(spec, path, error, BLUE)
    _dress(spec)
    return spec.compile()


def view(problem: Problem, poses: np.ndarray, size: tuple[int, int]) -> film.View:
    """A camera at rest that sees the whole way and the parked cars."""
    boxes = [bounding_box(o) for o in problem.obstacles]
    points = np.array([*poses[:, :2], *(corner for b in boxes for corner in (b.lo, b.hi))])
    lo, hi = points.min(axis=0), points.max(axis=0)
    wide = max(
        hi[0] - lo[0] + c.BODY_LENGTH, (hi[1] - lo[1] + c.BODY_LENGTH) * 0.75 * size[0] / size[1]
    )
    aim = lo + (0.5, 0.52) * (hi - lo)  # what is near the camera looks larger and needs more room
    return film.View((*aim, 0.0), NEARNESS * wide, 90.0, -50.0)


def _mark(spec, name: str, lo: np.ndarray, hi: np.ndarray) -> None:
    """White lines around a parking space."""
    for side, (a, b) in enumerate(
        (((0, 0), (1, 0)), ((0, 1), (1, 1)), ((0, 0), (0, 1)), ((1, 0), (1, 1)))
    ):
        start, end = lo + np.array(a) * (hi - lo), lo + np.array(b) * (hi - lo)
        film.paint(spec, f"{name}_{side}", start - LINE / 2, end + LINE / 2, WHITE, z=0.004)


def _dress(spec) -> None:
    """The plant's own box becomes a car with wheels; the front ones turn."""
    mujoco = film.headless_mujoco()
    car = spec.body("car")
    car.first_geom().rgba = [0, 0, 0, 0]
    film.add_car(car, "car", c.BODY_LENGTH, c.BODY_WIDTH, RED, wheels=False)
    for x in (c.FRONT_ARM, -c.REAR_ARM):
        for y in (-0.42 * c.BODY_WIDTH, 0.42 * c.BODY_WIDTH):
            wheel = car.add_body(pos=[x, y, 0.33])
            if x > 0:
                wheel.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
            wheel.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=[0.33, 0.12, 0],
                quat=[np.sqrt(0.5), np.sqrt(0.5), 0, 0],
                rgba=[0.06, 0.06, 0.06, 1],
                contype=0,
                conaffinity=0,
                mass=1.0,
            )
