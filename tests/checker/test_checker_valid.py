"""What is accepted is true: valid certificates pass, and a dense oracle and random members of the
sets agree.
"""

import json
import random
from fractions import Fraction as F
from pathlib import Path

import answer_files as build
import known
import known_points
import oracle
import pytest
from effort import calls_of
from rows_of_sets import set_rows

from parc_jax import checker
from parc_jax.checker.answer import percent

VARIANTS = [
    dict(),
    dict(body=build.TRIANGLE),
    dict(starts=False, n_q=0),
    dict(hidden=(), n_q=2),
    dict(n_k=1, bins=(3,), T=9),
    dict(n_k=3, bins=(1, 2, 1), hidden=(5,)),
    dict(bits=52, T=12),
]


@pytest.fixture(scope="module", params=range(len(VARIANTS)))
def answer(request):
    return build.scene(100 + request.param, **VARIANTS[request.param])


def test_valid_certificates_are_accepted(answer):
    report = checker.check_answer(answer)
    counts = (report.samples, report.sets, report.corridors)
    assert counts == tuple(len(answer[part]) for part in ("samples", "sets", "corridors"))
    assert report.claim["kind"] == "pac"
    assert report.hash == answer["hash"]


def test_the_oracle_agrees_with_samples(answer):
    judge = oracle.Oracle(answer)
    for sample in answer["samples"]:
        assert judge.safe(build.value(sample["p0"]), build.value(sample["k"]))


def members(rows, point, rng, count):
    """Random points of a polytope of checker rows: hit and run in fractions, from an inner
    point.
    """
    for _ in range(count):
        way = [build.dyadic(rng, 1, 6) for _ in point]
        lo, hi = F(-4), F(4)
        for _, _, a, c in rows:
            speed, room = build.dot(a, way), build.dot(a, point) + c
            if speed > 0:
                lo = max(lo, -room / speed)
            elif speed < 0:
                hi = min(hi, -room / speed)
        share = F(rng.randint(1, 4095), 4096)
        step = lo + share * (hi - lo)
        moved = [F(round((x + step * d) * 2**50), 2**50) for x, d in zip(point, way, strict=True)]
        if all(build.dot(a, moved) + c > 0 for _, _, a, c in rows if any(a)):
            point = moved
        yield point


def check_members(answer, count):
    """Random members of each set pass the sample check with the set's own directions, and the
    oracle.
    """
    context, judge, n = (
        checker.Context(*(answer[p] for p in ("problem", "network", "tube"))),
        oracle.Oracle(answer),
        0,
    )
    for piece in answer["sets"]:
        point = build.value(piece["p0"]) + build.value(piece["k"])
        rows = set_rows(context, piece)
        for x in members(rows, point, random.Random(7), count):
            p0, k = x[: answer["problem"]["n_p"]], x[answer["problem"]["n_p"] :]
            context.check_sample({"p0": build.text(p0), "k": build.text(k), "sep": piece["sep"]})
            assert n % 10 or judge.safe(p0, k)
            n += 1


def test_random_members_of_sets_are_safe(answer):
    check_members(answer, 20)


@pytest.mark.night
@pytest.mark.soundness
def test_ten_thousand_members_of_sets_are_safe():
    for seed in range(10):
        check_members(build.scene(seed, body=build.DISC if seed % 2 else build.TRIANGLE), 500)


def test_the_pattern_map_is_the_network_on_the_set(answer):
    """Rows of the set at a member equal the same conditions at the exactly evaluated network."""
    context, piece = (
        checker.Context(*(answer[p] for p in ("problem", "network", "tube"))),
        answer["sets"][0],
    )
    n, T = answer["problem"]["n_p"], answer["problem"]["steps"]
    rows = {name: (a, c) for name, _, a, c in set_rows(context, piece) if name.startswith("goal")}
    final = build.value(answer["tube"]["final"][piece["bin"]])
    for x in members(
        set_rows(context, piece),
        build.value(piece["p0"]) + build.value(piece["k"]),
        random.Random(3),
        5,
    ):
        knots, q = build.path(answer["problem"], answer["network"], x[:n], x[n:])
        goal = answer["problem"]["goal"]
        for i, (a, b) in enumerate(
            zip(build.value(goal["A"]), build.value(goal["b"]), strict=True)
        ):
            slack = b - build.dot(a, [*knots[T], *q]) - build.dot(map(abs, a), final)
            coefficients, constant = rows[f"goal row {i}"]
            scale = F(coefficients[0] or coefficients[1] or 1, -a[0] or -a[1] or 1)
            if any(a[:n]):
                assert build.dot(coefficients, x) + constant == scale * slack


def test_a_claim_is_optional_and_its_kind_is_reported():
    answer = build.scene(5)
    for kind, word in (
        ("pac", "ASSUMED: the claim's arithmetic was not checked"),
        ("assumed", "ASSUMED"),
        ("estimate", "ASSUMED"),
        (None, "ASSUMED"),
    ):
        answer["claim"] = None if kind is None else {"kind": kind, "statement": "s\x1b[2J"}
        text = "\n".join(checker.summary(checker.check_answer(build.rehash(answer))))
        assert word in text
        assert "\x1b" not in text


@pytest.mark.parametrize("part", ["interval", "final"])
@pytest.mark.parametrize("made", [known.plain, known_points.points])
def test_it_says_how_many_bins_have_no_claim(made, part):
    """By the tube alone: of a claim that is assumed or declared no premise says it."""
    answer = json.loads(json.dumps(made()))
    words = "bins of K have no claim"
    assert words not in "\n".join(checker.summary(checker.check_answer(answer)))
    answer |= {"samples": [], "sets": [], "corridors": [], "doubt": [], "no_plan": None}
    wide = answer["tube"][part][-1]
    wide = wide[-1][-1] if part == "interval" else wide
    (wide["b"] if isinstance(wide, dict) else wide)[0] = (1e100).hex()
    report = checker.check_answer(build.rehash(answer))
    told = f"1 of {report.bins} {words}: their tube is 10^100 or more wide"
    assert report.without_claim == 1 and told in checker.summary(report)


@pytest.mark.parametrize(
    ("places", "count"),
    [((), 0), (((0, 0),), 1), (((1, 1),), 1), (("end",), 1), (((0, 1), "end"), 1)],
)
def test_it_says_whether_the_tube_holds_the_model(places, count):
    """A template may leave out the prediction itself; then what is proved may be about nothing."""
    report = checker.check_answer(known_points.beside_the_model(*places))
    assert (report.without_model, report.bins) == (count, 2)
    words = "leaves out the model's own trajectory in 1 of 2 bins" if count else "in every bin"
    assert words in "\n".join(checker.summary(report))


def test_drift_sized_certificates_are_little_work():
    """One 4x8 network, 78 intervals, full 53-bit weights: a millisecond or two."""
    answer = build.scene(1, hidden=(8, 8, 8, 8), T=78, bits=52)
    context = checker.Context(*(answer[p] for p in ("problem", "network", "tube")))
    assert calls_of(lambda: context.check_sample(answer["samples"][0])) < 10_000
    assert calls_of(lambda: context.check_set(answer["sets"][0])) < 20_000


def test_the_checker_has_no_floats_and_short_files():
    files = {path: path.read_text() for path in Path(checker.__file__).parent.glob("*.py")}
    assert len(files) == 17
    wrong = [p for p, t in files.items() if "float(" in t or len(t.splitlines()) >= 450]
    assert not wrong, wrong


def test_shares_are_told_outward():
    """Of what is proved never more, of what is undecided never less."""
    for share in (F(1, 3), F(2, 3), F(1, 7**9), F(0), F(1)):
        down, up = (F(percent(share, up).removesuffix(" %")) for up in (False, True))
        assert down <= 100 * share <= up and up - down <= F(1, 1000)
