"""What a proof costs: models whose tubes are other ones, to be driven by `python -m sims.barn` side
by side: `python -m sims.barn.compared --model barn/jackal.npz`.

`none`: no tube, the predicted path alone has to be free. `constant`: as NeuralPARC has it, at each
time the largest error of all runs that the network was trained on, whatever k.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

import parc_jax as pj
from parc_jax.claim.pipeline import learn_profiles
from parc_jax.claim.tube import Tube


@dataclass(frozen=True)
class Options:
    """Which model."""

    model: Path = Path("barn/jackal.npz")
    """As `python -m sims.barn` learned it; its runs lie beside it."""


def with_tube(model: pj.types.TrajectoryModel, tube: Tube, why: str) -> pj.types.TrajectoryModel:
    """The network with a tube of which nothing is shown."""
    about = {"system": model.system, "points": model.points, "rotation": model.rotation}
    about |= {"labels": model.labels, "given": model.given}
    return pj.trajectory_model(
        model.net, pj.declared_claim(tube, why, model.net, model.time, **about)
    )


def main(options: Options) -> None:
    """Write both models beside the first."""
    model = pj.load(options.model)
    sides = [[lo, hi] for lo, hi in zip(model.domain.lo, model.domain.hi, strict=True)]
    runs = pj.load_rollouts(options.model.parent / "runs" / "train.npz")
    constant = learn_profiles([model.net], runs, (), sides, shape="box")[0]
    nothing = pj.tube(sides, np.zeros_like(constant.interval), np.zeros_like(constant.final))
    for name, tube, why in (
        ("none", nothing, "nobody asked how far the robot may be from its prediction"),
        ("constant", constant, "no run that the network was trained on was farther off"),
    ):
        path = options.model.with_stem(f"{options.model.stem}_{name}")
        with_tube(model, tube, why).save(path)
        print(path)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
