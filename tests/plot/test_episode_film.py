"""What a film of an episode shows: the robot is where it was, inside of what is drawn around it,
and stops where it is shown to stop.
"""

import json

import numpy as np
import pytest
from covered import covered
from episodes import driven

from parc_jax.app import figures
from parc_jax.app.plot import film
from parc_jax.app.plot.episode import Stage
from parc_jax.app.plot.page import episode_data
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import episode_of, episode_part


@pytest.fixture(scope="module", params=[False, True], ids=["", "turning"])
def known(request):
    """An episode as from its file."""
    commitments = driven(request.param)
    return episode_of(json.loads(json.dumps(episode_part(commitments))), "test")


def test_the_body_drives_inside_of_what_it_may_reach_to_the_stop_that_is_shown(known):
    for one in Stage(known, None).shown:
        times = one.begin + one.path.times
        for t in (times[:-1] + times[1:]) / 2:
            assert all(covered(outline, one.tube).all() for outline in one.predicted(t))
        for at_rest, shown in zip(one.predicted(times[-1]), one.rest, strict=True):
            np.testing.assert_allclose(at_rest, shown, atol=1e-12)


def test_the_true_robot_is_shown_where_it_was(known):
    shown = Stage(known, None).shown
    assert shown[-1].begin > shown[0].begin
    for one in shown:
        pose = np.array([*one.pose.place, one.pose.heading or 0.0])
        here, there = one.driven(pose), one.driven(pose + np.array([1, -2, 0]))
        for true, begun in zip(here, one.predicted(one.begin), strict=True):
            np.testing.assert_allclose(true, begun, atol=1e-12)
        for true, before in zip(there, here, strict=True):
            np.testing.assert_allclose(true, before + np.array([1, -2]), atol=1e-12)


def test_what_is_no_episode_is_refused(tmp_path):
    (tmp_path / "answer.json").write_text("{}")
    with pytest.raises(InputError, match="expected a"):
        figures.film(tmp_path / "answer.json", tmp_path / "film.gif")
    with pytest.raises(InputError, match="ffmpeg"):
        figures.film(tmp_path / "answer.json", tmp_path / "film.avi")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["answer.json"]


def test_what_it_may_reach_is_drawn_and_named_from_its_stated_pose(known, tmp_path):
    """What the pose may be off is not in it: the obstacles of the proof have grown by that."""
    one = Stage(known, None).shown[0]
    (outline,) = one.predicted(one.begin)
    beside = outline - [one.path.tube[0, 0, 0] + 0.01, 0.0]
    assert covered(outline, one.tube).all() and not covered(beside, one.tube).all()
    labels = [handle.get_label() for handle in film._episode_handles(None, known.copies)]
    assert "may reach from its stated pose, in the tube" in labels
    assert not any("spread" in label for label in labels)
    (robot, *_) = film._episode_handles(None, 3)
    assert robot.get_label() == "robot, as predicted, spread by uncertainty"
    figures.write_page(known, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "all that it may reach from its stated pose inside the tube" in page
    data = episode_data(Stage(known, None))
    under = " Under an assumed tube: see the statement."
    assert not data["doubt"] and data["notes"] == under
    told = {"clock": "progress, no time"}, {"TUBE_LEFT": "by 1 s"}
    for assumed, note in zip(told, ("Seconds are its clock's", "Some tube was left"), strict=True):
        part = episode_part(driven(False, 1), assumed=assumed)
        stage = Stage(episode_of(json.loads(json.dumps(part)), "test"), None)
        assert episode_data(stage)["notes"] == f" {note}: see the statement.{under}"
        figures.film(stage.driven, tmp_path / "film.gif")
    assert episode_data(Stage(known._replace(copies=3), None))["doubt"]
