"""The planner: one model, any number of queries."""

import time

import jax
import numpy as np

from parc_jax.answer import LEVELS, Answer
from parc_jax.certify.certificate import sample_part
from parc_jax.certify.cover import cover
from parc_jax.certify.draw import generator
from parc_jax.certify.prove import prove
from parc_jax.certify.scene import scene
from parc_jax.certify.union import SafeUnion
from parc_jax.errors import InputError
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid


class Planner:
    """Answers reach-avoid queries about one model.

    model: network, claim, domain and time grid of the system.
    """

    def __init__(self, model: TrajectoryModel):
        self.model = model

    def solve(
        self, problem: ReachAvoid, key: jax.Array, *, n_samples: int = 100, target: float = 0.01,
        confidence: float = 0.99, budget_s: float = 20.0, proof: bool = True,
    ) -> Answer:  # fmt: skip
        """The safe set of one problem, as samples and polytopes with certificates. Uses the SEARCH stream of `key`.

        n_samples: safe plans to return. target, confidence: the polytopes leave out at most `target` of the model's
        safe set, with this confidence, unless budget_s [s] ends first. proof: check all of it in exact arithmetic.
        Raises InputError when the problem does not fit the model.
        """
        if not 0 < target < 1 or not 0 < confidence < 1:
            raise InputError(f"solve: expected target and confidence between 0 and 1; got {target}, {confidence}.")
        begin = time.perf_counter()
        rng = generator(stream(key, Stage.SEARCH))
        laid_out = scene(problem, self.model)
        found = cover(self.model, problem, laid_out, rng, target=target, confidence=confidence, budget_s=budget_s)
        covered = time.perf_counter()
        pick = rng.permutation(len(found.points.k))[:n_samples]
        parts = [
            sample_part(problem, laid_out, self.model.tube, p.p0, p.k, p.path, int(p.bin))
            for p in (found.points.at(i) for i in pick)
        ]
        samples = np.concatenate([found.points.p0[pick], found.points.k[pick]], axis=1)
        pieces, level, refused = found.pieces, LEVELS[0], 0
        if proof:
            kept_samples, kept_pieces = prove(problem, self.model, parts, pieces)
            refused = int((~kept_samples).sum() + (~kept_pieces).sum())
            samples, parts = samples[kept_samples], [s for s, keep in zip(parts, kept_samples, strict=True) if keep]
            pieces, level = [p for p, keep in zip(pieces, kept_pieces, strict=True) if keep], LEVELS[1]
        timings = {
            "first_sample_s": found.first_sample_s, "first_piece_s": found.first_piece_s,
            "cover_s": covered - begin, "proof_s": time.perf_counter() - covered,
        }  # fmt: skip
        union = SafeUnion(self.model, laid_out, pieces)
        return Answer(self.model, problem, laid_out, found, samples, parts, union, level, refused, timings)
