"""The public face: the names, and that each says what it is."""

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from needs import need

import parc_jax

NAMES = [
    "Answer",
    "BlackBoxSystem",
    "Body",
    "Box",
    "Choice",
    "BoxScenes",
    "Density",
    "Disc",
    "Doubt",
    "Driving",
    "Effort",
    "Ended",
    "Episode",
    "Episodes",
    "ErrorClaim",
    "Exact",
    "Footprint",
    "FreeSpace",
    "GridMap",
    "HPolytope",
    "InputError",
    "Local",
    "Loop",
    "NoStatement",
    "Normalisation",
    "Outcome",
    "Part",
    "Pilot",
    "Planner",
    "Point",
    "Polygon",
    "Prepared",
    "Prover",
    "Published",
    "ReLUNetwork",
    "ReachAvoid",
    "Refine",
    "RegionTable",
    "RolloutBatch",
    "Settings",
    "SoundnessError",
    "Status",
    "Thinking",
    "TimeGrid",
    "Trajectory",
    "TrajectoryModel",
    "Tube",
    "Uniform",
    "assumed_claim",
    "body_of",
    "bound_error",
    "box",
    "box_scenes",
    "chained",
    "collect",
    "convex_pieces",
    "declared_claim",
    "enumerate_regions",
    "episodes",
    "fmu_system",
    "footprint",
    "free_place",
    "goal_of_points",
    "hpolytope",
    "hull",
    "labels_of",
    "learn_from",
    "left_tube",
    "load",
    "load_answer",
    "load_bags",
    "load_map",
    "load_network",
    "load_problem",
    "load_rollouts",
    "load_sweep",
    "march",
    "monitor",
    "moving",
    "occupancy_grid",
    "problem_of_text",
    "python_system",
    "reach_avoid",
    "refit",
    "relu_network",
    "replay",
    "replay_recorded",
    "required_runs",
    "safety_question",
    "save_episode",
    "save_problem",
    "seen_from",
    "time_grid",
    "train",
    "trajectory_model",
    "translation_gap",
    "tube",
    "update",
    "vnnlib",
    "write_c",
    "write_mcap",
    "write_onnx",
    "write_question",
]


def test_names_are_the_agreed_ones_and_sorted():
    assert parc_jax.__all__ == sorted(parc_jax.__all__) == sorted(NAMES)
    assert dir(parc_jax) == parc_jax.__all__


@pytest.mark.parametrize("name", NAMES)
def test_every_name_loads_and_has_a_docstring(name):
    thing = getattr(parc_jax, name)
    assert thing.__name__ == name
    text = inspect.getdoc(thing)
    assert text and len(text.split("\n")[0]) > 15
    if inspect.isclass(thing):
        assert text != inspect.getdoc(object)
        for attribute, member in vars(thing).items():
            if attribute.startswith("_") or attribute == "replace":
                continue
            if inspect.isfunction(member) or isinstance(member, property | classmethod):
                target = (
                    member.fget
                    if isinstance(member, property)
                    else getattr(member, "__func__", member)
                )
                assert inspect.getdoc(target), f"{name}.{attribute}"


def test_type_checkers_see_the_same_names():
    """The stub beside the package, since checkers do not follow names that are loaded on first
    use.
    """
    stub = Path(parc_jax.__file__).with_suffix(".pyi").read_text()
    homes = dict(
        reversed(pair)
        for pair in re.findall(r"^from parc_jax\.([\w.]+) import (\w+) as \2$", stub, re.M)
    )
    assert homes == parc_jax._HOME
    assert Path(parc_jax.__file__).with_name("py.typed").exists()


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'solve_everything'"):
        parc_jax.solve_everything  # noqa: B018


@pytest.mark.slow
def test_the_types_of_an_installed_package_are_seen(tmp_path):
    """From a folder of one's own, as installed (the gate installs an editable package): the types
    of the public names are known, and a wrong argument is found.
    """
    need("mypy")
    (tmp_path / "mine.py").write_text(
        "import parc_jax as pj\nmodel = pj.load('x.npz')\nreveal_type(model)\npj.Planner(3)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "MYPYPATH")}
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path / "cache"), "mine.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert 'Revealed type is "parc_jax.model.TrajectoryModel"' in done.stdout, done.stdout
    assert 'has incompatible type "int"; expected "TrajectoryModel"' in done.stdout
