"""Train the hovering policy from nothing with Brax PPO: `python -m sims.asv.train`. Interrupted, it
goes on.

A checkpoint holds network, value and normaliser; Brax keeps Adam's moments to itself, so a resumed
run starts those anew.
Training is in float32 and not reproducible to the bit across core counts: the policy ships as a
file with its record.
"""

import functools
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import jax
import jax.numpy as jnp

from sims.asv.policy import Policy, load_policy, save_arrays
from sims.quiet import quiet_import


@dataclass(frozen=True)
class Settings:
    """Everything that shapes the result. The defaults made the policy that ships."""

    steps: int = 12_000_000  # control steps over all environments
    seed: int = 0
    plant: str = "ode"  # mjx trains the same, several times slower
    law: str = "study"
    period: float = 0.2  # [s] control
    hidden: int = 64  # width of both tanh layers, of policy and value
    environments: int = 512
    unroll: int = 20  # control steps per environment and unroll
    batch: int = 256  # unrolls per minibatch
    minibatches: int = 8
    epochs: int = 6  # passes over the data
    learning_rate: float = 5e-4
    discount: float = 0.97
    gae: float = 0.95
    clip: float = 0.2
    entropy: float = 1e-3
    max_gradient: float = 1.0


def train(settings: Settings, out: Path, evaluations: int) -> Policy:
    """Train, or go on training, in folder `out`; writes checkpoint.npz, hover.npz and
    hover_training.json there.

    evaluations: how often to evaluate, report and save on the way. Raises InputError if `out` holds
        another training.
    """
    networks, ppo = (
        quiet_import(f"brax.training.agents.ppo.{name}") for name in ("networks", "train")
    )
    from sims.asv.environment import HoverEnv
    from sims.asv.training_log import TrainingLog

    out.mkdir(parents=True, exist_ok=True)
    log = TrainingLog(settings, out / "checkpoint.npz")
    restored = log.restore()
    left = settings.steps - log.steps
    hidden = (settings.hidden, settings.hidden)
    if left > 0:
        ppo.train(
            environment=HoverEnv(settings.plant, settings.law, settings.period),
            num_timesteps=left,
            episode_length=1000,
            num_envs=settings.environments,
            unroll_length=settings.unroll,
            batch_size=settings.batch,
            num_minibatches=settings.minibatches,
            num_updates_per_batch=settings.epochs,
            learning_rate=settings.learning_rate,
            discounting=settings.discount,
            gae_lambda=settings.gae,
            clipping_epsilon=settings.clip,
            entropy_cost=settings.entropy,
            max_grad_norm=settings.max_gradient,
            normalize_observations=True,
            network_factory=functools.partial(
                networks.make_ppo_networks,
                policy_hidden_layer_sizes=hidden,
                value_hidden_layer_sizes=hidden,
                activation=jnp.tanh,
            ),
            seed=settings.seed + log.steps,  # a resumed run must not see the first run's data again
            num_evals=1 + max(1, round(evaluations * left / settings.steps)),
            # the log evaluates: fixed tasks, and the study's own measure beside the return
            run_evals=False,
            policy_params_fn=log,
            restore_params=restored,
        )
    save_arrays(out / "hover.npz", log.policy)
    (out / "hover_training.json").write_text(json.dumps(log.record(), indent=1) + "\n")
    return load_policy(out / "hover.npz")


@dataclass(frozen=True)
class Options(Settings):
    """Train the hovering policy; run the same command again to go on after an interruption."""

    out: Path = Path("runs/asv_policy")
    evaluations: int = 24  # evaluations, reports and checkpoints on the way
    cores: int = os.cpu_count() or 1  # each trains its share of the environments


def main(argv: list[str] | None = None) -> None:
    """Command line."""
    import tyro

    options = tyro.cli(Options, args=argv, prog="python -m sims.asv.train")
    jax.config.update("jax_num_cpu_devices", options.cores)
    settings = Settings(**{name: getattr(options, name) for name in asdict(Settings())})
    try:
        train(settings, options.out, options.evaluations)
    except KeyboardInterrupt:
        print(f"stopped; the same command goes on from the last checkpoint in {options.out}")
        raise SystemExit(130) from None
    print(f"wrote {options.out / 'hover.npz'} and hover_training.json")


if __name__ == "__main__":
    main()
