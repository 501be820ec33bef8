"""The exact proof of every commitment, beside the loop: what it accepts, what it rejects, and what
the loop does then.
"""

from dataclasses import replace

import numpy as np
import pytest
from toy_models import line_model

import parc_jax as pj
from parc_jax.checker import Context, episode
from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.drive.loop.prover import Packer, Proving, Unpacker

PATIENT = pj.drive.Effort(candidates=64, deadline=300.0)
BLOCK = pj.box([30.0, 30.0], [31.0, 31.0])


class Trouble:
    """A prover that is in trouble."""

    def __init__(self, words):
        self.words, self.added = words, []

    def trouble(self):
        return self.words

    def add(self, one):
        self.added.append(one)

    def rehearse(self, one):
        self.rehearsed = one


LINE = line_model(4, 0.01, rests=True)


def loop_of(prover=None, uncertainty=None):
    options = {
        "leave": 0.5,
        "given": (1,),
        "effort": PATIENT,
        "prover": prover,
        "uncertainty": uncertainty,
    }
    return pj.drive.Loop(LINE, 0.1, **options)


def drive(loop, n: int, aside: float = 0.0):
    """Commitments of a robot that is exactly where its network says, but for the last one."""
    place, done = np.zeros(2), []
    for i in range(n):
        off = [aside if i == n - 1 else 0.0, 0.0]
        step = loop.step(
            place + off, [0.1], [BLOCK], lambda seen: -seen.path[:, -1, 0], drift=aside
        )
        assert step.new, step.reason
        done.append(step.committed)
        place = place + step.committed.k / 2
    return done


def unsafe(one):
    """The same commitment, with something where it begins."""
    problem = one.asked.problem.replace(obstacles=(from_box(pj.box([-0.05] * 2, [0.05] * 2)),))
    return replace(one, asked=replace(one.asked, problem=problem))


def test_every_commitment_is_proved_and_follows_the_one_before():
    loop = loop_of()
    proving = Proving()
    proofs = [proving.proof(one) for one in drive(loop, 3)]
    assert [proof[:4] for proof in proofs] == [(i, True, True, "") for i in range(3)]


def test_a_model_is_read_once_for_all_episodes_of_a_loop(monkeypatch):
    read = []
    monkeypatch.setattr(episode, "Context", lambda *parts: read.append(1) or Context(*parts))
    loop, proving = loop_of(), Proving()
    for _ in range(2):  # elsewhere: another episode
        assert [proving.proof(one)[1:3] for one in drive(loop, 2)] == 2 * [(True, True)]
        loop.restart()
    assert len(read) == 1
    doubtful = loop_of(uncertainty=pj.Uncertainty(start=0.01))
    assert proving.proof(drive(doubtful, 1)[0]).proved and len(read) == 2


def test_what_is_unsafe_is_rejected_and_what_jumps_is_told():
    proving = Proving()
    first, jumped = drive(loop_of(), 2, aside=0.2)
    assert not proving.proof(unsafe(first)).proved
    assert "fails" in proving.proof(unsafe(first)).why
    broken = replace(first, k=np.array([np.nan, 0.1]))
    assert not Proving().proof(broken).proved
    proving = Proving()
    assert proving.proof(first).follows
    assert proving.proof(jumped)[1:3] == (True, False)


def test_a_commitment_travels_with_its_model_once():
    packer, unpacker = Packer(), Unpacker()
    packed = [packer.pack(one) for one in drive(loop_of(), 3)]
    assert packed[0].model is not None and packed[1].model is packed[2].model is None
    there = [unpacker.unpack(one) for one in packed]
    assert there[0].asked.model is there[2].asked.model
    assert [one.part for one in there] == [one.part for one in drive(loop_of(), 3)]


def test_a_loop_whose_prover_is_in_trouble_goes_on_with_the_stop_in_hand():
    prover = Trouble("")
    loop = loop_of(prover)
    (first,) = drive(loop, 1)
    assert prover.added == [first] and prover.rehearsed is not None
    prover.words = "the exact checker rejects commitment 0"
    step = loop.step([0.0, 0.0], [0.1], [BLOCK], lambda seen: -seen.path[:, -1, 0])
    assert not step.new and step.committed is first and step.reason == prover.words
    assert prover.added == [first]


@pytest.mark.slow  # a second process, which starts JAX
def test_a_second_process_proves_while_the_loop_goes_on():
    with pytest.raises(SoundnessError, match="the exact checker rejects commitment 4"):
        with pj.drive.Prover() as prover:
            loop = loop_of(prover)
            done = drive(loop, 5)
            proofs = prover.finish()
            assert [proof.number for proof in proofs] == [0, 1, 2, 3, 4] and prover.behind == 0
            assert all(proof.proved and proof.follows and proof.seconds > 0 for proof in proofs)
            prover.add(unsafe(done[-1]))
            with pytest.raises(SoundnessError):
                prover.finish()
            step = loop.step([0.0, 0.0], [0.1], [BLOCK], lambda seen: -seen.path[:, -1, 0])
            assert not step.new and step.committed is done[-1] and "rejects" in step.reason


@pytest.mark.slow
def test_a_prover_that_ended_stops_the_loop_and_is_told_at_the_end():
    with pytest.raises(SoundnessError, match="process ended with exit code -9"):
        with pj.drive.Prover(most=1) as prover:
            loop = loop_of(prover)
            prover._process.kill()
            prover._process.join()
            drive(loop, 1)
            step = loop.step([0.0, 0.0], [0.1], [BLOCK], lambda seen: -seen.path[:, -1, 0])
            assert not step.new and "exit code -9" in step.reason


def test_a_prover_that_nobody_may_wait_for_is_refused():
    with pytest.raises(InputError, match="1 or more that may wait; got 0"):
        pj.drive.Prover(most=0)
