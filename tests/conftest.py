"""Strict numerics for every test: float64 on, no silent promotion, CPU unless --gpu."""

import os
from pathlib import Path

import pytest

SHAPE_CHECKED = ["parc_jax.sets"]  # annotated shapes and types of these hold at every call


def pytest_addoption(parser):
    parser.addoption("--gpu", action="store_true", help="run on the accelerator JAX finds, and the gpu tests")


def pytest_configure(config):
    if not config.getoption("--gpu"):
        os.environ["JAX_PLATFORMS"] = "cpu"
    import jax
    from jaxtyping import install_import_hook

    install_import_hook(SHAPE_CHECKED, "beartype.beartype")  # before anything of these is imported
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_numpy_dtype_promotion", "strict")
    jax.config.update("jax_numpy_rank_promotion", "raise")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--gpu"):
        for item in items:
            if "gpu" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="needs --gpu"))


@pytest.fixture
def rng():
    import numpy as np

    return np.random.default_rng(20240913)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Reference data of other implementations, beside the checkout; tests that use it skip when it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("reference data not present")
    return folder
