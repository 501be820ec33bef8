"""Faults of doubt: scenes that grow too little, executions left out, kinks forgotten, turns cut
short, poses mixed up.
"""

from benchmarks.attacks.fault import Fault

QUESTION = "tests/robust/test_question.py::"
EXECUTIONS = "tests/robust/test_executions.py::"
POSE = "tests/robust/test_pose.py::"
MOVED = "test_obstacles_that_may_be_moved_are_sums_that_hold_all_of_it_and_hardly_more"
WITHSTAND = "test_plans_withstand_the_doubt_and_no_more_is_given_up_than_has_to_be"

DOUBT = (
    Fault(
        "start_doubt_forgotten_on_the_way",
        "moved_tube",
        "wide = given.interval + np.tile(start, given.n_points)",
        "wide = given.interval + 0 * np.tile(start, given.n_points)",
        (QUESTION + "test_the_boxes_of_doubt_of_the_plain_question_say_the_same",),
    ),
    Fault(
        "start_doubt_forgotten_at_the_goal",
        "_shrunken_goal",
        "widths = [Fraction(x) for x in np.concatenate([start + 0.0, ",
        "widths = [Fraction(x) for x in np.concatenate([start * 0.0, ",
        (QUESTION + "test_the_start_set_shrinks_and_the_goal_by_what_points_do_together",),
    ),
    Fault(
        "moved_obstacles_grow_along_their_rows_alone",
        "_around_box",
        "(np.tile(half, 2) + off)",
        "(0 * np.tile(half, 2) + off)",
        (QUESTION + MOVED,),
    ),
    Fault(
        "moved_obstacles_rounded_inward",
        "_around_box",
        "np.nextafter(b + (np.abs(A) * half).sum(axis=2) * UP, np.inf)",
        "np.nextafter(b + (np.abs(A) * half).sum(axis=2), -np.inf)",
        (QUESTION + MOVED,),
    ),
    Fault(
        "start_set_does_not_shrink",
        "_less_a_box",
        "(bound) - support",
        "(bound)",
        (QUESTION + "test_the_start_set_shrinks_and_the_goal_by_what_points_do_together",),
    ),
    Fault(
        "points_shrink_the_goal_one_by_one",
        "_shrunken_goal",
        "filter(None, row[axis:n_c:n_p])",
        "filter(None, abs(row[axis:n_c:n_p]))",
        (QUESTION + "test_the_start_set_shrinks_and_the_goal_by_what_points_do_together",),
    ),
    Fault(
        "obstacles_stay_as_they_were_seen",
        "doubted_scene",
        "if by is not None:",
        "if False:",
        (QUESTION + WITHSTAND,),
    ),
    Fault(
        "copies_of_points_go_by_their_old_names",
        "copied_problem",
        ", points=points",
        "",
        (POSE + "test_a_goal_of_named_points_is_one_of_their_copies",),
    ),
    Fault(
        "nothing_is_said_of_copies",
        "Question.plain",
        "max(copies.counts) > 1",
        "False",
        (EXECUTIONS + "test_no_plan_under_copies_says_what_it_means",),
    ),
    Fault(
        "tolerance_on_one_side_only",
        "Parameter.box",
        "round_down(Fraction(lo) - off)",
        "lo",
        (EXECUTIONS + "test_samples_are_boxes_of_doubt_of_the_question_as_it_was_asked",),
    ),
    Fault(
        "no_plan_does_not_say_what_it_is_about",
        "Prepared._solve",
        "no_plan._replace(doubt=scene.asked.doubt)",
        "no_plan",
        (EXECUTIONS + "test_no_plan_under_doubt_says_what_it_is_about",),
    ),
    Fault(
        "a_path_with_the_tube_of_one_bin",
        "answer.path.nominal_path",
        "model.tube.widest_at(k[None])",
        "(w[model.tube.bin_of(k[None])] for w in (model.tube.interval, model.tube.final))",
        ("tests/answer/test_path.py::test_on_an_edge_the_wider_bin_counts",),
    ),
    Fault(
        "an_obstacle_rounded_inward",
        "hull.polytope_around",
        "np.array([round_up(exact_support(exact, w))",
        "np.array([float(exact_support(exact, w))",
        ("tests/sets/test_hull.py::test_every_vertex_is_inside_and_nothing_far_from_them",),
    ),
    Fault(
        "a_body_that_almost_touches_is_said_to_touch",
        "hopeless._touches",
        "< radius - near",
        "< 1.01 * radius",
        ("tests/verdict/test_hopeless.py::test_a_goal_under_the_body_is_told",),
    ),
    Fault(
        "an_obstacle_that_has_gone_is_touched",
        "hopeless._touching",
        "if span is not None and not span[0] <= t <= span[1]:",
        "if False:",
        ("tests/verdict/test_hopeless.py::test_a_goal_under_the_body_is_told",),
    ),
    Fault(
        "what_doubt_made_larger_is_surely_touched",
        "hopeless.why_none",
        "sure = scene.asked.doubt is None",
        "sure = True",
        (
            "tests/verdict/test_hopeless.py"
            "::test_an_obstacle_that_doubt_made_larger_makes_nothing_sure",
        ),
    ),
    Fault(
        "a_sentence_names_what_is_not_there",
        "statement.about_plans",
        "in told.items() if n]",
        "in told.items()]",
        ("tests/test_sentences.py::test_a_sentence_names_what_is_there_and_counts_in_english",),
    ),
    Fault(
        "no_word_of_a_bin_without_claim",
        "answer.statement.statement",
        "nothing_found(why_none(found.scene))",
        "nothing_found(None)",
        (
            "tests/answer/test_statement.py"
            "::test_a_value_on_the_edge_of_a_bin_without_claim_is_told",
        ),
    ),
    Fault(
        "a_measured_parameter_is_executed_exactly",
        "Parameter.box",
        "off = self.value, Fraction(self.off)",
        "off = self.value, Fraction(self.off if self.known is None else 0)",
        (EXECUTIONS + "test_a_measured_parameter_may_be_executed_roughly_too",),
    ),
    Fault(
        "a_parameter_by_name_and_by_number",
        "executions._by_axis",
        "require_once(word, [names[axis] for axis in axes])",
        "require_once(word, [name for name, _ in pairs])",
        (EXECUTIONS + "test_what_does_not_fit_the_model_is_refused",),
    ),
    Fault(
        "two_parameters_share_a_name",
        "labels._checked",
        "[name_of(other) for other in words].count(name) > 1",
        "words.count(word) > 1",
        ("tests/test_labels.py::test_wrong_labels_are_refused",),
    ),
    Fault(
        "kinks_forgotten",
        "bend.bend",
        "np.minimum(varies / 4, np.minimum(-below, above))",
        "0 * varies",
        (
            EXECUTIONS + "test_what_a_mixture_misses_is_bounded",
            EXECUTIONS + "test_one_kink_is_bounded_by_what_it_misses",
        ),
    ),
    Fault(
        "a_kink_takes_an_eighth",
        "bend.bend",
        "varies / 4",
        "varies / 8",
        (EXECUTIONS + "test_one_kink_is_bounded_by_what_it_misses",),
    ),
    Fault(
        "bins_of_executions_forgotten",
        "axis_of",
        "(a) + low, Fraction(b) + high",
        "(a), Fraction(b)",
        (EXECUTIONS + "test_bins_of_plans_hold_the_bins_of_their_executions",),
    ),
    Fault(
        "a_value_between_bins_counts_to_one",
        "axis_of",
        "_met(exact, low, high, closed=True)",
        "(max(0, _met(exact, low, high, closed=True)[1]),) * 2",
        (EXECUTIONS + "test_values_between_bins_meet_both",),
    ),
    Fault(
        "a_triangle_that_cuts_the_arc",
        "turn_by",
        "math.ceil(a / (1 - b * b) / unit) * unit",
        "Fraction(1)",
        (POSE + "test_turns_are_mixtures_of_the_maps",),
    ),
    Fault(
        "errors_do_not_turn",
        "widened",
        "widths + self.sine * widths[..., ::-1]",
        "widths",
        (POSE + "test_errors_turn_with_the_robot",),
    ),
    Fault(
        "a_pose_turned_the_other_way",
        "pose.from_here",
        "turn = np.array([[cosine, -sine], [sine, cosine]])",
        "turn = np.array([[cosine, sine], [-sine, cosine]])",
        (POSE + "test_a_scene_seen_from_a_pose_is_the_scene",),
    ),
    Fault(
        "an_angle_in_the_goal_does_not_turn",
        "pose.from_here",
        "problem.goal.b - shift - angle - ROUNDING",
        "problem.goal.b - shift - ROUNDING",
        (POSE + "test_a_scene_seen_from_a_pose_is_the_scene",),
    ),
    Fault(
        "plans_from_elsewhere",
        "safe_ones",
        "p0 = seen.p0 if scene.at is None else np.tile(scene.at, (len(seen.p0), 1))",
        "p0 = seen.p0 if scene.at is None else np.tile(scene.at + 0.01, (len(seen.p0), 1))",
        (POSE + "test_answers_from_here_are_sets_in_k_alone",),
    ),
    Fault(
        "of_an_option_given_twice_one_is_dropped",
        "cli._require_once",
        "names.count(name) > 1",
        "names.count(name) > 9",
        ("tests/cli/test_doubt_in_shell.py::test_bad_doubt_is_one_sentence",),
    ),
)
