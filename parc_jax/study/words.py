"""Numbers for people."""

import numpy as np


def seconds(value: float | None) -> str:
    """A time for people."""
    if value is None:
        return "-"
    return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"


def covering(coverage: dict) -> str:
    """What is known of how much of the safe set something covers: the fields of a `Coverage`."""
    if coverage["share"] == 0:
        return "how much of the safe set they cover was not measured in time"
    return (
        f"covering {100 * coverage['share']:.2f} % of the safe set (at least {100 * coverage['at_least']:.2f} % with "
        f"confidence {coverage['confidence']:g})"
    )


def spread(values: np.ndarray, names: tuple[str, ...]) -> str:
    """Half widths with their units."""
    return ", ".join(f"±{v:.2f} {n}".rstrip() for v, n in zip(values, names or ("",) * len(values), strict=False))
