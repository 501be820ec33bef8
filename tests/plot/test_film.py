"""Films: of any robot, from above, its true run or the prediction of the model; and their files."""

from types import SimpleNamespace

import numpy as np
import pytest
from drawn_bodies import CAR_AT, bare_answer, car, turned
from matplotlib.image import imread
from toy_answer import toy_answer, toy_replay

from parc_jax.app.plot import film as film_module
from parc_jax.app.plot.film import RATE, REST, film, require_kind, require_sample, write_film
from parc_jax.common.errors import InputError

INK = {"goal": (203, 232, 223), "block": (110, 110, 110), "tube": (214, 232, 245)}


def frames(folder):
    return [imread(path)[..., :3] * 255 for path in sorted(folder.iterdir())]


def near(image, color) -> np.ndarray:
    """(n, 2) row and column of the pixels of about this colour."""
    return np.argwhere(np.abs(image - np.array(color)).max(axis=-1) < 12)


@pytest.mark.night
@pytest.mark.parametrize("true", [False, True])
def test_a_prediction_and_a_true_run(tmp_path, true, capsys):
    answer = toy_answer()
    run = toy_replay(answer, shift=0.05).path[1] if true else None
    shown = frames(film(answer, tmp_path / "film", 1, run))
    assert len(shown) == round(answer.model.time.t_f * RATE) + 1 + round(REST * RATE)
    for name, color in INK.items():
        assert len(near(shown[0], color)) > 50, name
    moved = np.abs(shown[0] - shown[-1]).max(axis=-1) > 30
    columns = np.argwhere(moved)[:, 1]
    assert np.ptp(columns) > 200  # the robot went from the left to the right
    assert (shown[-1] == shown[-round(REST * RATE)]).all() and capsys.readouterr().err == ""


def test_the_body_turns_with_its_points(tmp_path, monkeypatch):
    """The polygon that is drawn is the turned rectangle, at every frame; the last one by k_1."""
    seen = []
    move = film_module._Side.move

    def watched(side, *args):
        move(side, *args)
        seen.append(side.body[0].get_xy()[:-1])

    monkeypatch.setattr(film_module._Side, "move", watched)
    film(bare_answer(*car(), [[-1.6, 0.2, 0.0, 1.0]]), tmp_path / "film")
    assert len(seen) == 26
    for outline, heading in ((seen[0], 0.0), (seen[-1], 1.0)):
        expected = turned(CAR_AT, heading)
        expected = expected - expected.mean(axis=0) + outline.mean(axis=0)
        gaps = np.linalg.norm(outline[:, None] - expected[None], axis=-1)
        assert len(outline) == 4 and gaps.min(axis=0).max() < 1e-9


def test_a_run_of_one_point_is_no_run_of_a_car(tmp_path):
    answer = bare_answer(*car(), [[-1.6, 0.2, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"8 columns.*got 2"):
        film(answer, tmp_path / "film", run=np.zeros((9, 2)))


def test_what_cannot_be_filmed_is_refused(tmp_path):
    answer = toy_answer()
    with pytest.raises(InputError, match="0 to 3; got 4"):
        film(answer, tmp_path / "film.gif", 4)
    with pytest.raises(InputError, match=r"film\.avi"):
        film(answer, tmp_path / "film.avi")
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_is_refused_before_anything_is_rendered(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"film\.webm"):
        require_kind(tmp_path / "film.webm")


def test_gif_and_frames(tmp_path):
    from PIL import Image

    images = [np.full((20, 30, 3), 40 * i, np.uint8) for i in range(5)]
    with Image.open(write_film(tmp_path / "new" / "film.gif", images, 10.0)) as gif:
        assert gif.n_frames == 5 and gif.size == (30, 20) and gif.info["duration"] == 100
        gif.seek(4)
        assert np.abs(np.asarray(gif.convert("RGB")).astype(int) - 160).max() < 8
    folder = write_film(tmp_path / "frames", images, 10.0)
    assert [p.name for p in sorted(folder.iterdir())] == [f"{i:04d}.png" for i in range(5)]
    for own in ("mine.png", "2024.png"):
        (folder / own).write_bytes(b"")
    write_film(folder, images[:2], 10.0)  # the end of a longer film became that of this one
    assert sorted(p.name for p in folder.iterdir()) == [
        "0000.png",
        "0001.png",
        "2024.png",
        "mine.png",
    ]


def test_other_samples_than_there_are_are_refused():
    with pytest.raises(InputError, match="has none to film"):
        require_sample(SimpleNamespace(samples=np.zeros((0, 4))), 0)
    for sample in (-1, 3):
        with pytest.raises(InputError, match=f"one of 3 safe samples, 0 to 2; got {sample}"):
            require_sample(SimpleNamespace(samples=np.zeros((3, 4))), sample)
