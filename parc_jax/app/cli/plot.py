"""`parc-jax plot`: pictures of an answer, one interactive page, or a film; and `parc-jax export`:
an answer for the computer of a robot.
"""

import importlib
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from parc_jax.app.cli.options import Offer, Shell
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import listed

Figure = Literal["samples", "regions"]
# a name, and what draws it on a path
Job = tuple[str, Callable[[Path], object], Path]


def plot(
    answer: Path,
    /,
    *,
    html: Path | None = None,
    out: Path | None = None,
    figures: tuple[Figure, ...] | None = None,
    video: Path | None = None,
    sample: int | None = None,
    system: str | None = None,
    shell: Annotated[Shell, Offer("app.cli.options.Shell", only=("quiet",))],
) -> int:
    """Draw an answer from its file alone. Example: parc-jax plot answer.json --html page.html

    Figures as PNG and PDF: parc-jax plot answer.json --out figures --figures samples regions

    A film of one plan in its simulator: parc-jax plot answer.json --video film.gif --sample 3

    An episode, as it was committed to: parc-jax plot drive.json --html drive.html --video film.gif

    Args:
        answer: An answer file of `solve` or `run`, or an episode of `pj.drive.save_episode`.
        html: Write one interactive page: scene, time slider, p0 and k by dragging or typing, with
            the verdict live; of an episode the manoeuvre at any time, and the reasons.
        out: Folder of the figures. Default: that of the answer.
        figures: Which figures. Default: all that the answer supports, or none with --html or
            --video, without --out.
        video: Film one safe sample: .gif, or a folder of .png files.
            Without a simulator the film shows the model's prediction.
        sample: Number of the sample that is filmed, from 0. Default: 0.
        system: Simulator for the film, as for `learn`. Default: the system that the answer names,
            if it is installed.
    """
    from tqdm import tqdm

    from parc_jax.app.cli.check import is_episode
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.files.answer_file import load_answer
    from parc_jax.app.plot.film import film, require_kind, require_sample
    from parc_jax.app.plot.page import write_page
    from parc_jax.drive.loop.episode_file import load_episode

    episode = is_episode(answer)
    if episode and html is None and video is None:
        words = "expected --html FILE, its page, or --video FILE."
        raise InputError(f"{answer} is an episode: {words}")
    given = {"figures": figures, "out": out} if episode else {}
    given |= {"sample": sample, "system": system} if episode or video is None else {}
    if unused := [f"--{name}" for name, value in given.items() if value is not None]:
        of = "an episode has none of it" if episode else "they are of the film, --video FILE"
        raise InputError(f"{', '.join(unused)}: expected no such option; {of}. Leave it out.")
    sample = sample or 0
    if figures is None and out is None and (html is not None or video is not None):
        figures = ()
    drawn_here = figures != () and not episode
    for place in (html, (out or answer.parent) / "samples.png" if drawn_here else None):
        require_place(place)
    if video is not None:
        require_kind(video)
        require_place(video, folder=not video.suffix)
    quiet = {"disable": shell.quiet, "leave": False}
    with tqdm(desc="checking the answer", total=1, delay=0.5, **quiet) as bar:
        loaded = load_episode(answer) if episode else load_answer(answer)
        bar.update()
    if video is not None and not episode:
        require_sample(loaded, sample)
    jobs = [] if episode else _jobs(loaded, out or answer.parent, figures, html is not None)
    if html is not None:
        jobs.insert(0, ("the page", partial(write_page, loaded), html))
    drawn = []
    for name, draw, path in (bar := tqdm(jobs, **(quiet if jobs else {"disable": True}))):
        bar.set_description(f"drawing {name}")
        draw(path)
        drawn.append(path)
    if video is not None and episode:
        drawn.append(film(loaded, video, quiet=shell.quiet))
    elif video is not None:
        drawn.append(_film(loaded, video, sample, system, shell.quiet))
    if not shell.quiet:
        print("\n".join(map(str, drawn)))
    return 0


def _jobs(answer, out: Path, wanted, page: bool) -> list[Job]:
    """The drawing jobs of figures. Raises InputError for one that the answer does not support."""
    from parc_jax.app.plot.of_answer import figures_of, pictures

    possible = figures_of(answer)
    chosen = possible if wanted is None else wanted
    old = [place.name for place in pictures(out) if place.stem not in possible]
    if wanted != () and old:
        print(f"parc-jax: {listed(old)} in {out}: of another answer.", file=sys.stderr)
    for name in chosen:
        if name not in possible:
            raise InputError(f"{name}: this answer has {', '.join(possible) or 'no figure'} only.")
    if not chosen and wanted is None and not page:
        words = "the answer has no plans and no plane of parameters to draw."
        print(f"parc-jax: {words}", file=sys.stderr)
    return [(name, possible[name], out / f"{name}.png") for name in chosen]


def _film(answer, out: Path, sample: int, named: str | None, quiet: bool) -> Path:
    """The film that the system renders, else a plain one: of its run, or of the prediction."""
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
    rendered = f"{module.__name__}.film"
    if hasattr(module, "__path__") and importlib.util.find_spec(rendered):
        return importlib.import_module(rendered).film_of(answer, out, sample, quiet)
    true = replay(black_box, answer.scene, answer.samples[[sample]], jax.random.PRNGKey(0))
    return film(answer, out, sample, true.path[0], quiet=quiet)


def export(
    answer: Path,
    /,
    *,
    c: Path,
    name: str | None = None,
    shell: Annotated[Shell, Offer("app.cli.options.Shell", only=("quiet",))],
) -> int:
    """Write an answer as a C99 header without dependencies, with is_safe(p0, k) and
    nearest_plan. Example: parc-jax export answer.json --c safe_set.h

    Args:
        answer: An answer file of `solve` or `run`; it is checked anew.
        c: The header to write.
        name: What its functions begin with. Default: the name of the header.
    """
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.files.answer_file import load_answer
    from parc_jax.drive.onboard.header import write_c

    require_place(c)
    written = write_c(load_answer(answer), c, name)
    if not shell.quiet:
        print(f"{written}: {len(written.read_bytes()):,} bytes")
    return 0
