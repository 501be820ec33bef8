"""What an answer says of plans drawn from it, against an answer whose true values are known."""

import copy

import numpy as np
import pytest
from scipy.stats import binom
from toy_whole import answer


def covering(at_least):
    """The answer, whose polytopes are only known to cover this share of the safe set."""
    partial = copy.copy(answer())
    coverage = answer().coverage._replace(share=at_least, at_least=at_least)
    partial._cover = answer()._cover._replace(coverage=coverage)
    return partial


def test_the_density_of_a_whole_answer_is_close_to_one():
    """Per unit of k the union offers the same box of end points, so k of `sample` is uniform."""
    assert len(answer().polytopes) == 1 and answer().coverage.at_least > 0.99
    assert 1 <= answer().density <= 1.03


@pytest.mark.parametrize("share", [0.5, 0.1])
def test_the_density_pays_for_what_the_polytopes_do_not_cover(share):
    """Polytopes that hold a share s of this safe set may be a slice of K of that share: then k of
    `sample` is 1 / s times as dense as uniform.
    """
    assert 1 / share <= covering(share).density <= 1.03 / share


def test_without_measured_coverage_no_density_is_stated():
    assert np.isinf(covering(0.0).density)


def test_the_volume_interval_is_clopper_pearson():
    counted = copy.copy(answer())
    counted._cover = answer()._cover._replace(drawn=1000, safe=300)
    estimate, low, high = np.array(counted.volume(0.99)) / answer()._cover.volume
    assert estimate == pytest.approx(0.3)
    assert binom.sf(299, 1000, low) == pytest.approx(0.005, rel=1e-6)  # 300 or more
    assert binom.cdf(300, 1000, high) == pytest.approx(0.005, rel=1e-6)
