"""Faults of rollouts, files, replay and the page: what is stored, read back, repeated, shown."""

from benchmarks.attacks.fault import Fault

COLLECT = "tests/rollout/test_collect.py"
REPLAYS = "tests/soundness/test_replays.py"
MANY = "tests/verdict/test_outcomes.py"
LOADED = "tests/bags/test_load.py"

ROLLOUTS = (
    Fault(
        "stages_share_random_numbers",
        "stream",
        "int(stage)",
        "0",
        (f"{COLLECT}::test_stages_share_no_numbers",),
    ),
    Fault(
        "k_and_disturbance_share_a_key",
        "split_rollout",
        "jax.random.split(key)",
        "key, key",
        (f"{COLLECT}::test_k_and_disturbance_are_independent",),
    ),
    Fault(
        "rows_start_anew_in_every_chunk",
        "chunks_of_rows",
        "np.arange(first_row + i, first_row + i + chunk) for i in range(0, n, chunk)",
        "np.arange(first_row, first_row + chunk) for i in range(0, n, chunk)",
        (f"{COLLECT}::test_rows_do_not_depend_on_chunking_or_on_how_many_are_asked_for",),
    ),
    Fault(
        "k_in_a_corner_of_the_domain",
        "_drawn.uniform",
        "+ u * (hi - lo)",
        "+ u * u * (hi - lo)",
        (f"{COLLECT}::test_parameters_are_uniform_on_the_domain",),
    ),
    Fault(
        "chunks_of_another_grid",
        "identity_of",
        "hex_text([time.dt, time.t_f, time.dt_record])",
        "[]",
        ("tests/rollout/test_resume.py::test_another_record_grid_is_refused",),
    ),
    Fault(
        "chunks_of_other_code",
        "identity_of",
        "reader.digest(value)",
        '""',
        ("tests/rollout/test_resume.py::test_changed_code_is_refused",),
    ),
    Fault(
        "workers_with_other_code_are_believed",
        "run_sent",
        "_HELD[code] != code",
        "code is None",
        ("tests/rollout/test_fleet.py::test_a_worker_with_other_code_is_refused",),
    ),
    Fault(
        "what_a_machine_lacks_is_a_failed_run",
        "python_worker.run_one",
        "    except ImportError:\n        raise\n",
        "",
        ("tests/rollout/test_fleet.py::test_what_a_machine_lacks_is_no_failed_run",),
    ),
    Fault(
        "an_fmu_of_other_bytes_is_run",
        "fmu_run.unpacked",
        "found != sha256",
        "found is None",
        ("tests/rollout/test_fmu.py::test_another_file_at_the_same_place_is_refused",),
    ),
    Fault(
        "samples_far_apart_are_interpolated",
        "sweep._cut",
        "longest * (1 + 1e-6)",
        "np.inf",
        ("tests/rollout/test_sweep.py::test_what_cannot_be_meant_is_refused",),
    ),
    Fault(
        "a_run_that_ended_stands_still",
        "sweep._cut",
        "right=np.nan",
        "right=axis[-1]",
        ("tests/rollout/test_sweep.py::test_runs_are_cut_and_put_on_the_grid",),
    ),
    Fault(
        "rows_that_are_missing_are_left_out",
        "whole_of",
        "        _require_up_to(folder, at, first)\n",
        "",
        ("tests/rollout/test_parts.py::test_rows_that_are_missing_are_named",),
    ),
    Fault(
        "a_part_of_another_key_is_taken",
        "parts._parts",
        "have.get(name) != wanted.get(name)",
        "False",
        ("tests/rollout/test_parts.py::test_a_part_from_elsewhere_is_refused",),
    ),
    Fault(
        "stored_runs_not_repeated",
        "require_same_runs",
        "not np.all(same)",
        "np.shape(same) is None",
        ("tests/rollout/test_resume.py::test_stored_runs_are_simulated_again",),
    ),
    Fault(
        "failed_runs_look_finished",
        "RolloutBatch.failed",
        "all(axis=(1, 2))",
        "any(axis=(1, 2))",
        ("tests/rollout/test_batch.py::test_one_record_that_is_no_number_fails_its_run",),
    ),
    Fault(
        "hash_of_a_run_without_its_path",
        "hashes",
        "() + p[i].tobytes() + q",
        "() + q",
        ("tests/rollout/test_batch.py::test_the_hash_of_a_run_sees_k_path_and_end",),
    ),
)

FILES_IN_AND_OUT = (
    Fault(
        "half_a_file_is_seen",
        "write_atomic",
        '.with_name(f".{path.name}.{os.getpid()}.tmp")',
        "",
        ("tests/rollout/test_files.py::test_a_failed_write_leaves_the_old_file",),
    ),
    Fault(
        "mat_axes_mixed_up",
        "_mat_arrays",
        "transpose(2, 0, 1)",
        "transpose(2, 0, 1)[:, :, ::-1]",
        ("tests/rollout/test_files.py::test_published_mat_layout",),
    ),
    Fault(
        "logged_runs_keep_their_start",
        "_assemble",
        "by_point - by_point[:, :1, :1]",
        "by_point - 0 * by_point[:, :1, :1]",
        ("tests/rollout/test_files.py::test_published_mat_layout",),
    ),
    Fault(
        "scene_of_other_points",
        "_problem",
        "tuple(points) != made_for",
        "set(points) != set(made_for)",
        (
            "tests/io/test_problem_file.py"
            "::test_a_saved_scene_is_one_of_the_points_that_its_goal_was_made_for",
        ),
    ),
    Fault(
        "answer_on_another_time_grid",
        "model_of_file",
        "if proved !=",
        "if False and proved !=",
        ("tests/io/test_answer_file.py::test_an_answer_is_about_what_its_claim_is_about",),
    ),
    Fault(
        "layers_in_reverse",
        "model.load",
        'file[f"W{i}"] for i in range(layers)',
        'file[f"W{i}"] for i in reversed(range(layers))',
        ("tests/test_model.py::test_a_saved_model_comes_back_equal",),
    ),
    Fault(
        "saved_tube_of_half_the_width",
        "tube_arrays",
        "error_tube.interval",
        "error_tube.interval * 0.5",
        ("tests/test_model.py::test_a_saved_model_comes_back_equal",),
    ),
    Fault(
        "shortest_decimals",
        "decimal_text",
        'text = format(Decimal(values.item()), "f")',
        "text = repr(values.item())",
        ("tests/certificate/test_write.py::test_numbers_are_spelled_exactly",),
    ),
    Fault(
        "multipliers_through_floats",
        "fraction_text",
        "return str(Fraction(values))",
        "return str(float(values))",
        ("tests/certificate/test_write.py::test_fractions_are_spelled_as_fractions",),
    ),
    Fault(
        "certificates_without_spans",
        "problem_part",
        'part["steps"] = list(span)',
        "pass",
        ("tests/io/test_answer_file.py::test_everything_but_timings_comes_back",),
    ),
    Fault(
        "hashes_of_the_names_only",
        "part_hash",
        'part, sort_keys=True, separators=(",", ":")',
        "sorted(part)",
        ("tests/certificate/test_write.py::test_hashes_see_every_number",),
    ),
    Fault(
        "answers_believed_unchecked",
        "load_answer",
        "report = check_answer(data)",
        'report = type("Unchecked", (), {"no_plan": None})',
        ("tests/io/test_answer_file.py::test_a_file_whose_proof_fails_is_refused",),
    ),
    Fault(
        "spans_lost_in_reading",
        "problem_of_file",
        '[tuple(o["steps"]) if "steps" in o else None for o in asked["obstacles"]]',
        "None",
        ("tests/io/test_answer_file.py::test_everything_but_timings_comes_back",),
    ),
    Fault(
        "corridor_read_without_slack",
        "corridor_of",
        "exact + scene.slack * np.abs(along).sum()",
        "exact",
        ("tests/io/test_answer_file.py::test_everything_but_timings_comes_back",),
    ),
    Fault(
        "obstacles_of_a_picture_counted_from_one",
        "timeline.timeline",
        'f"obstacle {o}',
        'f"obstacle {o + 1}',
        ("tests/test_numbering.py::test_pictures_and_films_say_the_same",),
    ),
)

LOST = "tests/cli/test_nothing_lost.py"

SHELL = (
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
        "cli.plot._film",
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
        "inside = inside_tube(model.claim, model.net, runs)",
        "inside = np.ones(len(plans), bool)",
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
        "_promised",
        "jnp.minimum(along[..., :-1], along[..., 1:])",
        "along[..., 1:]",
        (f"{MANY}::test_distances_are_those_of_every_hull_measured",),
    ),
    Fault(
        "facets_promise_by_the_best_point",
        "_promised",
        "min(axis=1)",
        "max(axis=1)",
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
        "parc_jax/plot/page/model.js",
        "sums([seen.path[t][i], seen.path[t + 1][i]], seen.tube.errors[t][i])",
        "[seen.path[t][i], seen.path[t + 1][i]]",
        ("tests/plot/test_page_browser.py::test_verdicts_equal_the_engine_s",),
    ),
    Fault(
        "page_sees_one_end_of_a_segment",
        "parc_jax/plot/page/model.js",
        "sums([seen.path[t][i], seen.path[t + 1][i]], seen.tube.errors[t][i])",
        "sums([seen.path[t][i]], seen.tube.errors[t][i])",
        ("tests/plot/test_page_browser.py::test_verdicts_equal_the_engine_s",),
    ),
)

BAGS = (
    Fault(
        "bag_with_gaps_bridged",
        "parc_jax.bags.windows._between",
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
        "parc_jax/plot/page/episode.js",
        "why && why[0] > one.begin - 1e-9 ? why : null",
        "why",
        ("tests/plot/test_episode_page.py::test_one_scrubs_to_what_was_said",),
    ),
    Fault(
        "mcap_of_a_plan_that_is_not_safe",
        "parc_jax.bags.write._plan",
        "if not fits or not verdicts(",
        "if not fits or None is verdicts(",
        ("tests/bags/test_write.py::test_what_is_not_safe_is_not_written",),
    ),
)

PILOTS = "tests/ros/test_pilot.py"
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
        "there = pose + share *",
        "there = pose + 1.0 *",
        (f"{PILOTS}::test_a_scan_frees_what_it_sees_from_where_it_was_taken",),
    ),
    Fault(
        "scan_that_failed_saw_far",
        "seen_in",
        "np.where(told, ranges, 0.0)",
        "np.where(told, ranges, message.range_max)",
        (f"{PILOTS}::test_a_beam_that_says_nothing_frees_nothing",),
    ),
)

FILES = (*ROLLOUTS, *FILES_IN_AND_OUT, *SHELL, *REPLAY, *BAGS, *ROS)
