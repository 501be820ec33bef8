"""What differs from run to run, as on a real floor. All of it is drawn from the key of the run."""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError

BLOCK = 32  # runs drawn at a time: one compiled program for batches of any size
FLOOR = ((-1.0, 10.0), (-4.0, 2.0))  # [m] where patches lie, seen from the start


@dataclass(frozen=True)
class Law:
    """Ranges (lo, hi) of uniform laws, and standard deviations. The fields are the declared law of
    the system.

    friction: coefficient of tyre and floor. patches: number of round patches of other friction;
        patch_radius [m];
    patch_friction: factor on the coefficient inside. motor, battery, mass: factors. steering [rad]:
    offset of the servo. latency [s]: from the motion capture to the command. position, heading [m,
    rad]: of the start. noise_position, noise_heading [m, rad]: standard deviations of the motion
    capture.
    """

    friction: tuple[float, float] = (0.346, 0.374)
    patches: int = 5
    patch_radius: tuple[float, float] = (0.15, 0.45)
    patch_friction: tuple[float, float] = (0.85, 1.05)
    motor: tuple[float, float] = (0.93, 1.07)
    battery: tuple[float, float] = (0.95, 1.0)
    mass: tuple[float, float] = (0.97, 1.03)
    steering: tuple[float, float] = (-0.009, 0.009)
    latency: tuple[float, float] = (0.020, 0.035)
    position: tuple[float, float] = (-0.02, 0.02)
    heading: tuple[float, float] = (-0.02, 0.02)
    noise_position: float = 0.0005
    noise_heading: float = 0.002


NONE = Law(
    (0.36, 0.36),
    0,
    (0.3, 0.3),
    (1.0, 1.0),
    (1.0, 1.0),
    (1.0, 1.0),
    (1.0, 1.0),
    (0.0, 0.0),
    (0.0275, 0.0275),
    (0.0, 0.0),
    (0.0, 0.0),
    0.0,
    0.0,
)
LAWS = {"floor": Law(), "none": NONE}


class Draws(NamedTuple):
    """What the keys gave, float64 on the host.

    friction, motor, battery, mass, steering, latency (B,); start (B, 3) x, y, heading; patches (B,
    n, 4) x, y, radius, factor; noise (B, ticks + 1, 3) of the motion capture.
    """

    friction: np.ndarray
    motor: np.ndarray
    battery: np.ndarray
    mass: np.ndarray
    steering: np.ndarray
    latency: np.ndarray
    start: np.ndarray
    patches: np.ndarray
    noise: np.ndarray


def draw(law: Law, keys, ticks: int) -> Draws:
    """Draws of B runs from their keys (B, 2); a run's draw depends on its own key alone."""
    keys = np.asarray(keys)
    padded = np.resize(keys, (-(-len(keys) // BLOCK) * BLOCK, 2))
    with x64():
        blocks = [
            _draw_many(law, jnp.asarray(padded[i : i + BLOCK]), ticks)
            for i in range(0, len(padded), BLOCK)
        ]
    parts = (np.concatenate(part)[: len(keys)] for part in zip(*blocks, strict=True))
    return Draws(*(np.array(part, np.float64) for part in parts))


def named_law(name: str) -> Law:
    """One of LAWS. Raises InputError."""
    if name not in LAWS:
        raise InputError(f"f110 law: expected one of {', '.join(LAWS)}; got {name!r}.")
    return LAWS[name]


def _draw(law: Law, key, ticks: int) -> Draws:
    def uniform(tag: int, lo_hi, shape=()):
        lo, hi = lo_hi
        return lo + (hi - lo) * jax.random.uniform(jax.random.fold_in(key, tag), shape, jnp.float64)

    names = ("friction", "motor", "battery", "mass", "steering", "latency")
    scalars = [uniform(i, getattr(law, name)) for i, name in enumerate(names)]
    start = jnp.concatenate([uniform(10, law.position, (2,)), uniform(11, law.heading, (1,))])
    n = (law.patches,)
    parts = [uniform(20, FLOOR[0], n), uniform(21, FLOOR[1], n), uniform(22, law.patch_radius, n)]
    patches = jnp.stack([*parts, uniform(23, law.patch_friction, n)], axis=-1)
    spread = jnp.array([law.noise_position, law.noise_position, law.noise_heading])
    noise = spread[None] * jax.random.normal(
        jax.random.fold_in(key, 30), (ticks + 1, 3), jnp.float64
    )
    return Draws(*scalars, start, patches, noise)


_draw_many = jax.jit(jax.vmap(_draw, in_axes=(None, 0, None)), static_argnums=(0, 2))
