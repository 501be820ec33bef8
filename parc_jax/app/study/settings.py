"""Settings of a study, from rollouts to a proved safe set: one frozen record."""

from dataclasses import dataclass

from parc_jax.common.errors import InputError, check_count
from parc_jax.learning.bound.counts import as_probability
from parc_jax.learning.learn import Learning
from parc_jax.safe_set.settings import Settings

WHOLE = Settings.whole()


@dataclass(frozen=True)
class Study(Learning):
    """Settings of a study: learning, the query, and the replay; `replace` reaches fields of
    the records in it, too. Raises InputError.
    """

    settings: Settings = WHOLE
    """The query."""
    risk: float | None = None
    """Most probability with which a plan drawn from the validated set may fail in this scene [T42];
    its runs are fresh ones of the system. Default: no set is validated."""
    repeats: int = 1
    """Runs of each returned plan in the replay, with fresh randomness."""
    driven: bool = False
    """Choose one plan, run it afresh and make a local claim near it, and report the sentence about
    it [T23]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.settings.samples_only:
            raise InputError("study: expected the whole safe set; got samples_only. Leave it out.")
        if self.risk is not None:
            as_probability("risk", self.risk)
        check_count("repeats", self.repeats, 1, "1 for a single run of each plan")
