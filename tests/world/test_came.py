"""What was free may not stay free: what comes into full view leaves the free space, and all that it
hides, until it is seen free again. A world that stands still loses next to nothing. [T44]
"""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from needs import need

need("shapely")
import shapely  # noqa: E402
from lidar_worlds import Lidar, a_world  # noqa: E402

from parc_jax.common.errors import InputError  # noqa: E402
from parc_jax.problem.world.free_space import FreeSpace, free_place  # noqa: E402
from parc_jax.problem.world.seen import seen_from  # noqa: E402

pytestmark = pytest.mark.soundness
WIDTH = 0.15
BODY = np.array([[0.21, 0.165], [-0.21, 0.165], [-0.21, -0.165], [0.21, -0.165]])
AHEAD = Lidar(np.linspace(-2.3, 2.3, 240), uncertainty=(0.01, 0.003), noise=0.01, angle_error=0.001)
AROUND = replace(AHEAD, angles=np.linspace(-np.pi, np.pi, 241)[:-1], uncertainty=(0.04, 0.02))


def seen(lidar, rng, world, truth):
    pose, ranges = lidar.scan(rng, world, truth)
    return seen_from(pose, lidar.angles, ranges, width=WIDTH, **lidar.declared)


def driven(lidar, seed: int, scans: int = 8):
    """World, what is known of it after some scans, all of them together, the last place."""
    rng = np.random.default_rng(seed)
    world, free, together = a_world(rng, WIDTH, 40), free_place(BODY, 0.15), []
    for i in range(scans):
        truth = np.array([0.05 * i - 0.2, 0.2 * np.sin(i), 0.7 * i])
        one = seen(lidar, rng, world, truth)
        free = free.add(one)
        together.append(one.region)
        assert free.refuting == 0 and free.said == "" and free.gone.is_empty
    return rng, world, free, shapely.union_all(together), truth


@pytest.mark.parametrize("lidar", [AHEAD, AROUND], ids=["ahead", "around"])
def test_a_world_that_stands_still_refutes_nothing_and_stays_free(lidar):
    for seed in range(3):
        _, world, free, together, _ = driven(lidar, seed)
        assert not shapely.intersects(free.region, world).any()
        assert together.difference(free.region).area < 0.01 * together.area


@pytest.mark.parametrize("lidar", [AHEAD, AROUND], ids=["ahead", "around"])
def test_who_comes_into_full_view_leaves_the_free_space_with_all_behind(lidar):
    found = 0
    for seed in range(4):
        rng, world, free, _, truth = driven(lidar, seed)
        for _ in range(8):
            turn, far, size = rng.uniform((0, 0.9, 0.08), (2 * np.pi, 2.5, 0.3))
            there = truth[:2] + far * np.array([np.cos(turn), np.sin(turn)])
            person = shapely.Point(there).buffer(size)
            view = person.union(shapely.Point(truth[:2])).convex_hull.buffer(0.03)
            if not free.region.contains(person) or shapely.intersects(view, world).any():
                continue
            looking = np.array([*truth[:2], turn])
            now = free.add(seen(lidar, rng, [*world, person], looking))
            assert not now.region.intersects(person)
            assert now.refuting and "ended within what was known to be free" in now.said
            behind = shapely.Point(there + (size + 0.05) * np.array([np.cos(turn), np.sin(turn)]))
            assert free.region.contains(behind) <= now.gone.contains(behind)
            # nobody is there any more: all that is seen once more is free again
            again = seen(lidar, rng, world, looking)
            later = now.add(again)
            assert later.refuting == 0 and later.gone.area < 0.8 * now.gone.area
            assert again.region.difference(later.region).area < 0.01 * again.region.area
            found += 1
    assert found >= 10


def yard(ranges=None, angles=None):
    """A scan of an empty yard from its middle, or with other ranges."""
    angles = np.linspace(-1.5, 1.5, 301) if angles is None else angles
    ranges = np.full(len(angles), 4.0) if ranges is None else ranges
    return seen_from((0, 0, 0), angles, ranges, max_range=4.0, noise=0.01, width=WIDTH)


def test_two_false_returns_side_by_side_cost_a_shadow_until_the_next_scan_and_one_nothing():
    free, false = yard(), np.full(301, 4.0)
    false[150] = 2.0
    one = free.add(yard(false))
    assert one.refuting == 0 and free.region.difference(one.region).area < 1e-3 * free.region.area
    false[151] = 2.0
    less = free.add(yard(false))
    lost = free.region.difference(less.region)
    assert less.refuting == 2 and 0 < lost.area < 0.03 * free.region.area
    assert less.region.contains(shapely.Point(1.9, 0.0)) and lost.contains(shapely.Point(3.0, 0.0))
    again = less.add(yard())
    assert again.refuting == 0 and free.region.difference(again.region).area < 1e-3


def test_a_beam_at_the_seam_of_a_full_turn_is_counted_once():
    around = np.linspace(0, 2 * np.pi, 361)[:-1]
    now = yard(angles=around).add(yard(np.full(360, 3.0), around))
    assert now.refuting == 360 and now.said.startswith("360 beams ended within")


def test_what_left_stays_gone_whatever_older_is_added_or_is_filled():
    free, one = yard(), np.full(301, 4.0)
    one[140:161] = 2.0
    less = free.add(yard(one))
    assert less.add(FreeSpace(free.region, WIDTH)).region.area == pytest.approx(less.region.area)
    assert less.within((0, 0), 3.0).gone.area == pytest.approx(
        less.gone.intersection(shapely.box(-3, -3, 3, 3)).area
    )
    cut = less.within((0, 0), 3.0)
    drifted = cut.drifted((0, 0, 0), (0.05, 0.02), 0.01)
    assert drifted.gone.contains(cut.gone.buffer(0.05))
    stands = free_place([[2.1, -0.1], [2.1, 0.1], [2.4, 0.0]])  # where a body is, nothing else is
    assert less.add(stands).region.contains(stands.region)


@pytest.mark.parametrize("order", [1, -1])
def test_whichever_is_added_to_the_other_the_scan_rules(order):
    one = np.full(301, 4.0)
    one[140:161] = 2.0
    memory, scan = FreeSpace(yard().region, WIDTH), yard(one)
    first, second = (memory, scan)[::order]
    both = first.add(scan if second is scan else memory)
    assert not both.region.intersects(shapely.box(2.05, -0.15, 3.5, 0.15))
    kept = first.within((0, 0), 3.0).add(second.within((0, 0), 3.0))  # a scan that was cut is one
    assert not kept.region.intersects(shapely.box(2.05, -0.15, 2.9, 0.15))


def test_only_what_is_newer_frees_again_and_a_memory_is_not_taken_for_newer():
    came = np.full(301, 4.0)
    came[140:161] = 2.0
    person = shapely.box(2.05, -0.15, 3.5, 0.15)
    memory = yard().add(yard(came))
    # an older scan, and the place looked at before the start, say nothing of what is gone
    known = FreeSpace(memory.region, WIDTH, memory.gone)
    for older in (yard(), free_place(BODY, 4.0)):
        assert not older.add(known).region.intersects(person)
    for one in (memory, memory.within((0, 0), 3.0), yard().forget(), memory.forget()):
        for older in (yard(), FreeSpace(yard().region)):
            with pytest.raises(InputError, match=r"got a memory, whose .* Add this to it"):
                older.add(one)


def test_who_came_is_remembered_where_nothing_is_known_to_be_free_any_more():
    """Drift takes all that was free, and what is not free any more grows on."""
    came = FreeSpace(shapely.box(-0.2, -0.2, 0.2, 0.2), gone=shapely.box(1, 0, 2, 1))
    once = came.drifted((0, 0), 0.5, 0.0)
    twice = once.drifted((0, 0), 0.5, 0.0)
    assert once.region.is_empty and twice.region.is_empty
    assert twice.gone.contains(shapely.box(0.05, 0.05, 2.95, 0.95))


def test_what_is_not_seen_again_is_forgotten_and_what_is_stays():
    """The left half is seen again; who forgets twice has nothing of before the first time."""
    angles = np.linspace(0.02, 1.5, 149)
    left, free = yard(angles=angles), yard()
    once = free.forget()
    assert once.region.equals(free.region)
    seen_again = once.add(left).within((0, 0), 9.0).drifted((0, 0), 0.01, 0.0)
    twice = seen_again.forget()
    aside, ahead = shapely.Point(1.0, -1.0), shapely.Point(1.0, 1.0)
    assert seen_again.region.contains(aside) and seen_again.region.contains(ahead)
    assert twice.region.contains(ahead) and not twice.region.intersects(aside)
    assert twice.gone.contains(aside) and not twice.gone.intersects(ahead)  # for the sentence
    assert left.region.contains(twice.region) and twice.forget().region.is_empty
    assert twice.add(yard()).region.contains(aside)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_lidar_that_sees_a_part_of_a_turn_is_remembered_and_forgotten_for_long(seed):
    """Borders of what it forgot and sees again meet: lines are left over there, no areas."""
    rng, free = np.random.default_rng(seed), free_place(BODY, 0.15)
    world = a_world(rng, WIDTH, 40)
    for i in range(60):
        truth = np.array([0.3 * np.sin(0.02 * i), 0.2 * np.sin(0.05 * i), 0.8 * np.sin(0.15 * i)])
        free = free.add(seen(AHEAD, rng, world, truth)).within(truth[:2], 4.0)
        free = free.forget() if i % 10 == 9 else free
        assert not shapely.intersects(free.region, world).any()
    assert free.region.area > 1.0


def test_lines_that_a_union_of_areas_leaves_over_are_no_areas():
    """Of corners as a lidar had them: their borders lie on each other but for the rounding."""
    shadow = [(1.457924406423176, -0.11851401885478609), (0.5645795967163584, 0.2759297981299458)]
    shadow += [(0.6102463547690676, 0.35537086285995717), (0.7644348057005619, 0.4373543164735058)]
    thin = [(0.7938669934007082, -0.0008975589333363616), (0.7841680415811035, 0.14352200877692248)]
    parts = [shapely.Polygon(x) for x in (shadow, [*thin, (0.759250138629519, 0.5145551718904937)])]
    for one, other in (parts, parts[::-1]):
        assert one.union(other).geom_type == "GeometryCollection"
        for name in ("gone", "standing", "region"):
            known = {"region": shapely.box(5, 5, 6, 6)}
            both = FreeSpace(**(known | {name: one})).add(FreeSpace(**(known | {name: other})))
            assert getattr(both, name).covers(shapely.Point(0.7, 0.3))


def test_who_came_stays_out_of_what_is_remembered_after_forgetting():
    came = np.full(301, 4.0)
    came[140:161] = 2.0
    person = shapely.box(2.05, -0.15, 3.5, 0.15)
    memory = yard().forget().add(yard(came))
    assert not memory.region.intersects(person)
    assert not memory.forget().region.intersects(person)
    # its front is at the edge of the newer part, which alone could not say that all behind it left
    slit = yard().region.difference(shapely.box(1.9, -0.3, 2.05, 0.3))
    known = FreeSpace(yard().region, WIDTH, newer=FreeSpace(slit, WIDTH))
    assert not known.add(yard(came)).forget().region.intersects(person)
    older = yard().forget().add(yard()).add(yard(came)).forget()
    assert not older.region.intersects(person)


@pytest.mark.parametrize("noise", [0.0, 1e-300, 1e-12])
def test_a_lidar_without_any_error_notices_who_comes_too(noise):
    """What has no size has no place within another: a hit never is so small."""
    angles, told = np.linspace(-1.5, 1.5, 301), {"max_range": 4.0, "noise": noise, "width": WIDTH}
    came = np.full(301, 4.0)
    came[140:161] = 2.0
    free = seen_from((0, 0, 0), angles, np.full(301, 4.0), **told)
    now = free.add(seen_from((0, 0, 0), angles, came, **told))
    assert now.refuting == 21 and now.gone.contains(shapely.Point(3.0, 0.0))
    assert not now.region.intersects(shapely.box(2.0, -0.1, 3.5, 0.1))


def test_the_least_drift_leaves_what_is_gone_as_it_was():
    came = FreeSpace(shapely.box(-9, -9, 9, 9), gone=shapely.box(1, 0, 2, 1))
    assert came.drifted((0, 0), 1e-300, 0.0).gone.contains(shapely.box(1, 0, 2, 1))


@pytest.mark.parametrize(("moved", "turned"), [(0.0, 0.0), (0.0, 0.02), (0.0, 0.05), (0.03, 0.03)])
@pytest.mark.parametrize("far", [2.5, 8.0])
def test_who_came_is_noticed_by_a_scan_whose_frame_has_drifted_since(far, moved, turned):
    """Also beyond the part that the scan proves free by itself, and away from the sensor's axis."""
    angles, about = np.linspace(-np.pi, np.pi, 361)[:-1], np.array([0.0, -1.0])
    told = {"max_range": 12.0, "noise": 0.01, "width": 0.1}
    memory, none = free_place(BODY), np.full(360, 12.0)
    for x in np.arange(0, 8.1, 0.5):
        memory = memory.add(seen_from([x, 0, 0], angles, none, **told))
    center, size = np.array([far, 0.3]), 0.25
    along = np.cos(angles) * center[0] + np.sin(angles) * center[1]
    inner = along**2 - center @ center + size**2
    near = along - np.sqrt(np.maximum(inner, 0.0))
    came = seen_from([0, 0, 0], angles, np.where((inner >= 0) & (along > 0), near, none), **told)
    now = memory.drifted(about, moved, turned).add(came.drifted(about, moved, turned))
    assert now.refuting and not now.region.is_empty
    for off, way in zip(np.linspace(-turned, turned, 9), np.linspace(0, 6, 9), strict=True):
        turn = np.array([[np.cos(off), -np.sin(off)], [np.sin(off), np.cos(off)]])
        there = turn @ (center - about) + about + moved * np.array([np.cos(way), np.sin(way)])
        assert now.region.intersection(shapely.Point(there).buffer(size)).area < 1e-9


def test_a_scan_that_frees_nothing_any_more_still_refutes_after_a_drift():
    """All beams end near by: nothing is left of what it freed, and its hits are where they are."""
    angles, told = np.linspace(-1.5, 1.5, 301), {"max_range": 4.0, "noise": 0.01, "width": WIDTH}
    now = seen_from((0, 0, 0), angles, np.full(301, 0.3), **told)
    empty = replace(now, region=shapely.Polygon())
    left = FreeSpace(yard().region, WIDTH).add(empty.drifted((0, 0), 0.05, 0.0))
    assert left.refuting and left.region.contains(shapely.Point(0.23, 0.0))
    assert not left.region.intersects(shapely.Point(0.245, 0.0))


def test_of_what_is_not_free_any_more_no_drift_is_told():
    gone = FreeSpace(shapely.box(0, 0, 1, 1), gone=shapely.box(3, 3, 4, 4)).drifted((0, 0), 2, 0.1)
    assert gone.region.is_empty and gone.drift == (0, 0)
    assert gone.add(yard()).drift == (0, 0)
    assert yard().drifted((0, 0), 0.01, 0.002).drift == (Fraction("0.01"), Fraction("0.002"))
