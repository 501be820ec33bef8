"""The page holds the numbers of the answer, nothing foreign; only an answer that was checked gets
to it.
"""

import json
import re
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
import toy_query
from toy_file import save, toy_file, toy_scene
from toy_models import host_outputs

from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.page import page_data, write_page
from parc_jax.common.errors import InputError
from parc_jax.problem.robust.realisations import Robustness
from parc_jax.problem.world.moving import Span
from parc_jax.proof.absence.prove_no_plan import PROVED, NoPlan
from parc_jax.proof.certificate.prove import corridor_of
from parc_jax.safe_set.corridors.polytopes import Polytopes, SafePolytope
from parc_jax.safe_set.corridors.stopping import nothing_covered


def embedded(page: str) -> dict:
    """The data block of a page."""
    return json.loads(
        re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S).group(1)
    )


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    return load_answer(save(tmp_path_factory.mktemp("toy") / "answer.json", toy_file()))


def cut_of(answer):
    """The two polytopes of the file: a page draws those that it is given."""
    parts = toy_file()["sets"]
    cut = []
    for part in parts:
        corridor = corridor_of(answer.scene, part)
        pattern = np.array([bit == "1" for bit in part["pattern"]], bool)
        cut.append(
            SafePolytope(answer.scene, corridor.p0, corridor.k, pattern, part["bin"], corridor)
        )
    return Polytopes(answer.scene, cut, nothing_covered(0.99), proved=True)


def test_the_page_is_whole_and_needs_no_network(loaded, tmp_path):
    page = write_page(loaded, tmp_path / "page.html").read_text()
    foreign = ["http:", "https:", " src=", "@import", "url(", "fetch(", "import("]
    for words in (*foreign, "XMLHttpRequest", "WebSocket"):
        assert words not in page
    assert not re.search(r"/\*[A-Z]+\*/", page)  # every part is in
    assert (
        page.count("<script") == page.count("</script>") == 4
    )  # a name from the file cannot end the data block
    assert embedded(page)["system"] == "toy </script><b>"


def test_numbers_survive_exactly(loaded):
    model, problem = toy_scene()
    data = page_data(loaded, cut_of(loaded))
    assert all(
        (np.array(W) == V).all()
        for W, V in zip(data["network"]["weights"], model.net.weights, strict=True)
    )
    assert (np.array(data["tube"]["interval"]) == model.tube.interval).all()
    assert (np.array(data["goal"]["b"]) == problem.goal.b).all()
    assert data["samples"][0]["k"] == [0.9, 0.0625]
    # both samples, both polytopes and the corridor have the same directions, kept once
    assert len(data["directions"]) == 1
    kinds = ("samples", "polytopes", "corridors")
    assert [part["sep"] for kind in kinds for part in data[kind]] == [0] * 5
    over, under = data["directions"][0]
    first, last = over
    assert first[:3] == [0, 2, [-1.0, -1.0]]
    assert first[3] == pytest.approx(0.5 - 0.3 + 0.1 * np.sqrt(2))
    assert last[:2] == [2, 4]
    assert under[0][2] == [0, 0.75] and under[0][3] == pytest.approx(0.75 * (-0.3 + 0.1))


def test_the_corridors_of_an_answer_are_on_its_page():
    answer = toy_query.answer()
    data = page_data(answer)
    assert len(data["corridors"]) == len(answer.corridors) > 0
    assert (
        data["corridor_share"] == answer.coverage.at_least > 0
        and data["set"] == "the model's safe set under an assumed tube"
    )
    some = SimpleNamespace(box=np.zeros((2, 4)))
    found = replace(answer, cover=answer.cover._replace(within=some))
    assert page_data(found)["set"].endswith("around what a search found") and page_data(found)[
        "set"
    ] in repr(found)
    for corridor, part in zip(answer.corridors, data["corridors"], strict=True):
        ((first, end, w, support),) = data["directions"][part["sep"]][0][:1]
        assert w == corridor.w[0, first].tolist() and support == corridor.support[0, first]
        assert first == 1 and end <= 4  # the obstacle exists in intervals 1 to 3


def test_outlines_hold_the_plans_of_their_polytopes(loaded, rng):
    cut = cut_of(loaded)
    data = page_data(loaded, cut)
    starts, parameters = data["outlines"]["0,1"], data["outlines"]["2,3"]
    assert len(starts) == len(parameters) == 2
    assert min(y for _, y in parameters[0]) == pytest.approx(0, abs=1e-6)
    for number, safe in enumerate(cut.project(range(4))):
        inner = rng.dirichlet(np.full(len(safe), 0.3), 300) @ safe
        y = host_outputs(loaded.model.net, inner[:, 2:])
        steps = np.concatenate([np.zeros((300, 1, 2)), y[:, :8].reshape(-1, 4, 2)], axis=1)
        path = inner[:, None, :2] + steps
        assert (np.abs(path[:, -1]) <= 0.2 - 0.02 + 1e-9).all()
        assert (path[:, :, 1] > -0.3 + 0.12 - 1e-9).all()
        sign = 1 if number == 0 else -1
        assert (sign * inner[:, 3] >= -1e-9).all()  # its own region


def test_a_doctored_answer_gets_no_page(tmp_path):
    """What the page calls proved was checked when it was written."""
    answer = toy_file()
    answer["samples"][0]["p0"] = ["-0.9", "0.5"]
    save(tmp_path / "answer.json", answer)
    with pytest.raises(InputError, match="the checker says: sample"):
        load_answer(tmp_path / "answer.json")


def test_the_page_has_what_its_question_rests_on(loaded):
    """One start, the moment of a clock, given parameters; and the sentence that was proved where
    there is no plan.
    """
    data = page_data(loaded)
    assert data["at"] is None and not data["doubt"]
    of_runs = "All plans start with the heading of the model's runs."
    assert data["about"] == [of_runs] and data["absence"] == ""
    asked = loaded.scene.nominal
    known = Robustness("k0 = 0.5 (measured)", Fraction(0), (2, 1), 2.0, False)
    at = replace(asked, at=np.array([-0.9, -0.05]), uncertainty=known)
    spans = (Span((1, 3), loaded.model.time.dt, 3.0), None)
    at = replace(at, problem=replace(asked.problem, spans=spans))
    data = page_data(replace(loaded, scene=replace(loaded.scene, nominal=at)))
    assert data["at"] == [-0.9, -0.05] and data["doubt"]
    told, safe, start = data["about"]
    assert (
        start == of_runs
        and "a plan that begins at 3.0 s of a clock" in told
        and "k0 = 0.5 (measured)" in safe
    )
    none = NoPlan(PROVED, Fraction(1), Fraction(0), Fraction(1), uncertainty=known, box="N")
    assert page_data(replace(loaded, absence=none))["absence"] == none.details()
