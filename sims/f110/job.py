"""`parc-jax run f110`: the study of few runs, from the runs of several laboratories to table,
figures and film.
"""

import json as as_json
import shutil
import subprocess
import sys
from pathlib import Path

import jax

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.stopwatch import Stopwatch
from parc_jax.learning.bound.start_gap import try_starts
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.files import write_atomic
from sims.f110.few_runs import Tried, attempt
from sims.f110.lesson import PUBLISHED, models
from sims.f110.rows import sentence, table
from sims.f110.scenario import problem
from sims.f110.study import STUDY
from sims.f110.system import seen_as, system
from sims.film import headless_mujoco

SIZES = (60, 250, 1000, 7000)
LEAST = 30  # runs of a laboratory: half of them must do for training
PICTURES = ("sideslip", "tubes", "more_runs", "repeats_*")
FILM_S = 240  # [s] most time for the film


def job(
    *,
    out: Path = Path("runs/f110"),
    seed: int = 0,
    body: str = "disc",
    rollouts: int | None = None,
    figures: bool = True,
    quiet: bool = False,
    json: bool = False,
) -> int:
    """The whole study. Returns 0 when an honest claim allows a plan, else 1.

    Writes rows and times (metrics.json), the table, the model and the answer of the honest
    laboratory with the most runs, figures and a film below `out`. rollouts: one laboratory with so
    many runs, instead of SIZES. body: of the car, as of `problem`; "rectangle" has the disc's rows
    beside its own, from the same runs.
    Raises InputError.
    """
    sizes = SIZES if rollouts is None else (rollouts,)
    if min(sizes) < LEAST:
        raise InputError(
            f"rollouts: expected at least {LEAST} runs for a laboratory; got {rollouts}."
        )
    headless_mujoco()  # quietly: stdout is the report's
    out, key, watch = Path(out), jax.random.PRNGKey(seed), Stopwatch()
    car = system(body=body)
    bodies = tuple(dict.fromkeys(("disc", body)))
    with watch("other starts"):
        start = try_starts(car, key, STUDY.bound.gap)
    with watch("rollouts"):
        runs = collect(
            car, key, max(sizes), Stage.TRAIN, path=out / "unfinished" / "runs.npz", quiet=quiet
        )
    tried: list[Tried] = []
    for n in sizes:
        for name in bodies:
            seen, scene = system(body=name), problem(name)
            with watch(f"{n} runs, {name}: models"):
                learned = models(seen, seen_as(name, runs.select(slice(0, n))), start, key)
            with watch(f"{n} runs, {name}: plans and replays"):
                for model in learned:
                    tried.append(attempt(seen, scene, n, model, key, quiet))
                    if not quiet:
                        print(table([tried[-1].row])[1], file=sys.stderr, flush=True)
    asked = [t for t in tried if t.row.body == body]
    best = next(
        (t for t in reversed(asked) if t.row.claim != PUBLISHED and t.row.plan is not None), None
    )
    pictures = (f"{name}.{kind}" for name in PICTURES for kind in ("png", "pdf"))
    written = ("model.npz", "answer.json", "film.gif", *pictures)
    for old in (each for name in written for each in out.glob(name)):  # of an older study
        old.unlink()
    if best is not None:
        best.model.model.save(out / "model.npz")
        best.answer.save(out / "answer.json")
    no_film = None
    if figures:
        from sims.f110.figures import draw_all

        with watch("figures"):
            draw_all(car, runs, asked, key, out)
        with watch("film"):
            no_film = _film(out / "film.gif", out / "answer.json" if best else None, seed)
    rows = [t.row for t in tried]
    text = "\n".join([*table(rows), "", *map(sentence, rows), ""])
    write_atomic(out / "table.txt", text.encode())
    metrics = {
        "system": car.name,
        "body": body,
        "seed": seed,
        "rows": [row._asdict() for row in rows],
        "stages": watch.stages,
    }
    metrics |= {} if no_film is None else {"no_film": no_film}
    write_atomic(out / "metrics.json", as_json.dumps(metrics, indent=1).encode())
    shutil.rmtree(out / "unfinished", ignore_errors=True)
    if json:
        print(as_json.dumps(metrics, indent=1))
    else:
        seconds = sum(stage["seconds"] for stage in watch.stages.values())
        print(
            text,
            *([f"No film: {no_film}"] if no_film else []),
            f"{seconds:.0f} s in all.",
            sep="\n",
        )
        print(f"Written to {out}.")
        if best is not None:
            print(f"Verify with: parc-jax check {out / 'answer.json'}")
    return 0 if best is not None else 1


def _film(to: Path, answer: Path | None, seed: int) -> str | None:
    """Film one run, where there is an answer of its first plan, over its tube; why there is none,
    or None. Its own process: MuJoCo settles on an OpenGL on import.
    """
    command = [
        sys.executable,
        "-m",
        "sims.f110.film",
        "--out",
        str(to),
        "--seed",
        str(seed),
        "--size",
        "640",
        "360",
    ]
    if answer is not None:
        command += ["--answer", str(answer)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=FILM_S, check=False)
    except subprocess.TimeoutExpired:
        return f"it took longer than {FILM_S} s."
    return (
        None
        if done.returncode == 0
        else (done.stderr.strip().splitlines() or ["no reason given."])[-1]
    )
