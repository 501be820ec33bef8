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
    work: float = 1.0,
    budget: float = 600.0,
    polytopes: bool = False,
    method: Literal["exact", "paper", "paper-lp"] = "exact",
    at: str | None = None,
    first: bool = False,
    doubt_start: tuple[float, ...] | None = None,
    doubt_heading: float | None = None,
    doubt_k: tuple[str, ...] | None = None,
    doubt_goal: tuple[float, ...] | None = None,
    given: tuple[str, ...] | None = None,
    unknown: tuple[str, ...] | None = None,
    sensing_eps: str | None = None,
    seed: int = 0,
    quiet: bool = False,
    json: bool = False,
    cache: bool = True,
) -> int:
    """Find and prove the safe starts and parameters of a scene. Example: parc-jax solve model.npz
    scene.toml

    A scene file names a goal, obstacles, a body and optionally a start set; `parc-jax systems NAME`
    prints one.

    Args:
        model: A model of `parc-jax learn` or `parc-jax run`.
        scene: The scene, .toml or .json.
        out: The answer file, with certificates; it is written in every case but bad input.
        system: Refuse a model of any other system. Default: take it.
        samples: Safe plans to return.
        target: Largest share of the safe set that the corridors (with --polytopes, these too) may
            leave out.
        confidence: Confidence in that.
        work: The most that is done, as a multiple of the standard: 60 looks at fresh draws, 4,096
            corridors tried, and 1,000 boxes for a proof where no plan is found. The same seed gives
            the same answer, however busy the machine.
        budget: A limit in seconds above the work; the answer says when it cut something off.
        polytopes: Cut the corridors into polytopes of (p0, k), for pictures of them and for
            optimisers of yours. Corridors alone take a fraction of the time.
        method: The exact engine, or the published search by supports (paper) or linear programs
            (paper-lp).
        at: Where the robot is, x,y or x,y,heading: which k may it drive from here? With a heading
            [rad] the scene is solved in the robot's frame. Default: from anywhere in its start set.
        first: Stop at the first plan, proved: no sets, no shares.
        doubt_start: Half widths [m] of a box around the start within which it may be; see also the
            table [doubt] of a scene, which these options replace entry by entry.
        doubt_heading: Half angle [rad] around the heading at the start.
        doubt_k: By how much parameters may be executed wrongly, e.g. speed=0.1.
        doubt_goal: Half widths [m] by which the goal may be seen wrongly.
        given: Parameters that are measured and not chosen, e.g. speed=9.2 load=1:2.
        unknown: Parameters that nobody chooses, e.g. wind=-1:1; a plan is safe for all of it.
        sensing_eps: Probability with which what was measured lies outside of these boxes.
        seed: Everything random follows from it.
        quiet: Print the verdict only.
        json: Print the result as JSON.
        cache: Keep compiled programs in the user's cache folder.
    """
    import sys

    from parc_jax.cli.cache import keep_compiled
    from parc_jax.cli.doubt import numbers_of_option, under_doubt
    from parc_jax.cli.goal_in_reach import odd_size, require_goal_in_reach
    from parc_jax.cli.help import fitted
    from parc_jax.cli.places import require_place
    from parc_jax.cli.saying import saying
    from parc_jax.cli.verdict import as_json, verdict
    from parc_jax.errors import InputError
    from parc_jax.io.problem_file import labelled, load_problem
    from parc_jax.keys import key_of
    from parc_jax.methods import Exact, Published
    from parc_jax.model import load
    from parc_jax.planner import Planner
    from parc_jax.settings import Settings

    if cache:
        keep_compiled()
    if model.suffix in (".toml", ".json") and scene.suffix == ".npz":
        raise InputError(
            f"solve: expected the model first and then the scene; got {model} and {scene}. Swap "
            "the two."
        )
    require_place(out)
    learned = load(model, system=system)
    problem = under_doubt(
        load_problem(scene, learned.points),
        start=doubt_start,
        heading=doubt_heading,
        k=doubt_k,
        goal=doubt_goal,
        given=given,
        unknown=unknown,
        sensing_eps=sensing_eps,
    )
    planner = Planner(labelled(learned, scene))
    if not first:
        require_goal_in_reach(problem, planner)
    key = key_of(seed)
    methods = {"exact": Exact(), "paper": Published(), "paper-lp": Published(lps=True)}
    settings = Settings(
        n_samples=samples,
        target=target,
        confidence=confidence,
        work=work,
        budget_s=budget,
        polytopes=polytopes,
        method=methods[method],
    )
    place = None if at is None else numbers_of_option("at", at)
    planner.prepare(problem, at=place)  # what does not fit is told before anything is done
    odd = odd_size(problem, planner.model)
    if odd is not None:
        print(odd, file=sys.stderr)
    with saying(quiet) as say:
        if first:
            say("compiling, and looking for a safe plan")
            one = Settings.fast()
            settings = one.replace(n_samples=1, proof=True, budget_s=budget, method=settings.method)
            answer = planner.solve(problem, key, settings, at=place)
            cold_s = answer.timings["first_sample_s"]
        else:
            # so that the times are those of the search and not of the compiler
            say("compiling")
            cold_s = planner.warm_up(problem, settings, at=place).timings["first_sample_s"]
            say("looking for safe plans, or for a proof that there are none")
            answer = planner.solve(problem, key, settings, at=place)
    answer.save(out)
    if json:
        print(as_json(answer, out, cold_s))
    else:
        print(fitted(verdict(answer, out, cold_s, short=quiet)))
    return 0 if answer.found else 1
