"""Every way in which the tool promises eps with confidence 1 - delta, as one repetition each.

A repetition runs the real pipeline on fresh random numbers and returns the probability that the
claim is about, computed exactly, next to the eps that was promised. The controls at the end break
one rule on purpose: a campaign that cannot see them would not see anything.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import jax
import numpy as np

from benchmarks.attacks.jump_plant import (
    HEIGHT,
    SLAB,
    hidden,
    jump_plant,
    network,
    recordings,
    truth,
    truth_of_recordings,
)
from parc_jax.common.keys import Stage, generator
from parc_jax.common.sets.box import box
from parc_jax.drive.local.trials import run_once
from parc_jax.learning.bound.calibrate import calibrate, calibrate_bins
from parc_jax.learning.bound.counts import clopper_pearson, required_runs
from parc_jax.learning.bound.measure import Scores, scores_of
from parc_jax.learning.bound.monitor import monitor
from parc_jax.learning.bound.pipeline import bound_error, learn_profile, update
from parc_jax.learning.bound.profile import fitted_profile
from parc_jax.learning.model import trajectory_model
from parc_jax.learning.runs.collect import collect, stream_rollouts
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.verdict.scene import scene_of

EPS, DELTA = 0.05, 0.05
NET = network()
LOOKS = 4
PARTS = 5  # runs of one recording
PROFILE_RUNS = 100
WATCHED = 200  # runs that a monitor sees
ALPHA = 0.05


@dataclass(frozen=True)
class Promise:
    """once: (slab width, key) -> (promised, true probability). The promise is broken when the
    second is larger.

    allowed: how often it may be broken at most. control: it must be broken more often than that.
    """

    name: str
    once: Callable
    allowed: float = DELTA
    control: bool = False


def one(width, key):
    """One claim over K, with a profile by bins learned from runs of its own."""
    claim = _claim(width, key)
    return claim.eps, truth(width, claim.tube).whole


def chosen_set(width, key):
    """A planner drives k only where it hurts most, from a strip twice as wide as the slab. The
    promise for a set of share s is eps / s.
    """
    claim = _claim(width, key)
    low, high = (0.0, SLAB), (1.0, SLAB + 2 * width)
    share = float(np.prod(np.subtract(high, low)))
    return claim.risk(share=share).bound, truth(width, claim.tube, low, high).whole


def fewer_runs(width, key):
    """Fewer runs than asked for: the claim must carry the eps that they support."""
    claim = _claim(width, key, fresh=30)
    return claim.eps, truth(width, claim.tube).whole


def discards(width, key):
    """Three runs left outside, fixed beforehand."""
    claim = _claim(width, key, discard=3)
    return claim.eps, truth(width, claim.tube).whole


def most_discards(width, key):
    """As many runs left outside as 300 runs allow."""
    claim = _claim(width, key, fresh=300, discard="most")
    return claim.eps, truth(width, claim.tube).whole


def looks(width, key, declared=LOOKS):
    """One holdout, four profiles, and of the four claims the one that is most often wrong: a user
    who picks the tightest cannot do worse.
    """
    n = required_runs(EPS, DELTA / declared)
    claims = []
    for number, bins in enumerate(((1, 1), (2, 1), (4, 1), (1, 4))):
        train = collect(jump_plant(width), key, 50, Stage.TRAIN, first_row=50 * number, quiet=True)
        profile = learn_profile(NET, train, (), bins)
        scores = _scores(jump_plant(width), key, profile, n)
        claims.append(calibrate(NET, scores, profile, eps=EPS, delta=DELTA, looks=declared))
    return EPS, max(truth(width, claim.tube).whole for claim in claims)


def grouped(width, key):
    """Recordings cut into runs that share a disturbance: any run of a new recording may leave the
    tube with probability eps.
    """
    claim = _recorded(width, key, grouped=True)
    return claim.eps, truth_of_recordings(width, claim.tube, PARTS)


def by_bin(width, key):
    """Four claims at once, each with its own eps, judged by the bin that breaks its own most."""
    system, n = jump_plant(width), 4 * required_runs(EPS, DELTA / 4)
    train = collect(system, key, PROFILE_RUNS, quiet=True)
    profile = learn_profile(NET, train, (), (4, 1))
    scores = _scores(system, key, profile, n)
    claim = calibrate_bins(NET, scores, profile, eps=EPS, delta=DELTA)
    real = truth(width, claim.tube).by_bin
    pairs = [(eps, p) for eps, p in zip(claim.bin_eps, real, strict=True) if eps is not None]
    return max(pairs, key=lambda pair: pair[1] - float(pair[0]), default=(1, 0.0))


def by_block(width, key):
    """Four claims at once on a fitted profile of twelve bins, judged by the block of three bins
    that breaks its own most.
    """
    system, n = jump_plant(width), 4 * required_runs(EPS, DELTA / 4)
    profile = fitted_profile(NET, [collect(system, key, PROFILE_RUNS, quiet=True)], (12, 1))
    scores = _scores(system, key, profile, n)
    claim = calibrate_bins(NET, scores, profile, eps=EPS, delta=DELTA, blocks=(4, 1))
    real = truth(width, claim.tube).by_bin.reshape(4, 3).mean(axis=1)
    pairs = [(eps, p) for eps, p in zip(claim.bin_eps[::3], real, strict=True) if eps is not None]
    return max(pairs, key=lambda pair: pair[1] - float(pair[0]), default=(1, 0.0))


def fitted(width, key):
    """One claim over K, of a tube between faces off centre."""
    claim = _claim(width, key, shape="fitted")
    return claim.eps, truth(width, claim.tube).whole


def fitted_most_discards(width, key):
    """The same with as many runs left outside as 300 runs allow."""
    claim = _claim(width, key, shape="fitted", fresh=300, discard="most")
    return claim.eps, truth(width, claim.tube).whole


def watched(width, key):
    """A monitor of a true claim must not ring: broken = the alarm rang although the claim is true.
    Its level is its own.
    """
    claim = _claim(width, key)
    runs = collect(jump_plant(width), key, WATCHED, Stage.REPLAY, quiet=True)
    rang = monitor(claim, NET, alpha=ALPHA).observe(runs).alarm
    holds = truth(width, claim.tube).whole <= claim.eps
    return 0, float(rang and holds)


def watched_at_eps(width, key):
    """The worst world in which the claim is true: runs leave the tube with probability eps."""
    rng = generator(key)
    watch = monitor(_any_claim(), NET, alpha=ALPHA)
    for outside in rng.random(WATCHED) < EPS:
        watch = watch.bet(bool(outside))
    return 0, float(watch.alarm)


def updated(width, key):
    """A claim made anew after a monitor has watched the old one; its runs become training runs."""
    system = jump_plant(width)
    old = _claim(width, key)
    seen = collect(system, key, WATCHED, Stage.REPLAY, quiet=True)
    rang = monitor(old, NET).observe(seen).alarm
    fresh = collect(
        system,
        jax.random.fold_in(key, 1 + rang),
        required_runs(EPS, DELTA),
        Stage.BOUND,
        quiet=True,
    )
    _, new = update(old, NET, seen, fresh, bins=(2, 2))
    return new.eps, truth(width, new.tube).whole


def chosen_choice(width, key):
    """Fresh runs of the plan that is driven, with no profile: failed = it jumped past the goal."""
    plans = np.tile([0, 0, 0.5, 0.5], (120, 1))
    failed, *_ = run_once(hidden(width), _wide_goal(), key, Stage.VALIDATE, plans, quiet=True)
    return clopper_pearson(int(failed.sum()), len(plans), float(DELTA)), width


def undeclared_looks(width, key):
    """Control: four looks that are declared to be one."""
    return looks(width, key, declared=1)


def recordings_taken_for_runs(width, key):
    """Control: the runs of the same recordings, counted as independent ones."""
    claim = _recorded(width, key, grouped=False)
    return claim.eps, truth(width, claim.tube).whole


def trained_on_its_holdout(width, key):
    """Control: the training maximum read as a claim. 59 runs whose largest error of each bin is the
    tube.
    """
    train = collect(jump_plant(width), key, required_runs(EPS, DELTA), quiet=True)
    profile = learn_profile(NET, train, (), (4, 4))
    return EPS, truth(width, profile).whole


def discards_chosen_afterwards(width, key):
    """Control: the largest scores are dropped after they were seen, and counted as none."""
    claim = _claim(width, key, fresh=required_runs(EPS, DELTA), discard=1)
    return EPS, truth(width, claim.tube).whole


PROMISES = (
    Promise("one", one),
    Promise("chosen_set", chosen_set),
    Promise("fewer_runs", fewer_runs),
    Promise("discards", discards),
    Promise("most_discards", most_discards),
    Promise("looks", looks),
    Promise("by_bin", by_bin),
    Promise("by_block", by_block),
    Promise("fitted", fitted),
    Promise("fitted_most_discards", fitted_most_discards),
    Promise("grouped", grouped),
    Promise("watched", watched, ALPHA),
    Promise("watched_at_eps", watched_at_eps, ALPHA),
    Promise("updated", updated),
    Promise("chosen_choice", chosen_choice),
    Promise("control_undeclared_looks", undeclared_looks, control=True),
    Promise("control_recordings_as_runs", recordings_taken_for_runs, control=True),
    Promise("control_training_maximum", trained_on_its_holdout, control=True),
    Promise("control_discards_afterwards", discards_chosen_afterwards, control=True),
)


def _claim(width, key, **options):
    options = {"bins": (4, 1), "profile_runs": PROFILE_RUNS} | options
    return bound_error(NET, jump_plant(width), key, eps=EPS, delta=DELTA, quiet=True, **options)


def _recorded(width, key, grouped: bool):
    """A claim from recorded runs; their number is such that they support eps = EPS."""
    rng = generator(key)
    n = required_runs(EPS, DELTA)
    n = n if grouped else -(-n // PARTS)
    train, held = recordings(width, rng, 20, PARTS), recordings(width, rng, n, PARTS)
    if not grouped:
        train, held = train.replace(groups=None), held.replace(groups=None)
    return calibrate(NET, held, learn_profile(NET, train, (), (4, 1)), eps=EPS, delta=DELTA)


def _scores(system, key, profile, n: int) -> Scores:
    fresh = stream_rollouts(system, key, n, Stage.BOUND, quiet=True)
    return scores_of(NET, profile, fresh)


@cache
def _any_claim():
    return _claim(0.0, jax.random.PRNGKey(0))


@cache
def _wide_goal():
    """The scene of a goal that every run reaches that does not jump."""
    goal = box([-HEIGHT / 2] * 3, [HEIGHT / 2] * 3)
    return scene_of(reach_avoid(goal, [], 0.1), trajectory_model(NET, _any_claim()))
