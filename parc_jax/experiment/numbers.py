"""Numbers for people."""

import numpy as np

from parc_jax.labels import name_of, unit_of


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
        f"covering {100 * coverage['share']:.2f} % of the safe set (at least "
        f"{100 * coverage['at_least']:.2f} % with "
        f"confidence {coverage['confidence']:g})"
    )


def spread(values: np.ndarray, labels: tuple[str, ...], digits: str = ".2f") -> str:
    """Half widths with their units and names, in the order of the labels."""
    parts = zip(values, labels, strict=True)
    return ", ".join(
        f"±{v:{digits}} {unit_of(n)} {name_of(n)}".replace("  ", " ") for v, n in parts
    )
