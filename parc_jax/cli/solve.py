"""`parc-jax solve`: the safe set of one scene."""

from pathlib import Path
from typing import Literal


def solve(
    model: Path,
    scene: Path,
    /,
    *,
    out: Path = Path("answer.json"),
    system: str | None = None,
    samples: int = 100,
    target: float = 0.01,
    confidence: float = 0.99,
    budget: float = 20.0,
    polytopes: bool = True,
    method: Literal["exact", "paper", "paper-lp"] = "exact",
    seed: int = 0,
    quiet: bool = False,
    json: bool = False,
    cache: bool = True,
) -> int:
    """Find and prove the safe starts and parameters of a scene. Example: parc-jax solve model.npz scene.toml

    A scene file names a goal, obstacles, a body and optionally a start set; `parc-jax systems NAME` prints one.

    Args:
        model: A model of `parc-jax learn` or `parc-jax run`.
        scene: The scene, .toml or .json.
        out: The answer file, with certificates; it is written in every case but bad input.
        system: Refuse a model of any other system.
        samples: Safe plans to return.
        target: Largest share of the safe set that the polytopes (without them: the corridors) may leave out.
        confidence: Confidence in that.
        budget: Most seconds to spend on covering the safe set.
        polytopes: Cut the corridors into polytopes of (p0, k). Corridors alone take a fraction of the time.
        method: The exact engine, or the published search by supports (paper) or linear programs (paper-lp).
        seed: Everything random follows from it.
        quiet: Print the verdict only.
        json: Print the result as JSON.
        cache: Keep compiled programs in the user's cache folder.
    """
    import jax

    from parc_jax.cli.cache import keep_compiled
    from parc_jax.cli.sense import require_sense
    from parc_jax.cli.verdict import as_json, verdict
    from parc_jax.errors import InputError
    from parc_jax.exchange.problem_file import load_problem
    from parc_jax.keys import Stage, stream
    from parc_jax.model import load
    from parc_jax.planner import Planner

    if cache:
        keep_compiled()
    if samples < 1 or not budget > 0:
        raise InputError(f"samples, budget: expected at least one sample and some seconds; got {samples}, {budget}.")
    planner, problem = Planner(load(model, system=system)), load_problem(scene)
    require_sense(problem, planner)
    key = jax.random.PRNGKey(seed)
    options = {"n_samples": samples, "target": target, "confidence": confidence, "method": method}
    options["polytopes"] = polytopes
    # compiles and answers once, so that the budget is spent on the safe set and not on the compiler
    apart = jax.random.fold_in(stream(key, Stage.SEARCH), 1)
    cold = planner.solve(problem, apart, budget_s=1e-3, no_plan_budget_s=0.0, proof=False, **options)
    answer = planner.solve(problem, key, budget_s=budget, **options)
    answer.save(out)
    if json:
        print(as_json(answer, out, cold.timings["first_sample_s"]))
    else:
        print(verdict(answer, out, cold.timings["first_sample_s"], short=quiet))
    return 0 if answer.found else 1
