"""Corridors: whoever meets the conditions of a corridor's directions is safe, in whatever region
and bin [T14, T27].

The conditions are computed a second time, in plain fractions, and the dense oracle has the last
word.
"""

import json
import random
from fractions import Fraction as F

import answer_files as build
import known
import oracle
import pytest

from parc_jax import checker

VARIANTS = [
    dict(),
    dict(body=build.TRIANGLE),
    dict(starts=False, n_q=0, bins=(3, 2)),
    dict(n_k=1, bins=(3,), T=9),
    dict(n_k=3, bins=(1, 2, 1), hidden=(5,)),
]


def accepted(check, *entry):
    try:
        check(*entry)
    except checker.Rejected:
        return False
    return True


def plans(answer, corridor, rng, count):
    """Random (p0, k): near the corridor's plan, far from it, with an end near its end, on edges,
    outside the domain.
    """
    problem, network = answer["problem"], answer["network"]
    centre, k0 = build.value(corridor["p0"]), build.value(corridor["k"])
    end = build.path(problem, network, centre, k0)[0][-1]
    for i in range(count):
        size = F(1, 8) if i % 2 else F(1)
        k = [max(min(v + build.dyadic(rng, size, 40), F(1)), F(-1)) for v in k0]
        if i % 5 == 0:
            axis = rng.randrange(len(k))
            k[axis] = rng.choice(build.value(answer["tube"]["edges"][axis]))
        if i % 50 == 1:
            k[0] += rng.choice((-2, 2))
        p0 = [v + build.dyadic(rng, F(1) if i % 7 == 0 else F(1, 8), 40) for v in centre]
        if i % 3 == 0:
            p0 = [
                v + z - e
                for v, z, e in zip(
                    p0, end, build.path(problem, network, centre, k)[0][-1], strict=True
                )
            ]
        yield p0, k


def look(answer, count, seed=0):
    """Draws plans around each corridor. Returns (faults, cells): what is wrong, and (bins, pattern)
    of all members.
    """
    parts, rng, faults, cells = (
        [answer[part] for part in checker.PARTS],
        random.Random(seed),
        set(),
        set(),
    )
    context, judge = checker.Context(*parts), oracle.Oracle(answer)
    for corridor in answer["corridors"]:
        for p0, k in plans(answer, corridor, rng, count):
            plan = {"p0": build.text(p0), "k": build.text(k), "sep": corridor["sep"]}
            member = accepted(context.check_sample, plan)
            if member is not build.keeps(*parts, corridor["sep"], p0, k):
                faults.add("another verdict")
            if member:
                bins, piece = tuple(build.bins_of(parts[2], k)), build.piece(*parts[1:], plan)
                cells.add((bins, piece["pattern"]))
                if not judge.safe(p0, k):
                    faults.add("not safe")
                if (
                    len(bins) == 1
                    and max(map(abs, k)) < 1
                    and not accepted(context.check_set, piece)
                ):
                    faults.add("no polytope")
    return faults, cells


@pytest.mark.slow
@pytest.mark.soundness
@pytest.mark.parametrize("variant", range(len(VARIANTS)))
def test_members_of_corridors_are_safe_in_every_region_and_bin(variant):
    """The checker's verdict is that of the fractions; members are safe, each in the polytope of its
    region and bin.
    """
    seen, alone = set(), set()
    for seed in range(2):
        faults, cells = look(build.scene(200 + seed, **VARIANTS[variant]), 120)
        assert not faults
        seen |= {pattern for _, pattern in cells}
        alone |= {bins for bins, _ in cells if len(bins) == 1}
    assert len(seen) > 2
    assert len(alone) > 1


@pytest.mark.night
@pytest.mark.soundness
def test_twenty_thousand_plans_about_corridors():
    for seed in range(40):
        faults, _ = look(build.scene(seed, **VARIANTS[seed % len(VARIANTS)]), 250, seed)
        assert not faults


def reason(answer):
    """Why the checker rejects an answer, or None."""
    try:
        checker.check_answer(answer)
    except checker.Rejected as why:
        return str(why)
    return None


def test_corridors_are_optional():
    """A file without this key claims none; null is no list."""
    without = known.plain()
    assert "corridors" not in without
    report = checker.check_answer(without)
    assert report.corridors == 0
    assert checker.check_answer(without | {"corridors": []}) == report
    some = without | {"corridors": without["samples"]}
    assert checker.check_answer(some) == report._replace(corridors=1)
    assert reason(without | {"corridors": None}) == "a list was expected"


def test_a_rejection_says_which_corridor():
    answer = known.corridor()
    bad = answer["corridors"][0] | {"p0": ["0", "-0.25"]}
    answer["corridors"] = [answer["corridors"][0], bad]
    assert reason(answer) == "corridors[1]: the condition of obstacle 0 at knot 0, point 0 fails"


@pytest.mark.soundness
def test_whatever_is_wrong_with_a_sample_is_wrong_with_a_corridor():
    """Every certificate that is rejected for its sample is so, for the same reason, with the sample
    as a corridor.
    """
    count = 0
    for make, limits in known.CASES.values():
        try:
            answer = json.loads(make())
        except ValueError:
            continue
        why = None if limits else reason(answer)
        if why is not None and why.startswith("samples[0]"):
            count += 1
            assert reason(build.only(answer, "corridors", *answer["samples"])) == why.replace(
                "samples", "corridors"
            )
    assert count > 30


@pytest.mark.parametrize("seed", range(3))
def test_the_directions_of_one_corridor_do_not_prove_another_place(seed):
    """Directions that turn round, change obstacles or lose one of them admit nothing."""
    answer = build.scene(seed)
    part = answer["corridors"][0]
    turned = [
        [[[stop, [[i, f"-{m}"] for i, m in terms]] for stop, terms in runs]]
        for (runs,) in part["sep"]
    ]
    for sep in (turned, part["sep"][:1], part["sep"] * 2, [[[]], [[]]], [[[[6, []]]]] * 2):
        assert reason(build.only(answer, "corridors", part | {"sep": sep})).startswith(
            "corridors[0]: "
        )
    assert reason(build.only(answer, "corridors", part)) is None
