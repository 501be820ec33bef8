"""The law that rollouts are drawn from: the distribution every statistical claim is about."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, is_dataclass

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import hex_text
from parc_jax.learning.systems.user_code import blamed

OURS = (
    "parc_jax:"  # begins parameters that no system may declare, so that none reads as one of ours
)
# parameter of a law whose k are drawn from a small box inside K, which sentences call N
BOX = f"{OURS}box of k"
LOG = "file:"  # begins the generator of runs that were logged
# parameter of a law whose K was not declared but fitted to logged k, and the runs of that fit
FITTED, TO_ALL, TO_TRAINING = (
    f"{OURS}K",
    "the smallest box of these runs",
    "the smallest box of the training runs",
)
SAMPLER = "the sampler "  # begins the law of k of a function: no name of one reads as another law
GIVEN = "given "  # begins that of values


@dataclass(frozen=True)
class LawSpec:
    """Where rollouts come from. Two laws with the same hash are the same declared distribution.

    generator:  what produced the rollouts: a system's name, or file:<name>.
    parameters: (name, value) pairs as text, sorted: the disturbance law of the system.
    k_law:      how k is drawn: "uniform" on [lo, hi], "given" with the values, "logged", "the
        sampler" with its name, or as a chained system has it.
    lo, hi:     (n_k,) corners of K, as hex floats.
    """

    generator: str
    parameters: tuple[tuple[str, str], ...]
    k_law: str
    lo: tuple[str, ...]
    hi: tuple[str, ...]

    @property
    def hash(self) -> str:
        """SHA-256 of the canonical JSON of all fields."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()

    @property
    def box(self) -> str:
        """What sentences call the box [lo, hi]: K, or N for a small box inside it."""
        return dict(self.parameters).get(BOX, "K")

    @property
    def fitted(self) -> str | None:
        """What K was fitted to, in words; None where it was declared."""
        return dict(self.parameters).get(FITTED)

    def describe(self) -> str:
        """One phrase for people."""
        others = (pair for pair in self.parameters if pair[0] != BOX)
        extra = "".join(f", {name.removeprefix(OURS)} = {value}" for name, value in others)
        return f"{self.generator} (k {self.how_drawn}{extra}; {self.hash[:8]})"

    @property
    def how_drawn(self) -> str:
        """How k is drawn, in words that follow "k"."""
        if self.k_law == "uniform":
            return f"uniform on {self.box}"
        as_it_was = self.k_law == "logged" or self.k_law.startswith(GIVEN)
        return f"{'as' if as_it_was else 'by'} {self.k_law}"


def law_spec(
    generator: str, domain: Box, k_law: str = "uniform", parameters: Mapping | None = None
) -> LawSpec:
    """The law of a named generator over K = domain, with the parameters of its disturbances."""
    pairs = tuple(sorted((str(name), str(value)) for name, value in (parameters or {}).items()))
    lo, hi = (tuple(hex_text(corner)) for corner in (domain.lo, domain.hi))
    return LawSpec(generator, pairs, k_law, lo, hi)


def law_of(system, k_law: str = "uniform") -> LawSpec:
    """The law of a system: its `law` (mapping or dataclass), and `plant` when that is a name.
    Raises InputError for a parameter with a name of ours.
    """
    with blamed(f"{system.name}: expected a law that can be read"):
        law = getattr(system, "law", None)
    parameters = dict((asdict(law) if is_dataclass(law) else law) or {})
    if isinstance(getattr(system, "plant", None), str):
        parameters["plant"] = system.plant
    ours = [name for name in parameters if str(name).startswith(OURS)]
    if ours:
        raise InputError(
            f"{system.name}: expected parameters of a law that do not begin with {OURS!r}; got "
            f"{', '.join(map(str, ours))}. Rename them."
        )
    return law_spec(system.name, system.domain, k_law, parameters)
