"""Margins that pay for the rounding of the header's code, asked in exact rationals; and that code
against the model of it that the theorem is about, on plans at the very border.
"""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import toy_query
from faces_of_errors import template_of
from header_model import exactly, is_safe, lost
from toy_bodies import random_faces
from toy_header import TUBES, border_pairs, toy_tables, write_toy

from benchmarks.compiled_header import Header
from parc_jax.common.errors import InputError
from parc_jax.drive.onboard.paid import require_paid
from parc_jax.drive.onboard.tables import in_numbers
from parc_jax.learning.bound.error_set import NO_CLAIM, ErrorBox

pytestmark = pytest.mark.soundness
needs_compiler = pytest.mark.needs("compiler")
CPU = Path("/proc/cpuinfo")
FUSED = ["-mfma", "-ffp-contract=fast"] if CPU.exists() and " fma " in CPU.read_text() else []


def toy(tube="boxes"):
    answer = toy_query.answer()
    return toy_tables(tube), answer.model, float(answer.scene.slack)


@pytest.mark.parametrize("tube", TUBES)
def test_the_slack_pays_with_reserve_and_nothing_does_not(tube):
    known, model, slack = toy(tube)
    require_paid(known, model, slack / 5)
    with pytest.raises(InputError, match="a row of the start"):
        require_paid(known, model, 0.0)


@pytest.mark.parametrize(
    ("part", "changed", "said"),
    [
        ("goal_A", lambda a: 1e-300 * a, "a row of the goal"),
        ("start_A", lambda a: 1e-300 * a, "a row of the start"),
        ("far", lambda far: 1e3 * far, "a row of the start"),
        ("far", lambda far: 0 * far + 1e308, "far out"),
        ("goal_b", lambda b: np.nan * b, "not finite"),
        ("runs", lambda runs: runs._replace(w=1e-300 * runs.w), "a direction of a corridor"),
        ("runs", lambda runs: runs._replace(support=1e3 + runs.support), "a direction of"),
        ("runs", lambda runs: runs._replace(support=1e308 + runs.support), "may overflow"),
        ("errors", lambda _: ErrorBox(np.full((1, 4, 1, 2), np.nan)), "not finite"),
    ],
)
def test_what_is_not_paid_for_is_refused(part, changed, said):
    known, model, slack = toy()
    broken = known._replace(**{part: changed(getattr(known, part))})
    with pytest.raises(InputError, match=f"margins that pay for all rounding.*{said}"):
        require_paid(broken, model, slack)


@pytest.mark.parametrize(
    ("part", "changed", "said"),
    [
        ("dual", lambda dual: 1e3 * dual, "a direction of"),
        ("dual", lambda dual: 0 * dual + 1e308, "may overflow"),
        ("dual", lambda dual: np.nan * dual, "not finite"),
        ("centre", lambda centre: 1e2 + centre, "a direction of"),
        ("half", lambda half: 1e2 + half, "a direction of"),
        ("half", lambda half: 1e308 + half, "may overflow"),
    ],
)
def test_faces_that_are_not_paid_for_are_refused(part, changed, said):
    known, model, slack = toy("faces")
    errors = known.errors.replace(**{part: changed(getattr(known.errors, part))})
    with pytest.raises(InputError, match=f"margins that pay for all rounding.*{said}"):
        require_paid(known._replace(errors=errors), model, slack)


def test_what_no_face_bounds_is_told_along_the_axes_where_nothing_cancels():
    """Sums of slanted faces as wide as no world would lose more than the world in rounding."""
    known, model, slack = toy("faces")
    errors = random_faces(
        np.random.default_rng(1), known.errors.half.shape[:3], 2, 0.01, False
    ).errors
    half = np.array(errors.half)
    half[:, 1] = np.inf
    told = in_numbers(errors.replace(half=half))
    require_paid(known._replace(errors=told), model, slack)
    assert (told.half[:, 1] == NO_CLAIM).all() and np.isfinite(told.half).all()
    slanted = told.replace(dual=errors.dual)
    with pytest.raises(InputError, match="a direction of a corridor"):
        require_paid(known._replace(errors=slanted), model, slack)


def test_the_tables_reach_as_far_as_the_faces_do():
    """Up to a quarter of the slack, in exact numbers, as the checker finds it; little farther."""
    rng = np.random.default_rng(2)
    slack = toy()[2]
    for n_p in (2, 3):
        faces = random_faces(rng, (3, 2, 1), n_p, 0.02, around_zero=False)
        errors = in_numbers(faces.errors)
        for index in np.ndindex(3, 2, 1):
            w = [Fraction(x) for x in rng.normal(size=n_p)]
            against = [-x for x in w]
            reach = template_of(faces.rows(index), n_p).support(against)
            spare = Fraction(slack) / 4 * sum(map(abs, w))
            more = lost(errors, index, w, Fraction) - reach
            assert -spare <= more <= spare + 16 * Fraction(2) ** -39 * sum(map(abs, w))


def test_a_network_that_may_overflow_is_refused():
    known, model, slack = toy()
    net = model.net.replace(biases=tuple(1e308 + b for b in model.net.biases))
    with pytest.raises(InputError, match="outputs may overflow"):
        require_paid(known, model.replace(net=net), slack)


@pytest.mark.parametrize(
    ("part", "changed", "said"),
    [
        ("runs", lambda runs: runs._replace(end=runs.end + 4), "runs of the corridors"),
        ("runs", lambda runs: runs._replace(pair=runs.pair - 1), "runs of the corridors"),
        ("runs", lambda runs: runs._replace(first_run=runs.first_run + 1), "runs of the corridors"),
        ("pair_points", lambda points: points + 1, "points of the body"),
        ("probes", lambda probes: probes + np.array([0, 9]), "probes"),
        ("edges", lambda edges: (edges[0][:1], edges[1]), "edges of the bins"),
        ("edges", lambda edges: edges[:1], "edges of the bins"),
        ("errors", lambda errors: ErrorBox(errors.half[:, :-1]), "errors"),
        ("goal_b", lambda b: b[:, :-1], "rows of the goal"),
        ("start_A", lambda A: A[:, :-1], "rows of the start"),
        ("plans", lambda plans: plans[:, :-1], "plans"),
    ],
)
def test_tables_that_do_not_fit_together_are_refused(part, changed, said, tmp_path):
    known = toy_tables()
    with pytest.raises(InputError, match=f"tables that fit together; {said}"):
        write_toy(known._replace(**{part: changed(getattr(known, part))}), tmp_path / "toy.h")
    assert not (tmp_path / "toy.h").exists()


def test_nothing_is_written_where_margins_do_not_pay(tmp_path):
    known = toy_tables()
    with pytest.raises(InputError, match="margins that pay"):
        write_toy(known._replace(goal_A=1e-300 * known.goal_A), tmp_path / "toy.h")
    assert not (tmp_path / "toy.h").exists()


def test_the_tables_leave_that_room():
    """Rows and supports of the tables are the exact ones less at least half of the slack: of a box
    and a disc, and of a goal that the tube shrinks.
    """
    answer = toy_query.answer()
    known, model, slack = toy()
    room = Fraction(slack) / 2
    problem = answer.problem
    at_end = model.tube.final_errors.half
    for a, b in zip(problem.goal.A, problem.goal.b, strict=True):
        row = int(np.flatnonzero((known.goal_A == a).all(axis=1))[0])
        for bin_, half in enumerate(at_end):
            lost = _dot(abs(a), half)
            assert Fraction(known.goal_b[bin_, row]) <= Fraction(b) - lost - room * _dot(abs(a), 1)
    for a, b in zip(problem.start.A, problem.start.b, strict=True):
        row = int(np.flatnonzero((known.start_A == a).all(axis=1))[0])
        assert Fraction(known.start_b[row]) <= Fraction(b) - room * _dot(abs(a), 1)
    lo, hi, radius = [-0.5, 0.3], [0.0, 0.6], Fraction(0.1)
    for w, support in zip(known.runs.w, known.runs.support, strict=True):
        beyond = Fraction(support) - room * _dot(abs(w), 1) - _dot(w, np.where(w > 0, hi, lo))
        assert beyond > 0 and beyond**2 >= radius**2 * _dot(w, w)


def _dot(a, x) -> Fraction:
    a, x = np.broadcast_arrays(np.asarray(a, float), np.asarray(x, float))
    return sum((Fraction(p) * Fraction(q) for p, q in zip(a.tolist(), x.tolist(), strict=True)))


@needs_compiler
@pytest.mark.parametrize("tube", TUBES)
@pytest.mark.parametrize(
    "flags",
    [
        ["-O2", "-ffp-contract=off"],
        ["-O2", *FUSED],
        pytest.param(
            ["-Ofast", "-fno-finite-math-only", "-fno-associative-math"], marks=pytest.mark.slow
        ),
        *(
            pytest.param([level, *more], marks=pytest.mark.slow)
            for level in ("-O0", "-O1", "-O3")
            for more in (["-ffp-contract=off"], FUSED)
        ),
    ],
    ids=" ".join,
)
def test_plans_at_the_border_are_as_the_model_says_and_kept_in_exact_numbers(flags, tube, tmp_path):
    """What is not fused agrees bit for bit with the model of the code; whatever is called safe,
    fused or not, keeps to a corridor in exact numbers whose thresholds are less by half of the
    slack, and to none where they are more by all of it: these plans are at the border.
    """
    answer = toy_query.answer()
    known, model, slack = toy(tube)
    header = Header(write_toy(known, tmp_path / "toy.h"), *flags)
    pairs = border_pairs(header, answer, 60)
    assert len(pairs) > 30
    n_p = model.n_p
    for plan, said in zip(pairs.reshape(-1, pairs.shape[2]), len(pairs) * [1, 0], strict=True):
        p0, k = plan[:n_p], plan[n_p:]
        assert header.are_safe(p0[None], k[None])[0] == said
        if "-ffp-contract=off" in flags:
            assert is_safe(known, model, p0, k) == said
        if said:
            assert exactly(known, model, p0, k, Fraction(slack) / 2)
            assert not exactly(known, model, p0, k, -Fraction(slack))
