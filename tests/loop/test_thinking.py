"""Thinking takes time, and is a part of the manoeuvre: a planner that is late, clocks that do not
fit, poses that jump.
"""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from toy_models import line_model, model_of, uniform_tube

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.drive.loop import loop as loop_module
from parc_jax.drive.loop.episode_file import episode_part
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.network.relu import relu_network

WAITS, HELD = 0.25, 0.5  # [s] a run of one second: it waits, follows its command, stops
WALL = pj.box([2.0, -2.0], [2.1, 2.0])
RADIUS = 0.1
THINKING = pj.drive.Thinking(WAITS, {"k1": "k0"}, HELD, [0.0])


def model(waits: float = WAITS):
    """k_0: the velocity along x that is commanded, k_1: the one before it. The cart has it at once,
    a quarter of a second after it was decided.
    """
    t = np.linspace(0, 1, 5)[1:]
    W = np.zeros((9, 2))
    W[0:8:2, 0] = np.clip(t - waits, 0, HELD)
    W[0:8:2, 1] = np.minimum(t, waits)
    return model_of(
        relu_network([W], [np.zeros(9)]), pj.box([-1, -1], [1, 1]), *uniform_tube(4, 0.01)
    )


def loop_of(**options):
    effort = pj.drive.Effort(candidates=64, deadline=WAITS)
    options = {"leave": HELD, "given": (1,), "thinking": THINKING, "effort": effort} | options
    return pj.drive.Loop(model(), RADIUS, **options)


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes forward where a test says so."""
    now = SimpleNamespace(seconds=0.0)
    fake = SimpleNamespace(perf_counter=lambda: now.seconds)
    monkeypatch.setattr(loop_module, "time", fake)
    return now


def forward(seen):
    return -seen.path[:, -1, 0]


class Cart:
    """The plant: does what it is told, when it is told, in quarters of a second."""

    def __init__(self):
        self.commands, self.path = {}, [np.zeros(2)]

    def begin(self, at: float, v: float):
        """From a time on; it stops by itself after HELD."""
        self.commands[at] = v

    def drive(self, seconds: float):
        for _ in range(round(seconds / 0.25)):
            now = 0.25 * (len(self.path) - 1)
            at = max((at for at in self.commands if at <= now), default=-9.0)
            v = self.commands[at] if now - at < HELD else 0.0
            self.path.append(self.path[-1] + [0.25 * v, 0.0])


def episode(loop, clock, slow, thinks=True, cycles=12):
    """Commitments and the path of a cart, that is looked at every half second. slow: [s] that each
    step takes.
    """
    cart, done = Cart(), []
    for i in range(cycles):
        now, took = i * HELD, slow[i % len(slow)]

        def prefer(seen, took=took):
            clock.seconds += took
            return forward(seen)

        step = loop.step(cart.path[-1], [] if thinks else [0.0], [WALL], prefer, at=now)
        if step.new:
            cart.begin(now + WAITS, step.committed.k[0])
            done.append(step.committed)
        cart.drive(HELD)
    cart.drive(1.0)
    return done, np.array(cart.path)


def test_a_loop_that_knows_how_long_it_thinks_stays_inside_and_touches_nothing(clock):
    done, path = episode(loop_of(), clock, slow=[0.2])
    assert len(done) > 4 and 1.6 < path[:, 0].max() < 1.9
    assert not pj.drive.left_tube(done, path) and path[-1, 0] == path[-2, 0]
    assert [one.k[1] for one in done] == [0.0, *(one.k[0] for one in done[:-1])]
    report = checker.check_episode(json.loads(json.dumps(episode_part(done))), allowance_of)
    assert report.manoeuvres == len(done)
    said = (
        "of each manoeuvre its command begins 0.25 s after its begin and is followed until 0.75 s"
    )
    assert any(said in str(value) for _, _, value in report.premises)
    words = done[1].certificate()["meta"]["rests_on"]
    assert any(text.startswith("its command begins 0.25 s after its begin") for text in words)
    other = replace(done[0], command="")
    assert other.loop != done[0].loop
    # with its numbers, not by a hash alone
    assert "its command begins 0.25 s after its begin and is followed until 0.75 s" in done[0].loop
    assert "from when on the command is (0.0)" in done[0].loop


def test_a_loop_that_forgets_it_leaves_its_tubes(clock):
    """What is assumed where no time to think is declared: the very robot of the test above."""
    loop = pj.drive.Loop(
        model(waits=0.0), RADIUS, leave=HELD, given=(1,), effort=pj.drive.Effort(64, deadline=WAITS)
    )
    done, path = episode(loop, clock, slow=[0.0], thinks=False)
    assert pj.drive.left_tube(done, path)


def test_a_planner_that_is_late_never_commits_and_the_cart_stops(clock):
    done, path = episode(loop_of(), clock, slow=[0.0, 0.3, 0.1, 0.3, 0.3])
    assert 3 < len(done) < 10 and not pj.drive.left_tube(done, path)
    assert path[:, 0].max() < 1.9
    done, path = episode(loop_of(), clock, slow=[0.0, 0.3, 0.3, 0.3, 0.3, 0.3])
    assert len(done) == 2 and done[1].k[1] == 0.0  # it rested in between
    assert path[3, 0] == path[12, 0] > 0.4


def test_who_thinks_too_long_goes_on_with_the_stop_in_hand(clock):
    loop = loop_of()
    ask = ([0.0, 0.0], [], [WALL], forward)
    clock.seconds = 5.0
    late = loop.step(*ask, measured=5.0 - 1.01 * WAITS)
    assert not late.new and "no manoeuvre was proved within 0.25 s" in late.reason
    assert "measured" in loop.step(*ask, measured=np.nan).reason
    other = loop.step(*ask, measured=1.8e9)  # of another clock: no deadline would count
    assert not other.new and "the loop's own clock, at 5 s; got 1800000000 s" in other.reason
    ahead = loop.step(*ask, measured=5.001)  # which is told, however little it is
    assert not ahead.new and "at 5 s; got 5.001 s" in ahead.reason
    assert loop.step(*ask, measured=5.0 - 0.99 * WAITS).new
    loop.restart()
    assert loop.step(*ask, measured=np.nextafter(5.0, 6.0)).new  # one moment, as another float


def test_a_command_that_changes_while_a_step_thinks_is_refused(clock):
    loop = loop_of(leave=WAITS)
    first = loop.step([0.0, 0.0], [], [WALL], forward, at=0.0).committed
    v = first.k[0]

    def asked(at):
        loop.under_way = first
        return loop.step([np.clip(at - WAITS, 0, HELD) * v, 0.0], [], [WALL], forward, at=at)

    for at, command in ((0.25, v), (0.5, v), (0.75, 0.0), (7.0, 0.0)):
        assert asked(at).committed.k[1] == command
    for at in (0.6, 0.74):
        assert not asked(at).new and "commands change at 0.25 and 0.75 s" in asked(at).reason


def test_a_pose_outside_of_the_tube_begins_nothing(clock):
    loop = loop_of()
    first = loop.step([0.0, 0.0], [], [WALL], forward, at=0.0).committed
    there = 0.25 * first.k[0]

    def asked(x, y, **known):
        loop.under_way = first
        first.seen_outside.clear()
        return loop.step([x, y], [], [WALL], forward, at=0.5, **known)

    for x, y, believed in ((there, 0.0099, True), (there, 0.0101, False), (there + 40, 0, False)):
        assert asked(x, y).new == believed
    step = asked(there + 40.0, 0.0)
    assert "by 0.5 s; this one is 40 m beyond what tube, uncertainty and drift allow" in step.reason
    assert step.committed is first and "begin again with `restart`" in step.reason
    assert asked(there + 0.05, 0.0, drift=0.05).new
    assert not asked(there + 0.07, 0.0, drift=0.05).new
    back = loop.step([there, 0.0], [], [WALL], forward, at=0.5)  # what was left stays left
    assert not back.new and "by 0.5 s a pose was beyond what tube" in back.reason
    for drift in (-0.1, np.nan):
        assert "drift: expected" in asked(there, 0.0, drift=drift).reason
    loop.restart()
    assert loop.step([there + 40.0, 0.0], [], [WALL], forward, at=0.5).new
    wide = loop_of(uncertainty=pj.Uncertainty(start=0.01))
    wide.step([0.0, 0.0], [], [WALL], forward, at=0.0)
    assert wide.step([there + 0.0499, 0.0], [], [WALL], forward, at=0.5).new


@pytest.mark.parametrize("cycle", [0, 2])
def test_a_command_that_comes_late_is_said_to_be_late(clock, cycle):
    """A loop that does not know of it, and a cart that begins one command a cycle late."""
    loop = pj.drive.Loop(
        model(waits=0.0), RADIUS, leave=HELD, given=(1,), effort=pj.drive.Effort(64, deadline=WAITS)
    )
    cart, steps = Cart(), []
    for i in range(cycle + 2):
        steps.append(loop.step(cart.path[-1], [0.0], [WALL], forward, at=i * HELD))
        cart.begin((i + (i == cycle)) * HELD, steps[-1].committed.k[0])
        cart.drive(HELD)
    assert [step.new for step in steps] == [True] * (cycle + 1) + [False]
    assert (
        "m beyond what tube, uncertainty and drift allow, and where it would be" in steps[-1].reason
    )
    assert "had the last command come late or never: see thinking" in steps[-1].reason


def test_before_it_may_be_left_a_manoeuvre_goes_on(clock):
    loop = loop_of()
    first = loop.step([0.0, 0.0], [], [WALL], forward, at=0.0)
    early = loop.step([0.0, 0.0], [], [WALL], forward, at=0.25)
    assert not early.new and early.committed is first.committed
    assert "left from 0.5 s to 1 s after its beginning, or at rest; this is after 0.25 s" in (
        early.reason
    )


def test_a_manoeuvre_is_left_when_those_of_the_runs_were(clock):
    law = replace(
        model().claim.law, k_law="a chain of 2 manoeuvres before it, each left after 0.5 to 0.75 s"
    )
    chained = model().replace(claim=derived(model().claim, law=law))
    asked = {"given": (1,), "thinking": THINKING, "effort": pj.drive.Effort(64, deadline=WAITS)}
    with pytest.raises(InputError, match=r"leave: .* from 0.5 s to 0.75 s .* after 0.25 s"):
        pj.drive.Loop(chained, RADIUS, leave=0.25, **asked)
    loop = pj.drive.Loop(chained, RADIUS, leave=HELD, **asked)
    first = loop.step([0.0, 0.0], [], [WALL], forward, at=0.0).committed
    for at, begun in ((0.75, True), (0.8, False), (1.0, True)):
        loop.under_way = first
        x = np.clip(at - WAITS, 0, HELD) * first.k[0]
        assert loop.step([x, 0.0], [], [WALL], forward, at=at).new == begun


def test_a_start_that_touches_and_an_end_out_of_reach_are_told(clock):
    step = loop_of().step([1.95, 0.0], [], [WALL], forward)
    assert not step.new and "where the plan starts, the body, which reaches 0.1 m" in step.reason
    assert "touches obstacle 0" in step.reason
    far = from_box(pj.box([3.0, -1.0, -1.0], [4.0, 1.0, 1.0]))
    step = loop_of(end=far).step([0.0, 0.0], [], [], forward)
    assert not step.new and "no plan of the model ends in the goal from where it" in step.reason


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"effort": pj.drive.Effort(deadline=0.3)}, "a deadline within the 0.25 s of thinking"),
        ({"leave": 0.25, "thinking": pj.drive.Thinking(0.5, {1: 0}, 0.25, [0])}, "no earlier"),
        ({"thinking": pj.drive.Thinking(0.25, {0: 1}, 0.5, [0])}, "every chosen parameter once"),
        ({"thinking": pj.drive.Thinking(0.25, {}, 0.5, [])}, "every chosen parameter once"),
        ({"thinking": pj.drive.Thinking(0.25, {1: 0.0}, 0.5, [0])}, "every chosen parameter once"),
        ({"thinking": pj.drive.Thinking(0.25, {True: 0}, 0.5, [0])}, "every chosen parameter"),
        ({"thinking": pj.drive.Thinking(0.25, [(1, 0)], 0.5, [0])}, "every chosen parameter once"),
        (
            {"thinking": pj.drive.Thinking(0.25, {1: 0}, 0.8, [0])},
            "together within a manoeuvre of 1 s",
        ),
        ({"thinking": pj.drive.Thinking(0.0, {1: 0}, 0.5, [0])}, "above 0 s"),
        ({"thinking": pj.drive.Thinking(0.25, {1: 0}, 0.5, [2])}, "rest within K"),
    ],
)
def test_what_makes_no_sense_is_told(options, words):
    with pytest.raises(InputError, match=words):
        loop_of(**options)


def test_without_a_time_to_think_the_caller_gives_all(clock):
    loop = pj.drive.Loop(
        line_model(4, 0.01, rests=True), RADIUS, leave=0.5, given=(1,), effort=pj.drive.Effort(64)
    )
    assert "given" in loop.step([0.0, 0.0], [], [], forward).reason
