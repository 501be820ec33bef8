"""Faults of what few real runs are learned with: priors, their corrections, discards."""

from benchmarks.attacks.fault import Fault

IDENTIFY = "tests/prior/test_identify.py"
CORRECT = "tests/prior/test_correct.py"
TEACH = "tests/prior/test_teach.py"
ADVISED = "tests/claim/test_advised.py"
STUDY = "tests/study/test_from_prior.py"

PRIOR = (
    Fault(
        "recordings_are_torn_apart",
        "correct.folds",
        "runs.n) if runs.groups is None else runs.groups",
        "runs.n)",
        (f"{IDENTIFY}::test_groups_stay_whole_in_every_fold",),
    ),
    Fault(
        "residuals_are_always_believed",
        "learning.prior.correct.corrected",
        "chosen = best if",
        "chosen = best if True or",
        (f"{CORRECT}::test_noise_is_left_alone_and_that_is_said",),
    ),
    Fault(
        "errors_of_runs_that_were_seen",
        "learning.prior.correct.corrected",
        "errors[chosen], *typical",
        "truth - whole, *typical",
        (f"{CORRECT}::test_errors_are_those_of_runs_that_had_not_been_seen",),
    ),
    Fault(
        "a_failed_training_run_has_no_size",
        "learning.prior.teach.taught",
        "np.full(train.n, np.inf)",
        "np.zeros(train.n)",
        (f"{TEACH}::test_sizes_are_of_all_training_runs_and_failed_ones_have_none",),
    ),
    Fault(
        "discards_without_end",
        "counts.advised_discards",
        "discard > MOST_SHARE * n and",
        "False and",
        (f"{ADVISED}::test_never_more_than_their_share_but_for_failed_runs",),
    ),
    Fault(
        "discards_from_what_is_held_out",
        "learning.from_prior.learn_from",
        "_usual(own, train, held, asked)",
        "_usual(taught(prior, held, asked.rollouts, key), held, held, asked)",
        (f"{STUDY}::test_discards_are_of_the_training_runs_and_not_of_what_is_held_out",),
    ),
    Fault(
        "the_claim_is_of_the_prior_s_runs",
        "learning.from_prior.learn_from",
        "RecordedRuns(held), train,",
        "RecordedRuns(own.runs.replace(law=held.law)), train,",
        (f"{STUDY}::test_a_prior_that_is_wrong_costs_width_and_never_the_claim",),
    ),
)
