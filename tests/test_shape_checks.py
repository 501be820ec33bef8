"""Annotated shapes are checked at every call while testing: a wrong one fails where it is
passed.
"""

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

from benchmarks.neuralparc.sets.affine import image, membership
from benchmarks.neuralparc.sets.operations import grow
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.network.maps import pattern_map
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.absence.contact_margins import corners_of
from parc_jax.safe_set.batch.proposals import _sides
from parc_jax.safe_set.corridors.corridor import lost
from parc_jax.safe_set.verdict.pointwise import row_margin

SQUARE = box([0, 0], [1, 1])
AFFINE = relu_network([np.eye(2)], [np.zeros(2)])
WRONG = {
    "corners of two lengths": lambda: Box(np.zeros(2), np.ones(3)),
    "a map of integers": lambda: image(SQUARE, np.eye(2, dtype=int), np.zeros(2)),
    "offsets of other rows": lambda: HPolytope(np.eye(3), np.zeros(2)),
    "a map into another space": lambda: image(SQUARE, np.eye(2), np.zeros(3)),
    "a radius that is a number": lambda: grow(HPolytope(np.eye(2), np.ones(2)), 0.1),
    "many points where one is meant": lambda: membership(SQUARE, np.zeros((3, 2))),
    "a pattern of numbers": lambda: pattern_map(AFFINE, np.zeros(0)),
    "a slack for each row": lambda: row_margin(np.eye(2), np.ones(2), np.ones(2), np.ones(2)),
    "points of fewer obstacles": lambda: lost(
        np.ones((2, 4, 2)), ErrorBox(np.ones((4, 1, 2))), np.zeros((1, 1), int)
    ),
    "corners of unlike boxes": lambda: corners_of(np.zeros((3, 2)), np.ones((1, 2))),
    "sides of other offsets": lambda: _sides(jnp.eye(2), jnp.zeros(3)),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_shape_fails_where_it_is_passed(case):
    with pytest.raises(TypeCheckError):
        WRONG[case]()
