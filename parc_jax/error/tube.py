"""The tube: how far the black box may be from the model, per bin of k, interval and axis."""

import numpy as np
from flax import struct

from parc_jax.arrays import as_float64, content_hash
from parc_jax.errors import InputError

NO_CLAIM = 1e100  # [m, .] wider than any world, and its square is still finite


@struct.dataclass
class Tube:
    """Interval and final errors by bin of k. Build with `tube`, which validates.

    edges:    tuple over the n_k axes of (n_bins_i + 1,) increasing edges; the outer ones bound K.
              Bins are closed boxes, numbered row-major (last axis fastest).
    interval: (n_bins, T, n_p) [m]       |p(s) - p^(s)| per axis for all recorded s in [t, t + 1].
    final:    (n_bins, n_p + n_q) [m, .] |final state - predicted|.
    A bin whose widths are infinite has no claim: nothing in it is ever safe. See `claimed`.
    """

    edges: tuple[np.ndarray, ...]
    interval: np.ndarray
    final: np.ndarray

    @property
    def n_bins(self) -> int:
        """Number of bins of K."""
        return self.interval.shape[0]

    @property
    def claimed(self) -> np.ndarray:
        """(n_bins,) bool: bins whose widths are all finite. Only these may be planned in."""
        return np.isfinite(self.interval).all(axis=(1, 2)) & np.isfinite(self.final).all(axis=1)

    @property
    def hash(self) -> str:
        """Content hash of edges and widths."""
        return content_hash(*self.edges, self.interval, self.final)

    @property
    def finite_widths(self) -> tuple[np.ndarray, np.ndarray]:
        """Interval and final, where a bin without claim is NO_CLAIM wide, for certificates and code that cannot take
        infinity. Its obstacles fill the world and its goal is empty, so still nothing in it is ever safe."""
        interval, final = (np.where(np.isinf(widths), NO_CLAIM, widths) for widths in (self.interval, self.final))
        return interval, final

    def bin_of(self, k: np.ndarray) -> np.ndarray:
        """Bin number of k (..., n_k), one of the closed bins that contain it; -1 outside K."""
        k = np.asarray(k)
        number, inside = np.zeros(k.shape[:-1], int), np.ones(k.shape[:-1], bool)
        for axis, edge in enumerate(self.edges):
            x = k[..., axis]
            inside &= (x >= edge[0]) & (x <= edge[-1])
            number = number * (len(edge) - 1) + np.clip(np.searchsorted(edge, x, side="right") - 1, 0, len(edge) - 2)
        return np.where(inside, number, -1)

    def bin_box(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Corners lo (n_k,), hi (n_k,) of a bin."""
        index = np.unravel_index(number, [len(e) - 1 for e in self.edges])
        lo = np.array([e[i] for e, i in zip(self.edges, index, strict=True)])
        hi = np.array([e[i + 1] for e, i in zip(self.edges, index, strict=True)])
        return lo, hi


def tube(edges, interval, final) -> Tube:
    """Validated tube; widths >= 0, infinite in bins without claim. Raises InputError."""
    edges = tuple(as_float64(f"tube edges[{i}]", e, (None,)) for i, e in enumerate(edges))
    for i, e in enumerate(edges):
        if len(e) < 2 or not (np.diff(e) > 0).all():
            raise InputError(f"tube edges[{i}]: expected at least two increasing numbers; got {e}.")
    n_bins = int(np.prod([len(e) - 1 for e in edges]))
    interval = _widths("tube interval errors", interval, (n_bins, None, None))
    final = _widths("tube final errors", final, (n_bins, None))
    return Tube(edges, interval, final)


def _widths(name: str, value, shape) -> np.ndarray:
    """Half widths >= 0, read-only. One infinite width makes its bin infinite: a claim or none."""
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


def refined(coarse: Tube, edges) -> Tube:
    """The same tube told bin by bin on finer edges, which must contain the coarse ones. Raises InputError."""
    edges = tuple(as_float64(f"tube edges[{i}]", e, (None,)) for i, e in enumerate(edges))
    for axis, (old, new) in enumerate(zip(coarse.edges, edges, strict=True)):
        if not np.isin(old, new).all():
            raise InputError(f"tube: expected finer edges that keep the old ones; axis {axis} loses some of {old}.")
    middles = np.meshgrid(*(0.5 * (e[1:] + e[:-1]) for e in edges), indexing="ij")
    source = coarse.bin_of(np.stack(middles, axis=-1).reshape(-1, len(edges)))
    return Tube(edges, coarse.interval[source], coarse.final[source])
