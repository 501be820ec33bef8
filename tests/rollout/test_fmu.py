"""The example of an FMU: the model's own numbers, a seed by run, early ends, and a plan."""

import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from needs import need

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "06_fmu_model.py"


@pytest.fixture(scope="module")
def glider(tmp_path_factory):
    need("fmpy", "pythonfmu")
    from pythonfmu import FmuBuilder

    script = Path(__file__).parents[1] / "helpers" / "glider_fmu.py"
    return str(FmuBuilder.build_FMU(script, dest=tmp_path_factory.mktemp("fmu")))


@pytest.mark.night
def test_runs_are_the_models_own_and_early_ends_are_failures(glider):
    glide = runpy.run_path(str(EXAMPLE))["glide"]
    k, s = np.array([0.7, 0.2]), np.linspace(0.0, 1.0, 21)
    (p, q), (again, _) = (glide(glider, np.random.default_rng(seed), k) for seed in (0, 0))
    other, _ = glide(glider, np.random.default_rng(1), k)
    assert np.array_equal(p, again) and not np.array_equal(p, other)
    gust = (p - p[0] - s[:, None] * k)[-1]
    assert 0 < np.abs(gust).max() < 0.1 and q == pytest.approx([0.2])
    assert np.allclose(p - p[0], s[:, None] * k + np.square(s)[:, None] * gust, atol=1e-12)
    with pytest.raises(RuntimeError, match=r"the FMU ended at 0\.[45]"):
        glide(glider, np.random.default_rng(0), np.array([0.97, 0.0]))


@pytest.mark.night
def test_the_example_leads_to_a_proved_plan(glider):
    done = subprocess.run([sys.executable, EXAMPLE, glider], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "(E) With confidence" in done.stdout and "a safe plan (p0, k): " in done.stdout
