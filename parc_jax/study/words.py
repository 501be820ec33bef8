"""Numbers for people."""

import numpy as np


def seconds(value: float | None) -> str:
    """A time for people."""
    if value is None:
        return "-"
    return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"


def spread(values: np.ndarray, names: tuple[str, ...]) -> str:
    """Half widths with their units."""
    return ", ".join(f"±{v:.2f} {n}".rstrip() for v, n in zip(values, names or ("",) * len(values), strict=False))
