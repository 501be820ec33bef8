"""An answer in words, for terminals and notebooks."""

from dataclasses import replace

import jax
import numpy as np
from toy_models import fold_model, line_model, told, toy_case
from toy_query import GOAL, START, answer, gap
from turning_bar import straight_bar

from parc_jax.answer.answer import answer_data
from parc_jax.app.files.answer_file import load_answer
from parc_jax.checker.answer import scene_of
from parc_jax.checker.claim import BOX
from parc_jax.common.premises import ASSUMED
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.common.status import Ended
from parc_jax.learning.bound.claim import derived, weaker
from parc_jax.learning.bound.tube import tube
from parc_jax.planner import Planner
from parc_jax.problem.body import hull
from parc_jax.problem.problem import goal_of_points, reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.absence.prove_no_plan import UNDECIDED, NoPlan
from parc_jax.safe_set.corridors.stopping import nothing_covered
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import lowered
from parc_jax.statement import nothing_found
from sims.boxes_of_k import under


def found(**changes):
    """The toy's answer, with a name that is no text of a notebook; cover changed."""
    scene = under(answer().scene, told(answer().model, system="<b>toy</b> & co"))
    return replace(answer(), scene=scene, cover=answer().cover._replace(**changes))


def nothing():
    """An answer without a plan, without a proof that none exists."""
    return replace(found(corridors=[], ended=Ended.WORK), samples=answer().samples[:0])


def test_names_of_others_are_text_in_a_notebook():
    page = found()._repr_html_()
    assert "&lt;b&gt;toy&lt;/b&gt; &amp; co: exact-proved, 5 plans" in page and "<b>toy" not in page
    assert page.count("<li>") == len(found().details().split("\n"))


def test_what_is_proved_comes_first_then_the_tube_then_the_risk():
    lines = found().details().split("\n")
    assert [line.split(" ")[0] for line in lines] == ["(C)", "All", "(E)", "Risk:", "Search:"]
    assert "proved in exact arithmetic" in lines[0]
    assert "proved in exact" not in found(proved=False).details().split("\n")[0]
    # the body, obstacles and starts, as the checker of its file has them
    scene = scene_of(answer_data(found())["problem"])
    assert "body (point 0 grown by 0.1 m) among 1 convex obstacle" in scene
    assert f" It is of {scene}. " in lines[0]


def test_where_nothing_is_found_from_a_start_set_without_width_that_is_said():
    """It asked for more work, and none of it finds a plan there."""
    flat, wide = box([-0.1, 0.0], [0.1, 0.0]), box([-0.1, -1e-6], [0.1, 1e-6])
    for start, said in ((flat, True), (wide, False)):
        scene = lowered(query(gap().replace(start=start), line_model(4, 0.01)).nominal())
        told = replace(nothing(), scene=scene).summary()
        assert ("The start set has no width along y: give it some" in told) == said


PART = "[-0.5, 0] x [-1, 1]"  # of the K of the toy


def asked_of_a_part(one):
    """The answer to the same question with k from a part of K, as sliders ask for it."""
    lo, hi = np.array([[-0.5, -1.0], [0.0, 1.0]])
    return replace(one, scene=replace(one.scene, k_lo=lo, k_hi=hi))


def test_an_answer_with_k_from_a_part_of_K_says_so_everywhere_and_in_its_file(tmp_path):
    """It said "all k in K", and its file drew from all of it."""
    one, none = asked_of_a_part(answer()), asked_of_a_part(nothing())
    held = one.sample(jax.random.PRNGKey(0), 200)
    assert held[:, 2].max() <= 0.0 and answer().sample(jax.random.PRNGKey(0), 200)[:, 2].max() > 0.0
    again = load_answer(one.save(tmp_path / "part.json"))
    assert (again.sample(jax.random.PRNGKey(0), 200) == held).all()
    assert "the part of K that was asked for" in again.unchecked and not one.unchecked
    for each in (one, again):
        assert (
            f"% of the model's safe set under an assumed tube with k in {PART} (confidence"
            in repr(each)
        )
        _, _, share, covered, *_ = each.summary().split("\n")
        assert f"of the plans with k in {PART} whose first point ends in" in share
        assert f"% of the safe set under an assumed tube with k in {PART} (at least" in covered
        assert (
            f"Plans were asked for with k in {PART}, a part of K, and no others." in each.details()
        )
    assert repr(none).endswith(f": not-found under an assumed tube with k in {PART}>")
    assert none.details().startswith(f"No safe plan was found with k in {PART}. This is")
    assert "k in [" not in repr(answer()) + answer().summary() + answer().details()
    assert "k" not in answer_data(answer())["meta"]


def test_a_proof_of_absence_is_of_the_box_of_its_model(tmp_path):
    """The model near a plan is one of a small box N: others, with k beyond, may be safe."""
    model = fold_model(T=4, e=0.02)
    law = replace(model.claim.law, parameters=((BOX, "N"),))
    near = model.replace(claim=derived(model.claim, law=law))
    far = box([3.5, -0.25, -9.0], [4.0, 0.25, 9.0])
    for goal, blocks in ((far, []), (GOAL, gap(wall=True).obstacles)):
        asked = reach_avoid(goal, blocks, 0.1, START)
        few = Settings(samples=5, work=0.1, budget_s=300)
        none = Planner(near).solve(asked, jax.random.PRNGKey(0), few)
        again = load_answer(none.save(tmp_path / "none.json"))
        for each in (none, again):
            assert each.status.label in repr(each) and repr(each).endswith(" with k in N>")
            assert "the model has no safe (p0, k) with k in N with this tube; a" in each.summary()
            assert (" from the start set, whatever its k in N: " in each.details()) == (goal is far)
            assert ("Whatever k in N, every run inside" in each.details()) == (goal is far)
    assert "of the plans with k in N whose" in NoPlan(UNDECIDED, 0, 1, 1, box="N").details()


def posed(model, goal, body=0.1):
    """`nothing` in another question: its goal and its body are told in the answer's sentences."""
    return replace(nothing(), scene=lowered(query(reach_avoid(goal, [], body), model).nominal()))


def test_the_goal_is_told_in_numbers_with_what_it_asks_nothing_of():
    """A goal told in degrees of an angle in rad is met by any k: (C) is no word of it."""
    of, line = "x [m] from -0.25 to 0.25, y [m] from -0.25 to 0.25", line_model()
    assert f" Its goal: {of} and q0 from -1 to 1. Of a plan" in found().details()
    wide = posed(line, box([-0.25, -0.25, -15.0], [0.25, 0.25, 15.0])).details()
    asked = f"Its goal: {of} and q0 from -15 to 15."
    free = "every run inside the tube ends so in q0, of which nothing is asked there."
    assert f"{asked} Whatever k, {free}" in wide
    rows = [[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 0]]
    cut = posed(line, hpolytope(rows, [0.25] * 4 + [0.5] * 3)).details()
    assert f"Its goal: 1 half-space across axes, {of} and q0 from -0.5 to 0.5. Of" in cut
    rows = [*rows[:4], [0.0, 0, 0.01], [0, 0, -0.01], [1, 0, 1]]  # which asks for q0 all the same
    told = posed(line, hpolytope(rows, [0.25] * 4 + [0.15] * 3)).details()
    assert "q0 from -15 to 15. Of a plan" in told


def test_reference_points_beside_the_body_are_named():
    """Where the body is told by some of a model's points alone, the others may touch."""
    bar = straight_bar()
    goal = goal_of_points(bar.points, {"tail": box([0.2, -0.1], [0.4, 0.1])}, box([-1.0], [1.0]))
    alone = posed(bar, goal).details()
    assert (
        "No part of it is told by nose: of those nothing is said. Its goal: x [m] of tail" in alone
    )
    assert "is told by" not in posed(bar, goal, hull("tail", "nose")).details()


def test_the_summary_is_short_and_names_every_assumption():
    for one in (found(), nothing(), answer(wall=True)):
        lines = one.summary().split("\n")
        assert len(lines) <= 15 and lines[0].startswith("Answer for")
        assert "All plans start with the heading of the model's runs." in lines
        names = [entry.name for entry in one.model.claim.premises if entry.standing == ASSUMED]
        assert lines[-1].startswith(f"Holds if ({len(names)} assumption")
        names = ["LAW" if name == "law" else name for name in names]
        assert names and all(name in lines[-1] for name in names)
        assert "tube (ASSUMED, not shown)" in lines[-1]  # the toy's tube is
    assert found().details().split("\n")[3] in found().summary()  # the risk
    assert "Status: safe plans in hand, shown in float64" in found(proved=False).summary()


def test_where_nothing_was_found_nothing_is_promised():
    none, scene, starts, tube, ended = nothing().details().split("\n")
    assert (none, ended) == (nothing_found(None), Ended.WORK.sentence)
    assert starts == "All plans start with the heading of the model's runs."
    assert scene.startswith("It is of a body") and tube.startswith("(E) ASSUMED")
    assert repr(nothing()) == ("<Answer for <b>toy</b> & co: not-found under an assumed tube>")


def test_coverage_that_was_not_measured_has_no_number():
    """A first plan alone had "at least 0 %", with a confidence."""
    measured, one = found(), found(coverage=nothing_covered(0.99), corridors=[])
    tube = " under an assumed tube"
    assert f"% of the model's safe set{tube} (confidence " in repr(measured)
    assert repr(one).endswith(f"0 corridors{tube}>")
    assert "%" not in repr(one) and "confidence" not in repr(one)
    assert "they cover was not measured" in one.summary()


def test_a_value_on_the_edge_of_a_bin_without_claim_is_told():
    """In both bins, so in one without a claim: no plan, and a word why."""
    model, problem = toy_case(0)
    half, final = (np.array([x[0], np.full_like(x[1], np.inf)]) for x in _widths_of(model))
    claim = weaker(model.claim, tube(model.tube.edges, half, final))
    for value, known_why in ((0.0, True), (np.nextafter(0, -1), False)):
        asked = problem.replace(uncertainty=Uncertainty(given={"k1": value}))
        known = query(asked, model.replace(claim=claim)).nominal()
        empty = nothing()
        empty = replace(empty, scene=lowered(known))
        said = empty.details()
        assert (
            "that have a claim; a value on an edge is in the bins on both sides" in said
        ) == known_why
        assert f"safe for k1 = {value if value else 0}" in said


def _widths_of(model):
    return model.tube.interval, model.tube.final
