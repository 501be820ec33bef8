"""Films of episodes: the robot is where it was, inside of what is drawn around it, and stops where
it is shown to stop.
"""

import json
import math

import numpy as np
import pytest
from covered import covered
from episodes import driven

from parc_jax.app import figures
from parc_jax.app.plot import film
from parc_jax.app.plot.episode import Stage, Truth
from parc_jax.app.plot.film import RATE_OF_EPISODE, REST
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


@pytest.mark.slow
def test_a_film_has_a_frame_for_every_moment_and_one_sees_the_robot(known, tmp_path, monkeypatch):
    shapely = pytest.importorskip("shapely")
    seen = []
    monkeypatch.setattr(film, "write_film", lambda out, images, *_: seen.extend(images))
    figures.film(known, tmp_path / "film.gif")
    last = known.manoeuvres[-1]
    seconds = float(last.begin - known.manoeuvres[0].begin) + known.model.time.t_f
    assert len(seen) == math.ceil(seconds * RATE_OF_EPISODE) + 1 + round(REST * RATE_OF_EPISODE)
    blue = [0, 114, 178]
    for image in seen:
        middle = image[image.shape[0] // 2 - 40 : image.shape[0] // 2 + 40, 150:310]
        assert (np.abs(middle.astype(int) - blue).sum(axis=-1) < 30).sum() > 20
    pose = np.array([0.0, 0.0, 0.0])
    ring = shapely.box(-3, -3, 3, 3).difference(shapely.box(1, 1, 2, 2))
    truth = Truth(np.array([0.0, 0.1]), np.stack([pose, pose]), [np.eye(3)[:, :2]], [(0.0, ring)])
    seen.clear()
    figures.film(known, tmp_path / "film.gif", run=truth)
    free = [0xF3, 0xF0, 0xDC]
    assert (np.abs(seen[0].astype(int) - free).sum(axis=-1) < 6).mean() > 0.2


def test_what_is_no_episode_is_refused(tmp_path):
    (tmp_path / "answer.json").write_text("{}")
    with pytest.raises(InputError, match="expected a"):
        figures.film(tmp_path / "answer.json", tmp_path / "film.gif")
    with pytest.raises(InputError, match="mp4"):
        figures.film(tmp_path / "answer.json", tmp_path / "film.avi")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["answer.json"]
