"""Words on a rendered film: above and below, the middle as it was."""

import numpy as np

from sims.film import explained


def test_a_clock_and_a_legend_are_on_every_frame():
    plain = [np.full((240, 480, 3), shade, np.uint8) for shade in (90, 120)]
    legend = [("car", [1.0, 0, 0, 1]), ("goal", [0, 1.0, 0, 1])]
    shown = explained(plain, [0.0, 1.25], "drift: true run", legend)
    for before, after in zip(plain, shown, strict=True):
        assert after.shape == before.shape and after.dtype == np.uint8
        assert (after[30:-30] == before[30:-30]).all()
        for colour in ([255, 0, 0], [0, 255, 0]):
            assert (after[-15:] == colour).all(axis=-1).sum() > 20
    clocks = [image[:14, 400:] - image[0, -1] for image in shown]
    assert (clocks[0] != clocks[1]).any() and (shown[0][:14, :200] == 255).any()
    assert (plain[0] == 90).all()
