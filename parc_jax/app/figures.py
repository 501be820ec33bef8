"""Every figure by its name, for papers and notebooks: `from parc_jax import figures`, then
`figures.samples(answer)`. `parc_jax.app.plot` describes each, and where it draws.
"""

from parc_jax.app.plot.episode import Truth
from parc_jax.app.plot.errors import Entry, claim, errors
from parc_jax.app.plot.film import film
from parc_jax.app.plot.page import write_page
from parc_jax.app.plot.projections import projections
from parc_jax.app.plot.regions import regions
from parc_jax.app.plot.samples import samples
from parc_jax.app.plot.spread import spread
from parc_jax.app.plot.style import save
from parc_jax.app.plot.timeline import timeline
from parc_jax.neuralparc.answer import region_verdicts

__all__ = [
    "Entry",
    "Truth",
    "claim",
    "errors",
    "film",
    "projections",
    "region_verdicts",
    "regions",
    "samples",
    "save",
    "spread",
    "timeline",
    "write_page",
]
