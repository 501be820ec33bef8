"""A fault in the user's own program: their file and line, in one sentence."""

import random
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.systems.python_system import python_system
from parc_jax.learning.systems.user_code import blamed

KEY = jax.random.PRNGKey(0)
DOMAIN, TIME = pj.box([0.0, 0.0], [1.0, 1.0]), pj.learning.time_grid(0.25, 1.0)


class Robot:
    """A robot whose rollout is given."""

    name, n_p, n_q, domain, time = "robot", 2, 0, DOMAIN, TIME

    def __init__(self, rollout):
        self.rollout = rollout


def misspelt(key, k):
    return pj.Trajectory(k.valeus * 3, k[:0])


def misfit(key, k):
    return pj.Trajectory(jnp.ones((5, 3)) @ k, k[:0])


def branch(key, k):
    if k[0] > 0:
        return pj.Trajectory(jnp.ones((5, 2)), k[:0])
    return pj.Trajectory(jnp.zeros((5, 2)), k[:0])


def line_of(text: str) -> int:
    lines = Path(__file__).read_text().splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)


@pytest.mark.parametrize(
    ("rollout", "text", "kind"),
    [
        (misspelt, "k.valeus *", "AttributeError"),
        (misfit, "jnp.ones((5, 3)) @ k", "TypeError"),
        (branch, "if k[0] > 0:", "TracerBoolConversionError"),
    ],
)
def test_a_bug_in_a_rollout_is_named_with_file_and_line(rollout, text, kind):
    with pytest.raises(InputError) as caught:
        pj.learning.collect(Robot(rollout), KEY, 4, quiet=True)
    message = str(caught.value)
    assert message.startswith("robot: expected rollout(key, k) to run; it fails in ")
    assert f"test_user_code.py, line {line_of(text)} (" in message and kind in message
    assert "\n" not in message and caught.value.__cause__ is not None  # the traceback is kept


@pytest.mark.parametrize("rollout", [lambda key: key, lambda key, k, heading: k])
def test_a_rollout_of_other_arguments_is_said(rollout):
    with pytest.raises(InputError, match=r"expected rollout\(key, k\) to run; it fails: TypeError"):
        pj.learning.collect(Robot(rollout), KEY, 4, quiet=True)


def test_what_is_no_trajectory_is_said():
    with pytest.raises(InputError, match=r"return Trajectory\(p, q\); got"):
        pj.learning.collect(Robot(lambda key, k: jnp.zeros((5, 2))), KEY, 4, quiet=True)
    with pytest.raises(InputError, match=r"return p \(5, 2\)"):
        pj.learning.collect(Robot(lambda key, k: (jnp.zeros((5, 2)), None)), KEY, 4, quiet=True)


def stumble(rng, k):
    return np.zeros((5, 2)) / {}[k[0]], []


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 1])
def test_a_plain_function_that_never_works(workers):
    walk = python_system(stumble, DOMAIN, TIME, name="walk", n_p=2, workers=workers)
    with pytest.raises(InputError) as caught:
        pj.learning.collect(walk, KEY, 4, quiet=True)
    walk.close()
    message = str(caught.value)
    assert f"test_user_code.py, line {line_of('{}[k[0]]')}" in message and "KeyError" in message
    assert "all 4 runs of a batch failed" in message and "\n" not in message


@pytest.mark.parametrize(
    ("attribute", "value", "message"),
    [
        ("domain", ([0, 0], [1, 1]), "with domain, a Box; got tuple"),
        ("time", 1.0, "with time, a TimeGrid; got float"),
        ("n_p", 0, "n_p >= 1"),
        ("name", None, "with name, a str"),
        ("rollout", None, r"expected rollout\(key, k\) or"),
    ],
)
def test_what_is_no_system_is_said(attribute, value, message):
    robot = Robot(lambda key, k: pj.Trajectory(jnp.zeros((5, 2)), k[:0]))
    setattr(robot, attribute, value)
    with pytest.raises(InputError, match=message):
        pj.learning.collect(robot, KEY, 4, quiet=True)


def test_a_law_that_cannot_be_read():
    class Lawless(Robot):
        @property
        def law(self):
            return {"gust": {}["gust"]}

    with pytest.raises(InputError, match=r"a law that can be read; it fails in .*KeyError"):
        pj.learning.collect(Lawless(misfit), KEY, 4, quiet=True)


def test_faults_of_ours_stay_what_they_are():
    with pytest.raises(ValueError, match="concatenate"):  # no line of theirs has a part in it
        pj.learning.collect(Robot(jnp.concatenate), KEY, 4, quiet=True)
    with pytest.raises(InputError, match=r"^mine$"), blamed("ours"):
        raise InputError("mine")


RNG = np.random.default_rng(0)


@pytest.mark.parametrize("draw", [np.random.normal, random.random, RNG.normal])
def test_chance_that_is_drawn_once_for_all_runs_is_refused(draw):
    """JAX keeps the number it meets as a program is made: runs without a gust, all alike."""

    def gusty(key, k):
        return pj.Trajectory(jnp.zeros((5, 2)).at[1:].set(draw()), k[:0])

    robot = Robot(gusty)
    for _ in range(2):  # it is found compiled in no call
        with pytest.raises(
            InputError, match=r"robot: expected randomness from the key.*np\.random"
        ):
            pj.learning.collect(robot, KEY, n=4, quiet=True)


def test_chance_that_changes_no_run_is_nobody_s_business():
    """A floor of a seed, drawn as a program is made; it is the same in each."""

    def uneven(key, k):
        random.seed(3)
        return pj.Trajectory(jnp.zeros((5, 2)).at[1:].set(random.random()), k[:0])

    pj.learning.collect(Robot(uneven), KEY, n=4, quiet=True)


def test_a_system_is_not_named_as_a_log():
    robot = Robot(None)
    robot.name = "file:robot"
    with pytest.raises(InputError, match="file:robot: expected a name that no log has"):
        pj.learning.collect(robot, KEY, n=4, quiet=True)


def test_a_class_in_the_place_of_a_system_is_told_so():
    """Its `rollout` lacks `self`: a raw TypeError of the simulation."""

    class Glider(Robot):
        rollout = staticmethod(misfit)

    for asked in (
        lambda: pj.learn(Glider, KEY),
        lambda: pj.learning.collect(Glider, KEY, 4, quiet=True),
    ):
        with pytest.raises(InputError, match=r"Glider: expected a system; .* Try Glider\(\)\."):
            asked()
