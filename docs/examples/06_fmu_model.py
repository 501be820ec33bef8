"""Door 5: a model that another tool exported (Simulink, Modelica, ...), as an FMU: python
06_fmu_model.py GLIDER.fmu

The glider of the tests: parameters vx, vy [m/s], outputs x, y [m] and heading [rad], and a seed
that decides its gust. Worker processes import this file, so its start is guarded.
"""

import sys

import jax

import parc_jax as pj

if __name__ == "__main__":
    domain, time = (
        pj.box([0.5, -0.5], [0.9, 0.5]),
        pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.05),
    )
    glider = pj.learning.fmu_system(
        sys.argv[1], ("vx", "vy"), ("x", "y"), domain, time, q=("heading",), seed="seed", workers=2
    )

    key = jax.random.PRNGKey(0)
    runs = pj.learning.collect(glider, key, n=400, quiet=True)
    net = pj.learning.train(runs, hidden=(8,), key=key, seeds=2, steps=400)
    claim = pj.learning.bound_error(net, glider, key, eps=0.05, delta=0.05, train=runs, quiet=True)
    scene = pj.reach_avoid(
        pj.box([0.6, -0.3, -1.0], [1.1, 0.3, 1.0]), [pj.box([0.2, 0.25], [0.5, 0.5])], 0.1
    )
    answer = pj.Planner(pj.learning.trajectory_model(net, claim)).solve(
        scene, key, pj.Settings.fast()
    )
    glider.close()
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
