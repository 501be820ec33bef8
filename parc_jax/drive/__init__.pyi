"""What the room offers: the one list, for type checkers and for `__init__.py`."""

from parc_jax.drive.local.localise import Local as Local
from parc_jax.drive.local.validation import Validate as Validate
from parc_jax.drive.loop.candidates import Outlook as Outlook
from parc_jax.drive.loop.candidates import Thinking as Thinking
from parc_jax.drive.loop.commitment import left_tube as left_tube
from parc_jax.drive.loop.episode_file import save_episode as save_episode
from parc_jax.drive.loop.episodes import Episodes as Episodes
from parc_jax.drive.loop.episodes import drive_episodes as drive_episodes
from parc_jax.drive.loop.loop import Effort as Effort
from parc_jax.drive.loop.loop import Loop as Loop
from parc_jax.drive.loop.reserved import reserved as reserved
from parc_jax.drive.loop.workers import Outcome as Outcome
from parc_jax.drive.shield import Sensed as Sensed
from parc_jax.drive.shield import Shield as Shield
from parc_jax.drive.shield_batch import BatchShield as BatchShield
