"""Tubes of which nothing is shown: they say so, and promise nothing."""

import numpy as np
import pytest
from synthetic_plants import straight_network

import parc_jax as pj
from parc_jax.learning.bound.counts import NoStatement

WHY = "the data sheet gives 2 cm over the whole workspace"
NET, TIME = straight_network(4), pj.learning.time_grid(0.25, 1.0)
TUBE = pj.learning.tube([[0, 0.5, 1], [0, 1]], np.full((2, 4, 2), 0.02), np.full((2, 3), 0.02))


def test_a_bound_from_elsewhere_gives_its_reason_and_no_probability():
    claim = pj.learning.declared_claim(TUBE, WHY + ".", NET, TIME)
    assert claim.kind == "declared" and claim.tube is TUBE
    assert claim.details() == (
        f"DECLARED, not shown here: that no run leaves the tube, because {WHY}. "
        "Assumes: THE TUBE HOLDS."
    )
    assert repr(claim).startswith(f"ErrorClaim(declared, {WHY}, Tube(2 bins of K")
    for law in ({"share": 0.5}, {"density": 1.0}, {}):
        assert isinstance(claim.risk(**law), NoStatement)


def test_a_declared_tube_makes_a_model_for_its_network_only(tmp_path):
    claim = pj.learning.declared_claim(TUBE, WHY, NET, TIME, system="arm", labels={"k": ("a", "b")})
    model = pj.learning.trajectory_model(NET, claim)
    assert model.system == "arm" and model.labels.k == ("a", "b") and model.time == TIME
    again = pj.load(model.save(tmp_path / "m.npz"))
    assert again.claim.details() == claim.details()
    other = pj.learning.relu_network([w + 1 for w in NET.weights], NET.biases)
    with pytest.raises(pj.InputError, match="network its claim was measured on"):
        pj.learning.trajectory_model(other, claim)


@pytest.mark.parametrize(("tube", "why"), [(None, WHY), (TUBE, "  "), (TUBE, None)])
def test_a_tube_and_a_reason_are_asked_for(tube, why):
    with pytest.raises(pj.InputError, match="expected a Tube"):
        pj.learning.declared_claim(tube, why, NET, TIME)
