"""Faults of what runs are worth: which are seen, fresh, uniform, of this robot and this start."""

from benchmarks.attacks.fault import Fault

FRESH = "tests/claim/test_fresh.py"
START = "tests/claim/test_start_gap.py"
UNIFORM = "tests/rollout/test_uniform.py"
FIRST = "tests/study/test_first_model.py"
IDENTITY = "tests/rollout/test_identity.py"

RUNS = (
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
        "loaders.recorded",
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
        "first_claim_of_the_fresh_runs",
        "learn.first_model",
        "key=stream(runs.key, Stage.FIRST), ",
        "",
        (f"{FIRST}::test_the_first_claim_takes_nothing_from_the_one_to_come",),
    ),
    Fault(
        "bins_cut_by_further_runs",
        "pipeline.learn_profiles",
        "first or None",
        "None",
        (f"{FIRST}::test_the_first_claim_takes_nothing_from_the_one_to_come",),
    ),
    Fault(
        "cuts_one_place_off",
        "edges._cut_at_each",
        "before[places - 1]",
        "before[places]",
        ("tests/claim/test_edges.py::test_cuts_are_those_found_one_by_one",),
    ),
    Fault(
        "bins_smoothed_over_sets",
        "edges.smoothed",
        "maxima.max(axis=axes, keepdims=True)",
        "maxima.max(keepdims=True)",
        ("tests/claim/test_edges.py::test_sets_of_bins_are_smoothed_apart",),
    ),
)
