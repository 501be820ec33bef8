"""Injected failures must never yield "safe", "empty" or "accepted". The gate allows no single one.

Lying host solver and lying batched kernel on programs whose truth is known; the published search
with every avoid-set LP in trouble; NaN and infinities in network, tube, margin and points, at
points that are safe without them; broken certificates. Counts are of injections and of wrong
verdicts (an "unknown" is never wrong).
"""

import copy
from itertools import islice
from unittest import mock

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import Metric, exact
from benchmarks.neuralparc.cells import cells_outward
from benchmarks.neuralparc.lp_batch import solve_batch
from benchmarks.neuralparc.lp_program import LPResult, LPStatus
from benchmarks.neuralparc.lp_solve import Hint, solve
from benchmarks.neuralparc.scene import paper_scene
from benchmarks.neuralparc.search import paper_search
from benchmarks.result import Result, Table
from benchmarks.workloads.lps import N, programs
from parc_jax import checker
from parc_jax.answer.answer import answer_data
from parc_jax.planner import Planner
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from sims.boxes_of_k import under

KINDS = ("solved", "empty", "unbounded", "trouble")
BAD = (np.nan, np.inf, -np.inf)


def run(bench: Bench) -> Result:
    """All five kinds of failure."""
    case, model = bench.model()
    problem, rng = case.problem(), np.random.default_rng(0)
    counts = {
        "lying_solver": _lying_solver(rng, bench.size(400, 8)),
        "lying_kernel": _lying_kernel(rng, bench.size(512, 64)),
        "solver_in_trouble": _solver_in_trouble(bench, model, problem),
    }
    sizes = {"samples": bench.size(50, 3), "target": 0.5}
    answer = Planner(model).solve(problem, bench.key(), Settings(**sizes, proof=False))
    data = answer_data(answer, answer.polytopes(bench.key(), bench.size(20_000, 500)))
    counts["arithmetic"] = _arithmetic(rng, model, problem, answer.samples, bench.size(200, 12))
    counts["certificates"] = _certificates(rng, data, bench.size(20, 1))
    metrics: list[Metric] = []
    for name, (injected, wrong) in counts.items():
        metrics += [
            exact(f"fails_safely.{name}.injected", injected),
            exact(f"fails_safely.{name}.wrong", wrong),
        ]
    rows = [(name.replace("_", " "), str(n), str(wrong)) for name, (n, wrong) in counts.items()]
    return Result(
        metrics, [Table("Injected failures", ("failure", "injected", "wrong verdicts"), rows)]
    )


def _wrong(status: int, empty: bool) -> bool:
    """A verdict that contradicts the truth."""
    claims_empty = status == int(LPStatus.INFEASIBLE)
    claims_point = status in (
        int(LPStatus.OPTIMAL),
        int(LPStatus.FEASIBLE),
        int(LPStatus.UNBOUNDED),
    )
    return (claims_empty and not empty) or (claims_point and empty)


def _lying_solver(rng, n: int) -> tuple[int, int]:
    """The host solver answers at random: any kind, random or non-finite vectors."""

    def liar(lp):
        def vector(size):
            v = rng.normal(size=size) * 10.0 ** rng.integers(-12, 12)
            return np.full(size, rng.choice(BAD)) if rng.random() < 0.2 else v

        rows = len(lp.A) + 2 * len(lp.E)
        return Hint(
            str(rng.choice(KINDS)),
            vector(lp.n),
            vector(rows),
            vector(len(lp.bound_rows()[1])),
            "injected",
        )

    c, A, b = programs(rng, n)
    with (
        mock.patch("benchmarks.neuralparc.lp_solve.clarabel_hint", liar),
        np.errstate(all="ignore"),
    ):
        verdicts = [int(solve(c[i], A[i], b[i]).status) for i in range(n)]
    return n, sum(_wrong(status, i % 2 == 0) for i, status in enumerate(verdicts))


def _lying_kernel(rng, n: int) -> tuple[int, int]:
    """The batched kernel proposes noise; the host solver decides what the checks refuse."""

    def liar(c, A, b):
        x, y = rng.normal(size=c.shape) * 1e3, rng.normal(size=b.shape)
        x[::5], y[::7] = np.nan, np.inf
        return x, y

    c, A, b = programs(rng, n)
    with mock.patch("benchmarks.neuralparc.lp_batch.propose", liar), np.errstate(all="ignore"):
        found = solve_batch(c, A, b, np.full(N, -10.0), np.full(N, 10.0))
    return n, sum(_wrong(int(status), i % 2 == 0) for i, status in enumerate(found.status))


def _solver_in_trouble(bench: Bench, model, problem) -> tuple[int, int]:
    """Every avoid-set LP of the published search stays undecided: no sample may be called safe."""
    injected = 0

    def trouble(*_):
        nonlocal injected
        injected += 1
        nothing = np.zeros(0)
        return LPResult(LPStatus.UNKNOWN, nothing, nothing, -np.inf, np.inf, "injected")

    table = enumerate_regions(model.net, model.domain)
    regions = islice(
        cells_outward(table, model.tube, 0.5 * (model.domain.lo + model.domain.hi)),
        bench.size(20, 2),
    )
    names = ("benchmarks.neuralparc.by_lp.membership", "benchmarks.neuralparc.by_lp.find_point")
    with mock.patch(names[0], trouble), mock.patch(names[1], trouble):
        found = paper_search(
            bench.key(),
            regions,
            paper_scene(problem, model.tube),
            method="lp",
            samples=bench.size(10, 2),
        )
    return injected, len(found.samples)


def _arithmetic(rng, model, problem, plans: np.ndarray, n: int) -> tuple[int, int]:
    """One bad number in network, tube, margin or point: none of the safe plans may stay safe."""
    scene, wrong = scene_of(problem, model), 0
    p0, k = plans[:, : model.n_p], plans[:, model.n_p :]
    assert verdicts(scene, p0, k).safe.all()
    for i in range(n):
        bad_scene, bad_p0, bad_k, bad = (
            scene,
            p0.copy(),
            k.copy(),
            rng.choice(BAD),
        )
        match i % 5:
            case 0:
                bad_scene = under(scene, model.replace(net=_bad_network(rng, model.net, bad)))
            case 1:
                claim = copy.copy(model.claim)
                tube = claim.tube
                interval, final = (
                    np.full_like(tube.interval, abs(bad)),
                    np.full_like(tube.final, abs(bad)),
                )
                object.__setattr__(claim, "tube", tube.replace(interval=interval, final=final))
                bad_scene = under(scene, model.replace(claim=claim))
            case 2:
                bad_scene = scene.replace(slack=np.float64(abs(bad)))
            case 3:
                bad_p0[:, rng.integers(model.n_p)] = bad
            case 4:
                bad_k[:, rng.integers(model.n_k)] = bad
        wrong += int(verdicts(bad_scene, bad_p0, bad_k).safe.any())
    return n, wrong


def _bad_network(rng, net, bad: float):
    """NaN in any layer, or an infinity in an output row, which every path goes through."""
    layer = rng.integers(len(net.weights)) if np.isnan(bad) else len(net.weights) - 1
    biases = [b.copy() for b in net.biases]
    biases[layer][rng.integers(len(biases[layer]))] = bad
    return net.replace(biases=tuple(biases))


def _certificates(rng, data: dict, n: int) -> tuple[int, int]:
    """Broken certificates of samples, sets and corridors, each provably wrong: all must be
    rejected.
    """
    context = checker.Context(data["problem"], data["network"], data["tube"])
    injected = accepted = 0

    def check_corridor(entry):
        checker.check_answer(data | {"samples": [], "sets": [], "corridors": [entry]})

    check_corridor(data["samples"][0])  # whole, it is accepted
    for part, check in (
        ("samples", context.check_sample),
        ("sets", context.check_set),
        ("samples", check_corridor),
    ):
        for entry in data[part][:n]:
            for broken in _broken(rng, entry):
                injected += 1
                try:
                    check(broken)
                    accepted += 1
                except checker.Rejected:
                    pass
    return injected, accepted


def _turned(runs: list) -> list:
    """Runs in the opposite directions."""
    return [[end, [[r, "-" + v] for r, v in w]] for end, w in runs]


def _broken(rng, entry: dict):
    """Copies of a certificate with one thing wrong each."""
    for change in (
        {"p0": [(float.fromhex(x) + 1e3).hex() for x in entry["p0"]]},
        {"k": [(float.fromhex(x) + 1e3).hex() for x in entry["k"]]},
        {"p0": ["nan"] * len(entry["p0"])},
        {"sep": entry["sep"][:-1]},
        {"sep": [[[]] * len(parts) for parts in entry["sep"]]},
        {"sep": [[_turned(runs) for runs in parts] for parts in entry["sep"]]},
    ):
        yield entry | change
    if "pattern" in entry:
        i = int(rng.integers(len(entry["pattern"])))
        flipped = "10"[int(entry["pattern"][i])]
        yield entry | {"pattern": entry["pattern"][:i] + flipped + entry["pattern"][i + 1 :]}
        yield entry | {"bin": entry["bin"] + 1}
