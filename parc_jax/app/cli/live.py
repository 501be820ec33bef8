"""`parc-jax live`: a page where obstacles, goal and start are dragged, and safe plans follow."""

from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.options import Offer, Shell


def live(
    model: Path,
    scene: Path | None = None,
    /,
    *,
    at: str | None = None,
    port: int = 8080,
    shell: Annotated[Shell, Offer("app.cli.options.Shell", only=("quiet", "cache"))],
) -> int:
    """Drag obstacles, goal and start in the browser, and see safe plans follow. Example: parc-jax
    live drift_parking

    While something is dragged, plans are redrawn, each verified in float64; on release the set is
    measured, and where it is empty the page says what is in the way. The page saves the scene for
    `solve`, and a proved answer. It is served to this machine alone. Needs the extra live.

    Args:
        model: A model of `parc-jax learn` or `parc-jax run`, or a system of `parc-jax systems`
            whose model comes along.
        scene: The scene, a .toml file. Default: that of the model's system.
        at: Where the robot is, x,y or x,y,heading, which can be dragged too. Default: anywhere in
            the start set.
        port: Of this machine; the next that is free where it is taken.
    """
    from parc_jax.app.cli.process import COMPILING, say
    from parc_jax.app.cli.scene import place_of_option
    from parc_jax.app.cli.systems import asked_of
    from parc_jax.app.live import live as open_page

    learned, problem = asked_of(model, scene)
    say(COMPILING, shell.quiet)
    open_page(learned, problem, place_of_option(at), port)
    return 0
