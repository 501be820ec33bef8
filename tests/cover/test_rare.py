"""Safe sets that uniform draws never hit: a slit between two blocks, known by its width."""

import re

import jax
import numpy as np
import pytest
from toy_models import line_model

import parc_jax as pj
from parc_jax.app.cli.scene import verdict
from parc_jax.common.errors import InputError
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.safe_set.corridors.rare import where_safe
from parc_jax.safe_set.corridors.sampling import Place, draw
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.scene import pruned_scene

pytestmark = [pytest.mark.soundness, pytest.mark.slow]  # kernels of its own: of the gate
MODEL = line_model(T=8, half=2.0)
HALF = 1e-4  # [m] of the slit: a share of 3e-10 of all plans is safe


def slit(half: float = HALF):
    """Straight lines from the left of two blocks to their right, through a slit of width 2 half
    about y = 0.1.
    """
    goal = pj.box([0.6, -1.0, -2.0], [1.0, 1.0, 2.0])
    start = pj.box([-1.6, -0.5], [-1.1, 0.5])
    blocks = [pj.box([-0.5, 0.1 + half], [0.5, 3.0]), pj.box([-0.5, -3.0], [0.5, 0.1 - half])]
    return pj.reach_avoid(goal, blocks, 1e-4 * abs(half), start=start)


def volume(half: float) -> float:
    """Of the safe set in a place that was found, from 200,000 draws in it."""
    scene = pruned_scene(NominalProblem(slit(half), MODEL))
    rng = np.random.default_rng(1)
    one = draw(scene, rng, 200_000, where_safe(scene, rng, 1, Limit(300.0)))
    assert len(one.safe.k) > 5000
    return one.volume * len(one.safe.k) / one.drawn


@pytest.fixture(scope="module")
def answer():
    settings = pj.Settings(samples=20, target=0.05, budget_s=300)
    return pj.Planner(MODEL).solve(slit(), jax.random.PRNGKey(0), settings)


def test_a_set_of_share_1e_10_is_covered_like_any_other(answer):
    assert answer.status is pj.types.Status.PROVED and answer.coverage.at_least >= 0.95
    assert len(answer.samples) == 20 and answer.share.volume[0] < 1e-8
    assert "around what a search found" in repr(answer)
    assert "Plans were drawn in a place alone" in answer.details()
    assert "beyond nothing is known" in answer.details()
    n_p = MODEL.n_p
    for plan in answer.samples:  # the line y(x) of each stays in the slit, beside the blocks
        x = np.array([-0.5, 0.5])
        y = plan[1] + (x - plan[0]) / plan[n_p] * plan[n_p + 1]
        assert (np.abs(y - 0.1) < HALF).all()


def test_what_is_printed_does_not_speak_of_all_of_the_safe_set(answer, tmp_path):
    said = verdict(answer, tmp_path / "answer.json")
    example = said.partition("For example: ")[2].partition("\n")[0]
    told = [float(x) for x in re.findall(r" = (\S+?)[, .]*(?: |$)", example)]
    assert told == answer.samples[0].tolist()  # the plan that is proved, to its last digit
    assert "of the plans whose first point ends in the goal's box, whatever else" in said
    assert "those around what a search found" in said and "end in the goal whatever" not in said
    assert said.count("% of the safe set under an assumed tube around what a search found") == 1
    assert "goal-reaching set" not in said and answer.cover.within is not None


def test_what_was_drawn_from_is_in_the_file(answer, tmp_path):
    again = pj.load_answer(answer.save(tmp_path / "answer.json"))
    assert (
        again.details().startswith(answer.details()) and again.share.volume == answer.share.volume
    )
    known = answer.samples[0]
    method = pj.types.Exact(around=(known[: MODEL.n_p], known[MODEL.n_p :]))
    settings = pj.Settings(samples=5, target=0.2, budget_s=300, method=method)
    corridors = pj.Planner(MODEL).solve(slit(), jax.random.PRNGKey(3), settings)
    read = pj.load_answer(corridors.save(tmp_path / "corridors.json"))
    drawn = read.sample(jax.random.PRNGKey(4), 6)
    assert (drawn == corridors.sample(jax.random.PRNGKey(4), 6)).all()


def test_no_part_of_a_thin_set_is_left_out():
    """Two of its four sides shrink with the slit, so its volume does with the square."""
    assert volume(1e-3) / volume(1e-5) == pytest.approx(1e4, rel=0.05)


def test_draws_are_uniform_over_a_place():
    place = Place(np.array([0.8, 0.0, 1.9, 0.1]), np.diag([0.1, 0.2, 0.05, 0.3]) @ _turn())
    x = place.draw(np.random.default_rng(0), 200_000)
    lo, hi = place.box
    assert ((lo <= x) & (x <= hi)).all()
    unit = np.linalg.solve(place.axes, (x - place.middle).T).T
    assert np.abs(unit).max() <= 1 + 1e-9
    counts = np.histogramdd(unit, bins=2, range=[(-1, 1)] * 4)[0] / len(x)
    np.testing.assert_allclose(counts, 1 / 16, rtol=0.05)
    assert place.volume == pytest.approx(16 * 0.1 * 0.2 * 0.05 * 0.3)


def _turn() -> np.ndarray:
    turn, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(4, 4)))
    return turn


def test_rare_parameters_from_one_start():
    settings = pj.Settings(samples=5, target=0.2, budget_s=300)
    planner = pj.Planner(MODEL)
    answer = planner.solve(slit(1e-6), jax.random.PRNGKey(0), settings, at=(-1.2, 0.1))
    assert answer.status is pj.types.Status.PROVED and answer.coverage.at_least >= 0.8
    np.testing.assert_array_equal(answer.samples[:, :2], np.tile([-1.2, 0.1], (5, 1)))
    with pytest.raises(InputError, match="any start"):
        pj.exchange.write_c(answer, "pose.h")
