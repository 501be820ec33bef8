"""Faults of the checker: claims, conditions of answers, certificates of absence, episodes."""

from benchmarks.attacks.fault import Fault

CHECKER = (
    Fault(
        "checker_claim_of_any_runs",
        "arithmetic_of",
        "need(used <= ONE",
        "need(used is not None",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_claim_whose_looks_cost_nothing",
        "arithmetic_of",
        "looks * share",
        "share",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_claim_whose_discards_cost_nothing",
        "claim.share",
        "range(discard, 0, -1)",
        "range(0)",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_claim_rounded_to_its_advantage",
        "claim.share",
        "-(-top * (n - i + 1) * p // (i * rest)) + (ONE >> up) + 1",
        "top * (n - i + 1) * p // (i * rest) + (ONE >> up) - 1",
        (
            "tests/checker/test_checker_claim.py"
            "::test_a_share_is_the_binomial_sum_rounded_up_by_next_to_nothing"
        ),
    ),
    Fault(
        "checker_claim_about_another_domain_or_time_step",
        "checked_claim",
        'None in (K, domain) or K == domain, "the claim is about another domain"',
        'True, ""',
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_claim_of_runs_that_failed",
        "arithmetic_of",
        "if failed and by_bin is None",
        "if None and by_bin is None",
        "tests/checker/test_checker_premises.py::test_what_no_field_states_is_assumed_and_said_to_be_missing",
    ),
    Fault(
        "checker_premise_that_no_field_states_is_not_told",
        "stated_premises",
        "found.append([name, ASSUMED, NOT_STATED])",
        "pass",
        "tests/checker/test_checker_premises.py::test_what_no_field_states_is_assumed_and_said_to_be_missing",
    ),
    Fault(
        "checker_touching_is_safe",
        "plans.holds",
        (":\n        return value >"),
        (":\n        return value >="),
        (
            "tests/checker/test_checker_answers.py"
            "::test_touching_is_refused_and_one_ulp_of_room_accepted"
        ),
    ),
    Fault(
        "checker_goal_not_shrunken",
        "shrunken_goal",
        "[(a, b - final.support(a, i)) for i, (a, b) in enumerate(self.goal)]",
        "self.goal",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_widths_without_absolute_values",
        "Widths.support",
        "[abs(x) for x in w]",
        "w",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_body_dropped",
        "Context._clear",
        "h + support(part, w)",
        "h",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_body_mirrored",
        "plans.support",
        "-dot(w, vertex)",
        "dot(w, vertex)",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_root_rounded_down",
        "plans.support",
        ("    if root * root < square:\n        root += 1\n"),
        "",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_tube_dropped",
        "Context._separation",
        "denominator + wider.numerator",
        "denominator",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_narrower_interval_at_a_knot",
        "Context._separation",
        "wider = max(before, after)",
        "wider = min(before, after)",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_last_knot_of_a_run_skipped",
        "Context._separation",
        "(errors) + 1",
        "(errors)",
        "tests/checker/test_checker_answers.py::test_a_wall_between_knots_is_never_jumped",
    ),
    Fault(
        "checker_runs_may_end_early",
        "Context._clear",
        "== last + 1",
        "<= last + 1",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_least_widths_on_a_border",
        "conditions",
        "interval, final = self.errors(bins, max)",
        "interval, final = self.errors(bins, min)",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_one_bin_on_a_border",
        "bins_meeting",
        "before(a, high)",
        "a < high",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_polytopes_closed_on_borders",
        "_bin_rows",
        ", place > 0",
        ", False",
        (
            "tests/checker/test_checker_borders.py"
            "::test_faces_towards_other_bins_are_open_and_ends_of_the_domain_closed"
        ),
    ),
    Fault(
        "checker_start_set_ignored",
        "conditions",
        "for i, (a, b) in enumerate(self.start)",
        "for i, (a, b) in enumerate(())",
        (
            "tests/checker/test_checker_checks.py"
            "::test_bad_certificates_are_rejected[p0 outside the start set]"
        ),
    ),
    Fault(
        "checker_negative_multipliers",
        "combine",
        '= 0, "a multiplier',
        '= -1000, "a multiplier',
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_reads_through_floats",
        "exact.number",
        "return Fraction(text)",
        "return Fraction(float(Fraction(text)))",
        "tests/checker/test_checker_answers.py::test_decimals_are_not_floats",
    ),
    Fault(
        "checker_boxes_without_errors",
        "Boxes.around",
        "x - e for",
        "x for",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_boxes_of_the_first_knot",
        "Boxes.box",
        "for s in (t, stop)",
        "for s in (t,)",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_hashes_ignored",
        "check_answer",
        'need(answer["hash"] == hashes, "a hash does not match its content")',
        "",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_the_end_may_leave_out_the_model",
        "_bins_where",
        "([final, *itertools.chain(*by_interval)] for",
        "([*itertools.chain(*by_interval)] for",
        "tests/checker/test_checker_valid.py::test_it_says_whether_the_tube_holds_the_model",
    ),
    Fault(
        "checker_errors_of_the_first_point",
        "Context._clear",
        "each[i] for each in interval[first:end]",
        "each[0] for each in interval[first:end]",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_an_error_of_some_bin",
        "Several.contains",
        "return all(each.contains(x) for each in self.sets)",
        "return any(each.contains(x) for each in self.sets)",
        (
            "tests/checker/test_checker_errors.py"
            "::test_several_bins_reach_as_far_as_the_farthest_or_as_all"
        ),
    ),
    Fault(
        "checker_template_reaches_along_the_wrong_side",
        "Context._separation",
        "support(away) for",
        "support(w) for",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_no_room_for_p0",
        "doubt.roomy",
        "scale - lost",
        "scale",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "checker_doubt_at_the_middle_only",
        "check_doubt",
        "in CellVertices(context).of(lo, hi)",
        "in CellVertices(context).of(k, k)",
        "tests/checker/test_checker_doubt.py::test_a_box_fails_where_one_of_its_corners_does",
    ),
    Fault(
        "no_plan_widest_widths",
        "Question.at_end",
        "for b in bins], min)",
        "for b in bins], max)",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "no_plan_contact_outside_the_disc",
        "shape_point",
        "dot(point, point) <= part.radius**2",
        "True or point",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "no_plan_vertices_forgotten",
        "network_cells",
        "(values) < 0 < max",
        "(values) < -1e9 < max",
        (
            "tests/checker/test_checker_cells.py"
            "::test_cells_tile_the_box_and_the_network_is_affine_on_each"
        ),
    ),
)
EPISODES = (
    Fault(
        "checker_chain_along_x_only",
        "Chain.follows",
        "product(range(n_p), (1, -1))",
        "product(range(1), (1, -1))",
        (
            "tests/checker/test_episode.py"
            "::test_the_next_one_begins_as_far_away_as_the_tube_allows_and_no_farther"
        ),
    ),
    Fault(
        "checker_chain_with_errors_of_the_end",
        "Chain.follows",
        "t = min(step, context.T - 1)",
        "t = context.T - 1",
        (
            "tests/checker/test_episode.py"
            "::test_the_next_one_begins_as_far_away_as_the_tube_allows_and_no_farther"
        ),
    ),
    Fault(
        "checker_chain_of_the_first_copy",
        "Chain.reach",
        "range(i * self.copies, (i + 1) * self.copies)",
        "range(i * self.copies, i * self.copies + 1)",
        (
            "tests/checker/test_episode.py"
            "::test_the_next_one_begins_as_far_away_as_the_tube_allows_and_no_farther"
        ),
    ),
    Fault(
        "checker_chain_of_points_seen_as_before",
        "episode.seen_by",
        "turned_back(other.heading, turned_back(-one.heading, w))",
        "w",
        "tests/checker/test_episode.py::test_so_it_is_for_a_robot_that_turns",
    ),
    Fault(
        "checker_episode_in_no_time",
        "Chain.follows",
        "2 * passed >= context.dt",
        "passed > 0",
        "tests/checker/test_episode.py::test_what_is_broken_is_rejected_however_it_is_sealed",
    ),
    Fault(
        "checker_episode_premise_told_otherwise",
        "checked_premises",
        "need(same,",
        "need(True,",
        "tests/checker/test_episode.py::test_each_premise_told_otherwise_is_refused",
    ),
    Fault(
        "checker_episode_leaves_out_a_doubt_that_gives_room",
        "known_premises",
        'rad"] if turned or heading else []',
        'rad"] if turned else []',
        "tests/checker/test_episode.py::test_a_doubt_of_a_heading_that_poses_do_not_have_is_said",
    ),
    Fault(
        "checker_episode_calls_anything_checked",
        "checked_premises",
        "standing in ADDED",
        "True",
        "tests/checker/test_episode.py::test_a_file_may_add_what_it_assumes_and_no_more",
    ),
)
FAULTS: tuple[Fault, ...] = (*CHECKER, *EPISODES)
