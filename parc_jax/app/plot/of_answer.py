"""Which figures an answer supports, by name: the one list, for the shell and for the report."""

from collections.abc import Callable
from pathlib import Path

from parc_jax.answer.answer import Answer
from parc_jax.app.plot.regions import regions
from parc_jax.app.plot.samples import samples
from parc_jax.app.study.replay import Replay
from parc_jax.proof.regions import RegionTable, enumerate_regions


def pictures(folder: Path) -> list[Path]:
    """The pictures of figures that are in a folder."""
    names = (f"{x}.{kind}" for x in ("samples", "regions") for kind in ("png", "pdf"))
    return [place for name in names if (place := folder / name).exists()]


def figures_of(
    answer: Answer, runs: Replay | None = None, table: RegionTable | None = None
) -> dict[str, Callable[[Path], object]]:
    """What draws each figure that the answer supports on a path.

    runs: replay of its samples; None draws none.
    table: regions of its network; None enumerates them when they are drawn.
    """
    model = answer.model

    def draw_regions(path: Path):
        found = enumerate_regions(model.net, model.domain) if table is None else table
        return regions(answer, found, path)

    supported: dict[str, Callable[[Path], object]] = {}
    if len(answer.samples):
        supported["samples"] = lambda path: samples(answer, runs, path)
    if 2 <= model.n_k <= 3:
        supported["regions"] = draw_regions
    return supported
