"""immrax: interval and linear bounds of every output over boxes of inputs. Runs alone, in its own
environment.

`python peer_immrax.py work.npz result.npz`; both files as `benchmarks.peers.__main__` says.
"""

import sys
from importlib.metadata import version

import immrax
import jax
import jax.numpy as jnp
import numpy as np
from peer_record import record


def network(weights, biases):
    """The trajectory network as a JAX function of one input."""

    def net(k):
        for W, b in zip(weights[:-1], biases[:-1], strict=True):
            k = jnp.maximum(W @ k + b, 0.0)
        return weights[-1] @ k + biases[-1]

    return net


def methods(net):
    """Bounds (n_out,), (n_out,) over one box, by name."""

    def intervals(lo, hi):
        out = immrax.natif(net)(immrax.interval(lo, hi))
        return out.lower, out.upper

    def linear(bounds):
        def call(lo, hi):
            box = immrax.interval(lo, hi)
            out = bounds(net)(box)(box)
            return out.lower, out.upper

        return call

    return {
        "immrax, intervals": intervals,
        "immrax, Fast-Lin": linear(immrax.fastlin),
        "immrax, CROWN": linear(immrax.crown),
    }


def main(source: str, target: str) -> None:
    """Bounds and times of every method over all boxes."""
    jax.config.update("jax_enable_x64", True)
    work = np.load(source)
    weights, biases = (
        [jnp.asarray(work[f"{name}{i}"]) for i in range(int(work["layers"]))] for name in "Wb"
    )
    net = network(weights, biases)
    out = {"version": version("immrax"), "on": f"jax {jax.__version__}"}
    for number, (name, method) in enumerate(methods(net).items()):
        bounds = jax.jit(jax.vmap(method))

        def call(bounds=bounds):
            return jax.block_until_ready(bounds(work["lo"], work["hi"]))

        out |= record(number, name, call, int(work["repeats"]))
    np.savez(target, **out)


if __name__ == "__main__":
    main(*sys.argv[1:])
