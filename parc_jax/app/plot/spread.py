"""The spread of plans under disturbances: many runs of each in the workspace, and their errors over
time inside the tube.
"""

import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.shapes import predicted
from parc_jax.common.errors import InputError

SHOWN = 4  # plans in the workspace, far from each other
RUNS = 100  # runs drawn per plan
POINTS = 120  # points per drawn run
LEVELS = (
    (0.0, 1.0, "#DCE9F3", "all runs"),
    (0.05, 0.95, "#A9CBE4", "90 %"),
    (0.25, 0.75, "#5A9BCB", "half"),
)


def spread(answer, runs, repeats: int, to=None, *, shown: int = SHOWN):
    """Runs of an answer's samples under fresh disturbances, of the first reference point.

    answer: Answer with n samples. runs: Replay of n * repeats runs, grouped by plan. to: as in
    `style.sheet`; 1 + n_p Axes: workspace from above with a few plans, signed error over time along
    each axis (positive: the run is ahead of the prediction), with the median half width of the tube
    over the plans. shown: plans in the workspace. Raises InputError.
    """
    n = len(answer.samples)
    if n == 0 or len(runs.path) != n * repeats:
        raise InputError(
            f"spread: expected {repeats} runs of each of the {n} samples; got {len(runs.path)} "
            "runs."
        )
    path, _, error = predicted(answer.model, answer.samples)
    true = runs.path.reshape(n, repeats, *runs.path.shape[1:])
    n_p = answer.model.n_p
    ratios = (1.5, *[1] * n_p)
    with style.sheet(to, (3.14 * sum(ratios), 3.6), columns=1 + n_p, width_ratios=ratios) as sheet:
        _workspace(sheet.axes[0], answer, path, error, true, runs.failed.reshape(n, repeats), shown)
        time = answer.model.time
        fine = np.linspace(0, time.n_steps, time.n_record + 1)
        for axis, ax in enumerate(sheet.axes[1:]):
            _errors(ax, time, true[..., axis], path[..., axis], error[..., axis], fine)
            ax.set_title(f"error along {'xyz'[axis]}, {n} plans, {repeats} runs each")
        sheet.axes[1].set_ylabel("run minus prediction [m]")
        style.explain(sheet, _handles(answer, runs.failed.any()), 5)
    return sheet.out


def far_apart(points: np.ndarray, most: int) -> np.ndarray:
    """Numbers of up to `most` points (n, d), each the one farthest from those before it."""
    chosen = [int(np.argmin(points[:, 0]))]
    distance = np.full(len(points), np.inf)
    while len(chosen) < min(most, len(points)):
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.array(chosen)


def _workspace(ax, answer, path, error, true, failed, shown: int) -> None:
    scene = shapes.SceneView(answer, shapes.TOP)
    for around in scene.grown:
        ax.fill(*around.T, **shapes.GROWN, linewidth=0.9, zorder=0.5)
    for obstacle in scene.obstacles:
        ax.fill(*obstacle.T, facecolor=style.OBSTACLE, edgecolor="none", zorder=2)
    goal = shapes.shadow(answer.problem.goal)
    path, error, true = (part[..., :2] for part in (path, error, true))
    ax.fill(
        *goal.T, facecolor=style.GREEN, alpha=0.18, edgecolor=style.GREEN, linewidth=1.0, zorder=0.4
    )
    chosen = far_apart(np.concatenate([path[:, 0], path[:, -1]], axis=1), shown)
    every = max(1, true.shape[2] // POINTS)
    for rank, number in enumerate(chosen):
        color = style.CYCLE[rank % len(style.CYCLE)]
        swept = shapes.tubes(path[number], error[number])
        style.areas(ax, swept, facecolors=color, alpha=0.04, edgecolors="none", zorder=1)
        colors = [style.RED if bad else color for bad in failed[number, :RUNS]]
        lines = true[number, :RUNS, ::every]
        style.ways(ax, lines, colors=colors, linewidths=0.3, alpha=0.5, zorder=3)
        ax.plot(*path[number].T, color="white", linewidth=2.4, zorder=4)
        ax.plot(*path[number].T, color=color, linewidth=1.4, zorder=4.5)
        dot = {"marker": "o", "markersize": 4, "markeredgecolor": "white"}
        ax.plot(*path[number, 0], **dot, color=color, zorder=5)
    lo, hi = shapes.span(path[chosen], true[chosen, :, ::every], goal, room=0.06)
    style.limits(ax, lo, hi)
    scene.label(ax)
    ax.set_title(f"{len(chosen)} of {len(path)} plans, {min(true.shape[1], RUNS)} runs each")


def _errors(ax, time, true, path, error, fine) -> None:
    """true (n, repeats, n_record + 1), path (n, T + 1), error (n, T) along one axis."""
    middle = np.stack([np.interp(fine, np.arange(time.n_steps + 1), one) for one in path])
    gap = (true - middle[:, None]).reshape(-1, len(fine))
    at = fine * time.dt
    for low, high, color, _ in LEVELS:
        ax.fill_between(at, *np.nanquantile(gap, [low, high], axis=0), color=color, linewidth=0)
    ax.plot(at, np.nanmedian(gap, axis=0), color=style.BLUE)
    edges, half = np.arange(time.n_steps + 1) * time.dt, np.median(error, axis=0)
    for sign in (-1, 1):
        ax.stairs(
            sign * half, edges, baseline=None, color=style.BLACK, linewidth=1.0, linestyle="--"
        )
    ax.set_xlim(0, time.t_f)
    ax.grid(True, axis="y")
    ax.set_xlabel("time [s]")


def _handles(answer, any_failed: bool) -> list:
    entries = [
        style.mark(
            "predicted, from its start", color=style.GREY, linewidth=1.4, marker="o", markersize=4
        ),
        style.mark("true run", color=style.GREY, linewidth=0.5),
        *(style.patch(f"error: {name}", facecolor=color) for _, _, color, name in LEVELS),
        style.mark("error: median", color=style.BLUE),
        style.mark("half width of the tube (median over plans)", color=style.BLACK, linestyle="--"),
    ]
    if shapes.grows_obstacles(answer):
        entries.append(style.patch("obstacle grown by the body", **shapes.GROWN))
    else:
        entries.append(style.patch("obstacle", facecolor=style.OBSTACLE))
    if any_failed:
        entries.append(style.mark("true run that failed", color=style.RED))
    return entries
