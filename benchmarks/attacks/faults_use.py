"""Faults of what a robot does with an answer: looks, tested plans, headers, maps, episodes."""

from benchmarks.attacks.fault import Fault

CHOSEN = (
    Fault(
        "looks_cost_nothing",
        "Looks.take",
        "delta / self.planned",
        "delta",
        (
            "tests/local/test_looks.py"
            "::test_delta_is_split_over_the_declared_looks_and_no_more_are_given"
        ),
    ),
    Fault(
        "a_file_forgets_its_looks",
        "_answer",
        'meta.get("looks")',
        "None",
        "tests/local/test_question.py::test_a_loaded_answer_goes_on_with_its_looks",
    ),
    Fault(
        "looks_share_their_runs",
        "fresh_key",
        "(look.number, *words)",
        "words",
        "tests/local/test_looks.py::test_streams_of_looks_meet_neither_each_other_nor_any_stage",
    ),
    Fault(
        "chosen_plan_may_touch",
        "trials.run_once",
        "~reached | touched",
        "~reached",
        "tests/local/test_choice.py::test_nan_and_contact_are_failures",
    ),
    Fault(
        "start_of_a_tested_plan_is_not_tried",
        "start_gap.trial_of",
        "try_starts(system, key, declared_gap(claim, GAP), claim.domain) if new else None",
        "None",
        "tests/local/test_validate.py"
        "::test_a_start_that_matters_is_seen_where_the_claim_did_not_look",
    ),
    Fault(
        "start_matters_only_to_the_tube",
        "start_gap.off_from_start",
        "len(invariances(claim.subject.rotation))",
        "0",
        "tests/local/test_validate.py::test_a_set_keeps_its_promise_where_the_start_matters",
    ),
    Fault(
        "runs_alike_taken_for_certainty",
        "Choice.test",
        "(failures, n, float(look.delta))",
        "(failures, n, float(look.delta)) * bool(failures)",
        "tests/local/test_choice.py::test_runs_that_are_alike_are_not_taken_for_certainty",
    ),
    Fault(
        "safe_box_not_asked_of_the_checker",
        "safe_box.safe_box",
        "proves_box(scene.problem, model, certificate)",
        "True",
        "tests/local/test_safe_box.py::test_only_what_the_checker_accepts_is_returned",
    ),
    Fault(
        "replay_keeps_contradictions_to_itself",
        "_refuse_contradictions",
        "bugs.any()",
        "bugs.all() and len(bugs) > 1",
        "tests/soundness/test_replays.py::test_a_proof_that_contradicts_the_plant_is_reported",
    ),
)
ROBOT = (
    Fault(
        "robots_that_jump_in_an_episode",
        "Chain.add",
        "if before is None:",
        "if True:",
        (
            "tests/checker/test_episode.py"
            "::test_the_next_one_begins_as_far_away_as_the_tube_allows_and_no_farther[0]"
        ),
    ),
    Fault(
        "obstacles_that_never_stray",
        "moving._fastest",
        "return known + ",
        "return known + 0 * ",
        (
            "tests/separation/test_moving.py"
            "::test_a_velocity_that_is_off_by_a_bound_stays_inside_and_no_bound_is_wasted"
        ),
    ),
    Fault(
        "spans_of_another_moment",
        "_require_now",
        "if span.at is None or not abs(span.at - float(at)) <= SAME:",
        "if span.at is None:",
        ("tests/loop/test_loop.py::test_what_moves_is_told_for_this_moment_and_these_intervals"),
    ),
    Fault(
        "what_was_left_is_reserved",
        "reserved.reserved",
        "if not commitment.under_way:",
        "if False:",
        (
            "tests/loop/test_reserved.py"
            "::test_what_a_robot_has_left_for_another_manoeuvre_reserves_nothing"
        ),
    ),
    Fault(
        "header_sees_one_end_of_an_interval",
        "parc_jax/drive/onboard/safe_set.h",
        "if (!(at_start > least && at_end > least))",
        "if (!(at_start > least))",
        "tests/onboard/test_header.py::test_a_header_says_what_python_says",
    ),
    Fault(
        "a_place_is_believed",
        "seen_from",
        "shrunk(star, moved + TOLERANCES.outline",
        "shrunk(star, TOLERANCES.outline",
        "tests/world/test_seen.py::test_each_of_the_bounds_is_needed",
    ),
    Fault(
        "unknown_cells_are_free",
        "problem.world.grid_map.occupancy_grid",
        "(cells >= 0) & (cells / 100 < FREE_THRESH)",
        "cells / 100 < FREE_THRESH",
        "tests/world/test_grid_map.py::test_99_may_be_declared_a_probability_and_255_is_unknown",
    ),
)
FAULTS: tuple[Fault, ...] = (*CHOSEN, *ROBOT)
