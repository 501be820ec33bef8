"""What a command says while it works, and of sizes that look like another unit."""

import io
import threading

import pytest
import toy_query
from toy_bodies import points_model

from parc_jax.answer.why import odd_size
from parc_jax.app.cli import process as saying
from parc_jax.common.sets.box import box
from parc_jax.problem.body import hull
from parc_jax.problem.problem import reach_avoid


class Stream(io.StringIO):
    """Tells when a sign of life has been written to it."""

    def __init__(self, on_terminal):
        super().__init__()
        self.on_terminal, self.seen = on_terminal, threading.Event()

    def isatty(self):
        return self.on_terminal

    def write(self, text):
        super().write(text)
        if "... 0 s" in text:
            self.seen.set()


@pytest.mark.parametrize("on_terminal", [False, True])
def test_work_that_goes_on_says_so(on_terminal, monkeypatch):
    stream = Stream(on_terminal)
    monkeypatch.setattr(saying.sys, "stderr", stream)
    monkeypatch.setattr(saying, "EVERY_S", {on_terminal: 1e-3})
    with saying.saying() as say:
        say("looking")
        assert stream.seen.wait(60)
    said = stream.getvalue()
    if on_terminal:
        assert said.startswith("\r\x1b[Klooking ...\r\x1b[Klooking ... 0 s") and said.endswith(
            "\x1b[K"
        )
        assert "\n" not in said
    else:
        assert said.startswith("looking ...\nlooking ... 0 s\n") and "\r" not in said


def test_a_sign_of_life_every_ten_seconds_and_none_where_nothing_is_wanted(capsys):
    assert saying.EVERY_S == {True: 1.0, False: 10.0}
    with saying.saying(quiet=True) as say:
        say("looking")
    assert capsys.readouterr().err == ""


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
