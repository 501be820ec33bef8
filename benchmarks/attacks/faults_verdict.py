"""Faults of the verdict on a plan: grown obstacles, goals, screens."""

from benchmarks.attacks.fault import Fault

INEQUALITY = "tests/separation/test_inequality.py"
HELD = "tests/verdict/test_facets.py::test_who_is_held_by_an_obstacle_touches_it_whatever_the_body"
OBSTACLES = (
    Fault(
        "separated_at_one_of_both_knots",
        "inequality.separates",
        "reduce(and_",
        "reduce(lambda x, y: x | y",
        (f"{INEQUALITY}::test_separates_where_the_excess_is_positive_and_never_by_nan",),
    ),
    Fault(
        "the_farthest_point_for_the_nearest",
        "inequality.excess",
        "jnp.minimum if traced else np.minimum",
        "jnp.maximum if traced else np.maximum",
        (f"{INEQUALITY}::test_excess_is_what_exact_numbers_say",),
    ),
    Fault(
        "what_is_undefined_is_lost_in_a_minimum",
        "arrays.least",
        "xp.where(xp.isnan(x), -np.inf, x)",
        "x",
        (
            "tests/soundness/test_undefined.py::test_a_path_or_errors_that_are_undefined_keep_no_distance",
        ),
    ),
    Fault(
        "intervals_without_their_ends",
        "inequality.at_both_knots",
        "slice(1, None)",
        "slice(None, -1)",
        (f"{INEQUALITY}::test_excess_is_what_exact_numbers_say",),
    ),
    Fault(
        "one_end_of_the_segment",
        "segment.separation",
        "= excess((height(w, pa), height(w, pb))",
        "= excess((height(w, pa),)",
        (
            "tests/separation/test_segment.py"
            "::test_gap_is_the_distance_when_disjoint_and_not_positive_when_in_contact",
        ),
    ),
    Fault(
        "disc_dropped",
        "segment.separation",
        "gap - radius",
        "gap",
        ("tests/soundness/test_known_plans.py::test_a_disc_that_touches_a_corner_is_refused",),
    ),
    Fault(
        "body_not_mirrored",
        "signed_vertices",
        "body = [(-Fraction(x), -Fraction(y))",
        "body = [(Fraction(x), Fraction(y))",
        ("tests/separation/test_grown.py::test_support_of_the_sum_for_every_error_box",),
    ),
    Fault(
        "span_ends_one_early",
        "exists",
        "return (at >= first) & (at <= last)",
        "return (at >= first) & (at < last)",
        ("tests/soundness/test_known_plans.py::test_an_obstacle_is_there_only_during_its_steps",),
    ),
    Fault(
        "sign_patterns_of_two_quadrants",
        "signed_corners",
        "out.append((polygon[index], (sx, sy)))",
        "out.append((polygon[index], (sx, sx)))",
        ("tests/separation/test_grown.py::test_support_of_the_sum_for_every_error_box",),
    ),
    Fault(
        "support_of_the_unmirrored_body",
        "body_support",
        "-body.vertices",
        "body.vertices",
        (
            "tests/separation/test_directions.py"
            "::test_every_multiplier_is_a_proof_and_the_support_is_exact",
        ),
    ),
    Fault(
        "sums_of_multipliers_forget_the_low_bits",
        "_rounded_sum",
        "factor * (x - large)",
        "0.0",
        ("tests/separation/test_directions.py::test_sums_are_rounded_once_whatever_is_summed",),
    ),
    Fault(
        "disc_support_of_unit_directions",
        "body_support",
        "return body.radius * np.hypot.reduce(w, axis=1)",
        "return body.radius * np.ones(len(w))",
        (
            "tests/separation/test_directions.py"
            "::test_every_multiplier_is_a_proof_and_the_support_is_exact",
        ),
    ),
)

VERDICT = (
    Fault(
        "only_the_first_knot_of_an_interval",
        "Pair.gaps",
        "[:-1], path[1:]",
        "[:-1], path[:-1]",
        ("tests/soundness/test_known_plans.py::test_a_thin_obstacle_between_knots_is_seen",),
    ),
    Fault(
        "tube_shrinks_obstacles",
        "Pair.gaps",
        "+ self.signs[None]",
        "- self.signs[None]",
        (
            "tests/soundness/test_known_plans.py"
            "::test_a_gap_of_exactly_body_and_tubes_is_refused_and_one_step_more_is_accepted",
        ),
    ),
    Fault(
        "tube_of_the_next_interval",
        "pointwise.verdict",
        "clearance(scene, seen.path, tube.during(seen.bin))",
        "clearance(scene, seen.path, jnp.roll(tube.during(seen.bin), -1, axis=0))",
        ("tests/verdict/test_pointwise.py::test_every_interval_has_its_own_widths",),
    ),
    Fault(
        "slack_dropped",
        "pointwise._nearest",
        "scene.slack",
        "0",
        ("tests/verdict/test_pointwise.py::test_the_clearance_pays_the_slack",),
    ),
    Fault(
        "slack_for_the_goal_given_back",
        "row_margin",
        "- values -",
        "- values +",
        ("tests/verdict/test_pointwise.py::test_row_margins_pay_the_slack_by_the_size_of_the_row",),
    ),
    Fault(
        "touching_is_safe",
        "safe",
        "clearance >",
        "clearance >=",
        ("tests/verdict/test_pointwise.py::test_a_clearance_of_nothing_is_not_safe",),
    ),
    Fault(
        "first_obstacle_only",
        "clearance",
        "scene.count,",
        "jnp.minimum(scene.count, 1),",
        (
            "tests/soundness/test_random_scenes.py"
            "::test_accepted_plans_are_free_and_clearly_free_plans_are_accepted",
        ),
    ),
    Fault(
        "wrong_bin_on_an_inner_edge",
        "open_bin_of",
        " & ~on_inner_edge",
        "",
        (
            "tests/claim/test_bins.py"
            "::test_a_kernel_knows_the_bin_inside_and_none_on_a_border_between_bins",
        ),
    ),
    Fault(
        "the_first_bin_of_an_edge_decides",
        "pointwise.verdicts",
        "np.minimum.reduceat(getattr(seen, name), first)",
        "getattr(seen, name)[first]",
        (
            "tests/verdict/test_pointwise.py"
            "::test_on_an_edge_the_margins_are_the_least_of_those_beside_it",
        ),
    ),
    Fault(
        "places_end_anywhere",
        "_draw_within",
        "(b >= 0) & ((z_lo[b] <= z) & (z <= z_hi[b])).all(axis=1)",
        "b > 0",
        ("tests/cover/test_rare.py::test_a_set_of_share_1e_10_is_covered_like_any_other",),
    ),
    Fault(
        "a_place_half_as_wide",
        "place_around",
        "5 * (most - least)",
        "25 * (most - least)",
        ("tests/cover/test_rare.py::test_a_place_holds_what_it_is_made_around",),
    ),
    Fault(
        "the_volume_of_a_place",
        "Place.volume",
        "2.0 ** len(self.middle) * abs",
        "abs",
        ("tests/cover/test_rare.py::test_draws_are_uniform_over_a_place",),
    ),
    Fault(
        "goal_not_shrunken",
        "arrival",
        "goal_b - lost",
        "goal_b",
        ("tests/soundness/test_known_plans.py::test_the_goal_is_closed_and_shrinks_by_the_tube",),
    ),
    Fault(
        "goal_shrunken_without_absolute_values",
        "ErrorBox.support",
        "return _total(_product(abs(w), half))",
        "return _total(_product(w, half))",
        (
            "tests/verdict/test_pointwise.py::test_margins_of_goal_and_start_are_those_of_the_rows",
            "tests/claim/test_error_set.py::test_a_box_reaches_to_its_corners",
        ),
    ),
    Fault(
        "start_set_ignored",
        "Verdicts",
        '""\n        return (self.goal >= 0) & (self.start >= 0) & (self.bin >= 0)',
        '""\n        return (self.goal >= 0) & (self.bin >= 0)',
        ("tests/soundness/test_known_plans.py::test_the_start_set_is_closed",),
    ),
    Fault(
        "float_slack_of_nothing",
        "float_slack",
        "4 * bound.error.max() + 2 * longest",
        "0 * bound.error.max() + 0",
        ("tests/verdict/test_scene.py::test_slack_grows_with_everything_that_rounds",),
    ),
    Fault(
        "float_slack_of_short_rows",
        "float_slack",
        "max(32, model.n_c + model.n_q + 3)",
        "32",
        ("tests/verdict/test_scene.py::test_the_slack_pays_for_rows_over_many_coordinates",),
    ),
    Fault(
        "beyond_one_facet_taken_for_inside",
        "Facets.holds",
        ".all(axis=1).any()",
        ".any(axis=1).any()",
        (HELD,),
    ),
    Fault(
        "inside_of_all_that_the_body_may_fill",
        "facets._core",
        " - body_support(shape, w)",
        "",
        (HELD,),
    ),
    Fault(
        "obstacles_alike_for_other_points",
        "alike.alike",
        "x.tobytes() for x in told",
        "x.tobytes() for x in told[:1]",
        ("tests/verdict/test_facets.py::test_gaps_are_those_of_the_inequality",),
    ),
    Fault(
        "rows_that_fill_up_are_kept_too",
        "arrays.map_rows",
        " & (np.diff(rows, prepend=-1) > 0)",
        "",
        ("tests/test_arrays.py::test_rows_that_are_kept_are_kept_once",),
    ),
    Fault(
        "what_looks_worst_is_never_asked",
        "screen.screen",
        "safe[unsure] = separated(unsure, *seen.worst[unsure].T)",
        "pass",
        ("tests/verdict/test_screen.py::test_same_verdicts_for_bodies_of_several_points",),
    ),
    Fault(
        "open_intervals_taken_for_separated",
        "facet_test.look",
        "~(gap > 0)",
        "gap < -0.5",
        ("tests/verdict/test_screen.py::test_contact_where_it_does_not_look_worst_is_seen",),
    ),
    Fault(
        "probes_that_fail_are_ignored",
        "require_sound_arithmetic",
        "if not f.ok",
        "if f is None",
        ("tests/test_probes.py::test_any_failed_probe_refuses_the_query",),
    ),
    Fault(
        "boxes_take_the_vertices_of_others",
        "Examiner.at_vertices",
        "(len(some))",
        "(len(some))[::-1]",
        ("tests/no_plan/test_examined.py::test_at_vertices_boxes_do_not_know_their_neighbours",),
    ),
    Fault(
        "boxes_over_the_bins_of_the_first",
        "_as_boxes",
        "node.lo[n_p:], node",
        "nodes[0].lo[n_p:], nodes[0]",
        ("tests/no_plan/test_examined.py::test_by_bounds_boxes_do_not_know_their_neighbours",),
    ),
)

VERDICTS = (*OBSTACLES, *VERDICT)
