"""What the room offers: the one list, for type checkers and for the module beside it."""

from parc_jax.app.live import live as live
from parc_jax.app.plot.episode import Truth as Truth
from parc_jax.app.plot.film import film as film
from parc_jax.app.plot.page import write_page as write_page
from parc_jax.app.plot.regions import regions as regions
from parc_jax.app.plot.regions import safe_regions as safe_regions
from parc_jax.app.plot.samples import samples as samples
from parc_jax.app.plot.style import save as save
