"""Faults of what is measured of the error: runs, scores, bins, the counting of runs."""

from benchmarks.attacks.fault import Fault

CALIBRATE = "tests/claim/test_calibrate.py"
COUNTS = "tests/claim/test_counts.py"
MEASURE = "tests/claim/test_measure.py"
COVERAGE = "tests/soundness/test_claims_coverage.py"
RARE = f"{COVERAGE}::test_wrong_claims_are_as_rare_as_the_theorem_says"

MEASURED = (
    Fault(
        "last_record_of_an_interval_dropped",
        "rollout_errors",
        "most(size.interval, axis=1)",
        "most(size.interval[:, :-1], axis=1)",
        (f"{MEASURE}::test_an_end_knot_counts_in_both_intervals",),
    ),
    Fault(
        "errors_at_knots_only",
        "rollout_errors",
        "most(size.interval, axis=1)",
        "most(size.interval[:, np.array([0, -1])], axis=1)",
        (f"{MEASURE}::test_an_error_between_knots_is_seen",),
    ),
    Fault(
        "failed_runs_without_error",
        "arrays.most",
        "(x), np.inf",
        "(x), 0.0",
        (f"{MEASURE}::test_failed_runs_have_infinite_errors",),
    ),
    Fault(
        "goal_state_not_measured",
        "_signed",
        ", q - q_hat",
        ", 0 * (q - q_hat)",
        (f"{MEASURE}::test_an_error_in_the_goal_state_alone_is_seen",),
    ),
    Fault(
        "signed_errors",
        "rollout_errors",
        "jnp.abs(e)",
        "e",
        (f"{MEASURE}::test_errors_are_the_definition",),
    ),
    Fault(
        "rounding_of_the_network_not_paid",
        "measure.allowance",
        "knots[:-1] +",
        "0 *",
        (f"{MEASURE}::test_the_allowance_covers_the_rounding_of_the_network",),
    ),
    Fault(
        "float32_storage_not_paid",
        "_signed",
        "= _FLOAT32_UNIT if p.dtype == jnp.float32 else 0",
        "= 0",
        (f"{MEASURE}::test_float32_storage_is_paid_for",),
    ),
    Fault(
        "runs_on_an_edge_keep_to_the_wider_bin",
        "score_arrays",
        "np.maximum",
        "np.minimum",
        ("tests/claim/test_fitting.py::test_a_run_on_a_shared_edge_must_fit_both_bins",),
    ),
    Fault(
        "proofs_on_an_edge_use_the_narrower_bin",
        "widest_at",
        "max(axis=1), self.final[bins].max",
        "min(axis=1), self.final[bins].min",
        ("tests/claim/test_tube.py::test_on_a_shared_edge_a_proof_allows_for_the_widest_bin",),
    ),
    Fault(
        "an_edge_belongs_to_one_bin",
        "closed_bins",
        "[right] if (left == right).all() else [right, left]",
        "[right]",
        (
            "tests/claim/test_bins.py"
            "::test_a_parameter_on_a_shared_edge_belongs_to_every_bin_it_touches",
        ),
    ),
    Fault(
        "score_of_the_intervals_only",
        "ratios",
        "zip(needed, profile.halves, strict=True)",
        "list(zip(needed, profile.halves, strict=True))[:1]",
        (f"{COVERAGE}::test_errors_that_hide_in_one_place_are_held",),
    ),
    Fault(
        "mean_score_of_a_run",
        "score_arrays",
        "ratio.max(axis=1)",
        "ratio.mean(axis=1)",
        (f"{CALIBRATE}::test_the_tube_holds_every_run_it_was_sized_by",),
    ),
)

COUNTED = (
    Fault(
        "one_run_more_discarded",
        "kept_maximum",
        "shape[-1] - 1",
        "shape[-1] - 2",
        (RARE,),
    ),
    Fault(
        "half_a_run_is_discarded",
        "check_count",
        "or not isinstance(value, Integral) ",
        "",
        (f"{CALIBRATE}::test_a_number_of_discards_is_a_number",),
    ),
    Fault(
        "failed_runs_counted_as_recordings",
        "evidence_of",
        "by_group()",
        "score",
        ("tests/claim/test_fresh.py::test_recordings_fail_not_runs",),
    ),
    Fault(
        "recordings_called_runs",
        "ErrorClaim.unit",
        "return RECORDINGS if RECORDED_ROWS in self.evidence else RUNS",
        "return RUNS",
        (
            "tests/claim/test_fresh.py::test_recordings_fail_not_runs",
            "tests/claim/test_fresh.py::test_the_score_of_a_group_is_its_worst",
        ),
    ),
    Fault(
        "discards_cost_nothing",
        "wrong_claim_probability",
        "if discard == 0:",
        "if True:",
        (f"{COUNTS}::test_discards_against_exact_rationals",),
    ),
    Fault(
        "tail_of_a_million_runs_rounded_too_little",
        "wrong_claim_probability",
        "_TAIL_OUTWARD",
        "_OUTWARD",
        ("tests/checker/test_checker_claim.py::test_the_tail_of_a_million_runs_is_rounded_up",),
    ),
    Fault(
        "eps_and_delta_swapped",
        "required_runs",
        "> delta) + 1",
        "> eps) + 1",
        (f"{COUNTS}::test_the_table_of_runs",),
    ),
    Fault(
        "one_run_too_few",
        "required_runs",
        "> delta) + 1",
        "> delta)",
        (f"{COUNTS}::test_the_table_of_runs",),
    ),
    Fault(
        "supported_eps_rounded_down",
        "_round_up",
        "ceil(eps / unit + 1e-9)",
        "floor(eps / unit)",
        (f"{COUNTS}::test_the_supported_eps_is_supported_and_nearly_the_smallest",),
    ),
    Fault(
        "looks_do_not_split_delta",
        "calibrate.calibrate",
        ", delta / asked.looks, ",
        ", delta, ",
        (f"{CALIBRATE}::test_discards_and_looks_cost_runs",),
    ),
    Fault(
        "networks_do_not_split_delta",
        "bound_errors",
        "looks * len(nets) * len(asked.claims)",
        "looks",
        ("tests/claim/test_pipeline.py::test_networks_and_claims_about_the_same_runs_split_delta",),
    ),
    Fault(
        "bins_do_not_split_delta",
        "calibrate_bins",
        "(n_blocks * asked.looks)",
        "asked.looks",
        (f"{CALIBRATE}::test_per_bin_claims_need_runs_in_every_bin",),
    ),
    Fault(
        "a_block_read_as_if_it_were_one_bin",
        "block_shares",
        "[whole[number] for number in block]",
        "bin_shares(profile)",
        (f"{CALIBRATE}::test_a_block_of_bins_has_one_claim_and_one_number",),
    ),
    Fault(
        "bins_with_few_runs_get_a_claim",
        "by_bin._shown",
        "wanted > allowed",
        "not len(score)",
        (f"{CALIBRATE}::test_per_bin_claims_need_runs_in_every_bin",),
    ),
    Fault(
        "clopper_pearson_from_below",
        "clopper_pearson",
        "betainccinv(failures + 1, n - failures, delta)",
        "betainccinv(failures + 1, n - failures, 1 - delta)",
        ("tests/claim/test_counts.py::test_the_bound_inverts_the_binomial_tail",),
    ),
    Fault(
        "lower_bounds_of_the_other_side",
        "least_probability",
        "return float(1 - clopper_pearson(n - successes, n, delta))",
        "return float(clopper_pearson(successes, n, delta))",
        ("tests/claim/test_counts.py::test_one_bound_on_a_probability_serves_everybody",),
    ),
)

MEASUREMENTS = (*MEASURED, *COUNTED)
