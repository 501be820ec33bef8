"""Faults of proofs that no plan exists, for bodies and errors of any shape."""

from benchmarks.attacks.fault import Fault

WRITTEN = "tests/certificate/test_write_points.py"
BAD = "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected"
IN_BINS = "tests/no_plan/test_bin_errors.py::"
TRIED = "tests/no_plan/test_contact_errors.py::"

PROVED = (
    Fault(
        "template_spelled_without_its_lower_faces",
        "templates._way",
        "int(share < 0)",
        "0",
        (f"{WRITTEN}::test_spelled_templates_reach_as_far_as_those_of_the_engine",),
    ),
    Fault(
        "directions_for_one_bin_of_an_edge",
        "sample_part",
        "each_bin(tube.edges, k[None])[1]",
        "each_bin(tube.edges, k[None])[1][:1]",
        (WRITTEN + "::test_the_whole_file_is_accepted",),
    ),
    Fault(
        "parts_exchanged_in_certificates",
        "separation_part",
        "return [spelled[first : first + n] for first in range(0, len(spelled), n)]",
        "return [spelled[first : first + n][::-1] for first in range(0, len(spelled), n)]",
        (f"{WRITTEN}::test_safe_plans_are_accepted_and_their_parts_are_not_exchanged",),
    ),
    Fault(
        "checker_errors_of_the_first_point",
        "Context._beyond",
        "each[i] for each in errors",
        "each[0] for each in errors",
        (BAD,),
    ),
    Fault(
        "checker_other_points_stay_at_their_offsets",
        "along_p0",
        "return [sum(row[axis : self.n_c : self.n_p]) for axis in range(self.n_p)]",
        "return row[: self.n_p]",
        (BAD,),
    ),
    Fault(
        "checker_places_of_the_first_point",
        "Question.offset",
        "n_points + i",
        "n_points",
        (BAD,),
    ),
    Fault(
        "checker_an_error_of_some_bin",
        "Several.contains",
        "return all(each.contains(x) for each in self.sets)",
        "return any(each.contains(x) for each in self.sets)",
        (
            "tests/checker/test_checker_errors.py"
            "::test_several_bins_reach_as_far_as_the_farthest_or_as_all",
        ),
    ),
    Fault(
        "no_plan_negative_shares_of_a_mixture",
        "check_weights",
        'need(all(v >= 0 for v in weights), "a weight of a contact is negative")',
        "",
        (BAD,),
    ),
    Fault(
        "no_plan_shares_of_less_than_one",
        "check_weights",
        'need(sum(weights) == 1, "the weights of a contact do not sum to one")',
        "",
        (BAD,),
    ),
    Fault(
        "no_plan_error_of_a_goal_row_outside_the_tube",
        "missed_goal",
        'need(final.contains(error), "the error of a goal row is outside the tube")',
        "",
        (BAD,),
    ),
)

ALLOWED = (
    Fault(
        "no_plan_common_errors_of_the_widest_bin",
        "OfTemplates.over",
        "[bins].min",
        "[bins].max",
        (IN_BINS + "test_common_errors_are_errors_of_every_bin",),
    ),
    Fault(
        "no_plan_least_widths_of_the_first_bin",
        "OfBoxes.over",
        ".min(axis=0)",
        "[0]",
        (IN_BINS + "test_common_errors_are_errors_of_every_bin",),
    ),
    Fault(
        "no_plan_boxes_around_faces",
        "OfTemplates.__init__",
        "interval.inner_box",
        "interval.box",
        (IN_BINS + "test_common_errors_are_errors_of_every_bin",),
    ),
    Fault(
        "no_plan_end_without_the_last_interval",
        "end_rows",
        "(n_points):\n        for a",
        "(0):\n        for a",
        ("tests/no_plan/test_no_plan_of_parts.py::test_ends_keep_to_the_last_interval_too",),
    ),
    Fault(
        "no_plan_corners_not_pulled_in",
        "BetweenFaces.__init__",
        "+ INSIDE *",
        "- INSIDE *",
        (TRIED + "test_every_error_that_is_tried_is_exactly_admitted",),
    ),
    Fault(
        "no_plan_admits_what_one_point_may",
        "contact_errors.holds",
        "zip(a, exact, strict=True)) <= b for a, b in rows)",
        "zip(a, exact, strict=True)) <= 1000 * b for a, b in rows)",
        (TRIED + "test_every_error_that_is_tried_is_exactly_admitted",),
    ),
    Fault(
        "faces_inner_box_of_the_half_widths",
        "inner_box",
        "np.maximum(finite - np.abs(self.centre), 0)",
        "finite",
        ("tests/claim/test_faces.py::test_the_inner_box_lies_inside_and_touches",),
    ),
    Fault(
        "faces_that_leave_out_the_model",
        "fitting._between",
        "np.minimum(least, 0.0)",
        "least + 0.0",
        ("tests/claim/test_fitting.py::test_no_error_at_all_is_between_the_faces",),
    ),
)

NO_PLANS = (*PROVED, *ALLOWED)
