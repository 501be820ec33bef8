"""A glider that is exported as an FMU: drives k in a second, in a gust that its seed decides."""

import random

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class Glider(Fmi2Slave):
    """x, y [m] and heading [rad] from speeds, a gust and a seed."""

    def __init__(self, **given):
        super().__init__(**given)
        self.vx, self.vy, self.gust, self.seed = 1.0, 0.0, 0.02, 0
        self.x, self.y, self.heading, self.steps = 3.0, -1.0, 0.0, 0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for name in ("vx", "vy", "gust"):
            self.register_variable(Real(name, **fixed))
        self.register_variable(Integer("seed", **fixed))
        for name in ("x", "y", "heading"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        counted = {"causality": Fmi2Causality.output, "variability": Fmi2Variability.discrete}
        self.register_variable(Integer("steps", **counted))

    def do_step(self, t, dt):
        if t == 0.0:
            rng = random.Random(self.seed)
            self.push = rng.gauss(0.0, self.gust), rng.gauss(0.0, self.gust)
        self.steps += 1
        s = t + dt
        self.x = 3.0 + s * self.vx + s * s * self.push[0]
        self.y = -1.0 + s * self.vy + s * s * self.push[1]
        self.heading = s * self.vy
        return self.vx < 0.95 or s < 0.5  # a stall
