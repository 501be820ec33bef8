"""parc_jax: whole sets of provably safe manoeuvres for robots that can be run but not written down.

Names are loaded on first use, so the checker (`python -m parc_jax.checker`) starts without JAX.
"""

import importlib

_HOME = {
    "Answer": "answer",
    "BlackBoxSystem": "system",
    "Box": "sets.box",
    "Disc": "problem",
    "ErrorClaim": "error.claim",
    "HPolytope": "sets.hpolytope",
    "InputError": "errors",
    "Planner": "planner",
    "Polygon": "problem",
    "ReLUNetwork": "network.relu",
    "ReachAvoid": "problem",
    "RegionTable": "pwa",
    "RolloutBatch": "rollout.batch",
    "SoundnessError": "errors",
    "TimeGrid": "system",
    "Trajectory": "system",
    "TrajectoryModel": "model",
    "Tube": "error.tube",
    "assumed_claim": "error.bound",
    "bound_error": "error.bound",
    "box": "sets.box",
    "collect": "rollout.collect",
    "enumerate_regions": "pwa",
    "hpolytope": "sets.hpolytope",
    "load": "model",
    "load_rollouts": "rollout.loaders",
    "march": "pwa",
    "reach_avoid": "problem",
    "relu_network": "network.relu",
    "time_grid": "system",
    "train": "network.train",
    "trajectory_model": "model",
    "tube": "error.tube",
}

__all__ = sorted(_HOME)
__version__ = "0.1.0"


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'parc_jax' has no attribute {name!r}")
    return getattr(importlib.import_module(f"parc_jax.{_HOME[name]}"), name)


def __dir__():
    return __all__
