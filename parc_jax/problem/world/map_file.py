"""The maps of ROS's map_server: a YAML file and the image it names."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from parc_jax.common.errors import InputError
from parc_jax.problem.world.grid_map import GridMap, grid_map
from parc_jax.problem.world.outlines import package

MODES = ("trinary", "scale", "raw")
NEEDED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")


def load_map(path: str | Path) -> GridMap:
    """The map of a map_server YAML file, and the image (PGM, PNG, ...) that it names.

    Free is what is occupied with a probability p < free_thresh; the rest, occupied or unknown, is
    not. p = 1 - shade, or the shade itself with `negate`; in the mode raw the value of a pixel is
    p in percent, and above 100 it is unknown. What is transparent is unknown. In the mode trinary
    map_server averages the alpha channel with the colours: free is then what is free with and
    without it. The origin's yaw turns the map. Raises InputError.
    """
    path = Path(path)
    said = _said(path)
    mode = said.get("mode", "trinary")
    free, taken = said["free_thresh"], said["occupied_thresh"]
    if not all(isinstance(v, int | float) for v in (free, taken)) or not 0 <= free <= taken <= 1:
        raise InputError(
            f"{path}: expected 0 <= free_thresh <= occupied_thresh <= 1; got {free!r:.20} and "
            f"{taken!r:.20}."
        )
    if mode not in MODES or said["negate"] not in (0, 1) or (mode == "raw" and said["negate"]):
        raise InputError(
            f"{path}: expected mode {', '.join(MODES)} and negate 0 or 1, raw with negate 0; got "
            f"{mode!r:.20} and {said['negate']!r:.20}."
        )
    colours, alpha = _pixels(path, path.parent / str(said["image"]))
    occupied = _occupied(colours, alpha, mode, bool(said["negate"]))
    return grid_map(str(path), (occupied < free)[::-1], said["resolution"], said["origin"])


def _said(path: Path) -> dict:
    """The entries of the YAML file. Raises InputError."""
    yaml = package("yaml", "load_map")
    try:
        said = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(
            f"{path}: expected a YAML file of map_server; got {type(error).__name__}."
        ) from None
    missing = [key for key in NEEDED if not isinstance(said, dict) or key not in said]
    if missing:
        raise InputError(f"{path}: expected an entry {missing[0]!r}; there is none.")
    return said


def _pixels(path: Path, image: Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Colours (rows, columns, channels) and alpha (rows, columns), in 0 ... 1. Raises
    InputError.
    """
    pillow = package("PIL.Image", "load_map")
    try:
        with pillow.open(image) as opened:
            palette = opened.mode in ("P", "PA", "1")
            array = np.asarray(opened.convert("RGBA") if palette else opened)
            mode = "RGBA" if palette else opened.mode
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(
            f"{path}: expected the image {image}; reading it gave {type(error).__name__} "
            f"({error!s:.60})."
        ) from None
    if mode not in ("L", "LA", "RGB", "RGBA", "I", "I;16", "I;16B"):
        raise InputError(f"{path}: expected an image of grey or colour; {image} has mode {mode}.")
    whole = array.astype(np.float64) / (65535 if mode.startswith("I") else 255)
    whole = whole.reshape(*whole.shape[:2], -1)
    return (whole[..., :-1], whole[..., -1]) if mode in ("LA", "RGBA") else (whole, None)


def _occupied(
    colours: Float[np.ndarray, "rows columns c"],
    alpha: Float[np.ndarray, "rows columns"],
    mode: str,
    negate: bool,
) -> np.ndarray:
    """Probability that a pixel is occupied; infinite where it is unknown."""
    shade = colours.mean(axis=-1)
    if mode == "raw":
        value = np.round(shade * 255)
        occupied = np.where(value <= 100, value / 100, np.inf)
    else:
        occupied = shade if negate else 1 - shade
    if alpha is None:
        return occupied
    if mode == "trinary":
        channels = colours.shape[-1]
        mixed = (channels * shade + alpha) / (channels + 1)
        occupied = np.maximum(occupied, mixed if negate else 1 - mixed)
    return np.where(alpha < 1, np.inf, occupied)
