"""Faults of what is left out of a scene because no plan comes near it."""

from benchmarks.attacks.fault import Fault

APART = "parc_jax/safe_set/separation/apart.py"
REACH = "parc_jax/safe_set/separation/ways.py"
LAID_OUT = "parc_jax/safe_set/verdict/near.py"
NO_SOONER = (
    "tests/verdict/test_near.py::test_an_obstacle_is_left_out_where_no_plan_comes_and_no_sooner"
)
WITHIN = "tests/verdict/test_near.py::test_all_plans_that_reach_stay_within_their_reach"
BY_POINT = "tests/verdict/test_near.py::test_every_point_of_a_part_counts_and_each_part_by_itself"
BOUNDS = "tests/separation/test_ways.py::test_bounds_of_an_affine_map_are_attained"
LEFT_OUT = (
    "tests/verdict/test_near.py::test_a_clearance_tells_no_more_than_what_was_left_out_allows"
)
PROVED = "tests/verdict/test_near.py::test_what_is_left_out_is_proved_in_every_certificate"

NEAR = (
    Fault("apart_without_the_tube", "apart._gap", "size @ error.T", "0.0", (NO_SOONER,)),
    Fault(
        "apart_by_the_body_inside_out",
        "apart._gap",
        "b + body_support",
        "b - body_support",
        (NO_SOONER,),
    ),
    Fault(
        "apart_by_the_worst_point_only_of_the_first",
        "Extent.of",
        "(part.points)",
        "(part.points)[:1]",
        (BY_POINT,),
    ),
    Fault(
        "apart_at_the_first_knot_only",
        "extent_of",
        "np.minimum(lo[:-1], lo[1:]), np.maximum(hi[:-1], hi[1:])",
        "lo[1:], hi[1:]",
        (NO_SOONER, WITHIN),
    ),
    Fault(
        "apart_outside_of_the_span",
        "_settled",
        "counts, rows",
        "~counts, rows",
        (NO_SOONER,),
    ),
    Fault(
        "apart_where_it_touches",
        "apart.apart",
        "(room > 0)",
        "(room > -0.2)",
        (NO_SOONER,),
    ),
    Fault(
        "another_row_is_spelled",
        "_settled",
        "minimum.reduceat(place, first) - first",
        "zeros(len(first), int)",
        (PROVED,),
    ),
    Fault(
        "ways_through_the_hidden_layers_without_bounds",
        "_affine",
        "hi @ down + b, hi @ up + lo",
        "lo @ down + b, hi @ up + hi",
        (BOUNDS,),
    ),
    Fault(
        "ends_without_their_errors",
        "extent_in",
        "goal_lo - most, goal_hi - least",
        "goal_lo, goal_hi",
        (NO_SOONER,),
    ),
    Fault(
        "ends_as_if_the_start_were_the_end",
        "extent_of",
        "[0] - own_hi",
        "[0] + 1.0 - own_lo",
        (WITHIN,),
    ),
    Fault(
        "clearance_forgets_what_is_beyond",
        "_far",
        "scene.beyond",
        "jnp.inf",
        (LEFT_OUT,),
    ),
    Fault(
        "the_last_obstacle_is_taken_for_padding",
        "laid_out",
        "(numbered_pairs(problem, kept))",
        "(numbered_pairs(problem, kept)) - 1",
        ("tests/verdict/test_near.py::test_a_thousand_obstacles_are_as_many_rows_as_matter",),
    ),
)
