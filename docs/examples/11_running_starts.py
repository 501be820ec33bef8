"""A robot that begins a manoeuvre while it moves: a speed measured at the start, runs that are the
last of a chain, and a query from one speed. docs/claims.md, "Running starts".
"""

import jax
import jax.numpy as jnp

import parc_jax as pj


class Rolling:
    """Half a second at speed v, half a second to stop. The drive lags, and its state is hidden."""

    name, n_p, n_q = "rolling", 2, 0
    domain, time = (
        pj.box([0.0, 0.0], [1.0, 1.0]),
        pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.05),
    )
    k_labels, given = ("v0 [m/s]", "v [m/s]"), ("v0",)

    def rollout(self, key, k):  # from a drive that has settled at v0
        return self.rollout_from_state(key, jnp.stack([k[0], k[0]]), k)[0]

    def start_state(self, key):  # these three are for chains
        return jnp.zeros(2)  # at rest: speed, drive

    def measured(self, state):
        return state[:1]

    def rollout_from_state(self, key, state, k):
        def step(state, record):
            speed, drive = state
            command = jnp.where(record < 10, k[1], 0.0)
            after = jnp.stack([speed + 0.25 * (drive - speed), drive + 0.15 * (command - drive)])
            return after, after

        states = jnp.concatenate([state[None], jax.lax.scan(step, state, jnp.arange(20))[1]])
        x = 0.05 * (jnp.cumsum(states[:, 0]) - states[0, 0])
        y = 0.01 * jnp.linspace(0, 1, 21) * jax.random.normal(key)
        return pj.Trajectory(jnp.stack([x, y], axis=1), k[:0]), states


def learned(system):
    """A network of a system, and a claim about it from fresh runs."""
    runs = pj.learning.collect(system, key, n=1000, quiet=True)
    net = pj.learning.train(runs, hidden=(8,), key=key, steps=1000)
    claim = pj.learning.bound_error(net, system, key, eps=1e-2, delta=1e-3, train=runs, quiet=True)
    return net, claim


rolling, key = Rolling(), jax.random.PRNGKey(0)
# runs of a chain begin where others were left
chain = pj.learning.chained(rolling, before=3, hand_over=(0.05, 1.0))
net, claim = learned(chain)
assert "HIDDEN_START(given v0)" in claim.assumptions

planner = pj.Planner(pj.learning.trajectory_model(net, claim))
scene = pj.reach_avoid(pj.box([0.2, -0.3], [0.5, 0.3]), [pj.box([0.0, 0.4], [0.6, 0.6])], 0.1)
measured = pj.Uncertainty(given={"v0": 0.5})  # or a box (0.48, 0.52)
print(planner.solve(scene.replace(uncertainty=measured), key, pj.Settings.fast()).details())

longer = pj.learning.chained(rolling, before=8)
drives = pj.learning.collect(longer, jax.random.PRNGKey(7), n=200, quiet=True)
for name, (its, about) in (("settled", learned(rolling)), ("chained", (net, claim))):
    left = pj.monitor(about, its, share=1.0).observe(drives).left
    print(f"{left} of 200 runs of longer chains left the tube of the {name} claim")
