"""An answer comes back from its file with the same corridors, and only if its proof holds."""

import json
from dataclasses import replace

import jax
import numpy as np
import pytest
import toy_query
from episodes import driven
from toy_file import hashed, save, toy_file
from toy_models import model_of

import parc_jax as pj
from parc_jax.answer.answer import answer_data
from parc_jax.app.files.answer_file import load_answer
from parc_jax.checker import check_answer
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import derived
from parc_jax.proof.certificate.write import part_hash
from sims.boxes_of_k import under


@pytest.fixture
def answer():
    return toy_query.answer()


def test_everything_but_timings_comes_back(answer, tmp_path, rng):
    again = load_answer(answer.save(tmp_path / "answer.json"))
    assert (again.samples == answer.samples).all() and again.cover[:4] == answer.cover[:4]
    assert again.details().startswith(answer.details()) and again.coverage == answer.coverage
    p0, k = rng.uniform(-1, 1, (2000, 2)), rng.uniform(-1, 1, (2000, 2))
    assert (again.contains(p0, k) == answer.contains(p0, k)).all()
    for mine, theirs in zip(again.corridors, answer.corridors, strict=True):
        exists = np.isfinite(mine.support)
        assert (
            (mine.w == theirs.w)[exists].all()
            and (mine.support == theirs.support).all()
            and mine.runs == theirs.runs
        )
    first, second = answer_data(answer), answer_data(again)
    assert all(first[part] == second[part] for part in ("corridors", "sets", "hash"))


def test_a_file_whose_proof_fails_is_refused(answer, tmp_path):
    data = json.loads(answer.save(tmp_path / "answer.json").read_text())
    data["samples"][0]["p0"][0] = "0x9p0"
    (tmp_path / "answer.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="the checker says"):
        load_answer(tmp_path / "answer.json")
    (tmp_path / "answer.json").write_text("{")
    with pytest.raises(InputError, match="the checker says"):
        load_answer(tmp_path / "answer.json")
    with pytest.raises(InputError, match="no such file"):
        load_answer(tmp_path / "none.json")


def test_a_proof_that_there_is_no_plan_comes_back(tmp_path):
    answer = toy_query.answer(wall=True)
    assert not answer.status.found and answer.absence.kind == "proved"
    again = load_answer(answer.save(tmp_path / "answer.json"))
    assert again.absence.unsafe == answer.absence.unsafe and again.details() == answer.details()
    assert np.shape(again.samples) == (0, 4)


def test_what_no_hash_covers_is_called_the_word_of_the_file(answer, tmp_path):
    path, whose = (
        answer.save(tmp_path / "answer.json"),
        "Read from a file, whose word alone it is: ",
    )
    found = load_answer(path)
    for said in (found.details(), found.summary(), found.choose().details()):
        assert f"{whose}how much of the safe set is covered, its share" in said
    assert whose not in answer.details() and whose not in answer.choose().details()
    data = json.loads(path.read_text())
    robust = {"words": "every start within ±9 m", "sensing_eps": "0", "parameters": [2, 2]}
    data["meta"]["doubt"] = robust | {"k_volume": "4"}
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match="it was edited, or is of an earlier form"):
        load_answer(path)
    data["meta"] = hashed(data["meta"])  # who makes the hash anew can write anything
    path.write_text(json.dumps(data))
    said = load_answer(path).details()
    assert "holds for every start within ±9 m" in said
    assert "what was looked at before and the uncertainty that the scene allows for." in said
    covered, counts = data["meta"]["coverage"], data["meta"]["counts"]
    wrong = [{"coverage": covered | {"at_least": 7}}, {"coverage": covered | {"confidence": 1}}]
    wrong += [{"coverage": covered | {"fresh_uncovered": 3}}, {"volume_of_all": "0.01"}]
    nothing = dict.fromkeys(("share", "at_least"), "0") | {"fresh_safe": 0, "fresh_uncovered": 3}
    wrong += [{"coverage": covered | nothing}, {"volume_drawn": "-1", "volume_of_all": "-9"}]
    for other in (*wrong, {"counts": counts | {"safe": counts["drawn"] + 1}}, {"ended": "luck"}):
        path.write_text(json.dumps(data | {"meta": hashed(data["meta"] | other)}))
        with pytest.raises(InputError, match="expected counts of draws and shares between 0 and 1"):
            load_answer(path)
    looks = {"delta": "1/1000", "planned": 2, "taken": 3, "others": []}
    for other in (looks, looks | {"taken": 1, "others": ["5"]}):
        path.write_text(json.dumps(data | {"meta": hashed(data["meta"] | {"looks": other})}))
        with pytest.raises(InputError, match="no more taken than planned, and deltas below 1"):
            load_answer(path)
    for other in ({"pose": ["7", "7", None]}, {"at": ["7", "7"]}):
        path.write_text(json.dumps(data | {"meta": hashed(data["meta"] | other)}))
        with pytest.raises(InputError, match="plans that start at its pose; got another"):
            load_answer(path)


def test_a_scene_says_that_it_tells_of_an_obstacle_for_some_time_alone(answer):
    said = "1 obstacle of 1 is told of for some of the 4 intervals of 0.25 s of a plan alone"
    assert said in answer.details() and f"(D) {said}" in answer.choose().details()
    always = pj.reach_avoid(toy_query.GOAL, [pj.box([-0.5, 0.3], [0, 0.6])], 0.1, spans=[(0, 3)])
    found = toy_query.planner().solve(always, jax.random.PRNGKey(0), pj.Settings(target=0.1))
    assert "(C)" in found.details() and "told of" not in found.details()
    late = pj.problem.Span((0, 3), 0.25, np.float64(3.5))  # of all of a plan, by any clock
    then = always.replace(spans=[late])
    found = toy_query.planner().solve(then, jax.random.PRNGKey(0), pj.Settings(target=0.1))
    said = said.removeprefix("1 obstacle of 1 is ").removesuffix(" alone")
    said += " that begins at 3.5 s of a clock alone"
    assert said in found.details() and said in found.choose().details() and said in found.summary()
    planner, key = toy_query.planner(), jax.random.PRNGKey(0)
    for few in (planner.prepare(then).first(key), found):
        assert " for a begin at 3.5 s of a clock" in repr(few)
    assert " for a begin at the moment of each" in repr(planner.solve_batch([then], key, draws=16))


def test_obstacles_that_always_exist_come_back_beside_those_that_do_not(tmp_path):
    blocks = [pj.box([-0.5, 0.3], [0.0, 0.6]), pj.box([-0.5, 0.7], [0.0, 0.8])]
    for spans in ([None, (1, 3)], [pj.problem.Span((0, 3), 0.25, 0.0), None]):
        asked = pj.reach_avoid(toy_query.GOAL, blocks, 0.1, spans=spans)
        found = toy_query.planner().solve(asked, jax.random.PRNGKey(0), pj.Settings(target=0.1))
        back = load_answer(found.save(tmp_path / "answer.json"))
        assert back.problem.spans == found.problem.spans and back.details()
        for mine, theirs in zip(back.problem.spans, found.problem.spans, strict=True):
            assert mine is theirs is None or vars(mine) == vars(theirs)


@pytest.mark.parametrize("proved", [False, True])
def test_that_there_is_no_plan_is_said_of_the_same_time_alone(proved, tmp_path):
    on_the_goal = [pj.box([-0.5, -0.5], [0.5, 0.5])]
    then = [pj.problem.Span((3, 3), 0.25, 3.5, said="That it comes was seen.", mover="one")]
    asked = pj.reach_avoid(toy_query.GOAL, on_the_goal, 0.1, spans=then)
    none = toy_query.planner().solve(asked, jax.random.PRNGKey(0), pj.Settings())
    none = none if proved else replace(none, absence=None)
    assert (none.status.label == "no-plan") == proved
    said = "1 obstacle of 1 is told of for some of the 4 intervals of 0.25 s of a plan"
    for text in (none.details(), none.summary()):
        assert f"{said} that begins at 3.5 s of a clock alone" in text
        assert "That it comes was seen." in text
    if proved:
        back = load_answer(none.save(tmp_path / "none.json"))
        (span,), said = back.problem.all_spans, f"{said} that begins at 3.5 s"
        assert vars(span) == vars(then[0])
        assert said in back.details() and said in back.summary()
        assert "That it comes was seen." in back.details()
        assert "in the world, and the moment when a plan begins." in back.details()
        assert (span.dt, span.at) == (0.25, 3.5)


@pytest.mark.slow
def test_bins_without_a_claim_stay_without(tmp_path):
    whole = toy_query.planner().model
    interval, final = (
        np.concatenate([wide, np.full_like(wide, np.inf)])
        for wide in (whole.tube.interval, whole.tube.final)
    )
    model = model_of(whole.net, whole.domain, interval, final, [[-1, 0, 1], [-1, 1]])
    answer = pj.Planner(model).solve(
        toy_query.gap(),
        jax.random.PRNGKey(0),
        pj.Settings(samples=3, target=0.3, budget_s=300),
    )
    again = load_answer(answer.save(tmp_path / "answer.json"))
    assert again.model.tube.claimed.tolist() == [True, False]


def edited(answer, path):
    """The file, its hashes those of what it says now."""
    for name in ("problem", "network", "tube", "claim"):
        answer["hash"][name] = part_hash(answer[name])
    return save(path, answer)


def test_an_answer_is_about_what_its_claim_is_about(tmp_path):
    """Time steps are compared by the checker; all else that its hash covers is asked here."""
    path = tmp_path / "answer.json"
    assert load_answer(edited(toy_file(), path)).model.time.dt == 0.25
    slower = toy_file()
    slower["problem"]["dt"] = "0.5"
    with pytest.raises(InputError, match="the claim is about another time step"):
        load_answer(edited(slower, path))
    for part, other in (("rotation", ["turns"]), ("points", ["nose"]), ("system", "another")):
        answer = toy_file()
        answer["claim"]["subject"][part] = other
        with pytest.raises(InputError, match="made about"):
            load_answer(edited(answer, path))


def test_what_contradicts_itself_is_refused_though_its_hashes_fit(answer, tmp_path):
    """A heading that the claim does not turn, copies of points without their uncertainty."""
    data = json.loads(answer.save(tmp_path / "answer.json").read_text())
    at = {"at": ["0x0p+0", "0x0p+0"], "pose": ["0.0", "0.0", "1.2"]}
    data["meta"] = hashed(data["meta"] | at)
    with pytest.raises(InputError, match="and fits its claim"):
        load_answer(save(tmp_path / "turned.json", data))
    data = json.loads((tmp_path / "answer.json").read_text())
    data["meta"] = hashed(data["meta"] | {"places": [["base\nIt is safe", 0, 0]]})
    with pytest.raises(InputError, match="places: expected text on one line"):
        load_answer(save(tmp_path / "line.json", data))
    model = answer.model.replace(
        claim=derived(answer.model.claim, evidence={"network_of_runs": ""})
    )
    other = replace(answer, scene=under(answer.scene, model)).save(tmp_path / "copies.json")
    with pytest.raises(InputError, match="and fits its claim"):
        load_answer(other)


@pytest.mark.slow  # compiles for a loop
def test_the_certificate_of_one_manoeuvre_is_no_set_of_plans(tmp_path):
    """It ended in a KeyError; `explain`, `plot` and `header` read by this."""
    place = tmp_path / "one.json"
    place.write_text(json.dumps(driven(False, 1)[0].certificate()))
    assert check_answer(json.loads(place.read_text())).samples == 1
    with pytest.raises(InputError, match=r"expected a set of plans.*one plan's certificate"):
        load_answer(place)
