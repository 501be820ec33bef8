"""What several commands ask alike."""

from dataclasses import dataclass

from parc_jax.common.options import Options


@dataclass(frozen=True)
class Shell(Options):
    """How a command runs, whatever it does."""

    seed: int = 0
    """Everything random follows from it."""
    quiet: bool = False
    """No progress bars, and as few words as there can be."""
    json: bool = False
    """Print the result as JSON."""
    cache: bool = True
    """Keep compiled programs in the user's cache folder."""

    def __post_init__(self) -> None:
        from parc_jax.common.keys import check_seed

        check_seed(self.seed)
