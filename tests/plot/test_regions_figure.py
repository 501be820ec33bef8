"""Regions are drawn where they are, with the verdict that belongs to them."""

from types import SimpleNamespace

import numpy as np
import pytest
from drawn_bodies import bare_answer
from gap_model import HI, LO, arc_network, arc_tube, gap_problem
from toy_models import model_of, random_network, uniform_tube

import parc_jax as pj
from parc_jax.app.plot.regions import COLORS, regions, safe_regions, slices
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
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


def test_regions_are_safe_where_plans_are(arcs):
    answer, table = arcs
    safe = safe_regions(answer, table)
    with_plan = table.locate(np.r_[answer.samples[:, 2:], [[4.8, 0.1]]])
    assert set(np.flatnonzero(safe)) == set(with_plan)
    some = len(set(with_plan))
    told = [f"a safe plan found ({some})", f"no safe plan found ({table.count - some})"]
    assert words_of(regions(answer, table))[:2] == told
    known = gap_problem().replace(uncertainty=pj.Uncertainty(goal=0.01))
    about = {"nominal": query(known, answer.model).nominal(), "at": None, "box_of_k": "K"}
    uncertain = SimpleNamespace(**(vars(answer) | {"scene": SimpleNamespace(**about)}))
    title = regions(uncertain, table).axes[0].get_title("left")
    assert title.replace("\n", " ").endswith(" for all that is uncertain")


@pytest.mark.parametrize("drawn", [True, False])
def test_plans_of_the_corridors_tell_where_it_is_safe(arcs, rng, drawn):
    answer, table = arcs
    few = SimpleNamespace(**(vars(answer) | {"corridors": ()}))
    bare = safe_regions(few, table)
    k = rng.uniform(LO, HI, (500, 2))
    elsewhere = k[np.argmin(bare[table.locate(k)])]
    plan = np.concatenate([[4.5, 0.0], elsewhere])

    def sample(key, n):
        if not drawn:
            raise InputError("sample: this set is too small.")
        return np.repeat(plan[None], n, axis=0)

    known = answer.samples[0, 2:] if drawn else elsewhere
    few.corridors, few.sample = (SimpleNamespace(k=known),), sample
    changed = np.flatnonzero(safe_regions(few, table) != bare)
    assert changed.tolist() == table.locate(elsewhere[None]).tolist()


def test_regions_of_another_network_are_refused(arcs):
    answer, _ = arcs
    other = enumerate_regions(arc_network(seed=1), box(LO, HI))
    with pytest.raises(InputError, match="over its K; got others"):
        safe_regions(answer, other)


def test_regions_are_drawn_in_their_colours(arcs):
    answer, table = arcs
    left = regions(answer, table).axes[0]
    assert len(left.collections[0].get_paths()) == table.count
    shown = [tuple(np.round(255 * c[:3])) for c in left.collections[0].get_facecolors()]
    colors = [tuple(int(c[i : i + 2], 16) for i in (1, 3, 5)) for c in COLORS]
    assert shown == [colors[not safe] for safe in safe_regions(answer, table)]
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
