"""Faults of the verdict on a plan: grown obstacles, goals, screens, volume bounds."""

from benchmarks.attacks.fault import Fault

OBSTACLES = (
    Fault(
        "one_end_of_the_segment",
        "parc_jax/obstacles/segment.py",
        "gap = xp.minimum(dot2(w, pa), dot2(w, pb)) -",
        "gap = dot2(w, pa) -",
        (
            "tests/obstacles/test_segment.py"
            "::test_gap_is_the_distance_when_disjoint_and_not_positive_when_in_contact",
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
        "fori_loop(0, scene.count, look, _far(scene, path))",
        "fori_loop(0, jnp.minimum(scene.count, 1), look, _far(scene, path))",
        (
            "tests/soundness/test_random_scenes.py"
            "::test_accepted_plans_are_free_and_clearly_free_plans_are_accepted",
        ),
    ),
    Fault(
        "wrong_bin_on_an_inner_edge",
        "parc_jax/claim/bins.py",
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
    Fault(
        "boxes_take_the_vertices_of_others",
        "parc_jax/volume_bounds/examined.py",
        "owner = np.repeat(np.arange(len(nodes)), [",
        "owner = np.repeat(np.arange(len(nodes))[::-1], [",
        (
            "tests/volume_bounds/test_examined.py"
            "::test_at_vertices_boxes_do_not_know_their_neighbours",
        ),
    ),
    Fault(
        "boxes_over_the_bins_of_the_first",
        "parc_jax/volume_bounds/examined.py",
        "over = [self.errors.over(node.lo[n_p:], node.hi[n_p:]) for node in nodes]",
        "over = [self.errors.over(nodes[0].lo[n_p:], nodes[0].hi[n_p:]) for node in nodes]",
        (
            "tests/volume_bounds/test_examined.py::test_by_bounds_boxes_do_not_know_their_neighbours",
        ),
    ),
)

VERDICTS = (*OBSTACLES, *VERDICT)
