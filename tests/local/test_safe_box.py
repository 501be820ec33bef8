"""A box of parameters around a plan: every one of them is safe, and the checker says so."""

from fractions import Fraction

import numpy as np
import pytest
import toy_driven as toy

from parc_jax.common.sets.box import box
from parc_jax.drive.local.safe_box import SafeBox, box_around, safe_box, share_of
from parc_jax.proof.certificate.prove import proves_box
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

P0 = np.array([0.0, 0.0])
K0 = np.array([0.5, 0.5])


def found(wall=0.95, within=None, k=K0):
    model = toy.model()
    scene = scene_of(toy.problem(wall), model)
    return model, scene, safe_box(scene, P0, k, within or model.domain)


def test_every_plan_of_the_box_is_safe_and_the_box_is_not_small(rng):
    model, scene, safe = found()
    x = rng.uniform(safe.lo, safe.hi, (4000, 2))
    assert verdicts(scene, np.broadcast_to(P0, (4000, 2)), x).safe.all()
    # by hand: the end k stays in the goal less its error, and p_y + radius + error below the wall
    most = np.minimum(0.2 - model.tube.final[0, :2], 1.0)
    assert (safe.half <= most + 1e-9).all() and (safe.half >= 0.5 * most).all()
    assert safe.share == share_of(box(-safe.half, safe.half), model.domain)


def test_a_wall_in_the_way_makes_it_smaller_and_one_on_the_plan_leaves_none():
    free = found()[2]
    model, _, tight = found(wall=0.66)
    assert tight.share < free.share
    high = tight.hi[1] + 0.05 + model.tube.interval[0, -1, 1]
    assert high < 0.66
    assert found(wall=0.5)[2] is None


def test_the_checker_refuses_a_box_that_is_too_large():
    """The guard itself: the same certificate with a wider room."""
    model, scene, safe = found()
    assert proves_box(scene.problem, model, safe.certificate)
    wide = [x.hex() for x in (safe.half * 2).tolist()]
    room = safe.certificate["room"] | {"k": wide}
    assert not proves_box(scene.problem, model, safe.certificate | {"room": room})


def test_only_what_the_checker_accepts_is_returned(monkeypatch):
    asked = []

    def refuse(problem, model, part):
        asked.append(part)
        return False

    monkeypatch.setattr("parc_jax.drive.local.safe_box.proves_box", refuse)
    assert found()[2] is None and asked


def test_a_box_cut_to_another_one_is_all_of_it_when_all_is_safe():
    near = box_around(K0 + 0.01, 0.05, toy.model().domain)
    model, _, safe = found(within=near, k=K0 + 0.01)
    assert (safe.lo == near.lo).all() and (safe.hi == near.hi).all()
    assert safe.share == share_of(near, model.domain)


def test_what_is_told_of_a_box_lies_inside_of_what_is_proved(rng):
    middle, half = rng.normal(size=300), rng.uniform(0.0, 0.1, 300)
    told = SafeBox(np.zeros(2), middle, half, Fraction(1, 2), {})
    for m, h, lo, hi in zip(middle, half, told.lo, told.hi, strict=True):
        m, h = Fraction(m), Fraction(h)
        assert m - h <= Fraction(lo) and Fraction(hi) <= m + h
    assert np.allclose(told.lo, middle - half, rtol=0, atol=1e-14)
    assert (told.lo != middle - half).any() and (told.hi != middle + half).any()


@pytest.mark.parametrize("k", [[0.0, 0.3], [1.0, 1.0], [np.pi / 6, 0.999]])
def test_boxes_stay_in_k_and_their_middles_are_exact(k):
    whole = box([0.0, np.pi / 12], [1.0, 1.0])
    near = box_around(np.clip(k, whole.lo, whole.hi), 0.03, whole)
    assert (near.lo >= whole.lo).all() and (near.hi <= whole.hi).all()
    middle, half = near.center, near.radius
    for m, h, lo, hi in zip(middle, half, near.lo, near.hi, strict=True):
        assert Fraction(m) - Fraction(h) == Fraction(lo) and Fraction(m) + Fraction(h) == Fraction(
            hi
        )
    assert 0.99 * 0.03**2 < float(share_of(near, whole)) <= 0.03**2 * (1 + 1e-12)
