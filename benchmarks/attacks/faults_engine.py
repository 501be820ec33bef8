"""Faults of the engine: prediction, verdicts, grown obstacles, regions, corridors, polytopes,
linear programs, volume bounds, the batch, what an answer says.
"""

from benchmarks.attacks.fault import Fault

NETWORK = (
    Fault(
        "active_neurons_inverted",
        "parc_jax/network/predict.py",
        "active.append(z > 0)",
        "active.append(z < 0)",
        (
            "tests/network/test_predict.py"
            "::test_a_prediction_is_the_network_time_major_from_the_start",
        ),
    ),
    Fault(
        "knots_axis_major",
        "parc_jax/network/predict.py",
        "return knots.reshape(-1, layout.n_c), y[layout.n_offsets :], active",
        "return knots.reshape(layout.n_c, -1).T, y[layout.n_offsets :], active",
        (
            "tests/network/test_predict.py::test_a_prediction_is_the_network_time_major_from_the_start",
        ),
    ),
    Fault(
        "accelerator_products_rounded",
        "parc_jax/network/predict.py",
        "HIGHEST = jax.lax.Precision.HIGHEST",
        "HIGHEST = jax.lax.Precision.DEFAULT",
        ("tests/verdict/test_pointwise.py::test_every_product_of_a_verdict_keeps_full_precision",),
    ),
    Fault(
        "rounding_of_earlier_layers_forgotten",
        "parc_jax/network/rounding.py",
        "error = (np.abs(W) @ error + gamma * absolute",
        "error = (gamma * absolute",
        ("tests/network/test_rounding.py::test_errors_of_earlier_layers_are_carried_on",),
    ),
    Fault(
        "fold_forgets_the_mean",
        "parc_jax/network/fold.py",
        "biases[0] = biases[0] - first @ norm.x_mean",
        "biases[0] = biases[0] + first @ norm.x_mean",
        ("tests/network/test_fold.py::test_folded_network_equals_the_normalised_one",),
    ),
)

OBSTACLES = (
    Fault(
        "one_end_of_the_segment",
        "parc_jax/obstacles/segment.py",
        "gap = xp.minimum(dot2(w, pa), dot2(w, pb)) -",
        "gap = dot2(w, pa) -",
        (
            "tests/obstacles/test_segment.py::test_gap_is_the_distance_when_disjoint_and_not_positive_when_in_contact",
        ),
    ),
    Fault(
        "disc_dropped",
        "parc_jax/obstacles/segment.py",
        "return gap - radius, w",
        "return gap, w",
        ("tests/soundness/test_known_plans.py::test_a_disc_that_touches_a_corner_is_refused",),
    ),
    Fault(
        "body_not_mirrored",
        "parc_jax/obstacles/grown.py",
        "body = [(-Fraction(x), -Fraction(y))",
        "body = [(Fraction(x), Fraction(y))",
        ("tests/obstacles/test_grown.py::test_support_of_the_sum_for_every_error_box",),
    ),
    Fault(
        "span_ends_one_early",
        "parc_jax/obstacles/grown.py",
        "return (at >= first) & (at <= last)",
        "return (at >= first) & (at < last)",
        ("tests/soundness/test_known_plans.py::test_an_obstacle_is_there_only_during_its_steps",),
    ),
    Fault(
        "sign_patterns_of_two_quadrants",
        "parc_jax/obstacles/grown.py",
        "out.append((polygon[index], (sx, sy)))",
        "out.append((polygon[index], (sx, sx)))",
        ("tests/obstacles/test_grown.py::test_support_of_the_sum_for_every_error_box",),
    ),
    Fault(
        "support_of_the_unmirrored_body",
        "parc_jax/obstacles/directions.py",
        "return (-body.vertices @ w.T).max(axis=0)",
        "return (body.vertices @ w.T).max(axis=0)",
        (
            "tests/obstacles/test_directions.py"
            "::test_every_multiplier_is_a_proof_and_the_support_is_exact",
        ),
    ),
    Fault(
        "sums_of_multipliers_forget_the_low_bits",
        "parc_jax/obstacles/directions.py",
        "products += [factor * large, factor * (x - large)]",
        "products += [factor * large, 0.0]",
        ("tests/obstacles/test_directions.py::test_sums_are_rounded_once_whatever_is_summed",),
    ),
    Fault(
        "disc_support_of_unit_directions",
        "parc_jax/obstacles/directions.py",
        "return body.radius * np.hypot.reduce(w, axis=1)",
        "return body.radius * np.ones(len(w))",
        (
            "tests/obstacles/test_directions.py"
            "::test_every_multiplier_is_a_proof_and_the_support_is_exact",
        ),
    ),
)

VERDICT = (
    Fault(
        "only_the_first_knot_of_an_interval",
        "parc_jax/obstacles/grown.py",
        "separations(path[:-1], path[1:], corners",
        "separations(path[:-1], path[:-1], corners",
        ("tests/soundness/test_known_plans.py::test_a_thin_obstacle_between_knots_is_seen",),
    ),
    Fault(
        "tube_shrinks_obstacles",
        "parc_jax/obstacles/grown.py",
        "corners = corner[None] + sign[None] * error[:, None]",
        "corners = corner[None] - sign[None] * error[:, None]",
        (
            "tests/soundness/test_known_plans.py"
            "::test_a_gap_of_exactly_body_and_tubes_is_refused_and_one_step_more_is_accepted",
        ),
    ),
    Fault(
        "tube_of_the_next_interval",
        "parc_jax/verdict/pointwise.py",
        "clearance(scene, seen.path, tube.during(seen.bin))",
        "clearance(scene, seen.path, jnp.roll(tube.during(seen.bin), -1, axis=0))",
        ("tests/verdict/test_pointwise.py::test_every_interval_has_its_own_widths",),
    ),
    Fault(
        "slack_dropped",
        "parc_jax/verdict/pointwise.py",
        "gap - scene.slack * jnp.abs(w).sum(axis=-1)",
        "gap - 0 * jnp.abs(w).sum(axis=-1)",
        ("tests/verdict/test_pointwise.py::test_the_clearance_pays_the_slack",),
    ),
    Fault(
        "slack_for_the_goal_given_back",
        "parc_jax/verdict/pointwise.py",
        "jnp.min(b - values - slack *",
        "jnp.min(b - values + slack *",
        ("tests/verdict/test_pointwise.py::test_row_margins_pay_the_slack_by_the_size_of_the_row",),
    ),
    Fault(
        "touching_is_safe",
        "parc_jax/verdict/pointwise.py",
        "return self.reaches & (self.clearance > 0)",
        "return self.reaches & (self.clearance >= 0)",
        ("tests/verdict/test_pointwise.py::test_a_clearance_of_nothing_is_not_safe",),
    ),
    Fault(
        "first_obstacle_only",
        "parc_jax/verdict/pointwise.py",
        "jnp.where(scene.obstacles.active, gap, jnp.inf).min()",
        "jnp.where(scene.obstacles.active, gap, jnp.inf)[0].min()",
        (
            "tests/soundness/test_random_scenes.py::test_accepted_plans_are_free_and_clearly_free_plans_are_accepted",
        ),
    ),
    Fault(
        "wrong_bin_on_an_inner_edge",
        "parc_jax/claim/tube.py",
        " & ~on_inner_edge",
        "",
        ("tests/verdict/test_pointwise.py::test_bins_are_the_tubes_bins_and_boundaries_have_none",),
    ),
    Fault(
        "places_end_anywhere",
        "parc_jax/cover/sampling.py",
        "fits = (b >= 0) & ((z_lo[b] <= z) & (z <= z_hi[b])).all(axis=1)",
        "fits = b > 0",
        ("tests/cover/test_rare.py::test_a_set_of_share_1e_10_is_covered_like_any_other",),
    ),
    Fault(
        "a_place_half_as_wide",
        "parc_jax/cover/place.py",
        "half = 0.5 * (most - least) * (1 + 2 * ROOM) + LEAST_ROOM",
        "half = 0.25 * (most - least) * (1 + 2 * ROOM) + LEAST_ROOM",
        ("tests/cover/test_rare.py::test_a_place_holds_what_it_is_made_around",),
    ),
    Fault(
        "the_volume_of_a_place",
        "parc_jax/cover/place.py",
        "return float(2.0 ** len(self.middle) * abs(np.linalg.det(self.axes)))",
        "return float(abs(np.linalg.det(self.axes)))",
        ("tests/cover/test_rare.py::test_draws_are_uniform_over_a_place",),
    ),
    Fault(
        "goal_not_shrunken",
        "parc_jax/verdict/pointwise.py",
        "scene.goal_b - lost",
        "scene.goal_b",
        ("tests/soundness/test_known_plans.py::test_the_goal_is_closed_and_shrinks_by_the_tube",),
    ),
    Fault(
        "goal_shrunken_without_absolute_values",
        "parc_jax/claim/error_set.py",
        "return _total(_product(abs(w), half))",
        "return _total(_product(w, half))",
        (
            "tests/verdict/test_pointwise.py::test_margins_of_goal_and_start_are_those_of_the_rows",
            "tests/claim/test_error_set.py::test_a_box_reaches_to_its_corners",
        ),
    ),
    Fault(
        "start_set_ignored",
        "parc_jax/verdict/pointwise.py",
        '''on the way."""
        return (self.goal >= 0) & (self.start >= 0) & (self.bin >= 0)

    @property
    def safe''',
        '''on the way."""
        return (self.goal >= 0) & (self.bin >= 0)

    @property
    def safe''',
        ("tests/soundness/test_known_plans.py::test_the_start_set_is_closed",),
    ),
    Fault(
        "float_slack_of_nothing",
        "parc_jax/verdict/scene.py",
        "slack = 4 * bound.error.max() + 64 * UNIT *",
        "slack = 0 * bound.error.max() + 0 * UNIT *",
        ("tests/verdict/test_scene.py::test_slack_grows_with_everything_that_rounds",),
    ),
    Fault(
        "open_intervals_taken_for_separated",
        "parc_jax/verdict/screen.py",
        "~(gap > 0))",
        "gap < -0.5)",
        ("tests/verdict/test_screen.py::test_contact_where_it_does_not_look_worst_is_seen",),
    ),
    Fault(
        "probes_that_fail_are_ignored",
        "parc_jax/probes.py",
        "failed = [f for f in _cached() if not f.ok]",
        "failed = [f for f in _cached() if f is None]",
        ("tests/test_probes.py::test_any_failed_probe_refuses_the_query",),
    ),
)

REGIONS = (
    Fault(
        "constant_positive_neuron_switched_off",
        "parc_jax/pwa/subdivide.py",
        "            lattice.bits.mark(column, codes)\n            column += 1",
        "            if (codes == Sign.MINUS).any():\n"
        "                lattice.bits.mark(column, codes)\n            column += 1",
        ("tests/pwa/test_degenerate.py::test_dead_layer_feeds_its_bias_forward",),
    ),
    Fault(
        "rows_of_the_other_side",
        "parc_jax/pwa/maps.py",
        "sign = xp.where(on, -1.0, 1.0)",
        "sign = xp.where(on, 1.0, -1.0)",
        ("tests/pwa/test_maps.py::test_one_pattern_and_many_in_numpy_and_jax_agree",),
    ),
    Fault(
        "offset_of_inactive_neurons_kept",
        "parc_jax/pwa/maps.py",
        "d = xp.where(on, d, 0.0)",
        "d = xp.where(on, d, d)",
        ("tests/pwa/test_maps.py::test_one_pattern_and_many_in_numpy_and_jax_agree",),
    ),
    Fault(
        "lost_volume_accepted",
        "parc_jax/pwa/proof.py",
        "if not proof.gap <= VOLUME_RELATIVE:",
        "if not proof.gap <= 1:",
        ("tests/pwa/test_guards.py::test_missing_volume",),
    ),
    Fault(
        "lost_face_accepted",
        "parc_jax/pwa/proof.py",
        "if proof.euler != 1:",
        "if proof.euler > 1:",
        ("tests/pwa/test_guards.py::test_missing_face",),
    ),
    Fault(
        "same_region_twice_accepted",
        "parc_jax/pwa/proof.py",
        "if not _all_distinct(plus):",
        "if not len(plus):",
        ("tests/pwa/test_guards.py::test_same_pattern_twice",),
    ),
    Fault(
        "exact_zero_is_active",
        "parc_jax/pwa/exact.py",
        "    if value > 0:\n        return Sign.PLUS",
        "    if value >= 0:\n        return Sign.PLUS",
        ("tests/pwa/test_degenerate.py::test_integer_weights_meet_everywhere",),
    ),
)

COVER = (
    Fault(
        "corridor_at_the_first_knot_only",
        "parc_jax/cover/corridors.py",
        "return conditions.met(bin, corridor, path[:-1], path[1:])",
        "return conditions.met(bin, corridor, path[:-1])",
        ("tests/cover/test_corridors.py::test_who_keeps_is_found_as_by_hand",),
    ),
    Fault(
        "corridor_without_the_tube",
        "parc_jax/cover/corridors.py",
        "threshold = support + allowed.support_by_axis(back)",
        "threshold = support + 0 * allowed.support_by_axis(back)",
        ("tests/cover/test_corridors.py::test_who_keeps_is_found_as_by_hand",),
    ),
    Fault(
        "polytope_needs_less_than_the_tube",
        "parc_jax/cover/corridor.py",
        "return self.support[..., None] + lost(self.w, errors, self.points)",
        "return self.support[..., None] + 0.5 * lost(self.w, errors, self.points)",
        (
            "tests/soundness/test_sets.py::test_vertices_of_the_float_polytopes_satisfy_the_exact_rows",
        ),
    ),
    Fault(
        "polytope_rows_at_the_first_knot_only",
        "parc_jax/cover/polytope.py",
        "for shift in (0, 1):",
        "for shift in (0,):",
        (
            "tests/soundness/test_sets.py::test_vertices_of_the_float_polytopes_satisfy_the_exact_rows",
        ),
    ),
    Fault(
        "polytope_rows_pushed_out",
        "parc_jax/cover/polytope.py",
        "b[real] - float(scene.slack) * size[real]",
        "b[real] + 1e6 * float(scene.slack) * size[real]",
        (
            "tests/soundness/test_sets.py::test_vertices_of_the_float_polytopes_satisfy_the_exact_rows",
        ),
    ),
    Fault(
        "cell_without_its_upper_border",
        "parc_jax/cover/polytope.py",
        "[jnp.asarray(bin_hi), -jnp.asarray(bin_lo),",
        "[jnp.asarray(bin_hi) + 1, -jnp.asarray(bin_lo),",
        ("tests/soundness/test_sets.py::test_contains_is_the_union_of_the_rows",),
    ),
    Fault(
        "members_not_asked_for_the_goal",
        "parc_jax/cover/plan_set.py",
        "out = e.reaches",
        "out = np.ones(len(k), bool)",
        ("tests/test_answer.py::test_membership_asks_for_goal_and_start_too",),
    ),
    Fault(
        "looks_share_no_error",
        "parc_jax/cover/stopping.py",
        "delta = (1 - confidence) * 6 / (np.pi * part) ** 2",
        "delta = 1 - confidence",
        (
            "tests/cover/test_stopping.py"
            "::test_announced_looks_alone_satisfy_a_rule_and_it_pays_for_each",
        ),
    ),
    Fault(
        "share_of_k_from_above",
        "parc_jax/cover/plan_set.py",
        "return least_probability(int(hit.sum()), n, 0.001)",
        "return least_probability(int(hit.sum()), n, 1 - 1e-12)",
        ("tests/test_answer.py::test_the_share_of_k_is_a_lower_bound",),
    ),
    Fault(
        "volume_without_its_lower_bound",
        "parc_jax/answer.py",
        "least_probability(x, n, tail), float(clopper_pearson(x, n, tail))",
        "x / n, float(clopper_pearson(x, n, tail))",
        ("tests/test_answer.py::test_the_volume_interval_is_clopper_pearson",),
    ),
    Fault(
        "rare_only_where_no_draw_was_safe",
        "parc_jax/cover/sampling.py",
        "return self.safe < FEW and",
        "return self.safe == 0 and",
        ("tests/cover/test_rare.py::test_a_handful_of_safe_draws_is_no_reason_to_go_on_drawing",),
    ),
    Fault(
        "samples_outside_of_the_corridors",
        "parc_jax/cover/kept.py",
        "kept = one.safe.at(self.has(one.safe))",
        "kept = one.safe",
        ("tests/cover/test_kept.py::test_every_sample_is_safe_by_a_corridor_of_the_answer",),
    ),
    Fault(
        "later_polytopes_counted_on_their_own_plans",
        "parc_jax/cover/later.py",
        "inside = polytopes.first(fresh, building) >= 0",
        "inside = polytopes.first(seen, building) >= 0",
        ("tests/cover/test_kept.py::test_what_later_polytopes_hold_is_told_by_fresh_plans",),
    ),
    Fault(
        "density_without_the_covered_share",
        "parc_jax/answer.py",
        "known[1] * self._held.at_least",
        "known[1]",
        ("tests/test_answer.py::test_the_density_pays_for_what_the_polytopes_do_not_cover",),
    ),
)

PROGRAMS = (
    Fault(
        "solver_trouble_read_as_empty",
        "parc_jax/lp/solve.py",
        "    return _result(lp, LPStatus.UNKNOWN, None, hint, -np.inf)\n\n\ndef _with_point",
        "    return _result(lp, LPStatus.INFEASIBLE, None, hint, -np.inf)\n\n\ndef _with_point",
        ("tests/lp/test_failures.py::test_limits_and_almost_answers_are_unknown",),
    ),
    Fault(
        "emptiness_without_a_proof",
        "parc_jax/lp/solve.py",
        'hint.kind == "empty" and _lower_bound(lp, np.zeros(lp.n), hint) > TOLERANCES.lp_margin',
        'hint.kind == "empty"',
        ("tests/lp/test_failures.py::test_a_lying_solver_never_makes_a_set_empty",),
    ),
    Fault(
        "points_not_checked",
        "parc_jax/lp/solve.py",
        "if not violation(x, A, b, lp.lo, lp.hi) <= TOLERANCES.lp_feasible:",
        "if violation(x, A, b, lp.lo, lp.hi) > 1e9:",
        ("tests/lp/test_failures.py::test_swapped_verdicts_do_not_pass",),
    ),
    Fault(
        "dual_bound_without_rounding",
        "parc_jax/lp/witness.py",
        "- gamma(h + n + 4) * size - (h + n) * _TINY",
        "",
        ("tests/lp/test_witness.py::test_float_bound_is_below_the_rational_bound_and_close",),
    ),
)

BATCH = (
    Fault(
        "box_spans_end_one_early",
        "parc_jax/batch/box_scenes.py",
        "(t <= boxes.spans[..., 1:])",
        "(t < boxes.spans[..., 1:])",
        ("tests/batch/test_solve.py::test_arrays_of_boxes_are_laid_out_like_problems",),
    ),
    Fault(
        "box_obstacles_in_reverse",
        "parc_jax/batch/box_scenes.py",
        "[tuple(int(t) for t in self.spans[i, j]) for j in kept]",
        "[tuple(int(t) for t in self.spans[i, j]) for j in kept[::-1]]",
        ("tests/batch/test_solve.py::test_arrays_of_boxes_are_laid_out_like_problems",),
    ),
    Fault(
        "absent_boxes_present",
        "parc_jax/batch/box_scenes.py",
        "boxes.present[..., None] & during",
        "during",
        ("tests/batch/test_solve.py::test_arrays_of_boxes_are_laid_out_like_problems",),
    ),
    Fault(
        "refused_certificates_accepted",
        "parc_jax/certificate/prove.py",
        "    except checker.Rejected:\n        return False",
        "    except checker.Rejected:\n        return True",
        ("tests/certificate/test_write.py::test_prove_keeps_what_holds_and_drops_what_does_not",),
    ),
)

ENGINE = (*NETWORK, *OBSTACLES, *VERDICT, *REGIONS, *COVER, *PROGRAMS, *BATCH)
