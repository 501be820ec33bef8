"""Faults of what is said about the plan that is driven: looks, fresh runs, boxes, refinement."""

from benchmarks.attacks.fault import Fault

CHOICE = "tests/driven/test_choice.py"
LOOKS = "tests/driven/test_looks.py"
SAFE_BOX = "tests/driven/test_safe_box.py"
REFINE = "tests/driven/test_refine.py"
SENTENCES = "tests/test_sentences.py"
QUESTION = "tests/driven/test_question.py"

DRIVEN = (
    Fault(
        "a_look_is_spent_before_starts_are_tried",
        "parc_jax/driven/choice.py",
        "        start = tried_first(system, self.model, key, asked)\n"
        "        look = self.looks.take()\n",
        "        look = self.looks.take()\n"
        "        start = tried_first(system, self.model, key, asked)\n",
        (
            "tests/driven/test_refine.py"
            "::test_a_start_that_matters_is_refused_before_a_probe_or_a_look",
        ),
    ),
    Fault(
        "looks_not_counted",
        "parc_jax/driven/looks.py",
        "        self.taken += 1\n",
        "",
        (f"{LOOKS}::test_delta_is_split_over_the_declared_looks_and_no_more_are_given",),
    ),
    Fault(
        "looks_cost_nothing",
        "parc_jax/driven/looks.py",
        "self.delta / self.planned)",
        "self.delta)",
        (f"{LOOKS}::test_delta_is_split_over_the_declared_looks_and_no_more_are_given",),
    ),
    Fault(
        "polytopes_have_looks_of_their_own",
        "parc_jax/answer/answer.py",
        "        answer = copy.copy(self)\n",
        "        answer = copy.copy(self)\n        answer.looks = type(self.looks)()\n",
        (f"{QUESTION}::test_what_is_derived_from_an_answer_shares_its_looks",),
    ),
    Fault(
        "a_local_answer_has_looks_of_its_own",
        "parc_jax/driven/choice.py",
        "choice.solve(question, key, settings, choice.looks)",
        "choice.solve(question, key, settings)",
        (f"{QUESTION}::test_the_start_set_is_asked_for_again",),
    ),
    Fault(
        "a_file_forgets_its_looks",
        "parc_jax/io/answer_file.py",
        'looks_of_json(meta.get("looks"))',
        "looks_of_json(None)",
        (f"{QUESTION}::test_a_loaded_answer_goes_on_with_its_looks",),
    ),
    Fault(
        "a_question_asked_again_forgets_its_pose",
        "parc_jax/robust/question.py",
        "return replace(self, model=model)",
        "return replace(self, model=model, pose=None)",
        (f"{QUESTION}::test_the_pose_is_asked_for_again",),
    ),
    Fault(
        "a_question_asked_again_forgets_its_start_set",
        "parc_jax/robust/question.py",
        "return replace(self, model=model)",
        "return replace(self, model=model, problem=self.problem.replace(start=None))",
        (f"{QUESTION}::test_the_start_set_is_asked_for_again",),
    ),
    Fault(
        "a_scene_told_from_a_heading_asked_as_if_in_the_world",
        "parc_jax/io/answer_file.py",
        "    here = at is None if pose is None else pose.heading is None\n",
        "    here = True\n",
        (f"{QUESTION}::test_a_file_in_the_frame_of_the_robot_is_not_asked_again",),
    ),
    Fault(
        "printed_bounds_rounded_down",
        "parc_jax/spelling.py",
        "_rounded(value, digits, ROUND_CEILING)",
        "_rounded(value, digits, ROUND_FLOOR)",
        (f"{SENTENCES}::test_a_bound_is_never_rounded_down",),
    ),
    Fault(
        "a_tested_choice_printed_to_the_nearest",
        "parc_jax/claim/validate.py",
        "{rounded_up(self.eps, 4)}",
        "{float(self.eps):.4g}",
        (
            f"{SENTENCES}::test_no_sentence_undercuts_its_bound",
            f"{SENTENCES}::test_no_bound_is_printed_to_the_nearest",
        ),
    ),
    Fault(
        "looks_share_their_runs",
        "parc_jax/driven/looks.py",
        "for word in (look.number, *words):",
        "for word in words:",
        (f"{LOOKS}::test_streams_of_looks_meet_neither_each_other_nor_any_stage",),
    ),
    Fault(
        "looks_at_other_plans_share_their_runs",
        "parc_jax/driven/looks.py",
        "for word in (look.number, *words):",
        "for word in (look.number,):",
        (f"{LOOKS}::test_streams_of_looks_meet_neither_each_other_nor_any_stage",),
    ),
    Fault(
        "chosen_plan_may_touch",
        "parc_jax/driven/tested.py",
        "failed = batch.failed | ~reached | ~(distance > 0)",
        "failed = batch.failed | ~reached",
        (f"{CHOICE}::test_nan_and_contact_are_failures",),
    ),
    Fault(
        "chosen_plan_may_miss",
        "parc_jax/driven/tested.py",
        "failed = batch.failed | ~reached | ~(distance > 0)",
        "failed = batch.failed | ~(distance > 0)",
        (f"{CHOICE}::test_failures_are_counted_and_paid_for",),
    ),
    Fault(
        "runs_alike_taken_for_certainty",
        "parc_jax/driven/tested.py",
        "    bound = clopper_pearson(failures, n, float(look.delta))\n",
        "    bound = clopper_pearson(failures, n, float(look.delta)) * (not alike)\n",
        (f"{CHOICE}::test_runs_that_are_alike_are_not_taken_for_certainty",),
    ),
    Fault(
        "local_runs_in_single_precision",
        "parc_jax/driven/local_runs.py",
        "return jnp.clip(lo + u * (hi - lo), lo, hi)",
        "return jnp.clip(lo + u * (hi - lo), lo, hi).astype(jnp.float32)",
        (f"{CHOICE}::test_runs_on_a_box_are_uniform_there_and_disjoint",),
    ),
    Fault(
        "shape_runs_are_the_training_runs",
        "parc_jax/driven/local_runs.py",
        "return self._stream(n, Stage.TRAIN, self.trained)",
        "return self._stream(n, Stage.TRAIN, 0)",
        (f"{CHOICE}::test_runs_on_a_box_are_uniform_there_and_disjoint",),
    ),
    Fault(
        "risk_of_the_whole_box",
        "parc_jax/driven/near.py",
        "return self.model.claim.risk(Uniform(self.held))",
        "return self.model.claim.risk(Uniform(1))",
        (f"{CHOICE}::test_a_smaller_proved_box_costs_its_share",),
    ),
    Fault(
        "every_local_tube_called_narrower",
        "parc_jax/driven/near.py",
        ">= NARROWER",
        ">= 0",
        (f"{CHOICE}::test_a_local_tube_that_is_not_narrower_says_so",),
    ),
    Fault(
        "safe_box_not_asked_of_the_checker",
        "parc_jax/driven/safe_box.py",
        "if proves_box(scene.problem, model, certificate):",
        "if True:",
        (f"{SAFE_BOX}::test_only_what_the_checker_accepts_is_returned",),
    ),
    Fault(
        "a_part_of_the_tube_called_all",
        "parc_jax/driven/nearly.py",
        "    judged_by = _under(model, part)\n",
        "    judged_by = _under(model, 0.5 * part)\n",
        (f"{REFINE}::test_the_score_is_the_least_margin_under_all_of_the_tube_or_a_part",),
    ),
    Fault(
        "smaller_boxes_anywhere",
        "parc_jax/driven/probe.py",
        "found.append((least.max() - unrest, Place",
        "found.append((unrest - least.max(), Place",
        (f"{REFINE}::test_smaller_boxes_lie_where_runs_end_calmly",),
    ),
    Fault(
        "a_local_claim_said_to_be_of_all_of_k",
        "parc_jax/driven/local_runs.py",
        'BOX: "N"}',
        'BOX: "K"}',
        (f"{CHOICE}::test_a_local_claim_is_about_its_box_and_narrower_where_the_error_is",),
    ),
)
