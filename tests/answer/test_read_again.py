"""An answer that is read from its file says what it said: of whatever its question, its claim and
its starts were, and of all of these together.
"""

import itertools
import re

import numpy as np
import pytest
from answers_of_arcs import AMONG, FROM, KEY, LOCAL, SETTINGS, UNSURE, Sure, model, question

import parc_jax as pj

COPIES = re.compile(r" in execution 0 and \w+ in execution 1")


def require_alike(answer, path) -> None:
    again = pj.load_answer(answer.save(path))
    assert again.unchecked and not answer.unchecked
    for said in ("summary", "details"):
        # the copies of a goal's state, one for each way of execution, may be told one by one
        one, two = (COPIES.sub("", getattr(x, said)()) for x in (answer, again))
        assert two == f"{one}\n{again.unchecked}"
    assert repr(again) == repr(answer)
    assert again.risk() == answer.risk() and again.share_of_k() == answer.share_of_k()
    p0, k = answer.samples[0, :2], answer.samples[0, 2:]
    heads = [x.path(p0, k).to_csv().partition("\n")[0] for x in (answer, again)]
    assert heads[0] == heads[1]


@pytest.mark.slow
@pytest.mark.parametrize("unsure", UNSURE)
def test_an_answer_read_again_says_what_it_said(unsure, tmp_path):
    ways = list(itertools.product(("one", "bins"), FROM, AMONG))
    for claims, start, among in np.roll(ways, -list(UNSURE).index(unsure), axis=0)[::6]:
        problem = question(AMONG[among], **UNSURE[unsure])
        answer = pj.Planner(model(claims)).solve(problem, KEY, SETTINGS, at=FROM[start])
        assert answer.status.found, (claims, start, among)
        require_alike(answer, tmp_path / "answer.json")


@pytest.mark.slow
@pytest.mark.parametrize("start", FROM)
@pytest.mark.parametrize("among", AMONG)
def test_a_tested_set_and_a_local_plan_read_again_say_what_they_said(start, among, tmp_path):
    validate = pj.drive.Validate(Sure(), risk=0.1, delta=0.05, tests=300, scales=(1.0, 0.5))
    planner, at = pj.Planner(model("one", Sure)), FROM[start]
    answer = planner.solve(question(AMONG[among]), KEY, SETTINGS, at=at, validate=validate)
    require_alike(answer.validation.answer, tmp_path / "tested.json")
    assert answer.details().endswith(answer.validation.sentence)
    plan = answer.choose().localise(Sure(), KEY, LOCAL, settings=SETTINGS)
    require_alike(plan.near.answer, tmp_path / "near.json")
