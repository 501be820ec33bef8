"""An answer.json made by hand: a plan that folds over at k_1 = 0, between two blocks, with one set
on either side.
"""

import json

from toy_models import fold_model, told

from parc_jax.common.sets.box import box
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate.write import (
    FORMAT,
    network_part,
    part_hash,
    problem_part,
    tube_part,
)

SEP = [
    [[[2, [[2, "1"], [3, "1"]]], [4, [[3, "1"]]]]],
    [[[4, [[1, "3/4"]]]]],
]  # rows of a box: x <=, y <=, -x <=, -y <=


def toy_scene():
    """Model and problem: c_t = (t / 4) (k_0, |k_1|); goal about the origin; corridor |y| < 0.3;
    disc of 0.1 m.
    """
    goal = box([-0.2, -0.2, -1.0], [0.2, 0.2, 1.0])
    blocks = [box([-0.5, 0.3], [0.0, 0.6]), box([-0.5, -0.6], [0.0, -0.3])]
    return fold_model(T=4, e=0.02), reach_avoid(goal, blocks, 0.1)


def hashed(meta: dict) -> dict:
    """What a file says beside its proof, with the hash of it."""
    told = {name: value for name, value in meta.items() if name != "hash"}
    return told | {"hash": part_hash(told)}


def answer_file(model, problem, samples=(), sets=(), corridors=()) -> dict:
    """The parsed answer file of a model and a problem with the given certificates."""
    parts = {
        "problem": problem_part(problem, model),
        "network": network_part(model.net),
        "tube": tube_part(model.tube),
    }
    nothing = {
        "share": "0",
        "at_least": "0",
        "confidence": "0.99",
        "fresh_safe": 0,
        "fresh_uncovered": 0,
    }
    meta = {
        "status": "exact-proved",
        "statement": "(C) proved.",
        "counts": {"drawn": 0, "reaching": 0, "safe": 0},
        "volume_drawn": "0",
        "ended": None,
        "coverage": nothing,
    }
    parts["claim"] = model.claim.to_json() | {
        f"{name}_hash": part_hash(parts[name]) for name in ("network", "tube")
    }
    return {
        "format": FORMAT,
        **parts,
        "no_plan": None,
        "meta": hashed(meta),
        "hash": {name: part_hash(part) for name, part in parts.items()},
        "samples": list(samples),
        "sets": list(sets),
        "corridors": list(corridors),
    }


def toy_file(system: str = "toy </script><b>") -> dict:
    """Two samples, the set around each, and the corridor of both."""
    model, problem = toy_scene()
    plans = [(["-0.9", "-0.05"], ["0.9", "0.0625"]), (["-0.9", "-0.05"], ["0.9", "-0.0625"])]
    samples = [{"p0": p0, "k": k, "sep": SEP} for p0, k in plans]
    sets = [
        s | {"bin": 0, "pattern": pattern}
        for s, pattern in zip(samples, ("1010", "1001"), strict=True)
    ]
    return answer_file(told(model, system=system), problem, samples, sets, samples[:1])


def save(path, answer: dict):
    """Write an answer file."""
    path.write_text(json.dumps(answer))
    return path
