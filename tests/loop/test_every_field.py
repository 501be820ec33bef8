"""Each field of what a loop is told, commits to and leaves behind reaches a sentence, a file's hash
or a refusal. Fields are read off the records: a new one without a rule fails.
"""

from dataclasses import fields, replace
from fractions import Fraction

import numpy as np
import pytest
from toy_models import line_model

import parc_jax as pj
from parc_jax.answer.looks import Look
from parc_jax.drive.loop.commitment import Begun, Commitment
from parc_jax.drive.loop.episode_file import episode_of, episode_part
from parc_jax.drive.loop.episodes import Episodes
from parc_jax.drive.loop.workers import Driven, Outcome, Task, run_one
from parc_jax.problem.problem import Span

pytestmark = pytest.mark.soundness
MODEL = line_model(4, 0.01, rests=True)
PATIENT = pj.drive.Effort(candidates=64, deadline=300.0)
BLOCK = pj.box([30.0, 30.0], [31.0, 31.0])
TASK = Task(0, np.zeros(2, np.uint32), np.zeros(2, np.uint32))


def loop_of(body=0.05):
    return pj.drive.Loop(MODEL, body, leave=0.5, given=(1,), effort=PATIENT)


LOOP, OTHER_LOOP = loop_of(), loop_of(0.06)


def step_of(loop, obstacles=(), spans=None):
    loop.restart()
    return loop.step(
        [0.0, 0.0], [0.1], obstacles, lambda seen: -seen.path[:, -1, 0], at=0.0, spans=spans
    )


def said_of(*commitments) -> list:
    """All that is said and written of commitments, each refusal in its words."""
    last = commitments[-1]
    path = np.zeros((3, 2))
    driven = run_one(
        lambda world, seed: Outcome(False, None, {}, commitments), lambda seed: 0, TASK
    )
    tell = [
        lambda: {**episode_part(commitments)["hash"], "premises": episode_part(commitments)},
        lambda: episode_of(episode_part(commitments), "file").statement,
        lambda: [one.loop for one in commitments],
        lambda: last.certificate(),
        lambda: [span.void for span in pj.drive.reserved(last, 0.5, MODEL.time)[1]],
        lambda: pj.drive.left_tube(commitments, path),
        lambda: driven,
        lambda: Episodes((driven,), Look(1, 1, Fraction(1, 1000)), "law", "drive").details(),
    ]
    return [words_of(one) for one in tell]


def words_of(tell) -> str:
    try:
        return repr(tell())
    except pj.InputError as error:
        return str(error)


def told_with(*spans) -> list:
    step = step_of(LOOP, [BLOCK] * len(spans), spans)
    return said_of(step.committed) if step.new else [step.reason]


DT = MODEL.time.dt
IN_WORDS = "of", "said", "mover"
PLAIN = Span((0, 3), DT, 0.0)
SPANS = {
    "pair": Span((0, 2), DT, 0.0),
    "dt": Span((0, 3), 2 * DT, 0.0),
    "at": Span((0, 3), DT, 1.0),
    "of": Span((0, 3), DT, 0.0, of=step_of(OTHER_LOOP).committed),
    "said": Span((0, 3), DT, 0.0, said="It goes on."),
    "mover": Span((0, 2), DT, 0.0, mover="one"),
}


def test_each_field_of_a_span_is_made_another():
    assert {"pair", *vars(PLAIN)} == {"pair", *Span.__annotations__} == SPANS.keys()


@pytest.mark.parametrize("field", SPANS)
def test_a_span_is_carried_in_each_field(field):
    other = SPANS[field]
    assert told_with(PLAIN) == told_with(PLAIN) != told_with(other)
    if field in IN_WORDS:  # of the file and of the episode
        one = SPANS["pair"] if field == "mover" else PLAIN
        then = Span((3, 3), DT, 0.0, said="It is.", mover="one")
        before, after = (told_with(x, then) for x in (one, other))
        assert before[1] != after[1] and before[-1] != after[-1]


def copied(one, **changes):
    """The same commitment with other fields, under way unless its episode is another."""
    made = replace(one, **({"episode": Begun()} | changes))
    if "episode" not in changes:
        made.episode.append(made)
    return made


COMMITMENTS = {
    "number": lambda one: one.number + 1,
    "begin": lambda one: one.begin + 1,
    "end": lambda one: one.end + 1,
    "k": lambda one: one.k + 1e-3,
    "clearance": lambda one: 0.125,
    "asked": lambda one: step_of(OTHER_LOOP).committed.asked,
    "drift": lambda one: 0.25,
    "drifted": lambda one: 0.25,
    "seen_outside": lambda one: [Fraction(1, 2)],
    "episode": lambda one: Begun(),
    "command": lambda one: "a cycle late",
    "given": lambda one: (),
}
# neither refused nor said: of no sentence
UNSAID = {"judged": "work that was done"}


def test_each_field_of_a_commitment_is_made_another():
    assert {field.name for field in fields(Commitment)} == {*COMMITMENTS, *UNSAID}


@pytest.mark.parametrize("field", COMMITMENTS)
def test_a_commitment_is_carried_in_each_field(field):
    one = copied(step_of(LOOP).committed)
    said = said_of(copied(one))
    assert said_of(copied(one)) == said
    assert said_of(copied(one, **{field: COMMITMENTS[field](one)})) != said


ONE = {"It goes on.": 1}
GOOD = Driven(0, False, False, "", {}, ["a loop"], None, False, ONE, ONE, ["one", "two"])
BAD = GOOD._replace(number=1, touched=True, told_then=True)
EPISODES = {
    "number": 7,
    "touched": False,
    "left": None,
    "failed": "why",
    "loops": ["another"],
    "told_for": 0.5,
    "told_then": False,
    "rests_on": {"It goes on.": 2},
    "told_in": {"It goes on.": 2},
    "drifted": 0.25,
    "before": 1,
    "manoeuvres": ["one", "two", "three"],
}
COUNTED = {"look": Look(2, 2, Fraction(1, 2000))} | dict.fromkeys(("law", "drive", "again"), "x")


def test_each_field_of_episodes_is_made_another():
    assert set(Driven._fields) == {*EPISODES, "told"}  # the caller's own values: of no sentence
    assert {field.name for field in fields(Episodes)} == {*COUNTED, "driven"}


@pytest.mark.parametrize("field", [*EPISODES, *COUNTED])
def test_what_is_said_of_a_loop_carries_each_field_of_its_episodes(field):
    # told_then is of those whose movers are told of for a while
    bad = BAD._replace(told_for=0.5) if field == "told_then" else BAD
    counted = {"look": Look(1, 1, Fraction(1, 1000)), "law": "law", "drive": "drive"}
    said = Episodes((GOOD, bad), **counted).details()
    if field in COUNTED:
        assert Episodes((GOOD, bad), **counted | {field: COUNTED[field]}).details() != said
        return
    other = bad._replace(**{field: EPISODES[field]})
    assert Episodes((GOOD, other), **counted).details() != said
