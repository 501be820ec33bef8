"""Faults of what is shown: replays, bags, films and pages."""

from benchmarks.attacks.fault import Fault

REPLAYS = "tests/soundness/test_replays.py"
MANY = "tests/verdict/test_outcomes.py"
LOADED = "tests/bags/test_load.py"

REPLAY = (
    Fault(
        "replay_from_the_origin",
        "outcomes._path",
        "p0, np.asarray",
        "0 * p0, np.asarray",
        (f"{REPLAYS}::test_what_a_replay_reports_is_what_the_runs_did",),
    ),
    Fault(
        "replay_looks_at_knots_only",
        "outcomes.outcomes",
        "runs.time.stride, path",
        "1, path[:, :: runs.time.stride]",
        (f"{REPLAYS}::test_a_bend_between_knots_is_replayed",),
    ),
    Fault(
        "replay_keeps_contradictions_to_itself",
        "_refuse_contradictions",
        "bugs.any()",
        "bugs.all() and len(bugs) > 1",
        (f"{REPLAYS}::test_a_proof_that_contradicts_the_plant_is_reported",),
    ),
    Fault(
        "recorded_runs_of_another_k_are_replayed",
        "replay._check_recorded",
        " or not (runs.k == k).all()",
        "",
        ("tests/study/test_recorded.py::test_the_open_door_takes_plans_of_the_runs_own_k",),
    ),
    Fault(
        "replay_compares_the_end_only",
        "_driven",
        "inside_tube(model.claim, model.net, runs)",
        "np.ones(len(plans), bool)",
        (f"{REPLAYS}::test_a_bend_between_knots_is_replayed",),
    ),
    Fault(
        "replay_counts_what_left_as_inside",
        "counts_of",
        "(~inside).",
        "inside.",
        (f"{MANY}::test_counts_are_those_of_a_replay",),
    ),
    Fault(
        "many_replays_keep_contradictions_to_themselves",
        "counts_of",
        "(touched | ~reached)",
        "touched & ~reached",
        (f"{MANY}::test_a_contradiction_among_many_is_reported",),
    ),
    Fault(
        "facets_promise_by_the_last_record_only",
        "along_facets",
        "at_both_knots(height(w, places[point]))",
        "at_both_knots(height(w, places[point]))[1:]",
        (f"{MANY}::test_distances_are_those_of_every_hull_measured",),
    ),
    Fault(
        "facets_promise_by_the_last_point",
        "along_facets",
        "jnp.minimum(far, jnp.where(mine, room, jnp.inf))",
        "jnp.where(mine, room, far)",
        (f"{MANY}::test_distances_are_those_of_every_hull_measured",),
    ),
    Fault(
        "touched_only_where_facets_promise_nothing_known",
        "_not_apart",
        "~(_measured(scene, path, run, o, t) > 0)",
        "_measured(scene, path, run, o, t) == 0",
        (f"{MANY}::test_touched_is_what_a_distance_says",),
    ),
    Fault(
        "replay_fails_only_by_both",
        "Replay.failed",
        "reached | self",
        "reached & self",
        (f"{REPLAYS}::test_what_a_replay_reports_is_what_the_runs_did",),
    ),
    Fault(
        "page_forgets_the_tube",
        "parc_jax/app/plot/page/model.js",
        "sums([seen.path[t][i], seen.path[t + 1][i]], seen.tube.errors[t][i])",
        "[seen.path[t][i], seen.path[t + 1][i]]",
        ("tests/plot/test_page_browser.py::test_verdicts_equal_the_engine_s",),
    ),
    Fault(
        "page_sees_one_end_of_a_segment",
        "parc_jax/app/plot/page/model.js",
        "sums([seen.path[t][i], seen.path[t + 1][i]], seen.tube.errors[t][i])",
        "sums([seen.path[t][i]], seen.tube.errors[t][i])",
        ("tests/plot/test_page_browser.py::test_verdicts_equal_the_engine_s",),
    ),
)

BAGS = (
    Fault(
        "bag_with_gaps_bridged",
        "parc_jax.ros.bags.windows._between",
        "(wide > bridge * 1e9)",
        "(wide > np.inf)",
        (f"{LOADED}::test_no_run_goes_over_a_gap_between_poses",),
    ),
    Fault(
        "bag_with_runs_cut_short_that_go_on",
        "windows.windows",
        "pose[at > following[:, None]] = np.nan",
        "pose[at > at[:, -1:]] = np.nan",
        (f"{LOADED}::test_a_run_cut_short_has_failed_unless_it_is_dropped",),
    ),
    Fault(
        "bags_without_groups",
        "load_bags",
        "groups=groups,",
        "groups=None,",
        (f"{LOADED}::test_a_recording_is_a_group_and_is_never_torn_apart",),
    ),
    Fault(
        "bag_of_two_clocks",
        "load._require_one_clock",
        "apart > CLOCKS_APART",
        "apart > 1e99",
        (f"{LOADED}::test_what_cannot_be_meant_is_refused_in_one_sentence",),
    ),
    Fault(
        "mcap_with_half_the_tube",
        "triangles.tube_triangles",
        "+ signs * half",
        "+ signs * half / 2",
        ("tests/bags/test_write.py::test_an_answer_is_read_back_by_another_library",),
    ),
    Fault(
        "film_shows_a_manoeuvre_at_another_time",
        "manoeuvres.Shown.predicted",
        "t - self.begin",
        "t",
        ("tests/plot/test_episode_film.py::test_the_true_robot_is_shown_where_it_was",),
    ),
    Fault(
        "episode_shows_the_manoeuvre_before",
        "manoeuvres.Stage.at",
        "one.begin <= t + SAME",
        "one.begin < t - SAME",
        (
            "tests/plot/test_episode_page.py::"
            "test_the_page_is_whole_and_the_body_is_inside_of_what_it_may_reach",
        ),
    ),
    Fault(
        "page_of_an_episode_keeps_an_old_reason",
        "parc_jax/app/plot/page/episode.js",
        "why && why[0] > one.begin - 1e-9 ? why : null",
        "why",
        ("tests/plot/test_episode_page.py::test_one_scrubs_to_what_was_said",),
    ),
    Fault(
        "mcap_of_a_plan_that_is_not_safe",
        "parc_jax.ros.bags.write._plan",
        "if not fits or not verdicts(",
        "if not fits or None is verdicts(",
        ("tests/bags/test_write.py::test_what_is_not_safe_is_not_written",),
    ),
)

SHOWN = (*REPLAY, *BAGS)
