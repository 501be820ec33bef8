"""Every picture is drawn from plain results, on a new figure, to files and onto given Axes."""

from fractions import Fraction

import numpy as np
import pytest
from drawn_bodies import bare_answer, car, drone
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from toy_answer import K, ToyPolytopes, toy_answer, toy_replay

from parc_jax.app.plot import shapes
from parc_jax.app.plot.errors import Entry, errors, quantile
from parc_jax.app.plot.projections import default_pairs, projections
from parc_jax.app.plot.samples import samples
from parc_jax.app.plot.timeline import clearances, direction_runs, timeline
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.fixture(scope="module")
def answer():
    return toy_answer()


def pac(answer):
    """The toy claim dressed as a pac claim."""
    from dataclasses import replace

    level = Fraction(1, 1000)
    return replace(answer.model.claim, kind="pac", eps=level, delta=level, n=7000)


def test_samples_show_starts_tubes_and_failed_runs(answer, tmp_path):
    drawn = samples(answer, toy_replay(answer), tmp_path / "a.png")
    assert isinstance(drawn, Figure)
    whole, near = drawn.axes
    assert whole.get_aspect() == near.get_aspect() == 1.0
    assert whole.get_title("left") == "4 safe samples; in the black box 4 reach the goal, 1 touch"
    labels = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert "true run that failed" in labels and "goal" in labels
    lo, hi = np.array([whole.get_xlim(), whole.get_ylim()]).T
    grown = shapes.grown(answer.problem.obstacles[0], answer.problem.parts[0])
    for points in (answer.samples[:, :2], answer.samples[:, :2] + K, grown):
        assert (points >= lo).all() and (points <= hi).all()
    assert {p.name for p in tmp_path.iterdir()} == {"a.png", "a.pdf"}


def test_samples_show_the_body_and_the_tube_of_every_point():
    answer = bare_answer(*car(e=0.02), [[-1.6, 0.2, 0.1, 0.4], [-1.5, 0.2, 0.0, 0.3]])
    drawn = samples(answer)
    (ax,) = drawn.axes
    sizes = [len(part.get_paths()) for part in ax.collections]
    assert 2 * 4 * 8 in sizes and 4 * 8 in sizes  # tubes: plans, points, intervals
    labels = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert "body, first sample" in labels and "grown by the body" not in labels
    assert f"predicted path ({answer.model.points[0]})" in labels


def test_samples_in_space_are_seen_from_three_sides():
    answer = bare_answer(*drone(), [[-2.2, -0.2, -0.5, 0.1, 0.4, 0.1]])
    above, side, front = samples(answer).axes
    assert [above.get_xlabel(), above.get_ylabel()] == ["x [m]", "y [m]"]
    assert [side.get_xlabel(), side.get_ylabel()] == ["x [m]", "z [m]"]
    assert [front.get_xlabel(), front.get_ylabel()] == ["y [m]", "z [m]"]
    assert above.get_title("left") == "1 safe sample\nfrom above"
    for ax, axes in ((above, (0, 1)), (side, (0, 2)), (front, (1, 2))):  # a wall, from each side
        lo, hi = np.array([ax.get_xlim(), ax.get_ylim()]).T
        for wall in answer.problem.obstacles:
            outline = shapes.shadow(wall, axes)
            assert (outline > lo).all() and (outline < hi).all()


def test_samples_refuse_what_they_cannot_draw(answer):
    replay = toy_replay(answer)
    replay.path = replay.path[:2]
    with pytest.raises(InputError, match="replay of the 4 samples"):
        samples(answer, replay)
    empty = toy_answer()
    empty.samples = empty.samples[:0]
    with pytest.raises(InputError, match="has none"):
        samples(empty)


def test_errors_draw_both_kinds_on_one_scale(answer):
    claimed = pac(answer)
    entries = [Entry("4×8", answer.model.claim, claimed), Entry("affine", answer.model.claim, None)]
    drawn = errors(entries, answer.model.time)
    left, right = drawn.axes
    assert left.get_ylim() == right.get_ylim() and left.get_yscale() == "log"
    assert right.get_title("left") == "claimed: left with probability ≤ 0.001, confidence 0.999"
    assert len(left.patches) == 2 and len(right.patches) == 1
    with pytest.raises(InputError):
        errors([], answer.model.time)


def test_weighted_quantile_is_the_smallest_value_that_carries_the_weight():
    values, share = np.array([[3.0], [1.0], [2.0]]), np.array([0.5, 0.2, 0.3])
    assert [quantile(values, share, q)[0] for q in (0.1, 0.2, 0.5, 0.51, 1.0)] == [
        1.0,
        1.0,
        2.0,
        3.0,
        3.0,
    ]


def test_projections_contain_the_samples(answer):
    drawn = projections(answer)  # its polytopes are cut for it
    assert len(drawn.axes) == len(default_pairs(2, 2)) == 6
    for ax, pair in zip(drawn.axes, default_pairs(2, 2), strict=True):
        x, y = answer.samples[:, pair[0]], answer.samples[:, pair[1]]
        assert ax.get_xlim()[0] <= x.min() <= x.max() <= ax.get_xlim()[1]
        assert ax.get_ylim()[0] <= y.min() <= y.max() <= ax.get_ylim()[1]
    assert len(projections(answer, pairs=[(0, 1), (2, 3)]).axes) == 2
    with pytest.raises(InputError, match="fills rows"):
        projections(answer, pairs=[(0, 1)] * 4)


def test_timeline_clearance_is_the_distance_to_the_grown_block(answer):
    gaps = clearances(answer, answer.samples[3])
    # plan 3 ends at (0, 0.02); block 0 starts at y = 0.3, the body takes 0.1 and the tube 0.02
    assert gaps[0, 3] == pytest.approx(0.3 - 0.02 - 0.1 - 0.02, abs=1e-9)
    drawn = timeline(answer, (0, 3), toy_replay(answer), names=["upper", "lower"])
    assert len(drawn.axes) == 4 and drawn.axes[2].get_yticklabels()[0].get_text() == "lower"
    with pytest.raises(InputError):
        timeline(answer, (4,))


def test_direction_runs_are_unit_sums_of_rows(answer):
    upper, lower = direction_runs(answer, answer.certificates[0]["sep"])
    assert [(first, end) for first, end, _ in upper] == [(0, 2), (2, 4)]
    assert upper[0][2] == pytest.approx([-np.sqrt(0.5), -np.sqrt(0.5)])
    assert lower[0][2] == pytest.approx([0.0, 1.0]) and upper[1][2] == pytest.approx([0.0, -1.0])


def test_many_polytopes_are_drawn_as_their_union(answer):
    """Two overlapping squares among many: no line where they meet, one around both."""

    def lines_inside(copies):
        crowd = toy_answer()
        square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
        crowd.samples = crowd.samples[:0]
        cut = ToyPolytopes([square, square + np.array([0.5, 0])] * (2 * copies))
        figure = projections(crowd, cut, pairs=[(0, 1)])
        figure.set_dpi(100)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        image = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
        ax = figure.axes[0]
        row = ax.transData.transform([0, 0.5])[1]
        left, right = (ax.transData.transform([x, 0.5])[0] for x in (0.1, 1.4))
        inside = image[int(image.shape[0] - row), int(left) : int(right)]
        return int((np.abs(inside - inside[0]).max(axis=1) > 8).sum())

    assert lines_inside(100) == 0 < lines_inside(1)


def test_the_second_panel_of_samples_only_where_it_shows_more(answer, tmp_path):
    assert len(samples(answer).axes) == 2
    wide = toy_answer()  # a goal as large as the scene
    wide.problem = reach_avoid(box([-2, -2, -1.0], [2, 2, 1.0]), [], 0.1)
    wide.scene = scene_of(wide.problem, wide.model)
    assert len(samples(wide, to=tmp_path / "a.png").axes) == 1
    with pytest.raises(InputError, match="matplotlib Axes"):
        samples(answer, to=np.array([1, 2]))


def test_verdicts_are_in_words():
    from parc_jax.common.status import OfRegion

    assert not any("BRS" in word for word in (of.text for of in OfRegion))
