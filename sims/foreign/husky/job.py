"""`parc-jax run husky`: from the log to a proved safe set, every held-out command against it."""

import json as as_json
from pathlib import Path

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.job import finish
from parc_jax.common.spelling import counted, rounded_down, rounded_up
from parc_jax.common.stopwatch import Stopwatch
from parc_jax.planner import Planner
from parc_jax.safe_set.settings import Settings
from sims.foreign.husky.learn import claimed, first_look, halves, network, profile, worst
from sims.foreign.husky.log import read_log
from sims.foreign.husky.scenario import problem
from sims.foreign.husky.unseen import Unseen, unseen
from sims.recorded import Recorded, replay_recorded

EPS = 0.1  # asked for; without discards the claim carries the smaller one that the log supports
PLANS = 50  # safe plans returned


def job(
    *,
    out: Path = Path("runs/husky"),
    seed: int = 0,
    eps: float = EPS,
    discard: int | None = None,
    figures: bool = True,
    quiet: bool = False,
    json: bool = False,
) -> int:
    """The whole study. Returns 0 when the claim allows a plan, else 1.

    discard: runs left outside of the tube, fixed before any is seen; None = none. Writes model,
    answer, metrics.json, the table and the figures below `out`. Raises InputError, SoundnessError.
    """
    del quiet  # there is nothing to wait for
    out, key, watch = Path(out), jax.random.PRNGKey(seed), Stopwatch()
    log = read_log()
    runs = halves(log)
    with watch("twist model and network"):
        net = network(log, key)
    with watch("claim"):
        model = claimed(net, runs, eps, discard or 0)
    with watch("safe set"):
        answer = Planner(model).solve(problem(), key, Settings(samples=PLANS))
        model.save(out / "model.npz")  # beside its own answer, never beside an older one
        answer.save(out / "answer.json")
    with watch("held-out commands against the answer"):
        replayed = replay_recorded(answer, runs.held) if answer.status.found else None
        others = unseen(net, runs.held, profile(net, runs.train))
    if figures:
        from sims.foreign.husky.figures import draw_all

        with watch("figures"):
            draw_all(answer, runs, replayed, out)
    metrics = {"first_look": first_look(net, runs.train)}
    metrics = finish(out, metrics | measured(answer, replayed, others, watch))
    print(as_json.dumps(metrics, indent=1) if json else told(metrics, answer))
    if not json:
        print(f"Written to {out}. Verify with: parc-jax check {out / 'answer.json'}")
    return 0 if answer.status.found else 1


def measured(answer: Answer, replayed: Recorded | None, others: Unseen, watch: Stopwatch) -> dict:
    """Everything that the study knows in numbers."""
    claim, share = answer.model.claim, answer.share_of_k() if answer.status.found else 0.0
    promise = float(claim.risk(share=share).bound) if share > 0 else None
    wide = answer.model.tube.interval.max(axis=2)[[0, 2]]
    return {
        "system": answer.model.system,
        "eps": float(claim.eps),
        "runs_behind_the_claim": claim.n,
        "discarded": claim.discard,
        "half_width_driving": wide[0].tolist(),
        "half_width_turning": wide[1].tolist(),
        "worst_commands": worst(claim),
        "status": answer.status.label,
        "corridors": len(answer.corridors),
        "coverage": answer.coverage._asdict(),
        "share": None if answer.share is None else answer.share._asdict(),
        "share_of_k": share,
        "promise": promise,
        "replay": None if replayed is None else tally(replayed),
        "unseen": others._asdict(),
        "stages": watch.stages,
        "claim": claim.to_json(),
    }


def tally(replayed: Recorded) -> dict:
    """Counts over the replays of recorded runs."""
    counts = replayed.counts()
    return {
        "commands": counts.pop("runs"),
        "commands_with_a_safe_start": counts.pop("with_start"),
        **counts,
        "least_clearance": float(replayed.runs.clearance.min()),
    }


def told(m: dict, answer: Answer) -> str:
    """The study for a terminal. Worst of training: cm; held out: shares of the profile."""
    lines = [
        "",
        f"tube             up to {100 * max(m['half_width_driving']):.0f} cm driving, "
        f"{100 * max(m['half_width_turning']):.0f} cm turning (any corner, any time)",
        f"claim            eps = {rounded_up(m['eps'], 3)} at 95 %, {m['runs_behind_the_claim']} "
        f"commands, {m['discarded']} left outside",
        "training, worst  " + "; ".join(_command(one, ".0f") for one in m["first_look"][:5]),
        "held out, worst  " + "; ".join(_command(one, ".2f") for one in m["worst_commands"][:5]),
        f"safe set         {m['status']}, {m['corridors']} corridors, "
        f"at least {rounded_down(100 * m['share_of_k'])} % of all commands have a safe start "
        "(99.9 % confidence)",
    ]
    if m["promise"] is not None:
        lines.append(
            "promise          for commands uniform over these, at most "
            f"{rounded_up(100 * m['promise'], 3)} % leave the tube (94.9 % confidence: 95 % of the "
            "claim, 99.9 % of how many these are)"
        )
    if m["replay"] is not None:
        r = m["replay"]
        lines.append(
            f"held-out runs    {r['commands_with_a_safe_start']} of {r['commands']} commands have "
            f"a safe start; {r['replays']} replays: {r['missed_the_goal']} missed the goal, "
            f"{r['touched']} touched, {r['left_the_tube']} left the tube"
            + f"; at least {r['made_the_tube']} of these, or copies of them, made the tube"
            * (r["made_the_tube"] > 0)
            + f"; {counted(r['rows_left_out'], 'row')} left out of their log, or of the tube's"
            * (r["rows_left_out"] > 0)
        )
    u = m["unseen"]
    lines.append(
        f"in order of time {u['later']} of {u['runs']} later runs leave the tube of the earlier "
        f"half, {u['earlier']} the other way round (claimed at 95 %: at most "
        f"{rounded_up(100 * u['eps'], 3)} %)"
    )
    seconds = sum(stage["seconds"] for stage in m["stages"].values())
    return "\n".join([*lines, f"time             {seconds:.0f} s", "", answer.details(), ""])


def _command(one: dict, digits: str) -> str:
    left, right = np.round(one["k"], 2)
    return f"{one['score']:{digits}} at ({left:g}, {right:g})"
