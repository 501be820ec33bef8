"""What a model says of manoeuvres before they are driven: where they lead, and how wide their tubes
are. The model has them as `asked`, of which `told` is the inverse.
"""

from pathlib import Path

import numpy as np

import parc_jax as pj
from parc_jax.learning.network.predict import trajectories
from sims.parking import car as c

MODEL = Path(__file__).with_name("model.npz")


def model() -> pj.types.TrajectoryModel:
    """The model that comes along; `python -m sims.parking.learn` made it."""
    return pj.load(MODEL, system="parking")


def asked(k: np.ndarray, begins: float = 0.0) -> np.ndarray:
    """Manoeuvres (b, 3) begun at a speed [m/s] as the model has them: what of their way is beyond
    that to stop in, not in metres.
    """
    stops = c.stopping(begins)
    beyond = np.maximum(np.abs(k[:, 0]) - stops, 0.0) / (1.0 - stops / c.WAY)
    return np.column_stack([c.told_of(np.copysign(beyond, k[:, 0])), k[:, 1:]])


def told(k: np.ndarray) -> np.ndarray:
    """Manoeuvres (b, 3) of what the model has (b, 5): all of their way, in metres."""
    stops = c.stopping(c.rolls_at(k[:, 1], k[:, 2]))
    way = c.way_of(k[:, 2]) * (1.0 - stops / c.WAY) + np.copysign(stops, k[:, 2])
    return np.column_stack([way, k[:, 3:]])


def tube_of(model, k: np.ndarray, begins: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Of manoeuvres k (b, 3) begun at a speed [m/s] the tube's width (b,) [m], at its widest, and
    (b, 11) at rest.
    """
    start = float(c.start_of(begins)) if begins else c.AT_REST
    return tube_at(model, np.column_stack([np.tile([0.0, start], (len(k), 1)), asked(k, begins)]))


def tube_at(model, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `tube_of`, of what the model has (b, 5)."""
    bins = model.tube.bins_of(k)
    during, final = model.tube.interval[bins], model.tube.final[bins]
    # on an edge between bins any of them may hold
    return during.max(axis=tuple(range(1, during.ndim))), final.max(
        axis=tuple(range(1, final.ndim - 1))
    )


def predicted(model, wheels: float, start: float = c.AT_REST, rolls_on: bool = False):
    """As `kinematics.ends`, by the network, with the steering before [rad] and what k has as its
    start; where the car rolls on, if it does.
    """
    along = ways_of(model, wheels, start)
    return lambda k: along(k)[:, [c.ROLLS_ON if rolls_on else -1]]


def ways_of(model, wheels: float, start: float):
    """Of manoeuvres k (b, 3) the poses (b, 19, 3) by the network at the edges of the intervals."""
    begins = float(c.rolls_at(start))

    def of(k: np.ndarray) -> np.ndarray:
        given = np.tile([wheels, start], (len(k), 1))
        return poses_of(model, np.column_stack([given, asked(k, begins)]))

    return of


def poses_of(model, k: np.ndarray) -> np.ndarray:
    """As of `ways_of`, of what the model has (b, 5)."""
    knots = trajectories(model.net, model.layout, k)[0]
    axle, front, rear = np.moveaxis(knots.reshape(*knots.shape[:2], -1, 2)[:, :, :3], 2, 0)
    ahead = front - rear
    return np.concatenate([axle, np.arctan2(ahead[..., 1], ahead[..., 0])[..., None]], axis=-1)
