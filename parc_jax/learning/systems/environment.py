"""An environment with a policy, in the manner of Gymnasium, as a function for `python_system`."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class EnvironmentRun:
    """simulate(rng, k): one episode of an environment under a policy that k steers. Picklable if
    its parts are.

    make: () -> environment with reset(seed=, options=) -> (observation, info) and step(action) ->
    (observation, reward, terminated, truncated, info), as Gymnasium's have; Gymnasium itself is not
    needed.
    policy: (observation, k (n_k,)) -> action. n_record: steps per episode, one record each.
    position: (environment, observation) -> workspace position (n_p,), of m reference points (m,
        n_p). final: (environment, observation) -> q (n_q,).
    options: k -> the options of reset; an environment that knows k at reset gets it here.
    An episode that ends early counts as a failed run: say in `make` when it must not end.
    """

    make: Callable
    policy: Callable
    n_record: int
    position: Callable
    final: Callable
    options: Callable | None = None

    def __call__(self, rng: np.random.Generator, k: np.ndarray):
        """Positions (n_record + 1, n_p), or (n_record + 1, m, n_p), and goal states (n_q,)."""
        environment = self.make()
        try:
            options = None if self.options is None else self.options(k)
            seen, _ = environment.reset(seed=int(rng.integers(2**31)), options=options)
            positions = [self._position(environment, seen)]
            for step in range(self.n_record):
                seen, _, terminated, truncated, _ = environment.step(self.policy(seen, k))
                positions.append(self._position(environment, seen))
                if (terminated or truncated) and step + 1 < self.n_record:
                    raise RuntimeError(
                        f"the episode ended after {step + 1} of {self.n_record} steps"
                    )
            return np.stack(positions), np.asarray(self.final(environment, seen), np.float64)
        finally:
            getattr(environment, "close", lambda: None)()

    def _position(self, environment, seen) -> np.ndarray:
        # a copy: many environments write the next observation into the same array
        return np.array(self.position(environment, seen), np.float64)
