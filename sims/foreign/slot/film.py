"""A rendered film of the drone in the slot: crazyflow's run of one safe plan, slowed down, with the
drone as crazyflow draws it, the box around it that was proved, and the tube of its centre.
"""

import itertools
from pathlib import Path

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.common.arrays import x64
from parc_jax.common.sets.extent import bounding_box
from sims import film
from sims.foreign.slot import params as c
from sims.foreign.slot import scenario
from sims.foreign.slot.pilot import FRAME
from sims.foreign.slot.system import POINTS, system

RATE = 12  # [frames/s]
SLOW = 4.0  # [1] how much longer the film takes than the flight
REST = 0.4  # [s] of the flight left out at its end, in which it only hovers
FROM = 0.78  # [s] of the flight at which the film begins
# camera, seen from the slot: where it looks, how far off, direction and height
VIEW = ((0.02, -0.06, -0.06), 1.25, 38.0, -6.0)
BLUE, GREEN, GREY = [0.34, 0.62, 0.85, 0.10], [0.1, 0.72, 0.5, 0.22], [0.72, 0.72, 0.76, 0.35]
EDGE, BODY = [0.95, 0.55, 0.15, 1.0], [0.85, 0.1, 0.5, 1.0]
SEED = 11  # of the disturbance that is filmed


def film_of(
    answer: Answer,
    out: Path,
    sample: int = 0,
    quiet: bool = True,
    size: tuple[int, int] = (720, 405),
) -> Path:
    """Fly one safe sample of an answer and write the film: .gif, or a folder of .png files.
    Raises InputError when there is no such sample or nothing can be rendered here.
    """
    film.require_film(out, answer, sample)
    seconds, poses = run(answer.samples[sample])
    model = stage(answer, sample)
    legend = [("slot", EDGE), ("goal", GREEN), ("body", BODY), ("tube of the centre", BLUE)]
    width, wide = 100 * slot_width(answer), 100 * c.SIZE[1]
    caption = f"crazyflow: slot of {width:.1f} cm, drone of {wide:.1f} cm, {SLOW:g} times slower"
    return film.film_of_poses(
        out, model, poses, view(), size, RATE, seconds, caption, legend, quiet
    )


def slot_width(answer: Answer) -> float:
    """[m] of the slot in an answer's scene: between its two long sides."""
    above, below = (bounding_box(side) for side in answer.problem.obstacles[:2])
    return float(above.lo[2] - below.hi[2])


def run(plan: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) [s] and poses (n, 7) of the drone, as MuJoCo's free joints have them."""
    drone = system()
    with x64():
        import jax.numpy as jnp

        k = jnp.asarray(plan[3:], jnp.float64)
        times, places, turns, _ = jax.jit(drone.fly)(jax.random.PRNGKey(SEED), k, 0 * k)
    shown = np.arange(FROM, c.T_FINAL - REST, 1 / (RATE * SLOW))
    every = np.searchsorted(np.asarray(times), shown)
    from scipy.spatial.transform import Rotation

    turned = np.array(Rotation.from_matrix(np.asarray(turns)[every]).as_quat())
    return shown, np.column_stack(
        [np.asarray(places)[every] + plan[:3] @ FRAME, turned[:, [3, 0, 1, 2]]]
    )


def stage(answer: Answer, sample: int):
    """The compiled scene: drone, wall, goal, tube."""
    from parc_jax.app.plot.shapes import predicted

    mujoco = film.headless_mujoco()
    spec = drone(mujoco)
    spec.visual.headlight.ambient = [0.45] * 3
    spec.visual.headlight.diffuse = [0.35] * 3
    spec.visual.map.znear = 0.005
    spec.worldbody.add_light(
        pos=[-2, 2, 4],
        dir=[0.4, -0.4, -1],
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.5] * 3,
        castshadow=False,
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.95, 0.98],
        rgb2=[0.45, 0.52, 0.62],
        width=64,
        height=384,
    )
    half = 0.5 * slot_width(answer)
    _wall(mujoco, spec, half)
    centre = POINTS.index("centre")
    goal = np.array(scenario.GOAL)
    _box(mujoco, spec, "goal", np.zeros(3), goal, GREEN)
    path, _, error = predicted(answer.model, answer.samples[[sample]])
    places = path[0].reshape(len(path[0]), -1, 3)[:, centre]
    widths = error[0].reshape(len(error[0]), -1, 3)[:, centre]
    for t, wide in enumerate(widths):
        lo = np.minimum(places[t], places[t + 1]) - wide
        hi = np.maximum(places[t], places[t + 1]) + wide
        _box(mujoco, spec, f"tube {t}", (lo + hi) / 2, (hi - lo) / 2, BLUE)
    return spec.compile()


def view() -> film.View:
    """A camera at rest, behind the drone's left, that looks through the slot."""
    aim, far, azimuth, elevation = VIEW
    return film.View(tuple(scenario.AT @ FRAME + aim), far, azimuth, elevation)


def drone(mujoco):
    """A MuJoCo model with crazyflow's drone, free to move, in the box that is proved."""
    import crazyflow

    home = Path(crazyflow.__file__).parent / "drones"
    spec = mujoco.MjSpec.from_file(str(home / "cf21B_500.xml"))
    spec.meshdir = str(home / spec.meshdir)
    spec.delete(spec.body("drone_fused"))  # the same once more, in one mesh
    flown = spec.body("drone")
    flown.pos = [0, 0, 0]
    flown.add_freejoint()
    half, line = np.array(c.SIZE) / 2, 0.001  # [m]
    look = {"type": mujoco.mjtGeom.mjGEOM_BOX, "rgba": BODY, "mass": 0}
    for axis in range(3):  # the edges of the box
        for sides in itertools.product((-1, 1), repeat=2):
            along = np.insert(np.array(sides, float), axis, 0.0)
            size = np.where(along == 0, half + line, line)
            flown.add_geom(pos=along * half, size=size, contype=0, conaffinity=0, **look)
    return spec


def _wall(mujoco, spec, half: float) -> None:
    """The wall around a slot of half this width [m], and the edges of the slot."""
    far, long, thick = scenario.FAR, scenario.LENGTH / 2, scenario.THICK / 2
    line = 0.004  # [m]
    for name, along, across, colour in (
        ("above", (-far, far), (half, far), GREY),
        ("below", (-far, far), (-far, -half), GREY),
        ("right", (long, far), (-half, half), GREY),
        ("left", (-far, -long), (-half, half), GREY),
        ("upper edge", (-long, long), (half, half + line), EDGE),
        ("lower edge", (-long, long), (-half - line, -half), EDGE),
        ("right edge", (long, long + line), (-half, half), EDGE),
        ("left edge", (-long - line, -long), (-half, half), EDGE),
    ):
        middle = np.array([0.0, sum(along) / 2, sum(across) / 2])
        room = np.array([thick, along[1] - along[0], across[1] - across[0]]) / [1, 2, 2]
        room[0] += 0.001 * (colour is EDGE)
        _box(mujoco, spec, name, scenario.AT + middle, room, colour)


def _box(mujoco, spec, name, middle, half, rgba) -> None:
    """A box in the frame of the slot, drawn in the world."""
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=middle @ FRAME,
        size=half,
        quat=[np.cos(c.INCLINE / 2), np.sin(c.INCLINE / 2), 0.0, 0.0],
        rgba=rgba,
        contype=0,
        conaffinity=0,
    )
