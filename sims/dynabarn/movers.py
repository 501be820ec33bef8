"""What walks, learned from its tracks: a tube for the next 1.2 s of who is seen. The tracks of half
of the worlds are learned from, and judged are the others, and the other way round.
`python -m sims.dynabarn.movers` trains the networks anew.
"""

from functools import cache
from itertools import product
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from sims.dynabarn.worlds import Track, half_of, numbers, world
from sims.jackal.params import TICK

STEP = 0.1  # [s] between the places from which a mover is seen
SEEN = 1e-4  # [m] within which each is seen where places are known; the files round to 1e-2
SCANNED = 0.01  # [m] by which places of a track of the lidar are taken to be off, along x and y
AHEAD = 1.2  # [s] of a window
FASTEST = 2.0  # [m/s]
WALKS = 1.96  # [m/s] that none of the files exceeds
EVERY = 0.25  # [s] between windows to learn from
# Of the claim, and tracks that are left outside. Who turns within the window is far from where it
# would be straight on, so a tube that holds nearly all is as wide as that of a greatest speed
BOUND = {"eps": 0.05, "delta": 0.01, "discard": 3, "shape": "fitted"}
LEARNED = 6  # worlds of a half for network and shape; the tracks of all others bound
EDGES = (0.98, 1.46)  # [m/s] between bins
NETWORKS = Path(__file__).with_name("networks.npz")
HIDDEN, LAYERS, PARTS = (8, 8), 3, ("weights", "biases")  # of each


def tracks_of(worlds, rng: np.random.Generator, off: float) -> list[Track]:
    """All tracks of worlds, as they are seen every 0.02 s within off [m]."""
    found = []
    for track in (track for number in worlds for track in world(number).tracks):
        times = np.arange(0.0, track.length, TICK)
        found.append(Track(times, seen(track.at(times), rng, off)))
    return found


def seen(places: np.ndarray, rng: np.random.Generator, off: float) -> np.ndarray:
    """Places as they are seen: uniform within off [m] along x and y."""
    return places + rng.uniform(-off, off, places.shape)


def most(off: float) -> float:
    """[m/s] that a mover seen within off [m] seems to have at most, from a tick to the next."""
    return max(FASTEST, WALKS + 2 * np.sqrt(2) * off / TICK)


@cache
def model(half: int, off: float = SEEN) -> pj.types.TrajectoryModel:
    """For movers of worlds of the other half, seen within off [m]: the network that comes along,
    bounded by other tracks, some of which walk a way of these. Training rounds elsewhere on
    another processor, and then every drive is another one.
    """
    train, held = runs_of(half, off)
    net = network(half, off)
    # who seems to turn by less may go straight on
    turns = max(0.02, 20 * off)
    edges = ([0.0, *EDGES, most(off)], [-3.15, -turns, turns, 3.15])
    claim = pj.learning.bound_error(net, held, None, train=train, bins=edges, **BOUND)
    return pj.learning.trajectory_model(net, claim)


def runs_of(half: int, off: float):
    """Windows to learn from, and one of each other track for the bound."""
    ours = [number for number in numbers() if half_of(number) == half]
    grid = pj.learning.time_grid(0.1, AHEAD, 0.02)
    # of all three kinds alike
    learned = ours[:: len(ours) // LEARNED][:LEARNED]
    rest = [number for number in ours if number not in learned]
    about = {"step": STEP, "most": most(off), "name": f"tracks of half {half} of DynaBARN"}
    about["name"] += f", places seen evenly within {off:g} m along each axis"
    rng = np.random.default_rng(half)
    tracks, others = tracks_of(learned, rng, off), tracks_of(rest, rng, off)
    of = [f"track {i}" for i in range(len(tracks) + len(others))]
    train = pj.problem.mover_runs(tracks, grid, of=of[: len(tracks)], every=EVERY, **about)
    held = pj.problem.mover_runs(others, grid, of=of[len(tracks) :], rng=rng, **about)
    return train, held


@cache
def network(half: int, off: float):
    """The one that comes along."""
    with np.load(NETWORKS) as file:
        layers = [
            [file[f"{part}{i} of half {half} seen within {off:g} m"] for i in range(LAYERS)]
            for part in PARTS
        ]
    return pj.learning.relu_network(*layers)


def learn() -> None:
    """Train all of them anew, into the file."""
    kept = {}
    for half, off in product((0, 1), (SEEN, SCANNED)):
        (train, held), key = runs_of(half, off), jax.random.PRNGKey(half)
        asked = {"hidden": HIDDEN, "seeds": 2, "steps": 1000, "quiet": True} | BOUND
        net = pj.learn(train, key, holdout=held, **asked).net
        for part, layers in zip(PARTS, (net.weights, net.biases), strict=True):
            for i, values in enumerate(layers):
                kept[f"{part}{i} of half {half} seen within {off:g} m"] = values
    np.savez_compressed(NETWORKS, **kept)


if __name__ == "__main__":
    learn()
