"""Films as files: .mp4, .gif, or a folder of .png files; complete or not at all."""

import io
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.runs.files import write_atomic

KINDS = (".mp4", ".gif", "")
COLOURS = 128  # of a .gif, where nobody says how many it needs
LOOKED_AT = 6  # frames that choose them


def require_kind(out: Path) -> None:
    """Raise InputError, before anything is drawn, for a file that `write_film` could not write."""
    if out.suffix not in KINDS:
        raise InputError(
            f"film: expected a .mp4 or .gif file, or a folder for .png files; got {out}."
        )
    if out.suffix == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError:
            raise InputError(
                f"film: {out} needs imageio and imageio-ffmpeg: pip install 'parc_jax[film]'. A "
                ".gif file, or a folder for .png files, needs neither."
            ) from None


def require_sample(answer, sample: int) -> None:
    """Raise InputError for a sample that the answer does not have."""
    n = len(answer.samples)
    if not n:
        raise InputError("film: expected an answer with safe samples; this one has none to film.")
    if not 0 <= sample < n:
        raise InputError(
            f"film: expected the number of one of {n} safe samples, 0 to {n - 1}; got {sample}."
        )


def counted(frames: Iterable, n: int, quiet: bool) -> Iterable:
    """The same n frames, with a progress bar unless `quiet`."""
    from tqdm import tqdm

    return tqdm(frames, desc="film", unit="frame", total=n, disable=quiet)


def write_film(
    out: Path, images: Sequence[np.ndarray], rate: float, colours: int = COLOURS
) -> Path:
    """Write images (height, width, 3) uint8 as a film of `rate` frames per second, by the ending of
    `out`. colours: of a .gif, 256 at most; the fewer, the smaller. Raises InputError.
    """
    out = Path(out)
    require_kind(out)
    if out.suffix == ".mp4":
        return write_atomic(out, _mp4(images, rate))
    if out.suffix == ".gif":
        return write_atomic(out, _gif(images, rate, colours))
    from matplotlib.image import imsave

    out.mkdir(parents=True, exist_ok=True)
    for number, image in enumerate(images):
        imsave(out / f"{number:04d}.png", image)
    return out


def _mp4(images: Sequence[np.ndarray], rate: float) -> bytes:
    import imageio.v2 as imageio

    with tempfile.TemporaryDirectory() as folder:  # the encoder wants a file of its own
        whole = Path(folder) / "film.mp4"
        imageio.mimwrite(whole, images, fps=rate, macro_block_size=2)
        return whole.read_bytes()


def _gif(images: Sequence[np.ndarray], rate: float, colours: int) -> bytes:
    """One palette for all frames and no dithering: what stands still costs nothing."""
    from PIL import Image

    some = np.concatenate(images[:: max(1, len(images) // LOOKED_AT)])
    palette = Image.fromarray(some).quantize(colours)
    first, *others = (
        Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE)
        for image in images
    )
    buffer = io.BytesIO()
    first.save(
        buffer,
        format="gif",
        save_all=True,
        append_images=others,
        duration=1000 / rate,
        loop=0,
        optimize=False,
    )
    return buffer.getvalue()
