"""Files of map_server, read as the format says: free is what is free by every reading of it."""

import struct
import zlib

import numpy as np
import pytest
from needs import need

from parc_jax.common.errors import InputError
from parc_jax.problem.world.grid_map import load_map

need("shapely")
from PIL import Image  # noqa: E402

YAML = """image: {image}
resolution: 0.05
origin: [-1.0, 2.0, 0.0]
negate: {negate}
occupied_thresh: 0.65
free_thresh: 0.196
"""
GREYS = np.array([[254, 205, 206, 0], [255, 100, 101, 250]], np.uint8)  # the upper row first


def chunk(kind, data):
    whole = kind + data
    return struct.pack(">I", len(data)) + whole + struct.pack(">I", zlib.crc32(whole))


def png(bits, colour, row, clear=b""):
    """A PNG of one row of four pixels, as no writer of Pillow's makes it. colour: 0 grey, 2 RGB,
    4 grey with alpha; clear: the colour that is transparent.
    """
    head = struct.pack(">IIBBBBB", 4, 1, bits, colour, 0, 0, 0)
    parts = chunk(b"IHDR", head), chunk(b"tRNS", clear) if clear else b""
    data = chunk(b"IDAT", zlib.compress(b"\0" + row))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts) + data + chunk(b"IEND", b"")


def tiff(bits, white, row):
    """A TIFF of one row of four grey pixels. white: 0 where 0 is white, 1 where it is black."""
    tags = {256: 4, 257: 1, 258: bits, 259: 1, 262: white, 273: 122, 277: 1, 278: 1, 279: len(row)}
    listed = b"".join(struct.pack("<HHII", tag, 3, 1, value) for tag, value in tags.items())
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + listed + bytes(4) + row


def written(folder, pixels, negate=0, image="map.pgm", more="", mode=None):
    Image.fromarray(pixels, mode).save(folder / image)
    (folder / "map.yaml").write_text(YAML.format(image=image, negate=negate) + more)
    return load_map(folder / "map.yaml")


def test_the_lowest_row_comes_first_and_205_is_unknown(tmp_path):
    grid = written(tmp_path, GREYS)
    assert grid.free.tolist() == [[True, False, False, True], [True, False, True, False]]
    assert (grid.resolution, grid.origin) == (0.05, (-1.0, 2.0, 0.0))
    said = grid.free_space().obstacles()[0].rests_on
    assert said.endswith("free cells of a map are occupied with less than {0.196}.")
    # a corner of the map's image lies where the format says: its lower left one at the origin
    assert grid.free_space().region.bounds == pytest.approx((-1.0, 2.0, -0.8, 2.1))


def test_205_is_unknown_whatever_the_threshold(tmp_path):
    """map_saver writes 205 where nobody was, and beside it a free_thresh below which it is."""
    written(tmp_path, GREYS)
    told = (tmp_path / "map.yaml").read_text().replace("free_thresh: 0.196", "free_thresh: 0.25")
    (tmp_path / "map.yaml").write_text(told)
    grid = load_map(tmp_path / "map.yaml")
    assert grid.free.tolist() == [[True, False, False, True], [True, False, True, False]]


def test_negate_turns_black_and_white(tmp_path):
    grid = written(tmp_path, GREYS, negate=1)
    assert grid.free.tolist() == [[False] * 4, [False, False, False, True]]


def test_scale_is_free_below_the_threshold_and_raw_is_in_percent(tmp_path):
    assert written(tmp_path, GREYS, more="mode: scale\n").free.sum() == 4
    raw = np.array([[0, 19, 20, 100, 101, 255]], np.uint8)
    grid = written(tmp_path, raw, more="mode: raw\n")
    assert grid.free.tolist() == [[True, True, False, False, False, False]]


def test_what_white_is_has_to_be_known(tmp_path):
    """Of 16 bits it is, of 32 any grey could be."""
    deep = (GREYS.astype(np.uint16) << 8) + GREYS
    assert written(tmp_path, deep, image="map.png").free.sum() == 4
    with pytest.raises(InputError, match="shades are known: save it as an 8-bit grey PNG or PGM"):
        written(tmp_path, GREYS.astype(np.int32) << 20, image="map.tiff")


DEEP = np.repeat([0xFFFF, 206 * 256, 206 * 256, 0], 3).astype(">u2").tobytes()  # of each channel
UNSURE = {
    "tiff of 16 bits, 0 is white": (tiff(16, 0, b"\xff\xff" * 4), 0),
    "tiff of 12 bits": (tiff(12, 1, b"\xff" * 6), 1),
    "2 bits with a transparent white": (png(2, 0, b"\xff", b"\0\3"), 0),
    "4 bits with a transparent white": (png(4, 0, b"\xff\xff", b"\0\x0f"), 0),
    "1 bit with a transparent white": (png(1, 0, b"\xf0", b"\0\1"), 0),
    "16 bits of colour": (png(16, 2, DEEP), 0),
    "ppm of 16 bits": (b"P6 4 1 65535\n" + DEEP, 0),
    "16 bits with alpha": (png(16, 4, b"\xff\xff\xff\0" * 4), 0),
    "pgm of 100 greys": (b"P5 4 1 100\n" + bytes([100, 81, 80, 0]), 0),
    "text of 1000 greys": (b"P2 4 1 1000\n1000 804 803 0\n", 0),
}


@pytest.mark.parametrize("kind", UNSURE)
def test_what_pillow_rounds_or_turns_is_refused(tmp_path, kind):
    """A cell came out free that map_server calls occupied or unknown."""
    data, negate = UNSURE[kind]
    (tmp_path / "map.any").write_bytes(data)
    (tmp_path / "map.yaml").write_text(YAML.format(image="map.any", negate=negate))
    with pytest.raises(InputError, match="save it as an 8-bit grey PNG or PGM; got"):
        load_map(tmp_path / "map.yaml")


def test_what_map_saver_and_painters_write_is_read_to_the_shade(tmp_path):
    """Also grey of 2 and 4 bits, in which a PNG with few greys is stored, palettes and text."""
    rows = {
        png(2, 0, bytes([0b11100100])): [True, False, False, False],
        png(4, 0, bytes([0xFC, 0xDE])): [True, False, True, True],  # 0xdd: 0.133 occupied
        b"P5 4 1 65535\n" + b"\xff\xff\xcf\0\xcd\xff\0\0": [True, True, False, False],
        b"P5\n# CREATOR: map_saver 0.05 m/pix\n4 1\n255\n\xfe\xcd\0\xfe": [
            True,
            False,
            False,
            True,
        ],
        b"P2 4 1 255\n254 205 0 254\n": [True, False, False, True],
        b"P1 4 1\n0 1 1 0\n": [True, False, False, True],
    }
    (tmp_path / "map.yaml").write_text(YAML.format(image="map.any", negate=0))
    for data, free in rows.items():
        (tmp_path / "map.any").write_bytes(data)
        assert load_map(tmp_path / "map.yaml").free.tolist() == [free]
    few = Image.fromarray(GREYS).quantize(8)
    few.save(tmp_path / "map.any", "PNG")
    assert load_map(tmp_path / "map.yaml").free.sum() == 4


def test_the_mode_may_be_in_capitals_as_nav2_reads_it(tmp_path):
    assert written(tmp_path, GREYS, more="mode: Scale\n").free.sum() == 4


def test_a_transparent_colour_is_unknown(tmp_path):
    written(tmp_path, GREYS, image="map.png")
    for pixels, clear in ((GREYS, 254), (np.stack([GREYS] * 3, axis=-1), (254,) * 3)):
        Image.fromarray(pixels).save(tmp_path / "map.png", transparency=clear)
        assert load_map(tmp_path / "map.yaml").free.sum() == 3
    Image.fromarray(GREYS.astype(np.uint16) << 8).save(tmp_path / "map.png", transparency=0)
    with pytest.raises(InputError, match="'I;16B' with a transparent colour"):
        load_map(tmp_path / "map.yaml")


@pytest.mark.parametrize("more", ["", "mode: raw\n"])
def test_a_mask_of_0_and_1_is_refused(tmp_path, more):
    """Its walls would be free: shades of 1 of 255, or 1 %."""
    mask = np.zeros((3, 4), np.uint8)
    mask[1], mask[2] = 1, 255 if more else 205  # the last row is unknown
    for negate in (0,) if more else (0, 1):
        with pytest.raises(InputError, match=r"map\.yaml: expected percent, or shades up to white"):
            written(tmp_path, mask, negate=negate, more=more)


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_what_is_transparent_is_unknown(tmp_path, mode):
    pixels = np.full((1, 3, 4), 255, np.uint8)
    pixels[0, 1, 3] = 254
    pixels[0, 2, :3] = 150
    grid = written(tmp_path, pixels, image="map.png", more=f"mode: {mode}\n")
    assert grid.free.tolist() == [[True, False, False]]


def test_an_alpha_channel_that_is_averaged_frees_nothing(tmp_path):
    """205 with alpha would be free on average; black with alpha, negated, is 0.25 on average."""
    pixels = np.full((1, 2, 4), 255, np.uint8)
    pixels[0, :, :3] = 205
    assert not written(tmp_path, pixels, image="map.png").free.any()
    pixels[0, :, :3] = 0
    assert not written(tmp_path, pixels, image="map.png", negate=1).free.any()


def test_colours_bits_and_depths_are_read(tmp_path):
    colour = np.repeat(GREYS[..., None], 3, axis=2)
    assert written(tmp_path, colour, image="map.png").free.sum() == 4
    deep = GREYS.astype(np.uint16) * 257
    assert written(tmp_path, deep, image="map.png").free.sum() == 4
    bits = Image.fromarray(GREYS > 230)
    assert bits.mode == "1"
    bits.save(tmp_path / "map.png")
    assert load_map(tmp_path / "map.yaml").free.sum() == 3


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("resolution: 0.05", ""), "expected an entry 'resolution'"),
        (("resolution: 0.05", "resolution: -1"), "resolution > 0"),
        (("resolution: 0.05", "resolution: .nan"), "finite"),
        (("[-1.0, 2.0, 0.0]", "[0, 0]"), "origin"),
        (("map.pgm", "gone.pgm"), "gone.pgm: no such file"),
        (("map.pgm", "cut.pgm"), "expected an image"),
        (("map.pgm", "map.yaml"), "expected an image"),
        (("negate: 0", "negate: 2"), "negate 0 or 1"),
        (("negate: 0", "negate: 1\nmode: raw"), "raw with negate 0"),
        (("negate: 0", "negate: 0\nmode: best"), "expected mode trinary, scale, raw"),
        (("free_thresh: 0.196", "free_thresh: 0.9"), "0 <= free_thresh <= occupied_thresh"),
        (("free_thresh: 0.196", "free_thresh: .nan"), "0 <= free_thresh"),
        (("free_thresh: 0.196", "free_thresh: ["), "expected a YAML file"),
        # of which yaml-cpp takes the first
        (("negate: 0", "negate: 0\nfree_thresh: 0.1"), "an entry that is there twice"),
        (("resolution: 0.05", "resolution: 2001-99-99"), "expected a YAML file"),
        (("map.pgm", "huge.pgm"), "huge.pgm: expected an image .* got DecompressionBomb"),
    ],
    ids=lambda value: value[1].strip() if isinstance(value, tuple) else "",
)
def test_what_is_no_map_is_refused_in_one_sentence(tmp_path, change, sentence):
    written(tmp_path, GREYS)
    (tmp_path / "cut.pgm").write_bytes((tmp_path / "map.pgm").read_bytes()[:-3])
    (tmp_path / "huge.pgm").write_bytes(b"P5\n20000 20000\n255\n")
    text = (tmp_path / "map.yaml").read_text()
    assert change[0] in text
    (tmp_path / "map.yaml").write_text(text.replace(*change))
    with pytest.raises(InputError, match=sentence):
        load_map(tmp_path / "map.yaml")
