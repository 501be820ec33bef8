"""Recorded runs judge an answer: each moved to starts from which the answer proves its k safe."""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.replay import Replay, replay
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import counted
from parc_jax.learning.bound.fresh import left_out_beside, not_named, used_by
from parc_jax.learning.bound.statement import UNSHOWN, confidence_of, probability
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import LEFT, OURS, LawSpec

STARTS = 10  # of those that prove safe, replayed at most


class Recorded(NamedTuple):
    """Replays of recorded runs. runs: their outcomes. plans (n, n_p + n_k) and row (n,): the
    replayed plans, and the run of each. with_start (n_runs,) bool: runs with a start that the
    answer proves safe. used: runs that are known to have made network or tube, with their copies
    and other parts of their recordings. gone: missing rows of their log, and of that of those.
    law: where they are from, with what never became a row of theirs. assumed: of other runs.
    under: the tube, where nothing showed it.
    """

    runs: Replay
    plans: np.ndarray
    row: np.ndarray
    with_start: np.ndarray
    law: LawSpec
    used: int = 0
    gone: int = 0
    assumed: tuple[str, ...] = ()
    under: str = ""

    @property
    def left_out(self) -> dict[str, int]:
        """Numbers of windows of their recordings that are no runs, by the reason."""
        ours = ((x.removeprefix(OURS), n) for x, n in self.law.parameters if x.startswith(OURS))
        told = ((name, n.removesuffix(LEFT).replace(",", "")) for name, n in ours if LEFT in n)
        return {name: int(n) for name, n in told if n.isdecimal()}  # `finite` says all

    def counts(self) -> dict[str, int]:
        """Numbers of runs, of those that test nothing, of their replays, and of the outcomes."""
        done = self.runs
        counts = {"runs": len(self.with_start), "with_start": int(self.with_start.sum())}
        counts |= {"replays": len(self.plans), "left_the_tube": int((~done.inside).sum())}
        counts |= {"missed_the_goal": int((~done.reached).sum())}
        counts |= {"touched": int(done.touched.sum())}
        counts |= {"made_the_tube": self.used, "rows_left_out": self.gone}
        return counts | {"windows_left_out": sum(self.left_out.values())}

    def details(self) -> str:
        """One sentence."""
        n, inside = self.counts(), int((self.runs.inside & self.runs.failed).sum())
        return (
            f"At least {n['with_start']:,} of {n['runs']:,} recorded runs have a k with a start "
            f"that is shown to be safe{self.under}; of {n['replays']:,} replays from such starts "
            f"{n['left_the_tube']:,} left the tube, {n['missed_the_goal']:,} missed the goal, "
            f"{n['touched']:,} touched an obstacle; {inside or 'none'} that stayed in the tube "
            "failed."
            f" The runs are of {self.law.describe()}."
            + self._made()
            + f" {counted(self.gone, 'row was', 'rows were')} left out of their log, or of that of "
            "the tube's runs."
            * (self.gone > 0)
            + f" {counted(n['windows_left_out'], 'window')} never became runs."
            * bool(self.left_out)
            + f" Assumes of the others: FRESH({', '.join(self.assumed)})." * bool(self.assumed)
        )

    def _made(self) -> str:
        """Runs that test nothing."""
        if not self.used:
            return ""
        some = "At least " if self.assumed and self.used < len(self.with_start) else ""
        told = "they, copies of them or parts of their recordings made the tube"
        return f" {some}{self.used:,} of these runs do not test it: {told}."


def replay_recorded(answer: Answer, runs: RolloutBatch) -> Recorded | None:
    """Move every recorded run to starts from which the answer proves its k safe, at most STARTS
    each; None where no run has one.

    Raises InputError for an answer under uncertainty, or runs on another time grid or of other
    points; SoundnessError when a proof and a run that stays in the tube disagree.
    """
    if answer.scene.nominal.uncertainty is not None:
        raise InputError(
            "replay_recorded: expected an answer without uncertainty, since recorded runs were "
            "executed as they are; solve the same problem with uncertainty=None."
        )
    # of each run at most STARTS plans that the answer proves safe with its k
    known = np.flatnonzero(answer.model.domain.contains(runs.k))
    starts = answer.starts(jax.random.PRNGKey(0), runs.k[known], STARTS)
    row = np.repeat(known, [len(p0) for p0 in starts])
    if not len(row):
        return None
    plans = np.concatenate([np.concatenate(starts), runs.k[row]], axis=1)
    done = replay(runs.select(row), answer.scene, plans)
    claim, of = answer.model.claim, np.isin(np.arange(runs.n), row)
    used, gone = int((used_by(claim, runs) != "").sum()), left_out_beside(claim, runs)
    assumed, under = tuple(not_named(claim, runs.seed is None)), UNSHOWN.get(claim.kind, "")
    if "risk" in (p := claim.premises):
        risk = f"risk of a plan of its law at most {probability(p['risk'])}"
        under += f" ({risk}, confidence {confidence_of(p)})"
    return Recorded(done, plans, row, of, runs.law, used, gone, assumed, under)
