"""Faults of what is said about the plan that is driven: looks, fresh runs, boxes, refinement."""

from benchmarks.attacks.fault import Fault

CHOICE = "tests/local/test_choice.py"
LOOKS = "tests/local/test_looks.py"
SAFE_BOX = "tests/local/test_safe_box.py"
REFINE = "tests/local/test_refine.py"
SENTENCES = "tests/test_sentences.py"
QUESTION = "tests/local/test_question.py"

DRIVEN = (
    Fault(
        "a_look_is_spent_before_starts_are_tried",
        "claim_near",
        "start = tried_first(system, key, asked)\n        look = self.looks.take()",
        "look = self.looks.take()\n        start = tried_first(system, key, asked)",
        (
            "tests/local/test_refine.py"
            "::test_a_start_that_matters_is_refused_before_a_probe_or_a_look",
        ),
    ),
    Fault(
        "looks_not_counted",
        "Looks.take",
        "        self.taken += 1\n",
        "",
        (f"{LOOKS}::test_delta_is_split_over_the_declared_looks_and_no_more_are_given",),
    ),
    Fault(
        "looks_cost_nothing",
        "Looks.take",
        "delta / self.planned",
        "delta",
        (f"{LOOKS}::test_delta_is_split_over_the_declared_looks_and_no_more_are_given",),
    ),
    Fault(
        "polytopes_have_looks_of_their_own",
        "Answer.with_polytopes",
        "refused=self.refused + refused",
        "refused=self.refused + refused, looks=type(self.looks)()",
        (f"{QUESTION}::test_what_is_derived_from_an_answer_shares_its_looks",),
    ),
    Fault(
        "a_local_answer_has_looks_of_its_own",
        "near_of",
        ", choice.looks",
        "",
        (f"{QUESTION}::test_the_start_set_is_asked_for_again",),
    ),
    Fault(
        "a_file_forgets_its_looks",
        "_answer",
        'meta.get("looks")',
        "None",
        (f"{QUESTION}::test_a_loaded_answer_goes_on_with_its_looks",),
    ),
    Fault(
        "a_question_asked_again_forgets_its_pose",
        "Question.of",
        "model=model",
        "model=model, pose=None",
        (f"{QUESTION}::test_the_pose_is_asked_for_again",),
    ),
    Fault(
        "a_question_asked_again_forgets_its_start_set",
        "Question.of",
        "model=model",
        "model=model, problem=self.problem.replace(start=None)",
        (f"{QUESTION}::test_the_start_set_is_asked_for_again",),
    ),
    Fault(
        "a_scene_told_from_a_heading_asked_as_if_in_the_world",
        "answer_file._asked",
        "at is None if pose is None else pose.heading is None",
        "True",
        (f"{QUESTION}::test_a_file_in_the_frame_of_the_robot_is_not_asked_again",),
    ),
    Fault(
        "printed_bounds_rounded_down",
        "rounded_up",
        ", ROUND_CEILING",
        ", ROUND_FLOOR",
        (f"{SENTENCES}::test_a_bound_is_never_rounded_down",),
    ),
    Fault(
        "a_tested_choice_printed_to_the_nearest",
        "Tested.statement",
        "rounded_up(self.eps)",
        "float(self.eps):.4g",
        (
            f"{SENTENCES}::test_no_sentence_undercuts_its_bound",
            f"{SENTENCES}::test_no_bound_is_printed_to_the_nearest",
        ),
    ),
    Fault(
        "looks_share_their_runs",
        "fresh_key",
        "(look.number, *words)",
        "words",
        (f"{LOOKS}::test_streams_of_looks_meet_neither_each_other_nor_any_stage",),
    ),
    Fault(
        "looks_at_other_plans_share_their_runs",
        "fresh_key",
        "number, *words",
        "number,",
        (f"{LOOKS}::test_streams_of_looks_meet_neither_each_other_nor_any_stage",),
    ),
    Fault(
        "chosen_plan_may_touch",
        "tested._judged",
        "reached | ~(distance > 0)",
        "reached",
        (f"{CHOICE}::test_nan_and_contact_are_failures",),
    ),
    Fault(
        "chosen_plan_may_miss",
        "tested._judged",
        "reached | ~",
        "",
        (f"{CHOICE}::test_failures_are_counted_and_paid_for",),
    ),
    Fault(
        "runs_that_end_alike_are_one",
        "tested._same",
        "~moved & ",
        "",
        (f"{CHOICE}::test_runs_that_are_one_again_are_judged_with_it_and_no_others",),
    ),
    Fault(
        "runs_alike_taken_for_certainty",
        "run_plan",
        "(failures, n, float(look.delta))",
        "(failures, n, float(look.delta)) * (not alike)",
        (f"{CHOICE}::test_runs_that_are_alike_are_not_taken_for_certainty",),
    ),
    Fault(
        "local_runs_in_single_precision",
        "_stream.near",
        "(lo + u * (hi - lo), lo, hi)",
        "(lo + u * (hi - lo), lo, hi).astype(jnp.float32)",
        (f"{CHOICE}::test_runs_on_a_box_are_uniform_there_and_disjoint",),
    ),
    Fault(
        "shape_runs_are_the_training_runs",
        "LocalRuns.further",
        "self.trained",
        "0",
        (f"{CHOICE}::test_runs_on_a_box_are_uniform_there_and_disjoint",),
    ),
    Fault(
        "risk_of_the_whole_box",
        "Near.risk",
        "return self.model.claim.risk(share=self.held)",
        "return self.model.claim.risk(share=1)",
        (f"{CHOICE}::test_a_smaller_proved_box_costs_its_share",),
    ),
    Fault(
        "every_local_tube_called_narrower",
        "is_narrower",
        "= NARROWER",
        "= 0",
        (f"{CHOICE}::test_a_local_tube_that_is_not_narrower_says_so",),
    ),
    Fault(
        "safe_box_not_asked_of_the_checker",
        "safe_box.safe_box",
        "proves_box(scene.problem, model, certificate)",
        "True",
        (f"{SAFE_BOX}::test_only_what_the_checker_accepts_is_returned",),
    ),
    Fault(
        "a_part_of_the_tube_called_all",
        "nearly_safe",
        "_under(model, part)",
        "_under(model, 0.5 * part)",
        (f"{REFINE}::test_the_score_is_the_least_margin_under_all_of_the_tube_or_a_part",),
    ),
    Fault(
        "smaller_boxes_anywhere",
        "probe.inside",
        "least.max() - unrest",
        "unrest - least.max()",
        (f"{REFINE}::test_smaller_boxes_lie_where_runs_end_calmly",),
    ),
    Fault(
        "a_local_claim_said_to_be_of_all_of_k",
        "local_model.on_box",
        'BOX: "N"}',
        'BOX: "K"}',
        (f"{CHOICE}::test_a_local_claim_is_about_its_box_and_narrower_where_the_error_is",),
    ),
)
