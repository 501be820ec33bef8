"""Faults of the robot that episodes drive, its lidar and its worlds."""

from benchmarks.attacks.fault import Fault

JACKAL = "tests/sims/test_jackal.py"
PHYSICS = "tests/sims/test_jackal_physics.py"
LIDAR = "tests/sims/test_lidar.py"
BARN = "tests/sims/test_barn.py"
DRIVE = "tests/sims/test_barn_drive.py"
YARD = "tests/sims/test_tractor_yard.py"
CROWD = "tests/sims/test_crowd.py"
ENTRIES = "tests/sims/test_entrywise.py"
DRIFT = "tests/sims/test_drift_parts.py"

ROBOT = (
    Fault(
        "what_is_behind_is_not_seen",
        "lidar._pairs",
        "[lo, lo - turn]",
        "[lo, lo]",
        (f"{LIDAR}::test_ranges_are_those_of_plain_loops",),
    ),
    Fault(
        "noise_on_what_was_not_hit",
        "lidar.Lidar.scan",
        "np.where(ranges < self.max_range, moved, ranges)",
        "moved",
        (f"{LIDAR}::test_noise_is_bounded_as_declared_and_only_on_what_was_hit",),
    ),
    Fault(
        "rectangles_shrink",
        "rectangles.placed",
        "CELL * b0], axis=1) - GROW",
        "CELL * b0], axis=1) + GROW",
        (f"{BARN}::test_rectangles_hold_every_cylinder_and_no_free_cell",),
    ),
    Fault(
        "a_rectangle_over_free_cells",
        "rectangles._best",
        "occupied[a0:a1].all(axis=0)",
        "occupied[a0:a1].any(axis=0)",
        (f"{BARN}::test_rectangles_hold_every_cylinder_and_no_free_cell",),
    ),
    Fault(
        "the_map_leaves_a_rectangle_out",
        "sight.Mapped.__init__",
        "for row in sides)",
        "for row in sides[1:])",
        (f"{BARN}::test_the_map_has_every_cylinder_and_nothing_stands_where_it_is_free",),
    ),
    Fault(
        "what_the_map_calls_free_is_all_of_the_field",
        "sight.Mapped.__init__",
        "FreeSpace(field.difference(shapely.union_all(cells)))",
        "FreeSpace(field)",
        (f"{BARN}::test_the_map_has_every_cylinder_and_nothing_stands_where_it_is_free",),
    ),
    Fault(
        "a_map_is_driven_on_odometry",
        "series.drive_worlds",
        "if options.map and options.odometry:",
        "if False:",
        (f"{DRIVE}::test_a_map_is_refused_to_a_robot_that_does_not_know_where_it_is",),
    ),
    Fault(
        "what_is_remembered_does_not_drift",
        "sight.Seen._drift",
        "self._before = here, speeds",
        "self._before = None",
        (f"{DRIVE}::test_on_odometry_the_robot_goes_on_too_and_drifts_no_more_than_allowed",),
    ),
    Fault(
        "a_robot_that_drives_is_taken_for_one_that_stands",
        "drift.allowed",
        "if stood:",
        "if True:",
        (f"{JACKAL}::test_a_cycle_adds_little_to_what_dead_reckoning_is_off_by",),
    ),
    Fault(
        "an_ellipse_of_errors_is_taken_for_its_box",
        "drift.Allowed.holds",
        "<= 1)",
        "<= 1.4)",
        (f"{JACKAL}::test_an_error_of_dead_reckoning_is_allowed_within_an_ellipse",),
    ),
    Fault(
        "who_goes_back_is_not_measured_to",
        "sims/jackal/system.py",
        "lo = [-backward - slower,",
        "lo = [-slower,",
        (f"{JACKAL}::test_measured_speeds_stay_in_the_domain",),
    ),
    Fault(
        "wheels_that_turn_are_taken_for_wheels_that_stand",
        "driven.Driven._reckon",
        "c.STANDS).all()",
        "100.0).all()",
        (f"{JACKAL}::test_while_its_wheels_stand_odometry_does_too",),
    ),
    Fault(
        "a_command_is_held_for_ever",
        "driven.Driven.drive",
        "self._left > 0",
        "self._left > -9999",
        (f"{JACKAL}::test_without_a_new_plan_it_stops_by_itself",),
    ),
    Fault(
        "a_start_that_misses_its_speeds",
        "before.running",
        "robots.push(robots.missed)",
        "robots.missed",
        (f"{JACKAL}::test_it_starts_with_the_speeds_that_are_measured",),
    ),
    Fault(
        "ramps_go_on_where_the_controller_was",
        "before.running",
        "robots.begin(measured)",
        "robots",
        (f"{JACKAL}::test_it_starts_with_the_speeds_that_are_measured",),
    ),
    Fault(
        "wheels_grip_as_mujoco_likes",
        "robots.model",
        "return mujoco.MjModel.from_xml_path(str(XML))",
        'return mujoco.MjModel.from_xml_string(XML.read_text().replace("0.03", "1"))',
        (f"{PHYSICS}::test_it_turns_in_place_as_the_balance_of_moments_demands",),
    ),
    Fault(
        "encoders_see_slip",
        "robots.Robots.encoders",
        "/ self.factor",
        "/ 1.0",
        (f"{JACKAL}::test_encoders_do_not_see_slip",),
    ),
    Fault(
        "tractors_that_do_not_stop",
        "sims/tractor/yard.py",
        "ks[:, 3] * held",
        "ks[:, 3]",
        (f"{YARD}::test_it_rests_at_the_end_and_stays",),
    ),
    Fault(
        "bumps_along_the_axes_of_the_world",
        "sims/tractor/yard.py",
        "turned(rough, qpos[:, 2])",
        "rough",
        (f"{YARD}::test_a_run_is_told_from_its_pose_wherever_that_is",),
    ),
    Fault(
        "discs_that_are_faster_than_is_said",
        "sims/jackal/crowd.py",
        "speed = FASTEST * np.sqrt",
        "speed = 2 * FASTEST * np.sqrt",
        (f"{CROWD}::test_nobody_is_faster_than_is_declared_or_leaves_the_field",),
    ),
    Fault(
        "contacts_under_way_taken_for_those_at_rest",
        "sims/jackal/crowd.py",
        "moves = last <= t_f + 1e-9",
        "moves = last <= 0.3",
        (f"{CROWD}::test_contacts_under_way_and_at_rest_are_told_apart",),
    ),
    Fault(
        "nothing_less_a_number_is_the_number",
        "sims/entrywise.py",
        "return x if _is(y, 0) else x - y",
        "return x if _is(y, 0) else y if _is(x, 0) else x - y",
        (f"{ENTRIES}::test_a_program_of_all_kinds_of_steps_is_the_same",),
    ),
    Fault(
        "known_zeros_are_multiplied",
        "sims/entrywise.py",
        "if _is(x, 0) or _is(y, 0):\n        return 0.0",
        "if False:\n        return 0.0",
        (f"{ENTRIES}::test_what_is_known_to_be_zero_or_one_costs_nothing",),
    ),
    Fault(
        "what_is_read_often_is_rounded",
        "sims/drift_parking/trig.py",
        "x / (1.0 + 0.0 * x)",
        "x / (1.0 + 1e-13 * x)",
        (f"{DRIFT}::test_what_several_read_is_the_same_bits",),
    ),
)
