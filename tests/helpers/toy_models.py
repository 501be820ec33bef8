"""Small trajectory models and scenes for the planner's tests: straight lines, random ReLU paths,
random obstacles.
"""

import itertools
from dataclasses import replace

import numpy as np

from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.learning.bound.claim import ErrorClaim, derived, error_claim
from parc_jax.learning.bound.tube import Tube, tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.runs.law import law_spec, subject
from parc_jax.learning.system import TimeGrid, time_grid
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import Problem, reach_avoid


def assumed(
    net: ReLUNetwork,
    error_tube: Tube,
    time: TimeGrid | None = None,
    system: str = "toy",
    points=None,
) -> ErrorClaim:
    """A claim whose tube is simply assumed, one second long where no grid is given."""
    domain = box([e[0] for e in error_tube.edges], [e[-1] for e in error_tube.edges])
    time = time_grid(1.0 / error_tube.n_steps, 1.0) if time is None else time
    return error_claim(
        kind="assumed",
        tube=error_tube,
        subject=subject(system, domain, time, error_tube.n_p, error_tube.n_q, points),
        network=net.hash,
        quantifier="assumed for every run",
        eps=None,
        delta=None,
        n=0,
        discard=0,
        looks=1,
        law=law_spec(system, domain),
        assumptions=("THE TUBE HOLDS",),
    )


def model_of(net: ReLUNetwork, domain: Box, interval, final, edges=None) -> TrajectoryModel:
    """A model whose tube is simply assumed. interval (n_bins, T, 2), final (n_bins, 2 + n_q), one
    second long.
    """
    edges = (
        [[lo, hi] for lo, hi in zip(domain.lo, domain.hi, strict=True)] if edges is None else edges
    )
    return trajectory_model(net, assumed(net, tube(edges, interval, final)))


def told(model: TrajectoryModel, net=None, tube: Tube | None = None, **about) -> TrajectoryModel:
    """The model told of another network, tube, or of another time, rotation, system, ...: whatever
    its claim said of it is not shown.
    """
    net = model.net if net is None else net
    tube = model.tube if tube is None else tube
    subject, assumptions = replace(model.claim.subject, **about), model.claim.assumptions
    if subject.rotation and not any("ROTATION_INVARIANCE" in each for each in assumptions):
        moved = next((x for x in assumptions if x[:5] == "TRANS"), "TRANSLATION_INVARIANCE")
        assumptions = (*assumptions, moved.replace("TRANSLATION", "ROTATION"))
    of = {"network": net.hash, "tube": tube, "subject": subject, "assumptions": assumptions}
    return model.replace(net=net, claim=derived(model.claim, **of))


def uniform_tube(T: int, e: float = 0.0, final: float | None = None, n_q: int = 1):
    """One bin, every width e, final widths `final`."""
    return np.full((1, T, 2), float(e)), np.full((1, 2 + n_q), float(e if final is None else final))


def line_model(
    T: int = 4, e: float = 0.0, final: float | None = None, half: float = 1.0, rests: bool = False
) -> TrajectoryModel:
    """The identity network: c_t = (t / T) k, q = k_0, over K = [-half, half]^2. T a power of two
    keeps it dyadic. rests: it is at k one knot before the end.
    """
    share = np.arange(1, T + 1)[:, None] / T
    share[T - 1 - rests :] = 1.0
    W = np.concatenate([np.kron(share, np.eye(2)), [[1.0, 0.0]]])
    domain = box([-half, -half], [half, half])
    return model_of(relu_network([W], [np.zeros(2 * T + 1)]), domain, *uniform_tube(T, e, final))


def resting(model: TrajectoryModel) -> TrajectoryModel:
    """The model that at the end is where it was one knot before."""
    n, last = model.n_c, model.layout.n_offsets
    W, b = model.net.weights[-1].copy(), model.net.biases[-1].copy()
    for rows in (W, b):
        rows[last - n : last] = rows[last - 2 * n : last - n]
    weights, biases = [*model.net.weights[:-1], W], [*model.net.biases[:-1], b]
    return told(model, net=relu_network(weights, biases))


def fold_model(T: int = 4, e: float = 0.0) -> TrajectoryModel:
    """The |x| network: c_t = (t / T) (k_0, |k_1|), q = k_0, over K = [-1, 1]^2, with |x| = relu(x)
    + relu(-x).
    """
    first = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    point = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
    W = np.concatenate([np.kron(np.arange(1, T + 1)[:, None] / T, point), point[:1]])
    return model_of(
        relu_network([first, W], [np.zeros(4), np.zeros(2 * T + 1)]),
        box([-1, -1], [1, 1]),
        *uniform_tube(T, e),
    )


def random_network(
    rng, T: int, hidden=(6, 5), n_k: int = 2, n_q: int = 1, scale: float = 1.0
) -> ReLUNetwork:
    """Random weights; outputs are cumulative sums of random steps of about `scale` / T, so paths
    are continuous.
    """
    widths = [n_k, *hidden]
    weights = [rng.normal(size=(n, m)) * np.sqrt(2 / m) for m, n in itertools.pairwise(widths)]
    biases = [0.5 * rng.normal(size=n) for n in hidden]
    steps = rng.normal(size=(T, 2, widths[-1])) * scale / T
    drift = rng.normal(size=(1, 2)) * 2 * scale / T
    last = np.concatenate(
        [steps.cumsum(axis=0).reshape(2 * T, -1), 0.3 * rng.normal(size=(n_q, widths[-1]))]
    )
    bias = np.concatenate(
        [np.cumsum(np.broadcast_to(drift, (T, 2)), axis=0).ravel(), rng.normal(size=n_q)]
    )
    return relu_network([*weights, last], [*biases, bias])


def random_model(
    rng, T: int = 4, hidden=(6, 5), bins=(1, 1), size: float = 0.05
) -> TrajectoryModel:
    """A random network over K = [-1, 1]^2 and a random tube of widths up to 2 `size`, one per
    bin.
    """
    n_bins = int(np.prod(bins))
    edges = [np.linspace(-1, 1, n + 1) for n in bins]
    interval, final = (
        rng.uniform(0, 2 * size, (n_bins, T, 2)),
        rng.uniform(0, 2 * size, (n_bins, 3)),
    )
    return model_of(random_network(rng, T, hidden), box([-1, -1], [1, 1]), interval, final, edges)


def random_polygon(rng, centre, size: float, rows: int = 5) -> HPolytope:
    """A bounded polygon with interior: random normals of random lengths around `centre`, closed by
    a box.
    """
    angle = rng.uniform(0, 2 * np.pi, rows)
    A = np.concatenate([np.stack([np.cos(angle), np.sin(angle)], axis=1), np.eye(2), -np.eye(2)])
    b = size * np.concatenate([rng.uniform(0.3, 1.0, rows), np.full(4, 1.2)])
    length = rng.uniform(0.1, 10, (len(A), 1))
    return hpolytope(A * length, (b + A @ np.asarray(centre)) * length[:, 0])


def random_problem(
    rng, model: TrajectoryModel, n_obstacles: int = 2, body: str = "disc", start: bool = False
):
    """A goal about the mean final state and obstacles about the mean path, so that some plans are
    safe and some not.
    """
    k = rng.uniform(model.domain.lo, model.domain.hi, (200, model.n_k))
    y = host_outputs(model.net, k)
    T = model.time.n_steps
    mean_q = y[:, 2 * T :].mean(axis=0)
    spread = y[:, 2 * T :].std(axis=0) + 0.2
    goal = box([-0.5, -0.5, *(mean_q - spread)], [0.5, 0.5, *(mean_q + spread)])
    paths = y[:, : 2 * T].reshape(-1, T, 2) - y[:, None, 2 * T - 2 : 2 * T]
    obstacles = []
    for _ in range(n_obstacles):
        at = paths[rng.integers(200), rng.integers(T)] + 0.6 * rng.normal(size=2)
        obstacles.append(random_polygon(rng, at, rng.uniform(0.1, 0.5)))
    shape = rng.uniform(0.0, 0.15) if body == "disc" else Polygon(0.15 * rng.normal(size=(4, 2)))
    p0 = -y[:, 2 * T - 2 : 2 * T].mean(axis=0)
    return reach_avoid(goal, obstacles, shape, box(p0 - 1.0, p0 + 1.0) if start else None)


def rectangle(rng, centre, size: float) -> HPolytope:
    """A turned rectangle: four rows of different lengths, never parallel to the axes; always eight
    grown corners.
    """
    angle = rng.uniform(0.2, np.pi / 2 - 0.2)
    u, v = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    A = np.stack([u, v, -u, -v])
    b = A @ np.asarray(centre) + size * rng.uniform(0.5, 1.5, 2)[[0, 1, 0, 1]]
    length = rng.uniform(0.5, 2.0, 4)
    return hpolytope(A * length[:, None], b * length)


TRIANGLE = Polygon(np.array([[0.1, 0.0], [-0.05, 0.08], [-0.06, -0.07]]))


def rectangle_problem(rng, model: TrajectoryModel, body=0.08, start: bool = False) -> Problem:
    """Two turned rectangles near the paths of the model: one compiled shape per kind of body and
    start.
    """
    T = model.time.n_steps
    y = host_outputs(model.net, rng.uniform(model.domain.lo, model.domain.hi, (200, model.n_k)))
    mean_q, spread = y[:, 2 * T :].mean(axis=0), y[:, 2 * T :].std(axis=0) + 0.2
    goal = box([-0.5, -0.5, *(mean_q - spread)], [0.5, 0.5, *(mean_q + spread)])
    paths = y[:, : 2 * T].reshape(-1, T, 2) - y[:, None, 2 * T - 2 : 2 * T]
    at = paths[rng.integers(200, size=2), rng.integers(T, size=2)] + 0.4 * rng.normal(size=(2, 2))
    p0 = -y[:, 2 * T - 2 : 2 * T].mean(axis=0)
    return reach_avoid(
        goal,
        [rectangle(rng, c, rng.uniform(0.1, 0.3)) for c in at],
        body,
        box(p0 - 1.0, p0 + 1.0) if start else None,
    )


def toy_case(number: int, body=0.08, start: bool = False) -> tuple[TrajectoryModel, Problem]:
    """A random model and scene of the one shape that most tests share, so that they share its
    compiled kernels.
    """
    rng = np.random.default_rng([7, number])
    model = random_model(rng, 4, (6, 5), (1, 2), 0.02)
    return model, rectangle_problem(rng, model, body, start)


def host_outputs(net: ReLUNetwork, k: np.ndarray) -> np.ndarray:
    """Network outputs (b, n_out) in NumPy."""
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        k = np.maximum(k @ W.T + b, 0)
    return k @ net.weights[-1].T + net.biases[-1]


def anchored_plans(
    rng, model: TrajectoryModel, n: int, half: float = 0.55
) -> tuple[np.ndarray, np.ndarray]:
    """p0 (n, 2), k (n, 2): k uniform, predicted ends uniform in [-half, half]^2; most reach the
    goal of a toy scene.
    """
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    T = model.time.n_steps
    z = rng.uniform(-half, half, (n, 2))
    return z - host_outputs(model.net, k)[:, 2 * T - 2 : 2 * T], k
