"""What is dragged, and the plans that follow: without a browser, but for the last tests."""

import threading
from types import SimpleNamespace
from unittest.mock import MagicMock

import jax
import numpy as np
import pytest
from compilations import compiled_by
from needs import need
from scene_text import problem_of_text
from scipy.optimize import linprog
from toy_bodies import points_model
from toy_models import line_model, told

import parc_jax as pj
import sims
from parc_jax.app import cli, live_page
from parc_jax.app import live as module
from parc_jax.app.live import Live, live, swept
from parc_jax.app.live_page import about_set
from parc_jax.app.plot.page import page_data
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.common.spelling import rounded_down
from parc_jax.learning.network.predict import by_point
from parc_jax.problem.body import hull
from parc_jax.problem.problem import Span
from parc_jax.problem.world.free_space import free_place
from parc_jax.safe_set.verdict.pointwise import paths_of, verdicts
from parc_jax.safe_set.verdict.scene import scene_of

GOAL = pj.box([1.4, -0.4, -9.0], [1.9, 0.4, 9.0])
START = pj.box([-0.4, -0.4], [0.0, 0.4])
BLOCKS = [pj.box([x, y], [x + 0.1, y + 0.1]) for x in (0.5, 0.9) for y in (-0.8, 0.1, 0.7)]
WIDE = np.array([0.3, 0.3, 0.2])
POLYGON = pj.hpolytope([[1.0, 0.3], [-1.0, 0.4], [0.0, -1.0], [0.1, 1.0]], [1.2, -1.0, 0.1, 0.3])


@pytest.fixture(autouse=True)
def any_clock(monkeypatch):
    """A busy machine draws as many plans as an idle one."""
    monkeypatch.setattr(module, "HASTE", 60.0)


@pytest.fixture(scope="module")
def dragged():
    model = line_model(e=0.01, half=2.5)
    return Live(model, pj.reach_avoid(GOAL, [*BLOCKS, POLYGON], 0.05, START))


def test_every_plan_that_is_drawn_is_safe_where_things_are_and_nothing_compiles(dragged):
    """200 of 200, and more: by the verdict on the whole problem as it was dragged."""
    dragged.draw()
    rng, seen = np.random.default_rng(0), 0

    def drag_about() -> None:
        nonlocal seen
        for _ in range(12):
            for name in ("obstacle 1", "obstacle 6", "goal", "start"):
                grip = dragged.grips[name]
                dragged.move(name, grip.middle + rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.3, 0.3))
            drawn = dragged.draw()
            p0, k = np.split(drawn.plans, [2], axis=1)
            drawings.append((dragged.problem, p0, k, drawn.clearance))
            seen += len(p0)

    drawings: list = []
    assert compiled_by(drag_about) == 0
    assert seen >= 200
    for problem, p0, k, clearance in drawings:
        verdict = verdicts(scene_of(problem, dragged.model), p0, k)
        assert verdict.safe.all()
        assert np.allclose(np.minimum(verdict.clearance, 9), np.minimum(clearance, 9), atol=0.3)


@pytest.mark.parametrize("where", [(3.5, 3.5), (5.0, 0.0), (6.0, 6.0)])
def test_the_roomiest_plan_comes_first_however_far_obstacles_are(where):
    """All had the bound from below by which an obstacle is left out, a tenth of the way to it."""
    problem = pj.reach_avoid(
        GOAL, [pj.box(np.subtract(where, 0.1), np.add(where, 0.1))], 0.1, START
    )
    far = Live(line_model(e=0.01, half=2.5), problem)
    far.warm_up()
    drawn: list = []
    assert compiled_by(lambda: drawn.append(far.draw())) == 0
    true = verdicts(scene_of(problem, far.model), *np.split(drawn[0].plans, [2], axis=1)).clearance
    assert np.ptp(true) > 0.1 and (np.diff(true) <= 0).all()
    assert np.allclose(true, drawn[0].clearance)


def test_what_is_dragged_is_the_set_moved_and_turned():
    dragged = Live(line_model(half=2.5), pj.reach_avoid(GOAL, [POLYGON], 0.05))
    rng, angle = np.random.default_rng(1), 0.7
    x = rng.uniform(-3, 3, (1000, 2))
    before = POLYGON.contains(x)
    assert (dragged.problem.obstacles[0].b == POLYGON.b).all()
    middle, turn = dragged.grips["obstacle 0"].middle, np.array([[0, -1.0], [1.0, 0]])
    dragged.move("obstacle 0", [5.0, 6.0], np.pi / 2)
    moved = (x - middle) @ turn.T + [5.0, 6.0]
    after = dragged.problem.obstacles[0].contains(moved)
    assert before.any() and (after == before).mean() > 0.999
    dragged.move("goal", dragged.grips["goal"].middle + np.array([0.5, 0.0]), angle)
    ends = np.r_[dragged.grips["goal"].place, 0.0]
    assert dragged.problem.goal.contains(ends[None]).all()


@pytest.mark.parametrize("heading", [3.0, 3.5, -3.5, 6.6])
def test_a_heading_is_the_one_that_was_told_and_is_turned_on_from_there(heading):
    """Within half a turn of 0 the goal, told around 3.5 rad, seemed out of reach."""
    end = np.array([0.5 * np.cos(heading), 0.5 * np.sin(heading), heading])
    goal = pj.box(end - WIDE, end + WIDE)
    problem = pj.reach_avoid(goal, [pj.box([j, 3.0], [j + 0.5, 3.5]) for j in range(5)], 0.05)
    page = Live(turning_model(), problem, [0.0, 0.0, heading])
    assert page.at[2] == pytest.approx(heading, abs=1e-12) and len(page.draw().plans)
    page.move("start", [0.0, 0.0], heading + 0.1)
    assert page.at[2] == pytest.approx(heading + 0.1, abs=1e-12) and len(page.draw().plans)


def turning_model():
    """A way ahead, then a turn; its runs turn with their heading."""
    W = np.zeros((9, 2))
    W[0:8:2, 0], W[8, 1] = np.linspace(0, 1, 5)[1:], 1.0
    tube = pj.learning.tube([[0, 1], [-0.5, 0.5]], np.full((1, 4, 2), 0.02), np.full((1, 3), 0.02))
    time, net = pj.learning.time_grid(0.25, 1.0, 0.05), pj.learning.relu_network([W], [W[:, 0] * 0])
    claim = pj.learning.declared_claim(tube, "this test", net, time, rotation=("turns",))
    return pj.learning.trajectory_model(net, claim)


@pytest.fixture
def opened(monkeypatch):
    """What a page was opened of, without one."""
    pages: list[Live] = []
    monkeypatch.setattr(live_page, "Page", lambda of, port: pages.append(of))
    return pages


@pytest.mark.parametrize("told", ["heading", "uncertain", "uncertain pose", "neither", "place"])
def test_an_answer_of_a_file_is_opened_where_the_file_knows_its_question(told, tmp_path, opened):
    """One in the robot's frame was turned and moved once more; one under an uncertainty was not
    robust to it any more, and said nothing of it.
    """
    far = pj.box(GOAL.lo + 50.0, GOAL.hi + 50.0)  # there is no plan: nothing is searched for
    model, asked = line_model(e=0.01, half=2.5), pj.reach_avoid(far, [POLYGON], 0.05, START)
    at = [0.0, 0.0] if told in ("uncertain pose", "place") else None
    asked = asked if at is None else asked.replace(start=None)
    if told.startswith("uncertain"):
        asked = asked.replace(uncertainty=pj.Uncertainty(start=0.01, sensing_eps="1/100"))
    if told == "heading":
        model, at = turning_model(), [0.15, -0.1, 0.1]
        end = np.array([50.0, -0.05, 0.1])
        asked = pj.reach_avoid(pj.box(end - WIDE, end + WIDE), [POLYGON], 0.05)
    answer = pj.Planner(model).solve(asked, jax.random.PRNGKey(0), module.SOON, at=at)
    answer.save(tmp_path / "answer.json")
    read = pj.load_answer(tmp_path / "answer.json")
    live(answer, wait=False)
    if told in ("neither", "place"):
        live(read, wait=False)
        mine, its = (page.scene().nominal for page in opened)
        assert (mine.problem.goal.b == its.problem.goal.b).all()
        assert mine.at is its.at is None or (mine.at == its.at).all()
    else:
        with pytest.raises(InputError, match="expected an answer that knows its question"):
            live(read, wait=False)
        assert len(opened) == 1


UNDER_WAY = SimpleNamespace(loop="a platform", under_way=True, seen_outside=False)
OTHERS = {  # what is said of an obstacle, and of that why it stays where it is
    "moves": (pj.problem.moving(BLOCKS[1], [0.0, -0.1], (0, 3), 0.25, off_by=0.1)[1][0], "told"),
    "of a robot": (Span((0, 3), of=UNDER_WAY), "rests on its manoeuvre"),
    "for a time": (Span((0, 2)), None),
}


@pytest.mark.parametrize("of", OTHERS)
def test_what_is_said_of_an_obstacle_is_not_said_of_where_it_is_dragged(of):
    """What was proved of a robot dragged 3 m aside rested on the manoeuvre that it was making."""
    span, why = OTHERS[of]
    told = pj.reach_avoid(GOAL, [BLOCKS[1], POLYGON], 0.05, START, spans=[span, None])
    among = Live(line_model(e=0.01, half=2.5), told)
    among.move("obstacle 1", [0.9, 0.9])
    assert among.grips["obstacle 0"].free == (why is None)
    if why is None:
        among.move("obstacle 0", [5.0, 5.0])
        assert among.problem.obstacles[0].contains(np.array([[5.0, 5.0]])).all()
        assert not among.problem.rests_on
        return
    with pytest.raises(InputError, match=rf"free grip, another than obstacle 0: .*{why}"):
        among.move("obstacle 0", [5.0, 5.0])
    assert (among.problem.obstacles[0].b == told.obstacles[0].b).all()


def test_edges_of_free_space_stay_where_they_are():
    """One that was dragged was an obstacle like others, with a start on either side of it."""
    need("shapely")
    seen = free_place([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]).obstacles()
    among = Live(line_model(half=2.5), pj.reach_avoid(GOAL, [POLYGON, *seen], 0.05), [0.0, 0.0])
    among.warm_up()
    with pytest.raises(InputError, match="another than obstacle 1: Within edges"):
        among.move("obstacle 1", [9.0, 9.0])
    with pytest.raises(InputError, match=r"expected one of goal, .*; got 'obstacle 7'"):
        among.move("obstacle 7", [9.0, 9.0])
    among.move("obstacle 0", [0.5, 1.0])
    assert len(among.draw().plans)
    among.move("start", [4.0, 0.0])
    with pytest.raises(InputError, match="expected a start inside the free space"):
        among.draw()


def test_the_scene_that_is_saved_is_the_one_that_is_shown(dragged):
    again = problem_of_text(dragged.toml(), "scene.toml", points=dragged.model.points)
    for mine, other in zip(again.obstacles, dragged.problem.obstacles, strict=True):
        assert (mine.A == other.A).all() and (mine.b == other.b).all()
    assert (again.goal.b == dragged.problem.goal.b).all()


@pytest.mark.parametrize("at", [None, pytest.param((-0.1, 0.05), marks=pytest.mark.slow)])
def test_sliders_narrow_plans_set_and_share(at):
    """Of uniform draws from what is left of K by an oracle of its own: the verdict on each."""
    start = None if at is not None else START
    model = line_model(e=0.01, half=2.5)
    alone = Live(model, pj.reach_avoid(GOAL, [POLYGON], 0.05, start), at)
    alone.settle()
    alone.k[:] = [1.45, -0.45], [1.85, 0.1]
    answer, _ = alone.settle()
    for k in (alone.draw().plans[:, 2:], answer.samples[:, 2:]):
        assert len(k) >= 8 and (k >= alone.k[0]).all() and (k <= alone.k[1]).all()
    rng, n = np.random.default_rng(5), 20_000
    k = rng.uniform(*alone.k, (n, 2))
    p0 = rng.uniform([1.4, -0.4], [1.9, 0.4], (n, 2)) - k
    if at is not None:
        p0[:] = at
    seen = verdicts(scene_of(alone.problem, model), p0, k).safe.mean()
    assert 0.05 < seen < 0.95
    assert answer.share.at_least - 0.015 <= seen <= answer.share.at_most + 0.015
    assert "k in the sliders' part of K" in about_set(answer)[0]


def test_sliders_that_leave_no_plan_are_named_before_other_remedies():
    """The page told to widen goal and start by 2.5 m, where one slider was what had to move."""
    model = line_model(e=0.01, half=2.5)
    alone = Live(model, pj.reach_avoid(GOAL, [POLYGON], 0.05, START))
    first = "What would help first: wider sliders of "
    alone.k[:] = [-2.5, -2.5], [-1.0, 2.5]
    answer, why = alone.settle()
    assert answer is None and why.sentences[0] == f"{first}k0."
    alone.k[:] = [-2.5, 2.0], [-1.0, 2.5]
    assert alone.settle()[1].sentences[0] == f"{first}k0 and k1."
    alone.move("goal", [40.0, 0.0])  # sliders are of no use
    assert not any("slider" in one for one in alone.settle()[1].sentences)
    alone.k[:] = model.domain.lo, model.domain.hi
    assert not any("slider" in one for one in alone.settle()[1].sentences)


def test_sliders_narrow_the_parameters_that_are_left_where_others_are_given():
    model = line_model(e=0.01, half=2.5)
    known = pj.Uncertainty(given={"k0": 1.6})
    alone = Live(model, pj.reach_avoid(GOAL, [POLYGON], 0.05, START, uncertainty=known))
    alone.k[:, 1] = -0.2, 0.1
    k = alone.draw().plans[:, -1]
    assert len(k) >= 8 and (k >= -0.2).all() and (k <= 0.1).all()
    assert alone.chosen == [1]  # a slider of what is given does nothing, and there is none


def test_a_slider_where_no_execution_stays_in_k_is_told():
    """Plans of the nearest k that may be asked for were drawn in its place."""
    known = pj.Uncertainty(k={"k0": 0.2})
    problem = pj.reach_avoid(GOAL, [], 0.05, START, uncertainty=known)
    alone = Live(line_model(e=0.01, half=2.5), problem)
    alone.k[:, 0] = 2.4, 2.5
    for ask in (alone.draw, alone.settle):
        with pytest.raises(InputError, match=r"k0: expected some of -2\.3 to 2\.3, from where"):
            ask()


def test_sliders_of_what_is_not_known_make_plans_robust_and_compile_nothing_while_dragged():
    """Every plan that is drawn is safe for the tube that moves, and for obstacles that do."""
    model = line_model(e=0.01, half=2.5)
    alone = Live(model, pj.reach_avoid(GOAL, [*BLOCKS, POLYGON], 0.05, START))
    alone.warm_up()
    off, rng, seen, answers = 0.05, np.random.default_rng(6), [], []

    def slide() -> None:
        for name in ("pose", "obstacles"):
            alone.off = {"pose": 0.0, "obstacles": 0.0, name: off}
            alone.move("obstacle 0", alone.grips["obstacle 0"].middle, 0.3)
            seen.append((name, alone.problem, alone.draw().plans))
            answers.append(alone.settle()[0])

    assert compiled_by(slide) == 0
    for answer in answers:  # of the scene as it is drawn more plans are safe
        assert answer.status.found
        assert "are safe for all that is uncertain, confidence" in about_set(answer)[0]
    for name, problem, plans in seen:
        p0, k = np.split(plans, [2], axis=1)
        assert len(plans) >= 16 and problem_of_text(alone.toml(), "scene.toml").uncertainty
        for _ in range(20):
            by = rng.choice([-off, off], 2)
            moved, places = problem.replace(uncertainty=None), p0
            if name == "pose":
                places = p0 + by
                moved = moved.replace(start=None)
            else:
                out = [hpolytope(o.A, o.b + o.A @ by) for o in moved.obstacles]
                moved = moved.replace(obstacles=out)
            assert verdicts(scene_of(moved, model), places, k).safe.all()
    alone.off = {"pose": 0.0, "obstacles": 0.0}
    assert alone.problem.uncertainty is None


def test_a_slider_that_moves_while_a_scene_is_made_mixes_no_two_parts_of_k(monkeypatch):
    model = sims.model("drift_parking")
    alone = Live(model, sims.drift_parking.problem("rectangle"))
    parts = [np.stack([model.domain.lo, model.domain.center]), np.array([model.domain.hi] * 2)]
    monkeypatch.setattr(Live, "k", property(lambda _: parts.pop(0), lambda *_: None), raising=False)
    one = alone.scene()
    assert (one.k_lo == model.domain.lo).all() and (one.k_hi == model.domain.center).all()


def test_on_release_the_set_is_measured_or_it_is_said_what_is_in_the_way():
    walls = [pj.box([0.7, 0.3], [0.9, 2.0]), pj.box([0.7, -2.0], [0.9, -0.3])]
    alone = Live(line_model(e=0.01, half=2.5), pj.reach_avoid(GOAL, walls, 0.2, START))
    answer, why = alone.settle()
    assert answer.status.found and answer.coverage.at_least > 0.5
    p0, k = np.split(alone.draw().plans, [2], axis=1)
    assert answer.contains(p0, k).mean() > 0.8
    for j, side in enumerate((-0.105, 0.105)):  # 3 cm too narrow, as in tests/answer/test_why.py
        alone.move(f"obstacle {j}", alone.grips[f"obstacle {j}"].middle + np.array([0.0, side]))
    answer, why = alone.settle()
    assert answer is None and sorted(why.obstacles) == [0, 1]
    assert why.missing == pytest.approx(0.03, abs=1e-3)
    corners, faces, way = swept(alone.scene(), alone.draw().plans)  # of nothing
    assert len(corners) == len(faces) == len(way) == 0 and way.shape[2] == 3


@pytest.mark.parametrize("told", [(0.01, None), (0.01,), ()])
def test_what_obstacles_are_off_by_is_drawn_beside_the_errors_that_the_scene_tells(told):
    """Also of an obstacle that it tells to be exact, among others that are not."""
    walls, off = [pj.box([0.7, 0.3], [0.9, 2.0]), pj.box([0.7, -2.0], [0.9, -0.3])], 0.05
    sets = [None if s is None else pj.box([-s, -s], [s, s]) for s in told]
    asked = pj.reach_avoid(GOAL, walls, 0.2, START).replace(
        uncertainty=pj.Uncertainty(obstacles=sets)
    )
    alone = Live(line_model(e=0.01, half=2.5), asked)
    alone.off["obstacles"] = off
    p0, k = np.split(alone.draw().plans, [2], axis=1)
    sizes = np.resize([(s or 0.0) + off for s in told] or [off], 2)
    grown = [pj.box(w.lo - s, w.hi + s) for w, s in zip(walls, sizes, strict=True)]
    true = scene_of(pj.reach_avoid(GOAL, grown, 0.2, START), alone.model)
    assert len(p0) and verdicts(true, p0, k).safe.all()
    exact = scene_of(pj.reach_avoid(GOAL, walls, 0.2, START), alone.model)
    assert compiled_by(alone.draw) == 0 and verdicts(exact, p0, k).clearance.min() > off


def test_a_set_of_the_sliders_part_says_so_wherever_it_goes(tmp_path):
    """Taken into a notebook or a file it was one of all k in K."""
    dragged = Live(line_model(e=0.01, half=2.5), pj.reach_avoid(GOAL, BLOCKS, 0.05), at=(0.0, 0.0))
    dragged.k = np.array([[1.5, -0.25], [1.75, 0.25]])
    answer, _ = dragged.settle()
    part = "[1.5, 1.75] x [-0.25, 0.25]"
    for one in (answer, pj.load_answer(answer.save(tmp_path / "part.json"))):
        assert f"set under an assumed tube with k in {part} from one start (" in repr(one)
        assert (
            f"% of all k in {part} (" in one.summary() and f" with k in {part}, " in one.details()
        )
        k = one.sample(jax.random.PRNGKey(0), 500)[:, 2:]
        assert (dragged.k[0] <= k).all() and (k <= dragged.k[1]).all()


@pytest.mark.slow
def test_polytopes_pages_and_headers_keep_to_the_sliders_part(tmp_path):
    """They were of all k, beside an answer that has none outside of the part."""
    problem = pj.reach_avoid(GOAL, BLOCKS, 0.05, START)
    dragged = Live(line_model(e=0.01, half=2.5), problem)
    dragged.k = np.array([[1.5, -0.25], [1.75, 0.25]])
    answer, _ = dragged.settle()
    data = page_data(answer)
    assert data["domain"] == {"lo": [1.5, -0.25], "hi": [1.75, 0.25]}
    assert data["box"] == "[1.5, 1.75] x [-0.25, 0.25]"
    for one in answer.polytopes(jax.random.PRNGKey(0), 50).all:
        rows = one.halfspaces
        for axis, lo, hi in ((2, 1.5, 1.75), (3, -0.25, 0.25)):
            along = np.eye(4)[axis]
            least, most = (
                sign * linprog(sign * along, rows.A, rows.b, bounds=(None, None)).fun
                for sign in (1, -1)
            )
            assert lo <= least <= most <= hi
    with pytest.raises(InputError, match=r"expected an answer about all of K; this one is of k in"):
        pj.exchange.write_c(answer, tmp_path / "part.h")


def test_a_pose_is_dragged_and_turned():
    turning = told(line_model(e=0.01, half=2.5), rotation=("turns",))
    blocks = [pj.box([4.0, 4.0], [4.1, 4.1])]
    goal = pj.box([-3.0, -3.0, -9.0], [3.0, 3.0, 9.0])
    alone = Live(turning, pj.reach_avoid(goal, blocks, 0.05), at=(0.0, 0.0, 0.5))
    assert alone.at == pytest.approx([0.0, 0.0, 0.5])
    alone.move("start", [0.3, 0.2], 1.0)
    drawn = alone.draw()
    told_beside = about_set(alone.settle()[0])[-1]  # all that is drawn and told is in the world
    assert "start at (0.3, 0.2) m with heading 1" in told_beside and "frame" not in told_beside
    assert "its heading, and of its goal states" in told_beside
    corners, _, way = swept(drawn.scene, drawn.plans)
    assert len(drawn.plans) and np.allclose(way[:, 0], [0.3, 0.2, 0.0])
    ends = drawn.plans[:, 2:] @ np.array([[np.cos(1), np.sin(1)], [-np.sin(1), np.cos(1)]])
    assert np.allclose(way[:, -1, :2], ends + np.array([[0.3, 0.2]])) and np.isfinite(corners).all()


@pytest.mark.parametrize("n_p", [2, 3])
def test_the_drawn_body_holds_the_points_on_their_way(n_p):
    """Along every direction in which it is drawn nothing of the body is beyond it."""
    model = points_model(np.random.default_rng(3), n_p)
    goal = pj.box([-60.0] * (model.n_c + 1), [60.0] * (model.n_c + 1))
    scene = scene_of(pj.reach_avoid(goal, [], hull("c0", "c1", radius=0.1)), model)
    plans = np.random.default_rng(0).uniform(-0.5, 0.5, (3, n_p + 2))
    corners, faces, _ = swept(scene, plans, pieces=1, tube=True)
    places = by_point(paths_of(model, plans[:, :n_p], plans[:, n_p:]), 4)[:, :, :2]
    wide = by_point(model.tube.widest_at(plans[:, n_p:])[0], 4)[:, :, :2].max(axis=1)
    each = corners.reshape(3, -1, 3)[:, :, :n_p]
    for axis in range(n_p):
        most = (places[..., axis] + wide[:, None, :, axis]).max(axis=(1, 2)) + 0.1
        assert np.allclose(each[:, :, axis].max(axis=1), most)
    assert faces.max() < len(corners)


def test_the_shell_opens_the_scene_of_a_system_at_a_pose(monkeypatch):
    opened = []
    monkeypatch.setattr(module, "live", lambda *given: opened.append(given))
    with pytest.raises(SystemExit) as stop:
        cli.main(["live", "drift_parking", "--at", "1.5,-2", "--quiet", "--no-cache"])
    assert stop.value.code == 0
    ((model, problem, at, port),) = opened
    assert model.claim.law.generator == "drift_parking" and len(problem.obstacles) == 2
    assert (at, port) == ([1.5, -2.0], 8080)


def test_what_is_no_answer_is_refused():
    with pytest.raises(InputError, match="expected an answer, or a model and a problem"):
        live(line_model())


class Told:
    """A line beside the scene, and that one has changed."""

    changed = threading.Event()
    text = ""

    @property
    def content(self) -> str:
        return self.text

    @content.setter
    def content(self, text: str) -> None:
        self.text = text
        self.changed.set()


def clear(drawn):
    return drawn._replace(clearance=np.full(len(drawn.plans), np.inf))


@pytest.fixture
def server(monkeypatch):
    """Of a page without a browser."""
    server = MagicMock()
    server.gui.add_markdown.side_effect = [Told(), Told()]
    server.gui.add_checkbox.return_value.value = False
    viser = MagicMock(ViserServer=lambda *_, **__: server)
    monkeypatch.setattr(live_page, "package", lambda *_: viser)
    return server


@pytest.mark.parametrize("at", [None, (0.0, 0.0), (0.0, 0.0, 0.1)])
def test_a_start_turns_where_it_has_a_heading_alone(at, server):
    """A box of starts was turned like a robot, whose plans and shares stayed as they were."""
    start = START if at is None else None
    model = told(line_model(e=0.01, half=2.5), rotation=("turns",))
    live(model, pj.reach_avoid(GOAL, [POLYGON], 0.05, start), at, wait=False).stop()
    made = server.scene.add_transform_controls.call_args_list
    fixed = {one.args[0]: one.kwargs["disable_rotations"] for one in made}
    assert fixed == {"/goal": False, "/obstacle 0": False, "/start": at is None or len(at) == 2}


def test_a_proof_that_is_refused_says_why(server):
    """Its note said for ever that it was being proved."""
    page = live(line_model(e=0.01, half=2.5), pj.reach_avoid(GOAL, [], 0.05, START), wait=False)
    page.stop()
    page.live.off["pose"] = 5.0
    client = MagicMock()
    page._prove(SimpleNamespace(client=client))
    assert client.add_notification.return_value.remove.called
    assert "uncertainty" in client.add_notification.call_args.args[1]
    assert not client.send_file_download.called


def test_an_error_of_any_kind_takes_words_and_plans_with_it(monkeypatch, caplog, server):
    """The last ones, of what had been safe before, stood there until the page was closed."""
    model = line_model(e=0.01, half=2.5)
    page = live(model, pj.reach_avoid(GOAL, [*BLOCKS, POLYGON], 0.05, START), wait=False)

    def until(words: str) -> str:
        while words not in page.told:
            assert Told.changed.wait(60.0)
            Told.changed.clear()
        return page.told

    assert "safe plans" in until("measured in") and "possible run" not in page.told
    page.live.off["pose"] = 0.01  # as its slider sets it
    page.move("obstacle 0", [0.7, -0.7])
    assert "m clear; lines are of one possible run" in until("possible run")
    page.live.off["pose"] = 0.0
    with monkeypatch.context() as bare:
        bare.setattr(page.live, "draw", lambda *of, draw=page.live.draw: clear(draw(*of)))
        page.move("obstacle 0", [0.6, -0.7])
        assert " ms, nothing near\n" in until("nothing near")
    for broken in ("settle", "draw"):
        with monkeypatch.context() as patched:
            patched.setattr(page.live, broken, lambda *_: np.zeros(2) @ np.zeros(3))
            server.scene.remove_by_name.reset_mock()
            page.move("obstacle 0", [0.6, -0.7])
            told = until("could not draw or measure this: ValueError")
            assert told.startswith("**") and told.endswith("**\n") and told.count("\n") == 1
        page.move("obstacle 0", [0.7, -0.7])
        assert "safe plans" in until("measured in")
        gone = {call.args[0] for call in server.scene.remove_by_name.call_args_list}
        assert {"/plans/way", "/plans/swept", "/body/swept"} <= gone
    page.stop()
    assert caplog.text.count("could not draw or measure this") == 2 and "matmul" in caplog.text


def test_the_words_beside_a_set_say_of_which_k_how_surely_and_what_is_assumed():
    dragged = Live(line_model(e=0.01, half=2.5), pj.reach_avoid(GOAL, BLOCKS, 0.1, START))
    answer, _ = dragged.settle()
    first, *_, tube, of_runs = about_set(answer)
    share = answer.share
    assert f"**{rounded_down(100 * share.at_least, 3)} to " in first
    assert "whatever else the goal asks" in first  # it is of these plans alone
    assert first.endswith(f"are safe, confidence {rounded_down(str(share.confidence), 10)}")
    assert tube == f"the tube is {answer.model.claim.kind}, not shown"
    assert of_runs == "All plans start with the heading of the model's runs."  # not as it is turned
    at, _ = Live(line_model(e=0.01, half=2.5), pj.reach_avoid(GOAL, [], 0.1), (0, 0)).settle()
    assert "%** of all k in K are safe, confidence" in about_set(at)[0]
    span = Span((1, 2), said="That it is there rests on a promise")
    known = pj.Uncertainty(start=0.01, sensing_eps="0.2")
    asked = pj.reach_avoid(GOAL, BLOCKS[:1], 0.1, START, spans=[span], uncertainty=known)
    said = "\n".join(about_set(Live(line_model(e=0.01, half=2.5), asked).settle()[0]))
    assert "That it is there rests on a promise" in said
    assert "but for a probability of at most 0.2 each time" in said


def test_what_sliders_add_to_is_told_in_numbers_for_people():
    """It was ±0.060000000000000005 m, and -0.050000000000000024 to 0.050000000000000024 m."""
    some = pj.box([-0.03, -0.03], [0.03, 0.03])
    known = pj.Uncertainty(start=[0.05, 0.02], obstacles=some)
    asked = pj.reach_avoid(GOAL, BLOCKS[:1], 0.1, START, uncertainty=known)
    dragged = Live(line_model(e=0.01, half=2.5), asked)
    dragged.off = {"pose": 0.01, "obstacles": 0.02}
    said = dragged.scene().nominal.uncertainty.words
    assert "within ±0.06, ±0.03 m of" in said
    assert "lies within -0.05 to 0.05, -0.05 to 0.05 m" in said


@pytest.mark.slow
def test_nothing_compiles_on_release_where_few_plans_are_safe():
    """Such a scene is first looked at in some of its many intervals, by a program of its own."""
    model, problem = sims.model("drift_parking"), sims.drift_parking.problem("rectangle")
    page = Live(model, problem)
    page.warm_up()
    page.move("obstacle 0", page.grips["obstacle 0"].middle + np.array([1.2, 0.0]))
    assert compiled_by(page.settle) == 0
