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
        "checker_touching_is_safe",
        PLANS,
        "    if condition.strict:\n        return value > 0",
        "    if condition.strict:\n        return value >= 0",
        (
            "tests/checker/test_checker_answers.py"
            "::test_touching_is_refused_and_one_ulp_of_room_accepted",
        ),
    ),
    Fault(
        "checker_goal_not_shrunken",
        PLANS,
        "return [(a, b - final.support(a, i)) for i, (a, b) in enumerate(self.goal)]",
        "return self.goal",
        (BAD,),
    ),
    Fault(
        "checker_widths_without_absolute_values",
        ERRORS,
        "return Fraction(dot([abs(x) for x in w], self.e), self.scale)",
        "return Fraction(dot(w, self.e), self.scale)",
        (BAD,),
    ),
    Fault(
        "checker_body_dropped",
        PLANS,
        "integers([*w, h + support(part, w)])",
        "integers([*w, h])",
        (BAD,),
    ),
    Fault(
        "checker_body_mirrored",
        PLANS,
        "return max(-dot(w, vertex) for vertex in part.vertices)",
        "return max(dot(w, vertex) for vertex in part.vertices)",
        (BAD,),
    ),
    Fault(
        "checker_root_rounded_down",
        PLANS,
        "    if root * root < square:\n        root += 1\n",
        "",
        (BAD,),
    ),
    Fault(
        "checker_tube_dropped",
        PLANS,
        "H = h * wider.denominator + wider.numerator",
        "H = h * wider.denominator",
        (BAD,),
    ),
    Fault(
        "checker_narrower_interval_at_a_knot",
        PLANS,
        "wider = max(before, after)",
        "wider = min(before, after)",
        (BAD,),
    ),
    Fault(
        "checker_last_knot_of_a_run_skipped",
        PLANS,
        "for s in range(first, first + len(errors) + 1):",
        "for s in range(first, first + len(errors)):",
        ("tests/checker/test_checker_answers.py::test_a_wall_between_knots_is_never_jumped",),
    ),
    Fault(
        "checker_runs_may_end_early",
        PLANS,
        'need(t == last + 1, f"the runs of obstacle {o} do not cover its steps")',
        'need(t <= last + 1, f"the runs of obstacle {o} do not cover its steps")',
        (BAD,),
    ),
    Fault(
        "checker_least_widths_on_a_border",
        PLANS,
        "interval, final = self.errors(bins, max)",
        "interval, final = self.errors(bins, min)",
        (BAD,),
    ),
    Fault(
        "checker_one_bin_on_a_border",
        QUESTION,
        "meets = edge[i] <= b and a <= edge[i + 1]",
        "meets = edge[i] <= b and a < edge[i + 1]",
        (BAD,),
    ),
    Fault(
        "checker_polytopes_closed_on_borders",
        PLANS,
        "(1, low, place > 0),",
        "(1, low, False),",
        (
            "tests/checker/test_checker_borders.py"
            "::test_faces_towards_other_bins_are_open_and_ends_of_the_domain_closed",
        ),
    ),
    Fault(
        "checker_start_set_ignored",
        PLANS,
        "for i, (a, b) in enumerate(self.start):",
        "for i, (a, b) in enumerate(()):",
        (
            "tests/checker/test_checker_checks.py"
            "::test_bad_certificates_are_rejected[p0 outside the start set]",
        ),
    ),
    Fault(
        "checker_constant_neurons_ignored",
        PLANS,
        "                inside = value >= 0\n",
        "                inside = True\n",
        ("tests/checker/test_checker_answers.py::test_constant_neurons_have_the_right_sign",),
    ),
    Fault(
        "checker_negative_multipliers",
        EXACT,
        'need(m >= 0, "a multiplier is negative")',
        'need(m >= -1000, "a multiplier is negative")',
        (BAD,),
    ),
    Fault(
        "checker_reads_through_floats",
        EXACT,
        "    return Fraction(text)\n",
        "    return Fraction(float(Fraction(text)))\n",
        ("tests/checker/test_checker_answers.py::test_decimals_are_not_floats",),
    ),
    Fault(
        "checker_domain_ignored",
        PLANS,
        'need(inside, "k is outside the domain")',
        'need(True, "k is outside the domain")',
        (BAD,),
    ),
    Fault(
        "checker_hashes_ignored",
        ANSWER,
        'need(answer["hash"] == hashes, "a hash does not match its content")',
        "",
        (BAD,),
    ),
    Fault(
        "checker_claim_about_another_tube",
        ANSWER,
        'need(claim["tube_hash"] == hashes["tube"], "the claim is about another tube")',
        "",
        (BAD,),
    ),
    Fault(
        "checker_processes_spend_apart",
        ENTRIES,
        "            context.spend(spent)",
        "            del spent",
        ("tests/checker/test_checker_entries.py::test_processes_share_one_allowance",),
    ),
    Fault(
        "checker_rejected_in_another_process_is_lost",
        ENTRIES,
        "    if rejections:",
        "    if answers[0][1]:",
        ("tests/checker/test_checker_entries.py::test_the_first_rejected_entry_is_told",),
    ),
    Fault(
        "checker_a_flat_axis_has_no_bin",
        QUESTION,
        'need(len(edge) >= 2, "an axis of the tube has no bin")',
        "",
        (BAD,),
    ),
    Fault(
        "checker_exceptions_pass",
        EXACT,
        '        raise Rejected(f"{where}malformed input, {kind}: {str(error)[:200]}") from error',
        "        del kind",
        (
            "tests/checker/test_checker_input.py"
            "::test_methods_of_the_context_raise_nothing_but_rejected",
        ),
    ),
    Fault(
        "checker_first_point_of_a_part_only",
        PLANS,
        "for i in part.points:",
        "for i in part.points[:1]:",
        (BAD,),
    ),
    Fault(
        "checker_first_part_only",
        PLANS,
        "for part, runs in zip(self.parts, by_part, strict=True):",
        "for part, runs in zip(self.parts[:1], by_part[:1], strict=True):",
        (BAD,),
    ),
    Fault(
        "checker_template_reaches_along_the_wrong_side",
        PLANS,
        "grow = [each.support(away) for each in errors]",
        "grow = [each.support(w) for each in errors]",
        (BAD,),
    ),
    Fault(
        "checker_template_with_negative_multipliers",
        ERRORS,
        "if own <= ahead:",
        "if own:",
        (BAD,),
    ),
    Fault(
        "checker_any_way_for_a_row_of_the_goal",
        ERRORS,
        "if v == w and all(m >= 0 for _, m in way):",
        "if all(m >= 0 for _, m in way):",
        (BAD,),
    ),
    Fault(
        "checker_no_room_for_p0",
        DOUBT,
        "condition.c * scale - lost,",
        "condition.c * scale,",
        (BAD,),
    ),
    Fault(
        "checker_doubt_at_the_middle_only",
        DOUBT,
        "in CellVertices(context).of(lo, hi):",
        "in CellVertices(context).of(k, k):",
        ("tests/checker/test_checker_doubt.py::test_a_box_fails_where_one_of_its_corners_does",),
    ),
    Fault(
        "no_plan_widest_widths",
        QUESTION,
        "return Several(sets, min)",
        "return Several(sets, max)",
        (BAD,),
    ),
    Fault(
        "no_plan_contact_outside_the_disc",
        HITS,
        "need(dot(point, point) <= part.radius**2,",
        "need(True or point,",
        (BAD,),
    ),
    Fault(
        "no_plan_error_outside_the_tube",
        HITS,
        'need(inside_tube, "the error of a contact is outside the tube")',
        "",
        (BAD,),
    ),
    Fault(
        "no_plan_vertices_forgotten",
        NO_PLAN,
        "if min(values) < 0 < max(values):",
        "if min(values) < -1e9 < max(values):",
        (
            "tests/checker/test_checker_cells.py"
            "::test_cells_tile_the_box_and_the_network_is_affine_on_each",
        ),
    ),
)
