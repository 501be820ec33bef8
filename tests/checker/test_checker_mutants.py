"""Random mutants of valid certificates: none is accepted unless what it claims is still true, by
the dense oracle. Many more by one command: python -m benchmarks.attacks mutants.
"""

import collections

import answer_files as build
import mutants
import pytest

from parc_jax import checker


@pytest.mark.slow
@pytest.mark.soundness
@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(3, 10), marks=pytest.mark.night)])
def test_of_two_thousand_mutants_none_is_wrongly_accepted(seeds):
    tally = sum((mutants.check_mutants(seed, 200) for seed in seeds), collections.Counter())
    assert not [kind for kind, verdict in tally if verdict == "false"]
    rejected = {kind for kind, verdict in tally if verdict == "rejected"}
    assert len(rejected) >= len(mutants.KINDS) - 2, f"never: {set(mutants.KINDS) - rejected}"
    # some mutants must still be true, or the test is blind
    assert sum(tally[kind, "accepted"] for kind in mutants.KINDS) > 50


def test_the_judge_sees_members_of_corridors(monkeypatch):
    """And is not fooled by a checker for which every condition holds."""
    answers = [build.only(build.scene(seed), "corridors") for seed in range(5)]
    assert sum(map(mutants.judge, answers)) > 20
    monkeypatch.setattr(checker.plans, "holds", lambda *_: True)
    with pytest.raises(AssertionError):
        for answer in answers:
            mutants.judge(answer)


@pytest.mark.slow
@pytest.mark.soundness
def test_mutants_of_no_plan_none_wrongly_accepted():
    tally = sum((mutants.check_plan_mutants(seed, 100) for seed in range(3)), collections.Counter())
    assert not [kind for kind, verdict in tally if verdict == "false"]
    kinds = {f"no_plan: {kind}" for kind in mutants.PLAN_KINDS}
    assert {kind for kind, verdict in tally if verdict == "rejected"} == kinds
