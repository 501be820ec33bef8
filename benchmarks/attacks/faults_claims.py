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
        "parc_jax/claim/fresh.py",
        "seen = np.isin(scores.ids, train.hashes())",
        "seen = np.zeros(scores.n, bool)",
        (f"{FRESH}::test_copies_of_failed_runs_are_copies_too",),
    ),
    Fault(
        "near_copies_of_training_runs",
        "parc_jax/claim/fresh.py",
        "_width(scores))[:, 0]] = True",
        "_width(scores))[:, 0]] = False",
        (f"{FRESH}::test_copies_of_training_runs_are_found_beyond_float32",),
    ),
    Fault(
        "one_gap_pays_for_place_and_heading",
        "parc_jax/claim/start_gap.py",
        "off = len(entries) * trial.declared",
        "off = trial.declared",
        (f"{START}::test_a_run_from_elsewhere_with_another_heading_is_off_twice_and_stays_inside",),
    ),
    Fault(
        "headings_are_in_no_ledger",
        "parc_jax/claim/start_gap.py",
        "(MOVED,) if rotation is None else (MOVED, TURNED)",
        "(MOVED,)",
        (f"{START}::test_a_run_from_elsewhere_with_another_heading_is_off_twice_and_stays_inside",),
    ),
    Fault(
        "headings_are_not_tried",
        "parc_jax/claim/start_gap.py",
        "turned = try_headings(system, key, declared)",
        "turned = None",
        (f"{START}::test_headings_are_tried_with_the_starts",),
    ),
    Fault(
        "uniform_is_believed_of_a_file",
        "parc_jax/rollout/loaders.py",
        'if k_law == "uniform":\n        check_uniform',
        'if k_law == "":\n        check_uniform',
        (f"{UNIFORM}::test_a_log_that_is_not_uniform_is_refused_with_the_figure",),
    ),
    Fault(
        "uniform_is_believed_of_a_holdout",
        "parc_jax/claim/fresh.py",
        'check_uniform("holdout", scores.k, _domain(scores), scores.groups)',
        "pass",
        (f"{FRESH}::test_runs_that_are_said_to_be_uniform_are_looked_at",),
    ),
    Fault(
        "windows_are_taken_as_independent_draws",
        "parc_jax/rollout/uniform.py",
        "        drawn = drawn[np.sort(np.unique(groups, return_index=True)[1])]",
        "        drawn = drawn[:]",
        (f"{UNIFORM}::test_only_recordings_are_taken_as_independent",),
    ),
    Fault(
        "empty_corners_are_not_seen",
        "parc_jax/rollout/uniform.py",
        "for look in (_ranges, _pairs, _corners)]",
        "for look in (_ranges, _pairs)]",
        (f"{UNIFORM}::test_a_log_that_is_not_uniform_is_refused_with_the_figure",),
    ),
    Fault(
        "windows_count_as_runs",
        "parc_jax/claim/calibrate.py",
        "independent = scores.by_group()",
        "independent = scores.score",
        (
            f"{FRESH}::test_the_score_of_a_group_is_its_worst",
            f"{FRESH}::test_a_claim_from_groups_is_not_too_good",
        ),
    ),
    Fault(
        "recordings_torn_apart",
        "parc_jax/rollout/batch.py",
        "own = np.arange(self.n) if self.groups is None else self.groups",
        "own = np.arange(self.n)",
        ("tests/rollout/test_batch.py::test_a_split_never_tears_a_group",),
    ),
    Fault(
        "changed_plants_keep_their_program",
        "parc_jax/rollout/simulate.py",
        "if known.is_current():",
        "if True:",
        (f"{IDENTITY}::test_a_claim_about_a_changed_plant_is_made_from_its_own_runs",),
    ),
    Fault(
        "copies_in_the_holdout",
        "parc_jax/claim/fresh.py",
        "repeated = len(scores.ids) - len(np.unique(scores.ids))",
        "repeated = 0",
        (f"{FRESH}::test_copies_of_failed_runs_are_copies_too",),
    ),
    Fault(
        "tube_rounded_inward",
        "parc_jax/claim/calibrate.py",
        "+ more) * _OUTWARD, np.inf)",
        "+ more) / _OUTWARD, -np.inf)",
        (
            "tests/properties/test_claims_properties.py"
            "::test_a_run_fits_the_tube_exactly_when_its_score_does",
        ),
    ),
    Fault(
        "time_between_records_forgotten",
        "parc_jax/claim/calibrate.py",
        "* half + more) *",
        "* half + 0 * more) *",
        (f"{CALIBRATE}::test_time_between_records_is_declared_and_added",),
    ),
    Fault(
        "half_of_the_speed_between_records",
        "parc_jax/claim/intersample.py",
        "self.v, n_p, n_points) * (0.5 * h)",
        "self.v, n_p, n_points) * (0.25 * h)",
        (f"{CALIBRATE}::test_time_between_records_is_declared_and_added",),
    ),
    Fault(
        "acceleration_between_records_over_sixteen",
        "parc_jax/claim/intersample.py",
        "(h * h / 8)",
        "(h * h / 16)",
        (f"{CALIBRATE}::test_time_between_records_is_declared_and_added",),
    ),
    Fault(
        "start_gap_named_and_not_added",
        "parc_jax/claim/start_gap.py",
        "np.nextafter(half + more, np.inf)",
        "np.nextafter(half, np.inf)",
        (
            "tests/claim/test_start_gap.py"
            "::test_the_tube_holds_runs_from_elsewhere_and_without_the_allowance_it_does_not",
        ),
    ),
    Fault(
        "start_gap_left_out_of_the_pipeline",
        "parc_jax/claim/pipeline.py",
        "out.append([allow_for_start(claim, start) for claim in claims])",
        "out.append(claims)",
        ("tests/claim/test_pipeline.py::test_the_start_is_declared_tried_and_added",),
    ),
    Fault(
        "start_gap_larger_than_declared_accepted",
        "parc_jax/claim/start_gap.py",
        "    if seen > declared:",
        "    if seen > 1e9:",
        (
            "tests/claim/test_start_gap.py"
            "::test_a_start_that_matters_more_than_declared_is_refused_with_its_size",
        ),
    ),
    Fault(
        "search_may_narrow_the_tube",
        "parc_jax/claim/search.py",
        "np.maximum(had, found)",
        "np.minimum(had, found)",
        ("tests/claim/test_search.py::test_the_tube_is_widened_only_where_something_was_found",),
    ),
    Fault(
        "claims_survive_narrower_tubes",
        "parc_jax/claim/claim.py",
        "if not wider.at_least(claim.tube):",
        "if not wider.claimed.all():",
        (f"{CLAIM}::test_a_claim_survives_a_wider_tube_only",),
    ),
    Fault(
        "risk_of_a_point",
        "parc_jax/claim/claim.py",
        "        if isinstance(nu, Point):\n            return NoStatement(",
        "        if isinstance(nu, Point):\n            return Risk(self.eps, self.eps)\n"
        "            return NoStatement(",
        (f"{CLAIM}::test_risk_of_a_set_a_density_and_a_point",),
    ),
    Fault(
        "risk_of_a_set_without_its_share",
        "parc_jax/claim/risk.py",
        "return whole / share",
        "return whole",
        (f"{CLAIM}::test_risk_of_a_set_a_density_and_a_point",),
    ),
    Fault(
        "assumed_tubes_promise",
        "parc_jax/claim/claim.py",
        'if self.kind in ("assumed", "declared"):',
        'if self.kind in ("declared",):',
        (f"{CLAIM}::test_assumed_is_printed_as_assumed_and_promises_nothing",),
    ),
    Fault(
        "claim_hash_not_compared",
        "parc_jax/claim/claim.py",
        "claim.hash != _hash(claim)",
        "claim.hash == 0",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[tube]",),
    ),
    Fault(
        "claim_hash_without_its_subject",
        "parc_jax/claim/claim.py",
        "claim.law.hash, claim.subject.identity]",
        "claim.law.hash]",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[time grid]",),
    ),
    Fault(
        "claim_hash_without_its_law",
        "parc_jax/claim/claim.py",
        "claim.law.hash, claim.subject.identity]",
        "claim.subject.identity]",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[law]",),
    ),
    Fault(
        "points_in_any_order",
        "parc_jax/rollout/subject.py",
        '"points": list(self.points),',
        '"points": sorted(self.points),',
        (f"{CLAIM}::test_the_order_of_points_and_every_word_of_rotation_count",),
    ),
    Fault(
        "claim_read_unchecked",
        "parc_jax/claim/claim_file.py",
        "check_claim(claim)",
        "claim",
        (f"{CLAIM}::test_every_part_is_bound_to_its_claim[K]",),
    ),
    Fault(
        "claim_about_more_k_than_were_run",
        "parc_jax/claim/claim.py",
        "if (law.lo, law.hi) != ",
        "if False and (law.lo, law.hi) != ",
        (f"{CLAIM}::test_parts_that_do_not_fit_make_no_claim",),
    ),
    Fault(
        "tube_over_another_k",
        "parc_jax/claim/claim.py",
        "    check_edges(claim.tube, about.domain)\n",
        "",
        (f"{CLAIM}::test_parts_that_do_not_fit_make_no_claim",),
    ),
    Fault(
        "profile_over_another_k",
        "parc_jax/claim/score.py",
        "    check_edges(profile, domain)\n",
        "",
        (
            "tests/claim/test_pipeline.py"
            "::test_a_profile_over_another_k_is_refused_before_the_first_run",
        ),
    ),
    Fault(
        "planner_takes_any_model",
        "parc_jax/planner.py",
        "        check_model(model)\n",
        "",
        ("tests/test_model.py::test_a_claim_with_a_part_from_elsewhere_makes_no_planner",),
    ),
    Fault(
        "runs_of_another_time_grid_watched",
        "parc_jax/claim/monitor.py",
        "if (batch.points, batch.time) != ",
        "if False and (batch.points, batch.time) != ",
        ("tests/claim/test_monitor.py::test_runs_and_networks_of_others_are_not_watched",),
    ),
    Fault(
        "header_of_any_model",
        "parc_jax/onboard/header.py",
        "    check_model(answer.model)\n",
        "",
        ("tests/onboard/test_header.py::test_a_model_with_a_part_from_elsewhere_gets_no_header",),
    ),
    Fault(
        "network_of_the_claim_not_compared",
        "parc_jax/claim/claim.py",
        "if claim.network != net.hash:",
        "if claim.network == net:",
        ("tests/test_model.py::test_a_tube_or_network_of_another_file_is_refused",),
    ),
    Fault(
        "declared_tubes_read_as_shown",
        "parc_jax/claim/claim.py",
        'if self.kind in ("assumed", "declared"):',
        'if self.kind == "assumed":',
        (
            "tests/claim/test_declared.py"
            "::test_a_bound_from_elsewhere_gives_its_reason_and_no_probability",
        ),
    ),
    Fault(
        "a_smaller_eps_without_the_runs_for_it",
        "parc_jax/claim/calibrate.py",
        "    return supported, discard\n",
        "    return supported / 2, discard\n",
        (f"{CALIBRATE}::test_more_runs_than_asked_for_support_a_smaller_eps",),
    ),
    Fault(
        "shares_of_k_for_logged_runs",
        "parc_jax/claim/statement.py",
        'if c.law.k_law == "uniform":',
        "if c.law.k_law:",
        (f"{CLAIM}::test_a_share_of_K_is_promised_only_where_k_was_uniform",),
    ),
    Fault(
        "alarm_that_stops",
        "parc_jax/claim/monitor.py",
        "return bool(self.peak >= 1.0 / self.alpha)",
        "return bool(self.e_value >= 1.0 / self.alpha)",
        ("tests/claim/test_monitor.py::test_an_alarm_does_not_stop",),
    ),
    Fault(
        "monitor_does_not_see_what_is_outside",
        "parc_jax/claim/monitor.py",
        "fits &= (size <= half[bins]).reshape(len(rows), -1).all(axis=1)",
        "fits &= (size <= half[bins]).reshape(len(rows), -1).any(axis=1)",
        ("tests/claim/test_monitor.py::test_a_run_that_leaves_the_tube_between_knots_has_left",),
    ),
    Fault(
        "an_update_looks_at_its_holdout",
        "parc_jax/claim/update.py",
        "        train=seen,\n",
        "",
        ("tests/claim/test_monitor.py::test_new_data_gives_a_new_claim",),
    ),
)

FITTED = (
    Fault(
        "faces_scored_on_one_side",
        "parc_jax/claim/score.py",
        "np.maximum(np.asarray(most) - centre, centre - np.asarray(least))",
        "np.asarray(most) - centre",
        (f"{FITTING}::test_a_score_is_the_definition",),
    ),
    Fault(
        "failed_runs_between_faces",
        "parc_jax/claim/measure.py",
        "failed = jnp.isnan(middle + pad)",
        "failed = jnp.zeros_like(middle, bool)",
        (f"{FITTING}::test_a_failed_run_takes_the_claim",),
    ),
    Fault(
        "box_around_faces_without_their_centre",
        "parc_jax/claim/faces.py",
        "np.nextafter(centre + half, np.inf)",
        "np.nextafter(half, np.inf)",
        (f"{FACES}::test_the_box_holds_the_set_and_no_box_of_its_axes_is_smaller",),
    ),
    Fault(
        "half_around_with_signs",
        "parc_jax/claim/faces.py",
        "(np.abs(self.directions[..., n:, :])",
        "((self.directions[..., n:, :])",
        (f"{FACES}::test_the_reach_is_the_largest_over_the_corners_of_a_box",),
    ),
    Fault(
        "faces_rounded_inward",
        "parc_jax/claim/faces.py",
        "whole = np.ceil(",
        "whole = np.floor(",
        (f"{FITTING}::test_faces_along_the_axes_about_zero_are_a_box",),
    ),
    Fault(
        "claims_survive_moved_faces",
        "parc_jax/claim/tube.py",
        'for name in ("directions", "centre")',
        'for name in ("directions",)',
        (f"{FITTING}::test_a_claim_survives_wider_faces_only",),
    ),
    Fault(
        "boxes_of_a_file_that_are_not_around_its_faces",
        "parc_jax/claim/tube_file.py",
        "if replace(fitted, templates=None).hash != boxes.hash:",
        "if False:",
        (f"{FITTING}::test_a_tube_of_faces_travels",),
    ),
)

CLAIMS = (*CLAIMED, *FITTED)
