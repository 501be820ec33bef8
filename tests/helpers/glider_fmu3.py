"""The same as an FMU of FMI 3, without a gust."""

from pythonfmu3 import Float64, Fmi3Causality, Fmi3Slave, Fmi3Variability


class Glider3(Fmi3Slave):
    """x, y [m] from speeds."""

    def __init__(self, **given):
        super().__init__(**given)
        self.time, self.vx, self.vy, self.x, self.y = 0.0, 1.0, 0.0, 3.0, -1.0
        independent = {"causality": Fmi3Causality.independent}
        self.register_variable(
            Float64("time", variability=Fmi3Variability.continuous, **independent)
        )
        for name in ("vx", "vy"):
            self.register_variable(Float64(name, causality=Fmi3Causality.input))
        for name in ("x", "y"):
            self.register_variable(Float64(name, causality=Fmi3Causality.output))

    def do_step(self, t, dt):
        """Goes on by a step."""
        self.x = 3.0 + (t + dt) * self.vx
        self.y = -1.0 + (t + dt) * self.vy
        return True
