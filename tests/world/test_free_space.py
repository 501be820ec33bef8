"""Free space adds up, is simplified inwards alone, and its obstacles let nobody out. [T41]"""

import copy
import pickle
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import jax
import numpy as np
import pytest
import toy_models
from exact_cover import exact, meets
from needs import need
from toy_models import line_model

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.common.said import without_braces
from parc_jax.drive.loop.episode_file import episode_part

need("shapely")
import shapely  # noqa: E402
from lidar_worlds import Lidar, a_world  # noqa: E402

from parc_jax.app.files.answer_file import load_answer  # noqa: E402
from parc_jax.common.sets.hpolytope import HPolytope, from_box  # noqa: E402
from parc_jax.learning.bound.error_set import faces  # noqa: E402
from parc_jax.learning.bound.tube import fitted_tube  # noqa: E402
from parc_jax.learning.system import TURNS  # noqa: E402
from parc_jax.problem.body import Polygon, body_of  # noqa: E402
from parc_jax.problem.robust.nominal import query  # noqa: E402
from parc_jax.problem.world import free_space  # noqa: E402
from parc_jax.problem.world.free_space import FreeSpace, free_place  # noqa: E402
from parc_jax.problem.world.grid_map import occupancy_grid  # noqa: E402
from parc_jax.problem.world.outlines import edge_of  # noqa: E402
from parc_jax.problem.world.seen import seen_from  # noqa: E402
from parc_jax.safe_set.verdict.infeasible import why_none  # noqa: E402
from parc_jax.safe_set.verdict.scene import lowered  # noqa: E402
from parc_jax.statement import about_obstacles  # noqa: E402

pytestmark = pytest.mark.soundness
LIDAR = Lidar(np.linspace(-2.3, 2.3, 360), uncertainty=(0.01, 0.003), noise=0.01, angle_error=0.001)
BODY = np.array([[0.21, 0.165], [-0.21, 0.165], [-0.21, -0.165], [0.21, -0.165]])


LAW = (
    "Within edges of free space nothing stands, and nothing has come since it was seen; beyond "
    "them nothing is told; all that stands is at least 0.15 m wide."
)


def driven(rng, scans: int = 12):
    """(world, free space after every scan, last place) of a robot that moves about the middle."""
    world = a_world(rng, 0.15, 40)
    free, steps = free_place(BODY, 0.15), []
    for number in range(scans):
        truth = np.array([0.04 * number - 0.2, 0.2 * np.sin(number), 0.7 * number])
        pose, ranges = LIDAR.scan(rng, world, truth)
        free = free.add(seen_from(pose, LIDAR.angles, ranges, width=0.15, **LIDAR.declared))
        steps.append(free)
    return world, steps, truth[:2]


@pytest.fixture(scope="module")
def drives():
    return [driven(np.random.default_rng(seed)) for seed in range(2)]


def test_nothing_stands_in_what_adds_up(drives):
    for world, steps, _ in drives:
        assert not shapely.intersects(steps[-1].region, world).any()
        for less, more in pairwise(steps):
            assert less.region.difference(more.region).area < 1e-9
        assert steps[-1].region.area > 1.5 * steps[0].region.area


def rings(region):
    found = shapely.get_rings(shapely.get_parts(region))
    return [exact(ring.coords) for ring in found]


def edges(region):
    return [edge for ring in rings(region) for edge in pairwise(ring)]


def side(a, b, c) -> int:
    turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (turn > 0) - (turn < 0)


def touch(one, other) -> bool:
    """Do two closed segments, not on one line, have a point in common?"""
    (a, b), (c, d) = one, other
    return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0


def inside(region, point) -> bool:
    """By the crossings of a ray, for points not on an edge."""
    x, y = point
    across = [(a, b) for a, b in edges(region) if (a[1] > y) != (b[1] > y)]
    right = [a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) > x for a, b in across]
    return sum(right) % 2 == 1


def test_simplified_inwards_never_outwards_in_exact_arithmetic(drives):
    """No edge of the one touches one of the other, and a corner of every ring is inside: of a hole
    that is lost there is a corner of the free space inside.
    """
    for _, steps, place in drives:
        base = steps[-1].within(place, 1.5).region
        near = steps[-1].near(place, 1.5).region
        assert not any(touch(one, other) for one in edges(near) for other in edges(base))
        assert all(inside(base, ring[0]) for ring in rings(near))
        assert not any(inside(near, ring[0]) for ring in rings(base))
        assert shapely.get_num_coordinates(near) < shapely.get_num_coordinates(base)


def test_the_pieces_close_in_exact_arithmetic(drives):
    """Every ring closes, every edge of it is held by its piece: so no path leads out."""
    rng = np.random.default_rng(1)
    for _, steps, place in drives:
        near = steps[-1].near(place, 1.5)
        pieces = near.obstacles()
        assert len(pieces) == len(edges(near.region)) <= 64
        assert all(ring[0] == ring[-1] for ring in rings(near.region))
        for ends, piece in zip(edges(near.region), pieces, strict=True):
            for x, y in ends:
                rows = zip(piece.A.tolist(), piece.b.tolist(), strict=True)
                assert all(Fraction(a) * x + Fraction(c) * y <= Fraction(b) for (a, c), b in rows)
        for turn in rng.uniform(0, 2 * np.pi, 20):  # an oracle: straight ways out
            way = exact([place, place + 3 * np.array([np.cos(turn), np.sin(turn)])])
            assert any(meets(piece, *way) for piece in pieces)


def test_a_missing_piece_is_a_way_out():
    near = free_place(BODY, 5.0).near((0, 0), 1.5)
    with pytest.raises(InputError, match="near most: expected a whole number"):
        near.near((0, 0), 1.5, most="a")
    pieces = near.obstacles()
    assert len(pieces) == 4  # the sides of the square: nothing else is near
    for gone, (p, q) in enumerate(edges(near.region)):
        way = [exact([(0.0, 0.0)])[0], (p[0] + q[0], p[1] + q[1])]
        assert meets(pieces[gone], *way)
        assert not any(meets(piece, *way) for i, piece in enumerate(pieces) if i != gone)


def test_edges_of_free_space_are_for_a_robot_inside_of_it():
    """Also among other obstacles, and for a problem as a planner takes it: beyond the edges
    nothing stands that anybody knows of, so a robot there would be told that all is safe.
    """
    line = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(line, 0.1, leave=0.5, effort=pj.drive.Effort(64, deadline=300.0))
    corners = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]
    edges = free_place(corners).obstacles()
    wall = pj.box([0.45, -2.0], [0.5, 2.0])
    for obstacles in (edges, [wall, *edges]):
        for x, inside in ((0.0, True), (20.0, False)):
            loop.restart()
            step = loop.step([x, 0.0], [], obstacles, lambda seen: -seen.path[:, -1, 0])
            assert step.new == inside
        assert "expected a start inside the free space" in step.reason
    goal = pj.box([-1.0] * 3, [1.0] * 3)
    for start in (None, pj.box([3.0, 0.0], [5.0, 1.0])):  # anywhere, and partly outside
        with pytest.raises(InputError, match="expected a start inside the free space"):
            query(pj.reach_avoid(goal, edges, 0.1, start), line).nominal()
    within = pj.reach_avoid(goal, edges, 0.1, pj.box([1.0, 0.0], [2.0, 1.0]))
    assert query(within, line).nominal().problem.obstacles


SQUARE = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]


def test_edges_of_a_free_space_are_taken_all_and_as_they_are(tmp_path):
    """Through an edge that was left out or moved a plan went where nothing is known to be free."""
    model, inside = line_model(4, 0.01, rests=True), pj.box([-0.1, -0.1], [0.1, 0.1])
    edges, goal = free_place(SQUARE).obstacles(), pj.box([-0.9, -0.9, -1.0], [0.9, 0.9, 1.0])
    asked = pj.reach_avoid(goal, edges, 0.05, inside)
    pj.exchange.save_problem(tmp_path / "scene.toml", asked)
    saved = pj.exchange.load_problem(tmp_path / "scene.toml")
    off = from_box(pj.box([-0.02, -0.02], [0.02, 0.02]))
    grown = query(asked.replace(uncertainty=pj.Uncertainty(obstacles=off)), model).nominal().problem
    for whole in (asked, saved, grown):
        assert query(whole, model).nominal().problem.obstacles
        for i, edge in enumerate(whole.obstacles):
            others = (*whole.obstacles[:i], *whole.obstacles[i + 1 :])
            away = replace(edge, b=edge.b + np.where(np.arange(len(edge.b)) == i, -0.2, 0.0))
            for some in (others, (*others, away)):
                with pytest.raises(InputError, match=r"expected all 4 edges of a free .* 1 of"):
                    query(whole.replace(obstacles=some), model).nominal()
    loop = pj.drive.Loop(model, 0.05, leave=0.5, effort=pj.drive.Effort(64, deadline=300.0))
    step = loop.step([0.0, 0.0], [], edges[1:], lambda seen: -seen.path[:, -1, 0])
    assert not step.new and "1 of its sides are in none of those given" in step.reason


def test_a_goal_beyond_the_edge_is_not_said_to_touch_anything():
    """Where the region was cut out of what is free, that is of no scene and no obstacle."""
    line, goal = line_model(4, 0.01, rests=True), pj.box([0.95, -0.1, -2.0], [1.1, 0.1, 2.0])
    problem = pj.reach_avoid(goal, free_place(SQUARE).obstacles(), 0.2)
    reason = why_none(lowered(query(problem, line, [0.0, 0.0]).nominal()))
    assert "from there, leaves the free space that is told" in reason.words
    assert "obstacle" not in reason.words and not reason.of_scene
    wall = pj.reach_avoid(goal, [pj.box([1.0, -1.0], [1.2, 1.0])], 0.2)
    stands = why_none(lowered(query(wall, line, [0.0, 0.0]).nominal()))
    assert "touches obstacle 0" in stands.words and stands.of_scene


def test_a_start_is_inside_of_the_free_space_wherever_its_edges_truly_stand():
    """All of it 1.5 m further along x: a robot in the middle of the region as told was safe."""
    edges, off = free_place(SQUARE).obstacles(), pj.box([1.5, 0.0], [1.6, 0.0])
    line, goal = line_model(4, 0.01, rests=True), pj.box([-5.0] * 3, [5.0] * 3)

    def asked(error, place):
        known = pj.Uncertainty(obstacles=error)
        problem = pj.reach_avoid(goal, edges, 0.1, uncertainty=known)
        return query(problem, line, [place, 0.0]).nominal()

    with pytest.raises(InputError, match=r"free space .* the edges elsewhere than told"):
        asked(off, 0.0)
    assert asked(off, 1.5) and asked([off] * 4, 1.5)
    around = pj.box([-0.1, 0.0], [0.2, 0.1])
    assert asked(around, 0.0) and asked([around, None, pj.box([0.0] * 2, [1.6, 0.0]), None], 0.0)
    with pytest.raises(InputError, match=r"errors of the edges .* may have at once"):
        asked([off, None, off, off], 0.0)


def edges_from_a_file(edges, known, folder):
    problem = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), edges, 0.1, uncertainty=known)
    path = pj.exchange.save_problem(folder / "scene.toml", problem)
    return pj.exchange.load_problem(path).obstacles


AS_TOLD = {
    "as made": lambda edges, *_: edges,
    "copied": lambda edges, *_: copy.deepcopy(edges),
    "of several widths": lambda edges, *_: [replace(e, width=0.1 * i) for i, e in enumerate(edges)],
    "from a file": edges_from_a_file,
}


@pytest.mark.parametrize("case", AS_TOLD)
def test_an_outline_is_not_torn_by_errors_of_its_edges(case, tmp_path):
    """The right edge alone 1.5 m further: plans through the gap that it leaves were proved."""
    edges = free_place(SQUARE).obstacles()
    right = [edge.contains(np.array([1.0, 0.0])) for edge in edges]
    known = pj.Uncertainty(obstacles=[pj.box([1.5, 0], [1.6, 0]) if r else None for r in right])
    edges = AS_TOLD[case](edges, known, tmp_path)
    problem = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), edges, 0.1, uncertainty=known)
    with pytest.raises(InputError, match=r"sets with no point in common, .* outline is torn"):
        query(problem, line_model(4, 0.01, rests=True), [0.8, 0.0]).nominal()


LEAN = pj.hpolytope([[0.8, 0.6], [-0.8, -0.6], [-0.6, 0.8], [0.6, -0.8]], [0.2, -0.1, 0.01, -0.01])
COMMON = {
    "few points": [pj.box([0.1, 0], [0.3, 0]), pj.box([0.29, 0], [0.9, 0])] * 2,
    "an edge of the first": [pj.box([-0.1, -0.1], [0.3, 0.1]), pj.box([0.2, 0.1], [0.3, 0.3])] * 2,
    "a segment that no float is in": [LEAN, copy.deepcopy(LEAN)] * 2,
    "the place as told": [pj.box([0, 0], [0.1, 0.1]), None, None, None],
}


@pytest.mark.parametrize("case", COMMON)
def test_errors_of_edges_that_have_one_in_common_are_taken(case):
    known, edges = pj.Uncertainty(obstacles=COMMON[case]), free_place(SQUARE).obstacles()
    problem = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), edges, 0.1, uncertainty=known)
    assert query(problem, line_model(4, 0.01, rests=True), [0.0, 0.0]).nominal()


def test_an_edge_of_free_space_is_one_at_all_times():
    edges = free_place(SQUARE).obstacles()
    with pytest.raises(InputError, match=r"obstacle 3: expected none for an edge .* got \(0, 0\)"):
        pj.reach_avoid(pj.box([1.0] * 2, [2.0] * 2), edges, 0.1, spans=[None] * 3 + [(0, 0)])


def trailer_model(off=None):
    """A tractor, and its trailer 1 m behind it, which nothing joins to it for a verdict. off: [m]
    by how much farther back the trailer is than predicted, of a fitted tube.
    """
    points, time = ("tractor", "trailer"), pj.learning.time_grid(0.5, 1.0, 0.5)
    eye, behind = np.eye(2), np.array([-1.0, 0.0])
    net = pj.learning.relu_network(
        [np.concatenate([0 * eye, *[eye] * 4])],
        [np.concatenate([behind, *[0 * behind, behind] * 2])],
    )
    tube = pj.learning.tube([[-1.0, 1.0]] * 2, np.full((1, 2, 4), 0.02), np.full((1, 4), 0.02), 2)
    if off is not None:
        centre = np.array([[0.0, 0.0], [-off, 0.0]])
        axes = np.broadcast_to(np.eye(2), (1, 2, 2, 2, 2))
        during = faces(axes, np.broadcast_to(centre, (1, 2, 2, 2)), np.full((1, 2, 2, 2), 0.02))
        at_end = faces(np.eye(4)[None], centre.reshape(1, 4), np.full((1, 4), 0.02), frames=True)
        tube = fitted_tube(tube.edges, during, at_end)
    claim = pj.learning.declared_claim(tube, "this test", net, time, points=points)
    return pj.learning.trajectory_model(net, claim)


def test_every_part_of_the_body_begins_in_the_free_space():
    points, model = ("tractor", "trailer"), trailer_model()
    goal = pj.problem.goal_of_points(points, {"tractor": pj.box([-1.0] * 2, [1.0] * 2)})
    tractor, trailer = (pj.problem.hull(name, radius=0.2) for name in points)
    beside = Polygon(np.array([[-1.2, -0.2], [-0.8, -0.2], [-1.0, 0.2]]))

    def asked(body, back):
        seen = free_place([[back, -2.0], [3.0, -2.0], [3.0, 2.0], [back, 2.0]]).obstacles()
        return query(pj.reach_avoid(goal, seen, body), model, [0.0, 0.0]).nominal()

    assert asked(tractor, -0.4) and asked(pj.problem.hull(*points, radius=0.2), -0.4)
    for number, body in ((1, body_of([tractor, trailer])), (0, trailer), (0, beside)):
        assert asked(body, -1.4)
        with pytest.raises(InputError, match=rf"part {number} may begin at \(-1.000, "):
            asked(body, -0.4)


def test_a_part_begins_where_errors_place_it():
    """Plans of a trailer at -2.0 m, predicted at -1.0 m, were safe, beyond an edge at -1.4 m."""
    seen = free_place([[-1.4, -2.0], [3.0, -2.0], [3.0, 2.0], [-1.4, 2.0]]).obstacles()
    goal = pj.problem.goal_of_points(
        ("tractor", "trailer"), {"tractor": pj.box([-1.0] * 2, [1.0] * 2)}
    )
    asked = pj.reach_avoid(goal, seen, pj.problem.hull("trailer", radius=0.2))
    for off in (None, 0.01, 0.1):
        assert query(asked, trailer_model(off), [0.0, 0.0]).nominal()
    far = trailer_model(1.0)
    with pytest.raises(InputError, match=r"part 0 may begin at \(-2.020, "):
        query(asked, far, [0.0, 0.0]).nominal()
    # it was found safe by a verdict, which knows edges and no inside
    bare = asked.replace(obstacles=[HPolytope(edge.A, edge.b) for edge in seen])
    settings = pj.Settings(samples=1, method=pj.types.FirstProved())
    assert pj.Planner(far).solve(bare, jax.random.key(0), settings, at=[0.0, 0.0]).status.found


def test_files_keep_the_region_that_edges_are_of(tmp_path):
    line, key = line_model(4, 0.01, rests=True), jax.random.key(0)
    place = free_place([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]], 0.125)
    edges = replace(place, width=0.15).obstacles()
    block = pj.box([3.0, 3.0], [3.5, 3.5])
    problem = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), [block, *edges], 0.1)
    settings = pj.Settings(samples=1, method=pj.types.FirstProved())
    said = f"{LAW[:-1]}{TOLD}0.125 m around a body are seen to be free."
    answer = pj.Planner(line).solve(problem, key, settings, at=[0.0, 0.0])
    assert said in answer.details() and said in answer.summary()
    read = pj.exchange.load_problem(pj.exchange.save_problem(tmp_path / "scene.toml", problem))
    for again in (read, load_answer(answer.save(tmp_path / "answer.json")).problem):
        for name in ("region", "width", "told"):
            assert [getattr(one, name, None) for one in again.obstacles] == [
                getattr(one, name, None) for one in problem.obstacles
            ]
        assert said in about_obstacles(again, line.time)
        with pytest.raises(InputError, match="expected a start inside the free space"):
            query(again, line, [5.0, 0.0]).nominal()
    old = edge_of(edges[0], f"{place.region.wkb_hex} 0.15")  # of an earlier version
    assert without_braces(old.rests_on) == LAW and old.holds(np.zeros((1, 2)))
    with pytest.raises(InputError, match="text on one line"):
        edge_of(edges[0], f"{place.region.wkb_hex} 0.15; all is\nfree")


TOLD = "; as told each time, at most: "
ERRORS = {"noise": 0.01, "angle_error": 0.001, "uncertainty": (0.02, 0.003)}
MOST = (
    "ranges are off by 0.01 m, beams by 0.001 rad, poses by 0.02 m, headings by 0.003 rad, beams "
    "without a return are free up to 4 m"
)
MIXED = MOST.replace("0.01 m", "{}") + ", free cells of a map are occupied with less than 0.196"


def scanned(**told):
    asked = ERRORS | {"max_range": 4.0, "width": 0.15} | told
    return seen_from((0, 0, 0), np.linspace(-2.3, 2.3, 360), np.full(360, 3.0), **asked)


DRIFTED = (
    f"{MOST}, the frame drifts by 0.01 m, it turns by 0.002 rad, in all by {{}} rad since the "
    "oldest of it was seen"
)


def off_again(free, cycles):
    for _ in range(cycles):
        free = free.drifted((0, 0, 0), 0.01, 0.002)
    return free


def remembered(cycles):
    return off_again(scanned(), cycles)


def mapped():
    return occupancy_grid(np.zeros((9, 9), int), 0.5, (-2.0, -2.0, 0.0)).free_space()


@pytest.mark.parametrize(
    ("free", "told"),
    [
        (lambda: scanned(), MOST),
        (lambda: scanned(noise=0.0125), MOST.replace("0.01 m", "0.0125 m")),
        (lambda: scanned(noise=0.1 / 3), MOST.replace("0.01 m", f"{0.1 / 3} m")),
        (lambda: mapped().add(scanned(noise=0.1 / 3)), MIXED.format(f"{0.1 / 3} m")),
        (lambda: scanned(angle_error=0.0), MOST.replace("0.001 rad", "0 rad")),
        (lambda: scanned().add(scanned()), MOST),
        # the least, on which a region rests, rounded down
        (lambda: scanned().add(scanned(noise=0.0125)), MOST.replace("0.01 m", "0.01 to 0.013 m")),
        (lambda: scanned(noise=0.0125).add(scanned()), MOST.replace("0.01 m", "0.01 to 0.013 m")),
        (
            lambda: scanned(noise=0.0125).add(scanned()).add(scanned()).add(scanned()),
            MOST.replace("0.01 m", "0.01 to 0.013 m"),
        ),
        (lambda: scanned(noise=0.1).add(scanned()), MOST.replace("0.01 m", "0.01 to 0.1 m")),
        (
            lambda: scanned().drifted((0, 0, 0), (0.02, 0.01), 0.004).within((0, 0), 2.0),
            f"{MOST}, the frame drifts by 0.01 to 0.02 m, it turns by 0.004 rad, in all by 0.01 m "
            "and 0.004 rad since the oldest of it was seen",
        ),
        # beside what it is the sum of, no more than was allowed for; nothing of what was forgotten
        (lambda: remembered(3), DRIFTED.format("0.03 m and 0.006")),
        (lambda: remembered(3).forget().add(remembered(1)), DRIFTED.format("0.03 m and 0.006")),
        (lambda: remembered(6), DRIFTED.format("0.06 m and 0.012")),
        (
            lambda: remembered(3).add(free_place(SQUARE, 0.3)),
            DRIFTED.format("0.03 m and 0.006") + ", 0.3 m around a body are seen to be free",
        ),
        (
            lambda: off_again(remembered(3).forget().add(scanned()), 2).forget(),
            DRIFTED.format("0.02 m and 0.004"),
        ),
        (
            lambda: scanned(max_range=8.0).add(scanned()),
            MOST.replace("to 4 m", "to 4 to 8 m"),
        ),
        (lambda: free_place(SQUARE, 0.3), "0.3 m around a body are seen to be free"),
        (lambda: free_place(SQUARE, -0.03), "poses by 0.03 m"),
        (lambda: free_place(SQUARE), ""),
        (lambda: mapped(), "free cells of a map are occupied with less than 0.196"),
        (
            lambda: mapped().add(scanned()).forget().add(free_place(SQUARE, 0.3)).forget(),
            f"{MOST}, 0.3 m around a body are seen to be free, free cells of a map are occupied "
            "with less than 0.196",
        ),
    ],
)
def test_an_edge_tells_the_bounds_that_were_told(free, told):
    free = free()
    (said,) = {without_braces(x.rests_on) for x in free.near((0.5, 0.0), 2.0).obstacles()}
    law = LAW if free.width else LAW.replace("; all that stands is at least 0.15 m wide", "")
    assert said == (f"{law[:-1]}{TOLD}{told}." if told else law)


def test_edges_tell_it_in_the_frame_of_the_robot_too():
    turning = toy_models.told(line_model(4, 0.01, rests=True), rotation=(TURNS,))
    edges = free_place(SQUARE, 0.5).obstacles()
    problem = pj.reach_avoid(pj.box([-5.0] * 3, [5.0] * 3), edges, 0.1)
    asked = query(problem, turning, [0.1, 0.0, 0.5]).nominal()
    assert asked.problem.rests_on == problem.rests_on and "{0.5} m" in str(problem.rests_on)


def test_a_loop_says_how_wide_all_is_that_stands():
    model = line_model(4, 0.01, rests=True)
    patient = pj.drive.Effort(candidates=64, deadline=300.0)
    loop = pj.drive.Loop(model, 0.05, leave=0.5, given=(1,), effort=patient)
    place = free_place([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]])
    edges, key = replace(place, width=0.15).obstacles(), jax.random.key(0)
    one = loop.step([0.0] * 2, [0.1], edges, lambda x: -x.path[:, -1, 0], at=0.0).committed
    said = dict(entry[::2] for entry in episode_part([one])["premises"])["said of obstacles"]
    assert said.endswith(f"Of at most {len(edges)} at a time: {LAW}")
    outcome = pj.drive.Outcome(False, False, {}, [one])
    drive = {"drive": lambda *_: outcome, "law": lambda seed: 0, "workers": 0, "quiet": True}
    assert LAW in pj.drive.drive_episodes(key=key, n=1, **drive).details()


def test_what_is_proposed_is_not_believed(drives, monkeypatch):
    """Where the proposal is wrong, nothing is free, rather than too much."""
    _, steps, place = drives[0]
    monkeypatch.setattr(free_space, "ROUND", -1.0)
    with pytest.raises(InputError, match="free space"):
        steps[-1].near(place, 1.5)
    seen = seen_from((0, 0, 0), LIDAR.angles, np.full(360, 3.0), width=0.15, **LIDAR.declared)
    assert seen.region.is_empty
    assert free_place(BODY, -0.02).region.is_empty


def test_a_hole_is_free_where_no_obstacle_has_room():
    yard = shapely.box(0, 0, 4, 4)
    slit, speck = shapely.box(1, 1, 1.05, 3), shapely.box(2, 2, 2.1, 2.1)
    room = shapely.box(3, 3, 3.12, 3.12)
    holed = yard.difference(shapely.union_all([slit, speck, room]))
    free = FreeSpace(holed, 0.11).add(free_place([[0, 0], [0.1, 0], [0, 0.1]]))
    assert free.width == 0.11
    assert free.region.symmetric_difference(yard.difference(room)).area < 1e-9
    unsure = FreeSpace(holed).add(free_place([[0, 0], [0.1, 0], [0, 0.1]]))
    assert unsure.region.symmetric_difference(holed).area < 1e-9


def turn_by(angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


@pytest.mark.parametrize("axes", [(0.03, 0.03), (0.06, 0.005), (0.005, 0.06)])
@pytest.mark.parametrize("turned", [0.0, 0.05])
def test_what_drifts_is_free_wherever_it_was_truly(drives, axes, turned):
    """Every point that is left lies in the region, however its frame has turned and moved: in a
    disc, or in an ellipse along a heading."""
    free = drives[0][1][-1]
    place, heading = np.array([0.3, -0.2]), 0.7
    left = free.within(place, 1.5).drifted([*place, heading], axes, turned)
    corners = shapely.get_coordinates(left.region)
    assert 0.3 * free.within(place, 1.5).region.area < left.region.area
    for angle in {-turned, 0.0, turned}:
        for side in np.linspace(0, 2 * np.pi, 16, endpoint=False):
            shift = turn_by(heading) @ (np.array(axes) * [np.cos(side), np.sin(side)])
            there = place + (corners - place) @ turn_by(angle).T + shift
            assert shapely.contains_xy(free.region, there).all()


def test_what_stands_on_a_map_drifts_where_nothing_is_free():
    """No hole of what is seen then is filled there, wherever it may stand by then."""
    cells = np.zeros((9, 9), int)
    cells[2:7, 2:7] = 100
    wall = occupancy_grid(cells, 0.5, (-2.0, -2.0, 0.0)).free_space().within((0.25, 0.25), 1.0)
    assert wall.region.is_empty and wall.gone.is_empty and wall.standing.area == pytest.approx(4)
    stands = wall.drifted((0, 0), 0.1, 0.0).standing
    assert stands.contains(wall.standing.buffer(0.1, quad_segs=64))


def test_holds_is_about_the_whole_body_in_one_part():
    free = FreeSpace(shapely.box(-1, -1, 1, 1).difference(shapely.box(0.3, -1, 0.31, 1)))
    assert free.holds(BODY) and free.holds(BODY, 0.08)
    assert not free.holds(BODY, 0.1)
    assert not free.holds(
        BODY + np.array([0.3, 0.0])
    )  # across the gap: its parts are not connected
    assert free.holds(BODY + np.array([0.6, 0.0]))
    assert not free.holds([[-0.5, 0.0], [0.9, 0.0]])


def test_a_place_grows_by_what_is_declared_and_shrinks_by_uncertainty():
    hull = shapely.MultiPoint(BODY).convex_hull
    grown, left = free_place(BODY, 0.1).region, free_place(BODY, -0.1).region
    assert grown.contains(hull) and hull.buffer(0.1 + 1e-9, quad_segs=64).contains(grown)
    assert hull.contains(left) and left.distance(hull.exterior) >= 0.1
    assert left.area > 0.8 * 0.22 * 0.13
    assert free_place(BODY, -0.2).region.is_empty


def test_a_body_in_uncertainty_keeps_its_own_place(drives):
    """A scan behind which nothing was seen yet does not hold a robot; what it stood on does."""
    world, _, _ = drives[0]
    pose, ranges = LIDAR.scan(np.random.default_rng(0), world, np.zeros(3))
    seen = seen_from(pose, LIDAR.angles, ranges, width=0.15, **LIDAR.declared)
    assert not seen.holds(BODY)
    assert seen.add(free_place(BODY, 0.15)).near((0, 0), 1.5).holds(BODY, 0.01)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda free: free.drifted((0, 0), -0.1, 0.0), "moved: expected a number >= 0; got -0.1"),
        (
            lambda free: free.drifted((0, 0), (0.2, 0.1), 0.0),
            r"place \(x, y, heading\): expected shape",
        ),
        (lambda free: free.near((5, 5), 1.0), "expected a place with free space"),
        (lambda free: free.near((np.nan, 0), 1.0), "place"),
        (lambda free: free.near([0.5], 1.0), "place: expected x, y or x, y, heading; got 1"),
        (lambda free: free.near((0, 0), 1.0, tolerance="a"), "tolerance: expected numbers"),
        (lambda free: free.near((0, 1e6), 1.0), "up to 100000 m; got 1e.06. Subtract an origin"),
        (lambda free: free_place(BODY + 1e6), "corners of the body: expected finite coordinates"),
        (lambda free: free.near((0, 0), -1.0), "reach: expected a number >= 0; got -1"),
        (lambda free: free.near((0, 0), 1.0, tolerance=np.inf), "tolerance: expected finite"),
        (lambda free: free.holds([0.0, 1.0]), "corners of the body"),
        (lambda free: free_place(BODY, np.nan), "margin: expected finite"),
        (lambda free: free.within((9, 9), 1.0).obstacles(), "this one is empty"),
    ],
)
def test_refused_in_one_sentence(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call(free_place(BODY, 0.5))


@pytest.mark.parametrize("window", [{}, {"place": (1.0, 1.0), "reach": 1.0}], ids=["rim", "window"])
def test_what_stands_at_the_rim_of_a_map_or_its_window_is_no_hole_either(window):
    """A bay of the map, which a scan from beyond closes to a hole."""
    cells = np.zeros((40, 80 if window else 40), np.int8)
    cells[20, 39] = 100  # 5 cm, at the right end
    free = occupancy_grid(cells, 0.05).free_space(**window)
    post, eye = shapely.box(1.95, 1.0, 2.0, 1.05), np.array([3.0, 1.025])
    angles = np.linspace(-1.2, 1.2, 2401)
    ways = np.stack([-np.cos(angles), -np.sin(angles)], axis=1)
    hits = [shapely.LineString([eye, eye + 1.5 * way]).intersection(post) for way in ways]
    ranges = np.array([1.5 if hit.is_empty else hit.distance(shapely.Point(eye)) for hit in hits])
    asked = {"max_range": 1.5, "noise": 0.002, "width": 0.15, "tolerance": 0.0}
    seen = seen_from((*eye, np.pi), angles, ranges, **asked)
    assert free.add(seen).region.intersection(post).area < 1e-9 * post.area


def test_what_stands_on_a_map_is_no_hole_that_the_assumption_of_a_scan_fills():
    cells = np.zeros((80, 80), np.int8)
    cells[60:62, 60:62] = 100  # a post of 10 cm
    free = occupancy_grid(cells, 0.05).free_space()
    elsewhere = {"max_range": 0.5, "noise": 0.01, "width": 0.2}
    angles = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    seen = seen_from((1.0, 1.0, 0.0), angles, np.full(360, 0.5), **elsewhere)
    post = shapely.Point(3.05, 3.05)
    both = free.add(seen).add(seen)
    assert not both.region.intersects(post) and both.region.area > free.region.area - 1e-9
    assert both.width == 0.2  # on which the scans rest


RING = [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3)]
ROOM = shapely.Polygon(RING)
BOWTIE = shapely.Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])


@pytest.mark.parametrize(
    ("region", "got"),
    [
        (shapely.LinearRing(RING), "got LINEARRING"),
        (shapely.LineString(RING), "got LINESTRING"),
        (shapely.MultiPoint(RING), "got MULTIPOINT"),
        (shapely.GeometryCollection([shapely.MultiPolygon([ROOM])]), "got GEOMETRYCOLLECTION"),
        (BOWTIE, r"got POLYGON \(\(0 0, 2 2"),
        (shapely.MultiPolygon([ROOM, shapely.box(0, 0, 1, 1)]), "got MULTIPOLYGON"),
        (None, "got None"),
    ],
)
def test_only_valid_areas_are_free_space(region, got):
    """Of others the sides are not found, and nobody would be kept inside."""
    with pytest.raises(InputError, match=f"free space: expected a valid Polygon or .*; {got}"):
        FreeSpace(region)
    if region is not None:
        edges = [replace(one, region=region) for one in FreeSpace(ROOM).obstacles()]
        with pytest.raises(InputError, match=f"obstacles: expected a valid Polygon .*; {got}"):
            edges[0].require_all(edges)


@pytest.mark.parametrize("width", [np.nan, np.inf, -1.0, None, True])
def test_only_a_length_is_a_width_below_which_nothing_stands(width):
    """NaN and -1 filled holes, and no edge said that it rests on a width."""
    with pytest.raises(InputError, match="free space width: expected"):
        FreeSpace(ROOM, width)


@pytest.mark.parametrize("width", ["0.5", np.array(0.5), np.float32(0.5)])
def test_a_width_is_kept_as_the_number_that_was_checked(width):
    """A text stayed one, and the union with a place raised a TypeError."""
    free = FreeSpace(ROOM, width)
    assert type(free.width) is float and free.add(FreeSpace(ROOM, 0.1)).width == 0.5
    assert "0.5 m wide" in without_braces(free.obstacles()[0].rests_on)


@pytest.mark.parametrize("name", ["region", "gone", "standing"])
def test_each_part_of_a_free_space_is_an_area_in_metres(name):
    for area in (BOWTIE, shapely.LineString(RING), None):
        with pytest.raises(InputError, match="free space: expected a valid Polygon or Multi"):
            FreeSpace(**{"region": ROOM, name: area})
    degrees = shapely.set_srid(shapely.box(8.5, 47.3, 8.6, 47.4), 4326)
    with pytest.raises(InputError, match=r"free space: expected metres .*; got SRID 4326"):
        FreeSpace(**{"region": ROOM, name: degrees})


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_a_copy_of_a_place_drifts_as_it_does(copied):
    place = free_place(BODY, 0.2)
    moved = [one.drifted((0, 0, 0), 0.01, 0.01) for one in (place, copied(place))]
    assert moved[0].region.equals(moved[1].region) and not moved[1].region.is_empty
    assert copied(moved[0]).add(place).region.area > place.region.area - 1e-9


def test_far_away_is_no_free_space_where_floats_round_by_more_than_is_allowed_for():
    with pytest.raises(InputError, match="free space: expected finite coordinates up to 100000 m"):
        FreeSpace(shapely.box(0, 0, 1e7, 1))
    with pytest.raises(InputError, match="free space: expected finite coordinates up to 100000 m"):
        seen_from((0, 0, 0), [-0.1, 0.1], [1e7, 1e7], max_range=1e7, noise=0.0, width=1e7)
