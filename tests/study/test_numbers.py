"""Numbers as people read them."""

import numpy as np
from toy_models import line_model
from turning_bar import straight_bar

from parc_jax.app.study.report import spread


def test_half_widths_have_units_and_names():
    assert spread(np.array([0.1, 0.25, 0.5]), line_model()) == "±0.10 m x, ±0.25 m y, ±0.50 q0"


def test_of_several_points_the_widest_is_said():
    widths = np.array([0.1, 0.25, 0.3, 0.2, 0.5])
    said = spread(widths, straight_bar(), ".3g")
    assert said == "±0.3 m x, ±0.25 m y, ±0.5 q0, at the widest of 2 points"
