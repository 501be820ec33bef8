"""Where a plan is predicted to go, with the tube around it: arrays, and tables for others."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.labels import Labels, named_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import by_point, moved_to, trajectories
from parc_jax.learning.runs.files import write_atomic


@dataclass(frozen=True)
class NominalPath:
    """The model's prediction for one plan, in float64, and the distance that a run inside the tube
    may have from it. It is no verdict.

    times (T + 1,) [s]. places (T + 1, points, n_p) [m]: of each reference point at these times;
    between them the prediction is straight. q (n_q,): the other goal states at the end.
    tube (T, points, n_p) [m]: half widths of the tube between two times, as `Tube.interval` has
    them: boxes around one with slanted faces, the widest of the bins that hold k, infinite where
    one has no claim. tube_at_end (points, n_p) [m], q_error (n_q,): half widths at the end.
    points: names of the reference points. labels: names and units of the coordinates. alone: what
    is uncertain, but for its execution, comes on top. turned: all is told in the robot's frame.
    """

    times: np.ndarray
    places: np.ndarray
    q: np.ndarray
    tube: np.ndarray
    tube_at_end: np.ndarray
    q_error: np.ndarray
    points: tuple[str, ...]
    labels: Labels
    alone: bool = False
    turned: bool = False

    def to_csv(self) -> str:
        """A row per time: the places, then the half widths of the tube from here to the next time,
        in the last row at the end, and there alone q and its half widths.
        """
        axes, q = self.labels.p, [*self.labels.q]
        names = [named_of(x, f"of {point}") for point in self.points for x in axes]
        names = names if len(self.points) > 1 else [*axes]
        if self.turned:
            names, q = ([named_of(x, "in the robot's frame") for x in of] for of in (names, q))
        half = [f"+-{x}" for x in (*names, *q)]
        half = [named_of(x, "of the tube alone") for x in half] if self.alone else half
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["time [s]", *names, *half[: len(names)], *q, *half[len(names) :]])
        last = [*self.q.tolist(), *self.q_error.tolist()]
        wide = [*self.tube, self.tube_at_end]
        for t, (time, place, half) in enumerate(zip(self.times, self.places, wide, strict=True)):
            at_end = last if t + 1 == len(self.times) else [""] * len(last)
            table.writerow([float(time), *place.ravel().tolist(), *half.ravel().tolist(), *at_end])
        return text.getvalue()

    def save(self, path) -> Path:
        """Write a .csv file, complete or not at all. Raises InputError for any other name."""
        path = Path(path)
        if path.suffix != ".csv":
            raise InputError(f"path: expected a file .csv to write; got {path}.")
        return write_atomic(path, self.to_csv().encode())


def nominal_path(model: TrajectoryModel, p0: np.ndarray, k: np.ndarray) -> NominalPath:
    """Of the plan p0 (n_p,), k (n_k,). Raises InputError for one outside of K, or of no numbers."""
    K = model.domain
    if not (np.isfinite(p0).all() and K.contains(k)):
        plan = ", ".join(f"{x:g}" for x in (*p0, *k))
        raise InputError(
            f"path: expected a plan with k in {K.text}, that of the model; got {plan}."
        )
    offsets, q = trajectories(model.net, model.layout, k[None])
    during, at_end = (half[0] for half in model.tube.widest_at(k[None]))
    return NominalPath(
        times=model.time.dt * np.arange(model.time.n_steps + 1),
        places=by_point(moved_to(p0, offsets[0]), model.n_points),
        q=q[0],
        tube=by_point(during, model.n_points),
        tube_at_end=by_point(at_end[: model.n_c], model.n_points),
        q_error=at_end[model.n_c :],
        points=tuple(model.points),
        labels=model.labels,
    )
