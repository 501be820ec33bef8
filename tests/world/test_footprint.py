"""A footprint becomes a body whose parts are the outline, wherever it stands."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from needs import need

import parc_jax as pj
from parc_jax.app.files.answer_file import load_answer
from parc_jax.checker.answer import main
from parc_jax.common.errors import InputError
from parc_jax.learning.network.relu import relu_network
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.world.outlines import read_footprint
from parc_jax.safe_set.batch.box_scenes import lay_out_boxes

need("shapely")
import shapely  # noqa: E402

NAV2 = "[[0.21, 0.165], [0.21, -0.165], [-0.21, -0.165], [-0.21, 0.165]]"
FORK = [[0, 0], [2, 0], [2, 0.5], [0.5, 0.5], [0.5, 1.5], [2, 1.5], [2, 2], [0, 2]]


def test_a_rectangle_is_one_hull_of_its_corners():
    robot = read_footprint(NAV2)
    assert robot.points == ("base", "corner 0", "corner 1", "corner 2", "corner 3")
    (part,) = robot.body.parts
    assert set(part.points) == set(robot.points[1:])
    assert robot.places[0].tolist() == [0, 0] and robot.places[1].tolist() == [0.21, 0.165]


@pytest.mark.parametrize("turn", [1, -1])
def test_what_is_not_convex_becomes_parts_that_are_all_of_it(turn):
    robot = read_footprint(FORK[::turn])
    where = dict(zip(robot.points, robot.places, strict=True))
    hulls = [
        shapely.MultiPoint([where[p] for p in part.points]).convex_hull for part in robot.body.parts
    ]
    assert 1 < len(hulls) <= 4
    assert shapely.union_all(hulls).symmetric_difference(shapely.Polygon(FORK)).area < 1e-12


def test_points_turn_and_move_with_the_pose():
    robot = read_footprint(NAV2)
    poses = np.array([[1.0, 2.0, np.pi / 2], [0.0, 0.0, 0.0]])
    found = robot.at(poses)
    assert found.shape == (2, 5, 2)
    assert found[0, 1] == pytest.approx([1 - 0.165, 2.21])
    assert (found[1] == robot.places).all()
    assert np.allclose(jax.jit(robot.at)(jnp.asarray(poses)), found)
    assert (robot.corners(poses[0]) == found[0, 1:]).all()


def slides(robot, places):
    """A model whose points (n, 2) go straight by k, with the names of a footprint."""
    n = len(places)
    W = np.kron(np.arange(5)[:, None] / 4, np.tile(np.eye(2), (n, 1)))[2:]
    net = relu_network([W], [np.tile(places.ravel(), 5)[2:]])
    wide = np.full((1, 4, 2 * n), 0.005), np.full((1, 2 * n), 0.005)
    tube = pj.learning.tube([[-1.0, 1.0]] * 2, *wide, n)
    time = pj.learning.time_grid(dt=0.25, t_f=1.0)
    claim = pj.learning.declared_claim(
        tube, "of this test", net, time, system="slides", points=robot.points
    )
    return pj.learning.trajectory_model(net, claim)


def test_a_footprint_that_is_not_the_model_s_is_refused():
    """Names alone are the same: else what is proved is of the smaller robot that was learned."""

    def asked(places):
        problem = pj.reach_avoid(
            pj.problem.goal_of_points(robot.points, {"base": pj.box([0.3, -0.1], [0.5, 0.1])}),
            [],
            robot.body,
        )
        return query(problem, slides(robot, places), [0.0, 0.0]).nominal()

    robot = read_footprint(NAV2)
    nearly = robot.places + 0.004 * np.sign(robot.places)
    for places in (robot.places, robot.places @ [[0, 1], [-1, 0]], nearly):  # of any heading
        assert asked(places).model.n_points == 5
    for places in (0.8 * robot.places, robot.places * [[1.0, 1.2]]):
        with pytest.raises(InputError, match="body: expected the footprint that the model was"):
            asked(places)
    goal = np.full((1, 10), -np.inf)
    goal[:, :2] = [0.3, -0.1]
    high = np.where(np.isfinite(goal), goal + 0.2, np.inf)
    post = [[2.0, 2.0]], [[2.1, 2.1]]
    for places in (robot.places, 0.8 * robot.places):
        model = slides(robot, places)
        scenes = pj.problem.box_scenes(model, goal, high, *post, robot.body)
        if places is robot.places:
            assert lay_out_boxes(scenes, model)
            continue
        with pytest.raises(InputError, match="body: expected the footprint that the model was"):
            pj.Planner(model).solve_batch(scenes, jax.random.PRNGKey(0))


def test_a_scene_file_has_the_places_of_a_footprint(tmp_path):
    """Else a footprint that the model was not learned with is refused, and read from a file not."""
    robot = read_footprint(NAV2)
    goal = pj.problem.goal_of_points(robot.points, {"base": pj.box([0.3, -0.1], [0.5, 0.1])})
    scene = pj.reach_avoid(goal, [], robot.body)
    path = pj.exchange.save_problem(tmp_path / "scene.toml", scene)
    again = pj.exchange.load_problem(path, robot.points)
    assert again.body == scene.body and len(again.body.places) == 5
    with pytest.raises(InputError, match="body: expected the footprint that the model was"):
        query(again, slides(robot, 0.8 * robot.places), [0.0, 0.0]).nominal()
    other = scene.replace(body=robot.body.replace(places=(("corner 9", 1.0, 0.0),)))
    with pytest.raises(InputError, match=r"places of points of the model, base, .*'corner 9'"):
        query(other, slides(robot, robot.places), [0.0, 0.0]).nominal()
    twice = robot.body.replace(places=(*robot.body.places, ("base", 1.0, 0.0)))
    with pytest.raises(InputError, match="places: expected each point at one place"):
        pj.exchange.save_problem(path, pj.reach_avoid(goal, [], twice))


@pytest.mark.parametrize(
    ("places", "match"),
    [
        ("{ tail = [0.2, 0.1] }", "a body of reference points, and x and y of some of them"),
        ("{ nose = [0.2] }", "a body of reference points, and x and y"),
        ("{ nose = 0.2 }", "places nose: expected a list of numbers"),
        ("[0.2, 0.1]", "a body of reference points, and x and y"),
        ("5", "a body of reference points, and x and y"),
    ],
)
def test_places_that_are_none_are_refused(places, match, tmp_path):
    path = tmp_path / "scene.toml"
    body = '[goal]\nlo = [0, 0]\nhi = [1, 1]\n[body]\ndisc = "nose"\n'
    named = 'points = ["nose"]\n' * (places != "5")  # also where no names are known
    path.write_text(f"{named}places = {places}\n{body}")
    with pytest.raises(InputError, match=match):
        pj.exchange.load_problem(path)


@pytest.mark.parametrize("unsure", [None, pj.Uncertainty(k={"k0": 0.01})])
def test_where_its_corners_are_is_told_of_an_answer_its_plan_and_its_file(unsure, tmp_path, capsys):
    """Else answers for a small robot and a large one read the same."""
    for half in (0.1, 0.3):
        robot = read_footprint(half * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]))
        goal = pj.problem.goal_of_points(robot.points, {"base": pj.box([0.4, -0.2], [0.9, 0.2])})
        problem = pj.reach_avoid(goal, [], robot.body, uncertainty=unsure)
        planner = pj.Planner(slides(robot, robot.places))
        answer = planner.solve(problem, jax.random.key(0), at=[0.0, 0.0])
        said = f"on the robot: base (0, 0), corner 0 ({half}, {half}), corner 1 ({half}, -{half}), "
        assert said in answer.details() and said in answer.summary()
        assert unsure is not None or said in answer.choose().details()
        answer.save(tmp_path / "answer.json")
        assert said in load_answer(tmp_path / "answer.json").details()
        main([str(tmp_path / "answer.json")])
        assert said in capsys.readouterr().out


@pytest.mark.parametrize(
    ("outline", "sentence"),
    [
        ("[[0.2, 0.1], [0.2", "footprint: expected .*; got "),
        ("[]", "footprint"),
        ([[0, 0], [1, 0]], "at least three corners"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "expected a valid Polygon"),
        ("[[0, 0], [1, null], [1, 1]]", "footprint"),
        (0.3, "footprint"),
    ],
)
def test_what_is_no_footprint_is_refused_in_one_sentence(outline, sentence):
    with pytest.raises(InputError, match=sentence):
        read_footprint(outline)
