"""FMUs as black boxes: the model's own numbers, seeds, early ends, and what cannot be run here."""

import random
import shutil
import subprocess
import sys
import zipfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import jax
import numpy as np
import pytest
from needs import need

import parc_jax as pj
from parc_jax.common.errors import InputError

HELPERS = Path(__file__).parents[1] / "helpers"
DOMAIN, TIME = pj.box([0.5, -0.5], [1.0, 0.5]), pj.learning.time_grid(0.25, 1.0, 0.05)
KEY = jax.random.PRNGKey(0)
ABOUT = {"parameters": ("vx", "vy"), "outputs": ("x", "y"), "domain": DOMAIN, "time": TIME}


@pytest.fixture(scope="module")
def glider(tmp_path_factory):
    need("fmpy", "pythonfmu")
    from pythonfmu import FmuBuilder

    folder = tmp_path_factory.mktemp("fmu")
    return FmuBuilder.build_FMU(HELPERS / "glider_fmu.py", dest=folder)


def system(path, **more):
    given = ABOUT | {"q": ("heading",), "seed": "seed", "workers": 0} | more
    return pj.learning.fmu_system(path, **given)


def runs(path, n=30, **more):
    made = system(path, **more)
    try:
        return pj.learning.collect(made, KEY, n, quiet=True)
    finally:
        made.close()


def same(one, other) -> bool:
    pairs = ((one.k, other.k), (one.p, other.p), (one.q, other.q))
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


@pytest.mark.night
def test_runs_are_the_models_own(glider):
    found = runs(glider, start={"gust": 0.0})
    s = np.linspace(0.0, 1.0, 21)[:, None]
    stalled = found.k[:, 0] >= 0.95
    assert (found.failed == stalled).all() and 0 < stalled.sum() < 30  # they end early
    flown = found.select(~stalled)
    assert np.allclose(flown.p, s * flown.k[:, None], atol=1e-12)
    assert np.allclose(flown.q, flown.k[:, 1:], atol=1e-12)
    assert found.name == "Glider" and "gust = 0.0" in found.law.describe()
    assert "fmu = " in found.law.describe()


@pytest.mark.night
def test_the_row_decides_the_seed_and_the_seed_the_gust(glider):
    first, again = runs(glider), runs(glider)
    assert same(first, again) and not np.array_equal(first.p, runs(glider, start={"gust": 0.1}).p)
    flown = first.select(~first.failed)
    gusts = flown.p[:, -1] - flown.k
    assert len(np.unique(gusts)) == gusts.size and 0.01 < gusts.std() < 0.03
    assert random.Random(0).gauss(0, 1) != 0  # what the model draws with
    without = runs(glider, seed=None)
    ends = without.select(~without.failed)
    gusts = ends.p[:, -1] - ends.k
    assert np.ptp(gusts, axis=0).max() < 1e-12  # all with the seed that it was exported with


@pytest.mark.night
def test_processes_make_the_same_runs(glider):
    make = partial(ProcessPoolExecutor, 2, mp_context=get_context("spawn"))
    assert same(runs(glider, workers=None, executor=make), runs(glider))


@pytest.mark.night
def test_several_points_and_smaller_steps(glider):
    outputs = ("x", "y", "heading", "y")
    found = runs(glider, outputs=outputs, points=("here", "there"), step=0.01)
    assert found.points == ("here", "there") and found.p.shape == (30, 21, 4)
    moved = runs(glider, step=0.01)
    assert np.array_equal(found.p[..., :2], moved.p, equal_nan=True)
    flown = ~found.failed
    assert np.allclose(found.p[flown, -1, 2], found.k[flown, 1] - 3.0)  # relative to x at the start


@pytest.mark.night
def test_another_file_at_the_same_place_is_refused(glider, tmp_path):
    copy = shutil.copy(glider, tmp_path)
    made = system(copy)
    Path(copy).write_bytes(Path(copy).read_bytes() + b"\0")
    with pytest.raises(InputError, match="expected the FMU with sha256"):
        pj.learning.collect(made, KEY, 4, quiet=True)


@pytest.mark.night
def test_an_fmu_of_fmi_3(tmp_path):
    need("fmpy", "pythonfmu3")
    from pythonfmu3 import FmuBuilder

    path = FmuBuilder.build_FMU(HELPERS / "glider_fmu3.py", dest=tmp_path)
    found = runs(path, n=8, q=(), seed=None)
    s = np.linspace(0.0, 1.0, 21)[:, None]
    assert np.allclose(found.p, s * found.k[:, None], atol=1e-12)


BAD = {
    "parameters": (
        {"parameters": ("vx", "speed")},
        r"expected parameters among its scalar variables of type Real .*: vx, vy, gust; got 'spe",
    ),
    "an output": ({"parameters": ("vx", "x")}, r"expected parameters among .*; got 'x'"),
    "outputs": ({"outputs": ("x", "z")}, r"expected outputs among .*x, y, heading; got 'z'"),
    "whole": ({"outputs": ("x", "steps")}, r"expected outputs among .*; got 'steps'"),
    "q": ({"q": ("yaw",)}, r"expected q among .*; got 'yaw'"),
    "seed": ({"seed": "gust"}, r"expected seed among .* of type Integer .*: seed; got 'gust'"),
    "start": ({"start": {"mass": 3}}, r"expected start among .* of any type: .*; got 'mass'"),
    "twice": ({"start": {"vx": 0.6}}, "nothing set twice; got 2 parameters and 2 outputs"),
    "axes": ({"parameters": ("vx",)}, "expected a parameter for each of 2 axes .*got 1 param"),
    "points": ({"points": ("a", "b", "c")}, "outputs for 3 reference points"),
    "text": ({"outputs": "xy"}, "expected outputs as a list of names; got 'xy'"),
    "step": ({"step": 0.03}, r"expected a step that is a whole part of dt_record = 0\.05 s"),
    "no step": ({"step": 0.0}, "expected a step that is a whole part"),
}


@pytest.mark.night
@pytest.mark.parametrize("what", BAD)
def test_what_the_model_does_not_have_is_refused(glider, what):
    more, words = BAD[what]
    with pytest.raises(InputError, match=words):
        system(glider, **more)


def repacked(source, target, change):
    """A copy of an FMU, each (name, bytes) of it changed, or left out where that gives None."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = change(name, old.read(name))
            if content is not None:
                new.writestr(name, content)
    return target


@pytest.mark.night
def test_what_cannot_be_run_here_is_refused(glider, tmp_path):
    windows = repacked(glider, tmp_path / "w.fmu", lambda n, c: None if n.endswith(".so") else c)
    with pytest.raises(
        InputError, match=r"expected an FMU with a binary for linux64; it has win64"
    ):
        system(windows)
    kind = (b"CoSimulation", b"ModelExchange")
    exchange = repacked(glider, tmp_path / "m.fmu", lambda n, c: c.replace(*kind))
    with pytest.raises(InputError, match=r"for co-simulation; it is of FMI 2\.0, no co-simulation"):
        system(exchange)
    (tmp_path / "half.fmu").write_bytes(Path(glider).read_bytes()[:3000])
    empty = repacked(glider, tmp_path / "e.fmu", lambda n, c: None)
    for bad in (tmp_path / "half.fmu", empty):
        with pytest.raises(InputError, match="expected an FMU, a zip file with a modelDescription"):
            system(bad)
    with pytest.raises(InputError, match="no such file"):
        system(tmp_path / "none.fmu")


def test_without_the_package_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "fmpy", None)
    with pytest.raises(InputError, match=r"expected the package fmpy.*pip install 'parc_jax\[fmu"):
        system("glider.fmu")


@pytest.mark.night
def test_the_example_leads_to_a_proved_plan(glider):
    example = Path(__file__).parents[2] / "docs" / "examples" / "06_fmu_model.py"
    done = subprocess.run([sys.executable, example, glider], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "(E) With confidence" in done.stdout and "a safe plan (p0, k): " in done.stdout
