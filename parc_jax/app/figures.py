"""Every figure by its name, for papers and notebooks: `from parc_jax import figures`, then
`figures.samples(answer)`. What each shows, and where it draws, is said in `parc_jax.app.plot`.
"""

from parc_jax.app.plot.claim import claim
from parc_jax.app.plot.cover import CoverCurve, cover
from parc_jax.app.plot.episode import film_episode
from parc_jax.app.plot.episode_page import write_episode_page
from parc_jax.app.plot.errors import Entry, errors
from parc_jax.app.plot.film import film
from parc_jax.app.plot.gap import GapCurve, GapRoom, gap
from parc_jax.app.plot.html import write_page
from parc_jax.app.plot.manoeuvres import Truth
from parc_jax.app.plot.projections import projections
from parc_jax.app.plot.regions import regions
from parc_jax.app.plot.samples import samples
from parc_jax.app.plot.spread import spread
from parc_jax.app.plot.style import save
from parc_jax.app.plot.timeline import timeline
from parc_jax.neuralparc.verdicts import region_verdicts

__all__ = [
    "CoverCurve",
    "Entry",
    "GapCurve",
    "GapRoom",
    "Truth",
    "claim",
    "cover",
    "errors",
    "film",
    "film_episode",
    "gap",
    "projections",
    "region_verdicts",
    "regions",
    "samples",
    "save",
    "spread",
    "timeline",
    "write_episode_page",
    "write_page",
]
