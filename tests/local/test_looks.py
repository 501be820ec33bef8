"""Looks are declared, counted and paid for; their runs meet nobody else's."""

import copy
from fractions import Fraction

import jax
import numpy as np
import pytest

from parc_jax.answer.looks import Looks, fresh_key, looks_of_json
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, stream


def test_delta_is_split_over_the_declared_looks_and_no_more_are_given():
    looks = Looks().declare(0.01, 4)
    shares = [looks.take().delta for _ in range(4)]
    assert sum(shares) == Fraction(1, 100) and len(set(shares)) == 1
    with pytest.raises(InputError, match=r"all 4 that were declared are spent.*looks=5"):
        looks.take()
    assert looks.taken == 4


@pytest.mark.parametrize("planned", [0, -1, 1.5, True, "two"])
def test_a_number_of_looks_is_a_number(planned):
    with pytest.raises(InputError, match="looks: expected"):
        Looks().declare(0.01, planned)


def test_streams_of_looks_meet_neither_each_other_nor_any_stage():
    key = jax.random.PRNGKey(0)
    looks = Looks().declare(0.01, 2)
    first = looks.take()
    second = looks.take()
    plan, other = np.array([0.5, 0.25, 0.1]), np.array([0.5, 0.25, np.nextafter(0.1, 1)])
    keys = [
        key,
        *(stream(key, stage) for stage in Stage),
        fresh_key(key, first, plan),
        fresh_key(key, second, plan),
        fresh_key(key, first, other),
        fresh_key(key, first, plan, plan),
    ]
    assert len({tuple(np.asarray(k).tolist()) for k in keys}) == len(keys)
    again = fresh_key(key, first, plan)
    assert (again == fresh_key(key, first, plan.copy())).all()  # the same look is the same runs


def test_a_copy_of_an_answer_has_the_account_of_the_answer():
    """Three copies of one answer took three first looks."""
    looks = Looks()
    held = [{"looks": looks}]
    copies = [*(copy.deepcopy(held)[0]["looks"] for _ in range(2)), copy.copy(looks)]
    copies[0].declare(0.01, 2)
    assert [one.take().number for one in copies[:2]] == [1, 2] and looks.taken == 2
    with pytest.raises(InputError, match="all 2 that were declared are spent"):
        copies[2].take()


def test_an_account_is_declared_once_and_goes_on_from_its_file():
    looks = Looks()
    with pytest.raises(InputError, match="expected some to be declared"):
        looks.take()
    assert looks.to_json() is None and looks_of_json(None).delta is None
    assert looks.declare(0.01, 2) is looks and looks.declare(0.01, 2).planned == 2
    with pytest.raises(InputError, match="expected those declared by the first choice"):
        looks.declare(0.01, 3)
    looks.take()
    again = looks_of_json(looks.to_json())
    assert again.take().number == 2
    with pytest.raises(InputError, match="all 2 that were declared are spent"):
        again.take()
    with pytest.raises(InputError, match="looks taken: expected a whole number >= 0; got -1"):
        looks_of_json(looks.to_json() | {"taken": -1})
