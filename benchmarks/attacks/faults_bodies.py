"""Faults about bodies of several points and errors between faces: whose place, whose error, which
part, which end.
"""

from benchmarks.attacks.fault import Fault

HULLS = "tests/soundness/test_bodies.py::test_clearances_are_the_distances_of_hulls"
IN_ORDER = "tests/separation/test_pairs.py::test_pairs_go_obstacle_by_obstacle"
EXACT = "tests/separation/test_distance.py::test_on_a_grid_the_gap_is_the_exact_distance"
CONTACT = (
    "tests/separation/test_distance.py::test_contact_is_claimed_only_where_it_is_and_mostly_found"
)
PROGRAM = "tests/claim/test_error_set.py::test_support_and_vertex_are_those_of_the_linear_program"
BY_HAND = "tests/cover/test_polytope.py::test_the_rows_are_the_conditions_written_by_hand"
WRITTEN = "tests/certificate/test_write_points.py"
SCENES = "tests/verdict/test_scene.py"

DISTANCES = (
    Fault(
        "part_of_its_first_point",
        "obstacles_of",
        "np.resize(own, n_i)",
        "own[0]",
        (IN_ORDER,),
    ),
    Fault(
        "body_at_the_first_knot_of_an_interval",
        "Pair.gaps",
        "[:-1], near[1:]",
        "[:-1], near[:-1]",
        (HULLS,),
    ),
    Fault(
        "errors_of_the_first_point_for_all",
        "Pair._own",
        "at(errors, np.s_[:, self.points",
        "at(errors, np.s_[:, 0 * self.points",
        (HULLS,),
    ),
    Fault(
        "radius_of_a_part_dropped",
        "obstacles_of",
        "radius[o] = shape.radius if isinstance(shape, Disc) else 0",
        "radius[o] = 0",
        (IN_ORDER,),
    ),
    Fault(
        "polygon_of_a_part_not_mirrored",
        "pairs._grown",
        "- y for x,",
        "+ y for x,",
        ("tests/separation/test_pairs.py::test_a_polygon_is_added_to_the_obstacle_inside_out",),
    ),
    Fault(
        "span_of_a_pair_ends_one_early",
        "obstacles_of",
        "pairs.active[o] = exists(problem, j, layout.n_steps)",
        "pairs.active[o] = np.roll(exists(problem, j, layout.n_steps), -1)",
        (IN_ORDER,),
    ),
    Fault(
        "other_points_stay_at_their_offsets",
        "moved_to",
        "* n_points",
        "+ [0 * p0] * (n_points - 1)",
        (f"{WRITTEN}::test_safe_plans_are_accepted_and_their_parts_are_not_exchanged",),
    ),
    Fault(
        "errors_reach_the_other_way",
        "distance._support",
        "excess((at_a, at_b), errors.support(-w[None]))",
        "excess((at_a, at_b), errors.support(w[None]))",
        (
            "tests/separation/test_distance.py"
            "::test_with_templates_of_errors_the_gap_is_the_distance",
        ),
    ),
    Fault(
        "nearest_vertex_for_the_farthest",
        "distance._support",
        "beyond.argmax",
        "beyond.argmin",
        (EXACT,),
    ),
    Fault(
        "distance_without_the_radius",
        "distance.separation",
        "gap - radius",
        "gap",
        (
            "tests/separation/test_pairs.py"
            "::test_in_space_the_gap_is_that_of_what_is_seen_from_the_side",
        ),
    ),
    Fault(
        "contact_within_twice_the_radius",
        "touching.step",
        "dot(nearest, nearest) <= radius",
        "dot(nearest, nearest) <= 4 * radius",
        (CONTACT,),
    ),
    Fault(
        "contact_where_some_side_holds_the_origin",
        "_holds_origin",
        "(volumes > rounding).all() | (volumes < -rounding).",
        "(volumes > rounding).any() | (volumes < -rounding).",
        (CONTACT,),
    ),
)

ERRORS = (
    Fault(
        "errors_centred_about_zero",
        "_by_basis",
        "mu * centre + _product",
        "_product",
        (PROGRAM,),
    ),
    Fault(
        "worst_basis_for_the_best",
        "ErrorTemplate.support",
        "return _by_basis(dual, centre, half, w)[1].min(axis=-1)",
        "return _by_basis(dual, centre, half, w)[1].max(axis=-1)",
        (PROGRAM,),
    ),
    Fault(
        "no_claim_is_no_error",
        "error_set._product",
        "(size == 0) & xp",
        "xp",
        (
            "tests/claim/test_error_set.py"
            "::test_without_claim_errors_reach_infinitely_far_along_every_direction",
        ),
    ),
    Fault(
        "bases_left_out_bound_the_set",
        "template",
        "[..., bases], np.inf",
        "[..., bases], 0.0",
        (
            "tests/claim/test_error_set.py"
            "::test_directions_that_depend_on_each_other_are_left_out_and_never_nan",
        ),
    ),
    Fault(
        "lower_faces_of_the_other_side",
        "Faces.rows",
        "[-x for x in a], half - middle",
        "[-x for x in a], half + middle",
        ("tests/claim/test_faces.py::test_rows_are_exact_and_short",),
    ),
)

COVERED = (
    Fault(
        "facets_promise_what_errors_off_an_axis_take",
        "Reach.along",
        "jnp.abs(w[axis])",
        "w[axis]",
        ("tests/verdict/test_facets.py::test_gaps_are_those_of_the_inequality",),
    ),
    Fault(
        "errors_reach_as_in_the_next_bin",
        "Reach.of",
        "[bin]",
        "[bin - 1]",
        ("tests/verdict/test_facets.py::test_gaps_are_those_of_the_inequality",),
    ),
    Fault(
        "plans_keep_to_corridors_by_their_first_points",
        "keeping.keeps",
        "points[o] == point",
        "points[o][:1] == point",
        (BY_HAND,),
    ),
    Fault(
        "quick_test_of_bodies_forgets_the_tube",
        "at_knot",
        "least + mine.support_by_axis(back)",
        "least",
        ("tests/cover/test_nearly.py::test_who_nearly_keeps_is_found_as_by_hand",),
    ),
    Fault(
        "plans_err_along_the_directions_of_corridors",
        "thresholds._of_one",
        "tuple(-x for x in w[o])",
        "tuple(x for x in w[o])",
        (
            "tests/cover/test_thresholds.py"
            "::test_they_are_those_of_the_corridor_and_plans_keep_to_it_as_by_hand",
        ),
    ),
    Fault(
        "corridor_is_looked_up_in_another_bin",
        "Looked.of",
        "self.row[corridor, bin]",
        "self.row[corridor, 0]",
        (
            "tests/cover/test_thresholds.py"
            "::test_they_are_those_of_the_corridor_and_plans_keep_to_it_as_by_hand",
        ),
    ),
    Fault(
        "what_was_never_asked_holds_nobody_back",
        "thresholds._nothing_exceeds",
        "np.inf, like.dtype",
        "-np.inf, like.dtype",
        (
            "tests/cover/test_thresholds.py"
            "::test_they_are_those_of_the_corridor_and_plans_keep_to_it_as_by_hand",
        ),
    ),
    Fault(
        "corridor_loses_to_the_other_side",
        "corridor.lost",
        "-w.swapaxes",
        "w.swapaxes",
        (BY_HAND,),
    ),
    Fault(
        "corridor_loses_to_the_first_point_only",
        "corridor.lost",
        "of_points = at(errors, np.s_[:, points])",
        "of_points = at(errors, np.s_[:, 0 * points])",
        (BY_HAND,),
    ),
    Fault(
        "polytope_of_the_first_point_of_all_parts",
        "SafePolytope.halfspaces",
        "C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, points]",
        "C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, 0 * points]",
        (BY_HAND,),
    ),
    Fault(
        "goal_of_one_point_moves_with_p0",
        "anchored_rows",
        ".sum(axis=1)",
        "[:, 0]",
        (BY_HAND,),
    ),
    Fault(
        "goal_of_a_body_may_be_unbounded",
        "goal_box",
        "layout.n_p :",
        ":",
        ("tests/verdict/test_scene.py::test_a_goal_may_leave_free_all_but_the_first_point_and_q",),
    ),
    Fault(
        "goal_of_points_in_another_order",
        "require_points",
        "problem.points != tuple",
        "len(problem.points) != len",
        (f"{SCENES}::test_a_goal_over_named_points_is_refused_by_a_model_with_another_order",),
    ),
    Fault(
        "open_goal_told_by_a_free_axis",
        "goal_box",
        'goal", needed',
        'goal"',
        (f"{SCENES}::test_an_open_goal_is_told_by_an_axis_that_needs_a_bound",),
    ),
)

BODIES = (*DISTANCES, *ERRORS, *COVERED)
