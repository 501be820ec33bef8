"""`parc-jax plot`: pictures of an answer, one interactive page, or a film."""

import importlib
import sys
from pathlib import Path
from typing import Literal

Figure = Literal["samples", "regions", "projections", "timeline"]


def plot(
    answer: Path,
    /,
    *,
    html: Path | None = None,
    out: Path | None = None,
    figures: tuple[Figure, ...] | None = None,
    video: Path | None = None,
    sample: int = 0,
    quiet: bool = False,
) -> int:
    """Draw an answer from its file alone. Example: parc-jax plot answer.json --html page.html

    Figures as PNG and PDF: parc-jax plot answer.json --out figures --figures samples regions

    A film of one plan in its simulator: parc-jax plot answer.json --video film.gif --sample 3

    Args:
        answer: An answer file of `solve` or `run`.
        html: Write one interactive page: scene, time slider, p0 and k by dragging with the verdict live.
        out: Folder of the figures. Default: the answer's own.
        figures: Which figures. Default: all that the answer supports, or none with --html or --video.
        video: Simulate one safe sample and film it: .gif, .mp4 (needs the extra film), or a folder of .png files.
        sample: Number of the sample that is filmed.
        quiet: Do not name the files.
    """
    from parc_jax.plot.html import write_page

    if figures is None and (html is not None or video is not None):
        figures = ()
    drawn = [write_page(answer, html)] if html is not None else []
    if figures is None or figures:
        drawn += _figures(answer, out or answer.parent, figures)
    if video is not None:
        drawn.append(_film(answer, video, sample))
    if not quiet:
        print("\n".join(str(path) for path in drawn))
    return 0


def _figures(path: Path, out: Path, wanted) -> list[Path]:
    from parc_jax.cli.systems import settings
    from parc_jax.errors import InputError
    from parc_jax.exchange.answer_file import load_answer

    answer = load_answer(path)
    study, possible = settings(answer.model.system), _possible(answer)
    chosen = tuple(possible) if wanted is None else wanted
    for name in chosen:
        if name not in possible:
            raise InputError(f"{name}: this answer supports {', '.join(possible) or 'no figure'} only.")
    if not chosen:
        print("parc-jax: the answer has no plans and no plane of parameters to draw.", file=sys.stderr)
    return [_draw(name, answer, out / f"{name}.png", study) for name in chosen]


def _film(path: Path, out: Path, sample: int) -> Path:
    from parc_jax.cli.systems import find
    from parc_jax.errors import InputError
    from parc_jax.exchange.answer_file import load_answer

    answer = load_answer(path)
    home = find(answer.model.system, needed=()).__name__
    try:
        film = importlib.import_module(f"{home}.film")
    except ModuleNotFoundError:
        raise InputError(
            f"video: expected a system that can be filmed; {answer.model.system!r} has no module {home}.film with a "
            "function film_of(answer, out, sample)."
        ) from None
    return film.film_of(answer, out, sample)


def _possible(answer) -> list[str]:
    planar = answer.model.n_p == 2
    return [
        *(["samples"] if len(answer.samples) and planar else []),
        *(["regions"] if 2 <= answer.model.n_k <= 3 else []),
        *(["projections"] if answer.pieces else []),
        *(["timeline"] if len(answer.samples) and answer.problem.obstacles and planar else []),
    ]


def _draw(name: Figure, answer, path: Path, study) -> Path:
    if name == "samples":
        from parc_jax.plot.samples import samples

        samples(answer, None, path, heading=study.heading)
    elif name == "regions":
        from parc_jax.plot.regions import regions
        from parc_jax.plot.verdicts import region_verdicts
        from parc_jax.pwa import enumerate_regions

        table = enumerate_regions(answer.model.net, answer.model.domain)
        safe_k = answer.samples[:, answer.model.n_p :]
        regions(table, region_verdicts(answer, table), None, path, names=study.parameters or None, safe_k=safe_k)
    elif name == "projections":
        from parc_jax.plot.projections import projections

        planar = answer.model.n_p == 2 and study.parameters
        projections(answer, to=path, names=("x [m]", "y [m]", *study.parameters) if planar else None)
    else:
        from parc_jax.plot.timeline import timeline

        timeline(answer, to=path)
    return path
