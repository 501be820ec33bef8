"""What a command says while it works, and of sizes that look like another unit."""

import logging
import re
import threading

import pytest
import toy_query
from toy_bodies import points_model

from parc_jax.answer.why import odd_size
from parc_jax.app.cli import process
from parc_jax.app.cli.process import SEARCHING, say
from parc_jax.common.sets.box import box
from parc_jax.problem.body import hull
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.problem_file import save_problem


def test_the_stage_is_named_unless_nothing_is_wanted(capsys):
    say("looking")
    assert capsys.readouterr().err == "looking ...\n"
    say("looking", quiet=True)
    assert capsys.readouterr().err == ""


def test_a_search_gives_signs_of_life_into_a_pipe(shell, files, monkeypatch):
    """Whoever waits reads what is done at present, also while a proof of no plan is looked for."""
    save_problem(files / "wall.toml", toy_query.gap(wall=True))
    asked = "solve", "model.npz", "wall.toml", "--out", "none.json", "--no-cache", "--work", 0.1
    monkeypatch.setattr(process, "SIGN_S", 1e-3)
    _, said, told = shell(*asked)
    after = told.partition(SEARCHING)[2]
    assert re.search(r"^\d+ s: proof of no plan: \d+ boxes, \d+ open$", after, re.MULTILINE)
    assert " s: " not in said.partition("\n")[0]
    assert shell(*asked, "--quiet")[2] == ""


@pytest.mark.parametrize("command", ["run", "learn", "solve", "check"])
def test_commands_that_take_long_give_signs_of_life(command, monkeypatch, capsys):
    monkeypatch.setattr(process, "SIGN_S", 1e-3)
    with process.logging_of([command]):
        logging.getLogger("parc_jax.some").info("at work")
        threading.Event().wait(0.1)
    assert ("s: at work" in capsys.readouterr().err) == (command != "check")


@pytest.mark.parametrize(
    ("radius", "word"),
    [
        (200.0, "body: its size of 200 m is more than all that the ways of this model"),
        (0.0001, "body: its size of 0.0001 m is less than a 1,000th of what the ways"),
        (0.9, None),
        (0.1, None),
        (0.0, None),
    ],
)
def test_a_body_in_another_unit_gets_a_word(radius, word):
    model = toy_query.planner().model
    told = odd_size(toy_query.gap().replace(body=type(toy_query.gap().body)(radius)), model)
    assert told is None if word is None else told.startswith(word)


def test_goals_without_bounds_are_no_size(rng):
    model = points_model(rng)
    goal = box([1.0, 1.0] + [-60.0] * 7, [3.0, 3.0] + [60.0] * 7)
    assert odd_size(reach_avoid(goal, [], hull("c0", radius=1.0)), model) is None
    assert "is it in metres?" in odd_size(reach_avoid(goal, [], hull("c0", radius=9.0)), model)
