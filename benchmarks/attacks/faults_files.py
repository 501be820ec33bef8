"""Faults of rollouts and files: what is stored, read back, repeated."""

from benchmarks.attacks.fault import Fault

COLLECT = "tests/rollout/test_collect.py"

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
        "damage_within_what_is_compressed_is_not_told",
        "parc_jax/learning/runs/files.py",
        "zlib.error, ",
        "",
        (
            "tests/rollout/test_files.py::test_wherever_a_byte_is_wrong_the_file_is_whole_or_says_so",
        ),
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
        "a_run_that_ended_its_process_has_another_chance",
        "Fleet._together",
        "elif not self.again:",
        "elif part.lost == LOSSES:",
        ("tests/rollout/test_fleet.py::test_a_lost_run_has_failed_and_no_other_is_begun_twice",),
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
        "RolloutBatch._hashes",
        "() + p.tobytes() + q",
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
        "loaders.recorded",
        "places - places[:, :1, :1]",
        "places - 0 * places[:, :1, :1]",
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
        "learning.model.load",
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


FILES = (*ROLLOUTS, *FILES_IN_AND_OUT)
