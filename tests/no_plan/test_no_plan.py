"""No safe plan: every reason, the two verdicts, the certificates and what happens when they are
wrong.
"""

import copy
from fractions import Fraction

import numpy as np
import pytest
from toy_models import line_model, model_of, random_network, told

from parc_jax import checker
from parc_jax import method as methods
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.common.status import Status
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.learning.network.predict import trajectories
from parc_jax.planner import Planner
from parc_jax.problem.body import Polygon
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.absence.errors import WithinWidths
from parc_jax.proof.absence.prove_no_plan import _missing, goal_faces, prove_no_plan
from parc_jax.proof.absence.reasons import Contacts, DiscBody
from parc_jax.proof.certificate.write import network_part, problem_part, tube_part
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.infeasible import no_end_fits
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

GOAL = ((3.0, -0.5, -1.0), (4.0, 0.5, 1.0))  # over (z, q); q = k_0
FAR = [box([50, 50], [51, 51]), box([-51, 50], [-50, 51])]


def walls(gap):
    """Two blocks beside the goal, `gap` apart in y, and a disc of radius 0.25."""
    blocks = [box([2, gap / 2], [5, gap / 2 + 2]), box([2, -gap / 2 - 2], [5, -gap / 2])]
    return reach_avoid(box(*GOAL), blocks, 0.25)


def decide(model, problem, **options):
    options = {"limit": Limit(300), "max_leaves": 400} | options
    return prove_no_plan(scene_of(problem, model), **options)


def check(model, problem, plan):
    """The independent checker on a certificate; raises Rejected."""
    context = checker.Context(
        problem_part(problem, model), network_part(model.net), tube_part(model.tube)
    )
    with checker.rejecting():
        return checker.check_no_plan(context, plan)


def named(node):
    """(reason, what) of a node, however it is proved."""
    ((name, what),) = node.items()
    return named(what) if name == "bounded" else (name, what)


def reasons(plan):
    return {named(node)[0] for node in plan["tree"]}


@pytest.mark.parametrize(
    ("reason", "problem"),
    [
        ("goal", reach_avoid(box((3, -0.5, 2.0), (4, 0.5, 3.0)), FAR, 0.25)),
        pytest.param(
            "start",
            reach_avoid(box(*GOAL), FAR, 0.25, start=box([20, 20], [21, 21])),
            marks=pytest.mark.slow,
        ),
        ("hit", reach_avoid(box(*GOAL), [box([2.9, -0.6], [4.1, 0.6]), FAR[0]], 0.25)),
    ],
)
def test_each_reason_proves_alone(reason, problem):
    model = line_model(e=0.05)
    answer = decide(model, problem)
    assert answer.kind == "proved" and reason in reasons(answer.certificate)
    assert answer.undecided == 0 and answer.unsafe == answer.total
    assert check(model, problem, answer.certificate)["kind"] == "proved"
    assert answer.details().startswith("Proved")


@pytest.mark.slow
def test_a_start_set_that_leaves_a_sliver_is_not_proved_away():
    """Starts at x <= -3 + k_0 / ... exist: the plan is handed over and the point test accepts
    it.
    """
    model = line_model(e=0.05)
    problem = reach_avoid(box(*GOAL), FAR, 0.25, start=box([2.0, -2.0], [2.2, 2.0]))
    answer = decide(model, problem)
    assert answer.kind == "undecided" and answer.safe_plan is not None
    p0, k = answer.safe_plan
    assert verdicts(scene_of(problem, model), p0[None], k[None]).safe.all()


def test_verdicts_switch_once_as_the_gap_widens():
    """Body 2 x 0.25 and error 2 x 0.05: nothing fits below 0.6, at 0.6 it touches, above plans
    exist.
    """
    model = line_model(e=0.05)
    kinds = {}
    for gap in (0.2, 0.5, 0.59, 0.599, 0.6, 0.61, 0.7, 1.2):
        answer = decide(model, walls(gap), max_leaves=200)
        kinds[gap] = "safe" if answer.safe_plan else answer.kind
        assert answer.certificate is not None
        assert answer.unsafe + answer.undecided == answer.total
    assert [kinds[g] for g in (0.2, 0.5, 0.59, 0.599)] == ["proved"] * 4
    assert (
        kinds[0.6] == "undecided"
    )  # only in a set of volume zero does nothing clear: no box shows it
    assert [kinds[g] for g in (0.61, 0.7, 1.2)] == ["safe"] * 3


def test_out_of_budget_the_rest_is_undecided_and_the_certificate_says_so():
    model, problem = line_model(e=0.05), walls(0.6)
    answer = decide(model, problem, max_leaves=20)
    report = check(model, problem, answer.certificate)
    assert answer.kind == "undecided" and report["kind"] == "bracket"
    assert Fraction(report["undecided"]) == answer.undecided > 0
    assert "not a proof" in answer.details()
    untouched = decide(model, problem, limit=Limit(0.0))
    assert untouched.undecided == untouched.total and untouched.leaves == 1


def test_goal_without_room_is_proved():
    """A slanted goal narrower than the error: the box of z is opened up and all of it misses."""
    model = line_model(e=0.05, final=0.3)
    rows = [[1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0], [0, 0, 1], [0, 0, -1]]
    problem = reach_avoid(hpolytope(rows, [3.5, -3.4, 4, 4, 1, 1]), FAR, 0.25)
    answer = decide(model, problem)
    assert answer.kind == "proved" and reasons(answer.certificate) <= {"goal", "split"}
    assert answer.reason is None  # its box is wide enough: no axis tells


@pytest.mark.parametrize(
    ("final", "kind", "words"),
    [
        (
            [[0.3, 0.1, 0.1]],
            "proved",
            "its x is 0.5 wide, and the error there is bounded by no less than ±0.3.",
        ),
        ([[0.3, 0.1, 0.1], [0.1, 0.3, 0.1]], None, "along some axis"),
        ([[np.inf] * 3], "undecided", "no plan keeps to bins of K that have a claim"),
        ([[0.3, 0.1, 0.1], [0.2, 0.1, 0.1]], "undecided", None),
    ],
)
def test_the_reason_is_said_where_a_sentence_can_say_it(final, kind, words):
    line, final = line_model(e=0.01), np.array(final)
    interval = np.where(np.isinf(final[:, :1, None]), np.inf, np.full((len(final), 4, 2), 0.4))
    model = model_of(
        line.net, line.domain, interval, final, [np.linspace(-1, 1, len(final) + 1), [-1.0, 1.0]]
    )
    answer = decide(model, reach_avoid(box([0, 0, -1], [0.5, 0.5, 1]), FAR, 0.1), max_leaves=100)
    assert kind in (None, answer.kind)
    assert answer.reason is None if words is None else words in answer.details()


def test_the_reason_is_about_all_faces_together_and_not_about_one_frame():
    """Each frame alone allows 0.5 along x, all faces together 0.25: a goal 0.7 wide is no
    reason.
    """
    line = line_model(e=0.01)
    slanted = [[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    ends = np.concatenate([np.eye(3), slanted])[None]
    at_end = faces(ends, np.zeros((1, 6)), [[0.5, 0.05, 0.1, 0.2, 0.9, 0.1]], frames=True)
    shape = (1, line.time.n_steps, 1, 2)
    during = faces(np.broadcast_to(np.eye(2), (*shape, 2)), np.zeros(shape), np.full(shape, 1.0))
    model = told(line, tube=fitted_tube(line.tube.edges, during, at_end))
    for width, words in ((0.7, None), (0.4, "its x is 0.4 wide")):
        problem = reach_avoid(box([0, -1, -1], [width, 1, 1]), FAR, 0.1)
        said = no_end_fits(scene_of(problem, model))
        assert said is None if words is None else words in said and "±0.25" in said


def test_faces_of_a_slanted_goal_are_exact_and_enclose_it(rng):
    turn = np.array([[0.8, 0.6, 0.1], [-0.6, 0.8, -0.2], [0.1, 0.05, 1.0]])
    goal = hpolytope(np.concatenate([turn, -turn]), [2.0, 1.0, 0.5, 1.5, 1.0, 0.5])
    model, problem = line_model(e=0.05), reach_avoid(goal, FAR, 0.25)
    lo, hi, faces = goal_faces(problem, model)
    for axis, pair in enumerate(faces):
        for sign, used in zip((-1, 1), pair, strict=True):
            m = [Fraction(v) for _, v in used]
            combined = [
                sum(v * Fraction(goal.A[r, j]) for (r, _), v in zip(used, m, strict=True))
                for j in range(3)
            ]
            assert min(m) > 0 and combined == [sign * (j == axis) for j in range(3)]
    y = np.linalg.solve(turn, rng.uniform([-1.4, -0.9, -0.4], [1.9, 0.9, 0.4], (500, 3)).T).T
    assert ((y[:, :2] > lo) & (y[:, :2] < hi)).all()
    assert decide(model, problem).certificate is not None


@pytest.mark.parametrize("body", [0.3, Polygon(np.array([[0.4, 0.0], [-0.2, 0.3], [-0.3, -0.25]]))])
def test_contacts_hold_exactly_wherever_the_grown_obstacle_is(rng, body):
    """Random points of a thin obstacle grown by body and error: contacts are found and hold in
    fractions.
    """
    obstacle = hpolytope([[1, 2], [-1, -2], [2, -1], [-2, 1]], [0.02, 0.02, 1.5, 1.0])
    contacts = Contacts(reach_avoid(box(*GOAL), [obstacle], body), 0)
    error = np.array([0.05, 0.1])
    within = WithinWidths(error[None], np.ones(1))
    corners = contacts.corners
    inside = rng.dirichlet(np.ones(len(corners)), 60) @ corners
    if isinstance(body, Polygon):
        moved = rng.dirichlet(np.ones(3), 60) @ body.vertices
    else:
        angle = rng.uniform(0, 2 * np.pi, (60, 1))
        moved = (
            0.3
            * np.sqrt(rng.uniform(0, 1, (60, 1)))
            * np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
        )
    p = inside - 0.999 * moved - 0.999 * rng.uniform(-error, error, (60, 2))
    for group in np.split(p, 12):
        entries = contacts.find(group, within)
        assert entries is not None
        for point in group:
            assert any(_touches(obstacle, body, point, error, *entry) for entry in entries)
    assert contacts.find(np.array([[5.0, 5.0]]), within) is None


def _touches(obstacle, body, p, error, spelled, shifts):
    (shift,) = shifts
    shift = [checker.number(v) for v in shift]
    assert all(abs(s) <= Fraction(float(e)) for s, e in zip(shift, error, strict=True))
    part = [checker.number(v) for v in spelled]
    if isinstance(body, Polygon):
        assert min(part) >= 0 and sum(part) == 1
        part = [
            sum(w * Fraction(v[j]) for w, v in zip(part, body.vertices, strict=True))
            for j in range(2)
        ]
    else:
        assert sum(v * v for v in part) <= Fraction(body) ** 2
    x = [Fraction(float(p[j])) + part[j] + shift[j] for j in range(2)]
    rows = zip(obstacle.A, obstacle.b, strict=True)
    return all(
        sum(Fraction(a) * v for a, v in zip(row, x, strict=True)) <= Fraction(b) for row, b in rows
    )


def test_tampered_certificates_are_rejected():
    model, problem = line_model(e=0.05), walls(0.59)
    plan = decide(model, problem).certificate
    hits = [i for i, node in enumerate(plan["tree"]) if named(node)[0] == "hit"]
    splits = [i for i, node in enumerate(plan["tree"]) if "split" in node]
    assert hits and splits

    def first_hit(c):
        return named(c["tree"][hits[0]])[1]

    def tampered():
        for edit in (
            lambda c: c["z"]["lo"].__setitem__(1, "0.0"),
            lambda c: c["faces"].reverse(),
            lambda c: c["faces"][0].reverse(),
            lambda c: c["tree"].pop(),
            lambda c: c["tree"].append(c["tree"][-1]),
            lambda c: c["tree"][splits[0]]["split"].__setitem__(1, "0.4"),
            lambda c: c["tree"].__setitem__(hits[0], {"open": None}),
            lambda c: c["tree"].__setitem__(hits[0], {"goal": [[0, "1"]]}),
            lambda c: c["tree"].__setitem__(hits[0], c["tree"][hits[-1]]),
            lambda c: first_hit(c).__setitem__(0, 1 - first_hit(c)[0]),
            lambda c: first_hit(c).__setitem__(1, 1),
            lambda c: first_hit(c).__setitem__(4, []),
            lambda c: first_hit(c)[4][0].__setitem__(0, ["1/2"]),
            lambda c: first_hit(c)[4][0][1][0].__setitem__(1, [["0.0", "0.051"]]),
            lambda c: first_hit(c)[4][0][1][0].__setitem__(0, ["0.0", "0.2500001"]),
        ):
            changed = copy.deepcopy(plan)
            edit(changed)
            yield changed

    assert check(model, problem, plan)["kind"] == "proved"
    for changed in tampered():
        with pytest.raises(checker.Rejected):
            check(model, problem, changed)
    with pytest.raises(checker.Rejected):
        check(model, walls(0.61), plan)  # the same proof about another scene


def test_a_search_that_errs_is_caught_by_the_checker(monkeypatch):
    """Mutant: a scene whose robot is too large. What it proves is refused, and all is undecided."""
    model, problem = line_model(e=0.05), walls(0.7)
    grown = scene_of(problem, model)
    grown = grown.replace(
        obstacles=grown.obstacles.replace(radius=np.full(len(grown.obstacles.radius), 0.4))
    )
    answer = prove_no_plan(grown, limit=Limit(300), max_leaves=200)
    # no contact of the true disc reaches: nothing false is even written
    assert answer.kind == "undecided"
    monkeypatch.setattr(DiscBody, "spell", lambda self, x: [float(v).hex() for v in 1.6 * x])
    monkeypatch.setattr(Contacts, "_depth", lambda self, x: np.ones(x.shape[:-1]))
    answer = prove_no_plan(grown, limit=Limit(300), max_leaves=200)
    assert (
        answer.kind == "undecided"
        and answer.certificate is None
        and answer.undecided == answer.total
    )


def test_planner_says_which_of_the_two_is_true(tmp_path, monkeypatch):
    import jax

    model = line_model(e=0.05)
    patient = Settings(target=0.3, budget_s=300)
    answer = Planner(model).solve(walls(0.59), jax.random.key(0), patient)
    assert (
        not answer.status.found
        and answer.absence.kind == "proved"
        and answer.details().startswith("Proved")
    )
    report = checker.check_answer(checker.load(answer.save(tmp_path / "answer.json")))
    assert report.no_plan["kind"] == "proved" and report.samples == report.sets == 0
    narrow = Planner(model).solve(walls(0.6001), jax.random.key(0), patient)
    assert narrow.corridors and narrow.status is Status.PROVED
    assert narrow.absence is None  # no draw was safe, a climb found some
    with monkeypatch.context() as blind:
        blind.setattr(methods, "where_safe", lambda *asked, **options: None)
        narrow = Planner(model).solve(walls(0.6001), jax.random.key(0), patient)
    assert narrow.corridors and narrow.status is Status.PROVED
    assert narrow.absence.kind == "undecided"  # the proof that none is there came across one
    report = checker.check_answer(checker.load(narrow.save(tmp_path / "narrow.json")))
    assert report.samples and report.no_plan["kind"] == "bracket"
    easy = Planner(model).solve(walls(1.2), jax.random.key(0), patient)
    assert easy.status.found and easy.absence is None


def buried(n_k):
    """A model of n_k parameters, and a problem whose goal lies inside of an obstacle."""
    net = random_network(np.random.default_rng(0), 4, hidden=(6, 5), n_k=n_k)
    model = model_of(
        net, box(-np.ones(n_k), np.ones(n_k)), np.full((1, 4, 2), 0.05), np.full((1, 3), 0.05)
    )
    return model, reach_avoid(box((3, -0.5, -100), (4, 0.5, 100)), [box((-50, -50), (50, 50))], 0.1)


@pytest.mark.night
def test_with_too_many_parameters_for_cells_there_is_a_proof_by_bounds(tmp_path):
    """Cells are listed for up to six parameters."""
    import jax

    model, problem = buried(8)
    answer = Planner(model).solve(problem, jax.random.key(0), Settings())
    assert not answer.status.found and answer.absence.kind == "proved"
    assert {"bounded"} <= {name for node in answer.absence.certificate["tree"] for name in node}
    report = checker.check_answer(checker.load(answer.save(tmp_path / "answer.json")))
    assert report.no_plan["kind"] == "proved" and report.samples == 0


@pytest.mark.night
def test_with_too_many_parameters_for_the_checker_the_answer_is_not_found():
    import jax

    model, problem = buried(9)
    answer = Planner(model).solve(problem, jax.random.key(0), Settings())
    assert not answer.status.found and answer.absence.kind == "undecided"
    assert answer.absence.undecided == answer.absence.total
    assert "touches obstacle 0" in answer.details()  # said of the scene, whatever the model
    assert answer.details().startswith("No plan is safe: ")
    assert _missing(model) == "a model with at most 8 parameters; this model has 9"


@pytest.mark.slow
def test_a_wall_across_eight_parameters_is_proved(rng):
    """Bounds are loose over all of K: the proof splits k, and only at a wall that all cross."""
    model, _ = buried(8)
    offsets = trajectories(model.net, model.layout, rng.uniform(-1, 1, (2000, 8)))[0][:, :, 0]
    start = 3.0 - offsets[:, -1].max() - 1, 4.0 - offsets[:, -1].min() + 1
    problem = reach_avoid(
        box((3, -0.5, -100), (4, 0.5, 100)),
        [box((start[0] - 9, -99), (start[1] + 9, 99))],
        0.1,
    )
    answer = decide(model, problem, max_leaves=5000)
    assert answer.kind == "proved"
    assert check(model, problem, answer.certificate)["kind"] == "proved"


@pytest.mark.slow
def test_a_proof_beyond_the_limits_of_the_checker_is_refused_in_words():
    import jax

    model, _ = buried(9)
    problem = reach_avoid(box((3, -0.5, -100), (4, 0.5, 100)), [], 0.1)
    with pytest.raises(InputError, match="limits of the exact checker"):
        Planner(model).solve(problem, jax.random.key(0), Settings(samples=1, samples_only=True))
    unproved = Settings(samples=1, samples_only=True, proof=False)
    found = Planner(model).solve(problem, jax.random.key(0), unproved)
    assert found.status.found


@pytest.mark.slow
def test_boxes_with_too_many_cells_are_split_first(rng):
    """A wide network whose ends only just do not come from the start set: bounds over all of K are
    too loose, and no call has room for all its cells, so the first boxes are halved unseen.
    """
    net = random_network(rng, 4, hidden=(40,))
    model = model_of(net, box([-1, -1], [1, 1]), np.full((1, 4, 2), 0.01), np.full((1, 3), 0.01))
    ends = trajectories(net, model.layout, rng.uniform(-1, 1, (20_000, 2)))[0][:, -1]
    first = 3.0 - ends[:, 0].max()
    start = box([first - 9, -99], [first - 0.05, 99])
    problem = reach_avoid(box((3, -0.5, -50), (4, 0.5, 50)), FAR, 0.25, start=start)
    answer = decide(model, problem)
    assert answer.kind == "proved" and answer.leaves > 1
    assert "start" in {name for node in answer.certificate["tree"] for name in node}
