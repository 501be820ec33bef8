"""The model that comes along, learned anew: `python -m sims.parking.learn --out model.npz`."""

from dataclasses import dataclass
from pathlib import Path

import jax

import parc_jax as pj
from sims.parking.car import WAY, system


@dataclass(frozen=True)
class Options:
    """How much of it."""

    out: Path = Path("model.npz")
    way: float = WAY
    """Metres of the longest manoeuvre."""
    rollouts: int = 60_000
    """Runs to train on; as many fresh ones as eps and delta ask for follow."""
    hidden: tuple[int, ...] = (48, 48, 48, 48)
    steps: int = 24_000
    eps: float = 2e-3
    seed: int = 0
    quiet: bool = False


def learn(options: Options) -> pj.types.TrajectoryModel:
    """Runs, network, bound."""
    return pj.learn(
        system(way=options.way),
        jax.random.PRNGKey(options.seed),
        rollouts=options.rollouts,
        hidden=options.hidden,
        steps=options.steps,
        seeds=1,
        bins=(1, 16, 3, 3),
        eps=options.eps,
        even=True,
        tail=6.0,
        quiet=options.quiet,
    )


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    model = learn(options)
    model.save(options.out)
    final = model.tube.final[:, : model.n_c].max(axis=1)
    print(model.claim)
    middle = sorted(final)[len(final) // 2]
    print(f"at rest at most {final.max():.3f} m, in the middle bin {middle:.3f} m")
