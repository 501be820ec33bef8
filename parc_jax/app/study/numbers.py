"""Numbers for people, and facts for other programs."""

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.corridors.sampling import FEW

IN_THE_BOX = "the plans whose first point ends in the goal's box, whatever else the goal asks"


def eps_of(claim: ErrorClaim) -> str | None:
    """The eps that a claim says, for people, by bin the largest; None where nothing is shown."""
    known = [claim.eps, *(claim.bin_eps or ())]
    known = [eps for eps in known if eps is not None]
    return rounded_up(max(known)) if known else None


def final_error(model: TrajectoryModel) -> np.ndarray:
    """Median half widths (n_c + n_q,) of the tube at the end, over the bins with a bound; infinite
    where there is none.
    """
    final = model.tube.final[model.tube.claimed]
    return np.median(final, axis=0) if len(final) else np.full(model.n_c + model.n_q, np.inf)


def name_of_network(net: ReLUNetwork) -> str:
    """The widths of its layers, or PARC for one affine map."""
    return "-".join(map(str, net.hidden)) or "PARC"


def seconds(value: float | None) -> str:
    """A time for people."""
    if value is None:
        return "-"
    return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"


def facts_of(answer: Answer, cold_s: float | None) -> dict:
    """What was found, of what, how far it went and how long it took, as plain data. cold_s: [s] to
    the first sample of a first query, compiling included; None where that is this answer.
    """
    return {
        "counts": answer.counts,
        "safe_share": None if answer.safe_share is None else answer.safe_share._asdict(),
        "volume": answer.volume(),
        "polytopes": len(answer.polytopes),
        "coverage": answer.coverage._asdict(),
        "corridors": len(answer.corridors),
        "corridor_coverage": answer.corridor_coverage._asdict(),
        "status": answer.status.label,
        "ended": None if answer.ended is None else answer.ended.label,
        "refused": answer.refused,
        "first_sample_cold_s": answer.timings["first_sample_s"] if cold_s is None else cold_s,
        "timings": answer.timings,
    }


def table_of(answer: Answer, cold_s: float | None) -> list[str]:
    """What a query found, line by line. cold_s: as of `facts_of`."""
    t = answer.timings
    part = "the safe set" + ("" if answer.around is None else " around what a search found")
    times = [f"{seconds(t['first_sample_s'])} {'cold' if cold_s is None else 'warm'}"]
    if cold_s is not None:
        times = [f"{seconds(cold_s)} cold", *times]
    lines = [f"first safe sample      {', '.join(times)}"]
    if answer.corridors or answer.polytopes or not answer.found:
        # where one plan was asked for and found, too few were drawn to say how many are safe
        lines = [f"safe                   {how_much_is_safe(answer)}", *lines]
    if answer.corridors:
        covered = covering(answer.corridor_coverage._asdict(), part)
        lines.append(f"corridors              {len(answer.corridors)}, {covered}")
    if answer.polytopes:
        covered = covering(answer.coverage._asdict(), part)
        lines.append(f"first safe polytope    {seconds(t['first_polytope_s'])} warm")
        lines.append(f"safe polytopes         {len(answer.polytopes)}, {covered}")
    if answer.corridors or answer.polytopes:
        lines.append(f"safe set               in {seconds(t['cover_s'])}")
    proof = f"{answer.status}, {answer.refused} refused, in {seconds(t['proof_s'])}"
    return [*lines, f"proof                  {proof}"]


def covering(coverage: dict, part: str = "the safe set") -> str:
    """For people: how much of the safe set, or of a part, the fields of a `Coverage` cover."""
    if coverage["share"] == 0:
        return f"how much of {part} they cover was not measured"
    return (
        f"covering {100 * coverage['share']:.2f} % of {part} (at least "
        f"{rounded_down(100 * coverage['at_least'], 4)} % with "
        f"confidence {rounded_down(str(coverage['confidence']), 10)})"
    )


def how_much_is_safe(answer: Answer) -> str:
    """The number to tune by: what the tube leaves of all plans, and obstacles of that."""
    share = answer.safe_share
    if share is None:
        return "what share of the plans was not measured"
    of_all = "all k in K" if answer.scene.at is not None else IN_THE_BOX
    low, high = rounded_down(100 * share.at_least, 3), rounded_up(100 * share.at_most, 3)
    sure = f"with confidence {rounded_down(str(share.confidence), 10)}"
    if answer.counts["safe"] < FEW:  # of a query for a first plan
        return f"{low} % to {high} % of {of_all}, {sure}"
    said = f"{_percent(share.share)} of {of_all} ({low} % to {high} % {sure})"
    if answer.around is not None:
        return f"{said}, counting only those around what a search found"
    kept = share.share / share.reaching if share.reaching else 0.0
    return f"{said}: the tube leaves {_percent(share.reaching)}, obstacles {_percent(kept)} of that"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def spread(values: np.ndarray, model: TrajectoryModel, digits: str = ".2f") -> str:
    """Half widths (n_c + n_q,) at the end in words; per axis of the point where it is widest."""
    values = np.asarray(values)
    places = values[: model.n_c].reshape(model.n_points, model.n_p).max(axis=0)
    parts = zip([*places, *values[model.n_c :]], model.labels.goal, strict=True)
    said = ", ".join(
        f"±{v:{digits}} {unit_of(n)} {name_of(n)}".replace("  ", " ") for v, n in parts
    )
    return said if model.n_points == 1 else f"{said}, at the widest of {model.n_points} points"
