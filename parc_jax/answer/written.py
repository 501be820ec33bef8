"""An answer as certificates, with what else its file says of it."""

from parc_jax.answer.findings import Findings
from parc_jax.answer.statement import statement
from parc_jax.common.spelling import hex_text
from parc_jax.proof.certificate.write import answer_part


def written(found: Findings) -> dict:
    """What answer.json holds, as `Answer.to_json`."""
    no_plan = None if found.no_plan is None else found.no_plan.certificate
    return answer_part(
        found.problem,
        found.model,
        found.sample_parts,
        found.corridors,
        found.polytopes,
        no_plan=no_plan,
        meta=_meta(found),
    )


def _meta(found: Findings) -> dict:
    """What readers want to know and the checker need not."""
    meta: dict = {
        "status": found.status.label,
        "ended": None if found.ended is None else found.ended.label,
        "statement": statement(found),
        "counts": found.counts,
        "volume_drawn": found.cover.volume,
        "volume_of_all": found.whole,
        "coverage": found.coverage._asdict(),
        "corridor_coverage": found.corridor_coverage._asdict(),
    }
    if found.around is not None:
        meta["within"] = [hex_text(side) for side in found.around]
    if found.uncertainty is not None:
        meta["doubt"] = found.uncertainty.to_json()
    if found.scene.at is not None:
        meta["at"] = hex_text(found.scene.at)
    if found.looks.delta is not None:
        meta["looks"] = found.looks.to_json()
    if found.pose is not None:
        meta["pose"] = [*found.pose.place.tolist(), found.pose.heading]
    return meta
