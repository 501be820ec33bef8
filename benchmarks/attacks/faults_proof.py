"""Faults of what proofs rest on: networks, sets of plans, certificates, uncertainty."""

from benchmarks.attacks.fault import Fault

NETWORK = (
    Fault(
        "accelerator_products_rounded",
        "common.arrays",
        "Precision.HIGHEST",
        "Precision.DEFAULT",
        "tests/verdict/test_pointwise.py::test_every_product_of_a_verdict_keeps_full_precision",
    ),
    Fault(
        "rounding_of_earlier_layers_forgotten",
        "rounding_bound",
        "error = (np.abs(W) @ error + gamma * absolute",
        "error = (gamma * absolute",
        "tests/network/test_rounding.py::test_errors_of_earlier_layers_are_carried_on",
    ),
    Fault(
        "lost_volume_accepted",
        "prove_complete",
        "= VOLUME_RELATIVE",
        "= 1",
        "tests/pwa/test_guards.py::test_missing_volume",
    ),
    Fault(
        "exact_zero_is_active",
        "sign_of",
        ("value > 0:\n        return"),
        ("value >= 0:\n        return"),
        "tests/pwa/test_degenerate.py::test_integer_weights_meet_everywhere",
    ),
    Fault(
        "emptiness_without_a_proof",
        "extent.chebyshev_center",
        "if bound > 0:",
        "if bound > -np.inf:",
        "tests/sets/test_questions.py::test_a_lying_solver_makes_no_box_too_small_and_no_set_empty",
    ),
)
SETS = (
    Fault(
        "corridor_at_the_first_knot_only",
        "corridor.satisfies",
        "range(len(path) - n + 1)",
        "range(1)",
        "tests/cover/test_corridors.py::test_who_keeps_is_found_as_by_hand",
    ),
    Fault(
        "corridor_without_the_tube",
        "Computed.of",
        "self.support[o, corridor] + lost",
        "self.support[o, corridor] + 0 * lost",
        "tests/cover/test_corridors.py::test_who_keeps_is_found_as_by_hand",
    ),
    Fault(
        "members_not_asked_for_the_goal",
        "safe_plans.members",
        "= e.reaches",
        "= np.ones(len(k), bool)",
        "tests/answer/test_answer.py::test_membership_needs_goal_and_start_too",
    ),
    Fault(
        "looks_share_no_error",
        "largest_share",
        "(1 - confidence) * 6 / (np.pi * part) ** 2",
        "1 - confidence",
        (
            "tests/cover/test_stopping.py"
            "::test_announced_looks_alone_satisfy_a_rule_and_it_pays_for_each"
        ),
    ),
    Fault(
        "volume_without_its_lower_bound",
        "Cover.safe_volume",
        "least_probability(self.safe, self.drawn, tail)",
        "self.safe / self.drawn",
        "tests/answer/test_numbers.py::test_the_volume_interval_is_clopper_pearson",
    ),
)
CERTIFICATES = (
    Fault(
        "refused_certificates_accepted",
        "_accepts",
        "return False",
        "return True",
        "tests/certificate/test_write.py::test_prove_keeps_what_holds_and_drops_what_does_not",
    ),
    Fault(
        "shortest_decimals",
        "decimal_text",
        'text = format(Decimal(values.item()), "f")',
        "text = repr(values.item())",
        "tests/certificate/test_write.py::test_numbers_are_spelled_exactly",
    ),
    Fault(
        "hashes_of_the_names_only",
        "canonical",
        'part, sort_keys=True, separators=(",", ":")',
        "sorted(part)",
        "tests/certificate/test_write.py::test_hashes_see_every_number",
    ),
    Fault(
        "answers_believed_unchecked",
        "load_answer",
        "report = check_answer(data)",
        'report = type("Unchecked", (), {"no_plan": None})',
        "tests/io/test_answer_file.py::test_a_file_whose_proof_fails_is_refused",
    ),
)
ABSENCE = (
    Fault(
        "no_plan_common_errors_of_the_widest_bin",
        "BinErrors.over",
        "[bins].min",
        "[bins].max",
        "tests/no_plan/test_bin_errors.py::test_common_errors_are_errors_of_every_bin",
    ),
    Fault(
        "no_plan_admits_what_one_point_may",
        "errors.holds",
        "zip(a, exact, strict=True)) <= b for a, b in rows)",
        "zip(a, exact, strict=True)) <= 1000 * b for a, b in rows)",
        (
            "tests/no_plan/test_contact_errors.py"
            "::test_every_error_that_is_tried_is_exactly_admitted"
        ),
    ),
)
UNCERTAINTY = (
    Fault(
        "start_uncertainty_forgotten_on_the_way",
        "moved_tube",
        "wide = given.interval + np.tile(start, given.n_points)",
        "wide = given.interval + 0 * np.tile(start, given.n_points)",
        (
            "tests/robust/test_question.py"
            "::test_the_boxes_of_doubt_of_the_plain_question_say_the_same"
        ),
    ),
    Fault(
        "kinks_forgotten",
        "bend.bend",
        "np.minimum(varies / 4, np.minimum(-below, above))",
        "0 * varies",
        "tests/robust/test_executions.py::test_what_a_mixture_misses_is_bounded",
    ),
    Fault(
        "a_triangle_that_cuts_the_arc",
        "turn_by",
        "math.ceil(a / (1 - b * b) / unit) * unit",
        "Fraction(1)",
        "tests/robust/test_pose.py::test_turns_are_mixtures_of_the_maps",
    ),
    Fault(
        "errors_do_not_turn",
        "widened",
        "widths + self.sine * widths[..., ::-1]",
        "widths",
        "tests/robust/test_pose.py::test_errors_turn_with_the_robot",
    ),
)
FAULTS: tuple[Fault, ...] = (*NETWORK, *SETS, *CERTIFICATES, *ABSENCE, *UNCERTAINTY)
