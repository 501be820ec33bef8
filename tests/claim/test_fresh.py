"""What counts as independent: copies are found beyond storage and printing, groups count as one."""

import re
from dataclasses import replace

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_batch
from synthetic_plants import noisy, plant, straight_network

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.calibrate import calibrate, calibrate_bins
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.fresh import left_out_beside, seen_in_training, used_by
from parc_jax.learning.bound.monitor import monitor
from parc_jax.learning.bound.pipeline import bound_error, update
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.law import FITTED, TO_ALL, law_spec
from parc_jax.learning.runs.loaders import load_rollouts

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
LOGS = "file:a", "file:b", "file:c", "file:d"
OTHERS = "copies other than with k within 1e-06 of its range, p 1e-05 of its length"
OTHERS += ", each of q as much of its largest"
pytestmark = pytest.mark.soundness


def recorded(k, p, q, like, k_law="logged", groups=None, name="file:log"):
    """Runs as from a file."""
    law = law_spec(name, like.domain, k_law)
    return rollout_batch(k, p, q, time=like.time, domain=like.domain, law=law, groups=groups)


@pytest.fixture(scope="module")
def train():
    return collect(plant(noisy), KEY, 100, quiet=True)


@pytest.fixture(scope="module")
def held():
    return collect(plant(noisy), KEY, 100, Stage.BOUND, quiet=True)


@pytest.fixture(scope="module")
def profile(train):
    return training_profile(NET, train, (1, 1))


def windows(held, shift):
    """Every run twice, the second time micrometres away, as overlapping windows are."""
    p = np.concatenate([held.p, held.p + shift * np.linspace(0, 1, 21)[None, :, None]])
    return np.concatenate([held.k, held.k]), p, np.concatenate([held.q, held.q])


def test_windows_of_one_recording_are_not_two_runs(held, profile):
    k, p, q = windows(held, 3e-6)
    with pytest.raises(InputError, match=r"rows 0 and 100 are copies.*100 pairs.*groups="):
        calibrate(NET, recorded(k, p, q, held), profile, eps=0.1)
    with pytest.raises(InputError, match=r"drawn uniformly, as declared; 100 of 200"):
        calibrate(NET, recorded(k, p + 0.1 * p**2, q, held, "uniform"), profile, eps=0.1)
    groups = np.tile(np.arange(100), 2)
    one, two = (
        calibrate(NET, recorded(*runs, held, "uniform", groups=own), profile, eps=0.1)
        for runs, own in (((held.k, held.p, held.q), None), ((k, p, q), groups))
    )
    assert (one.n, two.n) == (100, 100) and one.eps == two.eps
    assert "over the 100 calibration recordings (of 200 runs), any run of a new" in two.details()
    assert two.evidence["rows"] == 200


def test_runs_that_are_said_to_be_uniform_are_looked_at(held, profile):
    """Also where they come from no file: a batch of one's own whose k crowd at one end."""
    rows = held.k[:, 0] < 0.6
    crowded = [array[rows] for array in (held.k, held.p, held.q)]
    assert calibrate(NET, recorded(*crowded, held), profile, eps=0.1).n == rows.sum()
    with pytest.raises(InputError, match=r"^holdout: .* the range of k0 hold .*eave k_law out"):
        calibrate(NET, recorded(*crowded, held, "uniform"), profile, eps=0.1)


def test_the_score_of_a_group_is_its_worst(held, profile):
    groups = np.arange(100) // 4
    batch = recorded(held.k, held.p, held.q, held, groups=groups)
    scores = score_batch(NET, batch, profile)
    claim = calibrate(NET, batch, profile, eps=0.5, delta=0.05, discard=3)
    worst = scores.score.reshape(25, 4).max(axis=1)
    assert claim.n == 25 and float.fromhex(claim.evidence["scale"]) == np.sort(worst)[-4]
    with pytest.raises(InputError, match="come in groups"):
        calibrate_bins(NET, scores, profile, eps=0.5, delta=0.05)
    asked = calibrate(NET, batch, profile, eps=1e-3, delta=0.05)
    assert "(needs 2,995 recordings) was asked; 25 recordings do not" in asked.details()
    assert "25 recordings of file:log" in repr(claim)
    with pytest.raises(InputError, match="25 recordings with 25 discards"):
        calibrate(NET, batch, profile, eps=0.5, delta=0.05, discard=25)
    through = bound_error(
        NET, batch, None, eps=0.5, delta=0.05, train=collect(plant(noisy), KEY, 60, quiet=True)
    )
    assert through.n == 25


def test_recordings_fail_not_runs(held, profile):
    """Ten runs of three recordings are NaN: 3 of 25 failed."""
    p = np.array(held.p)
    p[[0, 1, 2, 3, 40, 41, 96, 97, 98, 99]] = np.nan
    batch = recorded(held.k, p, held.q, held, groups=np.arange(100) // 4)
    said = calibrate(NET, batch, profile, eps=0.5, delta=0.05, discard=0).details()
    assert said.startswith("No claim: 3 of 25 recordings failed, with 0 discards")
    assert "calibrate on new recordings" in said


def test_copies_of_training_runs_are_found_beyond_float32(train, held, profile):
    printed = [
        np.array([[float(f"{v:.6g}") for v in row] for row in part]) for part in (train.k, train.q)
    ]
    p = np.round(train.p, 6)
    copies = recorded(np.clip(printed[0], 0, 1), p, printed[1], train)
    assert not np.isin(copies.hashes(), train.hashes()).any()  # not equal in float32
    mixed = recorded(
        np.concatenate([held.k, copies.k[:3]]),
        np.concatenate([held.p, copies.p[:3]]),
        np.concatenate([held.q, copies.q[:3]]),
        train,
    )
    with pytest.raises(InputError, match=r"3 of 103 runs are training runs.*first is row 100"):
        calibrate(NET, mixed, profile, eps=0.1, train=train)
    calibrate(NET, mixed.select(slice(100)), profile, eps=0.1, train=train)


def test_copies_are_found_beside_the_way_too(train, held, profile):
    """In a file of six decimals: y is a thousandth of x. 9 of 10 claims at 95 % were false."""
    thin = np.array([1.0, 1e-3])
    mine, other = (recorded(x.k, x.p * thin, x.q, x) for x in (train, held))
    copies = recorded(train.k, np.round(mine.p, 6), train.q, train)
    mixed = [np.concatenate([getattr(x, name) for x in (other, copies)]) for name in "kpq"]
    with pytest.raises(InputError, match="holdout: at least 97 of 100 runs are training"):
        calibrate(NET, copies, profile, eps=0.1, train=mine)
    with pytest.raises(InputError, match="holdout: at least 97 of 200 runs are training runs"):
        calibrate(NET, recorded(*mixed, train), profile, eps=0.1, train=mine)
    assert calibrate(NET, other, profile, eps=0.1, train=mine).n == 100


@pytest.mark.parametrize("settings", [1, 20, 400])
def test_ends_that_are_equal_by_rounding_are_of_no_copies(settings):
    """Of few k the ends of some runs are the same in millimetres; those of copies all are."""
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n = np.random.default_rng(0), 200
    k = rng.uniform(size=(settings, 2))[np.arange(2 * n) % settings]
    end = np.round(k + 0.01 * rng.normal(size=k.shape), 3)
    one, other = (Marks(k[x], end[x], np.zeros((n, 0))) for x in (slice(n), slice(n, 2 * n)))
    assert len(near_copies(one, other, np.ones(2))) == 0
    copies = one._replace(p=one.p + 1e-7)
    assert len(near_copies(copies, one, np.ones(2))) == n
    by_k = np.lexsort(other.k.T)  # as a campaign logs them, and one by one
    each = [Marks(*(x[by_k[i]] for x in other)) for i in (slice(n // 2), slice(n // 2, n))]
    each += [Marks(*(x[i : i + 1] for x in other)) for i in range(20)] * (settings > 1)
    assert sum(len(near_copies(some, one, np.ones(2))) for some in each) == 0


def test_copies_are_known_beside_runs_that_stand():
    """Six decimals passed where most runs stood, by ends seven where two of one k were equal."""
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n = np.random.default_rng(0), 60
    still = np.arange(n) % 5 > 0
    k = np.where(still[:, None], 0.0, rng.uniform(0.5, 1.0, (n, 2)))
    p = k[:, None] * np.linspace(0.1, 1.0, 8)[:, None] + 1e-4 * rng.normal(size=(n, 8, 2))
    logged = Marks(k, p, np.zeros((n, 0)))
    found = near_copies(logged._replace(p=np.round(p, 6)), logged, np.ones(2))
    assert found[:, 0].tolist() == np.flatnonzero(~still).tolist()
    assert len(near_copies(logged, None, np.ones(2))) == 0
    k = rng.uniform(0.5, 1.0, size=(n, 2))
    end = k + 0.01 * rng.normal(size=k.shape)
    for stood in (0, 2, 8):  # ends alone: of as few runs at a time, too
        ends = np.concatenate([end, np.zeros((stood, 2))])
        known = Marks(np.concatenate([k, np.zeros((stood, 2))]), ends, np.zeros((n + stood, 0)))
        for m in (3, 5, n):
            copies = Marks(k[:m], np.round(end[:m], 6), np.zeros((m, 0)))
            assert len(near_copies(copies, known, np.ones(2))) == m


def test_copies_are_known_as_far_as_is_said():
    """Where p and the length are both off, their quotient is by twice as much."""
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n = np.random.default_rng(0), 100
    k, none = rng.uniform(size=(n, 2)), np.zeros((n, 0))
    p = np.sort(rng.uniform(0.1, 1.0, size=(n, 8, 2)), axis=1)
    off = 0.99e-5 * p.max(axis=(1, 2))[:, None, None] * np.array([1.0, -1.0])
    assert len(near_copies(Marks(k, p + off, none), Marks(k, p, none), np.ones(2))) == n
    assert len(near_copies(Marks(k, p + 3 * off, none), Marks(k, p, none), np.ones(2))) == 0


def test_ends_that_are_alike_by_feedback_are_of_no_copies():
    """Ten goals, each reached to a micrometre, by ways of their own."""
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n = np.random.default_rng(0), 120
    k, none = rng.uniform(0.5, 1.0, size=(10, 2))[np.arange(2 * n) % 10], np.zeros((n, 0))
    end = k + 1e-6 * rng.normal(size=k.shape)
    one, other = (Marks(k[i], end[i], none) for i in (slice(n), slice(n, 2 * n)))
    for m in (1, 5, n):
        some = Marks(*(x[:m] for x in other))
        assert len(near_copies(some, one, np.ones(2))) == 0


def test_a_log_in_three_storages_is_known_in_a_fourth():
    """Each run had three ends then, as if runs of one k came out alike."""
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n = np.random.default_rng(0), 60
    k, none = rng.uniform(0.5, 1.0, size=(n, 2)), np.zeros((n, 0))
    end = k + 0.01 * rng.normal(size=k.shape)
    stored = end, end.astype(np.float32).astype(float), np.round(end, 6)
    three = [Marks(k, x, none) for x in stored]
    known = Marks(*(np.concatenate(x) for x in zip(*three, strict=True)))
    assert len(near_copies(Marks(k, end + 2e-6, none), known, np.ones(2))) == n


@pytest.mark.parametrize("axes", [1, 2])
@pytest.mark.parametrize("stored", [("f8", 12), ("f4", 12), ("f8", 3), ("f4", 3)])
def test_a_list_that_is_driven_again_is_new(stored, axes):
    """20 of 20 were refused: ends by chance in 1-D, in float32 in mm, records that lie in a tick;
    half of a list again, beside new ones, is not."""
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n, (dtype, decimals) = np.random.default_rng(0), 120, stored
    for settings in (3, 10, 60, 120):
        k = rng.uniform(0.5, 1.0, size=(settings, 2))[np.arange(2 * n) % settings]
        p = k[:, :axes] + 5e-4 * rng.normal(size=(2 * n, axes))
        for told in (p, p[:, None] * np.linspace(0.1, 1.0, 8)[:, None]):
            told = np.round(told, decimals).astype(dtype).astype(float)
            one, other = (Marks(k[i], told[i], k[i, :0]) for i in (slice(n), slice(n, 2 * n)))
            assert len(near_copies(other, one, np.ones(2))) == 0
            p_of = np.concatenate([one.p[: n // 2] * (1 + 3e-6), other.p[n // 2 :]])
            if axes > 1:
                assert len(near_copies(other._replace(p=p_of), one, np.ones(2))) >= n // 2


def test_one_run_that_diverged_makes_no_others_alike():
    from parc_jax.learning.runs.independent import Marks, near_copies

    rng, n = np.random.default_rng(0), 60
    p = rng.uniform(size=(2 * n, 8, 2))
    p[7] *= 1e6
    one, other = (Marks(np.ones((n, 1)), x, np.zeros((n, 0))) for x in np.split(p, 2))
    assert not len(near_copies(one, None, np.ones(1))) + len(near_copies(one, other, np.ones(1)))


@pytest.mark.parametrize("n_k", [1, 2])
def test_independent_runs_are_no_copies(n_k):
    """Even where nothing but k tells them apart, and thousands of k lie close together."""
    from parc_jax.common.sets.box import box
    from parc_jax.learning.runs.independent import marks_of, near_copies
    from parc_jax.learning.system import time_grid

    rng, domain, time = np.random.default_rng(0), box([0.0] * n_k, [1.0] * n_k), time_grid(0.5, 1.0)
    law = law_spec("file:x", domain)
    marks = []
    for _ in range(2):
        k = rng.uniform(size=(3000, n_k))
        p = np.array([0.0, 0.5, 1.0])[None, :, None] * k[:, None, :1]
        marks.append(
            marks_of(rollout_batch(k, p, np.zeros((3000, 0)), time=time, domain=domain, law=law))
        )
    assert len(near_copies(marks[0], None, np.ones(n_k))) == 0
    assert len(near_copies(*marks, np.ones(n_k))) == 0


def test_copies_of_failed_runs_are_copies_too(train, held, profile):
    """They cannot be near anything, but they can be equal."""
    p = np.array(train.p[:2])
    p[:, 5:] = np.nan
    broken = recorded(train.k[:2], p, train.q[:2], train)
    one, two = broken.select([0]), broken.select([0, 1])
    mixed = recorded(*(np.concatenate([getattr(b, f) for b in (held, one)]) for f in "kpq"), held)
    with pytest.raises(InputError, match="1 of 101 runs are training runs"):
        calibrate(NET, mixed, profile, eps=0.1, train=two)
    twice = recorded(*(np.concatenate([getattr(b, f) for b in (one, mixed)]) for f in "kpq"), held)
    with pytest.raises(InputError, match="1 of 102 runs occur twice"):
        calibrate(NET, twice, profile, eps=0.1)


def test_recordings_are_known_by_name_whatever_the_file(train, held, profile):
    """Other windows of the same recordings, in another file."""

    def of(runs, name, groups):
        return recorded(runs.k, runs.p, runs.q, runs, groups=groups, name=name)

    names = np.array([f"2026-05-{day // 4:02d}/run {day % 4}" for day in np.arange(100) // 2])
    mine = of(train, "file:log", names)
    with pytest.raises(InputError, match=r"100 of 100 runs belong to recordings.*batch.split"):
        calibrate(NET, of(held, "file:other", names), profile, eps=0.1, train=mine)
    others = of(held, "file:other", np.char.add(names, " on ice"))
    claim = calibrate(NET, others, profile, eps=0.1, train=mine)
    (said,) = (entry for entry in claim.assumptions if entry.startswith("FRESH"))
    assert claim.n == 50 and said.startswith(f"FRESH({OTHERS}")
    assert "or parts of its recordings by another name or number, would not be recog" in said
    numbers = np.arange(100) // 2
    for file in ("file:other", "file:log"):  # a file of the same name, in another folder
        others = (numbers + 500, numbers), (numbers, names), (names, numbers)
        for told, seen in ((numbers, numbers), *others)[file == "file:log" :]:
            runs = of(held, file, told)
            with pytest.raises(InputError, match=r"can be told.*Name them.*in groups.csv"):
                calibrate(NET, runs, profile, eps=0.1, train=of(train, "file:log", seen))


def test_different_people_who_stand_are_no_copies(train, held, profile):
    """Without those the claim would be about people who walk. Who is there twice is refused."""

    def of(runs, groups, name="file:log"):
        k, p, q = (np.array(getattr(runs, x)) for x in "kpq")
        k[:9] = p[:9] = q[:9] = 0.0
        return recorded(k, p, q, runs, groups=groups, name=name)

    names = np.array([f"person {i}" for i in range(200)])
    mine, theirs = of(train, names[:100]), of(held, names[100:], "file:other")
    claim = calibrate(NET, theirs, profile, eps=0.1, train=mine)
    others = OTHERS.removeprefix("copies ")
    assert claim.n == 100 and f"FRESH(copies of runs that stand, and {others}" in claim.details()
    fresh = of(held, np.char.add(names[:100], " of today"), "file:other").select(np.arange(9))
    assert (used_by(claim, fresh) == "").all()
    assert (used_by(claim, theirs) == "calibration").all()
    assert seen_in_training(claim, mine).all() and not seen_in_training(claim, fresh).any()
    with pytest.raises(InputError, match=r"9 of 100 runs belong to recordings"):
        twice = np.append(names[:9], names[109:])
        calibrate(NET, of(held, twice, "file:other"), profile, eps=0.1, train=mine)
    with pytest.raises(InputError, match="8 of 100 runs occur twice"):
        calibrate(NET, of(held, None), profile, eps=0.1)
    turning = replace(train, p=np.zeros_like(train.p))  # on the spot: each k tells a run apart
    mine, theirs = (
        recorded(turning.k, turning.p, turning.q, train, groups=some, name=file)
        for some, file in ((names[:100], "file:log"), (names[100:], "file:other"))
    )
    with pytest.raises(InputError, match="100 of 100 runs are training runs or copies"):
        calibrate(NET, theirs, profile, eps=0.1, train=mine)


@pytest.mark.parametrize("name", ["rec{}", " REC{}\t", "ReC{}", "\uff52ec{}", "re\u0063{}\u00a0"])
def test_names_of_recordings_that_are_spelled_otherwise_are_one(name, train, held, profile):
    """In case, spaces around them, full-width letters: REC7 of one file is rec7 of the next."""

    def of(runs, name, by="Rec{}"):
        groups = np.array([by.format(row // 2) for row in range(100)])
        return recorded(runs.k, runs.p, runs.q, runs, groups=groups, name=name)

    mine = of(train, "file:log")
    with pytest.raises(InputError, match=r"100 of 100 runs belong to rec.* case or spaces alone"):
        calibrate(NET, of(held, "file:other", name), profile, eps=0.1, train=mine)
    assert len(np.unique(mine.groups)) == 50
    # a sign or a space between letters is another name
    for other in ("Rec-{}", "Rec {}", "Rec{}b"):
        assert calibrate(NET, of(held, "file:other", other), profile, eps=0.1, train=mine).n == 50


@pytest.mark.parametrize("older", [1 << 62, 0], ids=["an older file", "another list"])
def test_recordings_of_one_log_that_have_other_names_there_cannot_be_told(
    older, train, held, profile, tmp_path
):
    """Half of the windows were saved with other numbers for their recordings: all were shared."""
    k, p, q = (np.concatenate([getattr(x, name) for x in (train, held)]) for name in "kpq")
    names = np.array([f"rec {row // 2}" for row in range(200)])
    before = recorded(k, p, q, train, groups=older + np.arange(200) // 2)
    save_rollouts(tmp_path / "before.npz", before.select(slice(0, 200, 2)))
    trained = load_rollouts(tmp_path / "before.npz")
    now = recorded(k, p, q, train, groups=names)
    with pytest.raises(InputError, match=r"recordings that can be told.*Name them"):
        calibrate(NET, now.select(slice(1, 200, 2)), profile, eps=0.1, train=trained)
    theirs = before.select(slice(1, 200, 2))  # by the same rule they can be told
    with pytest.raises(InputError, match="100 of 100 runs belong to recordings"):
        calibrate(NET, theirs, profile, eps=0.1, train=trained)


def test_what_nobody_could_compare_is_assumed(train, held, profile):
    mine = recorded(train.k, train.p, train.q, train)
    for name in ("file:other", "file:log"):
        theirs = recorded(held.k, held.p, held.q, held, name=name)
        said = calibrate(NET, theirs, profile, eps=0.1, train=mine).details()
        assert f"FRESH(other windows of recordings that training saw, or {OTHERS}" in said
    said = calibrate(NET, theirs, profile, eps=0.1).details()
    assert "FRESH(there were no training runs to compare with)" in said
    assert "FRESH" not in calibrate(NET, held, profile, eps=0.1).details()  # of a seed
    said = calibrate(NET, theirs, profile, eps=0.1, train=train).details()  # in a file of 4 digits
    assert f"FRESH({OTHERS}, would not be recognised)" in said


def test_runs_that_show_a_claim_have_no_part_in_its_K(held, profile):
    """Logged k without a declared domain: K is that of the training half."""
    law = law_spec("file:log", held.domain, "logged", {FITTED: TO_ALL})
    runs = held.replace(law=law, seed=None, stage=None)
    with pytest.raises(InputError, match="a K that these runs had no part in"):
        calibrate(NET, runs, profile, eps=0.1)
    train, rest = runs.split(0.5)
    assert (train.domain.lo == train.k.min(axis=0)).all()
    assert (train.domain.hi == train.k.max(axis=0)).all() and train.domain.contains(rest.k).all()
    missed = 50 - rest.n
    assert 0 < missed < 10
    by_hand = runs.select(np.arange(100) < 50), runs.select(np.arange(100) >= 50)
    for seen, kept in ((train, rest), by_hand):
        claim = bound_error(NET, kept, None, eps=0.5, delta=0.1, train=seen, bins=(1, 1))
        said = claim.details()
        assert (claim.domain.lo == seen.k.min(axis=0)).all() and claim.n <= kept.n
        assert "any run" not in said and "a new rollout whose k lies in K, drawn from" in said
        assert f"the smallest box of the training runs, which {50 - claim.n} of 50" in said
    # of a network that other runs trained K is not the box of these
    less = train.select(train.k[:, 0] < train.k[:, 0].max())
    for seen, kept in ((less, rest), rest.split(0.5)):
        claim = bound_error(NET, kept, None, eps=0.5, delta=0.2, train=seen, bins=(1, 1))
        said = claim.details()
        assert f"K = the smallest box of other runs, which {missed} of 50 others miss" in said
        assert "training runs, which" not in said
    far = runs.replace(k=np.where(np.arange(100)[:, None] < 50, 0.4, 0.9) + 0.05 * runs.k)
    with pytest.raises(InputError, match="none of 50 does"):
        bound_error(
            NET,
            far.select(np.arange(100) >= 50),
            None,
            eps=0.5,
            delta=0.1,
            train=far.select(np.arange(100) < 50),
        )


def test_a_monitor_counts_recordings(held, profile, train):
    groups = np.arange(100) // 4
    claim = calibrate(NET, recorded(held.k, held.p, held.q, held, groups=groups), profile, eps=0.1)
    watch, parts = monitor(claim, NET), (train.k, train.p, train.q, train)
    seen = watch.observe(recorded(*parts, groups=groups))
    assert seen.seen == 25
    with pytest.raises(InputError, match="expected recordings, as the claim counts; got runs"):
        watch.observe(recorded(*parts))
    first, second = (recorded(*parts, groups=groups).select(slice(at, 100, 2)) for at in (0, 1))
    with pytest.raises(InputError, match="25 were observed before"):
        watch.observe(first).observe(second)
    with pytest.raises(InputError, match="numbers of several files"):
        watch.observe(first).observe(
            recorded(*parts, groups=groups + 50, name="file:b").select(slice(1, 2))
        )
    with pytest.raises(InputError, match="numbers of several files"):  # of one name
        other = recorded(0.99 * train.k, train.p, train.q, train, groups=groups + 50)
        watch.observe(first).observe(other.select(slice(1, 2)))
    with pytest.raises(InputError, match="expected recordings, as the claim counts; got runs"):
        update(claim, NET, train, recorded(*parts), eps=0.1)
    runs = monitor(calibrate(NET, held, profile, eps=0.1), NET)
    assert runs.observe(train).seen == 100
    with pytest.raises(InputError, match="expected runs, as the claim counts; got recordings"):
        runs.observe(recorded(*parts, groups=groups))


def test_other_windows_of_recordings_that_trained_a_network_are_no_news(train, held):
    """Neither to its monitor nor to an update, in which other runs are those seen since."""

    def of(runs, name, by):
        groups = [f"{by} {row}" for row in range(100)]
        return recorded(runs.k, runs.p, runs.q, runs, groups=groups, name=name)

    more = [collect(plant(noisy), jax.random.PRNGKey(i), 100, quiet=True) for i in (7, 8, 9)]
    made = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}
    mine, theirs = of(train, "file:a", "day"), of(held, "file:b", "night")
    claim = bound_error(NET, theirs, None, train=mine, **made)
    since = of(more[0], "file:c", "week")
    windows, others = of(more[1], "file:d", "DAY"), of(more[2], "file:d", "year")
    again = update(claim, NET, since, others)[1]
    for one in (claim, again):
        for meet in (
            monitor(one, NET).observe,
            lambda runs, one=one: update(one, NET, since, runs),
        ):
            said = r"100 of 100 are its training runs.* known by name \(give others"
            with pytest.raises(InputError, match=said):
                meet(windows)
    watch, said = monitor(claim, NET).observe(others), "nor a part of its recording by another name"
    assert watch.seen == again.n == 100
    assert said in watch.details() and said in again.details() and said not in claim.details()


def test_an_update_remembers_what_its_network_was_trained_on(train, held):
    """Copies of these passed a test of a set in a scene as runs that nobody had seen."""
    more = [collect(plant(noisy), jax.random.PRNGKey(i), 100, quiet=True) for i in (7, 8)]
    mine, theirs, since, fresh = (
        recorded(runs.k, runs.p, runs.q, runs, name=f"file:{row}")
        for row, runs in enumerate((train, held, *more))
    )
    made = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}
    claim = bound_error(NET, theirs, None, train=mine, **made)
    again = update(claim, NET, since, fresh)[1]
    copies = recorded(train.k, train.p * (1 + 1e-7), train.q, train, name="file:copies")
    for one, seen in ((claim, [True, False]), (again, [True, True])):
        assert [seen_in_training(one, x).all() for x in (copies, since)] == seen
    assert not seen_in_training(again, fresh).any()
    assert "ORDER_OF_K" not in str(again.assumptions)  # nothing is given by its column
    assert left_out_beside(again, since.select(slice(50))) == 50
    assert [left_out_beside(again, x.select(slice(50))) for x in (mine, theirs)] == [50, 50]
    # an update that trains on runs of before as well counts each of them once
    first, rest = since.select(slice(60)), since.select(slice(60, 90))
    claim = bound_error(NET, fresh, None, train=first, **made)
    again = update(claim, NET, first, theirs)[1]
    assert left_out_beside(again, rest) == left_out_beside(claim, rest) == 10


@pytest.mark.parametrize("logs", [True, False])
def test_runs_that_an_assumed_claim_was_made_from_are_no_news(train, held, logs):
    """As fresh runs of an update these made a claim that was false in 44 of 100 cases."""
    others = (collect(plant(noisy), jax.random.PRNGKey(i), 100, quiet=True) for i in (7, 8))
    mine, since, fresh = (
        recorded(x.k, x.p, x.q, x, name=f"file:{row}") if logs else x
        for row, x in enumerate((train, *others))
    )
    made, untold = {"eps": 0.2, "delta": 0.1, "bins": (1, 1)}, "does not say what it was trained on"
    claim = assumed_claim(NET, mine)
    again = update(claim, NET, since, fresh, **made)[1]
    bare = {name: told for name, told in claim.evidence.items() if name != "seen"}
    older = derived(replace(claim, evidence=bare))  # as of a file of before, and its update
    updated = derived(again, evidence={"seen": again.evidence["seen"][1:]})
    # such files name no runs of a seed
    for one in (claim, again, older, updated)[: 4 if logs else 2]:
        with pytest.raises(InputError, match="100 of 100 are its training runs"):
            update(one, NET, since, mine, **made)
    with pytest.raises(InputError, match="100 of 100 are its training runs"):
        monitor(again, NET).observe(mine)
    assert monitor(again, NET).observe(recorded(held.k, held.p, held.q, held) if logs else held)
    assert untold not in again.details()
    assert untold in update(older, NET, since, fresh, **made)[1].details()


def test_other_windows_of_recordings_that_a_claim_was_made_from_are_no_news(train, held):
    """By the same names: of its calibration nothing but the very runs were known."""
    more = [collect(plant(noisy), jax.random.PRNGKey(i), 100, quiet=True) for i in (7, 8, 9)]
    theirs, since, windows, others = (
        recorded(x.k, x.p, x.q, x, name=name, groups=[f"{by} {row}" for row in range(100)])
        for x, name, by in zip((held, *more), LOGS, ("day", "week", "DAY", "year"), strict=True)
    )
    made = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}
    claim = bound_error(NET, theirs, None, train=train, **made)
    again = update(claim, NET, since, others)[1]
    for one in (claim, again):
        with pytest.raises(InputError, match="100 of 100 are its calibration runs"):
            monitor(one, NET).observe(windows)
    other, part = "by another name or number", "is a calibration run of the claim, nor a part of"
    assert f"none {part} its recording {other}" in monitor(claim, NET).observe(others).details()
    old = {name: told for name, told in claim.evidence.items() if name != "calibration"}
    older = derived(replace(claim, evidence=old))  # as of a file of before, and its update
    for one in (older, update(older, NET, since, others)[1]):
        said = monitor(one, NET).observe(windows).details()
        assert f"{part} its recording, of which it keeps no name" in said


@pytest.mark.parametrize("known", [{}, {"recordings": []}])
def test_an_update_of_a_claim_that_does_not_say_what_trained_its_network(train, held, known):
    new, old = (collect(plant(noisy), jax.random.PRNGKey(i), 100, quiet=True) for i in (7, 8))
    made = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}
    claim = derived(bound_error(NET, held, None, train=train, **made), evidence={"training": known})
    again = update(claim, NET, old, new)[1]
    assert not again.evidence.get("training", {}).get("runs")
    assert not seen_in_training(again, train).any()


def test_a_claim_from_a_log_is_about_its_places_with_the_steps_they_have(held, profile, tmp_path):
    """Rounded, no run left a tube that nearly all leave; and places of a map in float32 have steps
    that no file shows. Logs with others are watched, and their steps are told.
    """
    from_far = held.p + np.array([5e5, 5e6])
    logs = {
        "0.1": np.round(held.p + 7.0, 1),
        "0.05": 0.05 * np.round(held.p / 0.05) + 0.0123,
        "0.023": 0.0237 * np.round(held.p / 0.0237),
        "0.5": from_far.astype(np.float32),
        "two lanes": held.p + 10.0 * (np.arange(held.n) % 2)[:, None, None],
    }
    claims = {}
    for step, p in logs.items():
        np.savez(tmp_path / "log.npz", k=held.k, p=p, q=held.q)
        runs = load_rollouts(tmp_path / "log.npz", held.time, held.domain)
        claims[step] = calibrate(NET, runs, profile, eps=0.1)
        said = f"places = as logged, errors too, steps from {step} m"
        said = (
            said
            if step[0] == "0"
            else re.search(r"steps from \d\.?\d*e-\d+ m", runs.law.describe())[0]
        )
        assert said in claims[step].details() and runs.law == runs.select(slice(5)).law
        assert said in load_rollouts(save_rollouts(tmp_path / "own.npz", runs)).law.describe()
    np.savez(tmp_path / "log.npz", k=held.k + 1e-4, p=held.p * 1.01, q=held.q)
    wide = load_rollouts(tmp_path / "log.npz", held.time, held.domain)
    seen = monitor(claims["0.1"], NET).observe(wide.select(slice(0, 10))).details()
    assert "errors too, steps from 0.1 m" in seen and re.search(r"steps from \S+e-\d+ m", seen)
