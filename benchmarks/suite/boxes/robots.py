"""Thin doors to the simulated robots of `sims`, which need JAX and MuJoCo."""

import numpy as np

from benchmarks.suite.boxes import BlackBox

OPTIONS = {
    "drift_parking": {"plant": "ode", "body": "rectangle"},
    "asv": {"plant": "ode", "body": "rectangle"},
    "f110": {"body": "rectangle"},
}
KEPT = {"drift_parking": 5, "asv": 5, "f110": 4, "tractor": 2, "drone": 2, "jackal": 1}
CHUNK = 64  # runs that are compiled together


def robot(name: str, own: str) -> BlackBox:
    """A system of `sims`. Of its records every KEPT-th is seen."""
    import sims

    return of_system(name, sims.load(own, **OPTIONS.get(own, {})), KEPT[own])


def of_system(name: str, system, fine: int = 1) -> BlackBox:
    """A box of any system that parc_jax takes, whose runs move along with their start: a robot of
    `sims`, Python (`python_system`). Of its records every fine-th is seen;
    the scorer looks at all.
    """
    time = system.time
    return BlackBox(
        name,
        lambda p0, k, seed: _runs(system, np.asarray(p0, float), np.asarray(k, float), seed),
        tuple(map(float, system.domain.lo)),
        tuple(map(float, system.domain.hi)),
        n_p=system.n_p,
        dt=fine * time.dt_record,
        records=time.n_record // fine,
        points=tuple(getattr(system, "points", ("reference",))),
        q=tuple(getattr(system, "q_labels", None) or [f"q{i}" for i in range(system.n_q)]),
        fine=fine,
    )


def _runs(system, p0, k, seed):
    import jax

    import parc_jax as pj

    key = jax.random.PRNGKey(seed % 2**63)
    n = len(k)
    padded = np.concatenate([k, np.repeat(k[-1:], -n % CHUNK, axis=0)])
    runs = pj.learning.collect(system, key, n=len(padded), k=padded, chunk=CHUNK, quiet=True)
    places = (n, runs.p.shape[1], len(runs.points), system.n_p)
    return runs.p[:n].reshape(places) + p0[:, None, None], runs.q[:n]
