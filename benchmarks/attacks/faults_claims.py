"""Faults of what is claimed of the error: claims, their files and updates, risks, tubes between
faces.
"""

from benchmarks.attacks.fault import Fault

CALIBRATE = "tests/claim/test_calibrate.py"
FRESH = "tests/claim/test_fresh.py"
START = "tests/claim/test_start_gap.py"
UNIFORM = "tests/rollout/test_uniform.py"
IDENTITY = "tests/rollout/test_identity.py"
CLAIM = "tests/claim/test_claim.py"
FACES = "tests/claim/test_faces.py"
FITTING = "tests/claim/test_fitting.py"

CLAIMED = (
    Fault(
        "training_runs_in_the_holdout",
        "_check_unseen",
        "seen = np.isin(scores.ids, train.hashes())",
        "seen = np.zeros(scores.n, bool)",
        (f"{FRESH}::test_copies_of_failed_runs_are_copies_too",),
    ),
    Fault(
        "near_copies_of_training_runs",
        "_check_unseen",
        "_width(scores))[:, 0]] = True",
        "_width(scores))[:, 0]] = False",
        (f"{FRESH}::test_copies_of_training_runs_are_found_beyond_float32",),
    ),
    Fault(
        "one_gap_pays_for_place_and_heading",
        "allow_for_start",
        "= len(entries) * trial",
        "= trial",
        (f"{START}::test_a_run_from_elsewhere_with_another_heading_is_off_twice_and_stays_inside",),
    ),
    Fault(
        "headings_are_in_no_ledger",
        "invariances",
        "(MOVED,) if rotation is None else (MOVED, TURNED)",
        "(MOVED,)",
        (f"{START}::test_a_run_from_elsewhere_with_another_heading_is_off_twice_and_stays_inside",),
    ),
    Fault(
        "a_hidden_start_is_in_no_ledger",
        "hidden_start",
        "if names else ()",
        "if not names else ()",
        ("tests/claim/test_hidden_start.py::test_a_claim_lists_it_and_keeps_it_in_files",),
    ),
    Fault(
        "chains_are_left_outside_of_k",
        "begun",
        "inside(measured, len(chain.leaves)) & chain.leaves",
        "np.broadcast_to(chain.leaves, measured.shape[:2])",
        (
            "tests/rollout/test_chained.py"
            "::test_what_is_measured_may_leave_k_and_come_back_but_not_for_good",
        ),
    ),
    Fault(
        "chains_forget_what_they_left_behind",
        "Simulator._begun",
        ", last.states)",
        ")",
        ("tests/rollout/test_chained.py::test_a_run_is_the_last_of_its_chain",),
    ),
    Fault(
        "chains_are_called_uniform",
        "rows.k_law",
        "isinstance(system, Chained)",
        "False",
        ("tests/rollout/test_chained.py::test_a_run_is_the_last_of_its_chain",),
    ),
    Fault(
        "replays_choose_what_was_measured",
        "Executions.whole",
        "np.tile(self.lo,",
        "np.tile(0 * self.lo,",
        ("tests/claim/test_hidden_start.py::test_plans_are_replayed_from_what_was_measured",),
    ),
    Fault(
        "what_is_measured_is_left_open",
        "require_given",
        "if axis not in said",
        "if axis in said",
        ("tests/claim/test_hidden_start.py::test_a_question_says_what_is_measured_or_is_refused",),
    ),
    Fault(
        "headings_are_not_tried",
        "try_starts",
        "try_headings(system, key, declared)",
        "None",
        (f"{START}::test_headings_are_tried_with_the_starts",),
    ),
    Fault(
        "uniform_is_believed_of_a_file",
        "_assemble",
        '= "uniform',
        '= "',
        (f"{UNIFORM}::test_a_log_that_is_not_uniform_is_refused_with_the_figure",),
    ),
    Fault(
        "uniform_is_believed_of_a_holdout",
        "fresh._check_recorded",
        'check_uniform("holdout", scores.k, _domain(scores), scores.groups)',
        "pass",
        (f"{FRESH}::test_runs_that_are_said_to_be_uniform_are_looked_at",),
    ),
    Fault(
        "windows_are_taken_as_independent_draws",
        "check_uniform",
        "np.sort(np.unique(groups, return_index=True)[1])",
        ":",
        (f"{UNIFORM}::test_only_recordings_are_taken_as_independent",),
    ),
    Fault(
        "empty_corners_are_not_seen",
        "check_uniform",
        ", _corners",
        "",
        (f"{UNIFORM}::test_a_log_that_is_not_uniform_is_refused_with_the_figure",),
    ),
    Fault(
        "windows_count_as_runs",
        "calibrate.calibrate",
        "by_group()",
        "score",
        (
            f"{FRESH}::test_the_score_of_a_group_is_its_worst",
            f"{FRESH}::test_a_claim_from_groups_is_not_too_good",
        ),
    ),
    Fault(
        "recordings_torn_apart",
        "RolloutBatch.split",
        "(self.n) if self.groups is None else self.groups",
        "(self.n)",
        ("tests/rollout/test_batch.py::test_a_split_never_tears_a_group",),
    ),
    Fault(
        "changed_plants_keep_their_program",
        "simulator",
        "known.is_current()",
        "True",
        (f"{IDENTITY}::test_a_claim_about_a_changed_plant_is_made_from_its_own_runs",),
    ),
    Fault(
        "copies_in_the_holdout",
        "check_fresh",
        "len(scores.ids) - len(np.unique(scores.ids))",
        "0",
        (f"{FRESH}::test_copies_of_failed_runs_are_copies_too",),
    ),
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
        "search_may_narrow_the_tube",
        "enlarge",
        "np.maximum(had, found)",
        "np.minimum(had, found)",
        ("tests/claim/test_bad_runs.py::test_the_tube_is_widened_only_where_something_was_found",),
    ),
    Fault(
        "search_compiles_the_rollout_again",
        "Simulator.run",
        "device or self._device",
        "device",
        ("tests/claim/test_bad_runs.py::test_the_search_runs_the_program_of_all_other_runs",),
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
        ", claim.subject.identity",
        "",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[time grid]",),
    ),
    Fault(
        "claim_hash_without_its_law",
        "_hash",
        "law.hash, claim.",
        "",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[law]",),
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
        "inside_tube",
        "(batch.points, batch.time)",
        "False and (batch.points, batch.time)",
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
        (f"{CALIBRATE}::test_more_runs_than_asked_for_support_a_smaller_eps",),
    ),
    Fault(
        "shares_of_k_for_logged_runs",
        "_chosen",
        'k_law == "uniform"',
        "k_law",
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
        "maximum(np.asarray(most) - centre, centre - np.asarray(least))",
        "asarray(most) - centre",
        (f"{FITTING}::test_a_score_is_the_definition",),
    ),
    Fault(
        "failed_runs_between_faces",
        "measure._along",
        "failed = jnp.isnan(middle + pad)",
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
