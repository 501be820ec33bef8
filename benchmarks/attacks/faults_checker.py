"""Faults of the independent checker: each would let it accept what is not proved."""

from benchmarks.attacks.fault import Fault

EXACT = "parc_jax/checker/exact.py"
ERRORS = "parc_jax/checker/errors.py"
QUESTION = "parc_jax/checker/question.py"
PLANS = "parc_jax/checker/plans.py"
NO_PLAN = "parc_jax/checker/no_plan.py"
HITS = "parc_jax/checker/hits.py"
DOUBT = "parc_jax/checker/doubt.py"
ENTRIES = "parc_jax/checker/entries.py"
ANSWER = "parc_jax/checker/answer.py"
BAD = "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected"
CHECKER = (
    Fault(
        "checker_claim_of_any_runs",
        "arithmetic_of",
        "need(used <= ONE",
        "need(used is not None",
        (BAD,),
    ),
    Fault(
        "checker_claim_whose_looks_cost_nothing",
        "arithmetic_of",
        "looks * share",
        "share",
        (BAD,),
    ),
    Fault(
        "checker_claim_whose_discards_cost_nothing",
        "claim.share",
        "range(discard, 0, -1)",
        "range(0)",
        (BAD,),
    ),
    Fault(
        "checker_claim_rounded_to_its_advantage",
        "claim.share",
        "-(-top * (n - i + 1) * p // (i * rest)) + (ONE >> up) + 1",
        "top * (n - i + 1) * p // (i * rest) + (ONE >> up) - 1",
        (
            "tests/checker/test_checker_claim.py"
            "::test_a_share_is_the_binomial_sum_rounded_up_by_next_to_nothing",
        ),
    ),
    Fault(
        "checker_premises_checked_by_their_own_word",
        "claim.check_premises",
        "need(checked == known",
        "need(checked is not None",
        (BAD,),
    ),
    Fault(
        "checker_touching_is_safe",
        "plans.holds",
        ":\n        return value >",
        ":\n        return value >=",
        (
            "tests/checker/test_checker_answers.py"
            "::test_touching_is_refused_and_one_ulp_of_room_accepted",
        ),
    ),
    Fault(
        "checker_goal_not_shrunken",
        "shrunken_goal",
        "[(a, b - final.support(a, i)) for i, (a, b) in enumerate(self.goal)]",
        "self.goal",
        (BAD,),
    ),
    Fault(
        "checker_widths_without_absolute_values",
        "Widths.support",
        "[abs(x) for x in w]",
        "w",
        (BAD,),
    ),
    Fault(
        "checker_body_dropped",
        "Context._beyond",
        "h + support(part, w)",
        "h",
        (BAD,),
    ),
    Fault(
        "checker_body_mirrored",
        "plans.support",
        "-dot(w, vertex)",
        "dot(w, vertex)",
        (BAD,),
    ),
    Fault(
        "checker_root_rounded_down",
        "plans.support",
        "    if root * root < square:\n        root += 1\n",
        "",
        (BAD,),
    ),
    Fault(
        "checker_tube_dropped",
        "Context._separation",
        "denominator + wider.numerator",
        "denominator",
        (BAD,),
    ),
    Fault(
        "checker_narrower_interval_at_a_knot",
        "Context._separation",
        "wider = max(before, after)",
        "wider = min(before, after)",
        (BAD,),
    ),
    Fault(
        "checker_last_knot_of_a_run_skipped",
        "Context._separation",
        "(errors) + 1",
        "(errors)",
        ("tests/checker/test_checker_answers.py::test_a_wall_between_knots_is_never_jumped",),
    ),
    Fault(
        "checker_runs_may_end_early",
        "Context._clear",
        "== last + 1",
        "<= last + 1",
        (BAD,),
    ),
    Fault(
        "checker_least_widths_on_a_border",
        "conditions",
        "interval, final = self.errors(bins, max)",
        "interval, final = self.errors(bins, min)",
        (BAD,),
    ),
    Fault(
        "checker_one_bin_on_a_border",
        "bins_meeting",
        "b and a <=",
        "b and a <",
        (BAD,),
    ),
    Fault(
        "checker_polytopes_closed_on_borders",
        "_bin_rows",
        ", place > 0",
        ", False",
        (
            "tests/checker/test_checker_borders.py"
            "::test_faces_towards_other_bins_are_open_and_ends_of_the_domain_closed",
        ),
    ),
    Fault(
        "checker_start_set_ignored",
        "conditions",
        "for i, (a, b) in enumerate(self.start)",
        "for i, (a, b) in enumerate(())",
        (
            "tests/checker/test_checker_checks.py"
            "::test_bad_certificates_are_rejected[p0 outside the start set]",
        ),
    ),
    Fault(
        "checker_constant_neurons_ignored",
        "check_inside",
        "value >= 0",
        "True",
        ("tests/checker/test_checker_answers.py::test_constant_neurons_have_the_right_sign",),
    ),
    Fault(
        "checker_negative_multipliers",
        "combine",
        '= 0, "a multiplier',
        '= -1000, "a multiplier',
        (BAD,),
    ),
    Fault(
        "checker_reads_through_floats",
        "exact.number",
        "return Fraction(text)",
        "return Fraction(float(Fraction(text)))",
        ("tests/checker/test_checker_answers.py::test_decimals_are_not_floats",),
    ),
    Fault(
        "checker_domain_ignored",
        "check_sample",
        'inside, "k',
        'True, "k',
        (BAD,),
    ),
    Fault(
        "checker_hashes_ignored",
        "check_answer",
        'need(answer["hash"] == hashes, "a hash does not match its content")',
        "",
        (BAD,),
    ),
    Fault(
        "checker_claim_about_another_tube",
        "checked_claim",
        'need(claim["tube_hash"] == hashes["tube"], "the claim is about another tube")',
        "",
        (BAD,),
    ),
    Fault(
        "checker_the_end_may_leave_out_the_model",
        "bins_without_model",
        "errors = [final, *itertools.chain.from_iterable(by_interval)]",
        "errors = [*itertools.chain.from_iterable(by_interval)]",
        ("tests/checker/test_checker_valid.py::test_it_says_whether_the_tube_holds_the_model",),
    ),
    Fault(
        "checker_says_again_what_was_said",
        "entries.valued",
        "return number(part) if type(part) is str else part",
        "return part",
        ("tests/checker/test_proved_js.py::test_both_checkers_count_the_same",),
    ),
    Fault(
        "checker_processes_spend_apart",
        "check_in_shares",
        "context.spend(spent)",
        "del spent",
        ("tests/checker/test_checker_entries.py::test_processes_share_one_allowance",),
    ),
    Fault(
        "checker_rejected_in_another_process_is_lost",
        "check_in_shares",
        "if rejections",
        "if answers[0][1]",
        ("tests/checker/test_checker_entries.py::test_the_first_rejected_entry_is_told",),
    ),
    Fault(
        "checker_a_flat_axis_has_no_bin",
        "_read_tube",
        'need(len(edge) >= 2, "an axis of the tube has no bin")',
        "",
        (BAD,),
    ),
    Fault(
        "checker_conditions_of_another_problem",
        "Context._read_problem",
        "self.known = {}",
        'self.known = getattr(self, "known", {})',
        (
            "tests/checker/test_checker_entries.py"
            "::test_what_is_known_of_a_problem_is_not_known_of_another",
        ),
    ),
    Fault(
        "checker_conditions_of_another_bin",
        "Context._clear",
        "repr(multipliers), *bins",
        "repr(multipliers)",
        (BAD,),
    ),
    Fault(
        "checker_exceptions_pass",
        "rejecting",
        'raise Rejected(f"{where}malformed input, {kind}: {str(error)[:200]}") from error',
        "del kind",
        (
            "tests/checker/test_checker_input.py"
            "::test_methods_of_the_context_raise_nothing_but_rejected",
        ),
    ),
    Fault(
        "checker_first_point_of_a_part_only",
        "Context._beyond",
        "part.points",
        "part.points[:1]",
        (BAD,),
    ),
    Fault(
        "checker_first_part_only",
        "conditions",
        "enumerate(array(entry, len(self.parts)))",
        "enumerate(array(entry, len(self.parts))[:1])",
        (BAD,),
    ),
    Fault(
        "checker_template_reaches_along_the_wrong_side",
        "Context._separation",
        "support(away) for",
        "support(w) for",
        (BAD,),
    ),
    Fault(
        "checker_template_with_negative_multipliers",
        "Template.least",
        "own <= ahead",
        "own",
        (BAD,),
    ),
    Fault(
        "checker_any_way_for_a_row_of_the_goal",
        "Template.support",
        "v == scaled and all",
        "all",
        (BAD,),
    ),
    Fault(
        "checker_no_room_for_p0",
        "doubt.roomy",
        "scale - lost",
        "scale",
        (BAD,),
    ),
    Fault(
        "checker_doubt_at_the_middle_only",
        "check_doubt",
        "in CellVertices(context).of(lo, hi)",
        "in CellVertices(context).of(k, k)",
        ("tests/checker/test_checker_doubt.py::test_a_box_fails_where_one_of_its_corners_does",),
    ),
    Fault(
        "no_plan_widest_widths",
        "Question.at_end",
        "return Several(sets, min)",
        "return Several(sets, max)",
        (BAD,),
    ),
    Fault(
        "no_plan_contact_outside_the_disc",
        "shape_point",
        "dot(point, point) <= part.radius**2",
        "True or point",
        (BAD,),
    ),
    Fault(
        "no_plan_error_outside_the_tube",
        "hit",
        'need(inside_tube, "the error of a contact is outside the tube")',
        "",
        (BAD,),
    ),
    Fault(
        "no_plan_vertices_forgotten",
        "network_cells",
        "(values) < 0 < max",
        "(values) < -1e9 < max",
        (
            "tests/checker/test_checker_cells.py"
            "::test_cells_tile_the_box_and_the_network_is_affine_on_each",
        ),
    ),
)
