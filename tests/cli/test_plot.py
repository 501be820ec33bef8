"""`plot` from the shell: films of robots that are here and of those that are not, progress,
places.
"""

import jax
import numpy as np
import pytest
import toy_query
from matplotlib.image import imread
from robot_text import ROBOT
from toy_models import model_of, random_network

import parc_jax as pj


@pytest.fixture
def shell(shell, tmp_path):
    """The shell beside an answer of the toy query."""
    toy_query.answer().save(tmp_path / "answer.json")
    return shell


def test_without_the_simulator_the_prediction_is_filmed_and_that_is_said(shell, tmp_path):
    code, said, complained = shell("plot", "answer.json", "--video", "film", "--sample", 1)
    assert code == 0 and said == "film\n"
    assert "no simulator of 'toy' is here" in complained and "--system MODULE" in complained
    assert "frame" in complained  # the bar
    assert len(list((tmp_path / "film").iterdir())) > 25


@pytest.mark.night
def test_with_a_simulator_a_true_run_is_filmed(shell, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "folded_robot.py").write_text(ROBOT.format(name="toy", dt=0.25))
    command = ("plot", "answer.json", "--system", "folded_robot", "--quiet")
    assert shell(*command, "--video", "film") == (0, "", "")
    first = imread(tmp_path / "film" / "0000.png")
    assert first.shape[:2] == (500, 720)
    code, _, complained = shell("plot", "answer.json", "--system", "none", "--video", "f.gif")
    assert code == 2 and "without .py; got 'none'" in complained
    assert not (tmp_path / "f.gif").exists()


@pytest.mark.parametrize(
    ("name", "dt", "differs"), [("toy", 0.5, "time"), ("another", 0.25, "system")]
)
def test_another_robot_is_not_filmed_as_this_one(shell, tmp_path, monkeypatch, name, dt, differs):
    monkeypatch.syspath_prepend(tmp_path)
    module = f"robot_{name}_of_{round(100 * dt)}"
    (tmp_path / f"{module}.py").write_text(ROBOT.format(name=name, dt=dt))
    command = ("plot", "answer.json", "--video", "f.gif", "--quiet")
    code, said, complained = shell(*command, "--system", module)
    assert code == 2 and said == "" and complained.count("\n") == 1
    assert "the system of this model, 'toy', and" in complained
    assert f"premises that agree; {differs} is " in complained and not (tmp_path / "f.gif").exists()


def test_a_film_of_its_own_is_of_its_own_robot_alone(shell, tmp_path):
    command = ("plot", "answer.json", "--video", "f.gif", "--quiet")
    code, _, complained = shell(*command, "--system", "drift_parking")
    assert code == 2 and "system is toy, beside drift_parking" in complained
    assert not (tmp_path / "f.gif").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--video", "film.avi"), "expected a .gif file"),
        (("--video", "f.gif", "--sample", "99"), "one of 5 safe samples, 0 to 4; got 99"),
        (("--out", "answer.json"), "answer.json is a file and no folder. Name another place"),
        (("--html", "answer.json/page.html"), "is a file and no folder"),
        (("--html", "folder.html"), "there is a folder of that name"),
        (("--html", "p.html", "--sample", "1"), "--sample: expected no such option; they are of"),
        (("--out", "p", "--system", "toy"), "--system: expected no such option; they are of"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence(shell, tmp_path, arguments, message):
    (tmp_path / "folder.html").mkdir()
    before = sorted(tmp_path.rglob("*"))
    code, said, complained = shell("plot", "answer.json", *arguments, "--quiet")
    assert code == 2 and said == "" and message in complained and complained.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_options_of_an_answer_are_refused_of_an_episode(shell, tmp_path):
    (tmp_path / "drive.json").write_text('{"format": "parc_jax.episode/0"}')
    options = ("--html", "d.html", "--figures", "samples", "--sample", "3", "--out", "q")
    code, said, complained = shell("plot", "drive.json", *options)
    told = "--figures, --out, --sample: expected no such option; an episode has none of it."
    assert code == 2 and said == "" and told in complained


def test_model_and_scene_the_wrong_way_round(shell):
    code, _, complained = shell("solve", "scene.toml", "model.npz", "--no-cache")
    assert code == 2 and "Swap the two" in complained


def test_pictures_of_another_answer_are_told_where_this_one_has_none(shell, tmp_path):
    """It said alone that there is nothing to draw, beside pictures of plans."""
    net = random_network(np.random.default_rng(0), 4, n_k=1)
    model = model_of(net, pj.box([-1], [1]), np.full((1, 4, 2), 0.01), np.full((1, 3), 0.01))
    far = pj.reach_avoid(pj.box([500.0] * 3, [501.0] * 3), [], 0.1, pj.box([0, 0], [1, 1]))
    answer = pj.Planner(model).solve(far, jax.random.key(0), pj.Settings(samples=2, work=0.02))
    answer.save(tmp_path / "none.json")
    (tmp_path / "old").mkdir()
    for place in (tmp_path, tmp_path / "old"):
        (place / "samples.png").write_bytes(b"")
    code, _, complained = shell("plot", "none.json", "--out", "old")
    assert code == 0 and "no plane of parameters to draw" in complained
    assert "samples.png in old: of another answer." in complained
    code, _, complained = shell("plot", "none.json", "--html", "old/page.html")
    assert code == 0 and "of another answer" not in complained  # where nothing is drawn
