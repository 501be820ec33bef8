"""Spell problems, networks, tubes, samples and pieces as certificates: exact numbers as text, nothing to trust.

Problem numbers are shortest decimals (31.3 means 313/10), network and tube are hexadecimal floats, multipliers p/q.
"""

import hashlib
import json
from fractions import Fraction

import numpy as np

from parc_jax.avoid.directions import multiplier_near
from parc_jax.avoid.segment import separation
from parc_jax.certify.corridor import Corridor, Run
from parc_jax.certify.piece import Piece
from parc_jax.certify.scene import Scene
from parc_jax.error.tube import Tube
from parc_jax.model import TrajectoryModel
from parc_jax.network.relu import ReLUNetwork
from parc_jax.problem import Disc, ReachAvoid

FORMAT = "parc_jax.answer/1"


def problem_part(problem: ReachAvoid, model: TrajectoryModel) -> dict:
    """The question."""
    obstacles = []
    for poly, span in zip(problem.obstacles, problem.spans, strict=True):
        part = _rows(poly)
        if span is not None:
            part["steps"] = list(span)
        obstacles.append(part)
    body = problem.body
    return {
        "n_p": model.n_p,
        "n_q": model.n_q,
        "n_k": model.n_k,
        "domain": {"lo": _decimals(model.domain.lo), "hi": _decimals(model.domain.hi)},
        "goal": _rows(problem.goal),
        "obstacles": obstacles,
        "body": {"radius": _decimal(body.radius)}
        if isinstance(body, Disc)
        else {"vertices": [_decimals(v) for v in body.vertices]},
        "start": None if problem.start is None else _rows(problem.start),
        "steps": model.time.n_steps,
        "dt": _decimal(model.time.dt),
    }


def network_part(net: ReLUNetwork) -> dict:
    """The network, float64 exactly."""
    return {"weights": [[_hexes(row) for row in W] for W in net.weights], "biases": [_hexes(b) for b in net.biases]}


def tube_part(tube: Tube) -> dict:
    """The tube, float64 exactly; its outer edges are the domain's decimals; a bin without claim is NO_CLAIM wide."""
    interval, final = tube.finite_widths
    return {
        "edges": [_decimals(e) for e in tube.edges],
        "interval": [[_hexes(row) for row in one] for one in interval],
        "final": [_hexes(row) for row in final],
    }


def answer_part(
    problem: ReachAvoid, model: TrajectoryModel, samples: list[dict], corridors, pieces, *, no_plan: dict | None, meta
) -> dict:
    """The whole answer file. samples: their parts. meta: what needs no proof, as plain values."""
    asked, network, tube = problem_part(problem, model), network_part(model.net), tube_part(model.tube)
    hashes = {"problem": part_hash(asked), "network": part_hash(network), "tube": part_hash(tube)}
    claim = model.claim.to_json() | {"network_hash": hashes["network"], "tube_hash": hashes["tube"]}
    return {
        "format": FORMAT, "problem": asked, "network": network, "tube": tube, "claim": _plain(claim), "hash": hashes,
        "samples": samples, "corridors": [corridor_part(c) for c in corridors],
        "sets": [piece_part(p) for p in pieces], "no_plan": no_plan, "meta": _plain(meta),
    }  # fmt: skip


def part_hash(part: dict) -> str:
    """SHA-256 of the canonical JSON text of a part."""
    return hashlib.sha256(json.dumps(part, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def sample_part(problem: ReachAvoid, scene: Scene, tube: Tube, p0, k, path: np.ndarray, bin_number: int) -> dict:
    """Certificate of one safe point; path (T + 1, n_p) is its prediction."""
    error = tube.interval[bin_number]
    sep = []
    for o in range(len(problem.obstacles)):
        w, reach = scene.directions.w[o], scene.directions.reach[o]
        need = reach[:, None] + np.abs(w) @ error.T + scene.slack * np.abs(w).sum(axis=1)[:, None]
        along = w @ path.T
        chosen = _longest(np.minimum(along[:, :-1], along[:, 1:]) > need)
        steps = np.flatnonzero(scene.obstacles.active[o])
        runs: list[Run] = []
        for t in steps:
            if chosen[t] < 0:
                m = multiplier_near(problem, scene.directions, o, _nearest(scene, o, path, error, t))
            else:
                m = scene.directions.multipliers[o][chosen[t]]
            if runs and runs[-1].multiplier is m:
                runs[-1] = runs[-1]._replace(end=int(t) + 1)
            else:
                runs.append(Run(int(t), int(t) + 1, m))
        sep.append(runs)
    return {"p0": _hexes(p0), "k": _hexes(k), "sep": _separation(sep)}


def piece_part(piece: Piece) -> dict:
    """Certificate of a piece: pattern, directions and one inner point."""
    return {
        "p0": _hexes(piece.p0),
        "k": _hexes(piece.k),
        "bin": piece.bin,
        "pattern": "".join("1" if on else "0" for on in piece.pattern),
        "sep": _separation(piece.corridor.runs),
    }


def corridor_part(corridor: Corridor) -> dict:
    """Certificate of a corridor: its directions and one plan that keeps to it."""
    return {"p0": _hexes(corridor.p0), "k": _hexes(corridor.k), "sep": _separation(corridor.runs)}


def _longest(ok: np.ndarray) -> np.ndarray:
    """ok (d, T) -> (T,): index of the direction that lasts longest from each change on, -1 where none holds."""
    length = np.zeros(ok.shape, int)
    for t in range(ok.shape[1] - 1, -1, -1):
        length[:, t] = np.where(ok[:, t], 1 + (length[:, t + 1] if t + 1 < ok.shape[1] else 0), 0)
    out, current = np.full(ok.shape[1], -1), -1
    for t in range(ok.shape[1]):
        if current < 0 or not ok[current, t]:
            current = int(np.argmax(length[:, t])) if ok[:, t].any() else -1
        out[t] = current
    return out


def _nearest(scene: Scene, o: int, path, error, t: int) -> np.ndarray:
    corners = scene.obstacles.corner[o] + scene.obstacles.sign[o] * error[t]
    return separation(path[t], path[t + 1], corners, scene.obstacles.radius, np)[1]


def _separation(runs_by_obstacle) -> list:
    return [
        [[run.end, [[r, _fraction(v)] for r, v in zip(*run.multiplier, strict=True)]] for run in runs]
        for runs in runs_by_obstacle
    ]


def _rows(poly) -> dict:
    return {"A": [_decimals(row) for row in poly.A], "b": _decimals(poly.b)}


def _decimals(values) -> list[str]:
    return [_decimal(v) for v in values]


def _decimal(value) -> str:
    return repr(float(value))


def _hexes(values) -> list[str]:
    return [float(v).hex() for v in values]


def _plain(value):
    """JSON without floats: certificates spell every number that is not a count as text."""
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return repr(float(value)) if isinstance(value, float) else value


def _fraction(value: Fraction) -> str:
    return str(value)
