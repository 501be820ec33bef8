"""The scene with safe samples: starts, predicted paths with their tubes, the body, obstacles, goal,
and the true runs; in space from three sides.
"""

from pathlib import Path
from textwrap import fill

import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.shapes import SceneView, View, predicted, views_of
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import counted
from parc_jax.statement import told_under

CLOSER = 0.8  # the second panel shows at most this share of the first one's extent
LETTERS = 64  # of a line of the title that has another beside it
NEAR = 0.9  # room around the goal on the right, in widths of the goal
SHOWN_RECORDS = 4  # true runs are drawn through about this many points per model interval
FOOTPRINTS = 9  # of the body along the first sample


def samples(answer, replay=None, to=None, *, most: int = 100):
    """Safe samples of an answer in the workspace, in the plane all of it on the left and, where
    that shows more, around the goal on the right, with the final headings where a label of q says
    that it is one; in space from three sides.

    answer: Answer with n samples. replay: Replay of the same samples, equally often each, all runs
    of a plan together; of each plan one is drawn as the true run, one that failed where one did.
    to: as in `style.sheet`; two Axes, or one for the left alone, in space three. most: samples
    drawn. Returns the figure or the Axes. Raises InputError.
    """
    count, n_p = min(len(answer.samples), most), answer.model.n_p
    if not count:
        raise InputError(
            "samples: expected an answer with safe samples; this one has none. Draw its regions "
            "instead."
        )
    if replay is not None:
        often = len(replay.plans) // len(answer.samples)
        same = np.array_equal(replay.plans, np.repeat(answer.samples, often, axis=0))
        if not same or replay.scene is not answer.scene:
            raise InputError(
                f"samples: expected a replay of the {len(answer.samples)} samples of this answer; "
                f"got one of {len(replay.plans)} plans, or in another order, or in another scene."
            )
    paths = predicted(answer.model, answer.samples[:count])
    pictures = [_Picture(answer, view, *paths, replay) for view in views_of(n_p)]
    drawn = _in_space if len(pictures) > 1 else _in_plane
    of = "" if count == len(answer.samples) else f"{count} of "
    of += f"{counted(len(answer.samples), 'safe sample')}{told_under(answer.scene)}"
    return drawn(pictures, to, f"{of}{pictures[0].tally()}")


def _in_plane(pictures: list["_Picture"], to, title: str):
    (scene,) = pictures
    whole, at_goal = scene.span, shapes.span(*scene.goals, room=NEAR)
    if to is not None and not isinstance(to, str | Path):  # Axes
        columns = len(np.atleast_1d(to))
    else:  # one where the second would hardly be larger than life
        columns = 1 + bool(np.ptp(at_goal, axis=0).max() < CLOSER * np.ptp(whole, axis=0).max())
    same_height = [shapes.ratio(*whole), shapes.ratio(*at_goal)]
    wide, ratios = (9.0, same_height) if columns == 2 else (6.0, [1.0])
    with style.sheet(to, (wide, 3.5), columns=columns, width_ratios=ratios) as sheet:
        left, *beside = sheet.axes
        scene.draw(left)
        scene.robot(left)
        style.limits(left, *whole)
        left.set_title(fill(title, LETTERS) if beside else title, wrap=True)
        for near in beside:
            scene.draw(near)
            scene.headings(near)
            style.limits(near, *at_goal)
            near.set_title("the same, at the goal")
            near.set_ylabel("")
        if not beside:
            scene.headings(left)
        _legend(sheet, scene)
    return sheet.out


def _in_space(pictures: list["_Picture"], to, title: str):
    ratios = [shapes.ratio(*picture.span) for picture in pictures]
    with style.sheet(to, (12.0, 3.8), columns=len(pictures), width_ratios=ratios) as sheet:
        for picture, ax in zip(pictures, sheet.axes, strict=True):
            picture.draw(ax)
            picture.robot(ax)
            style.limits(ax, *picture.span)
            ax.set_title(picture.view.name)
        sheet.axes[0].set_title(f"{fill(title, LETTERS)}\n{pictures[0].view.name}", wrap=True)
        _legend(sheet, pictures[0])
    return sheet.out


def _legend(sheet, picture: "_Picture") -> None:
    wide = picture.single or len(sheet.axes) > 1
    style.explain(sheet, picture.handles(), 4 if wide else 3)


class _Picture(SceneView):
    """The scene and its samples, for all panels of a view: path (n, T + 1, n_c), error (n, T, n_c),
    q (n, n_q); tubes (n, m, T, 6, 2) are of all reference points.
    """

    def __init__(self, answer, view: View, path, q, error, replay):
        super().__init__(answer, view)
        model, self.q = answer.model, q
        self.heading = model.labels.heading
        self.names, self.columns = shapes.names(answer), path
        self.path = self.of_points(path)
        self.tubes = shapes.tubes(self.path, self.of_points(error))
        self.replay, count = replay, len(path)
        every = max(1, model.time.stride // SHOWN_RECORDS)
        if replay is not None:  # of each plan the run that is drawn: the first that failed, if any
            failed = replay.failed.reshape(len(answer.samples), -1)[:count]
            self.one = failed.argmax(axis=1) + failed.shape[1] * np.arange(count)
            self.true = self.of_points(replay.path[self.one])[:, 0]
            self.shown = self.true[:, ::every]

    @property
    def span(self):
        """Corners (2,), (2,) of the picture."""
        around = *self.goals, *self.obstacles, *self.grown, *self._ends_of_bodies[:1]
        return shapes.span(self.path, *around)

    def draw(self, ax) -> None:
        flat = {"edgecolors": "none", "rasterized": True}
        swept, first = self.tubes.reshape(-1, 6, 2), self.tubes[0].reshape(-1, 6, 2)
        style.areas(ax, swept, facecolors=style.TUBE, **flat, zorder=1)
        style.areas(ax, first, facecolors="#9CCBE8", **flat, zorder=1.5)
        for goal in self.goals:
            ax.fill(*goal.T, facecolor=style.GREEN, alpha=0.25, edgecolor="none", zorder=2)
            ax.fill(*goal.T, fill=False, edgecolor=style.GREEN, linewidth=1.2, zorder=2.5)
        for around in self.grown:
            ax.fill(*around.T, **shapes.GROWN, linewidth=0.9, zorder=0.5)
        ink = None if self.n_p == 2 else style.SEE_THROUGH
        for obstacle in self.obstacles:
            ax.fill(*obstacle.T, facecolor=style.OBSTACLE, edgecolor="none", zorder=2, alpha=ink)
        lines = self.path[:, 0]
        style.ways(ax, lines, colors=style.BLUE, linewidths=0.4, alpha=0.6, zorder=3)
        ax.plot(*lines[0].T, color=style.BLUE, linewidth=1.6, zorder=4.5)
        if self.replay is not None:
            colors = np.where(self.replay.failed[self.one], style.RED, style.BLACK)
            style.ways(ax, self.shown, colors=colors, linewidths=0.35, alpha=0.6, zorder=4)
            looks = {"color": colors[0], "linestyle": (0, (3, 2)), "zorder": 4.6}
            ax.plot(*self.shown[0].T, linewidth=1.1, **looks)
        dots = {"color": style.ORANGE, "edgecolor": "white", "linewidth": 0.3}
        ax.scatter(*lines[:, 0].T, s=7, **dots, zorder=5)
        self.label(ax)

    @property
    def _ends(self):
        """Final positions (n, 2) of the first point, goal states (n, n_q): true where replayed."""
        if self.replay is None:
            return self.path[:, 0, -1], self.q
        return self.true[:, -1], self.replay.q[self.one]

    @property
    def _ends_of_bodies(self) -> list[np.ndarray]:
        return self.bodies(self.columns[:, -1])

    def robot(self, ax) -> None:
        """Body, and the robot itself, along or at the end of the first sample."""
        if self.single:
            (body,) = self.bodies(self._ends[0][:1])
            ax.fill(*body.T, fill=False, edgecolor=style.BLUE, linewidth=1.0, zorder=6)
            return
        knots = np.linspace(0, self.columns.shape[1] - 1, FOOTPRINTS).round().astype(int)
        along = self.bodies(self.columns[0, knots])
        ends = len(self.parts)
        looks = {"edgecolors": style.BLUE, "linewidths": 0.6, "zorder": 4.2}
        style.areas(ax, along[:-ends], facecolors="none", **looks)
        looks = {"edgecolors": style.BLUE, "linewidths": 1.0, "alpha": 0.6, "zorder": 4.3}
        style.areas(ax, along[-ends:], facecolors=style.SKY, **looks)

    def headings(self, ax) -> None:
        """Final positions, each with a stroke along the final heading."""
        if not self.single:
            looks = {"facecolors": "none", "edgecolors": style.BLUE, "linewidths": 0.4}
            style.areas(ax, self._ends_of_bodies, **looks, alpha=0.5, zorder=4)
        end, q = self._ends
        ax.scatter(*end.T, s=4, color=style.BLUE, zorder=6)
        if self.heading is not None:
            along = np.stack([np.cos(q[:, self.heading]), np.sin(q[:, self.heading])], axis=1)
            length = 0.09 * np.ptp(self.goals[0], axis=0).max()
            strokes = np.stack([end, end + length * along], axis=1)
            style.ways(ax, strokes, colors=style.BLUE, linewidths=0.7, zorder=6)

    def tally(self) -> str:
        """The outcomes of the replay, in a few words."""
        if self.replay is None:
            return ""
        runs = self.replay
        reached, touched, n = int(runs.reached.sum()), int(runs.touched.sum()), len(runs.plans)
        return f"; of {n} runs in the black box {reached} reach the goal, {touched} touch"

    def handles(self) -> list:
        one = self.path.shape[1] == 1
        tubes = "tubes (first sample darker)" if one else "tubes of all points"
        obstacle, goal, of_first = self.names
        ring = {"marker": "o", "fillstyle": "none", "linestyle": "none"}
        bodies = [
            style.patch("body, first sample", facecolor="none", edgecolor=style.BLUE),
            style.patch("at its end", facecolor=style.SKY, edgecolor=style.BLUE, alpha=0.6),
        ]
        if self.single:
            bodies = [style.mark("body at its end", color=style.BLUE, **ring)]
        entries = [
            style.patch(obstacle, facecolor=style.OBSTACLE),
            *([style.patch("grown by the body", **shapes.GROWN)] if self.single else []),
            style.patch(goal, facecolor=style.GOAL, edgecolor=style.GREEN),
            style.patch(tubes, facecolor=style.TUBE),
            style.mark(f"predicted path{of_first}", color=style.BLUE),
            style.mark("start", color=style.ORANGE, marker="o", linestyle="none", markersize=4),
            *bodies,
        ]
        if self.replay is not None:
            entries.append(style.mark(f"true run{of_first}", color=style.BLACK))
            if self.replay.failed[self.one].any():
                entries.append(style.mark("true run that failed", color=style.RED))
        return entries
