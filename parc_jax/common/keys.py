"""Random streams that never meet: training, bound, search, replay.

Every rollout has a global row number; its key and its parameters depend on (seed, stage, row)
alone, so the numbers do not depend on chunking, batch size, or devices, and a resumed run
continues bit for bit.
"""

import enum

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.errors import InputError, expected
from parc_jax.common.shapes import Key

SEEDS = 2**32  # so many: a larger number would lose its upper half without 64-bit integers
TURNS = (13, 15, 26, 6), (17, 29, 16, 24)  # [bits] of Threefry on two words of 32


class Stage(enum.IntEnum):
    """The purpose of a stream. Two stages never share random numbers."""

    TRAIN = 1
    BOUND = 2
    SEARCH = 3
    REPLAY = 4
    FIT = 5  # initial weights and minibatches: not rollouts
    VALIDATE = 6
    DRIVEN = 7  # keys of runs around the plan that is driven, one per look
    EPISODE = 8  # seeds of worlds and of drives through them, two per episode
    FIRST = 9  # key of the runs behind a first claim, of few
    SCENE = 10  # tests of a set in one scene
    PRIOR = 11  # runs of a simulator, whose disturbances are none of those of the robot's runs


def as_key(key) -> jax.Array:
    """The key itself, of either kind that `jax.random` makes. Raises InputError, as for a seed."""
    is_array = isinstance(key, jax.Array | np.ndarray)
    typed = is_array and jnp.issubdtype(key.dtype, jax.dtypes.prng_key) and key.shape == ()
    raw = is_array and key.dtype == np.uint32 and key.shape == (2,)
    if not (typed or raw):
        seed = key if isinstance(key, int) else 0
        raise InputError(expected("key", "a random key", key, f"jax.random.PRNGKey({seed})"))
    return key


def check_seed(seed: int) -> int:
    """The seed itself. Raises InputError for anything else."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or not 0 <= seed < SEEDS:
        raise InputError(f"seed: expected a whole number from 0 to {SEEDS - 1}; got {seed!r:.40}.")
    return int(seed)


def key_of(seed: int) -> np.ndarray:
    """The key of a seed: `jax.random.PRNGKey`, without a compiled program. Raises InputError."""
    return np.array([0, check_seed(seed)], np.uint32)


def key_data(key) -> np.ndarray:
    """The numbers of a key of either kind, for kernels that fold further numbers in."""
    return key if isinstance(key, np.ndarray) else np.asarray(jax.random.key_data(key))


def generator(key) -> np.random.Generator:
    """A host generator seeded by all bits of a key of either kind: its draws are cheap."""
    return np.random.default_rng([int(word) for word in key_data(key).ravel()])


def stream(key: Key, stage: Stage) -> jax.Array:
    """The key of one stage. Does not consume `key`. Raises InputError for anything else."""
    known = isinstance(as_key(key), np.ndarray)  # on the host
    return folded(key, int(stage)) if known else _of_stage(key, int(stage))


def folded(key, x: int):
    """`jax.random.fold_in`, of a key on the host without a compiled program: Threefry on two words,
    of 20 rounds (Salmon et al., Parallel Random Numbers: As Easy as 1, 2, 3, SC 2011).
    """
    if not isinstance(key, np.ndarray):
        return jax.random.fold_in(key, x)
    first, second = key.tolist()
    words = first, second, first ^ second ^ 0x1BD11BDA
    a, b = first, (second + x) % SEEDS
    for i in range(5):
        for turn in TURNS[i % 2]:
            a = (a + b) % SEEDS
            b = (b << turn | b >> 32 - turn) % SEEDS ^ a
        a, b = (a + words[(i + 1) % 3]) % SEEDS, (b + words[(i + 2) % 3] + i + 1) % SEEDS
    return np.array([a, b], np.uint32)


def row_keys(key: jax.Array, rows: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Of global rollout rows (B,) uint32 of a stage, whose `stream` is given: keys (B, 2) that draw
    k, and keys (B, 2) that drive the systems. A kernel.
    """
    keys = jax.vmap(jax.random.fold_in, in_axes=(None, 0))(key, rows)
    return jax.vmap(lambda one: tuple(jax.random.split(one)))(jax.random.key_data(keys))


# a program for each stage, since a query may move no number to the device
_of_stage = jax.jit(jax.random.fold_in, static_argnums=1)
