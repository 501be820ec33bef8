"""A fault in the user's own program: their file and line, in one sentence, exit code 2."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.start_gap import translation_gap
from parc_jax.learning.systems.python_system import python_system
from parc_jax.learning.systems.user_code import blamed, is_own, own_place, said

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


def test_what_is_no_trajectory_is_said():
    with pytest.raises(InputError, match=r"return Trajectory\(p, q\); got"):
        pj.learning.collect(Robot(lambda key, k: jnp.zeros((5, 2))), KEY, 4, quiet=True)
    with pytest.raises(InputError, match=r"return p \(5, 2\)"):
        pj.learning.collect(Robot(lambda key, k: (jnp.zeros((5, 2)), None)), KEY, 4, quiet=True)


@pytest.mark.slow
def test_a_bug_in_the_start_or_in_a_batch_of_another_kind():
    robot = Robot(lambda key, k: pj.Trajectory(jnp.zeros((5, 2)), k[:0]))
    robot.rollout_from = lambda key, k, p0: misspelt(key, k)
    with pytest.raises(InputError, match=r"rollout_from.*test_user_code.py, line"):
        translation_gap(robot, KEY, [[1.0, 1.0]])
    other = Robot(None)
    other.rollout_batch = lambda keys, ks: {}["gain"]
    with pytest.raises(InputError, match=r"test_user_code.py, line .*KeyError"):
        pj.learning.collect(other, KEY, 4, quiet=True)


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
        ("rollout", None, r"a method rollout\(key, k\)"),
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


def test_whose_code_is_whose():
    assert is_own(__file__) and not is_own(np.__file__) and not is_own(pj.__file__)
    assert not is_own(subprocess.__file__)
    told = RuntimeError(f'callback failed:\n  File "{__file__}", line 7, in f\nKeyError: 3')
    assert own_place(told).endswith("test_user_code.py, line 7")
    assert said(ValueError("\n one\ntwo")) == "ValueError: one" and said(KeyError()) == "KeyError"


@pytest.mark.slow
def test_the_shell_says_it_in_one_sentence(tmp_path):
    (tmp_path / "mine.py").write_text(
        textwrap.dedent(
            """
            import parc_jax as pj

            class Mine:
                name, n_p, n_q = "mine", 2, 0
                domain, time = pj.box([0.0], [1.0]), pj.learning.time_grid(0.25, 1.0)

                def rollout(self, key, k):
                    return pj.Trajectory(k.speed, k[:0])

            def system(plant: str = "good"):
                return Mine() if plant == "good" else missing
            """
        )
    )
    start = "from parc_jax.app.cli import main; main()"
    command = [
        sys.executable,
        "-c",
        start,
        "learn",
        "mine",
        "--out",
        "m.npz",
        "--quiet",
        "--no-cache",
    ]

    def told(*more):
        quiet = os.environ | {"TF_CPP_MIN_LOG_LEVEL": "3"}  # XLA remarks on programs that are kept
        ran = subprocess.run(
            [*command, *more], cwd=tmp_path, env=quiet, capture_output=True, text=True, check=False
        )
        assert ran.returncode == 2, ran.stderr
        assert len(ran.stderr.strip().splitlines()) == 1, ran.stderr
        return ran.stderr

    assert "mine.py, line 9" in told() and "mine.py, line 12" in told("--plant", "bad")
