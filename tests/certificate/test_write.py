"""Certificates spell the numbers they are about, exactly; the checker reads the same; what claims
more fails.
"""

import copy
import json
from fractions import Fraction
from pathlib import Path

import jax
import numpy as np
import pytest
from toy_models import (
    TRIANGLE,
    anchored_plans,
    line_model,
    model_of,
    random_model,
    random_problem,
    toy_case,
)

from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.common.sets.box import box
from parc_jax.common.spelling import fraction_text
from parc_jax.planner.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import (
    network_part,
    part_hash,
    problem_part,
    sample_part,
    tube_part,
)
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

GOAL = box([-0.5, -0.5, -3], [0.5, 0.5, 3])


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A small answer, its polytopes, and the file of both."""
    model, problem = toy_case(4)
    problem = problem.replace(spans=((0, 2), None))
    answer = Planner(model).solve(
        problem, jax.random.key(0), Settings(target=0.2, samples=12, budget_s=300)
    )
    cut = answer.polytopes(jax.random.key(1), 200)
    path = answer.save(tmp_path_factory.mktemp("answers") / "a.json", cut)
    return answer, cut, json.loads(path.read_text()), path


def test_numbers_are_spelled_exactly(rng):
    model = random_model(rng)
    problem = random_problem(rng, model, 2, "polygon", start=True)
    part, net, tube = problem_part(problem, model), network_part(model.net), tube_part(model.tube)
    for W, spelled in zip(model.net.weights, net["weights"], strict=True):
        assert [[float.fromhex(v) for v in row] for row in spelled] == W.tolist()
    assert [
        [[float.fromhex(v) for v in e] for (e,) in b] for b in tube["interval"]
    ] == model.tube.interval.tolist()
    for o, spelled in zip(problem.obstacles, part["obstacles"], strict=True):
        assert [checker.number(v) for v in spelled["b"]] == [Fraction(v) for v in o.b]
    (own,) = part["body"]["parts"]
    assert own["points"] == [0] and part["points"] == 1
    assert [[checker.number(v) for v in p] for p in own["vertices"]] == [
        [Fraction(v) for v in p] for p in problem.body.vertices
    ]
    assert checker.number(part["dt"]) == Fraction(model.time.dt)
    written = problem_part(reach_avoid(GOAL, [box([31.3, 0], [32, 0.1])], 0.1), line_model(4))
    exact = [checker.number(v) for v in written["obstacles"][0]["b"]]
    assert exact == [32, Fraction(0.1), -Fraction(31.3), 0] != [32, Fraction("0.1"), -31.3, 0]
    assert written["obstacles"][0]["b"][0] == "32" and written["obstacles"][0]["b"][3] == "-0"


def test_fractions_are_spelled_as_fractions():
    third, tiny = Fraction(1, 3), Fraction(1, 2**1100)
    spelled = fraction_text([third, tiny, Fraction(2)])
    assert [checker.number(text) for text in spelled] == [third, tiny, 2] and spelled[0] == "1/3"


def test_hashes_see_every_number(rng):
    model = line_model(4, 0.01)
    tube = tube_part(model.tube)
    before = part_hash(tube)
    changed = copy.deepcopy(tube)
    changed["interval"][0][2][0][1] = (0.01 + 2.0**-58).hex()
    assert part_hash(changed) != before and part_hash(json.loads(json.dumps(tube))) == before


def test_saved_answers_hold_no_floats_and_are_accepted(saved):
    answer, cut, data, path = saved

    def walk(x):
        assert not isinstance(x, float)
        for y in x.values() if isinstance(x, dict) else x if isinstance(x, list) else ():
            walk(y)

    walk(data)
    report = checker.check_answer(checker.load(path))
    assert report.samples == len(answer.samples) == 12 and report.sets == len(cut) > 0
    assert data["meta"]["status"] == "exact-proved"


def test_the_command_line_accepts_the_file_without_the_package(saved, tmp_path):
    import shutil
    import subprocess
    import sys

    _, _, data, path = saved
    shutil.copytree(Path(checker.__file__).parent, tmp_path / "alone")

    def run(p):
        return subprocess.run([sys.executable, "-I", tmp_path / "alone", p], capture_output=True)

    assert run(path).returncode == 0
    data = copy.deepcopy(data)
    data["samples"][0]["p0"][0] = (float.fromhex(data["samples"][0]["p0"][0]) + 5).hex()
    bad = tmp_path / "bad.json"
    bad.write_text(json.dumps(data))
    assert run(bad).returncode == 1


def mutants(data):
    """Changed answers that claim more than was proved: (name, answer)."""

    def change(name, edit):
        other = copy.deepcopy(data)
        edit(other)
        return name, other

    def rehash(other):
        for part in ("problem", "network", "tube"):
            other["hash"][part] = part_hash(other[part])
        other["claim"]["network_hash"], other["claim"]["tube_hash"] = (
            other["hash"]["network"],
            other["hash"]["tube"],
        )

    def edit_problem(other):
        other["problem"]["body"]["parts"][0]["radius"] = "0.5"
        rehash(other)

    def edit_tube(other):
        other["tube"]["interval"] = [[[["0.5", "0.5"]]] * 4] * 2
        rehash(other)

    def edit_steps(other):
        del other["problem"]["obstacles"][0]["steps"]
        rehash(other)

    def edit_network(other):
        other["network"]["biases"][-1][5] = "0.75"
        rehash(other)

    def edit_goal(other):
        other["problem"]["goal"]["b"][0] = "-0.49"
        rehash(other)

    yield change(
        "radius without hash", lambda o: o["problem"]["body"]["parts"][0].update(radius="0.07")
    )
    yield change("bigger body", edit_problem)
    yield change("wider tube", edit_tube)
    yield change("longer presence", edit_steps)
    yield change("other network", edit_network)
    yield change("smaller goal", edit_goal)
    yield change("k outside", lambda o: o["samples"][0]["k"].__setitem__(0, "0x1.8p+0"))
    yield change("dropped obstacle", lambda o: o["samples"][0]["sep"].pop())
    yield change("run too short", lambda o: o["sets"][0]["sep"][0][0].pop())
    yield change(
        "negative multiplier", lambda o: o["sets"][0]["sep"][0][0][0][1][0].__setitem__(1, "-1")
    )
    yield change("point outside", lambda o: o["sets"][0]["p0"].__setitem__(0, "0x1.0p+4"))


def test_answers_that_claim_more_are_rejected(saved):
    for name, other in mutants(saved[2]):
        with pytest.raises(checker.Rejected):
            checker.check_answer(other)
            pytest.fail(name)


def test_prove_keeps_what_holds_and_drops_what_does_not(saved):
    answer, cut, *_ = saved
    parts = copy.deepcopy(answer.certificates)
    parts[3]["p0"][0] = (float.fromhex(parts[3]["p0"][0]) + 3).hex()
    kept, _, polytopes = prove(answer.problem, answer.model, parts, polytopes=cut.all)
    assert polytopes.all() and kept.tolist() == [i != 3 for i in range(12)]


@pytest.mark.parametrize("body", [0.08, TRIANGLE], ids=["disc", "polygon"])
def test_every_clear_plan_of_random_scenes_has_a_certificate_that_holds(body):
    proved = 0
    for seed in range(6):
        model, problem = toy_case(60 + seed, body, start=True)
        scene = scene_of(problem, model)
        p0, k = anchored_plans(np.random.default_rng(seed), model, 60)
        e = verdicts(scene, p0, k)
        context = checker.Context(
            problem_part(problem, model), network_part(model.net), tube_part(model.tube)
        )
        for i in np.flatnonzero(e.safe & (e.clearance > 1e-6)):
            part = sample_part(scene, model.tube, p0[i], k[i], e.path[i])
            context.check_sample(part)
            assert len(json.dumps(part, separators=(",", ":"))) <= 1000
            proved += 1
    assert proved > 40


def test_a_model_whose_bins_lack_a_claim_is_answered_in_the_others():
    model, problem = toy_case(2)
    interval, final = np.array(model.tube.interval), np.array(model.tube.final)
    interval[1], final[1] = np.inf, np.inf
    model = model_of(model.net, model.domain, interval, final, model.tube.edges)
    answer = Planner(model).solve(
        problem, jax.random.key(0), Settings(target=0.2, samples=5, budget_s=300)
    )
    assert answer.status.found and (answer.samples[:, 3] < 0).all() and answer.cover.refused == 0
    checker.check_answer(json.loads(json.dumps(answer_data(answer))))
