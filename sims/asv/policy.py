"""Neural policies: how they see the vessel, how they act, and the .npz files that hold them.

Observation layouts, from measured position, yaw and velocities; the goal is at distance d, bearing
alpha off the bow:

    "goto"        u, v, r, cos alpha, sin alpha, d
    "capture"     u, v, r, cos alpha, sin alpha, d, and five zeros
    "neuralparc"  u, v, r, d, cos alpha, sin alpha, and five zeros for its context
"""

import json
import zipfile
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common import struct
from parc_jax.common.errors import InputError
from sims.asv.vessel import PHYSICS_DT

HOVER = Path(__file__).parent / "hover.npz"
LAYOUTS = {"goto": 6, "capture": 11, "neuralparc": 11}
# what the published files do not say about themselves: observation clip and control period, by
# layout
_PUBLISHED = {"capture": (12.0, 0.1), "neuralparc": (8.0, 0.2)}
_SQUASH = {"clip": lambda x: jnp.clip(x, -1.0, 1.0), "tanh": jnp.tanh}


@struct.dataclass
class Policy:
    """Two tanh layers and a linear one. Build with `load_policy` or `policy_from_arrays`, which
    validate.

    weights: (h, n_obs), (h, h), (2, h); biases: (h,), (h,), (2,); obs_mean, obs_std: (n_obs,).
        NumPy float64.
    norm_clip: elementwise limit of the normalised observation; obs_clip: of the observation,
        applied by `measure`.
    layout, squash: names, see the module. period: [s] control period.
    """

    weights: tuple
    biases: tuple
    obs_mean: np.ndarray
    obs_std: np.ndarray
    norm_clip: float = struct.field(pytree_node=False)
    obs_clip: float = struct.field(pytree_node=False)
    layout: str = struct.field(pytree_node=False)
    squash: str = struct.field(pytree_node=False)
    period: float = struct.field(pytree_node=False)

    @property
    def n_physics(self) -> int:
        """Physics steps per control step."""
        return round(self.period / PHYSICS_DT)


def act(policy: Policy, observation: jax.Array) -> jax.Array:
    """Deterministic action (2,) = (left, right) in [-1, 1] for an observation (n_obs,)."""
    policy = jax.tree.map(lambda w: jnp.asarray(w, observation.dtype), policy)
    x = jnp.clip(
        (observation - policy.obs_mean) / policy.obs_std, -policy.norm_clip, policy.norm_clip
    )
    for W, b in zip(policy.weights[:-1], policy.biases[:-1], strict=True):
        x = jnp.tanh(W @ x + b)
    return _SQUASH[policy.squash](policy.weights[-1] @ x + policy.biases[-1])


def observe(
    layout: str, position: jax.Array, yaw: jax.Array, velocity: jax.Array, goal: jax.Array
) -> jax.Array:
    """Observation of the named layout. position, goal: (2,) [m]; yaw () [rad]; velocity (3,) world
    [m/s], [rad/s].
    """
    cos, sin = jnp.cos(yaw), jnp.sin(yaw)
    vx, vy, r = velocity
    ex, ey = goal - position
    d = jnp.hypot(ex, ey)
    # cos and sin of (bearing - yaw) without the arctangent; at d = 0 the bearing is 0 as atan2(0,
    # 0) has it
    safe = jnp.maximum(d, jnp.finfo(d.dtype).tiny)
    bx, by = jnp.where(d > 0, ex / safe, 1.0), ey / safe
    motion = [cos * vx + sin * vy, cos * vy - sin * vx, r]
    ahead = [cos * bx + sin * by, cos * by - sin * bx]
    parts = [*motion, d, *ahead] if layout == "neuralparc" else [*motion, *ahead, d]
    return jnp.stack(parts + [jnp.zeros_like(d)] * (LAYOUTS[layout] - 6))


def policy_from_arrays(
    arrays: dict, layout: str, squash: str, obs_clip: float, period: float
) -> Policy:
    """Validated policy from arrays named as in the published files (W0, b0, W1, b1, mu_W, mu_b,
    obs_mean, obs_var, norm_eps, norm_clip). Raises InputError."""
    missing = [
        n
        for n in ("W0", "b0", "W1", "b1", "mu_W", "mu_b", "obs_mean", "obs_var")
        if n not in arrays
    ]
    if missing:
        raise InputError(
            f"asv policy: expected arrays {', '.join(missing)}; they are missing. Is it a policy "
            "file?"
        )
    if layout not in LAYOUTS or squash not in _SQUASH:
        raise InputError(
            f"asv policy: expected a layout of {', '.join(LAYOUTS)}; got {layout!r}, squash "
            f"{squash!r}."
        )
    if str(arrays.get("activation", "tanh")) != "tanh":
        raise InputError(f"asv policy: expected tanh layers; got {arrays['activation']!s}.")
    if not abs(period / PHYSICS_DT - round(period / PHYSICS_DT)) < 1e-9 or period <= 0:
        raise InputError(
            f"asv policy: expected a control period that is a multiple of {PHYSICS_DT} s; got "
            f"{period}."
        )
    weights = tuple(np.asarray(arrays[n], np.float64) for n in ("W0", "W1", "mu_W"))
    biases = tuple(np.asarray(arrays[n], np.float64) for n in ("b0", "b1", "mu_b"))
    mean, var = (np.asarray(arrays[n], np.float64) for n in ("obs_mean", "obs_var"))
    hidden = weights[0].shape[0]
    expected = [(hidden, LAYOUTS[layout]), (hidden, hidden), (2, hidden)]
    shapes = [w.shape for w in weights]
    vectors = [a.shape for a in (*biases, mean, var)]
    if shapes != expected or vectors != [
        (hidden,),
        (hidden,),
        (2,),
        (LAYOUTS[layout],),
        (LAYOUTS[layout],),
    ]:
        raise InputError(
            f"asv policy: expected weights {expected} for layout {layout!r}; got {shapes}, "
            f"{vectors}."
        )
    if not all(np.isfinite(a).all() for a in (*weights, *biases, mean, var)) or (var < 0).any():
        raise InputError(
            "asv policy: expected finite numbers and variances >= 0. Is the file damaged?"
        )
    std = np.sqrt(var + float(arrays.get("norm_eps", 1e-5)))
    return Policy(
        weights,
        biases,
        mean,
        std,
        float(arrays.get("norm_clip", 5.0)),
        obs_clip,
        layout,
        squash,
        period,
    )


def policy_from_file_arrays(arrays: dict) -> Policy:
    """The policy in a file of ours, whose `meta` (JSON) says how it observes and acts. Raises
    InputError.
    """
    try:
        meta = json.loads(str(arrays["meta"]))
        options = {name: meta[name] for name in ("layout", "squash", "obs_clip", "period")}
    except (KeyError, json.JSONDecodeError) as error:
        raise InputError(
            f"asv policy: expected meta with layout, squash, obs_clip, period; got {error!r}."
        ) from None
    return policy_from_arrays(arrays, **options)


def load_policy(path: str | Path = HOVER, layout: str | None = None) -> Policy:
    """Read a policy file; with no arguments, the one that ships with this simulator.

    layout: "capture" or "neuralparc" for a published file, which does not name its own. Raises
        InputError.
    """
    path = Path(path)
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            arrays = dict(file)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"asv policy: expected an .npz policy file at {path}; {error}. Check the path."
        ) from None
    if "meta" in arrays:
        return policy_from_file_arrays(arrays)
    if layout not in _PUBLISHED:
        raise InputError(
            f"asv policy: {path.name} does not say how it observes; expected layout= one of "
            f"{', '.join(_PUBLISHED)}; "
            f"got {layout!r}."
        )
    return policy_from_arrays(arrays, layout, "clip", *_PUBLISHED[layout])


def save_arrays(path: Path, arrays: dict) -> None:
    """Write an .npz that appears complete or not at all."""
    part = path.with_suffix(".part.npz")
    np.savez_compressed(part, **arrays)
    part.replace(path)
