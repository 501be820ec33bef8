"""One pipeline: Python and the shell promise the same of the same runs, the start included."""

import copy
from fractions import Fraction

import jax
import numpy as np
import pytest
from synthetic_plants import Plant, noisy, plant, straight_network

import parc_jax as pj
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.claim import check_claim
from parc_jax.learning.bound.counts import most_discards
from parc_jax.learning.bound.pipeline import learn_profile, update
from parc_jax.learning.bound.settings import BoundSettings, ModelBound
from parc_jax.learning.learn import Learning, learn_report
from parc_jax.learning.runs.collect import collect

KEY = jax.random.PRNGKey(5)
NET = straight_network(4)
STUDY = Study(
    hidden=(),
    rollouts=80,
    bound=ModelBound(bins=(2, 1), eps=0.1, delta=0.05, profile_runs=50, discard=0, gap=0.02),
)


def test_the_start_is_declared_tried_and_added(tmp_path):
    options = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "profile_runs": 40}
    narrow = pj.learning.bound_error(NET, plant(noisy), KEY, gap=0.0, quiet=True, **options)
    wide = pj.learning.bound_error(NET, plant(noisy), KEY, gap=0.25, quiet=True, **options)
    assert (wide.tube.interval >= narrow.tube.interval + 0.25).all()
    assert (wide.tube.final >= narrow.tube.final + 0.25).all()
    assert "TRANSLATION_INVARIANCE(within 0.25; not measured)" in wide.assumptions
    plain = pj.learning.bound_error(NET, plant(noisy), KEY, quiet=True, **options)
    assert any(a.startswith("TRANSLATION_INVARIANCE(within 1e-05") for a in plain.assumptions)
    held, train = (
        collect(plant(noisy), KEY, 60, s, quiet=True) for s in (Stage.BOUND, Stage.TRAIN)
    )
    logged = pj.learning.bound_error(NET, held, None, eps=0.1, delta=0.05, train=train, gap=0.25)
    assert "TRANSLATION_INVARIANCE(within 0.25; not measured)" in logged.assumptions


def test_options_that_would_change_nothing_are_refused():
    """The same answer came of all runs, as of others that were asked for."""
    held, train = (
        collect(plant(noisy), KEY, 60, s, quiet=True) for s in (Stage.BOUND, Stage.TRAIN)
    )
    log, made = train.replace(seed=None, stage=None), {"eps": 0.2, "delta": 0.1, "train": train}
    asked = pj.learning.bound_error
    tube = asked(NET, held, None, bins=(1, 1), **made).tube
    for call in (
        lambda: asked(NET, held, None, fresh=20, **made),
        lambda: asked(NET, held, None, profile=tube, bins=(2, 2), **made),
        lambda: asked(NET, held, None, BoundSettings(fresh=70), **made),
        lambda: asked(NET, held, None, BoundSettings(profile_runs=3000), **made),
        lambda: asked(NET, held, None, BoundSettings(bins=(2, 2)), profile=tube, **made),
        lambda: pj.learn(log, KEY, rollouts=50),
        lambda: pj.learn(log, KEY, settings=Learning(rollouts=50)),
        lambda: pj.learn(log, KEY, settings=Learning(bound=ModelBound(fresh=50))),
        lambda: pj.learn(log, KEY, "twist", profile_runs=50),
    ):
        with pytest.raises(InputError, match="expected no such option with"):
            call()
    with pytest.raises(InputError, match=r'blocks: expected claims=\("bins",\)'):
        asked(NET, held, None, bins=(2, 2), blocks=(2, 1), **made)


def test_a_claim_by_blocks_may_be_updated_to_one_over_k():
    held, train, fresh = (
        collect(plant(noisy), jax.random.PRNGKey(seed), 300, stage, quiet=True)
        for seed, stage in ((0, Stage.BOUND), (0, Stage.TRAIN), (1, Stage.BOUND))
    )
    made = {"eps": 0.1, "delta": 0.1, "train": train, "bins": (2, 2)}
    claim = pj.learning.bound_error(NET, held, None, claims=("bins",), blocks=(2, 1), **made)
    assert update(claim, NET, train, fresh)[1].evidence["blocks_asked"] == [2, 1]
    assert update(claim, NET, train, fresh, claims=("one",))[1].bin_eps is None
    with pytest.raises(InputError, match=r'blocks: expected claims=\("bins",\)'):
        update(claim, NET, train, fresh, claims=("one",), blocks=(2, 1))


def test_python_and_shell_make_the_same_claim(tmp_path):
    system = plant(noisy)
    learned = learn_report(system, KEY, STUDY, path=tmp_path, quiet=True)
    # the training runs are kept once, in chunks like all others
    assert (tmp_path / "training" / "meta.json").exists()
    assert {f.name for f in tmp_path.iterdir()} <= {"training", "profile", "fresh"}
    again = pj.learning.bound_error(
        learned.model.net,
        system,
        KEY,
        eps=STUDY.bound.eps,
        delta=STUDY.bound.delta,
        bins=STUDY.bound.bins,
        train=learned.train,
        profile_runs=STUDY.bound.profile_runs,
        gap=STUDY.bound.gap,
        quiet=True,
    )
    assert again.to_json() == learned.model.claim.to_json()
    assert again.tube.hash == learned.model.tube.hash
    check_claim(again)


def test_an_update_keeps_the_declared_start():
    train, held, more = (
        collect(plant(noisy), key, 80, stage, quiet=True)
        for key, stage in ((KEY, 1), (KEY, 2), (jax.random.PRNGKey(6), 2))
    )
    old = pj.learning.bound_error(
        NET, held, None, eps=0.1, delta=0.05, bins=(1, 1), train=train, gap=0.25
    )
    for gap, declared in (({}, 0.25), ({"gap": 0.5}, 0.5)):
        _, new = update(old, NET, train, more, bins=(1, 1), **gap)
        assert f"TRANSLATION_INVARIANCE(within {declared}; not measured)" in new.assumptions
        assert (new.tube.interval > declared).all()


def test_recorded_runs_too():
    runs = collect(plant(noisy), KEY, 160, quiet=True)
    learned = learn_report(runs, KEY, STUDY, holdout=0.5)
    train, held = runs.split(0.5, 5)
    again = pj.learning.bound_error(
        learned.model.net,
        held,
        None,
        eps=0.1,
        delta=0.05,
        bins=(2, 1),
        train=train,
        gap=STUDY.bound.gap,
        discard=0,
    )
    assert again.to_json() == learned.model.claim.to_json()
    assert np.isfinite(again.tube.interval).all()


def test_the_eps_asked_for_is_that_of_runs_that_are_given():
    """More of them than it needs are worth discards, a number settled before any is seen."""
    train, held = (collect(plant(noisy), KEY, n, s, quiet=True) for n, s in ((80, 1), (400, 2)))
    options = {"eps": 0.05, "delta": 0.05, "bins": (1, 1), "train": train}
    claim = pj.learning.bound_error(NET, held, None, **options)
    discards = most_discards(400, 0.05, 0.05)
    assert (claim.eps, claim.discard) == (Fraction(1, 20), discards) and discards > 5
    assert f"discards, fixed beforehand: {discards}" in claim.details()
    strict = pj.learning.bound_error(NET, held, None, discard=0, **options)
    assert strict.eps < Fraction(1, 100) and (strict.tube.interval > claim.tube.interval).all()


def test_claims_about_the_same_runs_split_delta():
    """Two claims, two looks each: four looks at one holdout, at a quarter of delta each."""
    from parc_jax.learning.bound.pipeline import SystemRuns, bound_errors
    from parc_jax.learning.bound.settings import BoundSettings
    from parc_jax.learning.bound.start_gap import StartTrial

    system = plant(noisy)
    asked = BoundSettings(
        eps=0.1,
        delta=0.05,
        claims=("one", "bins"),
        bins=(1, 1),
        profile_runs=40,
        fresh=100,
        looks=2,
    )
    runs = SystemRuns(system, KEY, 0, None, True)
    claims = bound_errors(NET, runs, None, asked, StartTrial(0.0, None))
    assert len(claims) == 2 and {claim.looks for claim in claims} == {4}
    assert {(claim.eps, claim.discard) for claim in claims} == {
        (Fraction(1, 10), most_discards(100, 0.1, 0.05 / 4))
    }


class Resting(Plant):
    """Nobody may run it."""

    def rollout(self, key, k):
        raise AssertionError("run")


def test_arguments_in_each_other_s_place_are_told_apart():
    net, system = straight_network(4), plant(noisy)
    runs = collect(system, KEY, 4, quiet=True)
    for given, train in (
        ((system, net, KEY), None),
        ((net, KEY, system), None),
        ((net, system, 5), None),
        ((net, system, KEY, runs), None),
        ((net, runs, None), system),
    ):
        with pytest.raises(InputError, match="expected"):
            pj.learning.bound_error(*given, eps=0.2, delta=0.2, train=train, quiet=True)


def test_a_profile_over_another_k_is_refused_before_the_first_run():
    """Its bins reach beyond what will be run: there would be plans at k that nobody ever ran."""
    base = plant(noisy)
    robot = Resting(base.domain, base.time, base.run)
    edges = [np.array([0.0, 0.5, 2.0]), np.array([0.0, 1.0])]
    larger = pj.learning.tube(edges, np.full((2, 4, 2), 0.1), np.full((2, 3), 0.1))
    train, held = (collect(base, KEY, 60, s, quiet=True) for s in (Stage.TRAIN, Stage.BOUND))
    words = r"bins that span K = \[0, 1\] x \[0, 1\]; along axis 0 they cover \[0, 2\]"
    with pytest.raises(pj.InputError, match=words):
        pj.learning.bound_error(
            NET, robot, KEY, eps=0.1, delta=0.05, profile=larger, train=train, quiet=True
        )
    with pytest.raises(pj.InputError, match=words):
        pj.learning.bound_error(NET, held, None, eps=0.1, delta=0.05, profile=larger, train=train)
    with pytest.raises(pj.InputError, match=words):
        calibrate(NET, held, larger, eps=0.1, delta=0.05)


def test_training_runs_on_another_grid_are_refused_in_a_sentence():
    train = collect(plant(noisy, 2), KEY, 40, quiet=True)
    held = collect(plant(noisy), KEY, 40, quiet=True)
    for of, key in ((plant(noisy), KEY), (held, None)):
        with pytest.raises(InputError, match=r"train: expected runs on .*0\.25.*; got .*dt=0\.5"):
            pj.learning.bound_error(NET, of, key, train=train, eps=0.2, delta=0.1, quiet=True)


def test_a_shape_without_its_own_tube_is_not_made_of_boxes():
    with pytest.raises(InputError, match="one of box, signed, fitted; got 'ellipse'"):
        learn_profile(NET, None, (), shape="ellipse")


@pytest.mark.parametrize("name", ["plant", "body"])
def test_learn_takes_the_system_as_it_was_built(name):
    """The shell builds the one that these options name; here it would be ignored."""
    with pytest.raises(pj.InputError, match=rf"learn: expected {name}=None, .* got 'ice'. Build"):
        pj.learn(plant(noisy), KEY, **{name: "ice"})
    built = copy.copy(plant(noisy))  # others use it, too
    object.__setattr__(built, name, "ice")
    with pytest.raises(pj.InputError, match="expected a random key"):  # past the names
        pj.learn(built, 0, **{name: "ice"})
