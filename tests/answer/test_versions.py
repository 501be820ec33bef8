"""The same verdicts and corridors on every version of JAX and every processor.

Seen between JAX 0.9 and 0.12: the same samples, bit by bit, and as many corridors of the same
pairs, whose directions, float32 proposals, differ by rounding: what they prove is settled in
float64 and in the certificate.
"""

import json
from fractions import Fraction
from pathlib import Path

import jax
import numpy as np
import pytest

import parc_jax as pj
import sims
from parc_jax.app.cli.systems import scene_of

KNOWN = Path(__file__).parents[1] / "data" / "drift_answer.json"
CLOSE = 1e-6  # of unit directions, float32; [m] and units of k for samples


def asked(folder: Path) -> dict:
    """Samples and corridors of the model that comes along, as numbers."""
    model = sims.model("drift_parking")
    settings = pj.Settings(target=0.9, samples=20, budget_s=600)
    answer = pj.Planner(model).solve(scene_of(model), jax.random.PRNGKey(1), settings)
    certificate = json.loads(answer.save(folder / "answer.json").read_text())
    return {
        "status": answer.status.label,
        "samples": answer.samples.tolist(),
        "corridors": [numbers(one["sep"]) for one in certificate["corridors"]],
    }


def numbers(part):
    """Fractions as floats, in the same nest."""
    if isinstance(part, list):
        return [numbers(one) for one in part]
    return float(Fraction(part)) if isinstance(part, str) else part


def flat(part):
    return [x for one in part for x in flat(one)] if isinstance(part, list) else [part]


@pytest.mark.smoke
@pytest.mark.slow
def test_verdicts_and_corridors_are_those_of_other_versions(tmp_path):
    known, found = json.loads(KNOWN.read_text()), asked(tmp_path)
    assert found["status"] == known["status"]
    np.testing.assert_allclose(found["samples"], known["samples"], rtol=0, atol=CLOSE)
    assert len(found["corridors"]) == len(known["corridors"])
    for one, other in zip(found["corridors"], known["corridors"], strict=True):
        np.testing.assert_allclose(flat(one), flat(other), rtol=0, atol=CLOSE)
