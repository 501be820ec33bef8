"""`parc-jax run`: the main job."""

import contextlib
import io
from dataclasses import replace
from pathlib import Path


def run(
    system: str,
    /,
    *,
    out: Path | None = None,
    model: Path | None = None,
    seed: int = 0,
    plant: str | None = None,
    body: str | None = None,
    hidden: tuple[int, ...] | None = None,
    bins: tuple[int, ...] | None = None,
    shape: str | None = None,
    rollouts: int | None = None,
    eps: float | None = None,
    delta: float | None = None,
    claims: tuple[str, ...] | None = None,
    blocks: tuple[int, ...] | None = None,
    fresh: int | None = None,
    discard: int | None = None,
    search: int | None = None,
    gap: float | None = None,
    samples: int | None = None,
    repeats: int | None = None,
    driven: bool | None = None,
    work: float | None = None,
    budget: float | None = None,
    figures: bool = True,
    quiet: bool = False,
    json: bool = False,
    cache: bool = True,
    hosts: str | None = None,
) -> int:
    """Learn a system, find its safe set, prove it, replay it, draw it. Example: parc-jax run
    drift_parking

    A system may have a study of its own, a function `job` beside `system` and `problem`, and then
    that is what runs; it takes the options that make sense for it, and refuses the others.

    Args:
        system: A system of `parc-jax systems`, or a module of your own with `system()` and
            `problem()`.
        out: Folder for model, answer, metrics and figures. Default: runs/SYSTEM, with .NAME behind
            it where a module's system has another name than the module.
        model: A saved model, in place of rollouts and training.
        seed: Everything random follows from it.
        plant: Plant of the simulator for everything, e.g. mjx or ode. Default: the system's own,
            for learning its study's.
        body: Body of the robot, e.g. rectangle or disc. Default: its study's, or the scene's own.
        hidden: Widths of the hidden layers. Default: the system's own.
        bins: Bins per axis of K over which the tube's profile varies. Default: cut where the error
            changes.
        shape: Shape of the tube: "box", half widths along the axes, or "fitted", faces along the
            principal axes of the errors beside them. Default: box, or the study's.
        rollouts: Number of training rollouts. Default: the study's, or 10,000.
        eps: Probability with which a new run may leave the tube. Default: the study's, or 0.001.
        delta: One minus the confidence in that. Default: the study's, or 0.001.
        claims: "one" over all of K, "bins" in every bin at once; the first is the one returned, the
            others compared. Default: the study's, or one.
        blocks: Claims per axis of K where "bins" is asked for, each about a block of neighbouring
            bins. Default: the study's, or every bin.
        fresh: Runs behind the claims. Default: as many as they need, or the study's.
        search: Runs spent looking for bad ones on purpose, which can only widen the tube; 0 for
            none. Default: as many as the fresh runs, 2,048 at most.
        discard: Runs to leave outside of the tube, fixed before any is seen; with 0 the claims
            carry the eps that the runs support. Default: as many as eps and delta allow.
        gap: Most that the start of a run may matter [m or rad]. It is tried from a few starts, a
            larger effect is refused, and the tube is widened by it. Default: the study's, or 1e-05.
        samples: Safe plans to return. Default: the study's, or 100.
        repeats: Runs of each returned plan in the replay. Default: the study's, or 1.
        driven: Choose one plan, run it afresh and make a local claim near it, and say what is then
            known of it. Default: as its study says.
        work: The most that is done to cover the safe set, as a multiple of the standard (`solve
            --help` says of what). Default: the study's, or 1.0.
        budget: A limit in seconds above that work; the answer says when it cut something off.
            Default: the study's, or 600.0.
        figures: Draw the figures.
        quiet: No progress bars.
        json: Print the metrics as JSON instead of the table.
        cache: Keep compiled programs in the user's cache folder.
        hosts: Share rollouts and error claims with other processes that run the same command:
            "auto" reads the cluster's environment, "ADDRESS:PORT,COUNT,NUMBER" names the first
            process, how many and which one. Default: this process alone.
    """
    from parc_jax.cli.cache import keep_compiled
    from parc_jax.cli.help import fitted
    from parc_jax.cli.lock import held
    from parc_jax.cli.places import require_place
    from parc_jax.cli.systems import black_box_of, build, find
    from parc_jax.cli.unfinished import only_of
    from parc_jax.experiment.figures import figures as draw_figures
    from parc_jax.experiment.job import METRICS, UNFINISHED, finish, run_study
    from parc_jax.experiment.report import report
    from parc_jax.experiment.settings import Study
    from parc_jax.keys import check_seed
    from parc_jax.model import load

    check_seed(seed)
    if cache:
        keep_compiled()
    module = find(system)
    given = {
        "hidden": hidden,
        "bins": bins,
        "shape": shape,
        "rollouts": rollouts,
        "eps": eps,
        "delta": delta,
        "claims": claims,
        "blocks": blocks,
        "fresh": fresh,
        "discard": discard,
        "search": search,
        "gap": gap,
        "samples": samples,
        "repeats": repeats,
        "driven": driven,
        "work": work,
        "budget_s": budget,
    }
    if hasattr(module, "job"):
        out = out or Path("runs") / system
        given |= {
            "out": out,
            "model": model,
            "plant": plant,
            "body": body,
            "hosts": hosts,
        }
        with held(out):
            return build(module, "job", **given, seed=seed, figures=figures, quiet=quiet, json=json)
    host = _join(hosts)
    study = replace(
        getattr(module, "STUDY", Study()), **{k: v for k, v in given.items() if v is not None}
    )
    with contextlib.redirect_stdout(
        io.StringIO()
    ):  # the simulator's libraries print to stdout on import
        body = body or study.body
        black_box, problem = (
            black_box_of(module, plant, body),
            build(module, "problem", body=body),
        )
        learn_from = (
            black_box_of(module, study.plant, body) if plant is None and study.plant else black_box
        )
    out = _folder_of(host, out or Path("runs") / _own_name(system, black_box.name))
    for name in ("model.npz", "answer.json", METRICS):
        require_place(out / name)
    saved = None if model is None else load(model)
    with held(out):
        with only_of(module, out / UNFINISHED):
            outcome = run_study(black_box, problem, study, out, seed, saved, quiet, learn_from)
        if host > 0:  # the first one reports
            return 0
        if figures:
            files = draw_figures(outcome, study, out)
            outcome = outcome._replace(
                metrics=finish(out, outcome.metrics | {"figures": [f.name for f in files]})
            )
    if json:
        import json as as_json

        print(as_json.dumps(outcome.metrics, indent=1))
    else:
        print(fitted(report(outcome)))
        print(f"Written to {out}. Verify with: parc-jax check {out / 'answer.json'}")
    return 0 if outcome.answer.found else 1


def _join(hosts: str | None) -> int:
    """Join the other processes, if there are any; the number of this one. Call before anything else
    uses JAX.
    """
    if hosts is None:
        return 0
    from parc_jax import distributed

    distributed.init(hosts)
    import jax

    return jax.process_index()


def _own_name(typed: str, name: str) -> str:
    """What the results of a system are kept under: modules whose systems share a name, and systems
    that share a module, do not share a folder.
    """
    return typed if typed.rpartition(".")[2] == name else f"{typed}.{name}"


def _folder_of(host: int, out: Path) -> Path:
    """The first host owns `out`; the others keep their finished chunks in a folder each, shared
    disk or not.
    """
    return out if host == 0 else out / "hosts" / str(host)
