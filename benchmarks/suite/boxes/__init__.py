"""Black boxes: a box is what `box(variant)` of a module returns; anybody's module will do."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.suite.bad import Refused

TOYS = ("puck", "bar", "cushion", "sled")
ROBOTS = ("drift_parking", "asv", "f110", "tractor", "drone", "jackal")
NODES = 21  # along an axis of chance that counts evenly: an edge of a square of them is 1/800 of it
SEPARATOR = ":"  # between the name of a box and that of its variant


@dataclass(frozen=True)
class BlackBox:
    """Something that can be run and not looked into.

    rollout: (p0 (n, n_p), k (n, n_k), seed) -> p (n, records * fine + 1, points, n_p) [m], where
        the reference points truly are, and q (n, n_q), other states at the end. The same for the
        same arguments; all chance is in the seed; a run that failed is NaN.
    told: the same of chance that is told: (p0, k, u (n, c)) -> p, q, with u drawn evenly from the
        unit cube by `rollout`; and nodes (m, c) of u with weights (m,), by which the share of runs
        that fail is a sum. None where only runs can tell.
    k_lo, k_hi (n_k,): the parameters. records: how many an entry sees of a run after its start, dt
    [s] apart. fine: what the scorer sees for each of them. speed: [m/s] that no point exceeds along
    any axis, where anybody knows. fixed: something in the world belongs to it, so that a scene may
    not be moved.
    """

    name: str
    rollout: Callable[[np.ndarray, np.ndarray, int], tuple[np.ndarray, np.ndarray]]
    k_lo: tuple[float, ...]
    k_hi: tuple[float, ...]
    n_p: int
    dt: float
    records: int
    points: tuple[str, ...] = ("reference",)
    q: tuple[str, ...] = ()
    fine: int = 1
    speed: float | None = None
    fixed: bool = False
    told: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = (
        None
    )
    nodes: tuple[np.ndarray, np.ndarray] | None = None

    def public(self) -> dict:
        """What an entry is told: not the variant, whose name tells the trap."""
        hidden = ("rollout", "fine", "fixed", "told", "nodes")
        told = {name: value for name, value in vars(self).items() if name not in hidden}
        return told | {"name": self.name.partition(SEPARATOR)[0]}


def toy(name: str, n_u: int, run: Callable, n_even: int, chance: float | None = None, **about):
    """A toy whose truth is known. run: (p0, k, u (n, n_u)) -> p, q, of which the first n_even of u
    count evenly, and of one more only whether it is below a chance.
    """

    def told(p0, k, u):
        return run(np.asarray(p0, float), np.asarray(k, float), np.asarray(u, float))

    def rollout(p0, k, seed):
        return told(p0, k, np.random.default_rng(seed).uniform(size=(len(k), n_u)))

    side = np.linspace(0.0, 1.0, NODES)
    weight = np.full(NODES, 1.0)
    weight[[0, -1]] = 0.5
    weight /= weight.sum()
    axes = [(side, weight)] * n_even
    if n_u > n_even:
        p = 1.0 if chance is None else chance
        axes += [(np.array([0.0, 1.0]), np.array([p, 1 - p]))] * (n_u - n_even)
    nodes = np.stack(np.meshgrid(*(x for x, _ in axes), indexing="ij"), -1).reshape(-1, n_u)
    weights = np.ones(1)
    for _, w in axes:
        weights = np.multiply.outer(weights, w).ravel()
    return BlackBox(name, rollout, told=told, nodes=(nodes, weights), **about)


def load(name: str) -> BlackBox:
    """The box of a name such as "puck" or "puck:jumps", of ours or, with dots, of anybody's module
    (`yours.box`). Raises Refused.
    """
    own, _, variant = name.partition(SEPARATOR)
    if own in ROBOTS:
        try:
            from benchmarks.suite.boxes.robots import robot

            return robot(name, own)
        except ModuleNotFoundError as missing:
            hint = "pip install -e '.[dev]' in the clone"
            raise Refused(f"box {own}: expected parc_jax and sims; {missing}; {hint}.") from None
    if own not in TOYS and "." not in own:
        raise Refused(
            f"box: expected one of {', '.join(TOYS + ROBOTS)}, or a module with dots in its name; "
            f"got {own!r}."
        )
    module = importlib.import_module(f"benchmarks.suite.boxes.{own}" if own in TOYS else own)
    return module.box(variant)
