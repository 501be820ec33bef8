"""The model of a system: what it shows of itself, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from toy_models import random_model

import parc_jax as pj


def test_a_model_is_one_short_line():
    model = random_model(np.random.default_rng(1), 4, (6, 5), (1, 2), 0.02)
    text = repr(model)
    assert len(text) < 300 and "\n" not in text
    assert "6-5" in text and "assumed" in text and "2 bins" in text
    assert len(repr(model.net)) < 60


def test_a_tube_that_is_not_the_claims_is_refused_on_load_and_in_python(tmp_path):
    model = random_model(np.random.default_rng(1), 4, (6, 5), (1, 2), 0.02)
    path = model.save(tmp_path / "model.npz")
    with np.load(path) as file:
        arrays = dict(file)
    arrays["interval"] = arrays["interval"] * 1e-3
    np.savez(tmp_path / "narrow.npz", **arrays)
    assert pj.load(path).tube.hash == model.tube.hash
    with pytest.raises(pj.InputError, match="tube that it was made about"):
        pj.load(tmp_path / "narrow.npz")
    narrow = pj.tube(model.tube.edges, arrays["interval"], model.tube.final)
    other = replace(model.claim, tube=narrow)
    with pytest.raises(pj.InputError, match="tube that it was made about"):
        pj.trajectory_model(model.net, other, model.domain, model.time)


def test_a_saved_model_comes_back_equal(tmp_path):
    model = random_model(np.random.default_rng(1), 4, (6, 5, 6), (1, 2), 0.02)
    again = pj.load(model.save(tmp_path / "model.npz"))
    assert again.net.hash == model.net.hash and again.tube.hash == model.tube.hash
    assert (again.time, again.system) == (model.time, model.system)
    assert (again.domain.lo == model.domain.lo).all() and (again.domain.hi == model.domain.hi).all()
    assert again.claim.to_json() == model.claim.to_json()
