"""Sets that recorded runs validate: what held-out recordings show, and what they may not be."""

import dataclasses
from fractions import Fraction
from types import SimpleNamespace

import jax
import numpy as np
import pytest
import toy_driven as toy
from scipy.stats import binom
from scored import score_batch
from synthetic_plants import plant

import parc_jax as pj
from parc_jax.app.files.answer_file import load_answer
from parc_jax.checker import check_answer, load, summary
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import box
from parc_jax.drive.local import nested, trials, validate
from parc_jax.drive.local.nested import fixed_sequence, nested_sets
from parc_jax.drive.local.validation import Validate
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.claim import derived, scene_claim
from parc_jax.learning.bound.counts import RECORDED_IDS
from parc_jax.learning.bound.fresh import left_out_beside, named_runs
from parc_jax.learning.learn import learn
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.law import FITTED, TO_ALL, TO_TRAINING, law_spec
from parc_jax.problem.robust.nominal import query
from parc_jax.safe_set.corridors import safe_plans
from parc_jax.safe_set.verdict.outcomes import reached_and_touched

pytestmark = pytest.mark.soundness

KEY = jax.random.PRNGKey(5)
K = box([0.0, 0.0], [1.0, 1.0])
TIME = plant(toy.gusty, toy.T).time
GUST = 0.12  # [m] at the end, times k_0
RISK, DELTA = 0.1, 0.1
SCENE = toy.problem(0.62)
REPEATS, N = 300, 60


def recorded(n, seed, windows=1, named=None, slips=0.0):
    """n recordings of a straight robot and a gust, which all windows of one have in common; and so
    many of them in which it slips far.
    """
    rng = np.random.default_rng(seed)
    gust = rng.uniform(-1, 1, (n, 2)) + 9 * (rng.uniform(size=(n, 1)) < slips)
    gust = np.repeat(gust, windows, axis=0)
    k = rng.uniform(0, 1, (n * windows, 2))
    s = np.linspace(0, 1, TIME.n_record + 1)[None, :, None]
    p = s * k[:, None] + s**2 * GUST * k[:, None, :1] * gust[:, None]
    groups = None if named is None else [f"{named}{i // windows}" for i in range(len(k))]
    law = law_spec("file:toy", K, "logged")
    return rollout_batch(k, p, k[:, :1], time=TIME, domain=K, law=law, groups=groups)


@pytest.fixture(scope="module")
def model():
    """A network and its claim, from recordings."""
    known, held = recorded(60, 1), recorded(N, 2)
    options = {"hidden": (4,), "seeds": 1, "steps": 400, "bins": (1, 1), "delta": 0.05}
    return learn(known, KEY, holdout=held, quiet=True, **options)


@pytest.fixture(scope="module")
def answer(model):
    asked = Validate(recorded(N, 2), RISK, DELTA)
    return pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=asked)


@pytest.fixture(scope="module")
def sets(model):
    """Nested sets, and the risk of each for 6,000 recordings drawn anew."""
    asked = Validate(recorded(N, 2), RISK, DELTA, scales=(1.0, 0.6, 0.45, 0.3, 0.1))
    rng = np.random.default_rng(7)
    found = nested_sets(query(SCENE, model), KEY, rng, toy.SETTINGS, asked)
    return SimpleNamespace(asked=asked, all=found, risk=[risk_of(one, rng) for one in found])


def risk_of(one, rng, slips=0.0, n=6000):
    """Share of failures of new recordings, from a start drawn for each in this set alone."""
    runs = recorded(n, int(rng.integers(1 << 30)), slips=slips)
    starts = one.starts(rng, runs.k) if len(one.corridors) else []
    rows = np.array([i for i, p0 in enumerate(starts) if len(p0)], int)
    if not len(rows):
        return 0.0
    reached, touched = reached_and_touched(
        one.scene, runs.select(rows), np.array([starts[i][0] for i in rows])
    )
    return float((~reached | touched).mean())


def wrong_ones(sets, tested):
    """How often, of REPEATS logs, a set is accepted whose risk is above the one asked for.
    tested: (log's number, generator) -> Trial.
    """
    wrong = 0
    for i in range(REPEATS):
        trial = tested(i, np.random.default_rng((11, i)))
        _, passed = fixed_sequence(sets.asked, trial.inside, trial.failed, 1)
        wrong += passed > 0 and sets.risk[passed] > RISK
    return wrong


MOST = binom.ppf(0.999, REPEATS, DELTA)


@pytest.fixture
def fewer_ends(monkeypatch):
    """Starts are looked for among fewer ends, for time."""
    monkeypatch.setattr(safe_plans, "ENDS", 40)


def test_the_sentence_is_false_as_rarely_as_it_says(sets, fewer_ends):
    assert sets.risk[1] < RISK < max(sets.risk)  # there is something to accept, and to refuse

    def tested(i, rng):
        return trials.by_recordings(recorded(N, (3, i)), sets.all, rng, 1)

    assert wrong_ones(sets, tested) <= MOST


@pytest.mark.night
def test_windows_of_one_recording_counted_several_times_are_noticed(sets, fewer_ends):
    risk = [risk_of(one, np.random.default_rng(3), slips=0.06) for one in sets.all]
    some = SimpleNamespace(asked=sets.asked, all=sets.all, risk=risk)

    def tested(windows):
        def one(i, rng):
            runs = recorded(N // windows, (4, i), windows, slips=0.06)
            return trials.by_recordings(runs, sets.all, rng, 1)

        return one

    assert wrong_ones(some, tested(1)) <= MOST < wrong_ones(some, tested(12))


def test_starts_of_another_law_are_noticed(sets, fewer_ends, monkeypatch):
    def central(scene, rng, k, real=nested.starts_of_ends):
        p0 = real(scene, rng, k)  # with most room first
        off = np.abs(p0 + k[:, None] - [0.5, 0.45]).max(axis=2)
        return np.take_along_axis(p0, off.argsort(axis=1)[..., None], axis=1)

    monkeypatch.setattr(nested, "starts_of_ends", central)

    def tested(i, rng):
        return trials.by_recordings(recorded(N, (5, i)), sets.all, rng, 1)

    assert wrong_ones(sets, tested) > MOST


def test_new_recordings_fail_as_rarely_as_the_sentence_says(answer):
    wide = answer.validation.answer
    rng = np.random.default_rng(9)
    assert risk_of(wide._plans, rng) <= RISK
    assert wide.risk().bound == pytest.approx(RISK)
    assert wide.share.at_least > 1.2 * (answer.share.at_most if answer.share else 0.0)


def test_the_sentence_names_its_recordings_its_law_and_its_premises(answer, tmp_path):
    wide, step = answer.validation.answer, answer.validation.steps[-1]
    said = answer.validation.details()
    claim = wide.model.claim
    assert "whose k is that of a new recording for which this set" in said and "k as logged" in said
    assert f"{claim.n:,} of {N} held-out recordings (" in said and step.n >= claim.n
    assert "ORDER_OF_K(that of the model; not all have names)" in said
    path = wide.save(tmp_path / "validated.json")
    printed = list(summary(check_answer(load(path))))
    assert f"  checked  n: {claim.n} recordings" in printed
    assert f"  measured law: {claim.quantifier}" in [
        line.replace("assumed ", "measured") for line in printed
    ]
    assert claim.evidence["recordings"][:12] in said and len(claim.evidence["tested"]) == N
    assert (
        "UNSEEN(1 look; network, K, error shape" in said
        and "TRANSLATION_INVARIANCE(within 1e-05" in said
    )
    assert (
        "k of one run, drawn from a new recording's with k in K, from a start drawn for it, fails"
        in answer.validation.summary()
    )
    header = pj.exchange.write_c(answer, tmp_path / "own.h").read_text()
    assert "(V)" in answer.details() and "(V)" not in header  # whose tables are of another set
    again = load_answer(wide.save(tmp_path / "validated.json"))
    assert again.model.claim.hash == claim.hash and again.risk() == wide.risk()
    with pytest.raises(InputError, match="draw one run of each new one"):
        again.sample(KEY, 3)


def test_of_one_start_the_sentence_names_it_and_tells_of_no_drawn_ones(model, tmp_path):
    """From each of which the same k would end elsewhere."""
    asked = Validate(recorded(2000, 6), RISK, DELTA, scales=(1.0, 0.8))
    at, k = np.array([-0.25, 0.0]), "whose k is that of a new recording for which this set has"
    found = pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=asked, at=at).validation
    said = f"a plan from (-0.25, 0) m in the scene's frame {k} such a plan, run in this scene by"
    path = found.answer.save(tmp_path / "validated.json")
    known = load_answer(path).model.claim.quantifier
    assert known.startswith(f"{said} file:toy (k as logged") and known in found.details()
    printed = list(summary(check_answer(load(path))))
    assert f"  assumed  law: {known}" in printed
    assert "this start, fails" in found.summary() and "400" not in found.details()
    assert "from this start, fails" in found.answer.summary()


def test_of_recordings_of_several_runs_it_is_said_that_one_is_drawn_from_each(model, tmp_path):
    """Of recordings of 8 runs, of which 1 in 25 goes astray, 1 in 4 has such a plan that fails."""
    runs = recorded(N, 18, windows=4, named="drive ")
    found = pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=Validate(runs, RISK, DELTA))
    wide, one = (
        found.validation.answer,
        "(k as logged, runs = one drawn from those of each recording with k in K; ",
    )
    path = wide.save(tmp_path / "validated.json")
    again = load_answer(path)
    printed = [line for line in summary(check_answer(load(path))) if " law: " in line]
    for said in (found.validation.details(), again.details(), *printed, found.summary()):
        assert one in said
    assert len(printed) == 1 and again.model.claim.law.cut == runs.law.cut
    assert not trials.one_of_each(model, recorded(N, 18), np.random.default_rng(0)).law.parameters


def test_a_model_of_a_log_keeps_its_recordings_and_plans_by_them(model, tmp_path):
    again = pj.load(model.save(tmp_path / "model.npz"))
    assert np.array_equal(again.held.hashes(), recorded(N, 2).hashes())
    found = pj.Planner(again).solve(SCENE, KEY, toy.SETTINGS)
    claim = found.validation.answer.model.claim
    assert (claim.eps, claim.delta) == (Fraction(15, 100), Fraction(5, 100))
    assert "fails in its 1 s with probability at most 0.15, confidence 0.95" in found.summary()
    assert risk_of(found.validation.answer._plans, np.random.default_rng(4)) <= 0.15
    # asked again it is the same look, whatever the key
    other = pj.Planner(again).solve(SCENE, jax.random.PRNGKey(9), toy.SETTINGS)
    assert other.validation.steps == found.validation.steps
    assert other.validation.answer.model.claim.hash == claim.hash


def test_a_model_with_other_labels_keeps_its_recordings_under_them(model, tmp_path):
    """They had the old names, and tested nothing by default."""
    named = model.with_labels({"k": ("ahead [m/s]", "left [m/s]")})
    renamed = named.with_labels({"k": ("v [m/s]", "left [m/s]")})
    again = pj.load(renamed.save(tmp_path / "model.npz"))
    assert again.labels == again.held.labels and again.labels.k[0] == "v [m/s]"
    found = pj.Planner(again).solve(SCENE, KEY, toy.SETTINGS)
    assert found.validation.answer.model.claim.eps == Fraction(15, 100)
    assert trials.one_of_each(again, again.held, np.random.default_rng(0)).n == N
    with pytest.raises(InputError, match="by its labels, all of them as they were; got others"):
        renamed.replace(held=named.held).save(tmp_path / "mixed.npz")
    # what its tests assume about the law has a name as the other assumptions do
    for told in (found.summary(), found.validation.answer.summary()):
        listed = told.partition("assumptions): ")[2].split(".\n")[0].rstrip(".").split(", ")
        assert "LAW" in listed and "law" not in listed


@pytest.fixture
def nothing_tested(monkeypatch):
    """As in a process of its own: no recordings tested anything yet."""
    monkeypatch.setattr(validate, "_TESTS", [])


def test_scenes_that_recordings_tested_before_are_told(model, nothing_tested):
    """Each was tested with all of delta, and said nothing of the others."""
    planner = pj.Planner(model)

    def said(x, key=KEY, **how):
        return planner.solve(toy.problem(x), key, toy.SETTINGS, **how).validation.details()

    first, second, third = map(said, (0.62, 0.61, 0.63))
    assert "LOOK(" not in first and "LOOK(after 1 look of another delta, 0.05)" in second
    assert "LOOK(after 2 looks of another delta, 0.05)" in third
    assert (said(0.61), said(0.62)) == (second, first)  # the same tests: no others
    # whether they were named or came by default, whatever the key
    assert "after 3 looks of another delta, 0.05" in said(0.61, validate=Validate(model.held))
    told = said(0.61, jax.random.PRNGKey(9), validate=Validate(model.held))
    assert "after 4 looks of another delta, 0.05" in told
    # otherwise tested, by some of them
    some = model.held.select(slice(0, model.held.n - 1))
    told = said(0.62, validate=Validate(some, risk=0.2, delta=0.1))
    assert "after 5 looks of another delta, 0.05" in told
    # and sets of another model: else one trains until a set passes
    again = derived(model.claim, evidence={"updated_from": "another"})
    planner = pj.Planner(model.replace(claim=again))
    assert "after 5 looks of another delta, 0.05; after 1 look of another delta, 0.1" in said(0.62)


def test_recordings_are_not_used_where_they_show_no_more(model):
    few = model.held.select(slice(0, 18))
    few = model.replace(
        claim=derived(model.claim, evidence=named_runs(score_batch(model.net, few, model.tube))),
        held=few,
    )
    uncertain = SCENE.replace(uncertainty=pj.Uncertainty(start=(0.001, 0.001)))
    for one, scene in ((few, SCENE), (model.replace(held=None), SCENE), (model, uncertain)):
        assert pj.Planner(one).solve(scene, KEY, toy.SETTINGS).validation is None
    quick = toy.SETTINGS.replace(samples_only=True)
    assert pj.Planner(model).solve(SCENE, KEY, quick).validation is None
    even = {"eps": Fraction(1, 50), "law": dataclasses.replace(model.claim.law, k_law="uniform")}
    sharp = model.replace(claim=derived(model.claim, **even))
    answer = pj.Planner(sharp).solve(toy.problem(5.0), KEY, toy.SETTINGS)
    assert answer.risk().bound <= 0.15 and answer.validation is None


def test_a_model_keeps_no_recordings_but_those_of_its_claim(model):
    with pytest.raises(InputError, match="recordings that its claim held out"):
        pj.Planner(model.replace(held=recorded(N, 3)))


@pytest.fixture(scope="module")
def slipped():
    """A model of a log some of whose recordings failed, and all of those that it held out."""
    log = recorded(N, 41, windows=2, named="drive ")
    p = np.array(log.p)
    p[np.random.default_rng(3).uniform(size=log.n) < 0.2, -3:] = np.nan
    known, held = dataclasses.replace(log, p=p).split(0.5)
    options = {"hidden": (4,), "seeds": 1, "steps": 400, "bins": (1, 1), "delta": 0.05, "eps": 0.9}
    return learn(known, KEY, holdout=held, quiet=True, **options)


def test_kept_recordings_are_all_of_those_of_the_claim_as_they_were(slipped, tmp_path):
    held, rows = slipped.held, np.arange(slipped.held.n)
    assert held.failed.any() and pj.load(slipped.save(tmp_path / "model.npz")).held.n == held.n
    pj.Planner(slipped.replace(held=held.select(rows[::-1])))  # in any order
    others = [
        held.finite,
        held.select(rows[:-1]),
        dataclasses.replace(held, groups=rows),  # each window a recording of its own
        dataclasses.replace(held, groups=np.roll(held.groups, 1)),
        dataclasses.replace(held, rows=rows, source=None),  # of a log without gaps
        dataclasses.replace(held, rows=held.rows + 1),
        dataclasses.replace(held, source=None),
        dataclasses.replace(held, lost=-np.ones(held.n, int)),
    ]
    for one in others:
        with pytest.raises(InputError, match="all of them as they were; got others"):
            pj.Planner(slipped.replace(held=one))
    with np.load(tmp_path / "model.npz") as file:
        kept = dict(file)
    long = [
        name for name in kept if name.startswith("held_") and kept[name].shape[:1] == rows.shape
    ]
    kept |= {name: kept[name][~held.failed] for name in long}
    np.savez(tmp_path / "edited.npz", **kept)
    with pytest.raises(InputError, match="holds other rollouts than were made"):
        pj.load(tmp_path / "edited.npz")


def test_a_model_keeps_recordings_of_which_none_was_lost(tmp_path):
    """The other half of a log had one: the file of the model was refused when it was read."""
    runs = recorded(60 + N, 5).replace(lost=(np.arange(60 + N) == 0).astype(int))
    train, held = runs.select(slice(60)), runs.select(slice(60, None))
    options = {"hidden": (4,), "seeds": 1, "steps": 10, "bins": (1, 1), "delta": 0.05}
    model = learn(train, KEY, holdout=held, quiet=True, **options)
    assert pj.load(model.save(tmp_path / "model.npz")).held.lost is None


def test_recordings_that_a_file_leaves_out_are_counted_by_content(slipped, tmp_path):
    """Finite recordings written to a file of their own, which has no gap."""
    fit = slipped.held.finite
    again = rollout_batch(
        fit.k, fit.p, fit.q, time=TIME, domain=K, law=law_spec("file:b", K, "logged")
    )
    gone = int(slipped.held.failed.sum())
    assert left_out_beside(slipped.claim, again) == gone > 0
    assert left_out_beside(slipped.claim, recorded(N, 6)) == 0  # new ones


def test_rows_left_out_of_a_calibration_set_are_assumed_to_be_any(slipped):
    net, profile = slipped.net, slipped.tube
    some = slipped.held.select(~slipped.held.failed)
    claim = calibrate(net, some, profile, eps=0.9, delta=0.05)
    gone = claim.evidence["left_out"]
    said = f"LEFT_OUT({gone:,} of their log, with k outside of K, or independent of k and run)"
    assert gone >= slipped.held.failed.sum() and said in claim.assumptions
    assert said in claim.details().partition("Assumes")[2]


def test_a_summary_tells_of_its_own_tests_and_no_others(answer, model):
    other = dataclasses.replace(answer.validation, asked=Validate(recorded(400, 3), 0.05, 0.05))
    assert other.summary() == answer.validation.summary()
    assert "from a start that `starts` draws, fails" in answer.validation.answer.summary()
    elsewhere = pj.Planner(model).solve(toy.problem(5.0), KEY, toy.SETTINGS)
    with pytest.raises(InputError, match="a validation of this very query"):
        dataclasses.replace(elsewhere, validation=answer.validation)


def test_starts_are_uniform_on_those_of_a_set(answer):
    wide = answer.validation.answer
    for odd in (None, {0.5}):
        with pytest.raises(InputError, match="starts"):
            wide.starts(KEY, odd)
    assert len(wide.starts(KEY, [0.5, 0.5])) == 1  # one plan's
    k = np.full((400, 2), 0.5)
    starts = np.array([p0[0] for p0 in wide.starts(KEY, k)])
    assert wide.contains(starts, k).all()
    lo, hi = starts.min(axis=0), starts.max(axis=0)
    grid = np.random.default_rng(2).uniform(lo - 0.1, hi + 0.1, (20_000, 2))
    truth = grid[wide.contains(grid, np.full((20_000, 2), 0.5))]
    spread = truth.std(axis=0) / np.sqrt(400)
    assert (np.abs(starts.mean(axis=0) - truth.mean(axis=0)) < 4 * spread).all()
    assert [len(p0) for p0 in wide.starts(KEY, [[5.0, 5.0]])] == [0]


def test_sets_hold_more_recordings_each(sets):
    trial = trials.by_recordings(recorded(N, 8), sets.all, np.random.default_rng(1), 1)
    assert (np.diff(trial.inside.astype(int), axis=0) >= 0).all()
    assert trial.failed.any() and not (trial.failed & ~trial.inside).any()


def test_a_recording_counts_once(model):
    runs = recorded(30, 12, windows=4, named="drive ")
    one = trials.one_of_each(model, runs, np.random.default_rng(0))
    assert one.n == Validate(runs).tests == len(np.unique(one.groups)) == 30
    assert len({i % 4 for i in one.rows}) > 1  # whichever window


def test_of_a_recording_a_run_with_k_in_K_is_drawn_as_is_said(model):
    """ "one drawn from each recording", of those that K had left, which others have more of."""
    lean, rich = recorded(N, 43, windows=4, named="lean "), recorded(N, 44, named="rich ")
    k = np.concatenate([lean.k, rich.k])
    k[: 4 * N][np.arange(4 * N) % 4 != 2] += 1.0  # of these one window in four is in K
    k[0:4] = 1.5  # and none of the first one
    p, q = (np.concatenate([getattr(x, name) for x in (lean, rich)]) for name in ("p", "q"))
    groups = [
        f"{'lean' if i < N else 'rich'} {i}" for i in [*np.arange(4 * N) // 4, *range(N, 2 * N)]
    ]
    large = box([-1.0] * 2, [2.0] * 2)
    law = law_spec("file:toy", large, "logged")
    log = rollout_batch(k, p, q, time=TIME, domain=large, law=law, groups=groups)
    for runs in (log, log.select(K.contains(log.k))):
        one = trials.one_of_each(model, runs, np.random.default_rng(0))
        inside = K.contains(one.k)
        assert (one.n, inside.sum()) == (runs.recordings, 2 * N - 1)
        # where K left one of each it says no less
        assert "runs = one drawn from those of each recording with k in K" in one.law.describe()
        assert one.law.cut == runs.law.cut


def test_a_recording_with_nan_has_failed(sets):
    runs = recorded(N, 13)
    p = np.array(runs.p)
    p[:5, -3:] = np.nan
    runs = dataclasses.replace(runs, p=p)
    trial = trials.by_recordings(runs, sets.all, np.random.default_rng(1), 1)
    assert np.array_equal(trial.failed[-1, :5], trial.inside[-1, :5]) and trial.inside[-1, :5].any()


def other(**changes):
    return dataclasses.replace(recorded(N, 14), **changes)


@pytest.mark.parametrize(
    ("runs", "words"),
    [
        (lambda: recorded(N, 1).select(slice(0, 40)), "40 of 40 runs they have"),
        (lambda: other(time=pj.learning.time_grid(0.5, 2.0, 0.1)), r"agree; time is .*, beside "),
        (lambda: other(points=("nose",)), "agree; points is .*, beside nose"),
        (lambda: recorded(N, 14).select(np.arange(N) // 2), "30 of 60 runs occur twice"),
        (lambda: other(seed=(0, 1), stage=1), "collected with a key"),
    ],
)
def test_recordings_that_do_not_fit_are_refused(model, runs, words):
    asked = Validate(runs())
    with pytest.raises(InputError, match=words):
        pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=asked)


def test_windows_of_a_recording_that_training_saw_are_refused():
    options = {"hidden": (4,), "seeds": 1, "steps": 50, "bins": (1, 1), "delta": 0.05}
    runs = recorded(60, 15, windows=2, named="drive ")
    first = runs.select(np.arange(60))
    model = learn(first, KEY, holdout=recorded(N, 16, named="else "), quiet=True, **options)
    rest = runs.select(np.arange(58, 120))
    with pytest.raises(InputError, match="2 of 62 runs they have"):
        trials.one_of_each(model, rest, np.random.default_rng(0))
    assert (
        trials.one_of_each(model, runs.select(np.arange(60, 120)), np.random.default_rng(0)).n == 30
    )


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Validate(recorded(18, 1)), "at least 19 recordings"),
        (lambda: Validate(recorded(60, 1), tests=30), "each of which is one test"),
        (
            lambda: (
                recorded(3, 1)
                and rollout_batch(
                    [[np.nan, 0.0]],
                    np.zeros((1, 21, 2)),
                    [[0.0]],
                    time=TIME,
                    domain=K,
                    law=law_spec("file:toy", K, "logged"),
                )
            ),
            "whose command is not known",
        ),
    ],
)
def test_too_few_recordings_or_none_of_k_are_said(make, words):
    with pytest.raises(InputError, match=words):
        make()


def refused(model, runs, words):
    with pytest.raises(InputError, match=words):
        trials.one_of_each(model, runs, np.random.default_rng(0))


def test_copies_of_training_recordings_are_refused(model):
    known, rng = recorded(60, 1), np.random.default_rng(0)
    noise = 1 + 1e-6 * rng.standard_normal(known.p.shape)
    for changes in ({"p": known.p * noise}, {"k": known.k + 1e-12 * (known.k < 0.5)}):
        refused(model, dataclasses.replace(known, **changes), "60 of 60 runs they have")


def test_recordings_that_cannot_be_told_from_those_of_training_are_refused():
    options = {"hidden": (4,), "seeds": 1, "steps": 50, "bins": (1, 1), "delta": 0.05}
    runs = recorded(60, 15, windows=2, named="drive ")
    first, second = (runs.select(np.arange(i, 120, 2)) for i in range(2))
    model = learn(first, KEY, holdout=recorded(N, 16, named="else "), quiet=True, **options)
    for groups in (None, np.arange(60)):
        refused(
            model, dataclasses.replace(second, groups=groups), "told from .*names in groups.csv"
        )
    numbered = dataclasses.replace(runs, groups=np.arange(120) // 2)
    train, rest = numbered.split(0.5)
    model = dataclasses.replace(model, claim=pj.learning.assumed_claim(model.net, train))
    assert trials.one_of_each(model, rest, np.random.default_rng(0)).n == 30


def test_training_that_is_not_recorded_is_assumed_to_differ(model):
    known = recorded(60, 1)
    model = model.replace(held=None)
    tube = model.replace(claim=pj.learning.assumed_claim(model.net, known))
    refused(tube, known, "60 of 60 runs they have")
    unknown = pj.learning.declared_claim(model.tube, "it holds", model.net, TIME)
    asked = Validate(recorded(N, 2), RISK, DELTA)
    said = pj.Planner(model.replace(claim=unknown)).solve(SCENE, KEY, toy.SETTINGS, validate=asked)
    whose = "none is a profile or training run of the claim, whose network does not say what it was"
    assert f"FRESH({whose} trained on)" in said.validation.details()


@pytest.mark.parametrize("kind", ["assumed", "pac"])
def test_of_training_by_a_seed_recordings_are_assumed_to_hold_no_copy(kind):
    """Its very runs, in a file of six digits, tested its sets, and nothing was said of them."""
    system, kinds = plant(toy.gusty, toy.T), "training"
    train = pj.learning.collect(system, KEY, 300, quiet=True)
    net = pj.learning.train(train, hidden=(4,), key=KEY, seeds=1, steps=400)
    claim = pj.learning.assumed_claim(net, train)
    if kind == "pac":
        held = pj.learning.collect(system, KEY, 300, Stage.BOUND, quiet=True)
        about = {"eps": 0.05, "delta": 0.05, "bins": (1, 1)}
        claim = pj.learning.bound_error(net, held, None, train=train, **about)
        kinds = "calibration or training"
    rows = np.argsort(train.k[:, 0])[:100]  # not all of the marked ones
    runs = [np.round(x[rows].astype(float), 6) for x in (train.k, train.p, train.q)]
    law = law_spec("file:toy", train.domain, "logged")
    log = rollout_batch(*runs, time=train.time, domain=train.domain, law=law)
    planner = pj.Planner(pj.learning.trajectory_model(net, claim))
    said = planner.solve(SCENE, KEY, toy.SETTINGS, validate=Validate(log, RISK, DELTA)).validation
    told = f"FRESH(none is a {kinds} run of the claim beside 128 of each part of these, compared by"
    assert told in said.answer.details()


def test_parameters_in_another_order_or_not_chosen_are_refused(model):
    def named(*k):
        return model.claim.subject.with_labels({"k": k}).labels

    told = dataclasses.replace(
        model.claim, subject=model.claim.subject.with_labels({"k": ("a", "b")})
    )
    swapped = dataclasses.replace(recorded(N, 14), labels=named("b", "a"))
    refused(model.replace(claim=told), swapped, "parameters is a, b, beside b, a")
    some = trials.one_of_each(model, swapped, np.random.default_rng(0))
    assert model.claim.subject.unordered(some.subject)  # the model's own have no names
    assert not told.subject.unordered(swapped.subject)
    refused(model, dataclasses.replace(recorded(N, 14), given=(0,)), "given is none, beside 0")


def test_recordings_that_were_made_again_are_said(sets):
    runs = dataclasses.replace(recorded(N, 8), lost=np.full(N, 3))
    trial = trials.by_recordings(runs, sets.all, np.random.default_rng(1), 1)
    assert trial.lost.sum() == 3 * N


def test_recordings_that_were_left_out_are_said(model):
    wild = recorded(100, 77)
    p = np.array(wild.p)
    p[:40, -3:] = np.nan
    finite = dataclasses.replace(wild, p=p).finite
    refused(model, finite, "leaves the tube; got runs without, of `finite`")
    asked = Validate(wild.select(slice(40, None)), RISK, DELTA)
    found = pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=asked).validation
    assert (
        "LEFT_OUT(40 of their log, with k outside of K, or independent of k and run)"
        in found.details()
    )
    assert found.answer.model.claim.premises["left out"] == 40


def test_no_start_is_told_to_have_been_tried_by_recordings(model):
    """Of a claim whose own trial was made in a simulator."""
    start = model.claim.evidence["start"] | {"seen": "0x0.0p+0"}
    told = [x.replace("not measured", "0 seen from 8 starts") for x in model.claim.assumptions]
    claim = derived(model.claim, evidence={"start": start}, assumptions=tuple(told))
    asked = Validate(recorded(N, 2), RISK, DELTA)
    planner = pj.Planner(model.replace(claim=claim, held=None))
    found = planner.solve(SCENE, KEY, toy.SETTINGS, validate=asked).validation
    assert "TRANSLATION_INVARIANCE(within 1e-05; not measured)" in found.details()
    assert found.answer.model.claim.premises  # its numbers are those of the evidence


def test_rows_of_training_and_calibration_are_not_left_out():
    log = recorded(3 * N + 4, 77)
    options = {"hidden": (4,), "seeds": 1, "steps": 400, "bins": (1, 1), "delta": 0.05}
    known, held = (log.select(slice(i * N, (i + 1) * N)) for i in range(2))
    model = learn(known, KEY, holdout=held, quiet=True, **options)
    assert left_out_beside(model.claim, log.select(slice(2 * N, None))) == 0
    assert left_out_beside(model.claim, recorded(N + 4, 78).select(slice(N))) == 4
    # of the calibration runs themselves, which may test too, none vanishes
    for tested, gone in ((held, N + 4), (held.select(slice(20, None)), N + 24)):
        assert left_out_beside(model.claim, tested) == gone
    asked = Validate(log.select(slice(2 * N + 4, None)), RISK, DELTA)
    found = pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=asked).validation
    assert "LEFT_OUT(4 of their log" in found.details()


@pytest.mark.parametrize(
    ("lo", "hi", "words"), [(0.3, 0.7, "(k as logged; "), (-1.0, 2.0, ", of which K is a part; ")]
)
def test_the_law_of_recordings_says_nothing_false_of_another_k(model, lo, hi, words):
    law = law_spec("file:day", box([lo] * 2, [hi] * 2), "logged", {FITTED: TO_ALL})
    shown = {"eps": RISK, "delta": DELTA, "n": 60, "discard": 0, "assumptions": ("IID",)}
    claim = scene_claim(model.claim, model.tube, law, {RECORDED_IDS: []}, **shown)
    assert words in claim.quantifier and "smallest box" not in claim.quantifier


MISSED = (f"{TO_TRAINING}, which 168 of 200 others miss", "as declared, which 168 of 200 miss")


@pytest.mark.parametrize("fitted", [*MISSED, "of a log whose K nobody knows"])
def test_recordings_left_out_by_a_smaller_k_are_refused(model, fitted):
    """By bags that were loaded with it, none of the runs outside failed: they were left out."""
    small, runs = box([0.3, 0.3], [0.7, 0.7]), recorded(200, 14)
    law = law_spec("file:toy", small, "logged", {FITTED: fitted})
    part = dataclasses.replace(runs.select(small.contains(runs.k)), domain=small, law=law)
    refused(model, part, "outside of a smaller box were left out, .* domain=model.domain")


def test_recordings_of_which_none_was_left_out_test_a_wider_k(model):
    """A half wholly inside the smallest box of the other was refused, for runs left out."""
    small, runs = box([0.3, 0.3], [0.7, 0.7]), recorded(200, 14)
    law = law_spec("file:toy", small, "logged", {FITTED: TO_ALL})
    logged = runs.select(small.contains(runs.k)).replace(domain=small, law=law)
    halves = [logged.split(0.2, seed=seed)[1] for seed in range(60)]
    rng, said = np.random.default_rng(0), [half.law.fitted for half in halves]
    inside = halves[said.index(TO_TRAINING)]
    assert trials.one_of_each(model, inside, rng).n == inside.n
    refused(model, halves[[x != TO_TRAINING for x in said].index(True)], "were left out")
    shown = {"eps": RISK, "delta": DELTA, "n": 60, "discard": 0, "assumptions": ("IID",)}
    claim = scene_claim(model.claim, model.tube, inside.law, {RECORDED_IDS: []}, **shown)
    assert "smallest box" not in claim.quantifier  # which the model's K is not


def test_recordings_left_out_by_a_larger_k_are_told(model, tmp_path):
    """No plan has their k, but the sentence is about all recordings of this law."""
    runs, large = recorded(N, 2), box([-1.0] * 2, [2.0] * 2)
    fitted = {FITTED: "as declared, which 7 of 67 commands miss"}
    runs = runs.replace(domain=large, law=law_spec("file:toy", large, "logged", fitted))
    asked = Validate(runs, RISK, DELTA)
    found = pj.Planner(model).solve(SCENE, KEY, toy.SETTINGS, validate=asked).validation
    told = ", of which K is a part, K = as declared, which 7 of 67 commands miss; "
    assert told in found.details()
    check_answer(load(found.answer.save(tmp_path / "validated.json")))
