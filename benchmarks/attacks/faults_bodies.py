"""Faults about bodies of several points and errors between faces: whose place, whose error, which
part, which end.
"""

from benchmarks.attacks.fault import Fault

PAIRS = "parc_jax/obstacles/pairs.py"
DISTANCE = "parc_jax/obstacles/distance.py"
ERROR_SET = "parc_jax/claim/error_set.py"
FACES = "parc_jax/claim/faces.py"
POLYTOPE = "parc_jax/cover/polytope.py"
QUESTION = "parc_jax/checker/question.py"
NO_PLAN = "parc_jax/checker/no_plan.py"
HITS = "parc_jax/checker/hits.py"
BIN_ERRORS = "parc_jax/volume_bounds/bin_errors.py"
CONTACT_ERRORS = "parc_jax/volume_bounds/contact_errors.py"
IN_BINS = "tests/volume_bounds/test_bin_errors.py::"
TRIED = "tests/volume_bounds/test_contact_errors.py::"
HULLS = "tests/soundness/test_bodies.py::test_clearances_are_the_distances_of_hulls"
OF_ALL = "tests/obstacles/test_pairs.py::test_the_gap_of_one_interval_is_that_of_all"
IN_ORDER = "tests/obstacles/test_pairs.py::test_pairs_go_obstacle_by_obstacle"
EXACT = "tests/obstacles/test_distance.py::test_on_a_grid_the_gap_is_the_exact_distance"
CONTACT = (
    "tests/obstacles/test_distance.py::test_contact_is_claimed_only_where_it_is_and_mostly_found"
)
PROGRAM = "tests/claim/test_error_set.py::test_support_and_vertex_are_those_of_the_linear_program"
BY_HAND = "tests/cover/test_polytope.py::test_the_rows_are_the_conditions_written_by_hand"
WRITTEN = "tests/certificate/test_write_points.py"
SCENES = "tests/verdict/test_scene.py"
BAD = "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected"

DISTANCES = (
    Fault(
        "part_of_its_first_point",
        PAIRS,
        "pairs.points[o] = np.resize(own, n_i)",
        "pairs.points[o] = own[0]",
        (IN_ORDER,),
    ),
    Fault(
        "body_at_the_first_knot_of_an_interval",
        PAIRS,
        "times(near[:-1], near[1:], allowed",
        "times(near[:-1], near[:-1], allowed",
        (HULLS,),
    ),
    Fault(
        "errors_of_the_first_point_for_all",
        PAIRS,
        "near = places[:, points]\n            allowed = at(errors, np.s_[:, points])",
        "near = places[:, points]\n            allowed = at(errors, np.s_[:, 0 * points])",
        (OF_ALL,),
    ),
    Fault(
        "radius_of_a_part_dropped",
        PAIRS,
        "pairs.radius[o] = shape.radius if isinstance(shape, Disc) else 0.0",
        "pairs.radius[o] = 0.0",
        (IN_ORDER,),
    ),
    Fault(
        "polygon_of_a_part_not_mirrored",
        PAIRS,
        "tuple(x - y for x, y in zip(corner.point",
        "tuple(x + y for x, y in zip(corner.point",
        ("tests/obstacles/test_pairs.py::test_a_polygon_is_added_to_the_obstacle_inside_out",),
    ),
    Fault(
        "span_of_a_pair_ends_one_early",
        PAIRS,
        "pairs.active[o] = exists(problem, j, n_steps)",
        "pairs.active[o] = np.roll(exists(problem, j, n_steps), -1)",
        (IN_ORDER,),
    ),
    Fault(
        "other_points_stay_at_their_offsets",
        "parc_jax/network/predict.py",
        "xp.concatenate([p0] * n_points, axis=-1)",
        "xp.concatenate([p0] + [0 * p0] * (n_points - 1), axis=-1)",
        (f"{WRITTEN}::test_safe_plans_are_accepted_and_their_parts_are_not_exchanged",),
    ),
    Fault(
        "errors_reach_the_other_way",
        DISTANCE,
        "jnp.minimum(along_a, along_b) - errors.support(-w[None])",
        "jnp.minimum(along_a, along_b) - errors.support(w[None])",
        (
            "tests/obstacles/test_distance.py"
            "::test_with_templates_of_errors_the_gap_is_the_distance",
        ),
    ),
    Fault(
        "nearest_vertex_for_the_farthest",
        DISTANCE,
        "last = heights.argmax()",
        "last = heights.argmin()",
        (EXACT,),
    ),
    Fault(
        "distance_without_the_radius",
        DISTANCE,
        "return gap - radius, w",
        "return gap, w",
        (
            "tests/obstacles/test_pairs.py"
            "::test_in_space_the_gap_is_that_of_what_is_seen_from_the_side",
        ),
    ),
    Fault(
        "contact_within_twice_the_radius",
        DISTANCE,
        "close = dot(nearest, nearest) <= radius * radius",
        "close = dot(nearest, nearest) <= 4 * radius * radius",
        (CONTACT,),
    ),
    Fault(
        "contact_where_some_side_holds_the_origin",
        DISTANCE,
        "return (volumes > rounding).all() | (volumes < -rounding).all()",
        "return (volumes > rounding).any() | (volumes < -rounding).all()",
        (CONTACT,),
    ),
)

ERRORS = (
    Fault(
        "errors_centred_about_zero",
        ERROR_SET,
        "return mu, _total(mu * centre + _product(abs(mu), half))",
        "return mu, _total(_product(abs(mu), half))",
        (PROGRAM,),
    ),
    Fault(
        "worst_basis_for_the_best",
        ERROR_SET,
        "return _by_basis(dual, centre, half, w)[1].min(axis=-1)",
        "return _by_basis(dual, centre, half, w)[1].max(axis=-1)",
        (PROGRAM,),
    ),
    Fault(
        "no_claim_is_no_error",
        ERROR_SET,
        "return size * xp.where((size == 0) & xp.isinf(half), 0, half)",
        "return size * xp.where(xp.isinf(half), 0, half)",
        (
            "tests/claim/test_error_set.py"
            "::test_without_claim_errors_reach_infinitely_far_along_every_direction",
        ),
    ),
    Fault(
        "bases_left_out_bound_the_set",
        ERROR_SET,
        "half, np.float64)[..., bases], np.inf)",
        "half, np.float64)[..., bases], 0.0)",
        (
            "tests/claim/test_error_set.py"
            "::test_directions_that_depend_on_each_other_are_left_out_and_never_nan",
        ),
    ),
    Fault(
        "lower_faces_of_the_other_side",
        FACES,
        "([-x for x in a], half - middle)",
        "([-x for x in a], half + middle)",
        ("tests/claim/test_faces.py::test_rows_are_exact_and_short",),
    ),
)

COVERED = (
    Fault(
        "plans_keep_to_corridors_by_their_first_points",
        "parc_jax/cover/corridors.py",
        "(0,) if alone else points:",
        "(0,) if alone else points[:1]:",
        (BY_HAND,),
    ),
    Fault(
        "quick_test_of_bodies_forgets_the_tube",
        "parc_jax/cover/nearly.py",
        "met &= along > least + mine.support_by_axis(back)",
        "met &= along > least",
        ("tests/cover/test_nearly.py::test_who_nearly_keeps_is_found_as_by_hand",),
    ),
    Fault(
        "plans_err_along_the_directions_of_corridors",
        "parc_jax/cover/corridors.py",
        "back = tuple(-x for x in w)",
        "back = tuple(x for x in w)",
        (BY_HAND,),
    ),
    Fault(
        "corridor_loses_to_the_other_side",
        "parc_jax/cover/corridor.py",
        "of_points.support(-w.swapaxes(0, 1)",
        "of_points.support(w.swapaxes(0, 1)",
        (BY_HAND,),
    ),
    Fault(
        "corridor_loses_to_the_first_point_only",
        "parc_jax/cover/corridor.py",
        "of_points = at(errors, np.s_[:, points])",
        "of_points = at(errors, np.s_[:, 0 * points])",
        (BY_HAND,),
    ),
    Fault(
        "polytope_of_the_first_point_of_all_parts",
        POLYTOPE,
        "C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, points]",
        "C = C.reshape(len(C), model.n_points, model.n_p, -1)[:, 0 * points]",
        (BY_HAND,),
    ),
    Fault(
        "goal_of_one_point_moves_with_p0",
        POLYTOPE,
        "goal_c.reshape(len(goal_c), -1, n_p).sum(axis=1)",
        "goal_c.reshape(len(goal_c), -1, n_p)[:, 0]",
        (BY_HAND,),
    ),
    Fault(
        "goal_of_a_body_may_be_unbounded",
        "parc_jax/verdict/scene.py",
        "needed[layout.n_p : layout.n_c] = False",
        "needed[: layout.n_c] = False",
        ("tests/verdict/test_scene.py::test_a_goal_may_leave_free_all_but_the_first_point_and_q",),
    ),
    Fault(
        "goal_of_points_in_another_order",
        "parc_jax/problem.py",
        "problem.points != tuple(points)",
        "len(problem.points) != len(points)",
        (f"{SCENES}::test_a_goal_over_named_points_is_refused_by_a_model_with_another_order",),
    ),
    Fault(
        "open_goal_told_by_a_free_axis",
        "parc_jax/verdict/scene.py",
        'finite_box(goal, "goal", needed)',
        'finite_box(goal, "goal")',
        (f"{SCENES}::test_an_open_goal_is_told_by_an_axis_that_needs_a_bound",),
    ),
)

PROVED = (
    Fault(
        "template_spelled_without_its_lower_faces",
        "parc_jax/certificate/templates.py",
        "int(share < 0), fraction_text(abs(share))",
        "0, fraction_text(abs(share))",
        (f"{WRITTEN}::test_spelled_templates_reach_as_far_as_those_of_the_engine",),
    ),
    Fault(
        "parts_exchanged_in_certificates",
        "parc_jax/certificate/write.py",
        "return [pairs[first : first + n] for first in range(0, len(pairs), n)]",
        "return [pairs[first : first + n][::-1] for first in range(0, len(pairs), n)]",
        (f"{WRITTEN}::test_safe_plans_are_accepted_and_their_parts_are_not_exchanged",),
    ),
    Fault(
        "checker_errors_of_the_first_point",
        "parc_jax/checker/plans.py",
        "errors = [by_point[i] for by_point in interval[t:stop]]",
        "errors = [by_point[0] for by_point in interval[t:stop]]",
        (BAD,),
    ),
    Fault(
        "checker_other_points_stay_at_their_offsets",
        QUESTION,
        "return [sum(row[axis : self.n_c : self.n_p]) for axis in range(self.n_p)]",
        "return row[: self.n_p]",
        (BAD,),
    ),
    Fault(
        "checker_places_of_the_first_point",
        QUESTION,
        "number = s * self.n_points + i\n",
        "number = s * self.n_points\n",
        (BAD,),
    ),
    Fault(
        "checker_an_error_of_some_bin",
        "parc_jax/checker/errors.py",
        "return all(each.contains(x) for each in self.sets)",
        "return any(each.contains(x) for each in self.sets)",
        (
            "tests/checker/test_checker_errors.py"
            "::test_several_bins_reach_as_far_as_the_farthest_or_as_all",
        ),
    ),
    Fault(
        "no_plan_negative_shares_of_a_mixture",
        HITS,
        'need(all(v >= 0 for v in weights), "a weight of a contact is negative")',
        "",
        (BAD,),
    ),
    Fault(
        "no_plan_shares_of_less_than_one",
        HITS,
        'need(sum(weights) == 1, "the weights of a contact do not sum to one")',
        "",
        (BAD,),
    ),
    Fault(
        "no_plan_error_of_a_goal_row_outside_the_tube",
        NO_PLAN,
        'need(final.contains(error), "the error of a goal row is outside the tube")',
        "",
        (BAD,),
    ),
)

ALLOWED = (
    Fault(
        "no_plan_common_errors_of_the_widest_bin",
        BIN_ERRORS,
        "least = self._inner[bins].min(axis=0)",
        "least = self._inner[bins].max(axis=0)",
        (IN_BINS + "test_common_errors_are_errors_of_every_bin",),
    ),
    Fault(
        "no_plan_least_widths_of_the_first_bin",
        BIN_ERRORS,
        "least = self._interval[bins].min(axis=0)",
        "least = self._interval[bins][0]",
        (IN_BINS + "test_common_errors_are_errors_of_every_bin",),
    ),
    Fault(
        "no_plan_boxes_around_faces",
        BIN_ERRORS,
        "inner = templates.interval.inner_box",
        "inner = templates.interval.box",
        (IN_BINS + "test_common_errors_are_errors_of_every_bin",),
    ),
    Fault(
        "no_plan_end_without_the_last_interval",
        BIN_ERRORS,
        "for i in range(n_points):\n        for a, b in during",
        "for i in range(0):\n        for a, b in during",
        ("tests/volume_bounds/test_no_plan_of_parts.py::test_ends_keep_to_the_last_interval_too",),
    ),
    Fault(
        "no_plan_what_the_first_bin_takes",
        BIN_ERRORS,
        "return np.max([self._lost[bin] for bin in bins], axis=0)",
        "return self._lost[bins[0]]",
        (IN_BINS + "test_what_any_bin_takes_along_directions",),
    ),
    Fault(
        "no_plan_corners_not_pulled_in",
        CONTACT_ERRORS,
        "pulled = corners + INSIDE * (middle - corners)",
        "pulled = corners - INSIDE * (middle - corners)",
        (TRIED + "test_every_error_that_is_tried_is_exactly_admitted",),
    ),
    Fault(
        "no_plan_admits_what_one_point_may",
        CONTACT_ERRORS,
        "zip(a, exact, strict=True)) <= b for a, b in rows)",
        "zip(a, exact, strict=True)) <= 1000 * b for a, b in rows)",
        (TRIED + "test_every_error_that_is_tried_is_exactly_admitted",),
    ),
    Fault(
        "faces_inner_box_of_the_half_widths",
        FACES,
        "left = np.maximum(finite - np.abs(self.centre), 0)",
        "left = finite",
        ("tests/claim/test_faces.py::test_the_inner_box_lies_inside_and_touches",),
    ),
    Fault(
        "faces_that_leave_out_the_model",
        "parc_jax/claim/fitting.py",
        "least = np.minimum(least, 0.0)",
        "least = least + 0.0",
        ("tests/claim/test_fitting.py::test_no_error_at_all_is_between_the_faces",),
    ),
)

BODIES = (*DISTANCES, *ERRORS, *COVERED, *PROVED, *ALLOWED)
