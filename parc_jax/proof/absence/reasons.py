"""Why no plan of a box is safe, as a certificate says it: it misses the goal, starts elsewhere, or
is in contact. [T15, T16, T36]
"""

import itertools
from fractions import Fraction

import numpy as np
from jaxtyping import Float

from parc_jax.common.spelling import fraction_text
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.problem.body import numbered
from parc_jax.proof.absence.bin_errors import BinErrors
from parc_jax.proof.absence.contact_errors import ContactErrors
from parc_jax.proof.absence.contact_margins import SHARES
from parc_jax.proof.absence.contacts import Contacts, short_weights
from parc_jax.proof.absence.examined import Batch
from parc_jax.proof.absence.faces import goal_entry
from parc_jax.proof.absence.tree import Node
from parc_jax.safe_set.verdict.scene import Scene


class Reasons:
    """Spells the reasons of one scene's boxes."""

    def __init__(self, scene: Scene, errors: BinErrors):
        model = scene.model
        problem = scene.problem
        self.model = model
        self.problem = problem
        self.errors = errors
        self.contacts = [
            Contacts(problem, o, part)
            for o in range(len(problem.obstacles))
            for part in range(len(problem.parts))
        ]
        self.parts = numbered(problem.body, model.points)
        self.goal_rows = len(problem.goal.b)
        self.start_rows = 0 if problem.start is None else len(problem.start.b)

    def of(self, batch: Batch, i: int):
        """(reason, what) of one box, the cheapest to check first, or None."""
        found = self._reason(batch, i)
        if found is None or not batch.bounded or (found[0] == "goal" and self._about_z(found[1])):
            return found
        return "bounded", dict([found])

    def _about_z(self, entries: list) -> bool:
        """Whether the rows of the goal that a leaf names are about z alone: no bound is asked."""
        A = self.problem.goal.A[:, self.model.n_p :]
        return not A[[row for row, *_ in entries]].any()

    def _reason(self, batch: Batch, i: int):
        """The reason of one box and what it names, or None."""
        margin = TOLERANCES.leaf_margin
        seen = batch.seen
        goal = seen.goal[i, : self.goal_rows]
        if goal.max(initial=-np.inf) > margin:
            errors = self.errors.at_end(batch.over[i].bins)
            return "goal", [goal_entry(self.errors, errors, int(np.argmax(goal)), Fraction(1))]
        start = seen.start[i, : self.start_rows]
        if start.max(initial=-np.inf) > margin:
            return "start", [[int(np.argmax(start)), "1"]]
        for c in np.flatnonzero(seen.hit[i] > margin):
            what = self._hit(batch, i, c)
            if what is not None:
                return "hit", what
        return None

    def _hit(self, batch: Batch, i: int, c: int) -> list | None:
        """What a certificate says of contact c of one box, or None where it cannot be written."""
        pair, t, share = batch.seen.which[i, c].tolist()
        points = list(self.parts[pair % len(self.parts)].points)
        at = batch.seen.at[batch.owner == i, c][:, points]
        corners: dict = {}  # those of z that have a mixture in common share its contacts
        mixtures = batch.seen.weights[i, c][:, points]
        for corner, given in zip(_corners(batch.nodes[i], self.model.n_p), mixtures, strict=True):
            corners.setdefault(tuple(short_weights(given)), []).append(corner)
        groups = []
        for weights, some in corners.items():
            mixed = np.array(weights, float)
            errors = self.errors.of_contact(batch.over[i], t, points, mixed)
            places = np.array(some)[:, None] + mixed @ at
            entries = self._contacts(pair, places, errors, batch.bounded)
            if entries is None:
                return None
            groups.append([fraction_text(weights), entries])
        moment = [t, str(Fraction(SHARES[share]))]
        return [*divmod(pair, len(self.parts)), *moment, groups]

    def _contacts(
        self, pair: int, places: Float[np.ndarray, "z v n_p"], errors: ContactErrors, bounded: bool
    ) -> list | None:
        """Contacts that serve all places of a mixture: z corners, v vertices of k. By
        bounds one serves all that a corner has; else each vertex may have its own.
        """
        if not bounded:
            return self.contacts[pair].find(places.reshape(-1, self.model.n_p), errors)
        entries: list = []
        for served in places:
            found = self.contacts[pair].find(served, errors, most=1)
            if found is None:
                return None
            entries += [entry for entry in found if entry not in entries]
        return entries


def _corners(node: Node, n_p: int) -> np.ndarray:
    """Corners (2^n_p, n_p) of the box of z."""
    sides = zip(node.lo[:n_p], node.hi[:n_p], strict=True)
    return np.array(list(itertools.product(*sides)))
