"""Films: of one plan, its true run where there is one, else the model's prediction; of an episode
(`Stage`). In the plane from above, in space from three sides. A film is a .gif file or a folder of
.png files, complete or absent.
"""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.episode import Stage, Truth, rings_of
from parc_jax.app.plot.shapes import SceneView, View, predicted, views_of
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import Episode
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.learning.runs.files import write_atomic
from parc_jax.statement import told_under

RATE, RATE_OF_EPISODE = 25.0, 10.0  # [frames/s]
MOST = 250  # frames: a longer manoeuvre is shown faster than it is
REST = 1.0  # [s] of the last frame, so that one sees where it stops
DPI = 100
INCHES = {2: (7.2, 5.0), 3: (11.6, 4.0)}  # by dimension of the workspace
INCHES_OF_EPISODE = (4.6, 5.0)
FREE, STANDS = "#F3F0DC", "#D9D9D9"  # regions observed to be free, and true outlines
KINDS = (".gif", "")
COLOURS, COLOURS_OF_EPISODE = 128, 32  # of a .gif; an episode has seven, and their edges
PALETTE_FRAMES = 6  # frames that choose the colours


def film(
    source: Answer | Episode | str | Path,
    out: str | Path,
    sample: int = 0,
    run: np.ndarray | Truth | None = None,
    *,
    quiet: bool = True,
) -> Path:
    """Film one safe sample of an answer, or an episode: .gif, or a folder of .png files.

    source: an answer; or an episode in the plane, or its file, which is checked anew first.
    sample: number of the sample of an answer.
    run: the true run, None = the prediction. Of an answer (n_record + 1, n_c) [m], all reference
        points in the workspace; of an episode a `Truth`.
    quiet: no progress bar.
    Returns `out`. Raises InputError.
    """
    from tqdm import tqdm

    out = Path(out)
    require_kind(out)
    if isinstance(source, Episode | str | Path):
        canvas: _EpisodeCanvas | _PlanCanvas = _EpisodeCanvas(Stage(source, run))
    else:
        require_sample(source, sample)
        canvas = _PlanCanvas(source, sample, run)
    times = tqdm(canvas.times, desc="film", unit="frame", disable=quiet)
    frames = [canvas.frame(t) for t in times]
    rest = [frames[-1]] * round(REST * canvas.rate)
    return write_film(out, [*frames, *rest], canvas.rate, canvas.colours)


def require_kind(out: Path) -> None:
    """Refuse another suffix, before anything is drawn. Raises InputError."""
    if out.suffix not in KINDS:
        raise InputError(
            f"film: expected a .gif file, or a folder for .png files, of which ffmpeg makes "
            f"any other; got {out}."
        )


def require_sample(answer, sample: int) -> None:
    """Refuse the number of a sample that the answer lacks. Raises InputError."""
    n = len(answer.samples)
    if not n:
        raise InputError("film: expected an answer with safe samples; this one has none to film.")
    if not 0 <= sample < n:
        raise InputError(f"film: expected one of {n} safe samples, 0 to {n - 1}; got {sample}.")


def write_film(
    out: Path, images: Sequence[np.ndarray], rate: float, colours: int = COLOURS
) -> Path:
    """Write images (height, width, 3) uint8 as a film, by the suffix of `out`.

    rate: frames per second. colours: of a .gif, 256 at most; the fewer, the smaller.
    Returns `out`. Raises InputError.
    """
    out = Path(out)
    require_kind(out)
    if out.suffix == ".gif":
        return write_atomic(out, _gif(images, rate, colours))
    from matplotlib.image import imsave

    out.mkdir(parents=True, exist_ok=True)
    for number, image in enumerate(images):
        imsave(out / f"{number:04d}.png", image)
    number = len(images)  # of a longer film before
    while (frame := out / f"{number:04d}.png").exists():
        frame.unlink()
        number += 1
    return out


def _gif(images: Sequence[np.ndarray], rate: float, colours: int) -> bytes:
    """One palette for all frames and no dithering: parts that stand still cost nothing."""
    from PIL import Image

    sampled = np.concatenate(images[:: max(1, len(images) // PALETTE_FRAMES)])
    palette = Image.fromarray(sampled).quantize(colours)
    how = {"palette": palette, "dither": Image.Dither.NONE}
    first, *others = (Image.fromarray(image).quantize(**how) for image in images)
    buffer = io.BytesIO()
    looks = {"format": "gif", "save_all": True, "loop": 0, "optimize": False}
    first.save(buffer, append_images=others, duration=1000 / rate, **looks)
    return buffer.getvalue()


class _Canvas:
    """A figure whose image is taken. rate: [frames/s]. colours: of a .gif."""

    def __init__(self, inches: tuple[float, float], rate: float, colours: int):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.rate, self.colours = rate, colours
        self.figure = Figure(inches, dpi=DPI, layout="constrained")
        self.canvas = FigureCanvasAgg(self.figure)

    def image(self) -> np.ndarray:
        """(height, width, 3) uint8."""
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


class _PlanCanvas(_Canvas):
    """One plan in its scene, drawn once; every frame adds the moving parts."""

    def __init__(self, answer, sample: int, run: np.ndarray | None):
        from matplotlib import rc_context

        model, views = answer.model, views_of(answer.model.n_p)
        path, _, error = (part[0] for part in predicted(model, answer.samples[[sample]]))
        self.run = path if run is None else np.asarray(run, float)
        if self.run.shape[1:] != path.shape[1:]:
            raise InputError(
                f"film: expected a run with {path.shape[1]} columns, the coordinates of all "
                f"reference points; got {self.run.shape[1]}."
            )
        super().__init__(INCHES[model.n_p], RATE, COLOURS)
        self.time = model.time
        self.seconds = np.linspace(0.0, self.time.t_f, len(self.run))
        self.times = np.linspace(0.0, self.time.t_f, min(MOST, round(self.time.t_f * RATE) + 1))
        with rc_context(style.RC):
            self.sides = [_Side(answer, view, path, error, self.run) for view in views]
            ratios = [shapes.ratio(side.lo, side.hi) for side in self.sides]
            axes = self.figure.subplots(1, len(views), width_ratios=ratios, squeeze=False)[0]
            k = zip(model.labels.k, answer.samples[sample][model.n_p :], strict=True)
            words = [f"{name_of(label)} {v:.4g} {unit_of(label)}".rstrip() for label, v in k]
            words += model.claim.evidence.get("not_drawn", ())
            shown = "true run" if run is not None else "prediction of the model"
            if run is None and answer.scene.nominal.uncertainty is not None:
                shown = "one possible run of the model"
            caption = f"{model.system or 'plan'}: {shown}, sample {sample}"
            lines = caption, told_under(answer.scene).lstrip(), ", ".join(words)
            self.figure.suptitle("\n".join(filter(None, lines)), x=0.01, ha="left", fontsize=9.5)
            self.clock = self.figure.text(0.99, 0.99, "", ha="right", va="top", fontsize=11)
            self.clock.set_animated(True)
            way = "way so far" if run is None else "true run"
            style.legend(self.figure, _plan_handles(answer, way), 3)
            for side, ax in zip(self.sides, axes, strict=True):
                side.draw(ax)
            self.canvas.draw()
            # animated artists are missing from this image: each frame draws them on top of it
            self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    def frame(self, t: float) -> np.ndarray:
        """Image of a time t [s]."""
        pose = np.array([np.interp(t, self.seconds, column) for column in self.run.T])
        interval = min(int(t / self.time.dt), self.time.n_steps - 1)
        self.clock.set_text(f"{t:.2f} s")
        self.canvas.restore_region(self.still)
        for side in self.sides:
            side.move(interval, int((self.seconds <= t).sum()), pose)
        self.figure.draw_artist(self.clock)
        return self.image()


class _Side(SceneView):
    """The scene and one plan in it. path (T + 1, n_c), error (T, n_c), driven (t, n_c) [m]."""

    def __init__(self, answer, view: View, path, error, driven):
        super().__init__(answer, view)
        self.spans = answer.problem.all_spans
        self.path = self.of_points(path)
        self.tubes = shapes.tubes(self.path, self.of_points(error))
        self.driven = self.of_points(driven)[0]
        around = self.bodies(driven)
        self.lo, self.hi = shapes.span(self.path, *around, *self.goals, *self.obstacles)

    def draw(self, ax) -> None:
        """Draw the still parts, and add the moving ones, which a draw of the figure leaves out."""
        from matplotlib.patches import Polygon

        self.ax = ax
        self.label(ax)
        style.limits(ax, self.lo, self.hi)
        if self.n_p == 3:
            ax.set_title(self.view.name)
        for goal in self.goals:
            ax.fill(*goal.T, facecolor=style.GOAL, edgecolor=style.GREEN, zorder=0.6)
        style.areas(ax, self.tubes.reshape(-1, 6, 2), facecolors=style.TUBE, zorder=0.7)
        ax.plot(*self.path[0].T, color=style.BLUE, linewidth=0.9, zorder=2)
        ax.plot(*self.path[0, 0], marker="o", color=style.ORANGE, zorder=3)
        ink = None if self.n_p == 2 else style.SEE_THROUGH
        self.blocks = [
            Polygon(o, facecolor=style.OBSTACLE, alpha=ink, zorder=2.5) for o in self.obstacles
        ]
        looks = {"facecolor": style.SKY, "edgecolor": style.BLUE, "alpha": 0.5}
        self.body = [Polygon(np.zeros((1, 2)), **looks) for _ in self.parts]
        (self.trail,) = ax.plot([], [], color=style.BLACK, linewidth=1.6, zorder=4)
        for part in (*self.blocks, *self.body):
            ax.add_patch(part)
        self.moving = [*self.blocks, self.trail, *self.body]
        for part in self.moving:
            part.set_animated(True)

    def move(self, interval: int, past: int, pose: np.ndarray) -> None:
        """Draw the moving parts in a model interval, after `past` records, at a pose (n_c,)."""
        for block, span in zip(self.blocks, self.spans, strict=True):
            block.set_visible(span is None or span[0] <= interval <= span[1])
        here = self.of_points(pose[None])[0]
        self.trail.set_data(*np.concatenate([self.driven[:past], here]).T)
        outlines = self.bodies(pose[None])
        for part, outline in zip(self.body, outlines, strict=True):
            part.set_xy(outline)
        for part in self.moving:
            self.ax.draw_artist(part)


def _plan_handles(answer, way: str) -> list:
    of_points = "" if len(answer.model.points) == 1 else " of every reference point"
    obstacle, goal, of_first = shapes.names(answer)
    return [
        style.patch(obstacle, facecolor=style.OBSTACLE),
        style.patch(goal, facecolor=style.GOAL, edgecolor=style.GREEN),
        style.patch("body", facecolor=style.SKY, edgecolor=style.BLUE, alpha=0.5),
        style.patch(f"tube{of_points}", facecolor=style.TUBE),
        style.mark(f"predicted path{of_first}", color=style.BLUE, linewidth=0.9),
        style.mark(way + of_first, color=style.BLACK),
    ]


class _EpisodeCanvas(_Canvas):
    """An episode, every frame of which is drawn anew: the picture moves with the robot."""

    def __init__(self, stage: Stage):
        super().__init__(INCHES_OF_EPISODE, RATE_OF_EPISODE, COLOURS_OF_EPISODE)
        self.stage, self.times = stage, stage.times(RATE_OF_EPISODE)
        self.way: list[np.ndarray] = []

    def frame(self, t: float) -> np.ndarray:
        """Image of a time t [s]."""
        from matplotlib import rc_context

        with rc_context(style.RC):
            self.figure.clear()
            self._draw(self.figure.subplots(), t)
            self.canvas.draw()
        return self.image()

    def _draw(self, ax, t: float) -> None:
        stage, now = self.stage, self.stage.at(t)
        one = stage.shown[now.number]
        self.way.append(now.middle)
        if stage.truth is not None:
            style.areas(ax, list(stage.truth.standing), facecolor=STANDS)
            self._draw_free(ax, t)
        style.areas(ax, one.tube, facecolor=style.TUBE, edgecolor=style.TUBE, linewidth=0.3)
        looks = {"facecolor": style.OBSTACLE, "edgecolor": style.OBSTACLE, "linewidth": 0.6}
        style.areas(ax, one.obstacles, **looks)
        style.areas(ax, one.rest, facecolor="none", edgecolor=style.BLUE, linewidth=0.8)
        ax.plot(*np.array(self.way).T, color=style.BLUE, linewidth=0.9)
        style.areas(ax, now.body, facecolor=style.BLUE)
        ax.set_aspect("equal")
        style.limits(ax, now.middle - stage.reach, now.middle + stage.reach)
        ax.set_axis_off()
        told = ", ".join([f"manoeuvre {now.number}", *stage.notes])
        ax.set_title(f"{stage.name}, {t - stage.begin:.1f} s: {told}")
        style.legend(self.figure, _episode_handles(stage.truth, stage.driven.copies), 2)

    def _draw_free(self, ax, t: float) -> None:
        """The last free region observed by then."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path as Outline

        regions = [region for time, region in self.stage.truth.free if time <= t + 1e-9]
        for rings in rings_of(regions[-1]) if regions else ():
            outline = Outline.make_compound_path(*[Outline(ring, closed=True) for ring in rings])
            ax.add_patch(PathPatch(outline, facecolor=FREE, edgecolor="none"))


def _episode_handles(truth: Truth | None, copies: int) -> list:
    spread = ", spread by uncertainty" * (copies > 1)
    entries = [
        style.patch(f"robot{'' if truth else ', as predicted'}{spread}", color=style.BLUE),
        style.patch("may reach from its stated pose, in the tube", color=style.TUBE),
        style.patch("where it would rest", facecolor="none", edgecolor=style.BLUE),
        style.patch("obstacles of the proof", color=style.OBSTACLE),
    ]
    if truth is not None:
        entries += [style.patch("seen free", color=FREE), style.patch("stands there", color=STANDS)]
    return entries
