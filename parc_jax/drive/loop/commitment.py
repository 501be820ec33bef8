"""What a loop has committed to, or why it goes on with the stop in hand."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import answer_part, sample_part
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import scene_along


@dataclass(frozen=True, eq=False)
class Commitment:
    """One manoeuvre, safe over all of its time for every run inside the tube; that the robot rests
    at its end is assumed. [T38] Proved in float64 with the margin that covers rounding; `proved`
    and `certificate` have the exact proof.

    number: from 0. begin, end: [s] of the loop's clock, from its pose to its end. k (n_k,): what
    was measured at the start and what is commanded. clearance: [m] kept from everything by every
    run inside the tube. judged: candidates that were looked at. asked: the plain question, told
    from the pose.
    """

    number: int
    begin: Fraction
    end: Fraction
    k: np.ndarray
    clearance: float
    judged: int
    asked: NominalProblem

    def __repr__(self) -> str:
        values = ", ".join(f"{x:.3g}" for x in self.k)
        return (
            f"<Commitment {self.number}: k = ({values}) from {float(self.begin):g} s to its end at "
            f"{float(self.end):g} s, {self.clearance:.3f} m clear>"
        )

    def proved(self) -> bool:
        """Does the exact checker accept it? Takes some ten to hundred milliseconds."""
        return bool(prove(self.asked.problem, self.asked.model, [self.part])[0][0])

    def certificate(self) -> dict:
        """A file for the checker: the question from this pose, and the plan as its one sample."""
        asked = self.asked
        pose = asked.pose
        meta = {
            "pose": [*pose.place.tolist(), pose.heading],
            "begin": str(self.begin),
            "end": str(self.end),
        }
        parts = [self.part]
        return answer_part(asked.problem, asked.model, parts, [], [], no_plan=None, meta=meta)

    @property
    def part(self) -> dict:
        """Its certificate, a sample of the checker."""
        path = paths_of(self.asked.model, self.asked.at[None], self.k[None])[0]
        scene = scene_along(self.asked, self.k, path)
        return sample_part(scene, scene.model.tube, self.asked.at, self.k, path)


@dataclass(frozen=True, eq=False)
class Step:
    """What to do now. committed: the manoeuvre that is under way from now on, None before the
    first one. new: it was committed to in this step; else the robot goes on with it, to its end.
    reason: why there is no new one, empty where there is.
    """

    committed: Commitment | None
    new: bool
    reason: str = ""
