"""bound_propagation: interval, CROWN and optimised CROWN bounds over boxes. Runs alone, in its own
environment.

`python peer_bound_propagation.py work.npz result.npz`; both files as `benchmarks.peers.__main__`
says.
"""

import sys
from importlib.metadata import version

import numpy as np
import torch
from bound_propagation import BoundModelFactory, HyperRectangle
from peer_record import record


def network(work) -> torch.nn.Sequential:
    """The trajectory network in PyTorch, float64."""
    layers, count = [], int(work["layers"])
    for i in range(count):
        W, b = work[f"W{i}"], work[f"b{i}"]
        layer = torch.nn.Linear(W.shape[1], W.shape[0]).double()
        layer.weight.data, layer.bias.data = torch.from_numpy(W.copy()), torch.from_numpy(b.copy())
        layers += [layer, torch.nn.ReLU()]
    return torch.nn.Sequential(*layers[:-1])


def methods(net, boxes):
    """Bounds (b, n_out), (b, n_out) over all boxes, by name."""

    def intervals():
        out = net.ibp(boxes)
        return out.lower, out.upper

    def linear(**options):
        def call():
            out = net.crown(boxes, **options).concretize()
            return out.lower, out.upper

        return call

    return {
        "bound_propagation, intervals": intervals,
        "bound_propagation, CROWN": linear(),
        "bound_propagation, optimised CROWN": linear(alpha=True),
    }


def main(source: str, target: str) -> None:
    """Bounds and times of every method over all boxes."""
    torch.set_default_dtype(torch.float64)
    work = np.load(source)
    net = BoundModelFactory().build(network(work))
    boxes = HyperRectangle(torch.from_numpy(work["lo"].copy()), torch.from_numpy(work["hi"].copy()))
    out = {"version": version("bound_propagation"), "on": f"torch {version('torch')}"}
    for number, (name, call) in enumerate(methods(net, boxes).items()):
        arrays = lambda call=call: [x.detach().numpy() for x in call()]  # noqa: E731
        out |= record(number, name, arrays, int(work["repeats"]))
    np.savez(target, **out)


if __name__ == "__main__":
    main(*sys.argv[1:])
