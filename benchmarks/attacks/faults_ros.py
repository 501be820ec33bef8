"""Faults of the pilot that is told messages of ROS."""

from benchmarks.attacks.fault import Fault

PILOTS = "tests/ros/test_pilot.py"
MOVERS = "tests/ros/test_movers.py"
ROS = (
    Fault(
        "pilot_in_any_frame",
        "require_frame",
        "if own != frame:",
        "if not own:",
        (f"{PILOTS}::test_what_cannot_be_meant_changes_nothing",),
    ),
    Fault(
        "pilot_that_stands_in_what_is_not_free",
        "Pilot._ways",
        "if not near.holds(",
        "if None is near.holds(",
        (f"{PILOTS}::test_a_body_that_does_not_lie_in_free_cells_commits_to_nothing",),
    ),
    Fault(
        "scan_from_where_the_robot_is_now",
        "Pilot._look",
        "there, (x, y, yaw) = way[1],",
        "there, (x, y, yaw) = poses[-1],",
        (f"{PILOTS}::test_a_scan_frees_what_it_sees_from_where_it_was_taken",),
    ),
    Fault(
        "sweeps_that_take_no_time",
        "measured.swept_in",
        "return round(each * max(n - 1, 0) * 1e9)",
        "return 0 * n",
        (
            "tests/ros/test_seeing.py"
            "::test_a_sweep_from_a_robot_that_drives_frees_nothing_where_a_post_stands",
        ),
    ),
    Fault(
        "scan_that_failed_saw_far",
        "seen_in",
        "np.where(told, ranges, 0.0)",
        "np.where(told, ranges, message.range_max)",
        (f"{PILOTS}::test_a_beam_that_says_nothing_frees_nothing",),
    ),
    Fault(
        "who_moves_stood_still_until_now",
        "movers.among",
        "+ d.mover_speed * age",
        "+ 0.0 * age",
        (f"{MOVERS}::test_outlines_hold_every_disc_wherever_it_goes_and_who_is_far_away_is_none",),
    ),
    Fault(
        "who_moves_stands_still_meanwhile",
        "movers.among",
        "off_by=d.mover_speed)",
        "off_by=0.0)",
        (f"{MOVERS}::test_outlines_hold_every_disc_wherever_it_goes_and_who_is_far_away_is_none",),
    ),
    Fault(
        "who_comes_near_during_a_manoeuvre_is_left_out",
        "movers.among",
        "d.reach + radius + d.mover_speed * time.t_f",
        "d.reach",
        (f"{MOVERS}::test_outlines_hold_every_disc_wherever_it_goes_and_who_is_far_away_is_none",),
    ),
    Fault(
        "nobody_said_who_moves_so_nobody_does",
        "Pilot._with_movers",
        'return "nobody has said yet where those are who move"',
        "return ways, None",
        (f"{MOVERS}::test_nothing_is_begun_before_all_are_told_or_where_they_may_be",),
    ),
)
