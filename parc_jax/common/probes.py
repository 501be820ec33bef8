"""Start-up arithmetic probes: known compiler and chip faults that no rounding analysis survives.

A failed probe refuses to certify. The result is cached per installation, unnoticed by queries.
"""

import contextlib
import hashlib
import json
import os
import sys
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import product, x64
from parc_jax.common.backend import refused
from parc_jax.common.errors import SoundnessError

SIZES = (16_385, 20_000, 32_769)  # batch sizes at which jaxlib 0.10.2 returns wrong rows
REDUCED = (1000, 16)  # numbers of which JAX 0.12 loses NaN in the largest and the least
NAMES = {"float64", "nan", "subnormals", "full precision dots", "batched rows"}


class Finding(NamedTuple):
    """The result of one probe."""

    name: str
    ok: bool
    detail: str


def require_sound_arithmetic() -> None:
    """Raise SoundnessError unless all probes pass. Cheap but for an installation's first call."""
    if failed := [f for f in _cached() if not f.ok]:
        raise SoundnessError(
            f"probe {failed[0].name}: {failed[0].detail} Nothing is certified on this "
            "installation; run `parc-jax doctor` and install the pinned JAX."
        )


def probe_all() -> list[Finding]:
    """Run every quick probe now."""
    quick = (probe_float64, probe_nan, probe_subnormal_margin)
    with x64():
        return [probe() for probe in (*quick, probe_full_precision, probe_batched_rows)]


def probe_float64() -> Finding:
    """Doubles are doubles inside a compiled function."""
    value = jax.jit(lambda x: x + 2.0**-50)(np.float64(1.0))
    ok = value.dtype == jnp.float64 and float(value) == 1.0 + 2.0**-50
    return Finding("float64", ok, f"1 + 2^-50 is {float(value)!r} as {value.dtype}.")


def probe_nan() -> Finding:
    """NaN passes relu and no comparison. The detail says whether it passes the largest and least of
    many numbers, which versions of JAX do differently: no verdict rests on it.
    """
    relu, compared, largest, least = jax.jit(
        lambda x: (jnp.maximum(x, 0), (x > 0) | (x <= 0), jnp.max(x, axis=0), jnp.min(x, axis=0))
    )(np.full(REDUCED, np.nan))
    ok = bool(np.isnan(relu).all() and not np.asarray(compared).any())
    kept = bool(np.isnan(largest).all() and np.isnan(least).all())
    through = "passes" if kept else "is lost in (no verdict rests on it)"
    told = f"NaN {through} the largest of {REDUCED[0]:,} numbers."
    return Finding("nan", ok, told if ok else "NaN was lost in max(x, 0), or passed a comparison.")


def probe_subnormal_margin() -> Finding:
    """A margin as large as the engine's is positive, also where subnormal numbers are flushed."""
    margin, tiny = jax.jit(lambda x: (x * 2.0**-40 > 0, x * 5e-310 > 0))(np.float64(1.0))
    flushed = "kept" if bool(tiny) else "flushed to zero (allowed for in every bound)"
    return Finding("subnormals", bool(margin), f"subnormal numbers are {flushed}.")


def probe_full_precision() -> Finding:
    """Dots at highest precision do not round their inputs to TF32 or bfloat16."""
    out = jax.jit(lambda x: product(x, jnp.eye(64, dtype=x.dtype)))(np.full((64, 64), 1 + 2.0**-40))
    ok = bool((np.asarray(out) == 1.0 + 2.0**-40).all())
    told = "products keep 40 bits." if ok else "products lose low bits."
    return Finding("full precision dots", ok, told)


def probe_batched_rows() -> Finding:
    """jit(vmap(max(M x))) against NumPy at the batch sizes where a compiler fault shows."""
    rng = np.random.default_rng(0)
    M = rng.normal(size=(3, 3))
    kernel = jax.jit(jax.vmap(lambda x: jnp.max(product(M, x))))
    for size in SIZES:
        x = rng.normal(size=(size, 3))
        wrong = int((np.abs(np.asarray(kernel(x)) - (x @ M.T).max(axis=1)) > 1e-12).sum())
        if wrong:
            told = f"{wrong} of {size} rows are wrong (a known fault of jaxlib 0.10.2)."
            return Finding("batched rows", False, told)
    told = f"batches of {', '.join(map(str, SIZES))} agree with NumPy."
    return Finding("batched rows", True, told)


def probe_options(options: dict[str, str | bool]) -> Finding:
    """The compiler knows these options."""
    wrong = [why for name, value in options.items() if (why := refused(name, value))]
    told = "; ".join(wrong) or "the compiler knows all that are used."
    return Finding("options", not wrong, told)


@lru_cache(maxsize=1)
def _cached() -> tuple[Finding, ...]:
    store = _store()
    with contextlib.suppress(OSError, ValueError, TypeError):  # absent or damaged: probe now
        known = tuple(Finding(*entry) for entry in json.loads(store.read_text()))
        if {finding.name for finding in known} == NAMES:
            return known
    findings = tuple(probe_all())
    with contextlib.suppress(OSError):  # a read-only home: probe again next time
        store.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        store.write_text(json.dumps(findings))
    return findings


def _store() -> Path:
    """One file per JAX, device and interpreter."""
    import jaxlib

    device = jax.devices()[0]
    versions = f"{jax.__version__}|{jaxlib.__version__}"
    name = f"{versions}|{device.platform}|{device.device_kind}|{sys.executable}"
    name += "|".join(
        f"{key}={value}"
        for key, value in sorted(os.environ.items())
        if key.startswith(("XLA_", "JAX_"))
    )
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "parc_jax" / f"probes-{hashlib.sha256(name.encode()).hexdigest()[:16]}.json"
