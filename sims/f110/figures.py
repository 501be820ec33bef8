"""Pictures of the study: drifting, repetitions over the tube, tubes over fresh runs, and what more
runs buy.
"""

from pathlib import Path

import jax
import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.shapes import predicted
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.network.predict import by_point
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.simulate import simulator
from sims.f110 import params as c
from sims.f110.rows import MANY, REPEATS, Row, interval
from sims.f110.system import F110

OUTLINE = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [c.BODY_LENGTH, c.BODY_WIDTH]
CLAIMS = {"published": style.RED, "honest": style.SKY, "honest, strict": style.BLUE}
BESIDE = (0.93, 1.0, 1.07)  # bars of the claims stand beside each other
SHOTS = 0.35  # [s] between the outlines of a timelapse
FRESH = 200  # runs that no model has seen, drawn over the tubes


def draw_all(car: F110, runs: RolloutBatch, tried: list, key: jax.Array, out: Path) -> None:
    """Write every picture below `out` as PNG and PDF. tried: `Tried` rows; a timelapse for each one
    with a plan.
    """
    sideslip(car, runs, key, out / "sideslip")
    fresh = collect(car, key, FRESH, Stage.VALIDATE, quiet=True)
    tubes(tried, fresh, out / "tubes")
    more_runs([t.row for t in tried], out / "more_runs")
    for t in tried:
        if t.repeats is not None:
            name = t.row.claim.replace(", ", "_")
            timelapse(car, t, key, out / f"repeats_{t.row.runs}_{name}")


def sideslip(car: F110, runs: RolloutBatch, key: jax.Array, to, shown: int = 30):
    """Sideslip and heading over time of the first runs."""
    rows = simulator(car).rows(key, Stage.TRAIN, runs.rows[:shown])
    run, t = car.run(rows.keys, rows.k), np.arange(car.time.n_record + 1) * car.time.dt_record
    with style.sheet(to, (8.0, 3.0), columns=2) as sheet:
        left, right = sheet.axes
        left.plot(t, np.rad2deg(np.abs(run.sideslip)).T, color=style.BLUE, linewidth=0.5, alpha=0.6)
        left.axhline(30, color=style.GREY, linestyle="--", linewidth=0.9)
        left.set(
            xlabel="time [s]",
            ylabel="sideslip [degrees]",
            title=f"{len(rows.k)} runs: all drift past 30 degrees",
        )
        right.plot(t, np.rad2deg(run.pose[:, :, 2]).T, color=style.BLUE, linewidth=0.5, alpha=0.6)
        right.axhline(180, color=style.GREY, linestyle="--", linewidth=0.9)
        right.set(xlabel="time [s]", ylabel="heading [degrees]", title="and turn about")
    return sheet.out


def timelapse(car: F110, tried, key: jax.Array, to):
    """Ten repetitions of the plan over the tube of every reference point: the whole way, and the
    space.
    """
    plan, answer = np.array(tried.row.plan), tried.answer
    rows = simulator(car).rows(
        key, Stage.REPLAY, np.arange(REPEATS), np.tile(plan[2:], (REPEATS, 1))
    )
    run = car.run(rows.keys, rows.k)
    at = run.measured[:, :, :2] - run.measured[:, :1, :2] + plan[:2]
    path, _, error = (columns[0] for columns in predicted(answer.model, plan[None]))
    n_points = answer.model.n_points
    swept = shapes.tubes(*(by_point(part, n_points).swapaxes(0, 1) for part in (path, error)))
    shots = np.unique(
        np.append(np.arange(0, car.time.n_record, round(SHOTS / c.TICK)), car.time.n_record)
    )
    goal = shapes.shadow(answer.problem.goal)
    with style.sheet(to, (10.0, 3.6), columns=2, width_ratios=(2.2, 1)) as sheet:
        from matplotlib.collections import LineCollection, PolyCollection

        for ax in sheet.axes:
            ax.add_collection(PolyCollection(swept.reshape(-1, 6, 2), facecolors="#D6E8F5"))
            ax.fill(*goal.T, facecolor=style.GREEN, alpha=0.25)
            for obstacle in answer.problem.obstacles:
                ax.fill(*shapes.shadow(obstacle).T, facecolor="#6E6E6E")
            outlines = [
                shapes.placed(OUTLINE, at[i, s], run.measured[i, s, 2])
                for i in range(REPEATS)
                for s in shots
            ]
            ax.add_collection(
                PolyCollection(outlines, facecolors="none", edgecolors=style.BLACK, linewidths=0.3)
            )
            ax.add_collection(LineCollection(at, colors=style.RED, linewidths=0.5))
            ax.set_aspect("equal")
            ax.set(xlabel="x [m]", ylabel="y [m]")
        whole, near = sheet.axes
        whole.autoscale_view()
        (x0, y0), (x1, y1) = goal.min(axis=0) - 0.8, goal.max(axis=0) + 0.8
        near.set(xlim=(x0, x1), ylim=(y0, y1), title="the space")
        row = tried.row
        whole.set_title(
            f"{row.runs:,} runs, {row.claim}: {REPEATS} repetitions, {row.failed_10} failed"
        )
    return sheet.out


def tubes(tried: list, fresh: RolloutBatch, to):
    """Half widths over time, x above y, one column per number of runs, over the errors on runs
    nobody has seen.
    """
    sizes = sorted({t.row.runs for t in tried})
    t = np.arange(fresh.time.n_steps) * fresh.time.dt
    with style.sheet(
        to, (2.6 * len(sizes) + 0.6, 4.2), rows=2, columns=len(sizes), sharex=True, sharey="row"
    ) as sheet:
        axes = sheet.axes.reshape(2, len(sizes))
        for column, n in enumerate(sizes):
            for one in (t for t in tried if t.row.runs == n):
                model, style_of = (
                    one.model.model,
                    {"color": CLAIMS[one.row.claim], "label": one.row.claim},
                )
                errors = np.asarray(measure(model.net, fresh).interval)
                width = model.tube.interval[model.tube.bin_of(fresh.k)].max(axis=0)
                for row in (0, 1):
                    if one.row.claim != "honest":
                        axes[row, column].plot(
                            t,
                            errors[:, :, row].T,
                            color=style_of["color"],
                            linewidth=0.2,
                            alpha=0.25,
                        )
                    axes[row, column].plot(t, width[:, row], **style_of)
            axes[0, column].set_title(f"{n:,} runs")
            axes[1, column].set_xlabel("time [s]")
            for row in (0, 1):
                axes[row, column].set_ylim(0, 0.6)
        axes[0, 0].set_ylabel("error of x [m]")
        axes[1, 0].set_ylabel("error of y [m]")
        style.legend(sheet.figure, axes[0, 0].get_legend_handles_labels()[0], 3)
    return sheet.out


def more_runs(rows: list[Row], to):
    """Measured failures with their intervals, share of safe plans, and promises, over the number of
    runs.
    """
    sizes = sorted({r.runs for r in rows})
    with style.sheet(to, (10.0, 3.2), columns=3) as sheet:
        fails, safe, leaves = sheet.axes
        for (claim, color), beside in zip(CLAIMS.items(), BESIDE, strict=True):
            found = [r for r in rows if r.claim == claim and r.plan is not None]
            every, n = [r for r in rows if r.claim == claim], np.array([r.runs for r in found])
            rate = np.array([r.failed_1000 / MANY for r in found])
            low, high = np.array([interval(r.failed_1000, MANY) for r in found]).reshape(-1, 2).T
            bars = 100 * np.array([np.maximum(rate - low, 0), np.maximum(high - rate, 0)])
            fails.errorbar(
                beside * n, 100 * rate, bars, fmt="o", color=color, label=claim, capsize=2
            )
            safe.plot([r.runs for r in every], [100 * r.safe for r in every], "o-", color=color)
            leaves.plot(n, [100 * r.left_random / MANY for r in found], "o-", color=color)
            promised = [(r.runs, 100 * r.promise) for r in found if r.promise is not None]
            if promised:
                leaves.plot(
                    *zip(*promised, strict=True), "o--", color=color, markerfacecolor="none"
                )
        titles = (
            f"one plan fails [% of {MANY:,}]; bars: 95 %",
            "safe plans [%]",
            "random plans leave [%]; dashed: promised",
        )
        for ax, title in zip(sheet.axes, titles, strict=True):
            ax.set(
                xscale="log", xlabel="runs", title=title, xlim=(0.8 * sizes[0], 1.25 * sizes[-1])
            )
            ax.set_xticks(sizes, [f"{n:,}" for n in sizes])
            ax.minorticks_off()
            ax.set_ylim(bottom=0)
        leaves.set_yscale("symlog", linthresh=0.1)
        leaves.set_ylim(0, 130)
        leaves.set_yticks([0, 0.1, 1, 10, 100], ["0", "0.1", "1", "10", "100"])
        style.legend(sheet.figure, fails.get_legend_handles_labels()[0], 3)
    return sheet.out
