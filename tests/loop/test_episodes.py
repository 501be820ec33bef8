"""What is claimed of a loop: fresh episodes, counted once each, whatever stops them."""

import copy
import enum
import json
import os
import sys
from dataclasses import dataclass
from datetime import timedelta
from decimal import Decimal
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from episodes import PATIENT, driven
from toy_episodes import Toy, law, no_outcome
from toy_models import line_model

import parc_jax as pj
from parc_jax import checker
from parc_jax.checker.answer import allowance_of
from parc_jax.common.arrays import once
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, as_key, key_data, stream
from parc_jax.drive.loop import workers as workers_of
from parc_jax.drive.loop.episodes import ABOUT, LINES, task_of, told_again
from parc_jax.learning.bound.counts import clopper_pearson
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.runs import chunks
from parc_jax.problem.problem import Span
from parc_jax.statement import about_obstacles

KEY = jax.random.PRNGKey(4)


def asked(drive, n, **options):
    return pj.drive.drive_episodes(drive, law, KEY, n, **{"workers": 0, "quiet": True} | options)


def test_every_bad_episode_is_counted_and_the_bound_is_that_of_the_count():
    done = asked(Toy(left=0.7, touched=0.9, breaks=0.97), 100)
    words = key_data(stream(KEY, Stage.EPISODE))
    worlds = np.array([law(task_of(words, i).of_world) for i in range(100)])
    assert done.failed == (worlds > 0.97).sum() > 0
    assert done.touched == ((worlds > 0.9) & (worlds <= 0.97)).sum() > 0
    assert done.left == ((worlds > 0.7) & (worlds <= 0.97)).sum() > done.touched
    assert done.bad == (worlds > 0.7).sum()
    assert done.eps == clopper_pearson(done.bad, 100, 0.001) and done.contradictions == ()
    said = done.details()
    assert f"Of 100 fresh episodes {done.bad} were bad: in {done.left} a tube was left" in said
    assert "With confidence 0.999 over them, an episode of this law leaves a tube, or" in said
    assert "What runs into a robot that rests is not counted." in said
    assert "; the driver (Toy, content" in said and "were settled before the first episode" in said
    assert "no episodes were driven for it but those of its 1 look, under any key; what" in said
    assert said.startswith("(C) is not said: no episode tells of a manoeuvre that a loop committed")


def test_without_a_bad_one_it_is_the_well_known_bound():
    done = asked(Toy(), 50, delta=0.01)
    assert done.bad == 0 and float(done.eps) == pytest.approx(1 - 0.01 ** (1 / 50))
    assert float(done.eps) >= 1 - 0.01 ** (1 / 50)


@dataclass(frozen=True)
class Looped(Toy):
    """A toy with a loop of a tube so wide, which commits in worlds above `idle`."""

    width: float = 0.01
    idle: float = 0.5

    def __call__(self, world, seed):
        loop = loop_of(self.width)
        loop.restart()
        step = loop.step([0.0, 0.0], [0.1], [], lambda seen: -seen.path[:, -1, 0])
        done = [step.committed] if world > self.idle else []
        return super().__call__(world, seed)._replace(committed=done)


@cache
def loop_of(width):
    model = line_model(4, width, rests=True)
    return pj.drive.Loop(model, 0.05, leave=0.5, given=(1,), effort=PATIENT)


def test_what_is_touched_inside_the_tubes_of_a_loop_is_said_to_contradict():
    done = asked(Looped(touched=0.8), 20)
    assert done.contradictions and "CONTRADICTED" in done.details()
    done = asked(Toy(touched=0.8), 20)  # nobody proved anything of it
    assert not done.contradictions and "CONTRADICTED" not in done.details()


def test_the_sentence_says_until_when_what_moves_is_told_of():
    def drive(until, first=0, other=0, touched=False, when=None):
        def one(world, seed):
            loop = loop_of(0.01)
            loop.restart()
            dt, block = loop.model.time.dt, pj.box([20.0, 20.0], [21.0, 21.0])
            parts, spans = pj.problem.moving(block, [0.1, 0.0], (first, until), dt, at=0.0)
            more, whole = pj.problem.moving(block, [0.1, 0.0], (other, 3), dt, at=0.0)
            goes = {"at": 0.0, "spans": spans + whole}
            step = loop.step([0.0] * 2, [0.1], parts + more, lambda x: -x.path[:, -1, 0], **goes)
            assert step.new
            return pj.drive.Outcome(touched, False, {}, [step.committed], when if touched else None)

        return asked(one, 3)

    for short in (drive(1), drive(1, other=2)):  # another one begins where it ends
        assert [one.told_for for one in short.driven] == [0.5] * 3
        assert ", of some for the first 0.5 s alone: later it may run into" in short.details()
    for whole in (drive(3), drive(3, first=2)):
        assert whole.driven[0].told_for is None and "for the first" not in whole.details()
    # who came after it was told of contradicts nothing
    assert drive(3, touched=True).contradictions and not drive(1, touched=True).contradictions
    for when, contradicts in ((0.4, True), (0.5, False), (0.9, False)):
        assert bool(drive(1, touched=True, when=when).contradictions) == contradicts
    assert not drive(1, when=0.4).contradictions


LAW = "Movers within 0.3 m each leave their tube with probability at most 0.1."


def with_movers(n: int):
    """Drives once among n movers, of which a sentence says how surely they are where they are."""

    def one(world, seed):
        loop = loop_of(0.01)
        loop.restart()
        far = [pj.box([20.0, 20.0], [21.0, 21.0])] * 2 * n
        pairs = [(0, 0), (1, 1)] * n
        told = {"dt": loop.model.time.dt, "at": 0.0, "said": LAW}
        spans = [pj.problem.Span(x, **told, mover=f"mover {i // 2}") for i, x in enumerate(pairs)]
        goes = {"at": 0.0, "spans": spans}
        step = loop.step([0.0] * 2, [0.1], far, lambda x: -x.path[:, -1, 0], **goes)
        return pj.drive.Outcome(False, False, {}, [step.committed])

    return one


def test_the_risk_of_movers_is_part_of_what_is_said_of_a_loop(tmp_path):
    """Against whom, how many at a time, until when: in the sentence, in its folder, in files."""
    done = asked(with_movers(2), 3, folder=tmp_path)
    assert f"Of at most 2 at a time: {LAW}" in done.details()
    assert "for the first 0.5 s alone" in done.details()
    assert asked(with_movers(2), 3, folder=tmp_path).details() == done.details()  # as it is stored
    assert f"Of at most 3 at a time: {LAW}" in asked(with_movers(3), 3).details()
    assert LAW not in asked(Looped(), 3).details()
    file = pj.drive.save_episode(tmp_path / "drive.json", with_movers(2)(0, 0).committed)
    said = checker.check_episode(json.loads(file.read_text()), allowance_of).premises
    assert ["said of obstacles", "assumed"] in [entry[:2] for entry in said]
    (told,) = (value for name, _, value in said if name == "said of obstacles")
    least = "for the first 0.5 s of each manoeuvre that rests on this, at least."
    assert told == f"{least} Of at most 2 at a time: {LAW}"


def test_how_far_the_frame_drifted_is_part_of_what_is_said_of_a_loop(tmp_path):
    """The sum in the worst of the episodes, also of one that began anew, and of a folder."""

    def drive(world, seed, drift=0.125, again=False):
        loop, begun = loop_of(0.01), []
        loop.restart()
        for at in (0.0, 0.5)[: 1 + (world > 0.5)] + (3.0,) * again:
            if at == 3.0:
                loop.restart()
            more = {"at": at, "drift": drift}
            begun.append(loop.step([0.0] * 2, [0.1], [], lambda x: x.path[:, -1, 0] ** 2, **more))
        return pj.drive.Outcome(False, False, {}, [step.committed for step in begun])

    said = asked(drive, 4, folder=tmp_path).details()
    assert (
        "Of each episode is assumed: obstacles and a goal are where they are told to be, in a "
        "frame that may have turned, and drifted by 0.25 m where the robot is, since the episode "
        "began. (E)" in said
    )
    assert asked(drive, 4, folder=tmp_path).details() == said
    assert "drifted by 0.375 m where" in asked(partial(drive, again=True), 4).details()

    def another_order(world, seed):
        done = drive(world, seed)
        return done._replace(committed=iter(done.committed[::-1]))

    assert "drifted by 0.25 m where" in asked(another_order, 4).details()
    assert "drifted" not in asked(partial(drive, drift=0.0), 4).details()


def test_a_heading_that_no_pose_tells_is_said_to_be_that_of_the_runs(tmp_path):
    assert (
        "heading told of no pose: each manoeuvre begins with that of"
        in asked(Looped(), 8).details()
    )
    for turning in (False, True):
        done = driven(turning, 1)
        file = json.loads(pj.drive.save_episode(tmp_path / "drive.json", done).read_text())
        (said,) = (value for name, _, value in file["premises"] if name == "heading")
        assert ("told of no pose" in said) == ("told of no pose" in done[0].loop) == (not turning)


def test_a_start_of_which_nothing_is_measured_is_said_to_be_that_of_the_runs(tmp_path):
    """Runs that begin at rest say nothing of a manoeuvre that begins while the robot moves."""
    for given in ((1,), ()):
        loop = pj.drive.Loop(
            line_model(4, 0.01, rests=True), 0.05, leave=0.5, given=given, effort=PATIENT
        )
        one = loop.step([0.0, 0.0], [0.0] * len(given), [], lambda seen: seen.k[:, 0]).committed
        path = pj.drive.save_episode(tmp_path / "drive.json", [one], assumed={"start": "level"})
        file = json.loads(path.read_text())
        assert checker.check_episode(file, allowance_of).manoeuvres == 1
        told = {name: value for name, _, value in file["premises"]}
        said = told.get("START", "")
        assert told["start"] == "level"  # what the user assumes of it stands beside it
        begins = "each manoeuvre begins as the model's runs did"
        assert (begins in said) == (begins in one.loop) == (not given)
        assert any(begins in text for text in one.certificate()["meta"]["rests_on"]) == (not given)


def test_a_folder_in_which_an_episode_failed_goes_on(tmp_path):
    """It was refused, as one that was changed."""
    drive = Toy(breaks=0.8)
    looks = {"looks": (10, 20), "folder": tmp_path}
    first = asked(drive, 10, **looks)
    assert 0 < first.failed < 10
    both = asked(drive, 20, **looks)
    assert both.driven[:10] == first.driven
    at_once = asked(drive, 20, looks=(10, 20), folder=tmp_path / "at once")
    assert both.details() == at_once.details()


def test_a_folder_of_another_version_is_refused(tmp_path, monkeypatch):
    asked(Toy(), 6, folder=tmp_path)
    monkeypatch.setattr(chunks, "__version__", "0.0.1")
    with pytest.raises(InputError, match="the same version"):
        asked(Toy(), 6, folder=tmp_path)


def test_a_way_of_which_a_part_is_left_out_is_told_of_no_longer():
    loop = loop_of(0.01)
    loop.restart()
    dt, block = loop.model.time.dt, pj.box([20.0, 20.0], [21.0, 21.0])
    parts, spans = pj.problem.moving(block, [0.1, 0.0], (0, 3), dt, at=0.0, every=1)
    goes = {"at": 0.0, "spans": spans[:2]}
    one = loop.step([0.0] * 2, [0.1], parts[:2], lambda x: -x.path[:, -1, 0], **goes).committed
    assert len(parts) == 4 and float(one.told_until) == 2 * dt
    # another that begins there, or goes on there, goes on for nobody else
    for first, at in ((2, 0.0), (0, 0.0)):
        other = pj.problem.moving(block, [0.2, 0.0], (first, 3), dt, at=at, every=2)
        goes = {"at": 0.0, "spans": [*spans[:2], *other[1]]}
        more = [*parts[:2], *other[0]]
        one = loop_of(0.01).step([0.0] * 2, [0.1], more, lambda x: -x.path[:, -1, 0], **goes)
        assert float(one.committed.told_until) == 2 * dt


@pytest.mark.parametrize("mover", ["", "cart", "cart from 1", "cart from 2", "bus from 42"])
def test_of_what_is_told_of_late_alone_all_say_so(mover, tmp_path):
    """Only of one told of from 2 on is it said what was before; of a contact that is assumed."""
    far, said = [pj.box([20.0, 20.0], [21.0, 21.0])], "A cart keeps to its plan."

    def drive(*_):
        loop = loop_of(0.01)
        loop.restart()
        spans = [pj.problem.Span((2, 3), at=0.0, said=said, mover=mover)]
        step = loop.step([0.0] * 2, [0.1], far, lambda x: -x.path[:, -1, 0], at=0.0, spans=spans)
        return pj.drive.Outcome(True, False, {}, [step.committed], 0.4)

    (one,), done, told = drive().committed, asked(drive, 3), mover.endswith("m 2")
    assert one.told_until == (one.end if told else one.begin)
    assert ("until 0 s" in repr(one)) == (not told) == (not done.contradictions)
    assert (", of some for the first 0 s alone" in done.details()) == (not told)
    text = pj.drive.save_episode(tmp_path / "drive.json", [one]).read_text()
    assert f"for the first {1 if told else 0} s of each manoeuvre that rests on this" in text
    answer = about_obstacles(one.asked.problem, one.asked.model.time)
    assert ("alone, until 1 s of it at least: of it nothing is said later." in answer) == told
    assert ("alone: of it nothing is said at other times." in answer) == (not told)
    where = "What is in the way is, before interval {} of a plan, counted from 0, nowhere"
    before = f"{where.format(2)} or told of apart."
    assert where.format(42) not in f"{text} {answer} {done.details()}"
    for words in (text, answer, done.details()):
        assert (f"{said} {before}" in words) == told and said in words


def test_what_was_driven_before_a_restart_is_under_way_no_more():
    """Contact in the second manoeuvre, inside its tube, by what was told of: a contradiction."""

    def drive(*_):
        loop, driven = loop_of(0.01), []
        dt, block = loop.model.time.dt, pj.box([20.0, 20.0], [21.0, 21.0])
        for begin in (0.0, 9.0):
            parts, spans = pj.problem.moving(block, [0.1, 0.0], (0, 1), dt, at=begin)
            asked = {"at": begin, "spans": spans}
            loop.restart()
            step = loop.step([0.0] * 2, [0.1], parts, lambda x: -x.path[:, -1, 0], **asked)
            driven.append(step.committed)
        return pj.drive.Outcome(True, False, {}, driven, 9.0 + dt)

    told = {"law": lambda seed: 0, "workers": 0, "quiet": True}
    done = pj.drive.drive_episodes(drive, key=jax.random.key(0), n=1, **told)
    assert done.contradictions == (0,) and done.driven[0].told_then


def test_a_pose_that_a_loop_saw_outside_of_its_tube_counts_as_a_tube_that_was_left():
    def drive(left):
        def one(world, seed):
            loop = loop_of(0.01)
            loop.restart()
            goes = [], lambda seen: -seen.path[:, -1, 0]
            first = loop.step([0.0, 0.0], [0.1], *goes).committed
            assert loop.step([0.0, 9.0], [0.1], *goes).left
            return pj.drive.Outcome(False, left, {}, [first])

        return asked(one, 3)

    done = drive(False)
    assert "in 3 a tube was left" in done.details()
    assert "grown by 0.05 m, safe for what is measured, exactly" in done.details()
    done = drive(None)  # nobody tested it, and yet it was seen
    assert done.bad == 3 and "in 3 a tube was left" in done.details()


def test_a_tube_that_was_left_counts_where_its_manoeuvre_is_not_listed():
    """The last need not be listed, and no other begins after a pose outside of its tube."""

    def drive(world, seed):
        loop, place, done = loop_of(0.01), 0.0, []
        loop.restart()
        for at in (0.0, 0.5):
            ahead = lambda seen: -seen.path[:, -1, 0]  # noqa: E731
            done.append(loop.step([place, 0.0], [0.0], [], ahead, at).committed)
            place += done[-1].k[0] / 2
        assert loop.step([place, 9.0], [0.0], [], ahead, 1.0).left
        return pj.drive.Outcome(False, False, {}, done[:1])

    assert asked(drive, 3).bad == 3


def test_of_how_many_a_tube_was_left_is_said_where_few_were_tested():
    done = asked(lambda world, seed: pj.drive.Outcome(False, True if world > 0.5 else None), 8)
    seen = sum(one.left is True for one in done.driven)
    assert 0 < seen < 8
    assert f"in {seen} a tube was left, of {seen} in which that was tested, in" in done.details()


def test_a_driver_that_ends_its_program_has_failed():
    """In this process it ended the whole call, and nothing was told of the episode."""

    def ends(world, seed):
        if world > 0.5:
            sys.exit("out of battery")
        return pj.drive.Outcome(False, False)

    done = asked(ends, 8)
    assert 0 < done.failed < 8 and done.bad == done.failed


def test_an_episode_that_leaves_out_what_it_drove_has_failed():
    done = driven(False)
    some = [(done[:-2], "2 of 4"), (done[-1:], "1 of 4"), (done[1:], "3 of 4")]
    some += [((*done[:2], done[0], done[1]), "2 of 4")]
    for given, of in ((done, ""), (done[:-1], ""), *some):
        law = {"law": lambda seed: 0, "key": KEY, "n": 1, "workers": 0, "quiet": True}
        outcome = pj.drive.Outcome(False, False, {}, given)
        if not of:  # the last one may have begun when the episode ended
            assert not pj.drive.drive_episodes(lambda *_, it=outcome: it, **law).bad
            continue
        with pytest.raises(InputError, match=f"that the robot drove; got {of} that its loop"):
            pj.drive.drive_episodes(lambda *_, it=outcome: it, **law)


def test_an_episode_that_begins_with_what_was_under_way_is_told_from_there_on():
    model, place, done = line_model(4, 0.01, rests=True), 0.0, []
    loop = pj.drive.Loop(model, 0.05, leave=0.5, given=(1,), effort=PATIENT)
    for i in range(5):
        if i == 3:
            loop.restart(done[-1])
        ahead = lambda seen: -seen.path[:, -1, 0]  # noqa: E731
        done.append(loop.step([place, 0.0], [0.0], [], ahead, 0.5 * i).committed)
        place += done[-1].k[0] / 2
    for given in (done[2:], done):
        outcome = pj.drive.Outcome(False, False, {}, given)
        law = {"law": lambda seed: 0, "key": KEY, "n": 1, "workers": 0, "quiet": True}
        assert not pj.drive.drive_episodes(lambda *_, it=outcome: it, **law).bad


def test_what_else_made_an_episode_bad_is_told_in_its_own_words_and_is_no_tube_that_was_left():
    def drive(world, seed):
        return pj.drive.Outcome(False, "odometry drifted beyond" if world > 0.5 else world > 0.3)

    done = asked(drive, 40)
    words = key_data(stream(KEY, Stage.EPISODE))
    worlds = np.array([law(task_of(words, i).of_world) for i in range(40)])
    drifted, left = (worlds > 0.5).sum(), ((worlds > 0.3) & (worlds <= 0.5)).sum()
    said = f"{left} a tube was left, in {drifted} odometry drifted beyond, in 0 something was"
    assert said in done.details() and done.bad == drifted + left and done.left == left
    with pytest.raises(InputError, match="None or a text; got False and ''"):
        asked(lambda *_: pj.drive.Outcome(False, ""), 1)
    with pytest.raises(InputError, match="None or a text; got False and '  '"):
        asked(lambda *_: pj.drive.Outcome(False, "  "), 1)
    for hidden in ("\u200b", "drifted\naway"):
        with pytest.raises(InputError, match="None or a text; got False and"):
            asked(lambda *_, hidden=hidden: pj.drive.Outcome(False, hidden), 1)
    # a time of what was not touched, or none
    for touched, at in ((False, 3.0), (True, np.nan), (True, True)):
        with pytest.raises(InputError, match=f"a finite time; got {at}, touched {touched}"):
            asked(lambda *_, told=(touched, at): pj.drive.Outcome(told[0], touched_at=told[1]), 1)


def test_what_is_driven_by_another_seed_replaces_the_file_of_no_episode(tmp_path):
    """A driver names its files by the seed: that of the second episode held what the first did."""

    def drive(world, seed):
        drawn = float(np.random.default_rng(seed).uniform())
        place = tmp_path / "_".join(map(str, seed))
        place.write_text(f"{world} {drawn}")
        return pj.drive.Outcome(False, told={"file": place.name, "said": f"{world} {drawn}"})

    for n in (3, 101):
        done = asked(drive, n)
        for one in done.driven:
            assert (tmp_path / one.told["file"]).read_text() == one.told["said"]
        (other,) = {x.name for x in tmp_path.iterdir()} - {one.told["file"] for one in done.driven}
        words = key_data(stream(KEY, Stage.EPISODE))
        assert other not in {"_".join(map(str, task_of(words, i).of_drive)) for i in range(2000)}


def harder(seed):
    return 0.5 + law(seed) / 2


def test_the_sentence_names_law_driver_and_loops_by_content():
    """All that was counted, so that another robot, law or driver has another sentence."""
    done = asked(Looped(), 8)
    said, claim = done.details(), loop_of(0.01).model.claim.hash[:12]
    idle = sum(not one.loops for one in done.driven)
    short = in_short(loop_of(0.01).model.claim)  # another kind, eps or count is another sentence
    assert f"(C) Of the manoeuvres of a loop (toy, claim {claim}: {short}, a body of" in said
    assert "What moves is told of for its intervals alone, until that rest at most" in said
    assert 0 < idle < 8 and f"Of {idle} episodes without one nothing is shown" in said
    both = [
        pj.drive.drive_episodes(drive, of, KEY, 8, workers=0, quiet=True).details()
        for drive, of in ((Looped(width=0.02), law), (Looped(left=3.0), law), (Looped(), harder))
    ]
    assert len({said, *both}) == 4
    wider, *_ = both
    assert claim not in wider and loop_of(0.02).model.claim.hash[:12] in wider
    same = pj.drive.drive_episodes(Looped(), law, KEY, 8, workers=0, quiet=True)
    assert same.details() == said


def test_where_nobody_looked_at_tubes_nothing_is_said_of_them():
    done = asked(lambda world, seed: pj.drive.Outcome(world > 0.9), 20)
    assert done.left is None
    assert "leaves" not in done.details() and "law touches anything with" in done.details()


def test_a_claim_is_wrong_as_rarely_as_it_says():
    """A true rate of 0.1 is above the bound in at most delta of all claims."""
    wrong = 0
    for i in range(80):
        done = pj.drive.drive_episodes(
            Toy(left=0.9), law, jax.random.PRNGKey(i), 40, workers=0, delta=0.1, quiet=True
        )
        wrong += done.eps < Fraction(1, 10)
    assert wrong <= 80 * 0.1 + 3 * np.sqrt(80 * 0.1 * 0.9)
    assert wrong > 0  # the bound is no wider than it has to be


class Logged:
    """Worlds of a list, one after another, so that each worker begins with the first. draw: those
    of a generator that goes on.
    """

    def __init__(self, draw=False):
        self.at, self.draw = -1, np.random.default_rng(0) if draw else None

    def __call__(self, seed):
        if self.draw is not None:
            return float(self.draw.uniform())
        self.at += 1
        return [0.1, 0.2, 0.3, 0.4, 0.5, 0.6][self.at]


def one_world_of_each_process(seed, told=[]):  # noqa: B006
    told.append(float(np.random.default_rng(seed).uniform()))
    return told[0]


@pytest.mark.parametrize(
    ("told_of", "words"),
    [
        (Logged(), "got another world of the same seed"),
        (Logged(draw=True), "got another world of the same seed"),
        (one_world_of_each_process, "got that a call of it changes it"),
    ],
)
def test_worlds_that_are_not_of_their_seeds_alone_are_no_independent_episodes(told_of, words):
    with pytest.raises(InputError, match=words):
        pj.drive.drive_episodes(Toy(), told_of, KEY, 6, workers=0, quiet=True)


class Adapting:
    """Brakes by how a gap compares with all gaps so far, as a normaliser in training mode has it;
    tells of it where `tells`.
    """

    def __init__(self, tells=False, worst=1.0):
        self.seen, self.tells, self.worst = [], tells, worst

    def __call__(self, world, seed):
        self.seen.append(world)
        far = float(abs(np.mean(self.seen) - world))
        return pj.drive.Outcome(far > self.worst, None, {"far": far} if self.tells else {})


def test_the_first_episode_may_end_after_those_that_are_driven_again():
    """Of two workers one is quicker: a KeyError, or all others were driven in vain."""
    again = workers_of.Driven(~0, True, None, "", {}, [])
    by_another_seed = again._replace(number=~3)
    assert told_again({}, [by_another_seed], 3)
    with pytest.raises(InputError, match=r"number 0, driven again, came out oth"):
        told_again({0: again._replace(number=0, touched=False)}, [again, by_another_seed], 3)


@pytest.mark.parametrize("workers", [0, 1])
def test_a_driver_that_goes_on_learning_is_no_driver_of_independent_episodes(workers):
    """Of 80 episodes 0, 33 or 58 were bad, by the number of processes. Of several the last may have
    begun when all others had been driven, and know none of them.
    """
    with pytest.raises(InputError, match=r"number 0, driven again, came out oth"):
        asked(Adapting(worst=1e-3), 30, workers=workers)
    said = asked(Adapting(True), 30, workers=workers).details()
    assert "(episodes: 1 driven again, the same but for far; the first, by another" in said
    alone = asked(Toy(), 30, workers=workers).details()
    assert "stay so (episodes: 1 driven again, the same; the first, by another seed, other" in alone


class Unseeded:
    """An environment that is reset without a seed: the first differs from itself at once."""

    def __init__(self):
        self.driven = 0

    def __call__(self, world, seed):
        self.driven += 1
        return pj.drive.Outcome(self.driven == 2)


def test_a_drive_that_does_not_draw_from_its_seed_ends_early_and_is_told_why():
    """It ended with the last of 300, and nothing was said of draws."""
    drive = Unseeded()
    with pytest.raises(InputError, match=r"number 0, .* not come from its seed, as by a re"):
        asked(drive, 300)
    assert drive.driven == 2


@pytest.mark.parametrize("of", ["begin", "k", "pose", "clearance", "far", "span", "goal"])
@pytest.mark.parametrize("seeded", [True, False])
def test_how_manoeuvres_began_is_of_what_another_drive_may_tell_otherwise(of, seeded, tmp_path):
    """Of drives that differed in k, poses, or in what was far away or asked for, alone no
    randomness was seen.
    """
    loop = loop_of(0.01)

    def drive(world, seed):
        draw = np.random.default_rng(seed if seeded else None).uniform()
        loop.restart()
        pose, at = [draw * (of == "pose"), 0.0], draw * (of == "begin")
        right = 22.0 + draw * (of == "far")
        far = pj.box([20.0 + draw * (of == "clearance"), 20.0], [right, 22.0])
        goal = pj.box([-9.0] * 3, [9.0 + draw, 9.0, 9.0]) if of == "goal" else None
        until = [int(2**i * draw) % 2 if of == "span" else 3 for i in range(40)]
        spans = [Span((0, last), at=at) for last in until]
        told = {"at": at, "spans": spans, "goal": goal}
        given = [0.1 + 0.1 * draw * (of == "k")]
        step = loop.step(pose, given, [far] * 40, lambda seen: -seen.path[:, -1, 0], **told)
        return pj.drive.Outcome(False, False, {}, [step.committed])

    options = {"folder": tmp_path, "looks": (2, 3)}
    done = asked(drive, 2, **options)
    same = "1 driven again, the same; the first, by another seed, otherwise"
    other = "1 driven again, the same but for manoeuvres; the first, by another seed, the same but"
    assert done.again.startswith(same if seeded else other)
    assert asked(drive, 3, **options).driven[:2] == done.driven
    about = json.loads((tmp_path / ABOUT).read_text())
    (tmp_path / ABOUT).write_text(json.dumps(about | {"format": "parc_jax.episodes/8"}))
    with pytest.raises(InputError, match="holds other work; expected the same format"):
        asked(drive, 3, **options)


class FromFile:
    """Its policy is a number in a file, read where it drives."""

    def __init__(self, path):
        self.path = str(path)

    def __call__(self, world, seed):
        return pj.drive.Outcome(world > float(Path(self.path).read_text()))


def test_a_campaign_does_not_go_on_with_another_policy_in_the_same_file(tmp_path):
    """Of 800 episodes 795 were of the policy before, and all were told of the one after."""
    (policy := tmp_path / "policy.txt").write_text("2.0")
    drive, folder = FromFile(policy), {"folder": tmp_path / "drives", "looks": (300, 302)}
    asked(drive, 300, **folder)
    assert "(episodes: 4 driven again, the same;" in asked(drive, 300, **folder).details()
    policy.write_text("0.1")
    for n in (300, 302):
        with pytest.raises(InputError, match=r"number \d, driven again, .* a file that it reads"):
            asked(drive, n, **folder)
    assert len(lines(tmp_path / "drives")) == 300


def test_a_drive_that_its_seed_does_not_touch_is_told():
    """`env.reset(seed=0)`: one gust, 300 times, was told as 300 fresh episodes."""
    once = asked(lambda world, seed: Toy()(world, np.zeros(2, np.uint32)), 8).details()
    assert "by another seed, the same: of its drive no randomness was seen)" in once
    assert "no randomness" not in asked(Toy(), 8).details()
    drawn = np.random.default_rng(0)  # of no seed of an episode

    def counting(world, seed):
        one = Toy()(world, np.zeros(2, np.uint32))
        return one._replace(told={"x": drawn.uniform()})

    said = asked(counting, 8).details()
    assert "by another seed, the same but for x: of its drive no other randomness was seen)" in said


def test_looks_share_delta_and_others_are_refused():
    first, last = (asked(Toy(left=0.5), n, looks=(10, 40)) for n in (10, 40))
    assert first.look[:2] == (1, 2) and last.look[:2] == (2, 2)
    assert first.look.delta == last.look.delta == Fraction(1, 2000)
    assert "look 2 of 2" in last.details()
    for looks in ((10, 40), (30, 30)):
        with pytest.raises(InputError, match="looks: expected the numbers of episodes, each once"):
            asked(Toy(), 30, looks=looks)


def test_seeds_meet_nobody_elses():
    words = key_data(stream(KEY, Stage.EPISODE))
    tasks = [task_of(words, i) for i in range(1000)]
    seeds = {tuple(seed.tolist()) for task in tasks for seed in task[1:]}
    assert len(seeds) == 2000
    others = {tuple(key_data(stream(KEY, stage)).tolist()) for stage in Stage}
    assert len(others) == len(Stage) and not others & seeds
    as_key(tasks[0].of_world)


def lines(folder):
    return [json.loads(line) for line in (folder / LINES).read_text().splitlines()]


@dataclass(frozen=True)
class Stopped:
    """Ctrl-C, once, in the episode after so many lines of a folder."""

    folder: Path
    at: int

    def __call__(self, world, seed):
        stopped = self.folder / "stopped"
        if len(lines(self.folder)) == self.at and not stopped.exists():
            stopped.touch()
            raise KeyboardInterrupt
        return Toy(left=0.8)(world, seed)


def test_a_stopped_run_goes_on_and_counts_every_episode_once(tmp_path):
    drive = Stopped(tmp_path, 12)
    with pytest.raises(KeyboardInterrupt):
        asked(drive, 30, folder=tmp_path)
    assert [one["number"] for one in lines(tmp_path)] == list(range(12))
    with (tmp_path / LINES).open("a") as file:
        file.write('{"number": 12, "touched": false, "le')  # killed while it wrote
    done = asked(drive, 30, folder=tmp_path)
    assert [one["number"] for one in lines(tmp_path)] == list(range(30))
    alone, kept = asked(Toy(left=0.8), 30), asked(Toy(left=0.8), 30, folder=tmp_path / "kept")
    assert alone.details().endswith("had nothing to do with how episodes went.")  # not measured
    assert "episodes went: 0 had begun by then, and were driven again." in kept.details()
    assert done.driven[12].before == 1  # whoever chose the moment may have seen it fail
    assert "episodes went: 1 had begun by then, and were driven again." in done.details()
    assert [one._replace(before=0) for one in done.driven] == [*kept.driven]
    assert [one._replace(before=None) for one in done.driven] == [*alone.driven]
    assert {path.name for path in tmp_path.iterdir()} == {LINES, ABOUT, "stopped", "kept"}
    os.truncate(tmp_path / LINES, 0)
    assert asked(drive, 30, folder=tmp_path).driven == kept.driven


@dataclass(frozen=True)
class Clearing:
    """Clears away what it does not know in the folder of its episodes."""

    folder: Path

    def __call__(self, world, seed):
        for path in self.folder.glob("begun_*"):
            path.unlink()
        return Toy(left=0.8)(world, seed)


def test_a_result_whose_begin_was_cleared_away_is_kept(tmp_path):
    done = asked(Clearing(tmp_path), 5, folder=tmp_path)
    assert len(lines(tmp_path)) == 5 and [one.left for one in done.driven] == [
        one.left for one in asked(Toy(left=0.8), 5).driven
    ]
    assert "episodes went: 0 had begun by then" in done.details()


def test_a_loop_that_has_driven_since_is_the_same_driver(tmp_path):
    """At the second of two looks, in the process of the first one."""
    loop = pj.drive.Loop(
        line_model(4, 0.01, rests=True), 0.05, leave=0.5, given=(1,), effort=PATIENT
    )

    def drive(world, seed):
        loop.restart()
        step = loop.step([0.0, 0.0], [0.0], [], lambda seen: -seen.k[:, 0], 0.0)
        return pj.drive.Outcome(False, False, {"world": world}, [step.committed])

    first = asked(drive, 3, folder=tmp_path, looks=(3, 6))
    assert asked(drive, 6, folder=tmp_path, looks=(3, 6)).driven[:3] == first.driven
    loop.effort = pj.drive.Effort(room=0.1)
    with pytest.raises(InputError, match=r"the same drive\. Go on with what began it, or"):
        asked(drive, 6, folder=tmp_path, looks=(3, 6))


def test_a_folder_of_other_episodes_is_refused(tmp_path):
    asked(Toy(), 6, folder=tmp_path)
    for drive, options, words in (
        (Toy(left=0.5), {}, "the same drive"),
        (Toy(), {"delta": 0.1}, "the same delta"),
        (Toy(), {"looks": (6, 7)}, "the same looks"),
    ):
        with pytest.raises(InputError, match=words):
            asked(drive, 6, folder=tmp_path, **options)
    with pytest.raises(InputError, match="the same seed"):
        pj.drive.drive_episodes(Toy(), law, jax.random.PRNGKey(5), 6, folder=tmp_path, workers=0)


class Gait(enum.Enum):
    SLOW, FAST = 1, 2


@dataclass(frozen=True)
class Driven(Toy):
    speed: object = None


def ring(inner: float):
    """A floor with a hole in it."""
    corners = [(i * 0.123456789, 0.0) for i in range(9)]
    hole = [(0.1, 0.1), (0.1, inner), (inner, inner)]
    return pytest.importorskip("shapely").Polygon([*corners, (1, 1), (0, 1)], [hole])


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Fraction(1, 2), Fraction(2)),
        (Decimal("0.5"), Decimal(2)),
        (Path("slow.txt"), Path("fast.txt")),
        (Gait.SLOW, Gait.FAST),
        (timedelta(1), timedelta(2)),
        (np.sin, np.cos),
        (ring(0.5), ring(0.9)),  # whose texts are cut before they differ
    ],
)
def test_a_drive_of_another_value_of_any_library_is_another(tmp_path, one, other):
    asked(Driven(speed=one), 6, folder=tmp_path)
    assert asked(Driven(speed=copy.deepcopy(one)), 6, folder=tmp_path).n == 6
    with pytest.raises(InputError, match="the same drive"):
        asked(Driven(speed=other), 6, folder=tmp_path)


class Hidden(Toy):
    """Holds what decides where a digest might not look."""

    def __init__(self, held):
        object.__setattr__(self, "_held", held)


def long(last: float) -> list:
    """More parts than are read of a system."""
    return [[float(i)] for i in range(20_001)] + [[last]]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (lambda: 0.1, lambda: 0.2),
        (lambda: np.ones(3), lambda: np.zeros(3)),
        (lambda: {"workers": {"_speed": 1.0}}, lambda: {"workers": {"_speed": 2.0}}),
        (lambda: Hidden(1.0), lambda: Hidden(2.0)),
        (lambda: SimpleNamespace(workers=1), lambda: SimpleNamespace(workers=2)),
        (lambda: np.random.default_rng(1), lambda: np.random.default_rng(2)),
        (lambda: long(1.0), lambda: long(2.0)),
    ],
    ids=["number", "array", "mapping", "nested", "workers", "generator", "long"],
)
def test_a_drive_of_other_private_content_is_another(tmp_path, one, other):
    asked(Hidden(one()), 6, folder=tmp_path)
    assert asked(Hidden(one()), 6, folder=tmp_path).n == 6
    with pytest.raises(InputError, match="the same drive"):
        asked(Hidden(other()), 6, folder=tmp_path)


def test_what_is_made_of_the_rest_when_it_is_asked_for_is_no_content(tmp_path):
    model = line_model(4, 0.01)
    asked(Hidden(model), 6, folder=tmp_path)
    _ = once(model, lambda model: object())
    assert asked(Hidden(model), 6, folder=tmp_path).n == 6


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        (
            lambda text: text + text.splitlines()[2] + "\n",
            "line 7: .* number 2 is of another one, stands there twice",
        ),
        (
            lambda text: text.replace('"number": 3', '"no": 3'),
            "line 4: expected an episode as it was written",
        ),
        (lambda text: text + "[1]\n", "line 7: expected an episode as it was written"),
        (lambda text: text.replace(', "hash"', ', "bash"', 1), "line 1.* number 0 is of another"),
        (
            lambda text: text.replace('"touched": true', '"touched": false'),
            "line 1: expected an episode of this folder, .*; number 0 .* changed. Begin anew",
        ),
        (lambda text: "\n" + text, "line 1: expected an episode as it was"),
        (lambda text: text.replace('"number": 3', '"number": 9'), "line 4: .* number 9 is of ano"),
    ],
)
def test_lines_that_were_changed_are_refused(tmp_path, spoilt, words):
    drive = Toy(touched=0.0)
    asked(drive, 6, folder=tmp_path)
    path = tmp_path / LINES
    path.write_text(spoilt(path.read_text()))
    with pytest.raises(InputError, match=words):
        asked(drive, 6, folder=tmp_path)


def test_episodes_of_another_folder_are_none_of_this_one(tmp_path):
    """390 of easy worlds were counted beside ten of the law."""
    one, other = tmp_path / "one", tmp_path / "other"
    asked(Toy(touched=0.5), 4, folder=one, looks=(4, 9))
    asked(Toy(), 9, folder=other)
    with (one / LINES).open("a") as file:
        file.writelines(line + "\n" for line in (other / LINES).read_text().splitlines()[4:])
    with pytest.raises(InputError, match=r"line 5: .* number 4 is of another one, stands"):
        asked(Toy(touched=0.5), 9, folder=one, looks=(4, 9))


def test_two_runs_never_write_one_folder(tmp_path):
    def drive(world, seed):
        with pytest.raises(InputError, match="another run does"):
            asked(drive, 1, folder=tmp_path)
        return pj.drive.Outcome(False)

    assert asked(drive, 1, folder=tmp_path).bad == 0


def test_workers_drive_the_same_episodes_and_one_that_ends_its_process_counts(tmp_path):
    drive = Toy(left=0.8, dies=0.9)
    done = asked(drive, 24, workers=2, folder=tmp_path)
    died = [one for one in done.driven if one.failed]
    assert died and all("its worker process died" in one.failed for one in died)
    alone = asked(Toy(left=0.8), 24, folder=tmp_path / "alone").driven
    assert all(one == alone[one.number] for one in done.driven if not one.failed)
    assert {one.number for one in died} == {o.number for o in alone if o.told["world"] > 0.9}
    assert sorted(one["number"] for one in lines(tmp_path)) == list(range(24))
    assert (tmp_path / ABOUT).exists()


@pytest.mark.parametrize(
    ("drive", "n", "options", "words"),
    [
        (no_outcome, 3, {}, "all 3 so far failed, the last .*expected an Outcome of .*; got bool"),
        (Toy(breaks=-1.0), 9, {}, "all 4 so far failed, the last in .*the wheels came off"),
        (Toy(), 0, {}, "episodes: expected a whole number >= 1"),
        (Toy(), 3, {"workers": -1}, "workers: expected"),
        (Toy(), 3, {"looks": (3, -5)}, "looks: expected a whole number >= 1"),
        (Toy(), 3, {"looks": ("a", 3)}, "looks: expected a whole number >= 1"),
        (Toy(), 3, {"folder": __file__}, "expected a folder for episodes; got FileExists"),
        (Toy(), 3, {"delta": 1.5}, "delta: expected a probability"),
        ("drive", 3, {}, "drive: expected Callable; got 'drive'"),
        (lambda world, seed: None, 3, {"workers": 1}, "top level of a module, or pass workers=0"),
        (lambda world, seed: pj.drive.Outcome(0.5), 1, {}, "touched True or False"),
        (
            lambda world, seed: pj.drive.Outcome(False, told={"a": {1}}),
            1,
            {},
            "plain values; got set",
        ),
    ],
)
def test_what_makes_no_sense_is_told(drive, n, options, words):
    with pytest.raises(InputError, match=words):
        asked(drive, n, **options)


def test_a_pose_outside_of_the_tube_is_said_whatever_else_is_wrong():
    """Wrong measurements, obstacles and reasons of the caller come with a pose, too."""
    loop = loop_of(0.01)
    goes = lambda seen: -seen.path[:, -1, 0]  # noqa: E731
    for given, obstacles in (([9.0], []), ([np.nan], []), ([0.1], ["no obstacle"])):
        loop.restart()
        first = loop.step([0.0, 0.0], [0.1], [], goes).committed
        step = loop.step([0.0, 40.0], given, obstacles, goes)
        assert step.left and step.committed is first and len(first.seen_outside) == 1
        assert "m beyond what tube, uncertainty and drift allow" in step.reason
    loop.restart()
    first = loop.step([0.0, 0.0], [0.1], [], goes).committed
    half = float(loop.leave_after) / 2  # nothing may begin then
    assert not loop.go_on("no scan", None, [0.0, 0.0], half, 0.5).left
    assert not loop.go_on("no scan", None, [np.nan, 0.0], half).left
    assert not loop.go_on("no scan").left and not first.seen_outside
    step = loop.go_on("no scan", None, [0.0, 40.0], half)
    assert step.left and step.reason.endswith("; no scan") and len(first.seen_outside) == 1
