"""What a rendered film says: a caption, a clock, a legend."""

from collections.abc import Iterable, Sequence

import numpy as np

SIZE = 0.032  # height of the letters, in heights of the picture
INK, PAPER = (255, 255, 255), (0, 0, 0, 110)  # PAPER is see-through


def explained(
    images: Iterable[np.ndarray],
    seconds: Iterable[float],
    caption: str,
    legend: Sequence[tuple[str, Sequence[float]]],
) -> list[np.ndarray]:
    """The images (height, width, 3) uint8 of a film with words on them: above the caption and the
    time of each [s], below the legend.

    legend: what is to be seen, with its colour (red, green, blue, ...) from 0 to 1.
    """
    return [
        _explained(image, f"{t:.2f} s", caption, legend)
        for image, t in zip(images, seconds, strict=True)
    ]


def _explained(image: np.ndarray, clock: str, caption: str, legend) -> np.ndarray:
    from matplotlib.font_manager import findfont
    from PIL import Image, ImageDraw, ImageFont

    height, width = image.shape[:2]
    size = SIZE * height
    font = ImageFont.truetype(findfont("DejaVu Sans"), size)
    picture = Image.fromarray(image)
    pen = ImageDraw.Draw(picture, "RGBA")
    bar = 1.8 * size
    pen.rectangle((0, 0, width, bar), fill=PAPER)
    pen.rectangle((0, height - bar, width, height), fill=PAPER)
    pen.text((size, bar / 2), caption, fill=INK, font=font, anchor="lm")
    pen.text((width - size, bar / 2), clock, fill=INK, font=font, anchor="rm")
    x, y = size, height - bar / 2
    for words, colour in legend:
        patch = tuple(round(255 * part) for part in colour[:3])
        pen.rectangle((x, y - 0.4 * size, x + size, y + 0.4 * size), fill=patch)
        pen.text((x + 1.5 * size, y), words, fill=INK, font=font, anchor="lm")
        x += 3.5 * size + pen.textlength(words, font)
    return np.asarray(picture)
