"""What of an answer a proof bears out: an entry may leave a file of parc_jax's certificates beside
its answer, which `parc-jax check` would take. They say of which plans no run inside of a tube of
its own touches anything or misses the goal; how likely runs are in that tube they do not say.
"""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.suite.answer import SOME, Sets, read
from benchmarks.suite.bad import Refused
from benchmarks.suite.instances import Instance

FILE = "certificate.json"
DRAWN = 2000  # plans


def certified(instance: Instance, answer: bytes, room: Path) -> float | None:
    """Share of plans drawn evenly from the sets of an answer which the certificates in a folder
    hold, once the exact checker has accepted them and they are about this scene; None without any.
    """
    path = room / FILE
    if not path.is_file():
        return None
    from parc_jax.common.errors import InputError

    try:
        given = read(answer, *instance.bounds)
        sets = Sets(given.pieces, np.random.default_rng(0)) if given.verdict == SOME else None
        if not sets:
            return None
        p0, k = np.split(sets.draw(DRAWN), [instance.black_box.n_p], axis=1)
        return float(_held(instance, path, p0, k).mean())
    except (Refused, InputError):
        return 0.0


def _held(instance: Instance, path: Path, p0: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(n,) bool: which plans the certificates hold. Raises InputError."""
    import parc_jax as pj
    from benchmarks.suite.entries.engine import read_scene
    from parc_jax.app.files.answer_file import load_answer
    from parc_jax.proof.certificate.write import problem_part

    proved, box = load_answer(path), instance.black_box
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(instance.scene_text)
        asked = read_scene(scene, box.points, box.n_p, len(box.q))
    whole = pj.Planner(proved.model).prepare(asked).scene.nominal.query.nominal()
    if problem_part(whole.problem, proved.model) != problem_part(
        proved.scene.problem, proved.model
    ):
        return np.zeros(len(k), bool)
    return proved.contains(p0, k if proved.model.n_k == k.shape[1] else np.hstack([p0, k]))
