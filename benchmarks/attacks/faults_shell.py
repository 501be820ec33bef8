"""Faults of the shell: what is asked, told and refused."""

from benchmarks.attacks.fault import Fault

LOST = "tests/cli/test_nothing_lost.py"

SHELL = (
    Fault(
        "lines_twice_where_the_root_logger_has_a_handler",
        "logs.told",
        "logger.propagate = False",
        "logger.propagate = True",
        (
            "tests/cli/test_logs.py"
            "::test_nothing_is_told_twice_where_a_library_has_given_the_root_logger_a_handler",
        ),
    ),
    Fault(
        "temporary_left_behind",
        "files.write_atomic",
        "temporary.unlink(missing_ok=True)",
        "pass",
        (f"{LOST}::test_what_fails_to_be_written_leaves_nothing",),
    ),
    Fault(
        "questions_not_tried_before_the_runs",
        "job.run_study",
        "require_fit(problem, outline_of(system))",
        "pass",
        (f"{LOST}::test_a_question_that_does_not_fit_is_refused_before_the_first_run",),
    ),
    Fault(
        "eps_of_the_study_in_the_report",
        "report.report",
        "eps_of(outcome.answer.model.claim)",
        '"0.001"',
        (f"{LOST}::test_the_report_tells_the_eps_of_the_claim_in_hand",),
    ),
    Fault(
        "new_model_beside_an_older_answer",
        "job.run_study",
        'model.save(out / UNFINISHED / "model.npz")',
        'model.save(out / "model.npz")',
        (f"{LOST}::test_a_late_stop_leaves_the_older_study_whole_and_the_new_runs_where_they_are",),
    ),
    Fault(
        "nothing_shown_before_the_plan_is_driven",
        "job.run_study",
        "if early is not None",
        "if early is None",
        (f"{LOST}::test_all_but_the_driven_plan_is_there_before_it_is_run",),
    ),
    Fault(
        "runs_of_another_program_discarded_unasked",
        "unfinished.only_of",
        "_ask_to_discard(work, module.__name__)",
        "pass",
        (f"{LOST}::test_unfinished_runs_of_another_program_are_not_discarded_unasked",),
    ),
    Fault(
        "a_place_for_everybody",
        "lock._locked",
        "fcntl.LOCK_EX",
        "fcntl.LOCK_SH",
        (f"{LOST}::test_a_place_is_held_by_one_process_and_taken_over_from_a_dead_one",),
    ),
    Fault(
        "replay_of_another_robot",
        "replay._driven",
        "require_same(system, model)",
        "pass",
        ("tests/verdict/test_outline.py::test_a_replay_is_of_the_model_s_own_robot",),
    ),
    Fault(
        "another_law_is_the_same_robot",
        "outline.require_same",
        "_disturbances(law) != _disturbances(law_of(system))",
        "False",
        ("tests/verdict/test_outline.py::test_another_robot_is_refused_with_what_differs",),
    ),
    Fault(
        "half_of_a_complex_number",
        "arrays.real",
        'raise TypeError("complex numbers")',
        "return value.real",
        ("tests/cli/test_bad_logs.py::test_python_is_told_the_same",),
    ),
    Fault(
        "a_gap_that_is_no_number",
        "asked.check_gap",
        "if not 0 <= declared < math.inf:",
        "if declared < 0:",
        ("tests/cli/test_bad_logs.py::test_bad_logs_and_options_are_refused_in_one_sentence",),
    ),
    Fault(
        "stopped_and_carried_on",
        "cli.main",
        "code = STOPPED if interrupts.seen else code",
        "pass",
        ("tests/cli/test_stopping.py::test_what_a_library_swallows_is_not_carried_on_to_success",),
    ),
    Fault(
        "another_robot_filmed_as_this_one",
        "app.cli.plot._film",
        "require_same(black_box, answer.model)",
        "pass",
        ("tests/cli/test_plot.py::test_a_film_of_its_own_is_of_its_own_robot_alone",),
    ),
    Fault(
        "a_plan_run_by_another_robot",
        "choice.Choice.run",
        "require_same(system, self.model)",
        "pass",
        ("tests/local/test_choice.py::test_a_model_of_another_system_is_refused",),
    ),
)
