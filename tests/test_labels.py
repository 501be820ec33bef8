"""Names and units reach every place that speaks of a coordinate, and nothing else depends on
them.
"""

import jax
import numpy as np
import pytest
import toy_driven
from toy_models import line_model

import parc_jax as pj
from parc_jax.app.cli.systems import asked_of
from parc_jax.common.errors import InputError, is_text
from parc_jax.learning.labels import axes_of, labels, labels_of, name_of, require_unit, unit_of
from parc_jax.learning.runs.law import law_spec, subject
from parc_jax.problem.problem import Span
from parc_jax.problem.problem_file import load_problem, save_problem
from parc_jax.safe_set.verdict.outline import require_fit

NAMED = labels(2, 1, 2, q=("final yaw [rad]",), k=("speed [m/s]", "turn [rad]"))


def scene():
    return pj.reach_avoid(pj.box([-0.25, -0.25, -1.0], [0.25, 0.25, 1.0]), [], 0.1)


class Cart:
    name, n_p, n_q = "cart", 2, 1
    domain = pj.box([0.5, -0.5], [1.0, 0.5])
    time = pj.learning.time_grid(0.5, 1.0)
    k_labels = ("speed [m/s]", "turn [rad]")


def test_plain_labels_and_those_of_a_system():
    assert labels(3, 1, 2) == (("x [m]", "y [m]", "z [m]"), ("q0",), ("k0", "k1"))
    assert labels(4, 0, 1).p == ("p0 [m]", "p1 [m]", "p2 [m]", "p3 [m]")
    named = labels_of(Cart())
    assert named.plan == ("x [m]", "y [m]", "speed [m/s]", "turn [rad]")
    assert named.goal == ("x [m]", "y [m]", "q0") and named.heading is None
    assert NAMED.heading == 0
    assert name_of("goal [left] [m]") == "goal [left]" and unit_of("goal [left] [m]") == "m"
    assert name_of("k0") == "k0" and unit_of("k0") == ""
    for label, parted in {
        "yaw (rad)": ("yaw", "rad"),
        "v(m/s)": ("v", "m/s"),
        "x (map)": ("x (map)", ""),
        "a (b) [m]": ("a (b)", "m"),
    }.items():
        assert (name_of(label), unit_of(label)) == parted


@pytest.mark.parametrize(
    "wrong",
    [
        ("speed [m/s]",),
        ("", "turn"),
        ("a$b$", "turn"),
        ("a\n", "b"),
        3,
        ("speed [m/s]", "speed [rad/s]"),
        ("1 [m]", "b"),
    ],
)
def test_wrong_labels_are_refused(wrong):
    given = (wrong, wrong) if isinstance(wrong, int) else wrong
    with pytest.raises(InputError, match="labels of k: expected"):
        labels(2, 0, 2, k=given)


@pytest.mark.parametrize(
    "wrong",
    [{"q": (f"yaw{unit}", "wind")} for unit in (" [deg]", " (deg)", "_degrees", "Deg")]
    + [{"p": words} for words in (("xMm", "yMm"), ("velX", "velY"), ("acc_x", "acc_y"))]
    + [
        {"p": (f"x{unit}", "y [m]")}
        for unit in (" [cm]", "[cm]", " (mm)", " mm", "_mm", "_inch", "_px")
    ]
    + [{"p": ("x [m]", word)} for word in ("bottom", "theta", "t", "robotSpeed", "lat")]
    + [{"p": ("x [m]", word)} for word in ("y_index", "y angle", "y (axle)", "y_time", "y_px")],
)
def test_a_unit_in_which_no_number_is_read_is_refused(wrong):
    about = "cart", Cart.domain, pj.learning.time_grid(0.5, 1.0), 2, 2, None, ("turns", "stays")
    named = subject(*about, {"q": ("yaw [rad]", "wind [knots]"), "k": ("speed [mm/s]", "b [deg]")})
    assert named.labels.heading == 0
    subject(*about, {"p": ("x (rear axle) [m]", "bottom [m]"), "q": ("yaw (world)", "wind (deg)")})
    for p in ("px,py", "x0,y0", "tx,ty", "x_t,y_t", "t x,t y", "index x [m],angle bracket y [m]"):
        assert subject(*about, {"p": p.split(",")}).labels.p == tuple(p.split(","))
    with pytest.raises(InputError, match="as its numbers are read; got"):
        subject(*about, wrong)
    with pytest.raises(InputError, match="as its numbers are read; got"):
        named.with_labels(wrong)


UNITS = (
    "X-mm|x.mm|x/mm|x;mm|x_Mm|xMM|xmm|posXMm|x1Mm|mm x|x in|x (in)|x in inches|inches_x|x_feet|"
    "x foot|x_millimeters|x centimetre|x_um|x µm|x_dm|x_cells|x°|x %|pixel_x|screenX|grid_x|u_x|"
    "x mm raw|x (m/s)|x(m/s)|x m/s|x_m_s|x_mps|x_kmh|x (deg)|x (mm)|x m/s2|x_kilometres"
)
SAID = (
    "odom.vel.x|xVel|velx|twist.linear.x|x_dot|xdot|x_rate|force_x|gyro_x|angular.x|err_x|cmd_x|x_std|"
    "cov_x|x_goal|target_x|x_ref|x_rad|orientation.x|omega_x|q_x|rot_x|torque_x|jerk_x|x_sigma|"
    "x_variance|x_rmse|x_bias|obstacle_x|waypoint_x|predicted_x|lateral error|t|xm|"
    "reference x|left foot x|foot in map x|"
    "Rev A x|ego v x|lidar_grid_x|delta_x|deltaX|wind_x|x_min|xmax|x limit|x_lower|x_upper|x_ddot|"
    "current_x|motor current x|field|x_1000|x1000|x 100|px_x|"
    "qvel_0|nsecs|magnetic_field.x|vx|qz|upper arm x|qpos[0]|bottom|yaw"
)
FINE = (
    "x|X|posX|robotX|xM|x_m|x (m)|x_metres|x [m]|pose.position.x|odom.pose.pose.position.x|x_t|"
    "tx|base_link_x|left foot x [m]|east|northing|x1|index finger x [m]|px|"
    "px [m]|grid x [m]|gyro x [m]|linear axis [m]|u [m]|utm_x|lateral error [m]|"
    "cross track err [m]|target x [m]|x ref [m]|goal frame x [m]|"
    "s [m]|t [m]|q [m]|target x (m)|left(m)|upper arm x [m]|delta x [m]|x min [m]|"
    "yaw bearing x [m]|"
    "/odom/pose/pose/position/x|Rigid Body 1 Position X|transform.translation.x|"
    "x_10|robot_px|robot_py|base px|"
    "field.pose.pose.position.x"
)
DEGREES = (
    "headingDeg|yawDegrees|deg heading|headingdeg|heading in degree|Heading Degs|yaw°|theta/deg"
)


@pytest.mark.parametrize(
    ("unit", "wrong", "fine"),
    [
        ("m", f"{UNITS}|{SAID}", FINE),
        (
            "rad",
            f"{DEGREES}|yaw_rate|heading_cmd|yaw_std|qz|yawRate|heading [mrad]|heading_mrad|gon|"
            "heading (deg)|yaw rad/s|heading error|wheel angle|rot_z|heading_turns|delta_yaw|"
            "yaw_max|pose.orientation.z|transform.rotation.w|q_z|yaw_index|t|T|map|world|in|"
            "execution|rad|robot|pose|current_yaw|theta1|heading_360|yaw_180|q360",
            "yaw|θ|heading [rad]|yaw in radians|headingRad|yaw_t|orientation|wheel angle [rad]|q0|"
            "q|q_0|theta_10|rot|robot_yaw|pose.theta|field.theta|odom_yaw|"
            "heading (rad)|heading error [rad]|target heading [rad]|rot_z [rad]|"
            "delta [rad]|orientation z [rad]",
        ),
    ],
)
def test_a_name_without_unit_is_believed_where_all_its_words_are_known(unit, wrong, fine):
    """However they are parted: columns in mm were read as m, and goals as where a robot was."""
    for label in wrong.split("|"):
        with pytest.raises(InputError, match=f"in .{unit}., as its numbers are read"):
            require_unit(label, unit)
    for label in fine.split("|"):
        require_unit(label, unit)
    require_unit("tag100 x", "m", ("tag100",))
    with pytest.raises(InputError, match=r"By other names they are told with their unit"):
        require_unit("goal_x", unit)


LINES = "It stands.\n(V) With confidence 0.999999 a plan fails with probability at most 1e-9."


@pytest.mark.parametrize("text", [LINES, "\x1b[2K\rACCEPTED", "\ud800", "\x7f"])
def test_no_text_that_comes_from_outside_can_look_like_a_sentence_of_ours(text, tmp_path):
    model = line_model(4, 0.01)
    about = model.tube, "this test", model.net, model.time
    for enters in (
        lambda: Span((0, 3), said=text),
        lambda: Span((0, 3), of=text),
        lambda: pj.learning.declared_claim(about[0], text, *about[2:]),
        lambda: pj.learning.declared_claim(*about, system=text),
        lambda: pj.learning.declared_claim(*about, points=(text,)),
        lambda: law_spec(text, model.domain),
        lambda: pj.problem.hull(text),
    ):
        with pytest.raises(InputError):
            enters()
    assert is_text(law_spec("a", model.domain, parameters={"a": text}).describe())
    if text != "\ud800":  # no name of a file
        np.savez(tmp_path / f"{text}.npz", k=np.ones((2, 1)), p=np.zeros((2, 5, 2)))
        runs = pj.load_rollouts(tmp_path / f"{text}.npz", model.time)
        assert is_text(runs.law.describe())


def test_coordinates_are_named_by_label_name_or_number_each_once():
    words = ("speed [m/s]", "turn [rad/s]", "é")
    for named in (("é", "speed"), (np.str_("é"), 0), (2, np.int64(0)), ["é", "speed [m/s]"]):
        axes = axes_of(named, words)
        assert axes == (2, 0) and all(type(axis) is int for axis in axes)
    assert axes_of(["turn (rad/s)", "speed (m/s)"], words) == (1, 0)
    for named in (("speed [km/h]",), ("é [m]",), ("speed [m/s]", "speed")):
        assert axes_of(named, words) is None
    for named in (("speed", 0), (np.int64(0), 0), (True,), (1.0,), (3,), (-1,), "speed", (None,)):
        assert axes_of(named, words) is None


def test_labels_of_no_part_of_a_model_are_refused():
    with pytest.raises(InputError, match=r"labels: expected those of p, q, k, as .*; got K"):
        line_model().with_labels({"K": ("speed [m/s]", "turn [rad]")})


@pytest.mark.parametrize("p", [("y [m]", "x [m]"), ("north [m]", "east [m]"), ("zPos", "yPos")])
def test_coordinates_of_a_mirrored_world_are_refused(p):
    """Of a system as of a file: its headings, turned obstacles and scans would be mirrored."""
    with pytest.raises(InputError, match=r"axes in the order x, y, z .* mirrored world"):
        subject("cart", pj.box([0.0], [1.0]), Cart.time, 2, 0, labels={"p": p})
    for fine in (p[::-1], ("along [m]", p[0])):
        assert subject("cart", pj.box([0.0], [1.0]), Cart.time, 2, 0, labels={"p": fine})


MIRRORED = "left ahead|forward right|right forward|south west|lateral longitudinal".split("|")


@pytest.mark.parametrize("pair", MIRRORED)
def test_coordinates_of_a_mirrored_robot_are_refused(pair):
    """A heading turns them the other way; where none does these are names of a plane's axes."""
    p = [f"{word} [m]" for word in pair.split()]
    about = "cart", pj.box([0.0], [1.0]), Cart.time, 2
    with pytest.raises(InputError, match=r"axes in the order x, y, z .*; ahead, left.* mirrored"):
        subject(*about, 1, labels={"p": p}, rotation=("turns",))
    assert subject(*about, 1, labels={"p": p})
    for fine in (
        ("ahead [m]", "left [m]"),
        ("longitudinal [m]", "lateral [m]"),
        ("along [m]", "y [m]"),
    ):
        assert subject(*about, 1, labels={"p": fine}, rotation=("turns",))
    wheels = {"points": ("left", "right"), "rotation": ("turns",)}
    assert subject(*about, 1, labels={"p": ("right x [m]", "right y [m]")}, **wheels)


def test_a_model_without_labels_has_the_plain_ones(tmp_path):
    toy = line_model()
    assert pj.load(toy.save(tmp_path / "model.npz")).labels.k == ("k0", "k1")


def test_a_scene_file_can_name_them(tmp_path):
    line_model().save(robot := tmp_path / "model.npz")
    path = save_problem(tmp_path / "scene.toml", scene(), NAMED)
    assert load_problem(path).goal.n == 3
    assert asked_of(robot, path)[0].labels == NAMED
    assert load_problem(save_problem(path, load_problem(path))).labels  # it keeps them
    assert asked_of(robot, path)[0].labels == NAMED
    save_problem(path, scene())
    assert asked_of(robot, path)[0].labels == line_model().labels


@pytest.mark.parametrize("k", [NAMED.k[::-1], ("speed [km/h]", NAMED.k[1])], ids=["swap", "unit"])
def test_a_scene_file_cannot_rename_what_has_a_name(tmp_path, k):
    """Else `--given speed=0.6` would hold another parameter, or so many of another unit; and in
    Python the numbers of a file in degrees would be read as radians.
    """
    path = save_problem(tmp_path / "scene.toml", scene(), NAMED._replace(k=k))
    only_k = line_model().with_labels({"k": NAMED.k})
    only_k.save(robot := tmp_path / "model.npz")
    moved = load_problem(path).replace(obstacles=[pj.box([4, 4], [5, 5])])
    again = load_problem(save_problem(tmp_path / "again.toml", moved, only_k.labels))
    for asked in (
        lambda: asked_of(robot, path),
        lambda: require_fit(moved, only_k.claim.subject),
        *(lambda problem=x: pj.Planner(only_k).prepare(problem) for x in (moved, again)),
    ):
        with pytest.raises(InputError, match=r"\[labels\] of .*parameters") as told:
            asked()
        assert all(label in str(told.value) for label in (*NAMED.k, *k))
    assert asked_of(robot, save_problem(path, scene(), NAMED))[0].labels == NAMED
    for fine in (only_k, line_model()):
        assert pj.Planner(fine).prepare(load_problem(path)).scene.nominal.problem.labels == ()


def test_learned_models_carry_the_labels_of_their_system():
    from sims import load

    for name in ("drift_parking", "f110"):
        assert labels_of(load(name)).heading == 0
    assert labels_of(load("asv", plant="ode")).k[2] == "initial heading [rad]"


def test_an_answer_keeps_the_labels_of_its_scene(tmp_path):
    """So that what one model was refused for is refused of the answer of another."""
    scene = toy_driven.problem().replace(labels={"k": ("a [m/s]", "b [m/s]")})
    assert pj.exchange.load_problem(pj.exchange.save_problem(tmp_path / "s.toml", scene)).labels
    answer = pj.Planner(toy_driven.model()).solve(scene, jax.random.PRNGKey(0), toy_driven.SETTINGS)
    named = toy_driven.model().with_labels({"k": ("b [m/s]", "a [m/s]")})
    for asked in (scene, answer.problem):
        with pytest.raises(InputError, match=r"\[labels\] of the scene.*parameters is b"):
            pj.Planner(named).prepare(asked)
    with pytest.raises(InputError, match="labels: expected those of p, q, k"):
        scene.replace(labels={"K": ("a",)})
