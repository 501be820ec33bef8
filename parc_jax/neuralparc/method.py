"""The published search, as a method of a query: a baseline beside `parc_jax.method.Exact`."""

import time
from dataclasses import dataclass

import jax

from parc_jax.common.errors import InputError
from parc_jax.common.keys import generator
from parc_jax.common.status import Ended
from parc_jax.neuralparc.cells import cells_outward
from parc_jax.neuralparc.scene import paper_scene
from parc_jax.neuralparc.search import paper_search
from parc_jax.proof.regions import regions_of
from parc_jax.safe_set.corridors.found import Cover
from parc_jax.safe_set.corridors.sampling import points
from parc_jax.safe_set.corridors.stopping import nothing_covered
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene


@dataclass(frozen=True)
class Published:
    """The published search, samples only, region by region from the middle of K outward.
    [NP, Sec. IV]

    lps: decide with linear programs, as published; False does the same through support functions.
    """

    lps: bool = False

    def search(self, scene: Scene, key: jax.Array, settings: Settings) -> tuple[Cover, None]:
        """A cover without corridors, of plans that the exact verdict accepts. Consumes `key`."""
        if scene.at is not None:
            raise InputError(
                "at: expected the exact engine for plans from one place; the published search "
                "knows sets of starts only. Leave method out."
            )
        begin = time.perf_counter()
        model = scene.model
        cells = cells_outward(regions_of(model), model.tube, model.domain.center)
        method = "lp" if self.lps else "supports"
        asked = paper_scene(scene.problem, model.tube)
        drawn = paper_search(key, cells, asked, method=method).samples
        p0 = drawn[:, : model.n_p]
        k = drawn[:, model.n_p :]
        e = verdicts(scene, p0, k)
        seen = points(p0, k, e).at(e.safe)
        none = nothing_covered(settings.confidence)
        found = Cover(
            drawn=len(drawn),
            reaching=len(drawn),
            safe=len(seen.k),
            volume=float("nan"),
            points=seen,
            coverage=none,
            first_sample_s=time.perf_counter() - begin if len(seen.k) else None,
            ended=Ended.TARGET if len(seen.k) else Ended.WORK,
        )
        return found.pick(generator(key), settings.samples), None
