"""Bounds of the network over a grid of boxes, by us and by peers: `python -m benchmarks.peers
--model MODEL`.

Every peer runs in an environment of its own, made here with pip from its public release, and gets
one file: the weights W0, b0, ..., the boxes lo, hi (b, n_k), and how often to repeat. It writes
    lower, upper (b, n_out) and times.
"""

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import tyro

from benchmarks.environment import environment
from benchmarks.neuralparc.sets.operations import clip_to_box
from parc_jax.learning.model import TrajectoryModel, load
from parc_jax.proof.regions import enumerate_regions

PEERS = {
    "peer_immrax.py": ("immrax==0.3.8",),
    "peer_bound_propagation.py": ("bound-propagation==0.4.7", "torch"),
}


@dataclass(frozen=True)
class Options:
    """Peers on the piece we share with them."""

    model: Path
    """A saved model."""
    per_axis: int = 16
    """Boxes along each axis of K."""
    repeats: int = 5
    """Warm calls of each method."""
    environments: Path = Path.home() / ".cache" / "parc_jax" / "peers"
    """Where the peers are installed, once."""
    page: Path | None = None
    """Write the table here, as Markdown."""


def boxes(model: TrajectoryModel, per_axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (b, n_k) of a grid of boxes over K."""
    edges = [
        np.linspace(a, b, per_axis + 1)
        for a, b in zip(model.domain.lo, model.domain.hi, strict=True)
    ]
    index = np.stack(np.meshgrid(*[np.arange(per_axis)] * model.n_k, indexing="ij"), -1).reshape(
        -1, model.n_k
    )
    at = [
        np.stack([edges[i][index[:, i] + side] for i in range(model.n_k)], axis=1)
        for side in (0, 1)
    ]
    return at[0], at[1]


def exact(model: TrajectoryModel, lo, hi) -> tuple[np.ndarray, np.ndarray]:
    """Range (b, n_out) of every output over every box, attained up to rounding: extremes lie at
    vertices of regions.
    """
    table = enumerate_regions(model.net, model.domain)
    C, d = table.maps(np.arange(table.count))
    below, above = np.full((len(lo), len(d[0])), np.inf), np.full((len(lo), len(d[0])), -np.inf)
    for r in range(table.count):
        corners = table.region_vertices(r)
        for i in np.flatnonzero(
            (lo < corners.max(axis=0)).all(axis=1) & (hi > corners.min(axis=0)).all(axis=1)
        ):
            part = clip_to_box(corners, lo[i], hi[i])
            if len(part):
                values = part @ C[r].T + d[r]
                below[i], above[i] = (
                    np.minimum(below[i], values.min(axis=0)),
                    np.maximum(above[i], values.max(axis=0)),
                )
    return below, above


def ours(model: TrajectoryModel, lo, hi, repeats: int) -> dict:
    """The same piece by regions, enumerated anew in every repetition."""
    spent = []
    for _ in range(repeats + 1):
        begin = time.perf_counter()
        below, above = exact(model, lo, hi)
        spent.append(time.perf_counter() - begin)
    return {
        "name0": "parc_jax, regions",
        "lower0": below,
        "upper0": above,
        "cold0": spent[0],
        "warm0": spent[1:],
    }


def peer(script: str, needs: tuple[str, ...], work: Path, environments: Path) -> dict:
    """Run a peer in its own environment, installed on first use."""
    home = environments / Path(script).stem
    python = home / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", home], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "numpy", *needs], check=True)
    result = work.with_name(f"{Path(script).stem}.npz")
    subprocess.run(
        [python, "-W", "ignore", Path(__file__).with_name(script), work, result], check=True
    )
    with np.load(result) as found:
        return dict(found)


def rows(results: list[dict]) -> list[dict]:
    """One row per method. width: mean over boxes and outputs of the bound's width, in exact
    widths.
    """
    below, above = results[0]["lower0"], results[0]["upper0"]
    width = above - below
    out = []
    for found in results:
        for n in (key[4:] for key in found if key.startswith("name")):
            lower, upper = found[f"lower{n}"], found[f"upper{n}"]
            slip = 1e-9 * np.abs(above).max()
            if (lower > below + slip).any() or (upper < above - slip).any():
                raise SystemExit(
                    f"{found[f'name{n}']}: a bound is inside of what the network attains."
                )
            out.append(
                {
                    "method": str(found[f"name{n}"]),
                    "version": str(found.get("version", "")),
                    "width": float((upper - lower).sum() / width.sum()),
                    "cold_s": float(found[f"cold{n}"]),
                    "warm_s": float(np.median(found[f"warm{n}"])),
                    "spread_s": float(np.ptp(found[f"warm{n}"])),
                }
            )
    return out


def table(found: list[dict]) -> str:
    """The rows as Markdown."""
    lines = [
        "| method | version | width of the bounds, exact = 1 | first call | later calls, median "
        "(range) |"
    ]
    lines.append("| --- | --- | --- | --- | --- |")
    for row in found:
        times = (
            f"{row['cold_s']:.3g} s | {1e3 * row['warm_s']:.3g} ms ({1e3 * row['spread_s']:.2g})"
        )
        lines.append(f"| {row['method']} | {row['version']} | {row['width']:.3g} | {times} |")
    return "\n".join(lines)


def main(options: Options) -> None:
    """Measure and print."""
    model = load(options.model)
    lo, hi = boxes(model, options.per_axis)
    weights = {f"W{i}": W for i, W in enumerate(model.net.weights)}
    weights |= {f"b{i}": b for i, b in enumerate(model.net.biases)}
    with TemporaryDirectory() as folder:
        work = Path(folder) / "work.npz"
        np.savez(
            work, layers=len(model.net.weights), lo=lo, hi=hi, repeats=options.repeats, **weights
        )
        results = [ours(model, lo, hi, options.repeats)]
        results += [
            peer(script, needs, work, options.environments) for script, needs in PEERS.items()
        ]
    found = rows(results)
    widths = "-".join(str(n) for n in model.net.hidden)
    head = (
        f"Network {widths}, {len(results[0]['lower0'][0])} outputs, {len(lo)} boxes. "
        f"{json.dumps(environment())}"
    )
    text = f"{table(found)}\n\n{head}\n"
    print(text)
    if options.page is not None:
        options.page.write_text(text)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
