"""What runs rest on reaches the sentence of the claim that is made from them, or is refused."""

import enum
import json
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import numpy as np
import pytest
from claim_files import load_claim, save_claim
from profiles import training_profile
from synthetic_plants import failing, noisy, plant, straight_network

import parc_jax as pj
from parc_jax.checker import Rejected
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.settings import SpeedBound
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.collect import k_law
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.runs.law import law_of, law_spec

KEY, NET, UNIT = jax.random.PRNGKey(0), straight_network(4), pj.box([0, 0], [1, 1])
ONE_BIN = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}
pytestmark = pytest.mark.soundness


@pytest.fixture(scope="module")
def runs():
    return pj.learning.collect(plant(noisy), KEY, 100, quiet=True)


@pytest.fixture(scope="module")
def held():
    return pj.learning.collect(plant(noisy), KEY, 100, Stage.BOUND, quiet=True)


@pytest.fixture(scope="module")
def claim(held, runs):
    return pj.learning.bound_error(NET, held, None, train=runs, **ONE_BIN)


def log(folder, runs, groups=None, name="log.npz", domain=True):
    """The same runs as a log of no known seed."""
    folder.mkdir(exist_ok=True)
    named = {} if groups is None else {"groups": groups}
    np.savez(folder / name, k=runs.k, p=runs.p, q=runs.q, **named)
    return pj.load_rollouts(folder / name, runs.time, runs.domain if domain else None)


def test_two_files_of_one_name_do_not_become_one(runs, held, tmp_path):
    """Windows of one recording would come to lie on both sides of a split."""
    groups = np.arange(100) // 2
    first, second = (
        log(tmp_path / name, batch, groups) for name, batch in (("a", runs), ("b", held))
    )
    with pytest.raises(pj.InputError, match=r"expected each row of file:log.npz once; 100 of 200"):
        concatenate([first, first])
    said = r"expected batches of one source; they differ in (law|log)"
    with pytest.raises(pj.InputError, match=said):
        concatenate([first, second])
    half = first.select(slice(50))
    with pytest.raises(pj.InputError, match=r"differ in labels \(None; Labels\(.*speed"):
        concatenate(
            [
                half.replace(labels=None),
                first.select(slice(50, 100)).replace(
                    labels=runs.subject.with_labels({"k": ("speed", "turn")}).labels
                ),
            ]
        )


def test_ungrouped_windows_of_one_file_are_assumed_to_be_of_two_recordings(runs, tmp_path):
    train, rest = log(tmp_path, runs).split(0.5)
    said = pj.learning.bound_error(NET, rest, None, train=train, **ONE_BIN).details()
    assert "FRESH(other windows of recordings that training saw, or copies other than" in said
    train, rest = log(tmp_path, runs, np.arange(100)).split(0.5)
    said = pj.learning.bound_error(NET, rest, None, train=train, **ONE_BIN).details()
    assert "FRESH(copies" in said and "FRESH(other windows" not in said


@pytest.mark.parametrize("numbers", ["{}", " {}.0"])
def test_numbers_written_as_text_are_no_names(numbers, runs, held, tmp_path):
    texts = np.array([numbers.format(i) for i in range(100)])
    train, rest = log(tmp_path, runs, texts, "a.npz"), log(tmp_path, held, texts, "b.npz")
    assert (train.groups == np.arange(100)).all()
    other = log(tmp_path, held, np.char.add("run ", texts), "b.npz")
    for calibration in (rest, other):
        with pytest.raises(pj.InputError, match=r"recordings that can be told|of which"):
            pj.learning.bound_error(NET, calibration, None, train=train, **ONE_BIN)
    for bad in ("2.5", ""):
        with pytest.raises(pj.InputError, match="Give each recording a name with a letter"):
            log(tmp_path, runs, np.array([bad] * 100))


def named(name):
    def sampler(key):
        return 0.1 * jax.random.uniform(key, (2,))

    sampler.__name__ = name
    return sampler


@pytest.mark.parametrize("name", ["uniform", "given (0.5, 0.5)", "logged", "<lambda>"])
def test_the_name_of_a_sampler_is_no_other_law(name, runs):
    drawn = pj.learning.collect(plant(noisy), KEY, 100, Stage.BOUND, k=named(name), quiet=True)
    claim = pj.learning.bound_error(NET, drawn, None, train=runs, **ONE_BIN)
    said = "without a name" if name == "<lambda>" else name
    assert f"k by the sampler {said}, content " in claim.quantifier
    assert f"For k drawn by the sampler {said}, content " in claim.details()
    assert "share s of K:" not in claim.details()


class Table:
    """A sampler, or a value of a law, whose numbers are private."""

    def __init__(self, rows):
        self._rows = rows

    def __call__(self, key):
        return self._rows[0]

    def __str__(self):
        return "a table"


class Gust(NamedTuple):
    """Two of these may have one text."""

    sigma: float

    def __str__(self):
        return f"gust of {self.sigma:.1f}"


def floors(mu):
    return enum.Enum("Floor", {"ICE": mu}, type=str, module=__name__).ICE


def test_laws_of_values_with_a_text_of_their_own_are_compared_by_content():
    for one, other in ((Gust(0.06), Gust(0.14)), (floors("mu 0.1"), floors("mu 0.9"))):
        laws = [law_spec("toy", UNIT, "uniform", {"k": x}) for x in (one, one, other)]
        assert laws[0] == laws[1] and laws[0].hash != laws[2].hash


def test_laws_of_long_tables_are_compared_by_content():
    """`str` of 2,000 rows shows the first and the last three, and eight digits."""
    one, other = np.linspace(0, 1, 4000).reshape(-1, 2), np.linspace(0, 1, 4000).reshape(-1, 2)
    other[1000] += 1e-12
    held = ((one, other), ([one], [other]), ({"a": one}, {"a": other}), (one[:2], one[:2] + 1e-12))
    for pair in (*held, (np.float32(0.1), 0.1), (Table(one), Table(other))):
        first, again, second = (
            law_spec("toy", UNIT, "uniform", {"k": x}) for x in (pair[0], *pair)
        )
        assert first == again and first.hash != second.hash, pair
        assert len(dict(first.parameters)["k"]) < 120
    drawn = [k_law(plant(noisy), Table(x)) for x in (one, one.copy(), other)]
    assert drawn[0] == drawn[1] != drawn[2]
    assert k_law(plant(noisy), [0.1, 0.2]) != k_law(plant(noisy), [0.1, 0.2 + 1e-12])
    plain = {"gust": (0.1, 2), "name": "calm", "none": None}
    assert dict(law_spec("toy", UNIT, "uniform", plain).parameters) == {
        name: str(value) for name, value in plain.items()
    }


def test_k_that_were_given_are_named(runs):
    for k, words in (([0.25, 0.5], "(0.25, 0.5)"), (runs.k[::-1], "(100 values, sha256 ")):
        given = pj.learning.collect(plant(noisy), KEY, 100, Stage.BOUND, k=k, quiet=True)
        said = pj.learning.bound_error(NET, given, None, train=runs, **ONE_BIN).details()
        assert f"(k as given {words}" in said and f"For k drawn as given {words}" in said


def test_k_of_a_seed_are_looked_at_too(held, runs):
    """A batch of one's own that has a seed, and says uniform."""
    k, about = 0.2 * held.k, {"time": held.time, "domain": held.domain, "law": held.law}
    mine = rollout_batch(k, held.p, held.q, seed=(0, 1), stage=2, **about)
    with pytest.raises(pj.InputError, match="expected k drawn uniformly, as declared"):
        pj.learning.bound_error(NET, mine, None, train=runs, **ONE_BIN)


def test_failed_runs_are_not_left_out_in_silence(runs, tmp_path):
    broken = pj.learning.collect(plant(failing), KEY, 300, Stage.BOUND, quiet=True)
    gone = int(broken.failed.sum())
    assert gone > 5 and not broken.failed[[0, -1]].any()
    with pytest.raises(
        pj.InputError, match=rf"all rows from 0 to 299 of their seed; {gone} are mis"
    ):
        pj.learning.bound_error(NET, broken.select(~broken.failed), None, train=runs, **ONE_BIN)
    with pytest.raises(pj.InputError, match="leaves the tube; got runs without, of `finite`"):
        pj.learning.bound_error(NET, broken.finite, None, train=runs, **ONE_BIN)
    logged = log(tmp_path, broken)
    with pytest.raises(pj.InputError, match="leaves the tube; got runs without, of `finite`"):
        pj.learning.bound_error(NET, logged.finite, None, train=runs, **ONE_BIN)
    with pytest.raises(pj.InputError, match="leaves the tube; got runs without, of `finite`"):
        pj.learn(logged.finite, KEY, hidden=(3,), seeds=1, steps=20)
    halves = logged.select(slice(0, 150)), logged.select(slice(150, None))
    both = concatenate([half.finite for half in halves])
    with pytest.raises(pj.InputError, match="leaves the tube; got runs without, of `finite`"):
        pj.learning.bound_error(NET, both, None, train=runs, **ONE_BIN)
    others = logged.select(~logged.failed)  # why these alone are left is the user's word
    claim = pj.learning.bound_error(NET, others, None, train=runs, **ONE_BIN)
    assert f"Before that {gone} rows beside theirs had been left out" in claim.details()
    train, rest = log(tmp_path, runs).split(0.5)
    assert (
        "left out" not in pj.learning.bound_error(NET, rest, None, train=train, **ONE_BIN).details()
    )
    train, rest = runs.split(0.5)  # of a seed: what the one lacks is in the other
    assert pj.learning.bound_error(NET, rest, None, train=train, **ONE_BIN).n == 50


def crash(folder, rng, k):
    """Ends its process, once in all; what disturbs it shows in the first k that is tried."""
    if k[0] > 0.8 and not (folder / "crashed").exists():
        (folder / "crashed").touch()
        raise KeyboardInterrupt
    return np.linspace(0, 1, 5)[:, None] * (k + 1e-9 * rng.normal()), k[:1]


def test_runs_that_were_begun_twice_are_counted(tmp_path):
    """A crash of all ends the work; the second time all succeeds, and nobody counted."""
    system = pj.python_system(
        partial(crash, tmp_path), pj.box([0.0], [1.0]), pj.learning.time_grid(0.25, 1.0),
        name="robot", n_p=1, n_q=1, workers=0,
    )  # fmt: skip
    net = pj.learning.relu_network([np.array([[0.25], [0.5], [0.75], [1.0], [1.0]])], [np.zeros(5)])
    about = {"eps": 0.2, "delta": 0.2, "bins": (1,), "profile_runs": 0, "quiet": True}
    train = pj.learning.collect(system, jax.random.PRNGKey(1), 4, k=[0.1], quiet=True)
    train = replace(train, k=train.k + np.linspace(0, 0.3, 4)[:, None])
    again = partial(
        pj.learning.bound_error, net, system, KEY, train=train, path=tmp_path / "runs", **about
    )
    with pytest.raises(KeyboardInterrupt):
        again(fresh=40)
    claim = again(fresh=40)
    assert "WORKERS_LOST(16, independent of the run)" in claim.details()
    silent = pj.learning.bound_error(net, system, KEY, train=train, fresh=40, **about)
    assert "WORKERS_LOST" not in silent.details()


def rewritten(claim, path, change):
    data = json.loads(save_claim(claim, path).read_text())
    change(data["claim"])
    path.write_text(json.dumps(data))
    return path


@pytest.mark.parametrize("failed", [101, 40])
def test_numbers_of_failed_runs_that_cannot_be_are_refused(failed, claim, tmp_path):
    def forge(data):
        data["evidence"]["failed"] = failed

    with pytest.raises(pj.InputError, match="Bound the error anew"):
        load_claim(rewritten(claim, tmp_path / "claim.json", forge))
    forged = derived(claim, evidence={"failed": failed})  # under a hash of its own
    with pytest.raises((pj.InputError, Rejected), match=r"failed|whole number"):
        load_claim(save_claim(forged, tmp_path / "claim.json"))
    with pytest.raises(pj.InputError, match="a sentence can state; the whole number -1"):
        save_claim(derived(claim, evidence={"failed": -1}), tmp_path / "claim.json")


def test_a_monitor_counts_what_the_claim_counts_and_each_once(claim, held, runs):
    watch = pj.monitor(claim, NET)
    fresh = pj.learning.collect(plant(noisy), jax.random.PRNGKey(5), 40, quiet=True)
    once = watch.observe(fresh.select(slice(20)))
    with pytest.raises(pj.InputError, match="20 of 40 occur twice or were observed before"):
        once.observe(fresh)
    with pytest.raises(
        pj.InputError, match="100 of 100 are its calibration runs, the first is row 0"
    ):
        watch.observe(held)
    chosen = pj.learning.collect(plant(noisy), jax.random.PRNGKey(5), 40, k=[0.5, 0.5], quiet=True)
    with pytest.raises(pj.InputError, match=r"got k as given \(0\.5, 0\.5\)\. Declare it: monitor"):
        watch.observe(chosen)
    assert pj.monitor(claim, NET, share=1.0).observe(chosen).seen == 40
    assert once.observe(fresh.select(slice(20, 40))).seen == 40


def test_recorded_runs_are_known_again(runs, held, tmp_path):
    first = log(tmp_path, held, name="day1.npz")
    claim = pj.learning.bound_error(NET, first, None, train=runs, **ONE_BIN)
    other = log(tmp_path, held, name="copy.npz")
    for again in (other.select(slice(3, 4)), first):
        with pytest.raises(pj.InputError, match="its calibration runs"):
            pj.monitor(claim, NET).observe(again)
        with pytest.raises(pj.InputError, match="are its calibration runs"):
            pj.learning.update(claim, NET, runs, again, bins=(1, 1))


def test_halves_that_changed_places_are_refused(runs, tmp_path):
    """K was fitted to the one, and the other was cut to it."""
    train, rest = log(tmp_path, runs, domain=False).split(0.5)
    with pytest.raises(pj.InputError, match=r"Pass the halves of split\(\) in its order"):
        pj.learning.bound_error(NET, train, None, train=rest, **ONE_BIN)
    with pytest.raises(pj.InputError, match="a K that these runs had no part in"):
        calibrate(NET, train, training_profile(NET, train, (1, 1)), eps=0.5)
    less, more = train.split(0.5)  # K is fitted again, to what is left
    claim = pj.learning.bound_error(NET, more, None, train=less, **ONE_BIN)
    assert (claim.domain.lo == less.k.min(axis=0)).all() and claim.n <= more.n


def test_an_update_is_of_the_same_kind_and_of_new_runs(held, runs):
    declared = SpeedBound((2.0, 4.0))
    asked = {"eps": 0.5, "delta": 0.1, "intersample": declared, "claims": ("bins",)}
    old = pj.learning.bound_error(NET, held, None, train=runs, bins=(4, 2), blocks=(2, 1), **asked)
    with pytest.raises(pj.InputError, match="100 of 100 are its calibration runs"):
        pj.learning.update(old, NET, runs, held)
    fresh = pj.learning.collect(plant(noisy), jax.random.PRNGKey(3), 100, Stage.BOUND, quiet=True)
    _, new = pj.learning.update(old, NET, runs, fresh)
    assert new.tube.grid == (4, 2) and len(new.evidence["blocks"]) == 2
    assert new.intersample == old.intersample and any("speed <= (2.0" in x for x in new.assumptions)


def test_a_file_that_says_its_time_and_K_is_not_told_others(runs, tmp_path):
    path = save_rollouts(tmp_path / "own.npz", runs)
    assert pj.load_rollouts(path, runs.time, runs.domain).n == 100
    for wrong in ({"time": pj.learning.time_grid(0.5, 2.0)}, {"domain": pj.box([0, 0], [9, 9])}):
        with pytest.raises(
            pj.InputError, match=rf"expected no {next(iter(wrong))}: a file of save_rollouts"
        ):
            pj.load_rollouts(path, **wrong)


def test_names_of_recordings_do_not_slip_by_a_row(runs, tmp_path):
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", runs.k[:6], delimiter=",")
    for i, track in enumerate(runs.p[:6]):
        np.savetxt(tmp_path / "p" / f"{i:03d}.csv", track, delimiter=",")
    told = {"a\na\nb\nb\nc\nc\n": True, "Recording\na\na\nb\nb\nc\nc\n\n": True}
    told |= {
        "group\na\n\nb\nb\nc\nc": False,
        "group\na\nb\nb\nc\nc": False,
        "a\na\nb\nb\nc\nc\nd": False,
    }
    for text, good in told.items():
        (tmp_path / "groups.csv").write_text(text)
        if good:
            groups = pj.load_rollouts(tmp_path, runs.time, runs.domain).groups
            assert groups[0] == groups[1] != groups[2] == groups[3] != groups[4] == groups[5]
            continue
        with pytest.raises(pj.InputError, match=r"a name for each of 6 rows of k.csv, a line each"):
            pj.load_rollouts(tmp_path, runs.time, runs.domain)
    # with the number of its row each run was a recording of its own
    for text in (",group\n0,a\n1,a\n2,b\n3,b\n4,c\n5,c", "0,a\n1,a\n2,b\n3,b\n4,c\n5,c"):
        (tmp_path / "groups.csv").write_text(text)
        with pytest.raises(pj.InputError, match=r"groups.csv: expected (one column|a name for)"):
            pj.load_rollouts(tmp_path, runs.time, runs.domain)


def test_no_parameter_of_a_system_reads_as_a_fitted_K(runs):
    class Gain:
        name, law, domain, plant = "gain", {"K": 2.5, "box of k": "N"}, runs.domain, None

    law = law_of(Gain)
    assert law.fitted is None and law.box == "K" and "K = 2.5, box of k = N" in law.describe()
    Gain.law = {"parc_jax:K": "the smallest box of these runs"}
    with pytest.raises(pj.InputError, match="Rename them"):
        law_of(Gain)


def test_what_was_settled_before_the_runs_is_assumed(held, runs):
    """Nobody sees that the same runs were looked at before, by another claim or by a profile."""
    profile = training_profile(NET, held, (1, 1))
    about = {"eps": 0.2, "delta": 0.1, "quiet": True}
    for options in ({"train": runs, "bins": (1, 1)}, {"train": runs, "profile": profile}):
        said = pj.learning.bound_error(NET, held, None, **options, **about).details()
        assert "UNSEEN(1 look; network, profile, eps and discards were settled before th" in said
    two = {"train": runs, "bins": (1, 1), "looks": 2}
    said = pj.learning.bound_error(NET, held, None, **two, **about).details()
    assert "UNSEEN(2 looks; network" in said and "delta is shared by 2 looks" in said


@pytest.mark.parametrize("cut", [slice(60), slice(40, None)])
def test_runs_that_are_cut_off_at_an_end_are_counted(cut, held, runs, tmp_path):
    """Who stops at the first run that fails has left out what came after."""
    for whole in (held, log(tmp_path, held)):
        path = save_rollouts(tmp_path / "cut.npz", whole.select(cut))
        for some in (whole.select(cut), pj.load_rollouts(path)):
            claim = pj.learning.bound_error(NET, some, None, train=runs, **ONE_BIN)
            assert (
                claim.n == 60
                and "Before that 40 rows beside theirs had been left" in claim.details()
            )
        less, more = whole.select(cut).split(0.5)
        assert (
            "Before that 40 rows"
            in pj.learning.bound_error(NET, more, None, train=less, **ONE_BIN).details()
        )


def test_a_part_of_a_list_of_k_names_that_part(held):
    """A sorted sweep: the tube of its calm half said to be about all of it."""
    sweep = np.stack([np.linspace(0, 1, 200), np.full(200, 0.5)], axis=1)
    whole = pj.learning.collect(plant(noisy), KEY, 200, k=sweep, quiet=True)
    halves = [whole.select(part) for part in (slice(100), slice(100, 200))]
    for train, calm in (halves, halves[::-1], whole.split(0.5)):
        claim = pj.learning.bound_error(NET, calm, None, train=train, **ONE_BIN)
        assert claim.law == law_of(plant(noisy), k_law(plant(noisy), calm.k)) != whole.law
        assert f"For k drawn {claim.law.how_drawn}" in claim.details()
        again = pj.learning.collect(plant(noisy), jax.random.PRNGKey(5), 200, k=sweep, quiet=True)
        for others in (again, again.select(slice(50))):
            with pytest.raises(pj.InputError, match=r"got k as given \(\d+ values, .*Declare it"):
                pj.monitor(claim, NET).observe(others)
        key = jax.random.PRNGKey(6)
        same = pj.learning.collect(plant(noisy), key, calm.n, k=calm.k, quiet=True)
        assert pj.monitor(claim, NET).observe(same).seen == calm.n
    # joined again they are the whole
    claim = pj.learning.bound_error(NET, concatenate(halves), None, train=held, **ONE_BIN)
    assert claim.law == whole.law
