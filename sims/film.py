"""Films of MuJoCo models, rendered without a screen, with a caption, a clock and a legend.

Needs a software or hardware OpenGL, in Debian libegl1 with libgl1-mesa-dri (MUJOCO_GL=egl) or
libosmesa6 (MUJOCO_GL=osmesa).
"""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from parc_jax.app.plot.film import require_kind, require_sample, write_film
from parc_jax.common.errors import InputError

SIZE = 0.032  # height of the letters, in heights of the picture
INK, PAPER = (255, 255, 255), (0, 0, 0, 110)  # PAPER is see-through


class View(NamedTuple):
    """A camera: the point it looks at (3,) [m], distance [m], azimuth and elevation [degrees]."""

    lookat: tuple[float, float, float]
    distance: float
    azimuth: float = 90.0
    elevation: float = -33.0


def headless_mujoco():
    """The module mujoco, set up to render without a screen if it is imported here for the first
    time.

    Raises InputError when the OpenGL that MUJOCO_GL names is not there.
    """
    os.environ.setdefault("MUJOCO_GL", "egl")  # read once, at the first import
    try:
        import mujoco
    except Exception as error:  # each OpenGL backend has its errors, and some come with the import
        raise _no_opengl(error) from None
    return mujoco


def require_film(out: Path, answer, sample: int) -> None:
    """Refuse a film that cannot be made, before the long part. Raises InputError for a kind of
    file, a sample that the answer lacks, or where there is no OpenGL.
    """
    require_kind(Path(out))
    require_sample(answer, sample)
    headless_mujoco()


def film_of_poses(
    out: Path,
    model,
    poses: np.ndarray,
    view: View,
    size: tuple[int, int],
    rate: float,
    seconds: np.ndarray,
    caption: str,
    legend: Sequence[tuple[str, Sequence[float]]],
    quiet: bool = True,
) -> Path:
    """Render joint coordinates (n, nq) of a model at times (n,) [s], and write the film.

    rate: frames per second. legend: names with colours, as of `explained`. Returns `out`.
    """
    images = frames(model, poses, view, size, quiet)
    return write_film(Path(out), explained(images, seconds, caption, legend), rate)


def frames(
    model, states: np.ndarray, view: View, size: tuple[int, int], quiet: bool = True
) -> list[np.ndarray]:
    """Images (height, width, 3) uint8 of joint coordinates (n, nq). size: width, height [pixels].
    quiet: no progress bar.

    Raises InputError where there is no OpenGL.
    """
    mujoco = headless_mujoco()
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    camera.lookat[:], camera.distance = view.lookat, view.distance
    camera.azimuth, camera.elevation = view.azimuth, view.elevation
    model.vis.global_.offwidth = max(size[0], model.vis.global_.offwidth)
    model.vis.global_.offheight = max(size[1], model.vis.global_.offheight)
    try:
        renderer = mujoco.Renderer(model, size[1], size[0])
    except Exception as error:  # or with the first context
        raise _no_opengl(error) from None
    images = []
    with renderer:
        for state in tqdm(states, desc="film", unit="frame", disable=quiet):
            data.qpos[:] = state
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            images.append(renderer.render().copy())
    return images


def _no_opengl(error: Exception) -> InputError:
    return InputError(
        f"film: no OpenGL here ({' '.join(str(error).split())}). Install libegl1 and "
        "libgl1-mesa-dri, or libosmesa6, "
        "and set MUJOCO_GL to egl or osmesa before Python starts."
    )


def explained(
    images: Iterable[np.ndarray],
    seconds: Iterable[float],
    caption: str,
    legend: Sequence[tuple[str, Sequence[float]]],
) -> list[np.ndarray]:
    """The images (height, width, 3) uint8 of a film with words on them: above the caption and the
    time of each [s], below the legend.

    legend: names with their colours (red, green, blue, ...) from 0 to 1.
    """
    return [
        _explained(image, f"{t:.2f} s", caption, legend)
        for image, t in zip(images, seconds, strict=True)
    ]


def _explained(image: np.ndarray, clock: str, caption: str, legend) -> np.ndarray:
    from matplotlib.font_manager import findfont
    from PIL import Image, ImageDraw, ImageFont

    height, width = image.shape[:2]
    size = SIZE * height
    font = ImageFont.truetype(findfont("DejaVu Sans"), size)
    picture = Image.fromarray(image)
    pen = ImageDraw.Draw(picture, "RGBA")
    bar = 1.8 * size
    pen.rectangle((0, 0, width, bar), fill=PAPER)
    pen.rectangle((0, height - bar, width, height), fill=PAPER)
    pen.text((size, bar / 2), caption, fill=INK, font=font, anchor="lm")
    pen.text((width - size, bar / 2), clock, fill=INK, font=font, anchor="rm")
    x, y = size, height - bar / 2
    for words, colour in legend:
        patch = tuple(round(255 * part) for part in colour[:3])
        pen.rectangle((x, y - 0.4 * size, x + size, y + 0.4 * size), fill=patch)
        pen.text((x + 1.5 * size, y), words, fill=INK, font=font, anchor="lm")
        x += 3.5 * size + pen.textlength(words, font)
    return np.asarray(picture)


def add_car(
    body, name: str, length: float, width: float, rgba, at=(0.0, 0.0), wheels: bool = True
) -> None:
    """Draw a car on a body of an MjSpec: hull, cabin, headlights, wheels standing on z = 0. Nothing
    touches it.

    length, width [m] over everything. at: of its middle in the body's frame [m]. rgba: of the hull.
    """
    mujoco = headless_mujoco()
    for part, x, z, half, colour in (
        ("body", 0.0, 0.13, (0.5, 0.5, 0.061), rgba),
        ("cabin", -0.04, 0.228, (0.21, 0.4, 0.044), [0.13, 0.14, 0.17, 1]),
    ):
        body.add_geom(
            name=f"{name}_{part}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[at[0] + x * length, at[1], z * length],
            size=[half[0] * length, half[1] * width, half[2] * length],
            rgba=colour,
            contype=0,
            conaffinity=0,
        )
    for y in (-0.33, 0.33):
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[at[0] + 0.495 * length, at[1] + y * width, 0.145 * length],
            size=[0.012 * length, 0.09 * width, 0.02 * length],
            rgba=[1, 1, 0.8, 1],
            contype=0,
            conaffinity=0,
        )
    if wheels:
        for x in (-0.3, 0.3):
            for y in (-0.44, 0.44):
                body.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                    pos=[at[0] + x * length, at[1] + y * width, 0.078 * length],
                    size=[0.078 * length, 0.055 * width, 0],
                    quat=[np.sqrt(0.5), np.sqrt(0.5), 0, 0],
                    rgba=[0.06, 0.06, 0.06, 1],
                    contype=0,
                    conaffinity=0,
                )


def paint_tube(spec, path: np.ndarray, error: np.ndarray, rgba, z: float = 0.003) -> None:
    """The tube of every reference point on the floor: a box around what each may take in every
    interval. path (T + 1, 2 n_points), error (T, 2 n_points) [m].
    """
    places = path.reshape(len(path), -1, 2)
    widths = error.reshape(len(error), -1, 2)
    lo = np.minimum(places[:-1], places[1:]) - widths
    hi = np.maximum(places[:-1], places[1:]) + widths
    for t, point in np.ndindex(widths.shape[:2]):
        paint(spec, f"tube_{t}_{point}", lo[t, point], hi[t, point], rgba, z)


def paint(spec, name: str, lo, hi, rgba, z: float = 0.002) -> None:
    """A rectangle from lo (2,) to hi (2,) [m] on the floor."""
    mujoco = headless_mujoco()
    lo, hi = np.asarray(lo), np.asarray(hi)
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[*(lo + hi) / 2, z],
        size=[*(hi - lo) / 2, z],
        rgba=rgba,
        contype=0,
        conaffinity=0,
    )
