"""A claim and its tube in a file of their own, as files of models hold them."""

import json
from pathlib import Path

from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.claim_file import claim_from_json
from parc_jax.learning.bound.tube import tube_from_json, tube_to_json


def save_claim(claim: ErrorClaim, path: Path) -> Path:
    path.write_text(json.dumps({"claim": claim.to_json(), "tube": tube_to_json(claim.tube)}))
    return path


def load_claim(path: Path) -> ErrorClaim:
    data = json.loads(path.read_text())
    return claim_from_json(data["claim"], tube_from_json(data["tube"]))
