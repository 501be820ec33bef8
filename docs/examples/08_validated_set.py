"""A set of plans tested in its scene: the simulator is asked about drawn plans, and the largest set
that passes is kept.

The tube must hold every error in every scene. A scene asks for less, so this set is wider, at a
risk that is declared before the first run.
"""

import jax

import parc_jax as pj
import sims

if __name__ == "__main__":
    key = jax.random.PRNGKey(0)
    model = sims.model("drift_parking")
    # the closed-form plant, which the model was learned from
    car = sims.load("drift_parking", plant="ode", body="rectangle")
    problem = sims.drift_parking.problem("rectangle")
    tested = pj.drive.Validate(car, risk=0.05, delta=0.01)
    answer = pj.Planner(model).solve(problem, key, pj.Settings(samples=20), validate=tested)

    print(answer.summary())  # under the whole tube: sentences (C) and (E)
    validation = answer.validation
    assert validation is not None
    print(validation.details())  # sentence (V): of a plan drawn from the wider set
    wider = validation.answer  # None where no set passed
    if wider is not None and wider.share is not None:
        print(f"{wider.share.share:.1%} of the plans that aim at the goal are safe under its tube")
        print("three plans of it:", wider.sample(key, 3).round(2).tolist())
        wider.save("validated.json")  # (C) for its own tube, and (V)
