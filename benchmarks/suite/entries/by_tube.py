"""A network of the runs, and a tube around what it predicts: what two entries share, which differ
in what they call the width of the tube.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from benchmarks.suite.contact import Obstacle, touched
from benchmarks.suite.entries import kit
from benchmarks.suite.scene import Scene

PARTS = 32  # of the time from a record to the next
CHUNK = 2048  # runs looked at together


def learn(task: kit.Task, rng, n: int) -> tuple:
    """A network from n runs that start at the origin, and what these are off (n, out)."""
    k, y = runs(task, rng, n)
    middle, scale = y.mean(axis=0), y.std(axis=0) + 1e-9
    weights = kit.train(_scaled(task, k), (y - middle) / scale)
    net = (*weights, middle, scale)
    return net, np.abs(predict(task, net, k) - y)


def runs(task: kit.Task, rng, n: int) -> tuple[np.ndarray, np.ndarray]:
    """k (n, n_k) and p, q in a row (n, out) of runs that start at the origin."""
    k = task.draw(rng, n)
    p, q = task.runs(np.zeros((n, task.n_p)), k)
    return k, np.concatenate([p.reshape(n, -1), q], axis=1)


def predict(task: kit.Task, net: tuple, k) -> np.ndarray:
    """p, q in a row (n, out) of runs that start at the origin."""
    *weights, middle, scale = net
    return kit.network(weights, _scaled(task, k)) * scale + middle


def _scaled(task: kit.Task, k):
    return 2 * (k - task.k_lo) / (task.k_hi - task.k_lo) - 1


def save(folder, net: tuple, width: np.ndarray) -> None:
    """To a file in the folder of the model."""
    np.savez(f"{folder}/model.npz", *net, width=width)


def load(folder) -> tuple:
    """Network and widths (out,)."""
    with np.load(f"{folder}/model.npz") as file:
        return [file[f"arr_{i}"] for i in range(len(file.files) - 1)], file["width"]


def answer(task: kit.Task, folder, scene_path, answer_path) -> None:
    """Polytopes of plans whose predicted runs, as wide as the tube, succeed."""
    net, width = load(folder)
    points, n_q = len(task.told["points"]), len(task.told["q"])
    n_out = len(width) - n_q
    at_end = width[n_out - points * task.n_p : n_out].reshape(points, -1)
    anywhere = width[:n_out].reshape(-1, task.n_p).max(axis=0)
    scene = shrunk(task.scene(scene_path), at_end, width[n_out:], anywhere)

    def predicted_to_succeed(plans):
        p0, k = np.split(plans, [task.n_p], axis=1)
        y = predict(task, net, k)
        p = y[:, :n_out].reshape(len(k), -1, points, task.n_p) + p0[:, None, None]
        return scene.succeeds(p, y[:, n_out:])

    rng, bounds = np.random.default_rng(0), task.bounds(scene)
    some = rng.uniform(*bounds, (4000, bounds.shape[1]))
    p0, k = np.split(some, [task.n_p], axis=1)
    ends = predict(task, net, k)[:, n_out - points * task.n_p : n_out][:, : task.n_p] + p0
    along = kit.sheared(task, p0, k, ends)
    found = kit.boxes(predicted_to_succeed, *bounds, rng, along)
    if found:
        kit.first(0.5 * (np.array(found[0]["lo"]) + found[0]["hi"]))
    kit.answer(answer_path, polytopes=found)


def shrunk(scene: Scene, at_end, q, anywhere) -> Scene:
    """The scene for a tube: ends in less, obstacles larger by half widths [m]."""
    ends = np.stack([scene.ends[0] + at_end, scene.ends[1] - at_end])
    further = np.stack([scene.q[0] + q, scene.q[1] - q])
    return replace(scene, ends=ends, q=further, obstacles=_grown(scene, anywhere))


@dataclass(frozen=True)
class Between(Scene):
    """A scene in which runs touch nothing between records either, where no point goes farther than
    `reach` [m] along any axis from one record to the next.
    """

    reach: float

    def succeeds(self, p: np.ndarray, q: np.ndarray) -> np.ndarray:
        found = super().succeeds(p, q)
        for rows in np.array_split(np.flatnonzero(found), 1 + found.sum() // CHUNK):
            corners = _between(p[rows], self.reach)
            for points, radius in self.body:
                hulls = corners[:, :, points].reshape(*corners.shape[:2], -1, p.shape[-1])
                for obstacle in self.obstacles:
                    found[rows] &= ~touched(hulls, obstacle, radius)
        return found


def _between(p: np.ndarray, reach: float) -> np.ndarray:
    """Corners (n, PARTS * records, points, 2 ** d, d) of boxes in which points of runs p are during
    parts of the time from each record to the next: no farther from either than the time allows.
    """
    before, after, found = p[:, :-1], p[:, 1:], []
    for part in range(PARTS):
        since, until = reach * (part + 1) / PARTS, reach * (1 - part / PARTS)
        lo = np.maximum(before - since, after - until)
        hi = np.minimum(before + since, after + until)
        sides = product(*((lo[..., i], hi[..., i]) for i in range(p.shape[-1])))
        found.append(np.stack([np.stack(corner, axis=-1) for corner in sides], axis=-2))
    return np.concatenate(found, axis=1)


def between_records(scene: Scene, task: kit.Task) -> Scene:
    """The scene for records between which a point goes no faster than is told."""
    if task.told["speed"] is None:
        return scene
    return Between(**vars(scene), reach=task.told["speed"] * task.told["dt"])


def _grown(scene: Scene, by: np.ndarray) -> tuple[Obstacle, ...]:
    """The obstacles, larger by half widths (n_p,) [m]."""
    sides = np.stack([-by, by])
    corners = np.stack(np.meshgrid(*sides.T), axis=-1).reshape(-1, len(by))
    return tuple(
        Obstacle(
            (one.vertices[:, None] + corners).reshape(-1, len(by)),
            np.unique(np.concatenate([one.normals, np.eye(len(by))]), axis=0),
            one.around + sides,
        )
        for one in scene.obstacles
    )
