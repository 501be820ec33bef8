"""A sweep's table becomes runs; a table of outcomes is refused, with what to log instead."""

import numpy as np
import pytest

import parc_jax as pj
from parc_jax.common.errors import InputError

TIME = pj.learning.time_grid(dt=0.5, t_f=1.0, dt_record=0.25)
RNG = np.random.default_rng(0)
NAMES = {"k": ("vx", "vy"), "p": ("x", "y"), "q": ("yaw",)}


def table(n=6, every=0.1, lasts=1.3) -> dict:
    """Runs from (3, -1) along k, on clocks of their own; the last one ends early."""
    rows = []
    for number in range(n):
        vx, vy = RNG.uniform(0.5, 1.0, 2)
        for s in np.arange(0.0, 0.6 if number == n - 1 else lasts, every):
            rows.append((f"r{number}", 100 * number + s, vx, vy, 3 + s * vx, -1 + s * vy, vy * s))
    return dict(
        zip(("run", "t", "vx", "vy", "x", "y", "yaw"), np.array(rows, object).T, strict=True)
    )


def written(path, columns) -> str:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_runs_are_cut_and_put_on_the_grid(tmp_path):
    columns = table()
    batch = pj.load_rollouts(columns, TIME, columns=NAMES)
    s = np.arange(5)[:, None] * 0.25
    assert batch.failed.tolist() == [False] * 5 + [True] and batch.n_p == 2
    assert np.allclose(batch.p[:5], s * batch.k[:5, None], atol=1e-9)
    assert np.allclose(batch.q[:5, 0], batch.k[:5, 1], atol=1e-9)
    assert np.isfinite(batch.p[5, :2]).all() and np.isnan(batch.p[5, -1]).all()
    assert batch.labels.k == ("vx", "vy") and batch.law.k_law == "logged"
    assert "records = straight between samples, 0.25 s apart at most" in batch.law.describe()
    stored = pj.load_rollouts(written(tmp_path / "sweep.csv", columns), TIME, columns=NAMES)
    assert np.array_equal(stored.p, batch.p, equal_nan=True) and stored.name == "file:sweep.csv"


def test_rows_of_runs_may_be_interleaved():
    columns = table()
    order = np.argsort(np.array([float(t) % 100 for t in columns["t"]]), kind="stable")
    mixed = pj.load_rollouts({name: x[order] for name, x in columns.items()}, TIME, columns=NAMES)
    assert np.array_equal(mixed.p, pj.load_rollouts(columns, TIME, columns=NAMES).p, equal_nan=True)


def test_several_points_are_relative_to_the_first():
    columns = table()
    columns |= {"nose x": columns["x"] + 1.0, "nose y": columns["y"]}
    named = NAMES | {"p": ("x", "y", "nose x", "nose y")}
    batch = pj.load_rollouts(columns, TIME, columns=named, points=("tail", "nose"))
    assert batch.points == ("tail", "nose") and np.allclose(batch.p[:, 0], [0.0, 0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    "outcomes",
    [
        {"vx": [0.5, 0.7], "vy": [0.1, 0.2], "success [%]": [80, 95]},
        {"run": [0, 1], "t": [1.0, 1.0], "vx": [0.5, 0.7], "vy": [0, 0], "x": [1, 2], "y": [0, 0]}
        | {"yaw": [0, 0]},
    ],
)
def test_outcomes_are_not_enough_and_what_to_log_is_said(outcomes):
    with pytest.raises(
        InputError, match=r"how often a k succeeded .* Log of every run, failed one"
    ):
        pj.load_rollouts(outcomes, TIME, columns=NAMES)


def changed(name, row, value):
    columns = table()
    columns[name] = columns[name].copy()
    columns[name][row] = value
    return columns


@pytest.mark.parametrize(
    "columns, words",
    [
        (changed("vx", 3, 0.6), "table, run r0: expected one k for the whole run; it changes"),
        (changed("t", 3, 0.1), "run r0: expected a clock that goes on from row to row"),
        (changed("t", 3, np.nan), "run r0: expected a clock that goes on"),
        (table(every=0.3), r"sample at least every dt_record = 0\.25 s; there are 0\.3 s between"),
        (changed("x", 2, "left"), "expected numbers in x, y"),
        (3, "table: expected a .csv file, or names with columns; got int"),
    ],
)
def test_what_cannot_be_meant_is_refused(columns, words):
    with pytest.raises(InputError, match=words):
        pj.load_rollouts(columns, TIME, columns=NAMES)


def test_files_that_are_none_are_refused(tmp_path):
    for text, words in (("", "no rows"), ("run,t\n", "no rows"), ("a,b\n1\n", "row 1 has 1")):
        (tmp_path / "s.csv").write_text(text)
        with pytest.raises(InputError, match=words):
            pj.load_rollouts(tmp_path / "s.csv", TIME, columns=NAMES)
    with pytest.raises(InputError, match=r"expected a .csv file; .*No such file"):
        pj.load_rollouts(tmp_path / "none.csv", TIME, columns=NAMES)
    with pytest.raises(InputError, match='expected k_law "logged"'):
        pj.load_rollouts(table(), TIME, columns=NAMES, k_law="uniform")
    with pytest.raises(InputError, match="columns="):
        pj.load_rollouts(written(tmp_path / "s.csv", table()))
