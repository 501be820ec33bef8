"""The nominal path of a plan: that of the network, with the tube of every bin that holds k."""

import csv

import jax
import numpy as np
import pytest
from toy_models import fold_model, line_model, told, toy_case
from toy_query import answer

import parc_jax as pj
from parc_jax.answer.path import nominal_path
from parc_jax.common.errors import InputError
from parc_jax.learning.labels import labels
from parc_jax.learning.system import TURNS

pytestmark = pytest.mark.slow  # kernels of its own: of the gate


def test_the_path_of_a_plan_is_known_in_closed_form():
    """The folding model: c_t = (t / T) (k_0, |k_1|), q = k_0."""
    path = answer().path([0.5, -0.25], [0.75, -0.5])
    share = np.arange(5) / 4
    assert path.times.tolist() == share.tolist() and path.points == answer().model.points
    assert path.places.shape == (5, 1, 2)
    assert (path.places[:, 0] == np.outer(share, [0.75, 0.5]) + np.array([0.5, -0.25])).all()
    assert path.q.tolist() == [0.75] and path.q_error.tolist() == [0.02]
    assert (path.tube == 0.02).all() and path.tube.shape == (4, 1, 2)
    assert path.tube_at_end.tolist() == [[0.02, 0.02]]


def test_on_an_edge_the_wider_bin_counts():
    model, _ = toy_case(0)
    path = nominal_path(model, np.zeros(2), np.zeros(2))
    assert (path.tube[:, 0] == model.tube.interval.max(axis=0)).all()
    assert (path.tube_at_end[0] == model.tube.final.max(axis=0)[:2]).all()


def test_tables_hold_the_numbers_exactly(tmp_path):
    path = answer().path(*np.split(answer().samples[0], 2))
    with open(path.save(tmp_path / "path.csv")) as file:
        head, *rows = csv.reader(file)
    assert head == ["time [s]", "x [m]", "y [m]", "+-x [m]", "+-y [m]", "q0", "+-q0"]
    assert (
        np.array([row[:5] for row in rows], float).tolist()
        == np.column_stack(
            [
                path.times,
                path.places[:, 0],
                np.concatenate([path.tube, path.tube_at_end[None]])[:, 0],
            ]
        ).tolist()
    )
    assert [row[5:] for row in rows[:-1]] == [["", ""]] * 4
    assert [float(x) for x in rows[-1][5:]] == [path.q[0], path.q_error[0]]
    with pytest.raises(InputError, match=r"path: expected a file \.csv"):
        path.save(tmp_path / "path.txt")


def test_without_a_claim_the_tube_is_endless(tmp_path):
    endless = fold_model(T=4, e=np.inf)
    path = nominal_path(endless, np.zeros(2), np.zeros(2))
    assert np.isinf(path.tube).all()
    assert path.to_csv().splitlines()[1].endswith("inf,inf,,")


@pytest.mark.parametrize("at", [None, (0.0, 0.0), (0.0, 0.0, 0.3)])
def test_a_table_says_what_it_leaves_out_and_in_whose_frame_it_is(at):
    named = {"p": ("east [m]", "north [m]"), "q": ("yaw [rad]",)}
    model = told(line_model(4, 0.02), rotation=(TURNS,)).with_labels(named)
    problem = pj.reach_avoid(pj.box([-2, -2, -2], [2, 2, 2]), [], 0.1)
    settings = pj.Settings(samples=3, target=0.3)
    heads = []
    for start in (0.0, 0.05):
        asked = problem.replace(uncertainty=pj.Uncertainty(start=start))
        one = pj.Planner(model).solve(asked, jax.random.PRNGKey(0), settings, at=at)
        plans = one.samples[:, :2], one.samples[:, 2:]
        assert one.contains(*plans).any()
        if at is not None:  # elsewhere nothing is said: of other places the set is not
            assert not one.contains(plans[0] + 1e-9, plans[1]).any()
        heads.append(one.path(*np.split(one.samples[0], [2])).to_csv().split("\n")[0])
    frame = " in the robot's frame" * (len(at or ()) == 3)
    ends = f"time [s],east{frame} [m],north{frame} [m]"
    assert (
        heads[0]
        == f"{ends},+-east{frame} [m],+-north{frame} [m],yaw{frame} [rad],+-yaw{frame} [rad]"
    )
    assert heads[1].startswith(f"{ends},+-east{frame} of the tube alone [m]")
    assert heads[1].endswith(f"yaw{frame} [rad],+-yaw{frame} of the tube alone [rad]")


def test_points_have_their_names():
    model = fold_model(T=4)
    one = nominal_path(model, np.zeros(2), np.zeros(2))
    named = labels(2, 1, 2, q=("yaw [rad]",))
    places = np.concatenate([one.places] * 2, axis=1)
    halves = np.concatenate([one.tube] * 2, axis=1), np.concatenate([one.tube_at_end] * 2)
    several = type(one)(
        one.times, places, one.q, *halves, one.q_error, ("nose", "tail"), named
    ).to_csv()
    assert several.startswith(
        "time [s],x of nose [m],y of nose [m],x of tail [m],y of tail [m],+-x"
    )


@pytest.mark.parametrize(
    ("p0", "k", "sentence"),
    [
        ([0, 0], [1.5, 0], r"path: expected a plan with k in \[-1, 1\] x \[-1, 1\], .* 1.5, 0"),
        ([0, 0], [np.nan, 0], "path: expected a plan with k in"),
        ([np.inf, 0], [0, 0], "path: expected a plan with k in"),
        ([0, 0, 0], [0, 0], "path: expected p0"),
        ([[0, 0]] * 2, [[0, 0]] * 2, "path: expected one plan; got 2"),
        ("here", [0, 0], "path: expected numbers"),
    ],
)
def test_what_is_no_plan_of_the_model_is_refused(p0, k, sentence):
    with pytest.raises(InputError, match=sentence):
        answer().path(p0, k)
