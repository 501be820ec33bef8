"""The page's verdict on a plan, under node, against the engine's: bodies of several points and
parts, in the plane and in space.
"""

import json
import subprocess

import numpy as np
import pytest
from drawn_bodies import car
from toy_bodies import points_model, points_problem
from toy_models import told

from parc_jax.app.plot.page import FILES, model_data
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.needs("node")


def by_the_page(model, problem, p0, k) -> list[dict]:
    """Path, clearance, goal margin and the verdict itself, by the scripts of the page."""
    known = {"corridors": [], "polytopes": [], "directions": [], "rounding": [[1e-9] * 99] * 2}
    data = model_data(model, problem) | known
    program = (
        "".join((FILES / part).read_text() for part in ("geometry.js", "model.js"))
        + f"""
const model = makeModel({json.dumps(data)}), P = {p0.tolist()}, K = {k.tolist()};
const out = P.map((p, i) => {{
  const {{ path, clearance, goal, safe }} = model.verdict(p, K[i]);
  return {{ path, clearance, goal: goal.least, safe, level: model.level(p, K[i]) }};
}});
console.log(JSON.stringify(out));
"""
    )
    return json.loads(printed(program))


def printed(program: str) -> str:
    """What a program prints in node."""
    told = {"capture_output": True, "text": True, "check": True}
    return subprocess.run(["node", "-"], input=program, **told).stdout


def random_case(n_p):
    """Random points, two parts, boxes in the way."""

    def case(rng):
        model = points_model(rng, n_p=n_p)
        return model, points_problem(rng, model)

    return case


def fitted_case(n_p):
    """The same with a tube that fits: slanted faces, not centred, turned sets."""

    def case(rng):
        model, problem = random_case(n_p)(rng)
        old = model.tube
        lead = (old.n_bins, old.n_steps, old.n_points)
        slanted = np.concatenate([np.eye(n_p), rng.normal(size=(2, n_p))])
        shape = (*lead, len(slanted))
        during = faces(
            np.broadcast_to(slanted, (*shape, n_p)),
            0.01 * rng.normal(size=shape),
            rng.uniform(0.02, 0.05, shape),
        )
        n_end = old.n_c + old.n_q
        at_end = faces(
            np.broadcast_to(np.eye(n_end), (old.n_bins, n_end, n_end)),
            0.02 * rng.normal(size=(old.n_bins, n_end)),
            rng.uniform(0.01, 0.04, (old.n_bins, n_end)),
            frames=True,
        )
        return told(model, tube=fitted_tube(old.edges, during, at_end)), problem

    return case


CASES = {
    "car": lambda _: car(e=0.02, parts=2),
    "random space": random_case(3),
    "fitted plane": fitted_case(2),
    "fitted space": fitted_case(3),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("car", marks=pytest.mark.slow),
        pytest.param("random space", marks=pytest.mark.night),
        "fitted plane",
        pytest.param("fitted space", marks=pytest.mark.night),
    ],
)
@pytest.mark.slow
def test_the_page_says_what_the_engine_says(name, rng):
    model, problem = CASES[name](rng)
    scene = scene_of(problem, model)
    n = 150
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    ends = rng.uniform(scene.z_lo, scene.z_hi, (n, model.n_p))
    p0 = ends - verdicts(scene, np.zeros((n, model.n_p)), k).path[:, -1, : model.n_p]
    seen = verdicts(scene, p0, k)
    said = by_the_page(model, problem, p0, k)
    paths = np.array([one["path"] for one in said]).reshape(seen.path.shape)
    assert paths == pytest.approx(seen.path, abs=1e-9)
    assert [one["goal"] for one in said] == pytest.approx(seen.goal, abs=1e-6)
    apart = seen.clearance > 1e-6
    gaps = np.array([one["clearance"] for one in said])
    assert gaps[apart] == pytest.approx(seen.clearance[apart], abs=1e-6)
    assert (gaps[~apart] < 2e-6).all()
    safe = np.array([one["safe"] for one in said])
    assert (safe == seen.safe).all() and safe.tolist() == [one["level"] > 0 for one in said]
    assert 3 < apart.sum() < n - 3 and 0 < safe.sum() < n  # both verdicts occur


def test_nothing_is_called_proved_by_less_than_rounding():
    """A plan on the border of its goal, of one corridor that any plan keeps to."""
    rng = np.random.default_rng(0)
    model = points_model(rng, n_p=2)
    problem = points_problem(rng, model).replace(obstacles=())
    called = {}
    for paid in (0.0, 1e3):
        known = {"polytopes": [], "directions": [[]], "corridors": [{"sep": 0}]}
        data = model_data(model, problem) | known | {"rounding": [[paid] * 99] * 2}
        p0, k = np.zeros(2), (model.domain.lo + model.domain.hi) / 2
        data["goal"] = {"A": data["goal"]["A"], "b": [100.0] * len(data["goal"]["b"])}
        program = "".join((FILES / part).read_text() for part in ("geometry.js", "model.js"))
        program += f"const model = makeModel({json.dumps(data)});"
        program += f"const at = [{p0.tolist()}, {k.tolist()}];"
        program += "console.log(model.level(...at), model.verdict(...at).corridor)"
        out = subprocess.run(
            ["node", "-"], input=program, capture_output=True, text=True, check=True
        )
        called[paid] = out.stdout.split()
    assert called == {0.0: ["2", "0"], 1e3: ["1", "-1"]}
