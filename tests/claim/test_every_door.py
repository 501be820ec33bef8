"""Every public door that takes a model refuses one whose network its claim never saw, and a tested
set's, which runs may leave. Doors are read off the signatures: a new one without a rule fails.
"""

import inspect

import pytest
from needs import need
from toy_models import line_model

import parc_jax as pj
from parc_jax.app.live import Live
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.statement import VALIDATED

need("gymnasium")
import gymnasium  # noqa: E402

MODEL = line_model(4, 0.01, rests=True)
SPOILT = {
    "another network": MODEL.replace(
        net=pj.learning.relu_network([0.9 * W for W in MODEL.net.weights], MODEL.net.biases)
    ),
    "a tested set": MODEL.replace(claim=derived(MODEL.claim, kind=VALIDATED)),
}
PARTS = (pj, pj.drive, pj.problem, pj.learning, pj.exchange, pj.types)
# what else they take, each valid: without it the model is not what is refused
DOORS = {
    "Planner": lambda model: pj.Planner(model),
    "Loop": lambda model: pj.drive.Loop(model, 0.05, leave=0.5, given=(1,)),
    "Shield": lambda model: pj.drive.Shield(
        gymnasium.Env(), model, system=None, body=0.05, every=1.0, sense=len, ask=len, act=len
    ),
    "BatchShield": lambda model: pj.drive.BatchShield(
        model, system=None, radius=0.05, every=1.0, ask=len, act=len
    ),
    "mover_obstacles": lambda model: pj.problem.mover_obstacles(model, [], 0.4, MODEL.time, 0.0),
    "live": lambda model: Live(model, pj.reach_avoid(pj.box([-1.0] * 3, [1.0] * 3), [], 0.05)),
    "TrajectoryModel.save": lambda model: model.save("no/where.npz"),
}
ARRAYS_ALONE = {"box_scenes"}  # takes sizes of it; `Planner` refuses it where they are judged


def takes_a_model(door) -> bool:
    if not callable(door) or (isinstance(door, type) and issubclass(door, Exception)):
        return False
    annotated = inspect.signature(door).parameters.values()
    return any(part.annotation is pj.types.TrajectoryModel for part in annotated)


def test_every_public_door_with_a_model_has_a_rule():
    found = {
        name
        for part in PARTS
        for name in dir(part)
        if not name.startswith("_") and takes_a_model(getattr(part, name))
    }
    assert found == (DOORS.keys() - {"live", "TrajectoryModel.save"}) | ARRAYS_ALONE


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("spoilt", SPOILT)
def test_it_refuses_a_claim_that_is_not_of_this_model(door, spoilt):
    words = {"another network": "expected the network", "a tested set": "a claim about all of K"}
    with pytest.raises(InputError, match=words[spoilt]):
        DOORS[door](SPOILT[spoilt])
