"""Start-up probes: a fault of the arithmetic refuses to certify, and no cache can hide one."""

import json
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_models import toy_case

from parc_jax.common import probes
from parc_jax.common.backend import CPU, options
from parc_jax.common.errors import SoundnessError
from parc_jax.common.probes import probe_all, probe_options, require_sound_arithmetic
from parc_jax.planner import Planner


@pytest.fixture
def store(monkeypatch, tmp_path):
    """A cache of our own, empty at first."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    probes._cached.cache_clear()
    yield probes._store()
    probes._cached.cache_clear()


@pytest.mark.smoke
def test_this_installation_passes_and_remembers(store, monkeypatch):
    require_sound_arithmetic()
    assert store.exists()
    probes._cached.cache_clear()
    monkeypatch.setattr(probes, "probe_all", lambda: pytest.fail("probed again"))
    require_sound_arithmetic()


@pytest.mark.smoke
def test_an_option_that_this_xla_does_not_know_is_left_out_and_told():
    kind = replace(CPU, compiler=(*CPU.compiler, ("xla_of_the_future", "1")))
    assert "xla_of_the_future" not in (options(kind) or {})
    assert (options(kind) or {}).items() <= dict(CPU.compiler).items()
    assert "xla_of_the_future" in probe_options(dict(kind.compiler)).detail


@pytest.mark.night
@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", '["x"]', "[[]]", '[["float64", true, "fine"]]']
)
def test_a_damaged_cache_is_probed_again(store, monkeypatch, text):
    store.parent.mkdir(parents=True, exist_ok=True)
    store.write_text(text)
    asked = []
    monkeypatch.setattr(probes, "probe_all", lambda: asked.append(1) or probe_all())
    require_sound_arithmetic()
    assert asked and len(json.loads(store.read_text())) == len(probe_all())


@pytest.mark.slow
@pytest.mark.parametrize("number", range(5))
def test_any_failed_probe_refuses_the_query(store, monkeypatch, number):
    findings = probe_all()
    assert all(f.ok for f in findings) and len(findings) == 5
    findings[number] = findings[number]._replace(ok=False, detail="2 + 2 came out as 5.")
    monkeypatch.setattr(probes, "probe_all", lambda: findings)
    model, problem = toy_case(4)
    with pytest.raises(
        SoundnessError, match=r"2 \+ 2 came out as 5.*Nothing is certified"
    ) as caught:
        Planner(model).solve(problem, jax.random.key(0))
    assert findings[number].name in str(caught.value)


def rounded(x):
    return x.astype(jnp.float32).astype(x.dtype)


def test_each_probe_sees_its_fault(monkeypatch):
    jit, product = jax.jit, probes.product
    with monkeypatch.context() as m:
        m.setattr(probes, "product", lambda a, b: product(rounded(a), rounded(b)))
        assert not probes.probe_full_precision().ok
    with monkeypatch.context() as m:
        m.setattr(probes.jax, "jit", lambda f: lambda x: jax.tree.map(jnp.nan_to_num, jit(f)(x)))
        assert not probes.probe_nan().ok
    with monkeypatch.context() as m:
        m.setattr(probes.jax, "jit", lambda f: lambda x: rounded(jit(f)(x)))
        assert not probes.probe_float64().ok
    with monkeypatch.context() as m:
        m.setattr(
            probes.jax, "jit", lambda f: lambda x: np.where(np.arange(len(x)) == 7, 0.0, jit(f)(x))
        )
        assert not probes.probe_batched_rows().ok
    with monkeypatch.context() as m:
        m.setattr(probes.jax, "jit", lambda f: lambda x: (False, False))
        assert not probes.probe_subnormal_margin().ok
