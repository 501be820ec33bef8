"""Networks and claims side by side: how much of everything is safe under each."""

import jax

from parc_jax.app.study.numbers import eps_of
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.learning.learn import NetworkModels, final_error
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.nominal import query
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.verdict.scene import lowered, volume_of_all

COMPARED = 32_768  # points drawn to estimate the safe share of every row of the comparison


def compare(learned: NetworkModels, problem: Problem, key: jax.Array) -> list[dict]:
    """A row per claim of one network, the assumed one first: regions, final error, safe share."""
    regions = enumerate_regions(learned.honest.net, learned.honest.domain).count
    return [
        {
            "network": learned.name,
            "claim": model.claim.kind,
            "by_bin": model.claim.bin_eps is not None,
            "eps": eps_of(model.claim),
            "unclaimed_bins": int((~model.tube.claimed).sum()),
            "regions": regions,
            "final_error": final_error(model).tolist(),
            **safe_volume(model, problem, key),
        }
        for model in (learned.assumed, *learned.claimed)
    ]


def safe_volume(model: TrajectoryModel, problem: Problem, key: jax.Array) -> dict[str, float]:
    """Shares of all (p0, k) over K and the goal's box: `reaching` the goal in the model, `safe`."""
    scene = lowered(query(problem, model).nominal())
    seen = draw(scene, generator(stream(key, Stage.SEARCH)), COMPARED)
    share = seen.volume / volume_of_all(scene) / seen.drawn
    return {"reaching": seen.reaching * share, "safe": len(seen.safe.k) * share}
