"""Films as files: kinds, palettes, and refusals before anything is drawn."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from parc_jax.app.plot.film import require_kind, require_sample, write_film
from parc_jax.common.errors import InputError


def test_what_cannot_be_written_is_refused_before_anything_is_rendered(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"film\.webm"):
        require_kind(tmp_path / "film.webm")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"pip install 'parc_jax\[film\]'"):
        require_kind(tmp_path / "film.mp4")


def test_gif_and_frames(tmp_path):
    from PIL import Image

    images = [np.full((20, 30, 3), 40 * i, np.uint8) for i in range(5)]
    with Image.open(write_film(tmp_path / "new" / "film.gif", images, 10.0)) as gif:
        assert gif.n_frames == 5 and gif.size == (30, 20) and gif.info["duration"] == 100
        gif.seek(4)
        assert np.abs(np.asarray(gif.convert("RGB")).astype(int) - 160).max() < 8
    folder = write_film(tmp_path / "frames", images, 10.0)
    assert [p.name for p in sorted(folder.iterdir())] == [f"{i:04d}.png" for i in range(5)]


def test_with_few_colours_a_gif_has_no_more(tmp_path):
    from PIL import Image

    images = [np.random.default_rng(0).integers(0, 256, (20, 30, 3), np.uint8)] * 2
    with Image.open(write_film(tmp_path / "film.gif", images, 10.0, colours=8)) as gif:
        assert len(gif.convert("RGB").getcolors()) <= 8


def test_other_samples_than_there_are_are_refused():
    with pytest.raises(InputError, match="has none to film"):
        require_sample(SimpleNamespace(samples=np.zeros((0, 4))), 0)
    for sample in (-1, 3):
        with pytest.raises(InputError, match=f"one of 3 safe samples, 0 to 2; got {sample}"):
            require_sample(SimpleNamespace(samples=np.zeros((3, 4))), sample)
