"""parc_jax: whole sets of provably safe manoeuvres for robots that can be run but not written down.

Names are loaded on first use, so the checker (`python -m parc_jax.checker`) starts without JAX.
What goes on inside is told to the logger "parc_jax", which is quiet until it is asked.
"""

import importlib
import logging

logging.getLogger(__name__).addHandler(logging.NullHandler())

_HOME = {
    "Answer": "answer.answer",
    "BlackBoxSystem": "system",
    "Body": "problem.body",
    "Box": "sets.box",
    "Choice": "local.choice",
    "BoxScenes": "batch.box_scenes",
    "Density": "claim.risk",
    "Disc": "problem.body",
    "Doubt": "problem.doubt",
    "Driving": "ros.driving",
    "Ended": "base.status",
    "Episode": "rollout.environment",
    "Episodes": "loop.episodes",
    "Effort": "loop.loop",
    "ErrorClaim": "claim.claim",
    "Exact": "methods",
    "Footprint": "world.footprint",
    "FreeSpace": "world.free_space",
    "GridMap": "world.grid_map",
    "HPolytope": "sets.hpolytope",
    "InputError": "errors",
    "Local": "local.local_model",
    "Loop": "loop.loop",
    "NoStatement": "claim.risk",
    "Normalisation": "network.fold",
    "Outcome": "loop.outcome",
    "Part": "problem.body",
    "Pilot": "ros.pilot",
    "Planner": "planner.planner",
    "Point": "claim.risk",
    "Polygon": "problem.body",
    "Prepared": "planner.prepared",
    "Prover": "loop.prover",
    "Published": "methods",
    "ReLUNetwork": "network.relu",
    "ReachAvoid": "problem.problem",
    "Refine": "local.refine",
    "RegionTable": "pwa",
    "RolloutBatch": "rollout.batch",
    "Settings": "settings",
    "SoundnessError": "errors",
    "Status": "base.status",
    "Thinking": "loop.thinking",
    "TimeGrid": "system",
    "Trajectory": "system",
    "TrajectoryModel": "model",
    "Tube": "claim.tube",
    "Uniform": "claim.risk",
    "assumed_claim": "claim.declared",
    "body_of": "problem.body",
    "bound_error": "claim.pipeline",
    "box": "sets.box",
    "box_scenes": "batch.box_scenes",
    "chained": "rollout.chained",
    "collect": "rollout.collect",
    "convex_pieces": "world.pieces",
    "declared_claim": "claim.declared",
    "enumerate_regions": "pwa",
    "episodes": "loop.episodes",
    "fmu_system": "rollout.fmu",
    "footprint": "world.footprint",
    "free_place": "world.free_space",
    "goal_of_points": "problem.problem",
    "hpolytope": "sets.hpolytope",
    "hull": "problem.body",
    "labels_of": "problem.labels",
    "learn_from": "study.from_prior",
    "left_tube": "loop.left",
    "load": "model",
    "load_answer": "io.answer_file",
    "load_bags": "bags.load",
    "load_map": "world.map_file",
    "load_network": "io.network_file",
    "load_problem": "io.problem_file",
    "load_rollouts": "rollout.loaders",
    "load_sweep": "rollout.sweep",
    "march": "pwa",
    "monitor": "claim.monitor",
    "moving": "separation.moving",
    "occupancy_grid": "world.grid_map",
    "problem_of_text": "io.problem_file",
    "python_system": "rollout.python_system",
    "reach_avoid": "problem.problem",
    "refit": "claim.update",
    "relu_network": "network.relu",
    "replay": "study.replay",
    "replay_recorded": "study.recorded",
    "required_runs": "claim.counts",
    "safety_question": "io.question",
    "save_episode": "loop.log",
    "save_problem": "io.problem_file",
    "seen_from": "world.seen",
    "time_grid": "system",
    "train": "network.train",
    "trajectory_model": "model",
    "translation_gap": "rollout.invariance",
    "tube": "claim.tube",
    "update": "claim.update",
    "vnnlib": "io.question",
    "write_c": "onboard.header",
    "write_mcap": "bags.write",
    "write_onnx": "io.onnx_write",
    "write_question": "io.question",
}

__all__ = sorted(_HOME)
__version__ = "0.1.0"


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'parc_jax' has no attribute {name!r}")
    return getattr(importlib.import_module(f"parc_jax.{_HOME[name]}"), name)


def __dir__():
    return __all__
