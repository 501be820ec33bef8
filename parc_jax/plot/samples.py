"""The scene with safe samples: starts, predicted paths with their tubes, obstacles, goal, and the
true runs.
"""

from pathlib import Path

import numpy as np

from parc_jax.errors import InputError
from parc_jax.plot import shapes, style
from parc_jax.plot.predict import predicted

CLOSER = 0.8  # the second panel shows at most this share of the first one's extent
NEAR = 0.9  # room around the goal on the right, in widths of the goal
SHOWN_RECORDS = 4  # true runs are drawn through about this many points per model interval


def samples(
    answer, replay=None, to=None, *, most: int = 100, heading: int | None = None, outline=None
):
    """Safe samples of an answer in the workspace, whole on the left and, where that shows more,
    around the goal on the right.

    answer: Answer with n samples. replay: Replay of the same samples, drawn as the true runs. to:
    as in `style.sheet`; two Axes, or one for the whole alone. most: samples drawn. heading: number
    of the goal state q that is the final heading [rad], None = the one whose label says so; arrows
    show it.
    outline: (v, 2) [m] vertices of the robot in its own frame, drawn at the end of the first
    sample; needs heading. Returns the figure or the Axes. Raises InputError.
    """
    count = min(len(answer.samples), most)
    if replay is not None and len(replay.path) != len(answer.samples):
        raise InputError(
            f"samples: expected a replay of the {len(answer.samples)} samples; got one of "
            f"{len(replay.path)} plans."
        )
    if replay is not None and not np.array_equal(
        replay.path[:, 0], answer.samples[:, : answer.model.n_p]
    ):
        raise InputError("samples: expected a replay of these samples; its runs start elsewhere.")
    if not count:
        raise InputError(
            "samples: expected an answer with safe samples; this one has none. Draw its regions "
            "instead."
        )
    scene = _Picture(
        answer, *predicted(answer.model, answer.samples[:count]), replay, count, heading, outline
    )
    columns = _columns(scene, to)
    wide, ratios = (9.0, _widths(scene)) if columns == 2 else (6.0, [1.0])
    with style.sheet(to, (wide, 3.5), columns=columns, width_ratios=ratios) as sheet:
        whole, *beside = sheet.axes
        scene.draw(whole)
        scene.robot(whole)
        _limits(whole, *scene.span)
        whole.set_title(f"{count} safe samples{scene.tally()}")
        for near in beside:
            scene.draw(near)
            scene.headings(near)
            _limits(near, *shapes.span(scene.goal, room=NEAR))
            near.set_title("the same, at the goal")
            near.set_ylabel("")
        if not beside:
            scene.headings(whole)
        if sheet.out is sheet.figure:
            style.legend(sheet.figure, scene.handles(), 4)
        else:
            whole.legend(handles=scene.handles(), loc="best")
    return sheet.out


class _Picture:
    """Everything both panels show. path (n, T + 1, 2), error (n, T, 2), q (n, n_q)."""

    def __init__(self, answer, path, q, error, replay, count, heading, outline):
        self.path, self.error, self.q, self.outline = path, error, q, outline
        self.heading = answer.model.labels.heading if heading is None else heading
        self.problem, self.scene, self.labels = answer.problem, answer.scene, answer.model.labels.p
        self.obstacles = [
            shapes.grown(answer.scene, o) for o in range(len(answer.problem.obstacles))
        ]
        self.goal = shapes.shadow(answer.problem.goal)
        self.replay, self.count = replay, count
        every = max(1, answer.model.time.stride // SHOWN_RECORDS)
        self.true = None if replay is None else replay.path[:count, ::every]

    @property
    def span(self):
        """Corners (2,), (2,) of all that is to be seen."""
        return shapes.span(self.path, self.goal, *self.obstacles)

    def draw(self, ax) -> None:
        from matplotlib.collections import LineCollection, PolyCollection

        swept = shapes.tubes(self.path, self.error).reshape(-1, 6, 2)
        ax.add_collection(
            PolyCollection(
                swept, facecolors="#D6E8F5", edgecolors="none", rasterized=True, zorder=1
            )
        )
        first = shapes.tubes(self.path[:1], self.error[:1]).reshape(-1, 6, 2)
        ax.add_collection(
            PolyCollection(
                first, facecolors="#9CCBE8", edgecolors="none", rasterized=True, zorder=1.5
            )
        )
        ax.fill(*self.goal.T, facecolor=style.GREEN, alpha=0.25, edgecolor="none", zorder=2)
        ax.fill(*self.goal.T, fill=False, edgecolor=style.GREEN, linewidth=1.2, zorder=2.5)
        for obstacle, around in zip(self.problem.obstacles, self.obstacles, strict=True):
            ax.fill(
                *around.T,
                facecolor="#EBEBEB",
                edgecolor=style.GREY,
                linewidth=0.9,
                linestyle="--",
                zorder=0.5,
            )
            ax.fill(*shapes.shadow(obstacle).T, facecolor="#6E6E6E", edgecolor="none", zorder=2)
        ax.add_collection(
            LineCollection(self.path, colors=style.BLUE, linewidths=0.4, alpha=0.6, zorder=3)
        )
        ax.plot(*self.path[0].T, color=style.BLUE, linewidth=1.6, zorder=4.5)
        if self.true is not None:
            failed = self.replay.failed[: self.count]
            colors = np.where(failed, style.RED, style.BLACK)
            ax.add_collection(
                LineCollection(self.true, colors=colors, linewidths=0.35, alpha=0.6, zorder=4)
            )
            ax.plot(
                *self.true[0].T, color=colors[0], linewidth=1.1, linestyle=(0, (3, 2)), zorder=4.6
            )
        ax.scatter(
            *self.path[:, 0].T, s=7, color=style.ORANGE, edgecolor="white", linewidth=0.3, zorder=5
        )
        ax.set_aspect("equal")
        ax.set_xlabel(self.labels[0])
        ax.set_ylabel(self.labels[1])

    @property
    def _ends(self):
        """Final positions (n, 2) and goal states (n, n_q): the true ones where there is a
        replay.
        """
        return (
            (self.path[:, -1], self.q)
            if self.replay is None
            else (self.replay.path[: self.count, -1], self._true_q)
        )

    @property
    def _true_q(self):
        return self.replay.q[: self.count]

    def robot(self, ax) -> None:
        """Body, and the robot itself, at the end of the first sample."""
        end, q = self._ends
        body = shapes.placed(shapes.body_outline(self.problem.body), end[0])
        ax.fill(*body.T, fill=False, edgecolor=style.BLUE, linewidth=1.0, zorder=6)
        if self.outline is not None and self.heading is not None:
            robot = shapes.placed(np.asarray(self.outline, float), end[0], q[0, self.heading])
            ax.fill(
                *robot.T,
                facecolor=style.SKY,
                alpha=0.6,
                edgecolor=style.BLUE,
                linewidth=0.9,
                zorder=2.8,
            )

    def headings(self, ax) -> None:
        """Final positions, each with a stroke along the final heading."""
        end, q = self._ends
        ax.scatter(*end.T, s=4, color=style.BLUE, zorder=6)
        if self.heading is not None:
            along = np.stack([np.cos(q[:, self.heading]), np.sin(q[:, self.heading])], axis=1)
            length = 0.09 * np.ptp(self.goal, axis=0).max()
            from matplotlib.collections import LineCollection

            strokes = np.stack([end, end + length * along], axis=1)
            ax.add_collection(LineCollection(strokes, colors=style.BLUE, linewidths=0.7, zorder=6))

    def tally(self) -> str:
        """What the replay saw, in a few words."""
        if self.replay is None:
            return ""
        reached, touched = (
            int(part[: self.count].sum()) for part in (self.replay.reached, self.replay.touched)
        )
        return f"; in the black box {reached} reach the goal, {touched} touch"

    def handles(self) -> list:
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        entries = [
            Patch(facecolor="#6E6E6E", label="obstacle"),
            Patch(
                facecolor="#EBEBEB", edgecolor=style.GREY, linestyle="--", label="grown by the body"
            ),
            Patch(facecolor="#CBE8DF", edgecolor=style.GREEN, label="goal"),
            Patch(facecolor="#D6E8F5", label="tubes (first sample darker)"),
            Line2D([], [], color=style.BLUE, label="predicted path"),
            Line2D(
                [],
                [],
                color=style.ORANGE,
                marker="o",
                linestyle="none",
                markersize=4,
                label="start",
            ),
            Line2D(
                [],
                [],
                color=style.BLUE,
                marker="o",
                fillstyle="none",
                linestyle="none",
                label="body at its end",
            ),
        ]
        if self.replay is not None:
            entries.append(Line2D([], [], color=style.BLACK, label="true run"))
            if self.replay.failed.any():
                entries.append(Line2D([], [], color=style.RED, label="true run that failed"))
        return entries


def _columns(scene: "_Picture", to) -> int:
    """Two panels, unless one set of Axes is given or the second would be hardly larger than life in
    the first.
    """
    if to is not None and not isinstance(to, str | Path):
        return len(np.atleast_1d(to))
    (x0, y0), (x1, y1) = scene.span
    (u0, v0), (u1, v1) = shapes.span(scene.goal, room=NEAR)
    return 2 if max(u1 - u0, v1 - v0) < CLOSER * max(x1 - x0, y1 - y0) else 1


def _widths(scene: "_Picture") -> list[float]:
    """Widths of the panels that give both the same height."""
    (x0, y0), (x1, y1) = scene.span
    (u0, v0), (u1, v1) = shapes.span(scene.goal, room=NEAR)
    return [(x1 - x0) / (y1 - y0), (u1 - u0) / (v1 - v0)]


def _limits(ax, lo, hi) -> None:
    ax.set_xlim(lo[0], hi[0])
    ax.set_ylim(lo[1], hi[1])
