"""Ends of K and borders between bins mean the same to the engine, to the exact checker and to the
page: ends belong to K, as the floats that they are; a polytope is open where bins meet.
"""

import json
import shutil
import subprocess
from pathlib import Path

import jax
import numpy as np
import pytest
from needs import need
from rows_of_sets import set_rows
from toy_file import answer_file, save
from toy_models import line_model, model_of, uniform_tube

import parc_jax
from parc_jax import checker
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.page import page_data
from parc_jax.common.sets.box import box
from parc_jax.common.spelling import hex_text
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import (
    network_part,
    polytope_part,
    problem_part,
    sample_part,
    tube_part,
)
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

PAGE = [
    Path(parc_jax.__file__).parent / "app" / "plot" / "page" / part
    for part in ("geometry.js", "model.js")
]
END = 1.6  # the float64 above 8/5
PROBLEM = reach_avoid(box([-0.5, -0.5, -3], [0.5, 0.5, 3]), [box([-1, 0.4], [3, 0.8])], 0.1)

pytestmark = pytest.mark.soundness


def model(edges):
    """c_t = (t / 4) k over K = [-END, END]^2, with the same widths in every bin."""
    n_bins = (len(edges) - 1) ** 2
    widths = [np.repeat(part, n_bins, axis=0) for part in uniform_tube(4, 0.02)]
    return model_of(line_model(4).net, box([-END, -END], [END, END]), *widths, [edges, edges])


WIDTHS = [0.02, 0.05, 0.1, 0.15]  # [m] of the bins around the middle of K, row-major
EDGES = [
    ([0.0, 0.0], {0, 1, 2, 3}),
    ([0.0, 0.5], {1, 3}),
    ([-0.5, 0.0], {0, 1}),
    ([END, 0.0], {2, 3}),
    ([0.0, END], {1, 3}),
    ([-END, 0.5], {1}),
]


def of_widths():
    """The same robot, as exactly known as WIDTHS say."""
    half = np.reshape(WIDTHS, (4, 1))
    interval, final = np.tile(half[:, None], (1, 4, 2)), np.tile(half, (1, 3))
    edges = [np.array([-END, 0.0, END])] * 2
    return model_of(line_model(4).net, box([-END, -END], [END, END]), interval, final, edges)


def by_the_page(folder, asked, plans, edges=None):
    """(safe, level above none) by the script of the page, for plans (p0, k)."""
    need("node")
    node = shutil.which("node")
    data = page_data(load_answer(save(folder / "answer.json", answer_file(asked, PROBLEM))))
    data["tube"]["edges"] = edges or data["tube"]["edges"]
    script = "".join(part.read_text() for part in PAGE)
    script += f"""
const model = makeModel({json.dumps(data)});
const plans = {json.dumps([[list(map(float, x)) for x in plan] for plan in plans])};
const said = plans.map(([p0, k]) => [model.verdict(p0, k).safe, model.level(p0, k) > 0]);
console.log(JSON.stringify(said));
"""
    return json.loads(
        subprocess.run([node, "-"], input=script, capture_output=True, text=True, check=True).stdout
    )


def by_the_checker(asked, p0, k):
    """Whether the checker accepts the plan, with the directions that the engine spells."""
    scene = scene_of(PROBLEM, asked)
    path = verdicts(scene, p0[None], k[None]).path[0]
    part = sample_part(scene, asked.tube, p0, k, path)
    assert part["k"] == hex_text(k)
    return bool(prove(PROBLEM, asked, [part])[0][0])


@pytest.mark.parametrize("k", [[END, 0.1], [-END, 0.2], [END, END], [0.3, END]])
def test_ends_of_k_belong_to_it_everywhere(k, tmp_path):
    asked, k = model([-END, END]), np.array(k)
    p0 = -k + [0.0, -0.1]
    assert verdicts(scene_of(PROBLEM, asked), p0[None], k[None]).safe.all()
    assert by_the_checker(asked, p0, k)
    assert by_the_page(tmp_path, asked, [(p0, k)]) == [[True, True]]


@pytest.mark.parametrize(("k", "bins"), EDGES)
def test_a_plan_on_an_edge_is_safe_when_it_is_with_the_errors_of_every_bin(k, bins):
    """A robot known exactly: it ends 0.3 below the grown obstacle less the widest of its bins."""
    asked, worst = of_widths(), max(WIDTHS[bin] for bin in bins)
    k = np.array(k)
    ends = [0.3 - worst - 1e-3, 0.3 - worst + 1e-3]
    p0 = np.array([-k + [0.0, end] for end in ends])
    seen = verdicts(scene_of(PROBLEM, asked), p0, np.array([k, k]))
    assert seen.safe.tolist() == [True, False] and (seen.bin == min(bins)).all()
    assert [by_the_checker(asked, start, k) for start in p0] == [True, False]


@pytest.mark.parametrize(("k", "bins"), EDGES)
def test_a_value_given_on_an_edge_has_the_plans_of_every_bin(k, bins):
    """The same plans, with the first parameter measured."""
    asked, worst = of_widths(), max(WIDTHS[bin] for bin in bins)
    found = query(PROBLEM.replace(uncertainty=Uncertainty(given={0: k[0]})), asked).nominal()
    p0 = np.array([[-k[0], -k[1] + 0.3 - worst + by] for by in (-1e-3, 1e-3)])
    scene = scene_of(found.problem, found.model)
    assert verdicts(scene, p0, np.full((2, 1), k[1])).safe.tolist() == [True, False]


@pytest.mark.parametrize("axis", [0, 1])
def test_beyond_the_ends_nothing_is_safe(axis, tmp_path):
    asked, k = model([-END, END]), np.array([0.3, 0.3])
    k[axis] = np.nextafter(END, 2) * np.sign(k[axis])
    p0 = -k + [0.0, -0.1]
    assert not verdicts(scene_of(PROBLEM, asked), p0[None], k[None]).safe.any()
    assert not by_the_checker(asked, p0, k)
    assert by_the_page(tmp_path, asked, [(p0, k)]) == [[False, False]]


def test_the_page_ends_at_k_where_the_bins_of_a_file_reach_beyond(tmp_path):
    asked, k = model([-END, END]), np.array([0.3, 0.3])
    k[0] = np.nextafter(END, 2)
    wider = [[-2.0, 2.0], [-2.0, 2.0]]
    assert by_the_page(tmp_path, asked, [(-k + [0.0, -0.1], k)], edges=wider) == [[False, False]]


@pytest.mark.night
def test_no_polytope_of_the_engine_contains_a_border_between_bins():
    """In floats no polytope holds a k on a border; in the exact rows it is outside; as a sample it
    is decided with the widths of all its bins.
    """
    asked = model([-END, 0.0, END])
    settings = Settings(samples=20, target=0.5, budget_s=300)
    answer = Planner(asked).solve(PROBLEM, jax.random.key(0), settings)
    polytopes = answer.polytopes(jax.random.key(1), 200).all
    assert polytopes
    k = np.array([0.0, -0.25])
    p0 = -k + [0.0, -0.1]
    assert not answer.contains(p0[None], k[None]).any()
    assert by_the_checker(asked, p0, k)
    parts = problem_part(PROBLEM, asked), network_part(asked.net), tube_part(asked.tube)
    context = checker.Context(*parts)
    for polytope in polytopes:
        rows = set_rows(context, polytope_part(polytope))
        open_faces = [a for name, strict, a, _ in rows if strict and name.startswith("axis")]
        assert len(open_faces) == 2  # one for each axis
        ends = [a for name, strict, a, _ in rows if not strict and name.startswith("axis")]
        assert len(ends) == 6
