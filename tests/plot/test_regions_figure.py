"""Regions are drawn where they are, with the verdict that belongs to them."""

from types import SimpleNamespace

import jax
import numpy as np
import pytest
from drawn_bodies import bare_answer
from gap_model import HI, LO, arc_network, arc_tube, gap_problem
from toy_models import model_of, random_network, uniform_tube

import parc_jax as pj
from parc_jax.app.plot.regions import COLORS, region_verdicts, regions, slices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.status import OfRegion
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.problem.robust.nominal import query
from parc_jax.proof.regions.subdivide import enumerate_regions
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.fixture(scope="module")
def arcs():
    """Model of arcs, its regions, and an answer with two samples and one corridor."""
    tube = arc_tube()
    model = model_of(arc_network(), box(LO, HI), tube.interval, tube.final)
    table = enumerate_regions(model.net, model.domain)
    samples = np.array([[4.5, 0.0, 5.0, 0.05], [4.6, 0.0, 5.2, -0.05]])
    return SimpleNamespace(
        model=model,
        problem=gap_problem(),
        samples=samples,
        corridors=(SimpleNamespace(k=np.array([4.8, 0.1])),),
        sample=lambda key, n: samples,
        scene=scene_of(gap_problem(), model),
    ), table


def words_of(drawn) -> list[str]:
    return [text.get_text().replace("\n", " ") for text in drawn.legends[0].get_texts()]


def test_verdicts_are_safe_where_plans_are_and_unreachable_only_where_no_k_reaches(arcs, rng):
    answer, table = arcs
    verdict = region_verdicts(answer, table)
    assert set(np.flatnonzero(verdict == OfRegion.SAFE)) == set(
        table.locate(np.r_[answer.samples[:, 2:], [[4.8, 0.1]]])
    )
    k = rng.uniform(LO, HI, (4000, 2))
    x = k
    for W, b in zip(answer.model.net.weights[:-1], answer.model.net.biases[:-1], strict=True):
        x = np.maximum(x @ W.T + b, 0)
    heading = (x @ answer.model.net.weights[-1].T + answer.model.net.biases[-1])[:, -1]
    reaches = (
        np.abs(heading) <= 0.25 - answer.model.tube.final[0, 2]
    )  # p0 is free, so only the heading can fail
    region = table.locate(k)
    assert not np.isin(region[reaches], np.flatnonzero(verdict == OfRegion.UNREACHABLE)).any()
    lost = [
        r
        for r in np.unique(region)
        if verdict[r] == OfRegion.NOT_FOUND and (region == r).sum() > 50
    ]
    assert all(reaches[region == r].any() for r in lost)
    assert {OfRegion.SAFE, OfRegion.UNREACHABLE} <= set(verdict)
    # of the tube too: runs from such a region may reach the goal
    missed = (verdict == OfRegion.UNREACHABLE).sum()
    drawn = regions(answer, table)
    assert words_of(drawn)[2] == f"no plan with this tube, in float64 ({missed})"
    # a region that misses a goal less its error may have plans: none is shown to withstand it
    known = gap_problem().replace(uncertainty=pj.Uncertainty(goal=0.01))
    about = {"nominal": query(known, answer.model).nominal(), "at": None, "box_of_k": "K"}
    uncertain = SimpleNamespace(**(vars(answer) | {"scene": SimpleNamespace(**about)}))
    drawn = regions(uncertain, table)
    assert "can be shown to withstand what is uncertain, in float64 (" in words_of(drawn)[2]
    assert drawn.axes[0].get_title("left").replace("\n", " ").endswith(" for all that is uncertain")


def test_a_goal_is_out_of_reach_by_the_errors_that_the_verdict_has():
    """A heading that is off by 0.05 to 0.15 rad, never about zero: the box around it about the
    model is twice as wide as the goal allows, and every region has safe plans.
    """
    share = np.linspace(0.25, 1.0, 4)
    split = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
    ways = [*np.concatenate([s * split for s in share]), [0.0, 0.0, -0.2, -0.2]]
    first = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    net = pj.learning.relu_network([first, np.array(ways)], [np.zeros(4), np.zeros(9)])
    square = np.broadcast_to(np.eye(2), (1, 4, 1, 2, 2))
    during = faces(square, np.zeros((1, 4, 1, 2)), np.full((1, 4, 1, 2), 0.02), False)
    to_one_side = np.array([[0.0, 0.0, 0.1]]), np.array([[0.02, 0.02, 0.05]])
    at_end = faces(np.eye(3)[None], *to_one_side, True)
    tube, time = fitted_tube([[-1.0, 1.0]] * 2, during, at_end), pj.learning.time_grid(0.25, 1.0)
    claim = pj.learning.declared_claim(tube, "this test says so", net, time)
    model = pj.learning.trajectory_model(net, claim)
    goal = pj.box([0.0, -0.5, -0.14], [1.0, 0.5, 0.14])
    asked = pj.reach_avoid(goal, [pj.box([5.0, 5.0], [6.0, 6.0])], 0.1)
    settings = pj.Settings(samples=1, method=pj.types.FirstProved())
    answer = pj.Planner(model).solve(asked, jax.random.key(0), settings)
    verdict = region_verdicts(answer, enumerate_regions(net, model.domain))
    assert len(verdict) == 4 and not (verdict == OfRegion.UNREACHABLE).any()


@pytest.mark.parametrize("drawn", [True, False])
def test_plans_of_the_corridors_tell_where_it_is_safe(arcs, rng, drawn):
    answer, table = arcs
    few = SimpleNamespace(**(vars(answer) | {"corridors": ()}))
    bare = region_verdicts(few, table)
    k = rng.uniform(LO, HI, (500, 2))
    elsewhere = k[np.argmax(bare[table.locate(k)] != OfRegion.SAFE)]
    plan = np.concatenate([[4.5, 0.0], elsewhere])

    def sample(key, n):
        if not drawn:
            raise InputError("sample: this set is too small.")
        return np.repeat(plan[None], n, axis=0)

    known = answer.samples[0, 2:] if drawn else elsewhere
    few.corridors, few.sample = (SimpleNamespace(k=known),), sample
    changed = np.flatnonzero(region_verdicts(few, table) != bare)
    assert changed.tolist() == table.locate(elsewhere[None]).tolist()


def test_regions_of_another_network_are_refused(arcs):
    answer, _ = arcs
    other = enumerate_regions(arc_network(seed=1), box(LO, HI))
    with pytest.raises(InputError, match="over its K; got others"):
        region_verdicts(answer, other)


def test_regions_are_drawn_in_their_colours(arcs):
    answer, table = arcs
    left = regions(answer, table).axes[0]
    assert len(left.collections[0].get_paths()) == table.count
    shown = [tuple(np.round(255 * c[:3])) for c in left.collections[0].get_facecolors()]
    colors = [tuple(int(c[i : i + 2], 16) for i in (1, 3, 5)) for c in COLORS]
    assert shown == [colors[v] for v in region_verdicts(answer, table)]
    assert left.get_xlabel() == answer.model.labels.k[0]


def test_slices_of_three_parameters_tile_the_plane(rng):
    net = random_network(rng, T=2, hidden=(5,), n_k=3)
    table = enumerate_regions(net, box([-1, -1, -1], [1, 1, 1]))
    numbers, outlines = slices(table, (0, 2), np.array([0.0, 0.3, 0.0]))
    nexts = [np.roll(o, -1, axis=0) for o in outlines]
    areas = [
        0.5 * (o[:, 0] * n[:, 1] - o[:, 1] * n[:, 0]).sum()
        for o, n in zip(outlines, nexts, strict=True)
    ]
    assert sum(areas) == pytest.approx(4.0, abs=1e-6)
    for number, outline in zip(numbers, outlines, strict=True):
        middle = outline.mean(axis=0)
        assert int(table.locate(np.array([middle[0], 0.3, middle[1]]))) == number
    model = model_of(net, table.domain, *uniform_tube(2))
    problem = pj.reach_avoid(pj.box([-0.5, -0.5, -1.0], [0.5, 0.5, 1.0]), [], 0.1)
    answer = bare_answer(model, problem, np.zeros((0, 5)))
    answer.corridors = ()
    drawn = regions(answer, table, axes=(0, 2), at=np.array([0.0, 0.3, 0.0]))
    assert "cut at k1 = 0.3" in drawn.axes[0].get_title("left")
