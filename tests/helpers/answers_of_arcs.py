"""Questions of a robot that drives arcs, by their claim, their start, what is uncertain and what
moves: for tests of what is said of an answer. In NumPy: little is compiled.
"""

import functools

import jax
import numpy as np

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
    if claims == "assumed":
        return pj.learning.trajectory_model(net, pj.learning.assumed_claim(net, train))
    options = {
        "eps": 0.1,
        "delta": 0.05,
        "claims": ("bins" if claims == "bins" else "one",),
        "quiet": True,
        "train": train,
    }
    bins = (2, 1, 1) if claims == "bins" else (1, 1, 1)
    claim = pj.learning.bound_error(net, arc, key, bins=bins, profile_runs=100, **options)
    if claims == "declared":
        claim = pj.learning.declared_claim(claim.tube, "a data sheet", net, arc.time)
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


def question(moves: bool, **unsure):
    goal = pj.box([0.4, -0.4, -2.0], [1.5, 0.4, 2.0])
    obstacles, spans = [pj.box([0.5, 0.3], [0.7, 0.6])], None
    if moves:
        told = {"at": 2.0, "off_by": 0.1}
        obstacles, spans = pj.problem.moving(obstacles[0], [0.1, 0.0], (0, 2), 1 / T, **told)
    uncertainty = pj.Uncertainty(**unsure) if unsure else None
    return pj.reach_avoid(goal, obstacles, 0.05, spans=spans, uncertainty=uncertainty)
