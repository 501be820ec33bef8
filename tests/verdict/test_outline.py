"""What belongs together: a robot and its model, told apart by all that a claim rests on."""

import re
from dataclasses import dataclass, field, replace

import jax
import numpy as np
import pytest
import toy_driven
from synthetic_plants import plant

import parc_jax as pj
from benchmarks.replays import counts_of
from parc_jax.app.study.replay import replay
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.runs.law import SAID, law_of, subject_of
from parc_jax.learning.system import TimeGrid, time_grid
from parc_jax.safe_set.verdict.outline import require_fit, require_same


@dataclass(frozen=True)
class Robot:
    """Never run. law: of its gusts."""

    name: str = "plant"
    n_p: int = 2
    n_q: int = 1
    points: tuple[str, ...] = ("reference",)
    time: TimeGrid = field(default_factory=lambda: toy_driven.model().time)
    domain: Box = field(default_factory=lambda: toy_driven.model().domain)
    law: tuple = ()
    plant: str | None = "ode"
    rotation: tuple[str, ...] | None = None
    given: tuple[str, ...] = ()
    k_labels: tuple[str, ...] | None = None
    q_labels: tuple[str, ...] | None = None
    p_labels: tuple[str, ...] | None = None


def test_the_same_robot_is_taken_on_another_plant_and_over_a_wider_k():
    require_same(plant(toy_driven.gusty, 4), toy_driven.model())
    require_same(Robot(plant="mjx"), toy_driven.model())
    require_same(Robot(domain=box([-1, -1], [2, 2])), toy_driven.model())


@pytest.mark.parametrize(
    ("other", "differs"),
    [
        (dict(name="cart"), "system is plant, beside cart"),
        (dict(n_q=2), "sizes is axes: 2, goal states: 1, .*, beside axes: 2, goal states: 2, .*"),
        (dict(n_p=3), "sizes is axes: 2, .*, beside axes: 3, .*"),
        (dict(points=("nose", "tail")), "points is .*, beside nose, tail"),
        (dict(time=time_grid(0.5, 1.0)), "time is .*, beside .*"),
        (dict(domain=box([0, 0], [1, 0.5])), "K is .*, beside .*"),
        (dict(domain=box([0, 0, 0], [1, 1, 1])), "K is .*; sizes is .*, beside .*"),
        (dict(law=(("gust", 9),)), "law: gust is not stated, beside 9"),
        (dict(given=("k0",)), "given is none, beside 0"),
        (dict(rotation=("turns",)), "rotation is none, beside heading, turns"),
        (dict(time=time_grid(0.5, 1.0)), "time is 0.25, 1, 0.05, beside 0.5, 1, 0.5"),
        (dict(name="cart", n_q=2), "system is plant, beside cart; sizes is .*, beside .*"),
    ],
)
def test_another_robot_is_refused_with_what_differs(other, differs):
    with pytest.raises(InputError, match=f"that agree; {differs}[.] Name the system"):
        require_same(Robot(**other), toy_driven.model())


NAMED = {
    "p": ("along [m]", "across [m]"),
    "q": ("psi [rad]",),
    "k": ("vx [m/s]", "vy [m/s]"),
}


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("k", ("vx [km/h]", "vy [km/h]")),
        ("k", ("vy [km/h]", "vx [km/h]")),
        ("k", ("vy [m/s]", "vx [m/s]")),
        ("k", ("vy [m/s]", "w [m/s]")),
        ("k", ("vx [rad/s]", "vy [m/s]")),
        ("q", ("psi [deg]",)),
        ("q", ("speed [m/s]",)),
        ("p", ("across [m]", "along [m]")),
        ("k", ("vx_kmh", "vy [m/s]")),
        ("k", ("Vy [m/s]", "Vx [m/s]")),
        ("k", ("a [m/s]", "vy [m/s]")),
    ],
)
def test_a_robot_in_other_units_or_of_other_quantities_is_refused(part, words):
    model = toy_driven.model().with_labels(NAMED)
    for fine in ({}, {"k_labels": NAMED["k"]}, {"q_labels": NAMED["q"]}):
        require_same(Robot(**fine), model)
    robot = Robot(**{f"{part}_labels": words})
    require_same(robot, toy_driven.model())
    with pytest.raises(InputError, match=f"premises that agree; {SAID[part]} is .*, beside"):
        require_same(robot, model)


def test_a_unit_that_one_of_the_two_alone_tells_is_refused_with_whose_is_missing():
    units, none = ("vx [m/s]", "vy [m/s]"), ("vx", "vy")
    for own, other in ((none, units), (units, none)):
        said = re.escape(f"parameters is {', '.join(other)}, beside {', '.join(own)}")
        with pytest.raises(InputError, match=said):
            require_same(Robot(k_labels=own), toy_driven.model().with_labels({"k": other}))
    require_same(Robot(k_labels=none), toy_driven.model().with_labels({"k": none}))


def test_a_plan_is_not_tested_on_a_robot_in_other_units():
    key, planner = jax.random.PRNGKey(0), pj.Planner(toy_driven.model().with_labels(NAMED))
    choice = planner.solve(toy_driven.problem(), key, toy_driven.SETTINGS).choose("room", key)
    other = plant(toy_driven.gusty, 4)
    object.__setattr__(other, "k_labels", ("vx [km/h]", "vy [km/h]"))
    with pytest.raises(InputError, match=r"parameters is vx \[m/s\], .* beside vx \[km/h\]"):
        choice.test(other, key)


def test_the_law_of_a_claim_is_compared_with_that_of_the_robot():
    model = toy_driven.model()
    windy = Robot(law=(("gust", 9),))
    law = replace(law_of(windy), k_law=model.claim.law.k_law)
    of_windy = model.replace(claim=replace(model.claim, law=law))
    require_same(windy, of_windy)
    with pytest.raises(InputError, match="law: gust is 9, beside not stated"):
        require_same(Robot(), of_windy)


def test_a_disturbance_by_the_name_of_plants_is_compared():
    model, light = toy_driven.model(), Robot(plant=None, law=(("plant", "5 kg"),))
    told = replace(model.claim.law, parameters=law_of(light).parameters)
    model = model.replace(claim=replace(model.claim, law=told))
    require_same(light, model)
    with pytest.raises(InputError, match="law: plant is 5 kg, beside 50 kg"):
        require_same(Robot(plant=None, law=(("plant", "50 kg"),)), model)
    with pytest.raises(InputError, match="plant once; got plant"):
        law_of(Robot(law=(("plant", "50 kg"),)))


@pytest.mark.parametrize("law", ["gust 0.1", [0.1], lambda: {}])
def test_a_law_that_is_no_table_is_refused_in_a_sentence(law):
    with pytest.raises(InputError, match="plant: its law: expected values by name; got"):
        law_of(Robot(law=law))


def test_a_replay_is_of_the_model_s_own_robot():
    answer, key = toy_driven.answer(), jax.random.PRNGKey(0)
    other = plant(toy_driven.gusty, 4, name="other")
    for ask in (replay, counts_of):
        with pytest.raises(InputError, match="the system of this model, 'plant', and"):
            ask(other, answer.scene, answer.samples, key)


def test_a_question_is_told_the_same_of_a_robot_and_of_its_model():
    model = toy_driven.model()
    for robot in (model, subject_of(Robot())):
        require_fit(toy_driven.problem(), robot)
        require_fit(toy_driven.problem().replace(uncertainty=pj.Uncertainty(k={0: 0.01})), robot)
        with pytest.raises(InputError, match="axis 1 has no bound"):
            A, b = np.eye(3)[[0, 0, 1, 2, 2]] * [[1], [-1], [1], [1], [-1]], np.ones(5)
            require_fit(pj.reach_avoid(pj.hpolytope(A, b), [], 0.1), robot)
        with pytest.raises(InputError, match="expected parameters of the model"):
            require_fit(
                toy_driven.problem().replace(uncertainty=pj.Uncertainty(k={"load": 0.01})), robot
            )
        robot = robot.with_labels({"k": ("vx [m/s]", "vy [m/s]")})
        for off in ({"k": {"vx [m/s]": 0.01}}, {"unknown": {"vy": (0.5, 0.6)}}):
            asked = toy_driven.problem().replace(uncertainty=pj.Uncertainty(**off))
            require_fit(asked, robot)
        for off in ({"k": {"vx [km/h]": 0.01}}, {"unknown": {"vy [km/h]": (0.5, 0.6)}}):
            asked = toy_driven.problem().replace(uncertainty=pj.Uncertainty(**off))
            with pytest.raises(InputError, match=r"model \(vx \[m/s\], vy \[m/s\]\), .*km/h"):
                require_fit(asked, robot)
