"""`parc-jax learn`: a model of a system, or of logged data, with an honest error bound."""

import contextlib
import io
import shutil
from dataclasses import replace
from pathlib import Path


def learn(
    source: str,
    /,
    *,
    out: Path,
    plant: str | None = None,
    body: str | None = None,
    rollouts: int | None = None,
    hidden: tuple[int, ...] | None = None,
    bins: tuple[int, ...] | None = None,
    shape: str | None = None,
    eps: float | None = None,
    delta: float | None = None,
    claims: tuple[str, ...] | None = None,
    blocks: tuple[int, ...] | None = None,
    fresh: int | None = None,
    discard: int | None = None,
    seeds: int | None = None,
    steps: int | None = None,
    dt: float | None = None,
    t_f: float | None = None,
    dt_record: float | None = None,
    points: tuple[str, ...] | None = None,
    holdout: float | None = None,
    domain: tuple[float, ...] | None = None,
    k_law: str | None = None,
    search: int | None = None,
    gap: float | None = None,
    seed: int = 0,
    quiet: bool = False,
    json: bool = False,
    cache: bool = True,
) -> int:
    """Learn a trajectory model and bound its error. Example: parc-jax learn drift_parking --out
    model.npz

    From logged runs: parc-jax learn logs.npz --dt 0.1 --t-f 4 --dt-record 0.05 --out model.npz

    Args:
        source: A system of `parc-jax systems`, a module of yours with `system()`, or logged runs
            (.npz, .mat, folder).
        out: The model file. Unfinished work is kept beside it, in OUT.unfinished.
        plant: Plant of the simulator, e.g. mjx or ode. Default: the system's own.
        body: Body of the robot, which says what points of it are learned, e.g. rectangle or disc.
            Default: its study's, or the system's own.
        rollouts: Number of training rollouts. Default: the study's, or 10,000.
        hidden: Widths of the hidden layers. Default: the study's, or 8 8 8 8.
        bins: Bins per axis of K over which the tube's profile varies. Default: cut where the error
            changes.
        shape: Shape of the tube: "box", half widths along the axes, or "fitted", faces along the
            principal axes of the errors beside them. Default: box, or the study's.
        eps: Probability with which a new run may leave the tube. Default: the study's, or 0.001.
        delta: One minus the confidence in that. Default: the study's, or 0.001.
        claims: "one" over all of K, "bins" in every bin at once; the first is the one of the model.
            Default: the study's, or one.
        blocks: Claims per axis of K where "bins" is asked for, each about a block of neighbouring
            bins. Default: the study's, or every bin.
        fresh: Runs behind the claims. Default: as many as they need, or the study's.
        discard: Runs to leave outside of the tube, fixed before any is seen; with 0 the claim
            carries the eps that the runs support. Default: as many as eps and delta allow.
        seeds: Networks trained, of which the best is kept. Default: the study's, or 6.
        steps: Training steps. Default: the study's, or 3,000.
        dt: Logged runs only: time between model knots [s]. Default: the file's own, if it has one.
        t_f: Logged runs only: length of a run [s]. Default: the file's own, if it has one.
        dt_record: Logged runs only: time between records [s]. Default: dt.
        points: Logged runs only: names of the robot's reference points, in the order of the
            columns. Default: the file's own, or one point.
        holdout: Logged runs only: share of the runs set aside for the bound. Default: 0.4.
        domain: Logged runs only: K as LO HI for every parameter. Default: the box of all k.
        k_law: Logged runs only: "uniform" if all k were drawn uniformly from the domain; only then
            does the claim speak of shares of K, and k that refute it are refused. Default:
            "logged".
        search: Runs spent looking for bad ones on purpose, which can only widen the tube; 0 for
            none. Default: as many as the fresh runs, 2,048 at most.
        gap: Most that the start of a run may matter [m or rad]. It is tried from a few starts, a
            larger effect is refused, and the tube is widened by it. Default: the study's, or 1e-05.
        seed: Everything random follows from it.
        quiet: No progress bars.
        json: Print the result as JSON.
        cache: Keep compiled programs in the user's cache folder.
    """
    from parc_jax.cli.cache import keep_compiled
    from parc_jax.cli.help import fitted
    from parc_jax.cli.learning import Log, from_log, from_system, refuse_options, summary
    from parc_jax.cli.lock import held
    from parc_jax.cli.places import require_place
    from parc_jax.cli.systems import black_box_of, find
    from parc_jax.cli.unfinished import only_of
    from parc_jax.experiment.settings import Study, checked
    from parc_jax.keys import check_seed

    check_seed(seed)
    if cache:
        keep_compiled()
    given = {
        "hidden": hidden,
        "bins": bins,
        "shape": shape,
        "rollouts": rollouts,
        "eps": eps,
        "delta": delta,
        "seeds": seeds,
        "steps": steps,
        "gap": gap,
        "claims": claims,
        "blocks": blocks,
        "fresh": fresh,
        "discard": discard,
        "search": search,
    }
    given = {name: value for name, value in given.items() if value is not None}
    require_place(out)
    work = out.with_name(f"{out.name}.unfinished")
    logged = {
        "dt": dt,
        "t-f": t_f,
        "dt-record": dt_record,
        "points": points,
        "holdout": holdout,
        "domain": domain,
        "k-law": k_law,
    }
    with held(out):
        if Path(source).suffix in (".npz", ".mat") or Path(source).is_dir():
            run_anew = ("rollouts", "fresh", "search")
            not_of_a_log = {"plant": plant, "body": body} | {n: given.get(n) for n in run_anew}
            refuse_options(not_of_a_log, source, "a system that can be run")
            study = checked(replace(Study(), **given))
            share, law = 0.4 if holdout is None else holdout, k_law or "logged"
            log = Log(Path(source), (dt, t_f, dt_record), domain, law, share, points)
            learned = from_log(log, study, seed)
            learned.main.save(out)
        else:
            refuse_options(logged, source, "logged runs")
            module = find(source, needed=("system",))
            study = checked(replace(getattr(module, "STUDY", Study()), **given))
            # the simulator's libraries print to stdout on import
            with contextlib.redirect_stdout(io.StringIO()):
                black_box = black_box_of(module, plant or study.plant, body or study.body)
            with only_of(module, work):
                learned = from_system(black_box, study, seed, work, quiet)
                learned.main.save(out)
            shutil.rmtree(work, ignore_errors=True)
    print(summary(learned, out, as_json=True) if json else fitted(summary(learned, out)))
    return 0 if learned.main.tube.claimed.any() else 1
