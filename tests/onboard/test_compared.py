"""What a header lets pass, the checker accepts: tables that ask for less are refused, and plans at
the very border belong to a corridor of the answer, by the checker's own conditions.
"""

from fractions import Fraction

import numpy as np
import pytest
import toy_query
from faces_of_errors import template_of
from toy_bodies import random_faces
from toy_header import border_pairs, toy_tables

import parc_jax as pj
from benchmarks.compiled_header import Header
from parc_jax.checker import Context, Rejected, load
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import hex_text
from parc_jax.drive.onboard.compared import held, require_kept
from parc_jax.drive.onboard.tables import in_numbers
from parc_jax.proof.certificate.write import corridor_part, question_parts

pytestmark = pytest.mark.soundness


def kept(known=None):
    answer = toy_query.answer()
    slack = float(answer.scene.slack)
    return require_kept(toy_tables() if known is None else known, answer, slack)


def test_tables_of_the_answer_are_those_of_its_file(tmp_path):
    answer = toy_query.answer()
    parts = ("problem", "network", "tube")
    hashes = kept()
    text = pj.exchange.write_c(answer, tmp_path / "toy.h").read_text()
    assert [*hashes] == [*parts, "corridors"]
    assert all(f"sha256 {name} {value}" in text for name, value in hashes.items())
    saved = load(answer.save(tmp_path / "answer.json"))["hash"]
    assert {name: saved[name] for name in parts} == {name: hashes[name] for name in parts}


def narrower(errors):
    half = np.array(errors.half)
    half[-1, -1] *= 1 - 1e-15
    return errors.replace(half=half)


def lower(runs):
    """One threshold less by a thousandth of a millimetre."""
    support = runs.support.copy()
    support[-1] -= 1e-6
    return runs._replace(support=support)


def turned(runs):
    return runs._replace(w=runs.w + 1e-9)


def shorter(runs):
    """The last run of a corridor ends an interval early."""
    end = runs.end.copy()
    end[-1] -= 1
    return runs._replace(end=end)


@pytest.mark.parametrize(
    ("part", "changed", "said"),
    [
        ("edges", lambda edges: (np.nextafter(edges[0], 9), *edges[1:]), "edges of the bins"),
        ("edges", lambda edges: (1.5 * edges[0], *edges[1:]), "edges of the bins"),
        ("start_b", lambda b: b + 1e-6, "rows of the start"),
        ("start_A", lambda A: 2 * A, "rows of the start"),
        ("goal_b", lambda b: b + 1e-6, "rows of the goal"),
        ("goal_A", lambda A: A[::-1], "rows of the goal"),
        ("errors", narrower, "errors"),
        ("runs", lower, "directions of a corridor"),
        ("runs", turned, "directions of a corridor"),
        ("runs", lambda runs: runs._replace(w=-runs.w), "directions of a corridor"),
        ("runs", shorter, "intervals of a corridor"),
        ("order", lambda order: np.roll(order, 1), "directions of a corridor"),
        ("pair_points", lambda points: points + 1, "points of the body"),
    ],
)
def test_tables_that_ask_for_less_are_refused(part, changed, said):
    known = toy_tables()
    with pytest.raises(InputError, match=f"ask for as much as .* {said} ask"):
        kept(known._replace(**{part: changed(getattr(known, part))}))


def test_faces_hold_all_errors_of_the_exact_ones():
    """Up to a quarter of the slack; a face that is moved or turned by more does not."""
    rng = np.random.default_rng(2)
    spare = Fraction(float(toy_query.answer().scene.slack)) / 4
    for n_p in (2, 3):
        faces = random_faces(rng, (3, 2, 1), n_p, 0.02, around_zero=False)
        errors = in_numbers(faces.errors)
        for index in np.ndindex(3, 2, 1):
            exact = template_of(faces.rows(index), n_p)
            own = type(errors)(errors.dual[index], errors.centre[index], errors.half[index])
            width = held(own, exact, spare)
            assert width is not None and width > 0
            for name, change in (("half", -1e-9), ("centre", 1e-9), ("dual", 1e-3)):
                moved = getattr(own, name).copy()
                moved[-1] += change
                assert held(own.replace(**{name: moved}), exact, spare) is None, name


@pytest.mark.needs("compiler")
@pytest.mark.parametrize("flags", [["-O0"], ["-O3", "-ffp-contract=fast"]], ids=" ".join)
def test_what_is_safe_at_the_border_belongs_to_a_corridor(flags, tmp_path):
    answer = toy_query.answer()
    header = Header(pj.exchange.write_c(answer, tmp_path / "toy.h"), *flags)
    safe = border_pairs(header, answer, 60)[:, 0]
    assert len(safe) > 30
    context = Context(*question_parts(answer.problem, answer.model))
    seps = [corridor_part(corridor, answer.problem)["sep"] for corridor in answer.corridors]
    assert all(belongs(context, seps, plan) for plan in safe)
    assert not any(belongs(context, seps, plan + 0.5) for plan in safe)


def belongs(context, seps, plan):
    p0, k = hex_text(plan[: context.n_p]), hex_text(plan[context.n_p :])
    for sep in seps:
        try:
            context.check_sample({"p0": p0, "k": k, "sep": sep})
            return True
        except Rejected:
            pass
    return False
