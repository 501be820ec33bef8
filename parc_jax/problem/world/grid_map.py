"""Occupancy grids, also those of ROS's map_server: cells that are not surely free are obstacles."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from jaxtyping import Float

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, reading
from parc_jax.problem.world.free_space import FreeSpace
from parc_jax.problem.world.outlines import FARTHEST, package, place_of, require_turn

LARGEST_COST = 254  # of costmap_2d: lethal; 253 inscribed, 255 no information
INSCRIBED = 99  # what costmap_2d publishes for 253
FREE_THRESH = 0.196  # what map_server's documentation gives as an example
UNKNOWN = 205  # grey of map_saver
CALL = "occupancy_grid"


@dataclass(frozen=True, eq=False)
class GridMap:
    """The free cells of a map. From `load_map` or `occupancy_grid`.

    free: (rows, columns) bool, row 0 at the origin, as in nav_msgs/OccupancyGrid. resolution: [m]
    side of a cell. origin: (x, y, yaw) [m, rad] of the outer corner of cell (0, 0); rows are
    stacked along y turned by yaw. occupied: the probability below which they are free, if known.
    """

    free: np.ndarray
    resolution: float
    origin: tuple[float, float, float]
    occupied: float | None = None

    def free_space(
        self, place: npt.ArrayLike | None = None, reach: float | None = None
    ) -> FreeSpace:
        """The free cells, as nothing is known beyond the map; or those that meet the square of half
        width reach [m] around a place (x, y), along the map's axes. Raises InputError.
        """
        shapely = package("shapely", "free_space")
        x, y, yaw = self.origin
        c, s = np.cos(yaw), np.sin(yaw)
        spans = [slice(0, count) for count in self.free.shape]
        if place is not None or reach is not None:
            if place is None or reach is None or not as_float64("map reach", reach, ()) > 0:
                raise InputError(
                    f"map: expected a place (x, y) with a reach > 0 m, or neither; got "
                    f"{place!r:.40} and {reach!r:.40}."
                )
            off = place_of(place) - (x, y)
            column, row = np.array([c * off[0] + s * off[1], c * off[1] - s * off[0]])
            for axis, (middle, n) in enumerate(zip((row, column), self.free.shape, strict=True)):
                ends = np.array([middle - reach, middle + reach]) / self.resolution
                first, last = np.clip([np.floor(ends[0]), np.ceil(ends[1])], 0, n).astype(int)
                if not 0 <= middle <= n * self.resolution:
                    raise InputError(
                        f"map: expected a place on the map; ({off[0] + x:g}, {off[1] + y:g}) is "
                        f"outside of its {self.free.shape} cells."
                    )
                spans[axis] = slice(first, last)
        found = _rectangles(self.free[*spans]) + np.repeat([one.start for one in spans], 2)
        boxes = shapely.box(found[:, 2], found[:, 0], found[:, 3], found[:, 1])
        region = shapely.union_all(boxes) or shapely.Polygon()  # of whole numbers: exact
        turn = self.resolution * np.array([[c, s], [-s, c]])
        window = shapely.box(spans[1].start, spans[0].start, spans[1].stop, spans[0].stop)
        region, window = (
            shapely.transform(one, lambda cell: cell @ turn + (x, y)) for one in (region, window)
        )
        # what stands on the map is no hole that the assumption of a scan may fill, nor a bay
        bounds = {} if self.occupied is None else {"occupied": (self.occupied,)}
        return FreeSpace(region, standing=window.difference(region), bounds=bounds)

    def __repr__(self) -> str:
        rows, columns = self.free.shape
        free = f"{self.free.sum():,} of them free"
        return f"<GridMap: {rows} x {columns} cells of {self.resolution:g} m, {free}>"


def grid_map(
    name: str, free: npt.ArrayLike, resolution: float, origin: npt.ArrayLike, occupied: float
) -> GridMap:
    """A validated map. Raises InputError, which begins with `name`."""
    resolution = float(as_float64(f"{name} resolution", resolution, ()))
    x, y, yaw = (float(v) for v in as_float64(f"{name} origin (x, y, yaw)", origin, (3,)))
    require_turn(f"{name} origin's yaw", yaw)
    free = np.array(free, bool)
    if free.ndim != 2 or not free.size or resolution <= 0:
        raise InputError(
            f"{name}: expected rows of cells with a resolution > 0 m; got shape {free.shape} and "
            f"{resolution:g}."
        )
    if max(abs(x), abs(y)) + resolution * (sum(free.shape) + 2) > FARTHEST:
        raise InputError(
            f"{name}: expected a map within {FARTHEST:g} m of the origin; got origin ({x:g}, {y:g})"
            f" and {free.shape} cells of {resolution:g} m."
        )
    free.setflags(write=False)
    return GridMap(free, resolution, (x, y, yaw), occupied)


def occupancy_grid(
    data: npt.ArrayLike,
    resolution: float,
    origin: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    inflated: bool | None = None,
) -> GridMap:
    """The map of a nav_msgs/OccupancyGrid. Raises InputError.

    data: (height, width) whole numbers: -1, or 255 unsigned, unknown; 0 ... 100 percent occupied.
    The message has them flat: np.array(data).reshape(height, width). resolution, origin: as of
    `GridMap`. Free are cells occupied with less than FREE_THRESH; unknown is never free.
    inflated: a costmap is refused, as its inflation hides unknown cells, and robots come out
    larger than they are. It is recognised by raw costs (101 ... 254) and by the value 99, which
    costmap_2d publishes next to obstacles; with False you say that 99 is a probability.
    """
    cells = np.asarray(data)
    masked = np.ma.is_masked(data)
    if cells.ndim != 2 or cells.dtype.kind not in "iu" or masked:
        raise InputError(
            f"{CALL}: expected whole numbers (height, width); got {cells.dtype} of shape "
            f"{cells.shape}{', some of them masked' * masked}. Try np.array(data, "
            "np.int8).reshape(height, width), with -1 in place of what is masked."
        )
    cells = np.where(cells == 255, -1, cells.astype(np.int64))
    if ((cells < -1) | (cells > LARGEST_COST)).any():
        strange = cells[(cells < -1) | (cells > LARGEST_COST)][0]
        raise InputError(f"{CALL}: expected values -1 ... 100; got {strange}.")
    costs = (cells > 100).any()
    if costs or (inflated is None and (cells == INSCRIBED).any()) or inflated:
        value = cells.max() if costs else INSCRIBED
        raise InputError(
            f"{CALL}: expected a map; the value {value} is one of an inflated costmap. Take the "
            "static map that it was made of (topic /map)."
        )
    _require_percent(CALL, cells.max(initial=0))
    free = (cells >= 0) & (cells / 100 < FREE_THRESH)
    return grid_map(CALL, free, resolution, origin, FREE_THRESH)


def _require_percent(name: str, largest: float) -> None:
    """Raises InputError for a mask of 0 and 1, whose walls would be occupied with 1 %."""
    if 0 < largest <= 1:
        raise InputError(
            f"{name}: expected percent, or shades up to white; the largest number is 1. Multiply "
            "a mask of 0 and 1 by 100, its picture by 255."
        )


def _rectangles(cells: np.ndarray) -> np.ndarray:
    """(n, 4) rows and columns, first and last + 1, of rectangles that are just the true cells."""
    steps = np.diff(np.pad(cells.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, first = np.nonzero(steps == 1)
    last = np.nonzero(steps == -1)[1]
    order = np.lexsort((row, last, first))
    row, first, last = row[order], first[order], last[order]
    new = (np.diff(row) != 1) | (np.diff(first) != 0) | (np.diff(last) != 0)
    begin = np.flatnonzero(np.concatenate([[True], new])) if len(row) else np.zeros(0, int)
    end = np.concatenate([begin[1:], [len(row)]]) - 1 if len(row) else begin
    return np.stack([row[begin], row[end] + 1, first[begin], last[begin]], axis=1)


MODES = ("trinary", "scale", "raw")
NEEDED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
# pixels of a file that Pillow gives to the shade, and those of which a colour may be transparent
CLEAR = "L", "RGB", "P", "P;1", "P;2", "P;4"
EXACT = *CLEAR, "1", "1;I", "L;2", "L;4", "I;16B", "LA", "RGBA"


def load_map(path: str | Path) -> GridMap:
    """The map of a map_server YAML file, and the PGM or PNG that it names: 8 bits, or 16 of grey.

    Free are cells occupied with a probability p < free_thresh; the rest, occupied or unknown, is
    not. p = 1 - shade, or the shade itself with `negate`; in the mode trinary 205 is unknown
    whatever the threshold; in the mode raw the value of a pixel is
    p in percent, and above 100 it is unknown. Transparent pixels are unknown. In the mode trinary
    map_server averages the alpha channel with the colours: free is then a pixel that is free
    with and without it. The origin's yaw turns the map. Raises InputError.
    """
    path, yaml = Path(path), package("yaml", "load_map")
    with reading(path, "a YAML file of map_server", yaml.YAMLError):
        text = path.read_text(encoding="utf-8")
        said = yaml.safe_load(text)
        if isinstance(said, dict) and len(said) != len(yaml.compose(text).value):
            raise ValueError("an entry that is there twice, or merged")  # others read the first
    missing = [key for key in NEEDED if not isinstance(said, dict) or key not in said]
    if missing:
        raise InputError(f"{path}: expected an entry {missing[0]!r}; there is none.")
    mode = str(said.get("mode", "trinary")).lower()
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
    unknown = colours * 255 > 100 if mode == "raw" else np.round(colours * 255) == UNKNOWN
    _require_percent(str(path), 255 * colours.max(initial=0.0, where=~unknown))
    occupied = _occupied(colours, alpha, mode, bool(said["negate"]))
    return grid_map(str(path), (occupied < free)[::-1], said["resolution"], said["origin"], free)


def _pixels(path: Path, image: Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Colours (rows, columns, channels), alpha (rows, columns), in 0 ... 1. Raises InputError."""
    pillow = package("PIL.Image", "load_map")
    wrong = SyntaxError, pillow.DecompressionBombError
    what = "an image whose shades are known: save it as an 8-bit grey PNG or PGM"
    opening = reading(f"{path}, image {image}", what, *wrong)
    with opening, pillow.open(image, formats=("PNG", "PPM")) as opened:
        stored, clear = opened.tile[0][3], "transparency" in opened.info
        raw, most = stored[:2] if isinstance(stored, tuple) else (stored, 0)
        if raw not in (CLEAR if clear else EXACT) or most not in (0, 255):  # others are rounded
            raise ValueError(f"pixels {stored!r}{' with a transparent colour' * clear}")
        palette = clear or raw[0] in "P1"
        whole = np.asarray(opened.convert("RGBA") if palette else opened, np.float64)
    whole = whole.reshape(*whole.shape[:2], -1) / (65535 if raw == "I;16B" else 255)
    return (whole[..., :-1], whole[..., -1]) if palette or raw[-1] == "A" else (whole, None)


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
    if mode == "trinary":  # map_saver's unknown, beside which it writes a free_thresh of 0.25
        occupied = np.where(np.round(shade * 255) == UNKNOWN, np.inf, occupied)
    if alpha is None:
        return occupied
    if mode == "trinary":
        channels = colours.shape[-1]
        mixed = (channels * shade + alpha) / (channels + 1)
        occupied = np.maximum(occupied, mixed if negate else 1 - mixed)
    return np.where(alpha < 1, np.inf, occupied)
