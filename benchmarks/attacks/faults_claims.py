"""Faults of what is claimed of the error: claims, their files and updates, risks, tubes between
faces.
"""

from benchmarks.attacks.fault import Fault

CALIBRATE = "tests/claim/test_calibrate.py"
PREMISES = "tests/claim/test_premises.py"
CLAIM = "tests/claim/test_claim.py"
FACES = "tests/claim/test_faces.py"
FITTING = "tests/claim/test_fitting.py"

CLAIMED = (
    Fault(
        "tube_rounded_inward",
        "scaled",
        "+ more) * _OUTWARD, np.inf)",
        "+ more) / _OUTWARD, -np.inf)",
        (
            "tests/properties/test_claims_properties.py"
            "::test_a_run_fits_the_tube_exactly_when_its_score_does",
        ),
    ),
    Fault(
        "time_between_records_forgotten",
        "scaled",
        "half + more",
        "half + 0 * more",
        (f"{CALIBRATE}::test_time_between_records_is_declared_and_added",),
    ),
    Fault(
        "half_of_the_speed_between_records",
        "SpeedBound.term",
        "self.v, n_p, n_points) * (0.5 * h)",
        "self.v, n_p, n_points) * (0.25 * h)",
        (f"{CALIBRATE}::test_time_between_records_is_declared_and_added",),
    ),
    Fault(
        "acceleration_between_records_over_sixteen",
        "AccelerationBound.term",
        "(h * h / 8)",
        "(h * h / 16)",
        (f"{CALIBRATE}::test_time_between_records_is_declared_and_added",),
    ),
    Fault(
        "start_gap_named_and_not_added",
        "allow_for_start",
        "half + more,",
        "half,",
        (
            "tests/claim/test_start_gap.py"
            "::test_the_tube_holds_runs_from_elsewhere_and_without_the_allowance_it_does_not",
        ),
    ),
    Fault(
        "start_gap_left_out_of_the_pipeline",
        "bound_errors",
        "[allow_for_start(claim, start) for claim in claims]",
        "claims",
        ("tests/claim/test_pipeline.py::test_the_start_is_declared_tried_and_added",),
    ),
    Fault(
        "start_gap_larger_than_declared_accepted",
        "try_starts",
        "> declared",
        "> 1e9",
        (
            "tests/claim/test_start_gap.py"
            "::test_a_start_that_matters_more_than_declared_is_refused_with_its_size",
        ),
    ),
    Fault(
        "claims_survive_narrower_tubes",
        "weaker",
        "if not wider.at_least(claim.tube)",
        "if not wider.claimed.all()",
        (f"{CLAIM}::test_a_claim_survives_a_wider_tube_only",),
    ),
    Fault(
        "risk_of_a_point",
        "ErrorClaim.risk",
        "if density is None:\n            return NoStatement",
        "if density is None:\n            return Risk(self.eps, self.eps)\n"
        "            return NoStatement",
        (f"{CLAIM}::test_risk_of_a_set_a_density_and_a_point",),
    ),
    Fault(
        "risk_of_a_set_without_its_share",
        "density_of_share",
        "return whole / share",
        "return whole",
        (f"{CLAIM}::test_risk_of_a_set_a_density_and_a_point",),
    ),
    Fault(
        "assumed_tubes_promise",
        "ErrorClaim.risk",
        'assumed", "declared"',
        'declared",',
        (f"{CLAIM}::test_assumed_is_printed_as_assumed_and_promises_nothing",),
    ),
    Fault(
        "claim_hash_not_compared",
        "check_claim",
        "!= _hash(claim)",
        "== 0",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[tube]",),
    ),
    Fault(
        "claim_hash_without_its_subject",
        "_hash",
        "claim.subject.identity",
        "None",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[time grid]",),
    ),
    Fault(
        "claim_hash_without_its_numbers",
        "_hash",
        "plain(facts)",
        "claim.network, claim.law.hash, claim.subject.identity",
        (
            f"{PREMISES}::test_what_differs_is_refused_in_memory_and_in_files_and_changes_the_sentence",
        ),
    ),
    Fault(
        "a_sum_of_a_claim_not_done_again",
        "claim_from_json",
        "        _check_sum(data, error_tube.n_bins)\n",
        "",
        (f"{PREMISES}::test_numbers_that_do_not_follow_from_the_runs_are_not_loaded",),
    ),
    Fault(
        "premises_that_differ_agree",
        "agree",
        "elif values[0] != values[1]:",
        "elif None not in values and values[0] != values[1]:",
        (f"{PREMISES}::test_two_records_that_meet_agree_in_every_entry",),
    ),
    Fault(
        "recordings_known_within_a_file_alone",
        "_check_unseen",
        "not (named or _one_log",
        "not (True or _one_log",
        ("tests/claim/test_fresh.py::test_recordings_are_known_by_name_whatever_the_file",),
    ),
    Fault(
        "k_of_the_runs_that_show_the_claim",
        "refitted",
        "box(train.k.min(axis=0), train.k.max(axis=0))",
        "train.domain",
        ("tests/claim/test_fresh.py::test_runs_that_show_a_claim_have_no_part_in_its_K",),
    ),
    Fault(
        "points_in_any_order",
        "Subject.identity",
        'points": list(self.points)',
        'points": sorted(self.points)',
        (f"{CLAIM}::test_the_order_of_points_and_every_word_of_rotation_count",),
    ),
    Fault(
        "claim_read_unchecked",
        "claim_from_json",
        "check_claim(claim)",
        "claim",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[K]",),
    ),
    Fault(
        "claim_about_more_k_than_were_run",
        "error_claim",
        "(law.lo, law.hi)",
        "False and (law.lo, law.hi)",
        (f"{CLAIM}::test_parts_that_do_not_fit_make_no_claim",),
    ),
    Fault(
        "tube_over_another_k",
        "_check_parts",
        "    check_edges(claim.tube, about.domain)\n",
        "",
        (f"{CLAIM}::test_parts_that_do_not_fit_make_no_claim",),
    ),
    Fault(
        "profile_over_another_k",
        "check_profile",
        "    check_edges(profile, domain)\n",
        "",
        (
            "tests/claim/test_pipeline.py"
            "::test_a_profile_over_another_k_is_refused_before_the_first_run",
        ),
    ),
    Fault(
        "planner_takes_any_model",
        "Planner.__init__",
        "        check_model(model)\n",
        "",
        ("tests/test_model.py::test_a_claim_with_a_part_from_elsewhere_makes_no_planner",),
    ),
    Fault(
        "runs_of_another_time_grid_watched",
        "_require_same_robot",
        'free = {"K"}',
        'free = {"K", "time"}',
        ("tests/claim/test_monitor.py::test_runs_and_networks_of_others_are_not_watched",),
    ),
    Fault(
        "header_of_any_model",
        "write_c",
        "    check_model(answer.model)\n",
        "",
        ("tests/onboard/test_header.py::test_a_model_with_a_part_from_elsewhere_gets_no_header",),
    ),
    Fault(
        "network_of_the_claim_not_compared",
        "check_network",
        "!= net.hash",
        "== net",
        ("tests/test_model.py::test_a_tube_or_network_of_another_file_is_refused",),
    ),
    Fault(
        "declared_tubes_read_as_shown",
        "ErrorClaim.risk",
        'in ("assumed", "declared")',
        '== "assumed"',
        (
            "tests/claim/test_declared.py"
            "::test_a_bound_from_elsewhere_gives_its_reason_and_no_probability",
        ),
    ),
    Fault(
        "a_smaller_eps_without_the_runs_for_it",
        "pac_label",
        "return supported, discard",
        "return supported / 2, discard",
        (
            f"{CALIBRATE}::test_more_runs_than_asked_for_leave_some_outside_or_support_a_smaller_eps",
        ),
    ),
    Fault(
        "shares_of_k_for_logged_runs",
        "_chosen",
        'p["k"] == "uniform on K"',
        '"k" in p',
        (f"{CLAIM}::test_a_share_of_K_is_promised_only_where_k_was_uniform",),
    ),
    Fault(
        "alarm_that_stops",
        "alarm",
        "peak >= 1.",
        "e_value >= 1.",
        ("tests/claim/test_monitor.py::test_an_alarm_does_not_stop",),
    ),
    Fault(
        "monitor_does_not_see_what_is_outside",
        "inside_tube.inside",
        "(len(rows), -1).all",
        "(len(rows), -1).any",
        ("tests/claim/test_monitor.py::test_a_run_that_leaves_the_tube_between_knots_has_left",),
    ),
    Fault(
        "an_update_looks_at_its_holdout",
        "update.update",
        "train=seen, ",
        "",
        ("tests/claim/test_monitor.py::test_new_data_gives_a_new_claim",),
    ),
)

FITTED = (
    Fault(
        "faces_scored_on_one_side",
        "score.sizes",
        "np.maximum(most - centre, centre - least)",
        "(most - centre)",
        (f"{FITTING}::test_a_score_is_the_definition",),
    ),
    Fault(
        "failed_runs_between_faces",
        "measure._along",
        "failed = ~jnp.isfinite(middle + pad)",
        "failed = jnp.zeros_like(middle, bool)",
        (f"{FITTING}::test_a_failed_run_takes_the_claim",),
    ),
    Fault(
        "box_around_faces_without_their_centre",
        "Faces.box",
        "centre + half",
        "half",
        (f"{FACES}::test_the_box_holds_the_set_and_no_box_of_its_axes_is_smaller",),
    ),
    Fault(
        "half_around_with_signs",
        "half_around",
        "(np.abs(self.directions[..., n:, :])",
        "((self.directions[..., n:, :])",
        (f"{FACES}::test_the_reach_is_the_largest_over_the_corners_of_a_box",),
    ),
    Fault(
        "faces_rounded_inward",
        "with_half",
        "whole = np.ceil",
        "whole = np.floor",
        (f"{FITTING}::test_faces_along_the_axes_about_zero_are_a_box",),
    ),
    Fault(
        "claims_survive_moved_faces",
        "at_least",
        ', "centre"',
        ",",
        (f"{FITTING}::test_a_claim_survives_wider_faces_only",),
    ),
    Fault(
        "boxes_of_a_file_that_are_not_around_its_faces",
        "tube_from_arrays",
        "replace(fitted, templates=None).hash != boxes.hash",
        "False",
        (f"{FITTING}::test_a_tube_of_faces_travels",),
    ),
)

CLAIMS = (*CLAIMED, *FITTED)
