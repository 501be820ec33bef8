"""Arrays that grow at the end: appending costs its own length, not the length of what is there."""

import numpy as np


class Growable:
    """A growing array along axis 0. `view` is the filled part (no copy; invalid after the next append)."""

    __slots__ = ("data", "n")

    def __init__(self, array: np.ndarray):
        self.data = np.array(array)
        self.n = len(self.data)

    @property
    def view(self) -> np.ndarray:
        """The filled rows."""
        return self.data[: self.n]

    def append(self, rows: np.ndarray) -> None:
        """Add rows at the end; capacity at least doubles when it is exhausted."""
        end = self.n + len(rows)
        if end > len(self.data):
            data = np.empty((max(end, 2 * len(self.data)), *self.data.shape[1:]), self.data.dtype)
            data[: self.n] = self.view
            self.data = data
        self.data[self.n : end] = rows
        self.n = end


def row_positions(start: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the concatenated rows [start_i, start_i + size_i) and the ends of the rows in the result.

    start, size: (r,) int. Returns positions (sum size,) and ends (r,).
    """
    ends = np.cumsum(size)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(start - (ends - size), size), ends
