"""What the room offers: the one list, for type checkers and for `__init__.py`."""

from parc_jax.loop.episodes import Episodes as Episodes
from parc_jax.loop.episodes import drive_episodes as drive_episodes
from parc_jax.loop.left import left_tube as left_tube
from parc_jax.loop.log import save_episode as save_episode
from parc_jax.loop.loop import Effort as Effort
from parc_jax.loop.loop import Loop as Loop
from parc_jax.loop.outcome import Outcome as Outcome
from parc_jax.loop.outlook import Outlook as Outlook
from parc_jax.loop.prover import Prover as Prover
from parc_jax.loop.thinking import Thinking as Thinking
