"""An answer that is read from its file says what it said: of whatever its question, its claim and
its starts were, and of all of these together.
"""

import functools
import itertools
import re

import jax
import numpy as np
import pytest

import parc_jax as pj
from parc_jax.learning.system import TURNS

T, H = 4, 0.05
GUST = 0.01  # [m] at the end, at most, in either axis


class Arc:
    """k = (speed at the start, measured; speed that is commanded [m/s]; turn [rad]); it turns its
    heading as told. In NumPy: nothing is compiled.
    """

    name, n_p, n_q = "arc", 2, 1
    domain = pj.box([0.0, 0.5, -0.5], [0.4, 1.0, 0.5])
    time = pj.learning.time_grid(1 / T, 1.0, H)
    k_labels = ("v0 [m/s]", "v [m/s]", "turn [rad]")
    q_labels = ("yaw [rad]",)
    rotation = (TURNS,)
    given = ("v0 [m/s]",)

    def rollout_batch(self, keys, k):
        s = np.linspace(0.0, 1.0, self.time.n_record + 1)[:, None]
        draw = [np.random.default_rng(np.asarray(key)).uniform(-1, 1, 2) for key in keys]
        ends = np.stack([k[:, 0] + k[:, 1], k[:, 2]], axis=1)
        p = s * ends[:, None] + GUST * s**2 * np.array(draw)[:, None]
        return pj.Trajectory(p, k[:, 2:])


class Sure(Arc):
    """The same, whose speed at the start is chosen."""

    given = ()


KEY = jax.random.PRNGKey(0)
SETTINGS = pj.Settings(samples=5, target=0.3)
LOCAL = pj.drive.Local(share=0.05, eps=0.1, rollouts=60, profile_runs=60)


@functools.cache
def model(claims: str, arc: type[Arc] = Arc):
    arc = arc()
    s = np.arange(1, T + 1)[:, None, None] / T
    W = (s * np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])).reshape(2 * T, 3)
    net = pj.learning.relu_network([np.vstack([W, [0.0, 0.0, 1.0]])], [np.zeros(2 * T + 1)])
    key = jax.random.PRNGKey(3)
    train = pj.learning.collect(arc, key, 100, quiet=True)
    options = {"eps": 0.1, "delta": 0.05, "claims": (claims,), "quiet": True, "train": train}
    bins = (2, 1, 1) if claims == "bins" else (1, 1, 1)
    claim = pj.learning.bound_error(net, arc, key, bins=bins, profile_runs=100, **options)
    return pj.learning.trajectory_model(net, claim)


MEASURED, ANY = {"given": {"v0": 0.2}}, {"given": {"v0": "free"}}
UNSURE = {
    "measured": MEASURED,
    "any start": ANY,
    "place": {"start": 0.01} | MEASURED,
    "heading": {"heading": 0.01} | ANY,
    "executed": {"k": {"v": 0.01}} | ANY,
    "obstacles": {"obstacles": pj.box([-0.01, -0.01], [0.01, 0.01]), "sensing_eps": "0.01"} | ANY,
    "all": {"start": 0.005, "heading": 0.01, "k": {"turn": 0.01}, "sensing_eps": "0.01"} | MEASURED,
}
FROM = {"anywhere": None, "a place": [0.1, 0.0], "a pose": [0.1, 0.0, 0.3]}
AMONG = {"what stands": False, "what moves": True}


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


def question(moves: bool, **unsure):
    goal = pj.box([0.4, -0.4, -2.0], [1.5, 0.4, 2.0])
    obstacles, spans = [pj.box([0.5, 0.3], [0.7, 0.6])], None
    if moves:
        told = {"at": 2.0, "off_by": 0.1}
        obstacles, spans = pj.problem.moving(obstacles[0], [0.1, 0.0], (0, 2), 1 / T, **told)
    uncertainty = pj.Uncertainty(**unsure) if unsure else None
    return pj.reach_avoid(goal, obstacles, 0.05, spans=spans, uncertainty=uncertainty)


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
