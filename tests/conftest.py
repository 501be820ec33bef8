"""Strict numerics for every test: float64 on, no silent promotion, CPU unless --gpu."""

import gc
import importlib.util
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytest_plugins = ["compile_report"]
# Files whose tests call the same kernels, as their paths begin: with -n one worker compiles them
FAMILIES = {
    "runs": "claim rollout local study network sims benchmarks soundness/test_claims "
    "cli/test_nothing_lost verdict/test_outline",
    "plans": "bags ros verdict cover batch soundness robust certificate io onboard answer no_plan "
    "separation cli plot study/test_recorded test_planner test_methods",
}
ROOMS = "safe_set/separation safe_set/verdict safe_set/corridors proof/absence proof/regions"
# are given what is no shape at all, or say hardly any and are called most often
DOORS = "assemble domain prune stopping subdivide table"
KERNELS = [
    "parc_jax.safe_set.batch.estimate",
    "parc_jax.safe_set.batch.proposals",
    "parc_jax.safe_set.batch.search",
    "parc_jax.learning.network.maps",
    "parc_jax.learning.network.train",
    *(
        f"parc_jax.{room.replace('/', '.')}.{path.stem}"
        for room in ROOMS.split()
        for path in sorted((ROOT / "parc_jax" / room).glob("[a-z]*.py"))
        if path.stem not in DOORS.split()
    ),
]
# annotated shapes and types of these hold at every call
SHAPE_CHECKED = {
    "beartype.beartype": ["parc_jax.common.sets", "benchmarks.neuralparc.sets"],
    "shape_hook.functions": KERNELS,
}


def pytest_addoption(parser):
    parser.addoption(
        "--gpu", action="store_true", help="run on the accelerator JAX finds, and the gpu tests"
    )


def pytest_configure(config):
    gc.set_threshold(100_000)  # tracing makes millions of objects that all stay
    if not config.getoption("--gpu"):
        os.environ["JAX_PLATFORMS"] = "cpu"
    if importlib.util.find_spec("crazyflow"):  # it asks for this before SciPy is imported
        os.environ.setdefault("SCIPY_ARRAY_API", "1")
    # Each program that comes from the folder of compiled ones is remarked on, in vain, on stderr.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    import jax
    from jaxtyping import install_import_hook

    for checker, names in SHAPE_CHECKED.items():  # before anything of these is imported
        install_import_hook(names, checker)
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_numpy_dtype_promotion", "strict")
    jax.config.update("jax_numpy_rank_promotion", "raise")
    keep_compiled()


def keep_compiled():
    """Compiled programs of all test processes, of this run and later ones, in one ignored folder,
    or in the one that JAX_COMPILATION_CACHE_DIR names: most of a first run may go into compiling.
    Programs are found again by their content. The environment hands the folder on to processes that
    tests start, and to the shell's commands.
    """
    import jax

    from parc_jax.app.study.cache import processor

    folder = Path(
        os.environ.get("JAX_COMPILATION_CACHE_DIR") or ROOT / ".pytest_cache" / "compiled"
    )
    if folder.name != processor():  # native code; what starts a process has named the folder whole
        folder = folder / processor()
    folder.mkdir(parents=True, exist_ok=True)
    settings = {
        "jax_compilation_cache_dir": str(folder),
        "jax_persistent_cache_min_compile_time_secs": 0.0,  # small programs are many
        "jax_persistent_cache_min_entry_size_bytes": 0,
        # else the path of the folder is part of what names a program, and it cannot be moved
        "jax_persistent_cache_enable_xla_caches": "none",
    }
    for name, value in settings.items():
        jax.config.update(name, value)
        os.environ[name.upper()] = str(value)


def family(nodeid: str) -> str:
    """The group of a test: the one that names most of its file's path, or the file alone."""
    file = nodeid.split("::")[0]
    name = file.removeprefix("tests/")
    begins = [(one, start) for one, all in FAMILIES.items() for start in all.split()]
    found = [(len(start), one) for one, start in begins if name.startswith(start)]
    return max(found)[1] if found else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With -n and no --dist: a family stays on one worker. Marks of groups are lost with some
    versions of pytest.
    """
    if config.getvalue("dist") != "load":
        return None
    from xdist.scheduler.loadscope import LoadScopeScheduling

    scheduler = LoadScopeScheduling(config, log)
    scheduler._split_scope = family
    return scheduler


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--gpu"):
        for item in items:
            if "gpu" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="needs --gpu"))


def pytest_runtest_setup(item):
    from needs import need

    for mark in item.iter_markers("needs"):
        need(*mark.args)


@pytest.fixture
def rng():
    import numpy as np

    return np.random.default_rng(20240913)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Reference data of other implementations, beside the checkout; tests that use it skip when it
    is absent.
    """
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("reference data not present")
    return folder
