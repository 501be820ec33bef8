"""Faults of the compiled query: what is looked at, what is taken, what is counted."""

from benchmarks.attacks.fault import Fault

FIRST = "parc_jax/safe_set/corridors/first.py"
JUDGED = ("tests/cover/test_first.py::test_every_plan_is_judged_as_all_plans_are",)
LOOP = "tests/loop/test_loop.py::"
THINKING = "tests/loop/test_thinking.py::"
PROVER = "tests/loop/test_prover.py::"
EPISODES = "tests/loop/test_episodes.py::"
MOVING = "tests/separation/test_moving.py::"
AWAY = ("tests/separation/test_pairs.py::test_boxes_tell_no_more_than_the_gap",)
COUNTED = (
    "tests/cover/test_first.py"
    "::test_plans_are_uniform_over_the_safe_set_and_their_counts_those_of_draws",
)

QUERY = (
    Fault(
        "only_the_nearest_box_is_looked_at",
        "verdict_in_turn.look",
        "away.at[o].set(jnp.inf)",
        "jnp.full_like(away, jnp.inf)",
        JUDGED,
    ),
    Fault(
        "boxes_of_obstacles_that_forget_errors",
        "Obstacles.away",
        "places[1:]) - under",
        "places[1:])",
        AWAY,
    ),
    Fault(
        "boxes_of_the_first_knots",
        "Obstacles.away",
        "jnp.maximum(places[:-1], places[1:])",
        "places[:-1]",
        AWAY,
    ),
    Fault(
        "boxes_of_obstacles_without_their_shape",
        "Obstacles.away",
        ", axis=1) - self.radius",
        ", axis=1)",
        AWAY,
    ),
    Fault(
        "always_the_same_obstacle",
        "Obstacles.only",
        "[o] for x",
        "[0] for x",
        (
            "tests/soundness/test_random_scenes.py"
            "::test_accepted_plans_are_free_and_clearly_free_plans_are_accepted",
        ),
    ),
    Fault(
        "plans_taken_unsafe",
        "_in_turn.judge",
        "seen.safe.astype(jnp.int32)",
        "1",
        JUDGED,
    ),
    Fault(
        "plans_after_the_last_one_are_counted",
        "_in_turn",
        "jnp.where(whole, len(drawn.k), last.astype(jnp.int32) + 1)",
        "jnp.int32(len(drawn.k))",
        COUNTED,
    ),
    Fault(
        "only_what_was_touched_last_is_looked_at",
        "verdict_in_turn.open_still",
        "(least(away) < nearest)",
        "(least(away) < nearest) & (nearest == _far(scene, seen.path))",
        (
            "tests/cover/test_preferred.py::test_a_plan_s_verdict_does_not_depend_on_those_before_it",
        ),
    ),
    Fault(
        "preferred_plans_without_room",
        "_preferred.unfinished",
        "clearance[found - 1] >= room",
        "clearance[found - 1] > 0",
        ("tests/cover/test_preferred.py::test_none_is_looked_at_after_the_first_that_has_room",),
    ),
    Fault(
        "as_many_looks_as_it_takes",
        "_preferred.unfinished",
        "& (looks < most_looks)",
        "",
        ("tests/cover/test_preferred.py::test_none_is_begun_after_so_many_looks",),
    ),
    Fault(
        "looks_of_each_call_alone",
        "Loop.step",
        "left = self.effort.looks - looks",
        "left = self.effort.looks",
        (LOOP + "test_after_so_many_looks_no_candidate_is_judged",),
    ),
    Fault(
        "preferred_in_one_of_the_bins_that_meet",
        "_preferred.room_of.in_bin",
        "bins[i, c]",
        "bins[i, 0]",
        (LOOP + "test_where_bins_meet_all_of_them_have_to_allow_it",),
    ),
    Fault(
        "a_loop_has_room_for_the_corners_of_boxes_alone",
        "sized.roomy",
        "corners + 4 if",
        "corners if",
        (LOOP + "test_nothing_compiles_after_the_first_step_whatever_is_around",),
    ),
    Fault(
        "preferred_plans_that_do_not_reach",
        "_preferred.judge",
        "(own > 0)",
        "(own > -1)",
        (LOOP + "test_the_best_liked_of_the_safe_ones_is_committed_to",),
    ),
    Fault(
        "commitments_after_the_deadline",
        "Loop.step",
        "> self.effort.deadline",
        "> 1e9",
        (LOOP + "test_who_is_late_commits_to_nothing",),
    ),
    Fault(
        "measured_values_outside_of_k",
        "Loop._all_of_k",
        "outside.any()",
        "False",
        (LOOP + "test_what_is_measured_wrongly_changes_nothing",),
    ),
    Fault(
        "proofs_that_nobody_needs",
        "Proving.proof",
        "not why, follows",
        "True, follows",
        (PROVER + "test_what_is_unsafe_is_rejected_and_what_jumps_is_told",),
    ),
    Fault(
        "robots_that_jump_in_an_episode",
        "Chain.add",
        "if before is None:",
        "if True:",
        (PROVER + "test_what_is_unsafe_is_rejected_and_what_jumps_is_told",),
    ),
    Fault(
        "loops_deaf_to_their_prover",
        "Loop.step",
        "if trouble:",
        "if False:",
        (PROVER + "test_a_loop_whose_prover_is_in_trouble_goes_on_with_the_stop_in_hand",),
    ),
    Fault(
        "commands_that_change_while_a_step_thinks",
        "UnderWay.command",
        "then <= end + SAME",
        "first <= end + SAME",
        (THINKING + "test_a_command_that_changes_while_a_step_thinks_is_refused",),
    ),
    Fault(
        "deadlines_beyond_the_time_to_think",
        "Loop._require_time_to_think",
        "self.effort.deadline <= seconds <=",
        "seconds <=",
        (THINKING + "test_what_makes_no_sense_is_told",),
    ),
    Fault(
        "time_between_measuring_and_asking",
        "Loop.step",
        "begin = min(begin, float(",
        "begin = max(begin, float(",
        (THINKING + "test_who_thinks_too_long_goes_on_with_the_stop_in_hand",),
    ),
    Fault(
        "poses_that_jump",
        "Loop._require_inside",
        "<= drift:\n            return",
        "<= 1e9:\n            return",
        (THINKING + "test_a_pose_outside_of_the_tube_begins_nothing",),
    ),
    Fault(
        "manoeuvres_that_never_rest",
        "require_rest",
        "if not beyond[i] <= ROUNDED:",
        "if False:",
        (LOOP + "test_a_model_that_does_not_rest_is_refused_and_what_it_moves_is_told",),
    ),
    Fault(
        "plans_kept_apart_without_their_errors",
        "near.scene_near_path",
        "Extent(lo, hi, error)",
        "Extent(lo, hi, 0 * error)",
        (LOOP + "test_a_certificate_names_directions_of_what_is_near_alone",),
    ),
    Fault(
        "clocks_that_stand_still",
        "Loop._time",
        "now <= last.begin",
        "False",
        (LOOP + "test_a_clock_that_does_not_go_forward_changes_nothing",),
    ),
    Fault(
        "tubes_that_were_left_do_not_count",
        "Driven.bad",
        " or self.left is True",
        "",
        (EPISODES + "test_every_bad_episode_is_counted_and_the_bound_is_that_of_the_count",),
    ),
    Fault(
        "looks_at_episodes_for_nothing",
        "episodes._look",
        "delta / len(declared)",
        "delta",
        (EPISODES + "test_looks_share_delta_and_others_are_refused",),
    ),
    Fault(
        "every_episode_from_one_seed",
        "episodes.task_of",
        "ravel()), number]",
        "ravel()), 0]",
        (EPISODES + "test_seeds_meet_nobody_elses",),
    ),
    Fault(
        "lines_that_a_killed_run_did_not_finish",
        "Ledger._open",
        "os.ftruncate(self._file, whole)",
        "whole",
        (EPISODES + "test_a_stopped_run_goes_on_and_counts_every_episode_once",),
    ),
    Fault(
        "episodes_of_another_drive_go_on",
        "episodes.drive_episodes",
        '"drive": lasting_digest(drive)',
        '"drive": ""',
        (EPISODES + "test_a_folder_of_other_episodes_is_refused",),
    ),
    Fault(
        "ends_of_another_number_of_points",
        "Scenes._end",
        "1, copies)",
        "1, 1)",
        (LOOP + "test_where_a_manoeuvre_may_end_holds_for_every_heading_of_the_doubt",),
    ),
    Fault(
        "loops_that_forget_the_doubt",
        "Scenes.seen",
        "doubt=doubt",
        "doubt=None",
        (LOOP + "test_more_doubt_never_goes_farther",),
    ),
    Fault(
        "loops_that_choose_what_is_measured",
        "given_axes",
        "if not set(model.given) <= set(axes):",
        "if False:",
        (LOOP + "test_what_is_measured_is_never_chosen",),
    ),
    Fault(
        "loops_silent_of_what_a_start_hides",
        "given_axes",
        "if others and",
        "if False and",
        (LOOP + "test_what_runs_did_not_measure_is_not_given_where_they_are_all_that_is_known",),
    ),
    Fault(
        "loops_blind_to_when_obstacles_exist",
        "Scenes.seen",
        "spans=spans",
        "spans=None",
        (LOOP + "test_what_moves_is_kept_away_from_until_the_rest",),
    ),
    Fault(
        "obstacles_that_never_stray",
        "moving._fastest",
        "return known + ",
        "return known + 0 * ",
        (MOVING + "test_a_velocity_that_is_off_by_a_bound_stays_inside_and_no_bound_is_wasted",),
    ),
    Fault(
        "obstacles_that_stray_until_the_interval_begins",
        "moving._farthest",
        "max(rate * t for t in ends)",
        "rate * ends[0]",
        (MOVING + "test_a_velocity_that_is_off_by_a_bound_stays_inside_and_no_bound_is_wasted",),
    ),
    Fault(
        "checker_silent_of_who_runs_into_a_robot_at_rest",
        "check_episode",
        'any("steps" in x',
        'any("step" in x',
        ("tests/loop/test_log.py::test_of_what_moves_nothing_is_said_while_the_robot_rests",),
    ),
)
