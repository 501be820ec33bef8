"""`parc-jax plot`: pictures of an answer, one interactive page, or a film."""

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

from parc_jax.app.cli.offer import Offer
from parc_jax.app.cli.shell import Shell
from parc_jax.common.errors import InputError

Figure = Literal["samples", "regions", "projections", "timeline"]
Job = tuple[str, Callable[[], Path]]  # what is drawn, and what draws it and names the file


def plot(
    answer: Path,
    /,
    *,
    html: Path | None = None,
    out: Path | None = None,
    figures: tuple[Figure, ...] | None = None,
    video: Path | None = None,
    sample: int = 0,
    system: str | None = None,
    shell: Annotated[Shell, Offer("app.cli.shell.Shell", only=("quiet",))],
) -> int:
    """Draw an answer from its file alone. Example: parc-jax plot answer.json --html page.html

    Figures as PNG and PDF: parc-jax plot answer.json --out figures --figures samples regions

    A film of one plan in its simulator: parc-jax plot answer.json --video film.gif --sample 3

    An episode, as it was committed to: parc-jax plot drive.json --html drive.html --video film.gif

    Args:
        answer: An answer file of `solve` or `run`, or an episode of `pj.loop.save_episode`.
        html: Write one interactive page: scene, time slider, p0 and k by dragging or typing, with
            the verdict live; of an episode what was under way at any time, and why.
        out: Folder of the figures. Default: the answer's own.
        figures: Which figures. Default: all that the answer supports but projections, which cut
            polytopes, or none with --html or --video.
        video: Film one safe sample: .gif, .mp4 (needs the extra film), or a folder of .png files.
            Without a simulator the film shows the model's prediction.
        sample: Number of the sample that is filmed, from 0.
        system: Simulator for the film, as for `learn`. Default: the system that the answer names,
            where it can be found.
    """
    from tqdm import tqdm

    from parc_jax.app.cli.places import require_place
    from parc_jax.app.files.answer_file import load_answer
    from parc_jax.app.files.episode_file import is_episode
    from parc_jax.app.plot.film_file import require_kind, require_sample

    episode = is_episode(answer)
    if episode and html is None and video is None:
        raise InputError(
            f"{answer} is an episode: expected --html FILE, its page, or --video FILE."
        )
    if figures is None and (html is not None or video is not None):
        figures = ()
    drawn_here = figures != () and not episode
    for place in (html, (out or answer.parent) / "samples.png" if drawn_here else None):
        require_place(place)
    if video is not None:
        require_kind(video)
        require_place(video, folder=not video.suffix)
    if episode:
        return _plot_episode(answer, html, video, shell.quiet)
    with tqdm(
        desc="checking the answer", total=1, disable=shell.quiet, leave=False, delay=0.5
    ) as bar:
        loaded = load_answer(answer)
        bar.update()
    if video is not None:
        require_sample(loaded, sample)
    jobs = _jobs(loaded, html, out or answer.parent, figures)
    drawn = []
    still = shell.quiet or not jobs
    with tqdm(desc="drawing", total=len(jobs), disable=still, leave=False) as bar:
        for name, draw in jobs:
            bar.set_description(f"drawing {name}")
            drawn.append(draw())
            bar.update()
    if video is not None:
        drawn.append(_film(loaded, video, sample, system, shell.quiet))
    if not shell.quiet:
        print("\n".join(str(path) for path in drawn))
    return 0


def _plot_episode(path: Path, html: Path | None, video: Path | None, quiet: bool) -> int:
    """Of an episode there are a page and a film."""
    from parc_jax.app.files.episode_file import load_episode
    from parc_jax.app.plot.episode import film_episode
    from parc_jax.app.plot.episode_page import write_episode_page

    driven, drawn = load_episode(path), []
    if html is not None:
        drawn.append(write_episode_page(driven, html))
    if video is not None:
        drawn.append(film_episode(driven, video, quiet=quiet))
    if not quiet:
        print("\n".join(map(str, drawn)))
    return 0


def _jobs(answer, html: Path | None, out: Path, wanted) -> list[Job]:
    """What is to be drawn. Raises InputError for a figure that the answer does not support."""
    from parc_jax.app.plot.html import write_page

    possible = _possible(answer)
    # polytopes have to be cut for this picture: it is drawn by name only
    unasked = [name for name in possible if name != "projections"]
    chosen = unasked if wanted is None else wanted
    for name in chosen:
        if name not in possible:
            raise InputError(
                f"{name}: this answer supports {', '.join(possible) or 'no figure'} only."
            )
    if not chosen and html is None and wanted is None:
        print(
            "parc-jax: the answer has no plans and no plane of parameters to draw.", file=sys.stderr
        )
    jobs: list[Job] = []
    if html is not None:
        jobs.append(("the page", lambda: write_page(answer, html)))
    for name in chosen:
        jobs.append((name, lambda name=name: _draw(name, answer, out / f"{name}.png")))
    return jobs


def _film(answer, out: Path, sample: int, named: str | None, quiet: bool) -> Path:
    """The system's own film, or a plain one of its run, or of the prediction where it is not
    known.
    """
    import jax

    from parc_jax.app.cli.systems import black_box_with, find
    from parc_jax.app.plot.film import film
    from parc_jax.app.study.replay import replay
    from parc_jax.safe_set.verdict.outline import require_same

    try:
        module = find(named or answer.model.system, needed=("system",))
        black_box = black_box_with(module, answer.model.points)
        require_same(black_box, answer.model)
    except InputError:
        if named is not None:
            raise
        print(
            f"parc-jax: no simulator of {answer.model.system!r} is here, so the film shows the "
            "model's prediction; a film of true runs needs one: --system MODULE.",
            file=sys.stderr,
        )
        return film(answer, out, sample, quiet=quiet)
    home = module.__name__
    if importlib.util.find_spec(f"{home}.film") if hasattr(module, "__path__") else None:
        return importlib.import_module(f"{home}.film").film_of(answer, out, sample, quiet)
    true = replay(black_box, answer.scene, answer.samples[[sample]], jax.random.PRNGKey(0))
    return film(answer, out, sample, true.path[0], quiet=quiet)


def _possible(answer) -> list[str]:
    several = answer.scene.at is None or answer.model.n_k > 1  # coordinates in which plans differ
    return [
        *(["samples"] if len(answer.samples) else []),
        *(["regions"] if 2 <= answer.model.n_k <= 3 else []),
        *(["projections"] if several and answer.corridors else []),
        *(["timeline"] if len(answer.samples) and answer.problem.obstacles else []),
    ]


def _draw(name: Figure, answer, path: Path) -> Path:
    draw = getattr(importlib.import_module(f"parc_jax.app.plot.{name}"), name)
    if name != "regions":
        draw(answer, to=path)
        return path
    from parc_jax.neuralparc.verdicts import region_verdicts
    from parc_jax.proof.regions import enumerate_regions

    table = enumerate_regions(answer.model.net, answer.model.domain)
    safe_k = answer.samples[:, answer.model.n_p :]
    verdict = region_verdicts(answer, table)
    draw(table, verdict, path, names=answer.model.labels.k, safe_k=safe_k)
    return path
