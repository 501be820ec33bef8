"""A model that comes along, a scene, and the set of all its safe plans: solve, sample, check.

A plan is a start p0 and parameters k: here the speed at which a car drifts into a parking space,
and the sideslip at which it brakes.
"""

import jax
import numpy as np

import parc_jax as pj
import sims
from parc_jax import checker

if __name__ == "__main__":
    key = jax.random.PRNGKey(0)
    model = sims.model("drift_parking")  # learned from runs of a simulator; it carries its claim
    problem = sims.drift_parking.problem("rectangle")  # goal, two parked cars, outline
    answer = pj.Planner(model).solve(problem, key, pj.Settings(samples=20))
    print(answer.summary())

    plans = answer.sample(key, 1000)  # uniform over the set, (1000, 4): x, y, speed, sideslip
    print("speeds from", *np.round(np.quantile(plans[:, 2], [0, 1]), 2), "m/s")
    best, room = answer.best("clearance")
    print("the plan with the most room:", np.round(best, 3), f"({room:.2f} m)")
    assert answer.contains(p0=best[:2], k=best[2:])

    file = answer.save("answer.json")
    report = checker.check_answer(checker.load(file))  # another program, in exact arithmetic
    print("accepted:", report.samples, "samples and", report.corridors, "corridors")
