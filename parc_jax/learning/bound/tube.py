"""The tube: bounds on the distance of the black box from the model, by bin of k and interval."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64, content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.shapes import Index, Indices
from parc_jax.common.spelling import counted, hex_floats, hex_text
from parc_jax.learning.bound.bins import Binned
from parc_jax.learning.bound.error_set import (
    NO_CLAIM,
    ErrorBox,
    ErrorSet,
    Faces,
    Templates,
    at,
    templates_of,
)
from parc_jax.learning.network.predict import Layout


@struct.dataclass
class Tube(Binned):
    """Interval and final errors by bin of k. Build with `tube`, which validates.

    edges:    tuple over the n_k axes of (n_bins_i + 1,) increasing edges; the outer ones bound K.
              Bins are closed boxes, numbered row-major (last axis fastest).
    interval: (n_bins, T, n_c) [m]       |p(s) - p^(s)| per axis for all recorded s in [t, t + 1],
              of every reference point: n_c = n_points n_p columns, point by point.
    final:    (n_bins, n_c + n_q) [m, .] |final state - predicted|.
    n_points: number of reference points.
    templates: faces that fit the errors better; then interval and final are boxes around them.
              None = the boxes are the tube.
    A bin with infinite widths has no claim: nothing in it is ever safe. See `claimed`.
    """

    interval: np.ndarray
    final: np.ndarray
    n_points: int = struct.field(pytree_node=False, default=1)
    templates: Templates | None = None

    @property
    def layout(self) -> Layout:
        """Layout of the outputs of a network with this tube."""
        return Layout(self.n_steps, self.n_p, self.n_points)

    @property
    def n_c(self) -> int:
        """Number of columns: the coordinates of all reference points."""
        return self.interval.shape[2]

    @property
    def n_bins(self) -> int:
        """Number of bins of K."""
        return self.interval.shape[0]

    @property
    def n_steps(self) -> int:
        """Number of intervals T."""
        return self.interval.shape[1]

    @property
    def n_p(self) -> int:
        """Workspace dimension."""
        return self.n_c // self.n_points

    @property
    def n_q(self) -> int:
        """Number of further goal states."""
        return self.final.shape[1] - self.n_c

    @property
    def claimed(self) -> np.ndarray:
        """(n_bins,) bool: bins whose widths are all finite. Only these may be planned in."""
        return np.isfinite(self.interval).all(axis=(1, 2)) & np.isfinite(self.final).all(axis=1)

    @property
    def hash(self) -> str:
        """Content hash of edges and widths."""
        points = () if self.n_points == 1 else (np.array(self.n_points),)
        faces = () if self.templates is None else self.templates.arrays.values()
        return content_hash(*self.edges, self.interval, self.final, *points, *faces)

    @property
    def halves(self) -> tuple[np.ndarray, np.ndarray]:
        """Scalable half widths, bins first: of the boxes, or between the faces."""
        if self.templates is None:
            return self.interval, self.final
        return self.templates.interval.half, self.templates.final.half

    def with_halves(self, interval: np.ndarray, final: np.ndarray) -> "Tube":
        """The tube with other `halves`. Raises InputError."""
        if self.templates is None:
            return tube(self.edges, interval, final, self.n_points)
        during, at_end = self.templates
        return fitted_tube(self.edges, during.with_half(interval), at_end.with_half(final))

    def times(self, way: float, end: float) -> "Tube":
        """All sets of errors, with zero, times a factor on the way and one at the end."""
        if self.templates is None:
            return tube(self.edges, way * self.interval, end * self.final, self.n_points)
        return fitted_tube(self.edges, *map(Faces.times, self.templates, (way, end)))

    def at_least(self, other: "Tube") -> bool:
        """Sufficient test that its sets contain the other's: none narrower, all else the same."""
        ours, theirs = ({} if t.templates is None else t.templates._asdict() for t in (self, other))
        same_faces = ours.keys() == theirs.keys() and all(
            np.array_equal(getattr(ours[part], name), getattr(theirs[part], name))
            for part in ours
            for name in ("directions", "centre")
        )
        pairs = zip(self.halves, other.halves, strict=True)
        same = same_faces and (self.n_k, self.n_points) == (other.n_k, other.n_points)
        same = same and all(map(np.array_equal, self.edges, other.edges))
        return same and all(a.shape == b.shape and bool((a >= b).all()) for a, b in pairs)

    def halves_around(
        self, interval: npt.ArrayLike, final: npt.ArrayLike
    ) -> tuple[np.ndarray, np.ndarray]:
        """`halves` that hold errors of at most interval () or (n_c,), final () or (n_c + n_q,)."""
        interval = np.broadcast_to(interval, self.n_c)
        if self.templates is None:
            return interval, np.broadcast_to(final, self.final.shape[1])
        during, at_end = self.templates
        return during.half_around(interval.reshape(self.n_points, -1)), at_end.half_around(final)

    @property
    def finite_widths(self) -> tuple[np.ndarray, np.ndarray]:
        """Interval and final, NO_CLAIM wide in place of infinity."""
        # obstacles there fill the world and the goal is empty, so still nothing is ever safe
        interval = np.where(np.isinf(self.interval), NO_CLAIM, self.interval)
        return interval, np.where(np.isinf(self.final), NO_CLAIM, self.final)

    @property
    def errors(self) -> ErrorSet:
        """Error sets of bins by interval and point: (n_bins, T, n_points) sets, n_p axes [m]."""
        if self.templates is not None:
            return self.templates.interval.errors
        return ErrorBox(self.interval.reshape(*self.interval.shape[:2], self.n_points, -1))

    @property
    def final_errors(self) -> ErrorSet:
        """Error sets of bins at the end: leading axis n_bins, n_c + n_q coordinates [m, .]."""
        return ErrorBox(self.final) if self.templates is None else self.templates.final.errors

    def during(self, bins: Indices, t: Indices | slice = slice(None)) -> ErrorSet:
        """Error sets of bins (...): leading axes (..., T, n_points), or (..., n_points) for
        intervals t (...). Also in kernels.
        """
        return at(self.errors, (bins, t))

    def at_end(self, bins: Indices) -> ErrorSet:
        """Error sets of bins (...) at the end. Also in kernels."""
        return at(self.final_errors, bins)

    def support_at_end(self, A: Float[ArrayLike, "h y"], bin_number: Index):
        """(h,) largest A e over the errors e of one bin at the end, for the rows A (h, n_c + n_q)
        of a goal. Kernel.
        """
        return at(self.final_errors, (bin_number, None)).support(A)

    @property
    def end_extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest error of the first point at the end, (n_bins, n_p) [m] each."""
        axes = np.eye(self.n_p, self.final.shape[1])
        far = at(self.final_errors, (slice(None), None))
        return -far.support(-axes), far.support(axes)

    def widest(self, bins: np.ndarray | slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Largest half widths over the bins: interval (T, n_c), final (n_c + n_q,)."""
        return self.interval[bins].max(axis=0), self.final[bins].max(axis=0)

    def widest_at(self, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Half widths at k (n, n_k): interval (n, T, n_c), final (n, n_c + n_q), the widest of all
        closed bins that contain k. Raises InputError outside K.
        """
        bins = self.bins_of(k)
        return self.interval[bins].max(axis=1), self.final[bins].max(axis=1)

    def __repr__(self) -> str:
        if not isinstance(self.interval, np.ndarray):
            return f"Tube({self.interval!r})"
        without, size = int((~self.claimed).sum()), "without claim"
        if without < self.n_bins:
            middle = np.median(self.interval[self.claimed])
            size = f"median half width {middle:.3g} m"
            size += f", {without} without claim" if without else ""
        bins = counted(self.n_bins, "bin")
        fitted = ""
        if self.templates is not None:
            n_faces = self.templates.interval.half.shape[-1]
            fitted = f", {counted(n_faces, 'pair', 'pairs')} of faces each"
        return f"Tube({bins} of K, {counted(self.n_steps, 'interval')}{fitted}, {size})"


def tube(
    edges: Sequence[np.ndarray], interval: npt.ArrayLike, final: npt.ArrayLike, n_points: int = 1
) -> Tube:
    """Validated tube; widths >= 0, infinite in bins without claim. Raises InputError."""
    edges = tuple(as_float64(f"tube edges[{i}]", e, (None,)) for i, e in enumerate(edges))
    for i, e in enumerate(edges):
        if len(e) < 2 or not (np.diff(e) > 0).all():
            raise InputError(f"tube edges[{i}]: expected at least two increasing numbers; got {e}.")
    n_bins = int(np.prod([len(e) - 1 for e in edges]))
    interval = _widths("tube interval errors", interval, (n_bins, None, None))
    final = _widths("tube final errors", final, (n_bins, None))
    n_c = interval.shape[2]
    if n_points < 1 or n_c % n_points or final.shape[1] < n_c:
        raise InputError(
            f"tube: expected interval errors of {n_points} points with equally many axes and final "
            f"errors that begin with theirs; got {n_c} and {final.shape[1]} columns."
        )
    return Tube(edges, interval, final, n_points)


def fitted_tube(edges: Sequence[np.ndarray], during: Faces, at_end: Faces) -> Tube:
    """Validated tube between faces, as in `Templates`; infinite: no claim. Raises InputError."""
    lost = np.isinf(during.half).any(axis=(1, 2, 3)) | np.isinf(at_end.half).any(axis=1)
    if lost.any():  # a claim of a bin as a whole, or none
        during = during.with_half(np.where(lost[:, None, None, None], np.inf, during.half))
        at_end = at_end.with_half(np.where(lost[:, None], np.inf, at_end.half))
    n_bins, n_steps, n_points = during.half.shape[:3]
    boxes = tube(edges, during.box.reshape(n_bins, n_steps, -1), at_end.box, n_points)
    return replace(boxes, templates=Templates(during, at_end))


def _widths(name: str, value: npt.ArrayLike, shape: tuple[int | None, ...]) -> np.ndarray:
    """Half widths >= 0, read-only. One infinite width makes all of its bin infinite."""
    value = np.asarray(value, np.float64)
    infinite = np.isposinf(value)
    checked = as_float64(name, np.where(infinite, 0.0, value), shape)
    if (checked < 0).any():
        raise InputError(f"{name}: expected half widths >= 0; got a negative one.")
    if not infinite.any():
        return checked
    out = np.array(value)
    out[infinite.reshape(len(value), -1).any(axis=1)] = np.inf
    out.setflags(write=False)
    return out


def zero_tube(
    edges: Sequence[np.ndarray], n_steps: int, n_c: int, n_end: int, n_points: int = 1
) -> Tube:
    """A tube of zero widths on these bins of K."""
    n_bins = int(np.prod([len(e) - 1 for e in edges]))
    return tube(edges, np.zeros((n_bins, n_steps, n_c)), np.zeros((n_bins, n_end)), n_points)


def tube_to_json(error_tube: Tube) -> dict:
    """Edges and widths as nested lists of hex floats ("inf" in bins without claim)."""
    points = {} if error_tube.n_points == 1 else {"points": error_tube.n_points}
    arrays = {name: hex_text(array) for name, array in tube_arrays(error_tube).items()}
    edges = [arrays.pop(f"edges{axis}") for axis in range(error_tube.n_k)]
    return points | {"edges": edges} | arrays


def tube_from_json(data: dict) -> Tube:
    """The tube of `tube_to_json`."""
    arrays = {f"edges{axis}": edge for axis, edge in enumerate(data["edges"])} | data
    names = [name for name in arrays if name not in ("edges", "points")]
    floats = {name: hex_floats(arrays[name]) for name in names}
    return tube_from_arrays(floats, len(data["edges"]), data.get("points", 1))


def tube_arrays(error_tube: Tube) -> dict[str, np.ndarray]:
    """All arrays of a tube, by name; n_points is missing."""
    edges = {f"edges{axis}": edge for axis, edge in enumerate(error_tube.edges)}
    boxes = {"interval": error_tube.interval, "final": error_tube.final}
    faces = {} if error_tube.templates is None else error_tube.templates.arrays
    return edges | boxes | faces


def tube_from_arrays(arrays: Mapping[str, np.ndarray], n_k: int, n_points: int = 1) -> Tube:
    """The tube of `tube_arrays`. Raises InputError, also where boxes and faces differ; KeyError."""
    edges = [arrays[f"edges{axis}"] for axis in range(n_k)]
    boxes = tube(edges, arrays["interval"], arrays["final"], n_points)
    if "interval_directions" not in arrays:
        return boxes
    fitted = fitted_tube(edges, *templates_of(arrays))
    if replace(fitted, templates=None).hash != boxes.hash:
        raise InputError("tube: expected the boxes around its faces; got other ones.")
    return fitted
