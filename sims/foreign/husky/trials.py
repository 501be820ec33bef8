"""What becomes of other robots' logs: a tube, an answer, and the runs that had no part in it.

    python -m sims.foreign.husky.trials warthog_ice_windows.npz --size 1.52 1.38

Commands of even number train. Of the others the earlier half sizes the tube and the later half is
only counted, and replayed against the answer for a bay as wide for this robot as the Husky's is
for the Husky.
"""

import argparse
import json
from pathlib import Path

import jax
import numpy as np

from parc_jax.learning.bound.edges import edges_of
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.bound.profile import largest_errors, smooth_profile
from parc_jax.learning.model import trajectory_model
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.planner import Planner
from parc_jax.safe_set.settings import Settings
from sims.foreign.husky import params as c
from sims.foreign.husky.learn import DELTA, trained
from sims.foreign.husky.scenario import BAY_LENGTH, BAY_WIDTH, problem
from sims.foreign.husky.twist import TwistModel, identify
from sims.foreign.husky.windows import SECONDS, read_windows
from sims.recorded import replay_recorded


def trial(
    path: Path,
    size: tuple[float, float],
    suspects: bool = True,
    seconds: float = SECONDS,
    seed: int = 0,
) -> dict:
    """Learn, bound, solve and replay one file. Raises InputError, SoundnessError."""
    cut = read_windows(path, size, suspects, seconds)
    time = cut.runs.time
    even = cut.runs.groups % 2 == 0
    late = cut.runs.groups > np.median(cut.runs.groups[~even])
    train, sizing, later = (cut.select(rows) for rows in (even, ~even & ~late, ~even & late))
    fine = train.select(~train.runs.failed)
    t = np.arange(time.n_record + 1) * time.dt_record
    twist = identify(t, fine.p, fine.yaw, fine.runs.k)
    key = jax.random.PRNGKey(seed)
    net = trained(TwistModel(twist, cut.runs.domain, time, size), key)
    maxima = largest_errors(net, fine.runs, edges_of(fine.runs.domain, (1, 1)))
    profile = smooth_profile(maxima, len(fine.runs.points), c.POSE_NOISE)
    claim = bound_error(
        net, sizing.runs, None, eps=0.1, delta=DELTA, profile=profile, train=train.runs
    )
    model = trajectory_model(net, claim)
    bay = problem(BAY_WIDTH * size[1] / c.WIDTH, BAY_LENGTH * size[0] / c.LENGTH)
    answer = Planner(model).solve(bay, key, Settings(samples=20))
    left = worst_by_group(~inside_tube(claim, net, later.runs), later.runs.groups)
    way = np.linalg.norm(fine.p[:, -1], axis=1)
    found = {
        "file": path.name,
        "runs": cut.runs.n,
        "failed": int(cut.runs.failed.sum()),
        "median_way": float(np.median(way)),
        "commands_behind_the_claim": claim.n,
        "eps": float(claim.eps),
        "half_width_at_the_end": float(model.tube.final.max()),
        "later_commands": len(left),
        "left_the_tube": int(left.sum()),
        "status": answer.status.label,
        "share_of_k_at_least": answer.share_of_k() if answer.status.found else 0.0,
        "confidence_of_that_share": 0.999,
    }
    replayed = replay_recorded(answer, later.runs) if answer.status.found else None
    if replayed is not None:
        found["replays"] = len(replayed.plans)
        found["replays_failed"] = int(replayed.runs.failed.sum())
    return found


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--size", type=float, nargs=2, required=True, help="length, width [m]")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="length of a run")
    parser.add_argument("--without-suspects", action="store_true", help="leave odd windows out")
    given = parser.parse_args()
    for path in given.files:
        found = trial(path, tuple(given.size), not given.without_suspects, given.seconds)
        print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
