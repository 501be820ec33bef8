"""Faults of one plan's verdict: the separating inequality, the goal, obstacles left out."""

from benchmarks.attacks.fault import Fault

INEQUALITY = (
    Fault(
        "separated_at_one_of_both_knots",
        "inequality.separates",
        "reduce(and_",
        "reduce(lambda x, y: x | y",
        (
            "tests/separation/test_inequality.py"
            "::test_separates_where_the_excess_is_positive_and_never_by_nan"
        ),
    ),
    Fault(
        "the_farthest_point_for_the_nearest",
        "inequality.excess",
        "jnp.minimum if traced else np.minimum",
        "jnp.maximum if traced else np.maximum",
        "tests/separation/test_inequality.py::test_excess_is_what_exact_numbers_say",
    ),
    Fault(
        "what_is_undefined_is_lost_in_a_minimum",
        "arrays.least",
        "xp.where(xp.isnan(x), -np.inf, x)",
        "x",
        (
            "tests/soundness/test_undefined.py"
            "::test_a_path_or_errors_that_are_undefined_keep_no_distance"
        ),
    ),
    Fault(
        "intervals_without_their_ends",
        "inequality.at_both_knots",
        "slice(1, None)",
        "slice(None, -1)",
        "tests/separation/test_inequality.py::test_excess_is_what_exact_numbers_say",
    ),
    Fault(
        "one_end_of_the_segment",
        "segment.separation",
        "= excess((height(w, pa), height(w, pb))",
        "= excess((height(w, pa),)",
        (
            "tests/separation/test_segment.py"
            "::test_gap_is_the_distance_when_disjoint_and_not_positive_when_in_contact"
        ),
    ),
    Fault(
        "disc_dropped",
        "segment.separation",
        "gap - radius",
        "gap",
        "tests/soundness/test_known_plans.py::test_a_disc_that_touches_a_corner_is_refused",
    ),
    Fault(
        "body_not_mirrored",
        "signed_vertices",
        "body = [(-Fraction(x), -Fraction(y))",
        "body = [(Fraction(x), Fraction(y))",
        "tests/separation/test_grown.py::test_support_of_the_sum_for_every_error_box",
    ),
    Fault(
        "span_ends_one_early",
        "exists",
        "return (at >= first) & (at <= last)",
        "return (at >= first) & (at < last)",
        "tests/soundness/test_known_plans.py::test_an_obstacle_is_there_only_during_its_steps",
    ),
    Fault(
        "errors_of_the_first_point_for_all",
        "Pair.gaps",
        "at(errors, np.s_[:, self.points",
        "at(errors, np.s_[:, 0 * self.points",
        "tests/soundness/test_bodies.py::test_clearances_are_the_distances_of_hulls",
    ),
    Fault(
        "errors_reach_the_other_way",
        "distance._support",
        "excess((at_a, at_b), errors.support(-w[None]))",
        "excess((at_a, at_b), errors.support(w[None]))",
        (
            "tests/separation/test_distance.py"
            "::test_with_templates_of_errors_the_gap_is_the_distance"
        ),
    ),
    Fault(
        "errors_centred_about_zero",
        "_by_basis",
        "mu * centre + _product",
        "_product",
        "tests/claim/test_error_set.py::test_support_and_vertex_are_those_of_the_linear_program",
    ),
    Fault(
        "no_claim_is_no_error",
        "error_set._product",
        "(size == 0) & xp",
        "xp",
        (
            "tests/claim/test_error_set.py"
            "::test_without_claim_errors_reach_infinitely_far_along_every_direction"
        ),
    ),
    Fault(
        "lower_faces_of_the_other_side",
        "Faces.rows",
        "[-x for x in a], half - middle",
        "[-x for x in a], half + middle",
        "tests/claim/test_faces.py::test_rows_are_exact_and_short",
    ),
)
VERDICTS = (
    Fault(
        "only_the_first_knot_of_an_interval",
        "Pair.gaps",
        "[:-1].T, path[1:].T",
        "[:-1].T, path[:-1].T",
        "tests/soundness/test_known_plans.py::test_a_thin_obstacle_between_knots_is_seen",
    ),
    Fault(
        "tube_shrinks_obstacles",
        "Pair.gaps",
        "+ self.signs[..., None]",
        "- self.signs[..., None]",
        (
            "tests/soundness/test_known_plans.py"
            "::test_a_gap_of_exactly_body_and_tubes_is_refused_and_one_step_more_is_accepted"
        ),
    ),
    Fault(
        "tube_of_the_next_interval",
        "pointwise.verdict",
        "clearance(scene, seen.path, tube.during(seen.bin))",
        "clearance(scene, seen.path, jnp.roll(tube.during(seen.bin), -1, axis=0))",
        "tests/verdict/test_pointwise.py::test_every_interval_has_its_own_widths",
    ),
    Fault(
        "slack_dropped",
        "pointwise._least",
        "scene.slack",
        "0",
        "tests/verdict/test_pointwise.py::test_the_clearance_pays_the_slack",
    ),
    Fault(
        "slack_for_the_goal_given_back",
        "row_margin",
        "product(A, x) - slack",
        "product(A, x) + slack",
        "tests/verdict/test_pointwise.py::test_row_margins_pay_the_slack_by_the_size_of_the_row",
    ),
    Fault(
        "touching_is_safe",
        "safe",
        "clearance >",
        "clearance >=",
        "tests/verdict/test_pointwise.py::test_a_clearance_of_nothing_is_not_safe",
    ),
    Fault(
        "first_obstacle_only",
        "clearance",
        "scene.count,",
        "jnp.minimum(scene.count, 1),",
        (
            "tests/soundness/test_random_scenes.py"
            "::test_accepted_plans_are_free_and_clearly_free_plans_are_accepted"
        ),
    ),
    Fault(
        "wrong_bin_on_an_inner_edge",
        "open_bin_of",
        " & ~on_inner_edge",
        "",
        (
            "tests/claim/test_bins.py"
            "::test_a_kernel_knows_the_bin_inside_and_none_on_a_border_between_bins"
        ),
    ),
    Fault(
        "goal_not_shrunken",
        "arrival",
        "goal_b - lost",
        "goal_b",
        "tests/soundness/test_known_plans.py::test_the_goal_is_closed_and_shrinks_by_the_tube",
    ),
    Fault(
        "goal_shrunken_without_absolute_values",
        "ErrorBox.support",
        "return _total(_product(abs(w), half))",
        "return _total(_product(w, half))",
        "tests/verdict/test_pointwise.py::test_margins_of_goal_and_start_are_those_of_the_rows",
    ),
    Fault(
        "start_set_ignored",
        "Verdicts",
        ('""\n        return (self.goal >= 0) & (self.start >= 0) & (self.bin >= 0)'),
        ('""\n        return (self.goal >= 0) & (self.bin >= 0)'),
        "tests/soundness/test_known_plans.py::test_the_start_set_is_closed",
    ),
    Fault(
        "float_slack_of_nothing",
        "float_slack",
        "4 * bound.error.max() + 2 * longest",
        "0 * bound.error.max() + 0",
        "tests/verdict/test_scene.py::test_slack_grows_with_everything_that_rounds",
    ),
    Fault(
        "open_intervals_taken_for_separated",
        "facet_test.look",
        "~(gap > 0)",
        "gap < -0.5",
        "tests/verdict/test_screen.py::test_contact_where_it_does_not_look_worst_is_seen",
    ),
    Fault(
        "facets_promise_what_errors_off_an_axis_take",
        "Reach.along",
        "jnp.abs(w[axis])",
        "w[axis]",
        "tests/verdict/test_facets.py::test_gaps_are_those_of_the_inequality",
    ),
)
PRUNED = (
    Fault(
        "apart_without_the_tube",
        "pruning._gap",
        "size @ error.T",
        "0.0",
        (
            "tests/verdict/test_near.py"
            "::test_an_obstacle_is_left_out_where_no_plan_comes_and_no_sooner"
        ),
    ),
    Fault(
        "clearance_forgets_what_is_beyond",
        "_far",
        "scene.beyond",
        "jnp.inf",
        (
            "tests/verdict/test_near.py"
            "::test_a_clearance_tells_no_more_than_what_was_left_out_allows"
        ),
    ),
)
FAULTS: tuple[Fault, ...] = (*INEQUALITY, *VERDICTS, *PRUNED)
