"""How a network is made, as one frozen record, and the network that it asks for."""

from dataclasses import dataclass

import jax

from parc_jax.base.options import Options, check_count
from parc_jax.errors import InputError
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch


@dataclass(frozen=True)
class Training(Options):
    """What a network is trained from, and how."""

    rollouts: int = 10_000
    """Number of training rollouts."""
    hidden: tuple[int, ...] = (8, 8, 8, 8)
    """Widths of the hidden layers; without any, in Python (), it is PARC's affine map."""
    seeds: int = 6
    """Networks trained, of which the best is kept."""
    steps: int = 3000
    """Training steps."""
    tail: float | None = None
    """Power of the error that the last layer is refitted to, at least 2. Default: least squares."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rollouts < 20:
            raise InputError(f"rollouts: expected at least 20 training runs; got {self.rollouts}.")
        check_count("seeds", self.seeds, 1, "1 for a single network")
        check_count("steps", self.steps, 1, "3000, the default")
        if self.tail is not None and (isinstance(self.tail, str) or not self.tail >= 2):
            raise InputError(f"tail: expected a power of at least 2, or None; got {self.tail!r}.")


def fit(data: RolloutBatch, asked: Training, key: jax.Array) -> ReLUNetwork:
    """The network of the training runs `data`. Raises InputError."""
    from parc_jax.network.parc import fit_affine
    from parc_jax.network.tail import fit_tail
    from parc_jax.network.train import train_report, training_arrays  # flax and optax

    if not asked.hidden:
        return fit_affine(*training_arrays(data))
    net = train_report(data, asked.hidden, key=key, seeds=asked.seeds, steps=asked.steps)[0]
    return net if asked.tail is None else fit_tail(net, data, asked.tail)
