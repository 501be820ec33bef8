"""What a training leaves behind: a line per stage, a checkpoint to go on from, the record to ship
with the policy.
"""

import functools
import json
import platform
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.errors import InputError
from sims.asv.environment import OBS_CLIP, HoverEnv
from sims.asv.evaluate import evaluate
from sims.asv.policy import Policy, act, policy_from_file_arrays, save_arrays
from sims.quiet import quiet_import

EVALUATION_STEPS = 100  # control steps of the return that is reported


class TrainingLog:
    """PPO calls it after every stage with (steps, make_policy, (normaliser, policy, value)).

    policy: arrays of the policy's file, as of the last stage.
    """

    def __init__(self, settings, checkpoint: Path):
        self.settings, self.checkpoint = settings, checkpoint
        self.start = self.steps = 0  # control steps at the start of this run, and now
        self.seconds, self.history, self.resumed, self.policy = 0.0, [], [], {}
        self._clock = None

    def restore(self):
        """(normaliser, policy, value) of an earlier run here, or None. Raises InputError if
        settings differ.
        """
        if not self.checkpoint.exists():
            return None
        running_statistics = quiet_import("brax.training.acme.running_statistics")
        with np.load(self.checkpoint, allow_pickle=False) as file:
            arrays = dict(file)
        record = json.loads(str(arrays.pop("record")))
        mine = asdict(self.settings)
        differing = [
            name for name in mine if name != "steps" and mine[name] != record["settings"].get(name)
        ]
        if differing:
            raise InputError(
                f"asv train: expected the settings of the training in {self.checkpoint.parent}; "
                f"{', '.join(differing)} "
                "differ. Choose another folder, or delete that one."
            )
        self.start = self.steps = record["steps"]
        self.seconds, self.history = record["seconds"], record["history"]
        self.resumed = [*record["resumed_at"], self.steps]
        tree = _unflatten(arrays)
        empty = running_statistics.init_state(
            jax.ShapeDtypeStruct((HoverEnv().observation_size,), jnp.float32)
        )
        count = type(empty.count)(**tree["normalizer"].pop("count"))
        normalizer = empty.replace(count=count, **tree["normalizer"])
        self.policy = policy_arrays(normalizer, tree["policy"], self.settings.period)
        return normalizer, tree["policy"], tree["value"]

    def __call__(self, steps: int, _make_policy, params) -> None:
        """Evaluate, print a line, save the checkpoint."""
        normalizer, policy, value = jax.tree.map(np.asarray, params)
        now = time.monotonic()
        self.seconds += now - (self._clock or now)
        self._clock, self.steps = now, self.start + steps
        self.policy = policy_arrays(normalizer, policy, self.settings.period)
        if steps or not self.history:
            self.history.append(self._evaluate())
            print(self._line(), flush=True)
        if steps:
            kept = {name: getattr(normalizer, name) for name in ("mean", "std", "summed_variance")}
            kept["count"] = {"hi": normalizer.count.hi, "lo": normalizer.count.lo}
            tree = {"normalizer": kept, "policy": policy, "value": value}
            save_arrays(self.checkpoint, {**_flatten(tree), "record": json.dumps(self.record())})

    def _evaluate(self) -> dict:
        policy = policy_from_file_arrays(self.policy)
        statistics = evaluate(policy, self.settings.law, jax.random.key(1), n=256)
        return {
            "steps": self.steps,
            "seconds": round(self.seconds, 1),
            "return": round(float(mean_return(policy, self.settings.plant, self.settings.law)), 2),
            "arrival_median_s": round(statistics["arrival_median_s"], 2),
            "spread_end_m": round(statistics["spread_end_m"], 4),
        }

    def _line(self) -> str:
        row, total = self.history[-1], self.settings.steps
        # pace of this run's last three stages, so that compiling soon stops counting
        stages = [r for r in self.history if r["steps"] >= self.start][-4:]
        taken = stages[-1]["steps"] - stages[0]["steps"]
        pace = (stages[-1]["seconds"] - stages[0]["seconds"]) / taken if taken else None
        left = "?" if pace is None else f"{pace * max(0, total - self.steps):.0f}"
        return (
            f"{self.steps / 1e6:6.2f} of {total / 1e6:.2f} M steps   return {row['return']:6.2f}   "
            f"arrival {row['arrival_median_s']:5.1f} s   spread {row['spread_end_m']:.3f} m   "
            f"{self.seconds:5.0f} s, {left} s left"
        )

    def record(self) -> dict:
        """What was trained, how, and how it went."""
        packages = {name: version(name) for name in ("jax", "brax", "flax", "optax", "mujoco-mjx")}
        return {
            "settings": asdict(self.settings),
            "steps": self.steps,
            "seconds": round(self.seconds, 1),
            "resumed_at": self.resumed,
            "return_is": f"sum of rewards over {EVALUATION_STEPS} control steps, mean of 256 "
            "tasks, deterministic",
            "packages": packages,
            "machine": f"{platform.machine()}, {jax.local_device_count()} devices",
            "history": self.history,
        }


def policy_arrays(normalizer, params: dict, period: float) -> dict:
    """The deterministic policy, tanh of the mean, as the arrays of a policy file."""
    meta = {"layout": "goto", "squash": "tanh", "obs_clip": OBS_CLIP, "period": period}
    arrays = {
        "meta": np.array(json.dumps(meta)),
        "norm_eps": np.array(0.0),
        "norm_clip": np.array(1e6),
    }
    arrays |= {"obs_mean": np.asarray(normalizer.mean), "obs_var": np.asarray(normalizer.std) ** 2}
    for i, (W, b) in enumerate((("W0", "b0"), ("W1", "b1"), ("mu_W", "mu_b"))):
        layer = params["params"][f"hidden_{i}"]
        arrays |= {W: np.asarray(layer["kernel"]).T, b: np.asarray(layer["bias"])}
    return arrays | {
        "mu_W": arrays["mu_W"][:2],
        "mu_b": arrays["mu_b"][:2],
    }  # the other half is exploration noise


@functools.partial(jax.jit, static_argnames=("plant", "law"))
def mean_return(policy: Policy, plant: str, law: str) -> jax.Array:
    """Sum of rewards over EVALUATION_STEPS control steps, mean of 256 fixed tasks."""
    env = HoverEnv(plant, law, policy.period, redraw=0.0)

    def one(key):
        def step(state, _):
            state = env.step(state, act(policy, state.obs))
            return state, state.reward

        return jax.lax.scan(step, env.reset(key), None, length=EVALUATION_STEPS)[1].sum()

    return jax.vmap(one)(jax.random.split(jax.random.PRNGKey(2), 256)).mean()


def _flatten(tree: dict, prefix: str = "") -> dict:
    flat = {}
    for name, value in tree.items():
        path = f"{prefix}{name}"
        flat |= (
            _flatten(value, f"{path}/") if isinstance(value, dict) else {path: np.asarray(value)}
        )
    return flat


def _unflatten(flat: dict) -> dict:
    tree: dict = {}
    for path, value in flat.items():
        *folders, name = path.split("/")
        node = tree
        for folder in folders:
            node = node.setdefault(folder, {})
        node[name] = value
    return tree
