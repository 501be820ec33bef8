"""Programs of the query near the driven plan are those that were compiled ahead, for a stand-in of
the same shapes.
"""

import jax
import numpy as np
import pytest
import toy_driven as toy
from synthetic_plants import plant

import parc_jax as pj
from parc_jax.drive.local.localise import Local, compile_near, guessed_near
from parc_jax.learning.runs.collect import collect

SETTINGS = pj.Settings(samples=4, target=0.3)


@pytest.mark.slow
def test_what_stands_in_for_a_local_model_has_its_shapes():
    system, key = plant(toy.gusty, toy.T), jax.random.PRNGKey(3)
    train = collect(system, key, 400, quiet=True)
    chosen = toy.answer().choose(delta=0.05)
    asked = Local(share=0.2, eps=0.1, rollouts=60, profile_runs=400)
    model = chosen.localise(system, key, asked, settings=SETTINGS).near.model
    guess = guessed_near(train, chosen.k)
    shapes = [jax.tree.map(np.shape, (one.net, one.tube)) for one in (guess, model)]
    assert shapes[0] == shapes[1] and guess.claim.kind == "assumed"
    assert guess.domain.contains(chosen.k)


def test_what_fails_ahead_is_told_by_the_query(capfd):
    compile_near(toy.problem(), None, np.zeros(2)).join()
    assert capfd.readouterr() == ("", "")
