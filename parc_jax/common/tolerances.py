"""Every slack of the engine, with unit and safe direction: goals shrink, obstacles grow."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """Named slacks. Enlarging any of them never turns an unsafe verdict into a safe one.

    lp_feasible: [row units] a point may miss a row by this and still be called feasible-to-look-at
        (never: safe).
    leaf_margin: [m or row units] a box of plans must clear its condition by this before it is
        written down as unsafe; otherwise it stays undecided.
    contact_depth: [m] how deep a contact must lie in the obstacle; less than leaf_margin.
    profile_floor: [m or rad] smallest half width of a tube's profile; tubes only grow by it.
    resumed, resumed_single: [1 + |value|] stored runs that are simulated again, in float64 or
        float32, may differ by this; a larger difference refuses them.
    near_k, near_p: [range of the parameter], [largest |p| of the run, or largest of this q]
        recorded runs that agree this closely in k, and in p and q, are copies, and refused.
    outline: [m] obstacles of outlines and maps grow by this, and measured free space shrinks by it:
        more than floats round places of up to 1e5 m by.
    """

    lp_feasible: float = 1e-9
    leaf_margin: float = 1e-6
    contact_depth: float = 2e-7
    profile_floor: float = 1e-3
    resumed: float = 1e-6
    resumed_single: float = 1e-3
    near_k: float = 1e-6
    near_p: float = 1e-5
    outline: float = 1e-9


TOLERANCES = Tolerances()
