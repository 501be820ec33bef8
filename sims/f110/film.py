"""A rendered film of the car drifting into the space, without a screen: `python -m sims.f110.film --out film.mp4`.

Needs a software OpenGL, in Debian libosmesa6 (MUJOCO_GL=osmesa) or libegl1 with libgl1-mesa-dri (MUJOCO_GL=egl), and
imageio with imageio-ffmpeg for .mp4 files; .gif files need imageio alone, a folder of .png files only matplotlib.
"""

import os
from pathlib import Path

import jax
import numpy as np

from parc_jax.errors import InputError
from sims.f110 import params as c
from sims.f110.car import XML
from sims.f110.scenario import SPACE, problem
from sims.f110.system import system

os.environ.setdefault("MUJOCO_GL", "egl")  # read once, when mujoco is first imported; without it a screen is needed

EVERY = 4  # ticks per frame: 30 frames a second
VIEW = {"lookat": (3.9, -0.9, 0.0), "distance": 4.6, "azimuth": 90.0, "elevation": -33.0}


def film(
    out: Path, k: tuple[float, float] = (-1.45, 2.6), start: tuple[float, float] | None = None, seed: int = 0,
    size: tuple[int, int] = (1280, 720),
) -> Path:  # fmt: skip
    """Drive once and write the film. Raises InputError when it cannot be rendered or written here.

    Args:
        out: A .mp4 or .gif file, or a folder for .png files.
        k: Line [m] and speed [m/s].
        start: [m]; by default the one from which the car without disturbance stops in the middle of the space.
        seed: Of the run's disturbances.
        size: Width and height [pixels].
    """
    car, k = system(), np.array([k], np.float64)
    if start is None:
        start = np.array(SPACE) - system(law="none").run(np.zeros((1, 2), np.uint32), k).pose[0, -1, :2]
    qpos = car.run(jax.random.PRNGKey(seed)[None], k, origin=start, keep_qpos=True).qpos[0]
    images = frames(qpos[::EVERY], size)
    out.parent.mkdir(parents=True, exist_ok=True)
    if not out.suffix:
        from matplotlib.image import imsave

        out.mkdir(exist_ok=True)
        for number, image in enumerate(images):
            imsave(out / f"{number:04d}.png", image)
        return out
    try:
        import imageio.v2 as imageio
    except ImportError:
        raise InputError(
            f"film: {out.suffix} needs imageio and imageio-ffmpeg; give a folder for .png files."
        ) from None
    rate = 1 / (EVERY * c.TICK)
    imageio.mimwrite(out, images, **({"fps": rate} if out.suffix == ".mp4" else {"duration": 1000 / rate}))
    return out


def frames(qpos: np.ndarray, size: tuple[int, int] = (1280, 720)) -> list[np.ndarray]:
    """Images (height, width, 3) uint8 of states (n, 17). Raises InputError without OpenGL."""
    import mujoco

    model = stage()
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    camera.lookat[:], camera.distance = VIEW["lookat"], VIEW["distance"]
    camera.azimuth, camera.elevation = VIEW["azimuth"], VIEW["elevation"]
    try:
        renderer = mujoco.Renderer(model, size[1], size[0])
    except Exception as error:  # each OpenGL backend has errors of its own
        raise InputError(
            f"film: no OpenGL here ({error}). Install libosmesa6 and set MUJOCO_GL=osmesa before Python starts."
        ) from None
    images = []
    with renderer:
        for state in qpos:
            data.qpos[:] = state
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            images.append(renderer.render().copy())
    return images


def stage():
    """The car's model with the parked cars and the space painted on the floor."""
    import mujoco

    spec = mujoco.MjSpec.from_file(str(XML))
    scene = problem()
    for number, car in enumerate(scene.obstacles):
        lo, hi = -car.b[car.n :][: car.n], car.b[: car.n]
        middle, half = (lo + hi) / 2, (hi - lo) / 2
        for name, z, height, shrink, rgba in (
            ("body", 0.075, 0.035, (1.0, 0.8), [0.55, 0.1, 0.12, 1]),
            ("cabin", 0.13, 0.025, (0.4, 0.55), [0.15, 0.15, 0.18, 1]),
        ):
            spec.worldbody.add_geom(
                name=f"parked_{number}_{name}", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[*middle, z],
                size=[half[0] * shrink[0], half[1] * shrink[1], height], rgba=rgba, contype=0, conaffinity=0,
            )  # fmt: skip
    spec.worldbody.add_geom(
        name="space", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[*SPACE, 0.001], size=[0.28, 0.305, 0.001],
        rgba=[0.0, 0.62, 0.45, 0.5], contype=0, conaffinity=0,
    )  # fmt: skip
    return spec.compile()


if __name__ == "__main__":
    import tyro

    tyro.cli(film)
