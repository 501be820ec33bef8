"""The corridors of an answer, cut into polytopes after the query."""

import jax

from parc_jax.answer.findings import Findings
from parc_jax.proof.certificate.prove import prove
from parc_jax.safe_set.corridors.found import Cover
from parc_jax.safe_set.corridors.later import cut_later


def with_polytopes(found: Findings, key: jax.Array, n: int) -> tuple[Cover, int]:
    """The cover with polytopes around n fresh safe plans, and how many the exact checker refused:
    proved where the answer is. [T31]
    """
    cover = found.cover
    asked = found.scene, key, found._corridors, cover.within
    polytopes, coverage = cut_later(*asked, n, cover.kept.confidence)
    refused = 0
    if found.proved:
        accepted = prove(found.problem, found.model, [], (), polytopes)[2]
        refused = int((~accepted).sum())
        if refused:
            polytopes = [p for p, kept in zip(polytopes, accepted, strict=True) if kept]
            coverage = coverage._replace(at_least=0.0)
    return cover._replace(polytopes=polytopes, coverage=coverage), refused
