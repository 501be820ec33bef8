"""`parc-jax learn`: a model of a system, or of logged data, with an honest error bound."""

import shutil
from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.options import Offer, Shell
from parc_jax.common.errors import InputError


def learn(
    source: str,
    /,
    *,
    out: Path,
    study: Annotated[dict, Offer("learning.learn.Learning", left_out="the study's, or ")],
    logged: Annotated[dict, Offer("app.cli.logged.Logged", left_out="")],
    shell: Annotated[Shell, Offer("app.cli.options.Shell")],
) -> int:
    """Learn a trajectory model and bound its error. Example: parc-jax learn drift_parking --out
    model.npz

    From logged runs: parc-jax learn logs.npz --dt 0.1 --t-f 4 --dt-record 0.05 --out model.npz;
    from few of them, add --prior twist.

    Args:
        source: A system of `parc-jax systems`, a module of yours with `system()`, logged runs
            (.npz, folder).
        out: The model file. Unfinished work stays beside it, in OUT.unfinished.
    """
    from parc_jax.app.cli import logged as logs
    from parc_jax.app.cli.places import held, require_place
    from parc_jax.app.cli.systems import black_box_of, find, study_of
    from parc_jax.common.keys import key_of
    from parc_jax.learning.learn import learn_report

    require_place(out)
    work = out.with_name(f"{out.name}.unfinished")
    with held(out):
        if Path(source).suffix in (".npz", ".csv") or Path(source).is_dir():
            log = logs.Logged(**logged)
            run_anew = [name for name in logs.NEW_RUNS if name in study]
            if log.prior not in (None, logs.NONE):
                run_anew = [name for name in run_anew if name != "rollouts"]
            logs.refuse(run_anew, source, "a system that can be run")
            learned = logs.from_log(Path(source), log, study, shell.seed)
        elif Path(source).suffix in (".bag", ".mcap", ".db3", ".mat"):
            raise InputError(
                f"{source}: expected a system, a .npz file or a folder of CSV files. Bags are read "
                "in Python, by pj.exchange.load_bags; other tables become a .npz first."
            )
        else:
            logs.refuse(logged, source, "logged runs")
            module = find(source, needed=("system",))
            settings = study_of(module, **study)
            black_box, key = black_box_of(module, settings.plant, settings.body), key_of(shell.seed)
            learned = learn_report(black_box, key, settings, path=work, quiet=shell.quiet)
        learned.model.save(out)
        shutil.rmtree(work, ignore_errors=True)
    print(logs.summary(learned, out, as_json=shell.json))
    return 0 if learned.model.tube.claimed.any() else 1
