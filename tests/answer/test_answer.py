"""What an answer holds and what it refuses, against an answer whose true values are known."""

from dataclasses import replace

import pytest
from toy_whole import answer

from parc_jax.common.errors import InputError


def test_membership_asks_for_goal_and_start_too():
    """Without obstacles every plan keeps to every corridor: only goal and start can refuse it."""
    k = answer().samples[:1, 2:]
    hit, missed = answer().samples[:1, :2], answer().samples[:1, :2] + 5.0
    for of in (None, "corridors", "polytopes"):
        assert answer().contains(hit, k, of=of).all()
        assert not answer().contains(missed, k, of=of).any()
    uncut = replace(answer(), cover=answer().cover._replace(polytopes=[]))
    assert uncut.contains(hit, k).all() and not uncut.contains(hit, k, of="polytopes").any()
    with pytest.raises(InputError, match="contains: expected of="):
        answer().contains(hit, k, of="cells")


def test_the_share_of_k_is_a_lower_bound():
    """All of K is hit, by 20,000 draws: the share is at least the thousandth's 20,000th root."""
    assert answer().share_of_k() == pytest.approx(0.001 ** (1 / 20_000), abs=1e-8)
