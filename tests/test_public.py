"""The public face: the names, and that each says what it is."""

import inspect
import re
from pathlib import Path

import pytest

import parc_jax

NAMES = [
    "Answer", "BlackBoxSystem", "Box", "Disc", "ErrorClaim", "HPolytope", "InputError", "Planner", "Polygon",
    "ReLUNetwork", "ReachAvoid", "RegionTable", "RolloutBatch", "SoundnessError", "TimeGrid", "Trajectory",
    "TrajectoryModel", "Tube", "assumed_claim", "bound_error", "box", "collect", "enumerate_regions", "hpolytope",
    "load", "load_rollouts", "march", "reach_avoid", "relu_network", "time_grid", "train", "trajectory_model", "tube",
]  # fmt: skip


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
                target = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
                assert inspect.getdoc(target), f"{name}.{attribute}"


def test_type_checkers_see_the_same_names():
    """The stub beside the package, since checkers do not follow names that are loaded on first use."""
    stub = Path(parc_jax.__file__).with_suffix(".pyi").read_text()
    homes = dict(reversed(pair) for pair in re.findall(r"^from parc_jax\.([\w.]+) import (\w+) as \2$", stub, re.M))
    assert homes == parc_jax._HOME
    assert Path(parc_jax.__file__).with_name("py.typed").exists()


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'solve_everything'"):
        parc_jax.solve_everything  # noqa: B018
