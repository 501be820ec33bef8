"""Cases that no constant was set by: those of TPCAP mirrored and turned, parked; a table, no files.
`python -m sims.parking.turned`
"""

from dataclasses import dataclass

import jax
import numpy as np

from sims.parking.cases import Case, case, case_of, numbers
from sims.parking.drive import drive
from sims.parking.kinematics import compose
from sims.parking.prove import loop_of


@dataclass(frozen=True)
class Options:
    """Which cases, turned by how much."""

    case: tuple[int, ...] = numbers()
    degrees: float = 13.0
    """By which they are turned, after they are mirrored."""
    mirrored: bool = True
    """At the x axis."""
    seed: int = 0


def turned(known: Case, degrees: float, mirrored: bool = True) -> Case:
    """A case mirrored at the x axis, and turned. Raises InputError."""
    side = np.array([1.0, -1.0, -1.0] if mirrored else [1.0, 1.0, 1.0])
    frame = np.array([0.0, 0.0, np.radians(degrees)])
    outlines = (np.column_stack([one, np.zeros(len(one))]) for one in known.outlines)
    return case_of(
        f"{known.name}, turned",
        compose(frame, side * known.start),
        compose(frame, side * known.goal),
        [compose(frame, side * one)[:, :2] for one in outlines],
    )


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    print("| case | parked | proved | touched | left | driven [s] | nearest [cm] | rolled | why |")
    print("|---|---|---|---|---|---|---|---|---|")
    for number in options.case:
        known = turned(case(number), options.degrees, options.mirrored)
        one = drive(known, loop_of(), jax.random.PRNGKey(options.seed + number))
        said = ["yes" if x else "no" for x in (one.reached, one.proved, one.touched, one.left)]
        nearest = f"{np.floor(100 * one.clearance):.0f}"
        cells = [number, *said, f"{one.seconds:.1f}", nearest, one.rolled, one.why]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
