"""Faults of what is said of many plans: corridors, polytopes, their share, batches, what an answer
says.
"""

from benchmarks.attacks.fault import Fault

COVER = (
    Fault(
        "bins_of_two_kinds_are_two_programs",
        "sampling.points",
        "e.bin.astype(np.int64)",
        "e.bin",
        ("tests/cover/test_sampling.py::test_counts_are_of_what_reaches_and_what_is_safe",),
    ),
    Fault(
        "safe_share_of_what_the_tube_leaves",
        "numbers.safe_share",
        "found.whole",
        "found.cover.volume",
        (
            "tests/answer/test_numbers.py::test_the_safe_share_is_of_all_plans_that_were_asked_about",
        ),
    ),
    Fault(
        "safe_share_of_what_the_doubt_leaves",
        "Findings.whole",
        "self.doubt is None or self.question is None",
        "True",
        (
            "tests/answer/test_numbers.py::test_the_safe_share_is_of_all_plans_that_were_asked_about",
        ),
    ),
    Fault(
        "seconds_that_end_a_search_early",
        "Limit.over",
        "+ reserved > self",
        "+ reserved > 0.03 * self",
        ("tests/cover/test_work.py::test_a_slow_machine_gives_the_same_bits",),
    ),
    Fault(
        "climbs_without_a_limit",
        "rare._raise_to_safe",
        " or limit.over()",
        "",
        ("tests/cover/test_work.py::test_seconds_end_a_climb_between_its_levels",),
    ),
    Fault(
        "seconds_that_count_from_a_safe_draw_on",
        "rare._raise_to_safe",
        "limit.start()",
        "pass",
        ("tests/test_methods.py::test_seconds_count_though_no_draw_was_safe",),
    ),
    Fault(
        "moves_without_a_limit",
        "rare._moved",
        "if limit.over()",
        "if False",
        ("tests/cover/test_work.py::test_seconds_end_a_climb_between_its_moves",),
    ),
    Fault(
        "draws_of_plans_alone_without_a_limit",
        "search.draw_safe_plans",
        " and limit.over()",
        " and False",
        ("tests/cover/test_work.py::test_seconds_end_draws_of_plans_alone_and_are_told",),
    ),
    Fault(
        "a_climb_when_no_seconds_are_left",
        "method.Exact.search",
        " or limit.over()",
        "",
        (
            "tests/cover/test_work.py"
            "::test_where_no_seconds_are_left_nothing_climbs_and_nothing_is_proved",
        ),
    ),
    Fault(
        "a_proof_when_no_seconds_are_left",
        "prove_no_plan.prove_no_plan",
        "if limit.over()",
        "if False",
        (
            "tests/cover/test_work.py"
            "::test_where_no_seconds_are_left_nothing_climbs_and_nothing_is_proved",
        ),
    ),
    Fault(
        "cut_off_and_told_as_the_target",
        "search._ended",
        "    if query.limit.cut:\n        return Ended.SECONDS\n",
        "",
        (
            "tests/cover/test_work.py"
            "::test_a_target_that_is_reached_after_a_cut_is_not_told_as_reached",
        ),
    ),
    Fault(
        "cut_off_and_told_as_work",
        "prove_no_plan.prove_no_plan",
        "SECONDS if limit.cut else Ended.",
        "",
        ("tests/cover/test_work.py::test_a_proof_of_absence_says_what_ended_it",),
    ),
    Fault(
        "corridor_at_the_first_knot_only",
        "keeping.keeps",
        "range(len(path) - n + 1)",
        "range(1)",
        ("tests/cover/test_corridors.py::test_who_keeps_is_found_as_by_hand",),
    ),
    Fault(
        "corridor_without_the_tube",
        "Computed.of",
        "self.support[o, corridor] + lost",
        "self.support[o, corridor] + 0 * lost",
        ("tests/cover/test_corridors.py::test_who_keeps_is_found_as_by_hand",),
    ),
    Fault(
        "polytope_needs_less_than_the_tube",
        "threshold",
        "return self.support[..., None] + lost(self.w, errors, self.points)",
        "return self.support[..., None] + 0.5 * lost(self.w, errors, self.points)",
        (
            "tests/soundness/test_sets.py"
            "::test_vertices_of_the_float_polytopes_satisfy_the_exact_rows",
        ),
    ),
    Fault(
        "polytope_rows_at_the_first_knot_only",
        "SafePolytope.halfspaces",
        "for shift in (0, 1)",
        "for shift in (0,)",
        (
            "tests/soundness/test_sets.py"
            "::test_vertices_of_the_float_polytopes_satisfy_the_exact_rows",
        ),
    ),
    Fault(
        "polytope_rows_pushed_out",
        "SafePolytope.halfspaces",
        "- float(scene.slack)",
        "+ 1e6 * float(scene.slack)",
        (
            "tests/soundness/test_sets.py"
            "::test_vertices_of_the_float_polytopes_satisfy_the_exact_rows",
        ),
    ),
    Fault(
        "cell_without_its_upper_border",
        "anchored_rows",
        "(bin_hi), -jnp.",
        "(bin_hi) + 1, -jnp.",
        ("tests/soundness/test_sets.py::test_contains_is_the_union_of_the_rows",),
    ),
    Fault(
        "members_not_asked_for_the_goal",
        "PlanSet.contains",
        "= e.reaches",
        "= np.ones(len(k), bool)",
        ("tests/answer/test_answer.py::test_membership_asks_for_goal_and_start_too",),
    ),
    Fault(
        "looks_share_no_error",
        "largest_share",
        "(1 - confidence) * 6 / (np.pi * part) ** 2",
        "1 - confidence",
        (
            "tests/cover/test_stopping.py"
            "::test_announced_looks_alone_satisfy_a_rule_and_it_pays_for_each",
        ),
    ),
    Fault(
        "share_of_k_from_above",
        "PlanSet.share_of_k",
        ", n, 0.001",
        ", n, 1 - 1e-12",
        ("tests/answer/test_answer.py::test_the_share_of_k_is_a_lower_bound",),
    ),
    Fault(
        "volume_without_its_lower_bound",
        "numbers.safe_volume",
        "least_probability(cover.safe, cover.drawn, tail)",
        "cover.safe / cover.drawn",
        ("tests/answer/test_numbers.py::test_the_volume_interval_is_clopper_pearson",),
    ),
    Fault(
        "rare_only_where_no_draw_was_safe",
        "Counts.hopeless",
        "safe < FEW",
        "safe == 0",
        ("tests/cover/test_rare.py::test_a_handful_of_safe_draws_is_no_reason_to_go_on_drawing",),
    ),
    Fault(
        "samples_outside_of_the_corridors",
        "KeptPlans.sample",
        ".at(self.has(one.safe))",
        "",
        ("tests/cover/test_kept.py::test_every_sample_is_safe_by_a_corridor_of_the_answer",),
    ),
    Fault(
        "later_polytopes_counted_on_their_own_plans",
        "cut_later",
        ".first(fresh, building)",
        ".first(seen, building)",
        ("tests/cover/test_kept.py::test_what_later_polytopes_hold_is_told_by_fresh_plans",),
    ),
    Fault(
        "density_without_the_covered_share",
        "density_of_k",
        "least * found._held.at_least",
        "least",
        (
            "tests/answer/test_numbers.py"
            "::test_the_density_pays_for_what_the_polytopes_do_not_cover",
        ),
    ),
    Fault(
        "names_of_others_as_html",
        "as_html",
        "html.escape(one_line(found))",
        "one_line(found)",
        ("tests/answer/test_statement.py::test_names_of_others_are_text_in_a_notebook",),
    ),
)

BATCH = (
    Fault(
        "box_spans_end_one_early",
        "box_scenes._obstacles",
        "t <= boxes.spans[..., 1:]",
        "t < boxes.spans[..., 1:]",
        ("tests/batch/test_solve.py::test_arrays_of_boxes_are_laid_out_like_problems",),
    ),
    Fault(
        "box_obstacles_in_reverse",
        "BoxScenes.problem",
        "(int(t) for t in self.spans[i, j]) for j in kept",
        "(int(t) for t in self.spans[i, j]) for j in kept[::-1]",
        ("tests/batch/test_solve.py::test_arrays_of_boxes_are_laid_out_like_problems",),
    ),
    Fault(
        "absent_boxes_present",
        "box_scenes._obstacles",
        "boxes.present[..., None] & during",
        "during",
        ("tests/batch/test_solve.py::test_arrays_of_boxes_are_laid_out_like_problems",),
    ),
    Fault(
        "refused_certificates_accepted",
        "_accepts",
        "return False",
        "return True",
        ("tests/certificate/test_write.py::test_prove_keeps_what_holds_and_drops_what_does_not",),
    ),
)

COVERS = (*COVER, *BATCH)
