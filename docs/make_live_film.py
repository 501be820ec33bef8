"""The film of `live`: the mouse drags a parked car in a real browser, and safe plans follow.

python docs/make_live_film.py docs/pictures/live_film.gif      (Chromium, and the extra live)
"""

import io
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from parc_jax import figures
from parc_jax.app.cli.systems import model_of, scene_of
from parc_jax.app.plot.film import write_film

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
BY = (2.2, -2.2)  # [m] of the drags along x
RATE, STILL = 4.0, 12  # [1/s] frames; so many of what was measured
COLOURS = 64


def main(out: Path) -> None:
    """Drag and write."""
    from live_tab import Tab

    model = model_of(Path("drift_parking"), None)
    page = figures.live(model, scene_of(model), wait=False)
    page.server.initial_camera.look_at = (25.0, -9.5, 0.0)
    page.server.initial_camera.position = (25.0, -15.0, 21.0)
    frames: list[np.ndarray] = []
    with tempfile.TemporaryDirectory() as folder, Tab(page, Path(folder), (820, 480)) as tab:

        def shoot(n: int = 1) -> None:
            image = Image.open(io.BytesIO(tab.picture())).convert("RGB")
            frames.extend([np.asarray(image)] * n)

        def measured() -> None:
            time.sleep(1.0)
            while "measured" not in page.told:
                time.sleep(0.1)
            time.sleep(1.5)  # until it is drawn
            shoot(STILL)

        measured()
        close = "document.querySelectorAll('[class*=Notification] button')"
        tab.run(f"{close}.forEach(button => button.click())")  # that WebGL has no GPU
        time.sleep(1.0)
        frames.clear()
        measured()
        for by in BY:
            tab.drag("obstacle 0", 0, by, shoot)
            measured()
    page.stop()
    write_film(out, frames, RATE, COLOURS)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
