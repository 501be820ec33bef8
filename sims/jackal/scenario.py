"""One manoeuvre's task: come to rest behind a gap, from whatever speeds are measured."""

from parc_jax.common.sets.box import box
from parc_jax.problem.problem import Problem, reach_avoid
from parc_jax.problem.uncertainty import FREE, Uncertainty
from sims.jackal import params as c
from sims.rectangle import goal_of_centre, rectangle, require_body

GAP = 0.9  # [m] between two posts; the robot is 0.416 m wide
POSTS = (-0.5, -0.35)  # [m] along x
FAR = 1.5  # [m] how far they reach to the sides
START = ((-1.4, -0.2), (-0.8, 0.2))  # [m] of the centre
# where the centre must come to rest [m], and the heading [rad]
GOAL = ((-0.3, -0.3, -1.5), (0.5, 0.3, 1.5))


def problem(body: str = "rectangle") -> Problem:
    """A wall with a gap, the start before it, the goal behind. body: "rectangle" or "outside", as
    of `system`. Raises InputError.
    """
    require_body(body, tuple(c.SIZES))
    near, far = POSTS
    walls = [
        box([near, GAP / 2], [far, FAR]),
        box([near, -FAR], [far, -GAP / 2]),
    ]
    measured = Uncertainty(given={"speed at the start": FREE, "turning at the start": FREE})
    return reach_avoid(goal_of_centre(*GOAL), walls, rectangle(), box(*START), uncertainty=measured)
