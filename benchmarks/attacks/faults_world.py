"""Faults of what stands around the robot: what was seen, what is free, maps."""

from benchmarks.attacks.fault import Fault

PIECES = "tests/world/test_pieces.py"
SEEN = "tests/world/test_seen.py"
GRID = "tests/world/test_grid_map.py"
FILE = "tests/world/test_map_file.py"
SPACE = "tests/world/test_free_space.py"

WORLD = (
    Fault(
        "a_triangle_may_be_missing",
        "problem.world.pieces._triangles",
        "!= whole - sum(holes)",
        "> whole - sum(holes)",
        (f"{PIECES}::test_a_triangle_that_is_lost_is_noticed",),
    ),
    Fault(
        "the_nearer_of_two_beams_alone",
        "seen._between",
        "near * np.maximum(np.cos(half) - np.sin(half), 0.0)",
        "near * 1.0",
        (f"{SEEN}::test_nothing_stands_where_all_was_seen_free",),
    ),
    Fault(
        "objects_may_hide_in_wide_gaps",
        "seen._between",
        "width / (np.sqrt(8)",
        "1e3 * width / (np.sqrt(8)",
        (f"{SEEN}::test_nothing_stands_where_all_was_seen_free",),
    ),
    Fault(
        "beams_point_where_they_say",
        "seen._between",
        "gaps / 2 + angle_error",
        "gaps / 2",
        (f"{SEEN}::test_between_beams_that_spread_more_room_may_hide_a_disc",),
    ),
    Fault(
        "a_heading_is_believed",
        "seen_from",
        "_off(angles, angle_error + turned)",
        "_off(angles, angle_error)",
        (f"{SEEN}::test_each_of_the_bounds_is_needed",),
    ),
    Fault(
        "a_place_is_believed",
        "seen_from",
        "shrunk(star, moved + TOLERANCES.outline",
        "shrunk(star, TOLERANCES.outline",
        (f"{SEEN}::test_each_of_the_bounds_is_needed",),
    ),
    Fault(
        "a_frame_drifts_without_turning",
        "free_space.FreeSpace.drifted",
        "by = turned *",
        "by = 0.0 *",
        (f"{SPACE}::test_what_drifts_is_free_wherever_it_was_truly",),
    ),
    Fault(
        "a_frame_drifts_along_another_heading",
        "free_space._shifted",
        "[-np.sin(heading), np.cos(heading)]",
        "[np.sin(heading), np.cos(heading)]",
        (f"{SPACE}::test_what_drifts_is_free_wherever_it_was_truly",),
    ),
    Fault(
        "simplified_as_proposed",
        "free_space.shrunk",
        "if inside and not shapely.dwithin(border, simple.boundary, by):",
        "if True:",
        (f"{SPACE}::test_what_is_proposed_is_not_believed",),
    ),
    Fault(
        "every_hole_is_free",
        "free_space._filled",
        "shapely.area(holes) >= np.pi / 4 * width**2",
        "shapely.area(holes) >= 9.0",
        (f"{SPACE}::test_a_hole_is_free_where_no_obstacle_has_room",),
    ),
    Fault(
        "the_sides_of_the_square_are_open",
        "FreeSpace._edges",
        "[same]",
        "[same][1:]",
        (f"{SPACE}::test_the_pieces_close_in_exact_arithmetic",),
    ),
    Fault(
        "unknown_cells_are_free",
        "problem.world.grid_map.occupancy_grid",
        "(cells >= 0) & (cells / 100 < threshold)",
        "cells / 100 < threshold",
        (f"{GRID}::test_99_may_be_declared_a_probability_and_255_is_unknown",),
    ),
    Fault(
        "costmaps_are_read_as_maps",
        "problem.world.grid_map.occupancy_grid",
        "(cells == INSCRIBED).any()",
        "False",
        (f"{GRID}::test_what_is_no_map_is_refused_in_one_sentence",),
    ),
    Fault(
        "cells_are_rounded_to_nearest",
        "GridMap.obstacles",
        "+ TOLERANCES.outline",
        "- TOLERANCES.outline",
        (f"{GRID}::test_all_that_is_not_free_is_covered_exactly",),
    ),
    Fault(
        "maps_end_in_the_open",
        "GridMap.obstacles",
        "np.pad(~cells, 1, constant_values=True)",
        "np.pad(~cells, 1, constant_values=False)",
        (f"{GRID}::test_near_a_place_the_frame_comes_along",),
    ),
    Fault(
        "images_are_upside_down",
        "load_map",
        "[::-1]",
        "[::1]",
        (f"{FILE}::test_the_lowest_row_comes_first_and_205_is_unknown",),
    ),
    Fault(
        "alpha_is_averaged_alone",
        "map_file._occupied",
        "np.maximum(occupied, mixed if negate else 1 - mixed)",
        "(mixed if negate else 1 - mixed)",
        (f"{FILE}::test_an_alpha_channel_that_is_averaged_frees_nothing",),
    ),
    Fault(
        "what_is_transparent_is_free",
        "map_file._occupied",
        "np.where(alpha < 1, np.inf, occupied)",
        "occupied",
        (f"{FILE}::test_what_is_transparent_is_unknown",),
    ),
    Fault(
        "what_was_free_stays_free",
        "FreeSpace.add",
        "if not away.is_empty:",
        "if False:",
        (
            "tests/world/test_came.py"
            "::test_who_comes_into_full_view_leaves_the_free_space_with_all_behind",
        ),
    ),
)
