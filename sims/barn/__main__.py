"""Drive worlds of the BARN challenge on a lidar alone: `python -m sims.barn`.

Learns a model of the Jackal first (some minutes), or takes one that was saved.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro
from scipy.stats import qmc
from tqdm import tqdm

import parc_jax as pj
import sims
from sims.barn.drive import Drive, drive
from sims.barn.worlds import numbers, world
from sims.rectangle import rectangle

SPEED, TURNING = 1.6, 1.0  # [m/s], [rad/s] at most: beyond, tyres slip now and then, and tubes pay
EDGES = (0.7, 1.2)  # [m/s] of speeds at the start, between bins: the slower, the less it is off
SLOW = 1.7  # power of the share of the speed: more candidates are slow than fast
TURNS_ON_THE_SPOT = 101


@dataclass(frozen=True)
class Options:
    """Which worlds, with which model."""

    worlds: tuple[int, ...] = ()
    """Numbers of worlds; default: all 200."""
    seeds: int = 1
    """Episodes in each."""
    model: Path = Path("barn/jackal.npz")
    """A saved model of the Jackal; learned and saved there, if there is none."""
    out: Path = Path("barn/drives.jsonl")
    """A line for each episode; what stands there is not driven again."""
    odometry: bool = False
    """The robot knows where it is by dead reckoning alone, which drifts; else it truly knows."""
    prove: bool = False
    """Prove every commitment in exact arithmetic as well, after its episode."""
    save: bool = False
    """Save every episode beside `out`, as a file that `parc-jax check` verifies."""
    rollouts: int = 8_000
    """To train on; as many fresh ones as eps and delta ask for follow."""
    eps: float = 1e-3
    """Of the claim about single manoeuvres."""
    deadline: float = 10.0
    """[s] of the clock for a step. The robot waits, so that a busy machine does not decide."""


def learned(options: Options) -> pj.TrajectoryModel:
    """The model at its place, learned if there is none."""
    if options.model.exists():
        return pj.load(options.model)
    system, key = robot(), jax.random.PRNGKey(0)
    kept = options.model.parent / "runs"
    runs = pj.collect(system, key, n=options.rollouts, path=kept / "train.npz")
    net = pj.train(runs, hidden=(32, 32), key=key, seeds=2, steps=6000)
    lo, hi = system.domain.lo, system.domain.hi
    bins = [(lo[0], *EDGES, hi[0]), (lo[1], hi[1]), np.linspace(lo[2], hi[2], 3), (lo[3], hi[3])]
    asked = {"bins": bins, "shape": "fitted", "train": runs, "search": 0}
    claim = pj.bound_error(net, system, key, eps=options.eps, delta=1e-3, path=kept, **asked)
    model = pj.trajectory_model(net, claim)
    options.model.parent.mkdir(parents=True, exist_ok=True)
    model.save(options.model)
    return model


def robot():
    """The Jackal as it is driven here."""
    return sims.load("jackal", speed=SPEED, turning=TURNING)


def candidates(domain: pj.Box) -> np.ndarray:
    """Commands (b, 2) within K: speed [m/s] and turning [rad/s]."""
    share = qmc.Sobol(2, seed=0).random_base2(10)
    share[:, 0] **= SLOW
    lo, hi = domain.lo[2:], domain.hi[2:]
    on_the_spot = np.linspace(lo[1], hi[1], TURNS_ON_THE_SPOT)
    on_the_spot = np.stack([np.full(TURNS_ON_THE_SPOT, lo[0]), on_the_spot], axis=1)
    return np.concatenate([lo + (hi - lo) * share, on_the_spot])


def told(one: Drive, seed: int, proved: bool | None) -> dict:
    """What is kept of an episode: times in milliseconds of processor time."""

    def quantiles(seconds):
        return [round(1e3 * float(q), 2) for q in np.quantile(seconds, [0.5, 0.95, 1.0])]

    new = [step.committed for step in one.steps if step.new]
    return {
        "world": one.world,
        "seed": seed,
        "reached": one.reached,
        "touched": one.touched,
        "seconds": round(one.seconds, 2),
        "metric": round(one.metric, 4),
        "clearance": round(one.clearance, 4),
        "drifted": one.drifted,
        "cycles": len(one.steps),
        "committed": len(new),
        "proved": proved,
        "edges": [round(float(np.mean(one.edges)), 1), max(one.edges)],
        "plan_ms": quantiles(one.plan_s),
        "see_ms": quantiles(one.see_s),
        "guide_ms": quantiles(one.guide_s),
    }


def main(options: Options) -> None:
    """Drive, write a line an episode, print what came of all."""
    model, system = learned(options), robot()
    effort = pj.Effort(judged=512, room=0.05, deadline=options.deadline)
    loop = pj.Loop(
        model,
        rectangle(),
        leave=system.moving,
        given=(0, 1),  # speed and turning at the start
        candidates=candidates(model.domain),
        effort=effort,
    )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    lines = options.out.read_text().splitlines() if options.out.exists() else []
    found = {(one["world"], one["seed"]): one for one in map(json.loads, lines)}
    asked = [(w, s) for w in options.worlds or numbers() for s in range(options.seeds)]
    for number, seed in tqdm([each for each in asked if each not in found], unit="episode"):
        key = jax.random.fold_in(jax.random.PRNGKey(seed), number)
        one = drive(world(number), system, loop, key, odometry=options.odometry)
        new = [step.committed for step in one.steps if step.new]
        proved = all(each.proved() for each in new) if options.prove else None
        if options.save and new:
            pj.save_episode(options.out.parent / f"world_{number}_{seed}.json", new)
        found[number, seed] = told(one, seed, proved)
        with options.out.open("a") as file:
            file.write(json.dumps(found[number, seed]) + "\n")
    print(summary([found[each] for each in asked]))


def summary(found: list[dict]) -> str:
    """The lines that are printed."""
    reached = [one for one in found if one["reached"] and not one["touched"]]
    seconds = [one["seconds"] for one in reached]
    worst = [f"{o['world']}/{o['seed']}" for o in found if not o["reached"] or o["touched"]]
    middle = np.median([one["plan_ms"] for one in found], axis=0)
    return "\n".join(
        [
            f"{len(reached)} of {len(found)} episodes reached the goal without contact, "
            f"{sum(one['touched'] for one in found)} touched something; "
            f"metric {np.mean([one['metric'] for one in found]):.3f} of 0.5.",
            f"Time of those that reached it: median {np.median(seconds):.1f} s, longest "
            f"{max(seconds):.1f} s. Least clearance {min(o['clearance'] for o in found):.3f} m.",
            f"A step of the loop, processor time: median {middle[0]:.1f} ms, 95 % {middle[1]:.1f} "
            f"ms in the middle episode; at most {max(o['plan_ms'][2] for o in found):.0f} ms.",
            f"Not reached (world/seed): {', '.join(worst) or 'none'}.",
        ]
    )


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
