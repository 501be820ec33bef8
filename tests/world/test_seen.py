"""What is called free is free: whatever lidar and pose do inside of what is declared of them."""

import numpy as np
import pytest
from needs import need

from parc_jax.common.errors import InputError

need("shapely")
import shapely  # noqa: E402
from lidar_worlds import Lidar, a_world  # noqa: E402

from parc_jax.problem.world import seen  # noqa: E402
from parc_jax.problem.world.seen import seen_from  # noqa: E402

pytestmark = pytest.mark.soundness
WIDTH = 0.3
FAN = np.linspace(-2.3, 2.3, 120)
TURN = np.linspace(-np.pi, np.pi, 150, endpoint=False)
LIDARS = {
    "fan": Lidar(FAN),
    "turn": Lidar(TURN),
    "seam": Lidar(np.linspace(-np.pi, np.pi, 151)),  # its first beam is its last
    "uneven": Lidar(np.delete(np.linspace(-2.3, 2.3, 200), [20, 21, 50, 90, 91, 92])),
    "few beams": Lidar(
        np.linspace(-2.3, 2.3, 40), angle_error=0.0, uncertainty=(0.0, 0.0), noise=0.0
    ),
}


def overlaps(lidar, worlds: int, first: int = 0, **declared) -> int:
    """In how many random worlds something stands where all was called free."""
    found = 0
    for number in range(first, first + worlds):
        rng = np.random.default_rng(number)
        world = a_world(rng, WIDTH)
        truth = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(-3, 3)])
        pose, ranges = lidar.scan(rng, world, truth)
        said = {"width": WIDTH, **lidar.declared, **declared}
        region = seen_from(pose, lidar.angles, ranges, **said).region
        assert region.area > 1
        found += bool(shapely.intersects(region, world).any())
    return found


@pytest.mark.parametrize("name", LIDARS)
def test_nothing_stands_where_all_was_seen_free(name):
    assert overlaps(LIDARS[name], 40) == 0


@pytest.mark.parametrize("name", LIDARS)
def test_beams_that_end_short_of_all_that_stands_prove_nothing_free_that_is_not(name, monkeypatch):
    draw, scan = np.random.default_rng(1), Lidar.scan

    def short(lidar, *asked):
        pose, ranges = scan(lidar, *asked)
        bad = draw.uniform(size=len(ranges)) < 0.05
        return pose, np.where(bad, draw.uniform(0.0, 1.0, len(ranges)) * ranges, ranges)

    monkeypatch.setattr(Lidar, "scan", short)
    assert overlaps(LIDARS[name], 30) == 0


def test_a_beam_that_ends_alone_costs_nothing_and_two_side_by_side_do():
    said = {"max_range": 2.5, "noise": 0.01, "width": WIDTH}
    free = np.full(120, 2.5)
    whole = seen_from((0.0, 0.0, 0.0), FAN, free, **said).region.area
    for beams, least, most in ((slice(60, 61), 0.995, 1.0), (slice(60, 62), 0.9, 0.985)):
        ranges = free.copy()
        ranges[beams] = 1.0
        area = seen_from((0.0, 0.0, 0.0), FAN, ranges, **said).region.area
        assert least * whole < area <= most * whole


EXACT = {"noise": 0.0, "angle_error": 0.0, "uncertainty": (0.0, 0.0)}


@pytest.mark.parametrize(
    ("truly", "said"),
    [
        ({"noise": 0.1}, {"noise": 0.0}),
        ({"angle_error": 0.05}, {"angle_error": 0.0}),
        ({"uncertainty": (0.1, 0.0)}, {"uncertainty": (0.0, 0.0)}),
        ({"uncertainty": (0.0, 0.05)}, {"uncertainty": (0.0, 0.0)}),
        ({"angles": np.linspace(-2.3, 2.3, 30)}, {"width": 4 * WIDTH}),
    ],
    ids=str,
)
def test_each_of_the_bounds_is_needed(truly, said):
    """The oracle sees what is understated, so it would see what is forgotten."""
    lidar = Lidar(**{"angles": np.linspace(-2.3, 2.3, 400)} | EXACT | truly)
    assert overlaps(lidar, 10) == 0
    assert overlaps(lidar, 10, **said) > 0


@pytest.mark.night
@pytest.mark.parametrize("name", LIDARS)
def test_nothing_stands_there_in_many_worlds(name):
    assert overlaps(LIDARS[name], 400, first=1000) == 0


def test_corners_reach_out_between_beams(monkeypatch):
    """The nearer of two ranges alone is not enough."""
    few = LIDARS["few beams"]

    def nearer_range_alone(angles, sure, told, *rest):
        near = np.minimum(sure[:-1], sure[1:])
        return np.minimum(np.append(near, near[-1]), np.append(near[0], near))

    monkeypatch.setattr(seen, "_between", nearer_range_alone)
    assert overlaps(few, 40) > 0


def test_between_beams_that_spread_more_room_may_hide_a_disc():
    """Four beams, the inner two each 0.05 rad farther out than they say, and a disc between."""
    disc = shapely.Point(1.02, 0.0).buffer(0.15)
    beams = [shapely.LineString([(0, 0), (4 * np.cos(a), 4 * np.sin(a))]) for a in (-0.15, 0.15)]
    assert not shapely.intersects(beams, disc).any()
    scan = {"pose": (0, 0, 0), "angles": [-0.3, -0.1, 0.1, 0.3], "ranges": np.full(4, 4.0)}
    scan |= {"max_range": 4.0, "noise": 0.0, "width": 0.3}
    assert seen_from(**scan).region.intersects(disc)
    assert not seen_from(**scan, angle_error=0.05).region.intersects(disc)


def test_a_seam_is_as_unsure_as_any_other_direction():
    """A full turn, told with or without its first beam again at the end, is the same."""
    said = {"max_range": 5.0, "noise": 0.01, "width": 1.0, "angle_error": 0.05}
    ranges = np.where(np.arange(150) < 3, 1.0, 4.0)
    open_end = seen_from((0, 0, 0), TURN, ranges, **said).region
    whole = np.linspace(-np.pi, np.pi, 151)
    for last in (1.0, 4.0):  # the nearer of the two readings holds
        region = seen_from((0, 0, 0), whole, np.append(ranges, last), **said).region
        assert region.symmetric_difference(open_end).area < 1e-6


def test_a_beam_that_says_nothing_shows_nothing():
    ranges = np.full(120, 3.0)
    ranges[60] = 0.0
    said = {"max_range": 5.0, "noise": 0.01, "width": 0.3}
    region = seen_from((0.0, 0.0, 0.0), FAN, ranges, **said).region
    ahead = shapely.LineString([[0.1, 0], [3, 0]])
    assert not region.intersects(ahead) and region.geom_type == "MultiPolygon"
    nothing = seen_from((0.0, 0.0, 0.0), FAN, np.zeros(120), **said)
    assert nothing.region.is_empty
    with pytest.raises(InputError, match="this one is empty"):
        nothing.obstacles()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"ranges": np.full(7, np.nan)}, "got 7 that are not.*reads max_range"),
        ({"ranges": np.full(7, np.inf)}, "got 7 that are not"),
        ({"ranges": [3000.0, 2990, 600, 450, 610, 2990, 3000]}, "got 5, 450 to 3000. Are they mi"),
        ({"ranges": [5.1, 9, 11, 12, 2, 2, 2]}, "got 4, 5.1 to 12. Are they millimetres"),
        ({"ranges": [1.0, 5, 5.2, 5, 1, 6, 1]}, "max_range, 5 m, for no return; got 2, 5.2 to 6"),
        ({"ranges": [1.0, 5, 5.2, 5, 1, 60, 1]}, r"to 60. If in m: np.minimum\(ranges, max_range"),
        ({"ranges": 5.1 + np.arange(7) / 100}, r"to 5.16. If in m: np.minimum\(ranges, max_range"),
        ({"ranges": np.ones(6)}, r"expected shape \(7,\); got \(6,\)"),
        ({"ranges": -np.ones(7)}, "ranges >= 0 m; got -1"),
        ({"angles": np.linspace(1, -1, 7)}, "increasing angles"),
        ({"angles": np.linspace(-135, 135, 7)}, "Are they degrees"),
        ({"pose": (0, 0)}, r"pose.*expected shape \(3,\)"),
        ({"pose": (0, 0, np.nan)}, "pose"),
        ({"pose": (0, 0, 90.0)}, "heading: expected rad, at most 63; got 90. Is it in"),
        ({"pose": (4e5, 5e6, 0)}, "pose: expected finite coordinates up to 100000 m; got 5e.06"),
        ({"noise": -0.1}, "noise >= 0"),
        ({"noise": None}, "noise, width, angle_error, tolerance: expected finite numbers"),
        ({"width": "a"}, r"noise, width, .*: expected numbers of shape"),
        ({"ranges": ["a", *[1.0] * 6]}, "ranges: expected numbers of shape"),
        ({"width": 0.0}, "width > 0"),
        ({"max_range": np.inf}, "max_range, .*: expected finite numbers"),
        ({"uncertainty": (-1.0, 0.0)}, "uncertainty"),
        ({"uncertainty": 0.1}, "uncertainty"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_what_is_no_scan_is_refused_in_one_sentence(change, sentence):
    scan = {"pose": (0, 0, 0), "angles": np.linspace(-1, 1, 7), "ranges": np.ones(7)}
    scan |= {"max_range": 5.0, "noise": 0.01, "width": 0.1} | change
    with pytest.raises(InputError, match=sentence) as refused:
        seen_from(**scan)
    assert len(str(refused.value)) < 250


def test_one_number_above_max_range_is_no_return():
    """Some drivers have a code for it: all that is seen is as if they told max_range."""
    scan = {"pose": (0, 0, 0), "angles": np.linspace(-1, 1, 7), "max_range": 5.0, "noise": 0.01}
    told = [np.array([1.0, 5, far, 5, far, far, 1]) for far in (5.0, 65.535)]
    one, other = (seen_from(**scan, ranges=ranges, width=0.1) for ranges in told)
    assert one.region.equals(other.region) and one.region.area > 0


def test_noise_of_a_reading_that_met_nothing_frees_no_more_than_max_range():
    """They were refused as millimetres, and with the 0 that was advised little of a scan was left.
    Also beside a code, and beside a beam that ends.
    """
    draw, scan = np.random.default_rng(0), {"pose": (0, 0, 0), "angles": FAN, "width": WIDTH}
    scan |= {"max_range": 10.0, "noise": 0.02}
    clear = np.where((FAN > 0.2) & (FAN < 0.6), 3.0, 10.0)
    noisy = clear + draw.uniform(-0.02, 0.02, len(FAN))
    noisy[60:64] = 65.535
    assert len(np.unique(noisy[noisy > 10])) > 20
    one, other = (seen_from(**scan, ranges=x) for x in (noisy, np.minimum(noisy, 10.0)))
    assert one.region.equals(other.region) and one.region.area > 10
    assert max(np.linalg.norm(one.region.exterior.coords, axis=1)) <= 10.0 - 0.02 + 1e-9
