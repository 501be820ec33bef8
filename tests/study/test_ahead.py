"""Programs of a query are those that were compiled ahead, for a stand-in of the same shapes."""

import jax
import pytest
import toy_driven as toy
from compilations import compiled_by
from synthetic_plants import plant

import parc_jax as pj
from parc_jax.rollout.collect import collect
from parc_jax.study.ahead import Ahead

SETTINGS = pj.Settings(samples=4, target=0.3, polytopes=True)


@pytest.mark.slow
def test_a_query_compiles_nothing_that_was_compiled_ahead():
    model, problem = toy.model(), toy.problem()
    train = collect(plant(toy.gusty, toy.T), jax.random.PRNGKey(3), 100, quiet=True)
    narrower = model.tube.with_halves(*(half / 2 for half in model.tube.halves))
    ahead = Ahead(problem, SETTINGS)
    ahead.wait()
    ahead.begin(model.net, train, narrower)
    ahead.wait()
    assert compiled_by(lambda: pj.Planner(model).warm_up(problem, SETTINGS)) == 0


def test_what_fails_ahead_is_told_by_the_query(capfd):
    ahead = Ahead(toy.problem(), SETTINGS)
    ahead.begin(toy.NET, None, None)
    ahead.wait()
    assert capfd.readouterr() == ("", "")
