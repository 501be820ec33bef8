"""The picture of many runs per plan."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from toy_answer import toy_answer, toy_replay

from parc_jax.app.plot.spread import far_apart, spread
from parc_jax.common.errors import InputError


@pytest.fixture(scope="module")
def answer():
    return toy_answer()


def many_runs(answer, repeats: int):
    """Every run of the toy replay, repeated with a growing sideways shift."""
    shifts = [toy_replay(answer, shift) for shift in np.linspace(-0.02, 0.02, repeats)]
    path = np.stack([one.path for one in shifts], axis=1).reshape(-1, *shifts[0].path.shape[1:])
    return SimpleNamespace(
        path=path, failed=np.stack([one.failed for one in shifts], axis=1).ravel()
    )


@pytest.mark.slow
def test_error_bands_lie_inside_their_axes_and_files_are_written(answer, tmp_path):
    figure = spread(answer, many_runs(answer, 5), 5, tmp_path / "spread.png")
    assert isinstance(figure, Figure) and len(figure.axes) == 3
    assert {f.name for f in tmp_path.iterdir()} == {"spread.png", "spread.pdf"}
    band = figure.axes[1].collections[0].get_paths()[0].vertices
    assert band[:, 1].max() == pytest.approx(0.02) and band[:, 1].min() == pytest.approx(-0.02)


def test_it_draws_on_given_axes(answer):
    axes = Figure().subplots(1, 3)
    assert spread(answer, many_runs(answer, 3), 3, axes, shown=2) is axes
    assert "2 of 4 plans" in axes[0].get_title(loc="left") + axes[0].get_title()


def test_wrong_number_of_runs_is_refused(answer):
    with pytest.raises(InputError, match="expected 4 runs of each of the 4 samples"):
        spread(answer, many_runs(answer, 3), 4)


def test_far_apart_points_are_the_corners():
    points = np.array([[0.0, 0.0], [0.1, 0.0], [1.0, 0.0], [0.0, 1.0], [0.1, 0.1]])
    assert set(far_apart(points, 3)) == {0, 2, 3}
    assert len(far_apart(points, 99)) == 5
