"""Faults of what is claimed: runs, errors, counts, premises, tubes."""

from benchmarks.attacks.fault import Fault

MEASURED = (
    Fault(
        "last_record_of_an_interval_dropped",
        "rollout_errors",
        "most(size.interval, axis=1)",
        "most(size.interval[:, :-1], axis=1)",
        "tests/claim/test_measure.py::test_an_end_knot_counts_in_both_intervals",
    ),
    Fault(
        "failed_runs_without_error",
        "arrays.most",
        "(x), np.inf",
        "(x), 0.0",
        "tests/claim/test_measure.py::test_failed_runs_have_infinite_errors",
    ),
    Fault(
        "rounding_of_the_network_not_paid",
        "measure.allowance",
        "knots[:-1] +",
        "0 *",
        "tests/claim/test_measure.py::test_the_allowance_covers_the_rounding_of_the_network",
    ),
    Fault(
        "proofs_on_an_edge_use_the_narrower_bin",
        "widest_at",
        "max(axis=1), self.final[bins].max",
        "min(axis=1), self.final[bins].min",
        "tests/claim/test_tube.py::test_on_a_shared_edge_a_proof_allows_for_the_widest_bin",
    ),
)
COUNTS = (
    Fault(
        "one_run_more_discarded",
        "kept_maximum",
        "shape[-1] - 1",
        "shape[-1] - 2",
        (
            "tests/soundness/test_claims_coverage.py"
            "::test_wrong_claims_are_as_rare_as_the_theorem_says"
        ),
    ),
    Fault(
        "discards_cost_nothing",
        "wrong_claim_probability",
        "if discard == 0:",
        "if True:",
        "tests/claim/test_counts.py::test_discards_against_exact_rationals",
    ),
    Fault(
        "one_run_too_few",
        "required_runs",
        "return discard + bisect_left",
        "return discard - 1 + bisect_left",
        "tests/claim/test_counts.py::test_the_table_of_runs",
    ),
    Fault(
        "supported_eps_rounded_down",
        "supported_eps",
        "rounded_up(eps, 6)",
        "eps * (1 - 1e-5)",
        "tests/claim/test_counts.py::test_the_supported_eps_is_supported_and_nearly_the_smallest",
    ),
    Fault(
        "looks_do_not_split_delta",
        "calibrate.calibrate",
        ", delta / settings.looks, ",
        ", delta, ",
        "tests/claim/test_calibrate.py::test_discards_and_looks_cost_runs",
    ),
    Fault(
        "clopper_pearson_from_below",
        "clopper_pearson",
        "_rare_at(failures, n, delta)",
        "_rare_at(failures, n, 1 - delta)",
        "tests/claim/test_counts.py::test_the_bound_inverts_the_binomial_tail",
    ),
)
RUNS = (
    Fault(
        "k_and_disturbance_share_a_key",
        "row_keys",
        "jax.random.split(one)",
        "(one, one)",
        "tests/rollout/test_collect.py::test_k_and_disturbance_are_independent",
    ),
    Fault(
        "a_run_that_ended_its_process_has_another_chance",
        "Fleet.run",
        "if not self.again:",
        "if losses[place] == LOSSES:",
        "tests/rollout/test_fleet.py::test_a_lost_run_has_failed_and_no_other_is_begun_twice",
    ),
    Fault(
        "stored_runs_not_repeated",
        "require_same_runs",
        "not np.all(same)",
        "np.shape(same) is None",
        "tests/rollout/test_resume.py::test_stored_runs_are_simulated_again",
    ),
    Fault(
        "training_runs_in_the_holdout",
        "_check_unseen",
        "seen = np.isin(scores.ids, train.hashes())",
        "seen = np.zeros(scores.n, bool)",
        "tests/claim/test_fresh.py::test_copies_of_failed_runs_are_copies_too",
    ),
    Fault(
        "near_copies_of_training_runs",
        "_check_unseen",
        "width)[:, 0]] = True",
        "width)[:, 0]] = False",
        "tests/claim/test_fresh.py::test_copies_of_training_runs_are_found_beyond_float32",
    ),
    Fault(
        "headings_are_in_no_ledger",
        "invariances",
        "(MOVED,) if rotation is None else (MOVED, TURNED)",
        "(MOVED,)",
        (
            "tests/claim/test_start_gap.py"
            "::test_a_run_from_elsewhere_with_another_heading_is_off_twice_and_stays_inside"
        ),
    ),
    Fault(
        "uniform_is_believed_of_a_holdout",
        "check_fresh",
        'check_uniform("holdout", scores.k, scores.subject.domain, scores.groups, level=level)',
        "pass",
        "tests/claim/test_fresh.py::test_runs_that_are_said_to_be_uniform_are_looked_at",
    ),
    Fault(
        "windows_count_as_runs",
        "calibrate.calibrate",
        "by_group()",
        "score",
        "tests/claim/test_fresh.py::test_the_score_of_a_group_is_its_worst",
    ),
    Fault(
        "changed_plants_keep_their_program",
        "simulator",
        "known.is_current()",
        "True",
        (
            "tests/rollout/test_identity.py"
            "::test_a_claim_about_a_changed_plant_is_made_from_its_own_runs"
        ),
    ),
    Fault(
        "copies_in_the_holdout",
        "check_fresh",
        "len(ids) - len(np.unique(ids))",
        "0",
        "tests/claim/test_fresh.py::test_copies_of_failed_runs_are_copies_too",
    ),
)
CLAIMED = (
    Fault(
        "tube_rounded_inward",
        "scaled",
        "* half + more) * _OUTWARD, np.inf",
        "* half + more) / _OUTWARD, -np.inf",
        (
            "tests/properties/test_claims_properties.py"
            "::test_a_run_fits_the_tube_exactly_when_its_score_does"
        ),
    ),
    Fault(
        "time_between_records_forgotten",
        "scaled",
        "half + more",
        "half + 0 * more",
        "tests/claim/test_calibrate.py::test_time_between_records_is_declared_and_added",
    ),
    Fault(
        "start_gap_left_out_of_the_pipeline",
        "bound_errors",
        "allow_for_start(derived(claim, evidence=whole), start)",
        "derived(claim, evidence=whole)",
        "tests/claim/test_pipeline.py::test_the_start_is_declared_tried_and_added",
    ),
    Fault(
        "start_gap_larger_than_declared_accepted",
        "try_starts",
        "> declared",
        "> 1e9",
        (
            "tests/claim/test_start_gap.py"
            "::test_a_start_that_matters_more_than_declared_is_refused_with_its_size"
        ),
    ),
    Fault(
        "claims_survive_narrower_tubes",
        "weaker",
        "if not wider.at_least(claim.tube)",
        "if not wider.claimed.all()",
        "tests/claim/test_claim.py::test_a_claim_survives_a_wider_tube_only",
    ),
    Fault(
        "risk_of_a_point",
        "ErrorClaim.risk",
        ("if density is None:\n            return NoStatement"),
        (
            "if density is None:\n"
            "            return Risk(self.eps, self.eps)\n"
            "            return NoStatement"
        ),
        "tests/claim/test_claim.py::test_risk_of_a_set_a_density_and_a_point",
    ),
    Fault(
        "risk_of_a_set_without_its_share",
        "density_of_share",
        "return whole / exact",
        "return whole",
        "tests/claim/test_claim.py::test_risk_of_a_set_a_density_and_a_point",
    ),
    Fault(
        "assumed_tubes_promise",
        "ErrorClaim.risk",
        'assumed", "declared"',
        'declared",',
        "tests/claim/test_claim.py::test_assumed_is_printed_as_assumed_and_promises_nothing",
    ),
    Fault(
        "claim_hash_not_compared",
        "check_claim",
        "!= _hash(claim)",
        "== 0",
        "tests/claim/test_claim.py::test_every_part_is_bound_to_its_claim[tube]",
    ),
    Fault(
        "claim_hash_without_its_numbers",
        "_hash",
        "plain(facts)",
        "claim.network, claim.law.hash, claim.subject.identity",
        (
            "tests/claim/test_premises.py"
            "::test_what_differs_is_refused_in_memory_and_in_files_and_changes_the_sentence"
        ),
    ),
    Fault(
        "a_sum_of_a_claim_not_done_again",
        "claim_from_json",
        "        _check_sum(data, error_tube)\n",
        "",
        (
            "tests/claim/test_premises.py"
            "::test_numbers_that_do_not_follow_from_the_runs_are_not_loaded"
        ),
    ),
    Fault(
        "claim_about_more_k_than_were_run",
        "claim._check_law",
        "_corners(K) != (law.lo, law.hi)",
        "False",
        "tests/claim/test_claim.py::test_parts_that_do_not_fit_make_no_claim",
    ),
    Fault(
        "law_of_a_part_of_K_told_of_all",
        "claim.derived",
        "_corners(K) != _corners(claim.domain)",
        "False",
        "tests/robust/test_executions.py"
        "::test_a_claim_of_a_part_of_K_says_of_what_its_runs_were_drawn",
    ),
    Fault(
        "planner_takes_any_model",
        "Planner.__init__",
        "        check_model(model)\n",
        "",
        "tests/test_model.py::test_a_claim_with_a_part_from_elsewhere_makes_no_planner",
    ),
    Fault(
        "network_of_the_claim_not_compared",
        "check_network",
        "!= net.hash",
        "== net",
        "tests/test_model.py::test_a_tube_or_network_of_another_file_is_refused",
    ),
    Fault(
        "shares_of_k_for_logged_runs",
        "_chosen",
        'p["k"] == "uniform on K"',
        '"k" in p',
        "tests/claim/test_claim.py::test_a_share_of_K_is_promised_only_where_k_was_uniform",
    ),
    Fault(
        "monitor_does_not_see_what_is_outside",
        "measure.kept",
        "(len(k), -1).all",
        "(len(k), -1).any",
        "tests/claim/test_monitor.py::test_a_run_that_leaves_the_tube_between_knots_has_left",
    ),
    Fault(
        "faces_rounded_inward",
        "with_half",
        "whole = np.ceil",
        "whole = np.floor",
        "tests/claim/test_fitting.py::test_faces_along_the_axes_about_zero_are_a_box",
    ),
)
CARRIED = (
    Fault(
        "a_sampler_called_uniform_is_uniform",
        "collect.k_law",
        "return SAMPLER + with",
        'return "" + with',
        "tests/claim/test_carried.py::test_the_name_of_a_sampler_is_no_other_law",
    ),
    Fault(
        "a_law_of_a_table_is_its_text",
        "told_whole",
        "_is_exact(x) and len(text) <= _LONG",
        "True",
        "tests/claim/test_carried.py::test_laws_of_long_tables_are_compared_by_content",
    ),
    Fault(
        "failed_runs_of_a_seed_left_out",
        "check_fresh",
        "elif gaps := left_out(scores, train, between=True):",
        "elif gaps := 0:",
        "tests/claim/test_carried.py::test_failed_runs_are_not_left_out_in_silence",
    ),
    Fault(
        "runs_begun_twice_are_not_counted",
        "chunks.begin",
        "marker.tell() - 1",
        "0",
        "tests/claim/test_carried.py::test_runs_that_were_begun_twice_are_counted",
    ),
    Fault(
        "windows_of_one_file_are_told_apart",
        "fresh.freshness",
        "scores.groups is None or train.groups is None",
        "False",
        "tests/claim/test_carried.py::test_ungrouped_windows_of_one_file_are_assumed_to_be_of_two_recordings",
    ),
    Fault(
        "a_monitor_counts_a_run_twice",
        "monitor._with_new",
        "if again:",
        "if False:",
        "tests/claim/test_carried.py::test_a_monitor_counts_what_the_claim_counts_and_each_once",
    ),
    Fault(
        "copies_in_files_are_new_evidence",
        "fresh.used_by",
        "np.isin(ids, contents) | repeated(runs, by_k)",
        "np.isin(ids, contents)",
        "tests/claim/test_monitor.py"
        "::test_copies_in_files_of_runs_that_have_a_seed_are_no_new_evidence",
    ),
    Fault(
        "bounds_between_records_are_believed",
        "settings.check_between",
        "if over.any():",
        "if over.all():",
        "tests/claim/test_calibrate.py"
        "::test_a_bound_between_records_that_the_records_refute_is_refused",
    ),
    Fault(
        "an_update_from_calibration_runs",
        "monitor.require_new",
        'if (old := made != "").any():',
        'if (old := made == " ").any():',
        "tests/claim/test_carried.py::test_an_update_is_of_the_same_kind_and_of_new_runs",
    ),
    Fault(
        "kept_recordings_forget_their_losses",
        "fresh.identity_of",
        "(ids, runs.rows, lost, runs.groups)",
        "(ids, runs.rows, runs.groups)",
        "tests/local/test_recordings.py"
        "::test_kept_recordings_are_all_of_those_of_the_claim_as_they_were",
    ),
    Fault(
        "kept_recordings_forget_their_rows",
        "fresh.identity_of",
        "(ids, runs.rows, lost, runs.groups)",
        "(ids, lost, runs.groups)",
        "tests/local/test_recordings.py"
        "::test_kept_recordings_are_all_of_those_of_the_claim_as_they_were",
    ),
    Fault(
        "kept_recordings_forget_which_is_whose",
        "fresh.identity_of",
        "(ids, runs.rows, lost, runs.groups)",
        "(ids, runs.rows, lost)",
        "tests/local/test_recordings.py"
        "::test_kept_recordings_are_all_of_those_of_the_claim_as_they_were",
    ),
    Fault(
        "kept_recordings_forget_gaps_of_their_log",
        "fresh.identity_of",
        "[runs.law.hash, *map(str, joined_source([runs]))]",
        "[runs.law.hash]",
        "tests/local/test_recordings.py"
        "::test_kept_recordings_are_all_of_those_of_the_claim_as_they_were",
    ),
    Fault(
        "losses_that_an_executor_did_not_count",
        "Fleet.run",
        "losses[place] if type(sent.executor) in COUNTED else UNCOUNTED",
        "losses[place]",
        "tests/rollout/test_fleet.py::test_a_claim_says_how_many_runs_were_made_again",
    ),
    Fault(
        "numbers_of_an_assumption_of_another_count",
        "has_its_numbers",
        "known = [count] if type(count) is int else []",
        "known = told",
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "rows_left_out_are_any_number",
        "parc_jax.checker.claim",
        'COUNTED = ("WORKERS_LOST", "LEFT_OUT")',
        'COUNTED = ("WORKERS_LOST",)',
        "tests/checker/test_checker_checks.py::test_bad_certificates_are_rejected",
    ),
    Fault(
        "training_in_other_coordinates",
        "_check_unseen",
        '    scores.subject.agree(where, train.subject, ("K", *STATED))\n',
        "",
        "tests/claim/test_meetings.py::test_runs_that_meet_others_agree_or_say_it",
    ),
    Fault(
        "only_one_entry_is_compared",
        "premises.agree",
        "for name in dict.fromkeys([*one, *other]):",
        "for name in [*one][:1]:",
        "tests/claim/test_premises.py::test_two_records_that_meet_agree_in_every_entry",
    ),
    Fault(
        "a_monitor_bets_on_rows_that_never_came",
        "Monitor.closed",
        "state = state.bet(True)",
        "state = state.bet(False)",
        "tests/claim/test_monitor.py::test_rows_that_never_come_have_failed_where_somebody_says_so",
    ),
    Fault(
        "a_monitor_is_silent_of_missing_rows",
        "Monitor.details",
        'if "MISSING" in p:',
        "if False:",
        "tests/claim/test_monitor.py::test_each_premise_of_a_monitor_is_in_its_sentence",
    ),
    Fault(
        "a_loop_goes_on_with_what_another_proved",
        "Loop.restart",
        "if first not in (None, self._last):",
        "if False:",
        "tests/loop/test_log.py::test_a_manoeuvre_and_the_next_agree_on_all_that_they_share",
    ),
    Fault(
        "manoeuvres_of_two_loops_in_one_file",
        "require_whole",
        'agree(f"{where}: commitments of one loop", one.shared, other.shared)',
        "pass",
        "tests/loop/test_log.py::test_a_manoeuvre_and_the_next_agree_on_all_that_they_share",
    ),
)
FAULTS: tuple[Fault, ...] = (*MEASURED, *COUNTS, *RUNS, *CLAIMED, *CARRIED)
