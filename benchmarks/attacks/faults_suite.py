"""Faults of the suite: what is drawn, counted, tested, frozen, refused."""

from benchmarks.attacks.fault import Fault

SCORE = "tests/benchmarks/suite/test_score.py"
ANSWERS = "tests/benchmarks/suite/test_answers.py"
CONTACT = "tests/benchmarks/suite/test_contact.py"
ENTERING = "tests/benchmarks/suite/test_entering.py"
ENGINE = "tests/benchmarks/suite/test_engine.py"
TRAPS = "tests/benchmarks/suite/test_traps.py"
BOXES = "tests/benchmarks/suite/test_boxes.py"

SUITE = (
    Fault(
        "a_false_answer_costs_nothing",
        "score._some",
        "if min(chances) < WRONG / len(chances):",
        "if False:",
        (f"{SCORE}::test_a_cheat_gains_nothing", f"{SCORE}::test_failures_decide_against_eps"),
    ),
    Fault(
        "plans_are_not_tried_beside_sets",
        "score._some",
        "    if len(answer.plans):",
        "    if len(answer.plans) and not sets:",
        (f"{SCORE}::test_a_cheat_gains_nothing",),
    ),
    Fault(
        "a_flat_set_has_a_yield",
        "score._some",
        "if sets and not sets.flat else 0",
        "if sets and not sets.flat else len(good)",
        (f"{SCORE}::test_a_cheat_gains_nothing",),
    ),
    Fault(
        "a_plan_may_fail_in_all_but_a_share_eps",
        "score._truth",
        "instance.eps * instance.repeats",
        "(1 - instance.eps) * instance.repeats",
        (f"{SCORE}::test_the_share_of_plans_that_truly_succeed_is_the_closed_form",),
    ),
    Fault(
        "seeds_are_known_before_the_answers",
        "score.seed_of",
        "{hashlib.sha256(answers[name]).hexdigest()}",
        "",
        (f"{SCORE}::test_seeds_depend_on_the_answers_and_on_chance_that_was_drawn_later",),
    ),
    Fault(
        "overlaps_are_drawn_twice",
        "Sets.draw",
        "self.rng.uniform(size=len(plans)) * many < 1",
        "many > 0",
        (f"{ANSWERS}::test_draws_are_even_over_a_union",),
    ),
    Fault(
        "slivers_are_drawn_from",
        "Sets._share",
        "inside / tried if inside >= ENOUGH else 0.0",
        "inside / tried",
        (f"{ANSWERS}::test_what_is_flat_or_empty_has_no_volume",),
    ),
    Fault(
        "nan_is_a_number",
        "answer.read",
        "parse_constant=_no_number",
        "parse_constant=lambda word: 0.0",
        (f"{ANSWERS}::test_nonsense_is_refused_in_a_sentence",),
    ),
    Fault(
        "only_the_end_is_looked_at",
        "contact.touched",
        "    poses = p.reshape(n * t, *p.shape[2:])",
        "    poses = np.repeat(p[:, -1:], t, axis=1).reshape(n * t, *p.shape[2:])",
        (f"{CONTACT}::test_a_touch_at_any_record_counts",),
    ),
    Fault(
        "edges_of_the_body_separate_nothing",
        "contact.gap",
        "        axes.append(_across(_pairs(poses)))",
        "        pass",
        (f"{CONTACT}::test_polygons_touch_where_another_program_says_so",),
    ),
    Fault(
        "runs_beyond_the_budget",
        "Door._answered",
        "if len(k) > left:",
        "if len(k) > self.budget:",
        (f"{ENTERING}::test_runs_are_counted_and_end_with_the_budget",),
    ),
    Fault(
        "an_entry_sees_what_the_scorer_sees",
        "BlackBox.public",
        '("rollout", "fine")',
        '("rollout",)',
        (f"{ENTERING}::test_what_is_told_does_not_show_what_is_hidden",),
    ),
    Fault(
        "answers_may_change_after_they_were_frozen",
        "result.frozen",
        'if hashlib.sha256(given).hexdigest() != ledger[instance.id]["sha256"]:',
        "if not given:",
        (f"{ENTERING}::test_an_answer_that_was_changed_later_is_refused",),
    ),
    Fault(
        "what_failed_afresh_is_answered",
        "engine.borne_out",
        "if not len(failed):",
        "if True:",
        (f"{ENGINE}::test_what_fails_afresh_is_left_out_until_a_look_sees_no_failure",),
    ),
    Fault(
        "none_after_too_few_runs",
        "kit.enough",
        "math.ceil(math.log(task.delta)",
        "math.ceil(0.1 * math.log(task.delta)",
        (f"{ENGINE}::test_none_is_said_after_enough_runs_without_success_and_not_before",),
    ),
    Fault(
        "strings_taken_for_numbers",
        "answer._array",
        'not in "iuf"',
        'not in "iufU"',
        (f"{ANSWERS}::test_nonsense_is_refused_in_a_sentence",),
    ),
    Fault(
        "why_an_answer_is_worth_nothing_is_lost",
        "result.scored",
        ' | {"why": why}',
        ' | {"why": ""}',
        (f"{ENTERING}::test_why_an_answer_is_worth_nothing_is_told",),
    ),
    Fault(
        "scenes_tell_their_trap",
        "enter._scene",
        'if not line.startswith("#")',
        "",
        (f"{ENTERING}::test_what_was_refused_at_the_door_is_told_and_rooms_are_kept",),
    ),
    Fault(
        "looks_do_not_share_delta",
        "engine.looks",
        "task.delta / LOOKS",
        "task.delta",
        (f"{ENGINE}::test_what_fails_afresh_is_left_out_until_a_look_sees_no_failure",),
    ),
    Fault(
        "states_that_no_goal_asks_for_are_forgotten",
        "engine.scene",
        "    if not free:",
        "    if True:",
        (f"{ENGINE}::test_a_goal_bounds_every_state_that_a_model_has",),
    ),
    Fault(
        "the_caster_never_swings",
        "puck._run",
        "(chance < SWINGS)",
        "(chance < 0)",
        (f"{TRAPS}::test_the_hidden_caster_is_hardly_seen_and_refutes_who_ignores_it",),
    ),
    Fault(
        "records_are_all_that_there_is",
        "by_tube.between_records",
        'if task.told["speed"] is None:',
        "if True:",
        (
            f"{TRAPS}::"
            "test_the_post_between_records_refutes_who_sees_records_alone_and_can_be_passed",
        ),
    ),
    Fault(
        "a_system_does_not_move_with_its_start",
        "robots._runs",
        " + p0[:, None, None]",
        "",
        (f"{BOXES}::test_a_python_system_is_a_box",),
    ),
)
