"""Tubes of faces: the same claims as boxes give, by plain loops; faces that fit are smaller."""

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from claim_files import load_claim, save_claim
from profiles import training_profile
from scored import score_batch
from synthetic_plants import failing, noisy, plant, straight, straight_network
from turning_bar import Bar

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.calibrate import calibrate, calibrate_bins
from parc_jax.learning.bound.claim import weaker
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.bound.profile import fitted_profile, shape_of
from parc_jax.learning.bound.settings import SpeedBound
from parc_jax.learning.bound.start_gap import StartTrial, allow_for_start
from parc_jax.learning.bound.tube import fitted_tube, tube_from_json, tube_to_json
from parc_jax.learning.model import load, trajectory_model
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.runs.collect import collect

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
pytestmark = pytest.mark.soundness


def slanted(key, k, s):
    """Early or late on a slanted path, and a little to one side: a long thin error off centre."""
    p, q = straight(k, s)
    late, aside = jax.random.uniform(key, (2,)) - jnp.array([0.2, 0.5])
    along, across = jnp.array([0.8, 0.6]), jnp.array([-0.6, 0.8])
    return p + s[:, None] * (late * along + 0.02 * aside * across)[None], q + 0.1 * late


@pytest.fixture(scope="module")
def train():
    return collect(plant(slanted), KEY, 600, quiet=True)


@pytest.fixture(scope="module")
def holdout():
    return collect(plant(slanted), KEY, 688, Stage.BOUND, quiet=True)


@pytest.fixture(scope="module")
def profile(train):
    return fitted_profile(NET, [train], (3, 1))


def signed_errors(batch, i):
    """Errors (T, records of an interval, 2) and of the end (3,) of one run, by the definition."""
    c = np.linspace(0, 1, 21)[:, None] * batch.k[i]
    error = batch.p[i] - c
    during = np.array([[error[5 * t + j] for j in range(6)] for t in range(4)])
    return during, np.concatenate([error[-1], batch.q[i] - batch.k[i, :1]])


def textbook_score(batch, i, tube, bin):
    during, end = signed_errors(batch, i)
    score = 0.0
    for t in range(4):
        for e in during[t]:
            given = tube.templates.interval
            for u, c, s in zip(
                given.directions[bin, t, 0],
                given.centre[bin, t, 0],
                given.half[bin, t, 0],
                strict=True,
            ):
                score = max(score, abs(u @ e - c) / s)
    given = tube.templates.final
    for u, c, s in zip(given.directions[bin], given.centre[bin], given.half[bin], strict=True):
        score = max(score, abs(u @ end - c) / s)
    return score


def test_a_score_is_the_definition(profile, holdout):
    scores = score_batch(NET, holdout, profile).score
    bins = profile.bin_of(holdout.k)
    for i in range(0, holdout.n, 13):
        by_hand = textbook_score(holdout, i, profile, bins[i])
        assert scores[i] >= by_hand
        np.testing.assert_allclose(scores[i], by_hand, rtol=1e-9)


def test_faces_along_the_axes_about_zero_are_a_box(holdout):
    seen = collect(plant(noisy), KEY, 300, quiet=True)
    box = training_profile(NET, seen, (2, 2))
    during, at_end = (
        faces(np.broadcast_to(np.eye(n), (*half.shape, n)), np.zeros(half.shape), half)
        for half, n in ((box.interval[:, :, None], 2), (box.final, 3))
    )
    same = fitted_tube(box.edges, during, at_end)
    np.testing.assert_array_equal(same.interval, box.interval)
    np.testing.assert_array_equal(same.final, box.final)
    fresh = collect(plant(noisy), KEY, 688, Stage.BOUND, quiet=True)
    one, other = score_batch(NET, fresh, same), score_batch(NET, fresh, box)
    np.testing.assert_allclose(one.score, other.score, rtol=1e-13)
    np.testing.assert_array_equal(one.worst, other.worst)
    claims = [calibrate(NET, fresh, p, eps=1e-2, delta=1e-3, discard=0) for p in (same, box)]
    for ours, theirs in zip(claims[0].tube.halves, claims[1].tube.halves, strict=True):
        more = ours.reshape(theirs.shape) - theirs
        assert (more >= -1e-14).all() and (more <= 2.0**-40 + 1e-14).all()  # short fractions


def test_no_error_at_all_is_between_the_faces():
    """A robot that is always late errs about a far centre; its tube reaches back to the model."""

    def late(key, k, s):
        p, q = slanted(key, k, s)
        return p + 2 * s[:, None] * jnp.array([[0.8, 0.6]]), q + 1.0

    always = collect(plant(late), KEY, 300, quiet=True)
    found = fitted_profile(NET, [always], (2, 1))
    for given in found.templates:
        assert given.allow_none.all() and (given.half < 2 * np.abs(given.centre)).any()
    assert score_batch(NET, always, found).score.max() < 1


def test_a_signed_tube_is_a_box_about_the_middle_of_the_errors(profile, train, holdout):
    signed = fitted_profile(NET, [train], (3, 1), turned=False)
    for ours, theirs in zip(signed.templates, profile.templates, strict=True):
        n = ours.directions.shape[-1]
        assert (ours.directions == np.eye(n)).all() and ours.allow_none.all()
        np.testing.assert_array_equal(ours.half, theirs.half[..., :n])  # as the axes of the fitted
        np.testing.assert_array_equal(ours.centre, theirs.centre[..., :n])
    about = training_profile(NET, train, (3, 1))  # errors lie to one side
    wide = signed.templates.final.half[:, :2]
    assert (wide < 0.75 * about.final[:, :2]).all()
    claim = calibrate(NET, holdout, signed, eps=1e-2, delta=1e-3, discard=0)
    assert inside_tube(claim, NET, holdout).all() and shape_of(claim.tube) == "signed"
    assert [shape_of(tube) for tube in (profile, about)] == ["fitted", "box"]
    assert tube_from_json(tube_to_json(claim.tube)).hash == claim.tube.hash


def test_a_fitted_tube_is_thin_across_the_error(profile):
    across = np.broadcast_to([-0.6, 0.8], (3, 4, 1, 2))
    box = np.abs(across * profile.interval.reshape(3, 4, 1, 2)).sum(axis=-1)
    assert (profile.errors.support(across) < 0.3 * box)[:, 1:].all()
    fit = profile.templates.interval.directions[:, 3, 0, 2]
    assert (np.abs(fit @ [0.8, 0.6]) > 0.99).all()


def test_every_kind_of_claim_holds_the_runs_it_was_sized_by(profile, holdout, train):
    one = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3, train=train, discard=0)
    assert inside_tube(one, NET, holdout).all() and one.tube.templates is not None
    kept = calibrate(NET, holdout, profile, eps=5e-2, delta=1e-3, discard="most", train=train)
    assert (~inside_tube(kept, NET, holdout)).sum() == kept.discard > 0
    scores = score_batch(NET, holdout, profile)
    by_bin = calibrate_bins(NET, scores, profile, eps=0.1, delta=1e-2, discard=0)
    assert inside_tube(by_bin, NET, holdout).all()
    assert np.ptp([h[0, 0] for h in by_bin.tube.templates.interval.half[:, 3]]) > 0


def test_a_run_on_a_shared_edge_must_fit_both_bins(profile, holdout):
    edge = profile.edges[0][1]
    on_edge = holdout.select(np.arange(5)).replace(
        k=np.column_stack([np.full(5, edge), holdout.k[:5, 1]])
    )
    scores = score_batch(NET, on_edge, profile).score
    for i in range(5):
        both = [textbook_score(on_edge, i, profile, bin) for bin in (0, 1)]
        np.testing.assert_allclose(scores[i], max(both), rtol=1e-9)


def test_time_between_records_widens_every_pair_of_faces_by_its_own_reach(profile, holdout):
    plain = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3)
    fast = calibrate(
        NET, holdout, profile, eps=1e-2, delta=1e-3, intersample=SpeedBound((2.0, 4.0))
    )
    grown = fast.tube.halves[0] - plain.tube.halves[0]
    directions = profile.templates.interval.directions
    by_hand = np.abs(directions) @ (np.array([2.0, 4.0]) * 0.5 * holdout.time.dt_record)
    np.testing.assert_allclose(grown, by_hand, atol=2.0**-39)
    assert (inside_tube(fast, NET, holdout) == inside_tube(plain, NET, holdout)).all()


def test_a_start_gap_widens_every_pair_of_faces_by_its_own_reach(profile, holdout):
    claim = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3)
    wider = allow_for_start(claim, StartTrial(0.01, None)).tube
    for part, given in zip(("interval", "final"), claim.tube.templates, strict=True):
        grown = getattr(wider.templates, part).half - given.half
        by_hand = 0.01 * np.abs(given.directions).sum(axis=-1)
        np.testing.assert_allclose(grown, by_hand, atol=2.0**-39)


def test_a_failed_run_takes_the_claim(profile):
    broken = collect(plant(failing), KEY, 200, quiet=True)
    scores = score_batch(NET, broken, profile)
    assert (np.isinf(scores.score) == broken.failed).all() and broken.failed.any()
    claim = calibrate(NET, broken, profile, eps=0.1, delta=1e-3)
    assert not claim.tube.claimed.any() and "No claim" in claim.details()


def test_a_tube_of_faces_travels(profile, holdout, tmp_path):
    claim = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3)
    save_claim(claim, tmp_path / "claim.json")
    again = load_claim(tmp_path / "claim.json")
    assert again.tube.hash == claim.tube.hash != claim.tube.replace(templates=None).hash
    assert tube_from_json(tube_to_json(profile)).hash == profile.hash
    model = trajectory_model(NET, claim)
    read = load(model.save(tmp_path / "model.npz"))
    assert read.tube.hash == claim.tube.hash and "4 pairs of faces" in repr(read.tube)
    data = tube_to_json(profile)
    data["interval"][0][0][0] = (0.5).hex()
    with pytest.raises(InputError, match="boxes around its faces"):
        tube_from_json(data)


def test_claimed_faces_add_up_without_rounding(profile, holdout):
    claim = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3)
    for given in claim.tube.templates:
        for c, s in zip(given.centre.ravel(), given.half.ravel(), strict=True):
            for sign in (1, -1):
                exact = Fraction(s) + sign * Fraction(c)
                assert exact == Fraction(float(s) + sign * float(c))


def test_a_claim_survives_wider_faces_only(profile, holdout):
    claim = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3)
    half = [np.array(h) for h in claim.tube.halves]
    half[0][1, 2, 0, 3] *= 0.999
    with pytest.raises(InputError, match="narrower somewhere"):
        weaker(claim, claim.tube.with_halves(*half))
    moved = claim.tube.templates.interval
    shifted = faces(moved.directions, moved.centre + 2.0**-20, moved.half * 2)
    other = fitted_tube(claim.tube.edges, shifted, claim.tube.templates.final)
    with pytest.raises(InputError, match="narrower somewhere"):
        weaker(claim, other)
    with pytest.raises(InputError, match="narrower somewhere"):
        weaker(claim, claim.tube.replace(templates=None))


def test_every_point_of_a_body_has_faces_of_its_own():
    runs = collect(Bar(), KEY, 300, quiet=True)
    layout = layout_of(runs)
    net = relu_network([np.zeros((layout.n_offsets + 1, 2))], [np.zeros(layout.n_offsets + 1)])
    found = fitted_profile(net, [runs], (1, 1))
    given = found.templates.interval
    assert given.half.shape == (1, 4, 2, 4) and found.templates.final.half.shape == (1, 2 * 5)
    stride, at = runs.time.stride, runs.p.reshape(runs.n, -1, 2, 2)  # the network says 0
    half = np.empty(given.half.shape[1:])
    for t in range(4):
        for i in range(2):
            seen = at[:, t * stride : (t + 1) * stride + 1, i].reshape(-1, 2)
            seen = np.concatenate([seen, np.zeros((1, 2))])  # no error at all is among them
            along = seen @ given.directions[0, t, i].T
            half[t, i] = np.abs(along - given.centre[0, t, i]).max(axis=0)
    size = 0.1 * half[..., :2].mean(axis=0) + 1e-3  # margin and floor, per point and axis
    more = (np.abs(given.directions[0]) * size[:, None]).sum(axis=-1)
    np.testing.assert_allclose(given.half[0], half + more, rtol=1e-6)
    assert score_batch(net, runs, found).score.max() < 1
