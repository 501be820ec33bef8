"""The measured scenes and comparisons on a tiny model: narrowed gaps, both methods agree, failures
are seen.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from gap_model import arc_network, arc_tube, gap_problem
from matplotlib.figure import Figure
from toy_models import model_of, told

from benchmarks.bench import Bench
from benchmarks.cases import Case, case
from benchmarks.models import PARC, CaseModels, Claims, name_of
from benchmarks.neuralparc.by_lp import avoid_set
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.scene import paper_scene
from benchmarks.neuralparc.sets.affine import membership
from benchmarks.published import Partition, kept
from benchmarks.rectangle_gap import Narrowest
from benchmarks.workloads import bras, gap
from parc_jax.common.sets.box import box
from parc_jax.learning.network.fit import fit_affine
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

T, DOMAIN = 4, box([4.0, -0.4], [6.0, 0.4])
QUICK = Bench(quick=True)


@pytest.fixture(scope="module")
def model():
    t = arc_tube(T, size=0.005)
    return model_of(arc_network(T), DOMAIN, t.interval, t.final, t.edges)


@pytest.fixture(scope="module")
def learned(model):
    rng = np.random.default_rng(0)
    k = rng.uniform(DOMAIN.lo, DOMAIN.hi, (50, 2))
    outputs = np.array([model.net(x) for x in k])
    straight = told(model, fit_affine(k, outputs))
    toy = Case(
        "toy",
        None,
        lambda: gap_problem(2.0),
        ((6, 5),),
        (9,),
        (1, 1),
        1,
        2.0 - 0.6,
        0.3,
        None,
        {},
    )
    both = {PARC: Claims(straight, straight), (6, 5): Claims(model, model)}
    return CaseModels(toy, None, None, both, 0.05)


@pytest.mark.parametrize("name", ["drift", "boat"])
def test_narrowed_scenes_leave_the_slack_that_they_say(name):
    scene_ = case(name)
    radius = scene_.problem().body.radius
    for slack in (scene_.slack, 0.5):
        problem = scene_.narrowed(slack)
        low, high = sorted(problem.obstacles, key=lambda o: o.b[scene_.axis])
        room = -high.b[2 + scene_.axis] - low.b[scene_.axis] - 2 * radius
        assert room == pytest.approx(slack, abs=1e-12)
        moved = np.mean([(o.b[:2] - o.b[2:]) / 2 for o in problem.obstacles], axis=0)
        before = np.mean([(o.b[:2] - o.b[2:]) / 2 for o in scene_.problem().obstacles], axis=0)
        np.testing.assert_allclose(moved, before, atol=1e-12)  # the gap stays where it was


@pytest.mark.night
def test_published_keeps_exactly_what_no_avoid_set_contains(model, rng):
    problem = gap_problem(2.0)
    parts = Partition(model, enumerate_regions(model.net, DOMAIN))
    k = rng.uniform(DOMAIN.lo, DOMAIN.hi, (40, 2))
    p0 = np.stack([rng.uniform(4.0, 6.0, 40), rng.uniform(-1.0, 1.0, 40)], axis=1)
    bins = model.tube.bin_of(k)
    ours = kept(parts, problem, p0, k, bins)
    grown = paper_scene(problem, model.tube).grown
    for i, number in enumerate(parts.cell_of(k, bins)):
        cell = parts.cells[number]
        sets = [
            avoid_set(cell, grown.at(int(bins[i]), t, j), t) for t in range(T) for j in range(2)
        ]
        by_lp = all(membership(one, p0[i]).status is LPStatus.INFEASIBLE for one in sets)
        assert by_lp == ours[i]
    assert 0 < ours.sum() < 40
    safe = verdicts(scene_of(problem, model), p0, k)
    assert (safe.clearance[ours] > 0).all()  # what it keeps is clear; the converse does not hold


@pytest.mark.night
def test_lp_and_lp_free_agree_and_both_are_timed(model):
    c = bras.compare(model, gap_problem(2.0), QUICK, starts=3)
    assert c.regions == enumerate_regions(model.net, DOMAIN).count > c.measured == 2
    assert c.lp_s > 0 and (c.free_s > 0).all() and c.unknown == 0
    assert c.contradictions == 0


@pytest.mark.slow
def test_the_gap_workload_orders_the_methods(learned, monkeypatch):
    monkeypatch.setattr(gap, "narrowest_for_rectangle", lambda key, quick: Narrowest(0.5, True))
    learned = learned._replace(case=replace(learned.case, length=0.45))
    bench = Bench(quick=True, known={"boat": learned})
    result = gap.run(bench)
    shares = {c["name"]: np.array(c["share"]) for c in result.data["curves"]}
    assert (shares["ours, 6-5"] >= shares["published, 6-5"]).all() and shares["ours, 6-5"][0] > 0
    assert {m.key: m.value for m in result.metrics}["gap.ours.6-5.not_proved"] == 0
    *discs, rectangle = result.tables[1].rows  # the circle of the toy is 0.6 m across
    assert rectangle == ("ours, true rectangle", "-0.10 m", "0.05 m", "yes", "")
    for row in discs:
        assert row[1] == "none" or float(row[2][:-2]) == pytest.approx(float(row[1][:-2]) + 0.15)
    assert {m.key: m.value for m in result.metrics}["gap.ours.rectangle.narrowest"] < 0
    axes = Figure().subplots(2)
    gap.figure(json.loads(json.dumps(result.data)), axes)
    rows = [label.get_text() for label in axes[1].get_yticklabels()]
    assert rows == [row[0] for row in result.tables[1].rows]
    lines = [line.get_xydata() for line in axes[1].lines if line.get_marker() == "None"]
    drawn = [line for line in lines if (line[:, 1] == len(rows) - 1).all()]
    np.testing.assert_allclose(drawn, [[(-0.1, len(rows) - 1), (0.05, len(rows) - 1)]])
    assert name_of((8, 8, 8, 8)) == "4x8" and name_of(PARC) == "affine"
