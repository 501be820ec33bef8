"""Every picture is drawn from plain results, on a new figure, to files and onto given Axes."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_bodies import bare_answer, car, drone
from matplotlib.figure import Figure
from toy_answer import K, toy_answer, toy_replay

from parc_jax.app.plot import film, shapes
from parc_jax.app.plot.regions import regions, safe_regions
from parc_jax.app.plot.samples import samples
from parc_jax.app.study.replay import Replay
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.statement import VALIDATED
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.regions import enumerate_regions


@pytest.fixture(scope="module")
def answer():
    return toy_answer()


def test_samples_show_starts_tubes_and_failed_runs(answer, tmp_path):
    drawn = samples(answer, toy_replay(answer), tmp_path / "a.png")
    assert isinstance(drawn, Figure)
    whole, near = drawn.axes
    assert whole.get_aspect() == near.get_aspect() == 1.0
    told = (
        "4 safe samples under an assumed tube; of 4 runs in the black box 4 reach the goal, 1 touch"
    )
    assert whole.get_title("left").replace("\n", " ") == told
    labels = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert "true run that failed" in labels and "goal" in labels
    lo, hi = np.array([whole.get_xlim(), whole.get_ylim()]).T
    grown = shapes.grown(answer.problem.obstacles[0], answer.problem.parts[0])
    for points in (answer.samples[:, :2], answer.samples[:, :2] + K, grown):
        assert (points >= lo).all() and (points <= hi).all()
    assert {p.name for p in tmp_path.iterdir()} == {"a.png", "a.pdf"}


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("pac", ""),
        (VALIDATED, " under a tube that runs may leave"),
        ("assumed", " under an assumed tube"),
        ("declared", " under a declared tube"),
    ],
)
def test_samples_regions_and_films_tell_of_a_tube_that_runs_may_leave(answer, kind, words):
    one = toy_answer()
    one.corridors = ()
    one.model = answer.model.replace(claim=replace(answer.model.claim, kind=kind))
    one.scene = replace(one.scene, nominal=replace(one.scene.nominal, model=one.model))
    table = enumerate_regions(one.model.net, one.model.domain)
    drawn = [samples(one), regions(one, table)]
    titles = [figure.axes[0].get_title("left") for figure in drawn]
    assert titles == [f"4 safe samples{words}", f"1 region{words}"]
    caption = film._PlanCanvas(one, 0, None).figure._suptitle.get_text().split("\n")
    assert caption[1:-1] == [words[1:]] * bool(words)


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
    assert above.get_title("left") == "1 safe sample under an assumed tube\nfrom above"
    for ax, axes in ((above, (0, 1)), (side, (0, 2)), (front, (1, 2))):  # a wall, from each side
        lo, hi = np.array([ax.get_xlim(), ax.get_ylim()]).T
        for wall in answer.problem.obstacles:
            outline = shapes.shadow(wall, axes)
            assert (outline > lo).all() and (outline < hi).all()


def test_a_picture_is_of_one_answer(answer):
    """In another scene the same plans reach and touch something else."""
    seen = toy_replay(answer)
    samples(answer, seen)
    for other in (
        seen._replace(scene=toy_answer().scene),
        seen._replace(plans=seen.plans + 1e-9),
        seen._replace(plans=seen.plans[::-1]),
    ):
        said = "replay of the 4 samples of this answer; got one of 4 plans, or in another order, or"
        with pytest.raises(InputError, match=said):
            samples(answer, other)
    K = answer.model.domain
    part = enumerate_regions(answer.model.net, box(K.lo, K.lo + 0.5 * (K.hi - K.lo)))
    with pytest.raises(InputError, match="those of the answer's network over its K"):
        safe_regions(answer, part)


def test_what_is_drawn_under_an_uncertainty_is_called_that():
    model, problem = car()
    known = problem.replace(uncertainty=Uncertainty(k={0: 0.01}, goal=0.01, given={1: 0.2}))
    asked = query(known, model).nominal()
    answer = bare_answer(asked.model, asked.problem, [[-1.6, 0.2, 0.1]])
    answer.scene.nominal = asked
    labels = [text.get_text() for text in samples(answer).legends[0].get_texts()]
    canvas = film._PlanCanvas(answer, 0, None)
    in_film = [text.get_text() for text in canvas.figure.legends[0].get_texts()]
    for words in (labels, in_film):
        assert {"obstacle, grown by what is uncertain", "goal, less what is uncertain"} < {*words}
        assert "predicted path (one possible run)" in words
    title = canvas.figure._suptitle.get_text()
    assert title.endswith(f"{model.labels.k[1]} = 0.2 (measured)")
    assert ": one possible run of the model, sample 0" in title


def test_a_picture_of_some_samples_tells_all_runs_of_all_of_them(answer):
    """Two runs of each of four samples, of the last the second one failed."""
    once, n = toy_replay(answer), len(answer.samples)
    twice = Replay(*(np.repeat(part, 2, axis=0) for part in once[:-1]), answer.scene)
    first = np.arange(2 * n) == 2 * n - 2
    twice = twice._replace(touched=once.touched.repeat(2) & ~first)
    twice = twice._replace(clearance=np.where(first, 0.1, twice.clearance))
    title = samples(answer, twice, most=3).axes[0].get_title("left").replace("\n", " ")
    assert title.startswith("3 of 4 safe samples under an assumed tube; of 8 runs in the black box")
    assert title.endswith(" 8 reach the goal, 1 touch")
    labels = [each.get_text() for each in samples(answer, twice, most=3).legends[0].get_texts()]
    assert "true run that failed" not in labels  # none of those that are drawn
    labels = [each.get_text() for each in samples(answer, twice).legends[0].get_texts()]
    assert "true run that failed" in labels
    with pytest.raises(InputError, match="expected a replay of the 4 samples of this answer"):
        samples(answer, Replay(*(part[:7] for part in twice[:-1]), answer.scene))


def test_a_title_ends_within_its_picture(answer):
    narrow = answer.problem.replace(goal=box([4.0, -30.0, -9.0], [5.0, 30.0, 9.0]))
    tall = bare_answer(answer.model, narrow, answer.samples)
    tall.scene.at, once = 1, toy_replay(answer)
    for one in (answer, tall):
        figure = samples(one, once._replace(scene=one.scene))
        figure.draw_without_rendering()
        for ax in figure.axes:
            title = ax._left_title.get_window_extent()
            assert title.x1 <= figure.bbox.x1 and title.y1 <= figure.bbox.y1
