"""Files are whole or absent; nothing global changes; no picture starts a window system."""

import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from toy_answer import toy_answer

from benchmarks.curves import GapCurve, gap
from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.samples import samples
from parc_jax.app.plot.shapes import predicted
from parc_jax.common.errors import InputError
from parc_jax.problem.body import Part, Polygon
from parc_jax.problem.robust.pose import Pose

CURVES = [GapCurve("a", np.array([1.0, 2.0]), np.array([0.1, 0.5]))]


def test_a_failed_save_leaves_the_old_file(tmp_path, monkeypatch):
    (tmp_path / "f.png").write_bytes(b"old")
    figure = gap(CURVES)

    def broken(*args, **kwargs):
        raise OSError("disk full")

    monkeypatch.setattr(figure, "savefig", broken)
    with pytest.raises(OSError):
        style.save(figure, tmp_path / "f")
    assert (tmp_path / "f.png").read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 1


def test_titles_of_wide_scenes_are_whole(tmp_path):
    """Of axes with equal scales the first layout is wrong: no ink at the sheet's edge."""
    with style.sheet(tmp_path / "f", (9.0, 3.5), columns=2, width_ratios=[2.0, 1.0]) as sheet:
        for ax, wide in zip(sheet.axes, (34.0, 4.5), strict=True):
            ax.set_aspect("equal")
            ax.set_title("a title")
            ax.set_xlabel("x [m]")
            style.limits(ax, (0.0, 0.0), (wide, 17.0 if wide > 5 else 4.5))
        style.legend(sheet.figure, [style.mark("a line")] * 7, 4)
    ink = np.asarray(Image.open(tmp_path / "f.png").convert("L")) < 128
    assert ink.any() and not ink[:3].any()


def test_pictures_of_an_answer_from_here_name_their_frame():
    answer = toy_answer()
    for pose, told in ((None, ""), (Pose(np.zeros(2)), ""), (Pose(np.zeros(2), 0.1), "robot's")):
        nominal = replace(answer.scene.nominal, pose=pose)
        scene = SimpleNamespace(nominal=nominal, at=None, box_of_k="K")
        shown = SimpleNamespace(**vars(answer) | {"scene": scene})
        label = samples(shown).axes[0].get_xlabel()
        assert label == (f"x [m], {told} frame" if told else "x [m]")


def test_given_axes_are_drawn_on_and_returned():
    ax = Figure().subplots()
    assert gap(CURVES, ax) is ax
    assert ax.get_legend() is not None and len(ax.lines) > 0
    with pytest.raises(InputError, match="1 matplotlib Axes"):
        gap(CURVES, [ax, ax])


def test_no_global_setting_survives():
    before = dict(matplotlib.rcParams)
    gap(CURVES)
    assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
def test_importing_pictures_does_not_import_matplotlib_or_pyplot():
    modules = ("samples", "regions", "film", "page")
    code = "import sys; " + "; ".join(f"import parc_jax.app.plot.{m}" for m in modules)
    code += "; assert 'matplotlib' not in sys.modules; from benchmarks.curves import *"
    code += "; gap([GapCurve('a', [1.0], [0.5])]); assert 'matplotlib.pyplot' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_tubes_are_the_swept_boxes(rng):
    path, error = np.cumsum(rng.normal(size=(3, 5, 2)), axis=1), rng.uniform(0.05, 0.3, (3, 4, 2))
    hexagons = shapes.tubes(path, error)
    assert hexagons.shape == (3, 4, 6, 2)
    for run in range(3):
        for t in range(4):
            corners = np.array([[sx, sy] for sx in (-1, 1) for sy in (-1, 1)]) * error[run, t]
            swept = np.concatenate([path[run, t] + corners, path[run, t + 1] + corners])
            for angle in np.linspace(0, 2 * np.pi, 33):
                w = np.array([np.cos(angle), np.sin(angle)])
                assert (hexagons[run, t] @ w).max() == pytest.approx((swept @ w).max(), abs=1e-12)


def test_grown_obstacles_hold_obstacle_and_body():
    problem = toy_answer().problem
    plain = shapes.grown(problem.obstacles[0], problem.parts[0])
    assert plain.max(axis=0) == pytest.approx([0.1, 0.7], abs=1e-3)
    assert plain.min(axis=0) == pytest.approx([-0.6, 0.2], abs=1e-3)
    triangle = np.array([[0.0, 0.0], [0.2, 0.0], [0.0, 0.1]])
    turned_in = shapes.grown(problem.obstacles[0], Part((0,), Polygon(triangle)))
    assert turned_in.min(axis=0) == pytest.approx([-0.7, 0.2])
    assert turned_in.max(axis=0) == pytest.approx([0.0, 0.6])
    turned = shapes.placed(np.array([[1.0, 0.0]]), np.array([5.0, 5.0]), np.pi / 2)
    assert turned == pytest.approx(np.array([[5.0, 6.0]]))


def test_predictions_on_the_host_are_the_network_s():
    answer = toy_answer()
    path, q, error = predicted(answer.model, answer.samples)
    n = len(answer.samples)
    expected = (
        answer.samples[:, None, :2]
        + np.linspace(0, 1, 5)[None, :, None] * answer.samples[:, None, 2:]
    )
    assert path == pytest.approx(expected) and q == pytest.approx(answer.samples[:, 2:3])
    assert error.shape == (n, 4, 2) and (error == 0.02).all()
