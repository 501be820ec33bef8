"""Which profile of the tube leaves the largest safe set: python -m sims.profiles drift_parking (or
asv).

One network, one set of runs for profiles, one holdout; only the profile differs: the largest errors
per bin, or an error scale that a small ReLU network gives for every k. Safe: share of all (p0, k),
drawn over K and the goal's box. Each row is a claim at the study's eps and delta over all of K on
its own; to hold together they would have to share delta.
"""

import time
from dataclasses import replace

import jax
import numpy as np

import sims
from parc_jax.claim.calibrate import calibrate
from parc_jax.claim.counts import required_runs
from parc_jax.claim.pipeline import learn_profiles
from parc_jax.claim.score import scores_of
from parc_jax.cli.systems import find
from parc_jax.experiment.compare import safe_volume
from parc_jax.experiment.learn import networks
from parc_jax.experiment.settings import name_of
from parc_jax.keys import Stage
from parc_jax.model import trajectory_model
from parc_jax.rollout.collect import collect, stream_rollouts

GRIDS = {
    "drift_parking": (None, (20, 4)),
    "asv": ((3, 3, 3), (3, 5, 5), (5, 7, 7)),
}  # bins per axis of K; None = cut where the error changes
HEADS = (None, (8, 8))


def compared(
    name: str, seed: int = 0, fresh: int | None = None, profile_runs: int | None = None
) -> None:
    """Print a row per grid and head.

    Args:
        name: drift_parking or asv.
        seed: Everything random follows from it.
        fresh: Runs of the holdout. Default: the study's, or as many as eps and delta need.
        profile_runs: Runs beside the training ones for the profiles. Default: the study's.
    """
    module, key = find(name), jax.random.PRNGKey(seed)
    system, problem = sims.load(name, plant="ode"), module.problem()
    study = replace(module.STUDY, others=())
    study = study if profile_runs is None else replace(study, profile_runs=profile_runs)
    train = collect(system, key, study.rollouts, Stage.TRAIN)
    net = networks(train, study, key)[0]
    further = (
        ()
        if not study.profile_runs
        else [
            collect(
                system, key, study.profile_runs, Stage.TRAIN, first_row=train.n, dtype=np.float32
            )
        ]
    )
    variants = [(head, bins) for bins in GRIDS[name] for head in HEADS]
    tubes, spent = [], []
    for head, bins in variants:
        begin = time.perf_counter()
        tubes += learn_profiles([net], train, further, bins, head, key)
        spent.append(time.perf_counter() - begin)
    n = fresh or study.fresh or required_runs(study.eps, study.delta)
    # one network, judged against every profile
    seen = scores_of([net] * len(tubes), tubes, stream_rollouts(system, key, n, Stage.BOUND))
    print(
        f"{name}: network {name_of(study.hidden)}, {n:,} fresh runs, eps = {study.eps:g}, seed "
        f"{seed}"
    )
    print("        bins  in all  profile           half width  at the end      safe  profile in")
    for (head, bins), profile, score, seconds in zip(variants, tubes, seen, spent, strict=True):
        claim = calibrate(
            net,
            score,
            profile,
            study.eps,
            study.delta,
            discard="most",
            train=train,
        )
        model = trajectory_model(net, claim)
        safe = safe_volume(model, problem, key)["safe"]
        size = _shares(claim.tube)
        middle = np.exp(size @ np.log(claim.tube.interval).mean(axis=(1, 2)))
        end = np.exp(size @ np.log(claim.tube.final[:, : model.n_p]).mean(axis=1))
        print(
            f"{'cut' if bins is None else ' x '.join(map(str, bins)):>12}  {profile.n_bins:6}  "
            f"{'maxima' if head is None else f'head {name_of(head)}':14}  {middle:8.4f} m  "
            f"{end:8.4f} m  "
            f"{100 * safe:6.2f} %  {seconds:6.1f} s",
            flush=True,
        )


def _shares(tube) -> np.ndarray:
    """(n_bins,) share of K in every bin, row-major."""
    out = np.ones(1)
    for e in tube.edges:
        out = np.multiply.outer(out, np.diff(e) / (e[-1] - e[0])).ravel()
    return out


if __name__ == "__main__":
    import tyro

    tyro.cli(tyro.conf.configure(tyro.conf.PositionalRequiredArgs)(compared))
