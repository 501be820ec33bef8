"""`parc-jax replay`: recorded runs against an answer."""

import json
from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.offer import Offer
from parc_jax.app.cli.shell import Shell


def replay(
    answer: Path,
    log: Path,
    /,
    *,
    shell: Annotated[Shell, Offer("app.cli.shell.Shell", only=("json",))],
) -> int:
    """Move logged runs to starts that an answer proves safe for their k, and say what they did
    there. Example: parc-jax replay answer.json new_logs.npz

    Nothing is run. Logs that no tube was sized by try the claim, others the proof alone.

    Args:
        answer: An answer file of `solve` or `run`; it is checked anew.
        log: Logged runs (.npz, .mat, folder) on the time grid and of the points of its model; those
            with k outside of its K are left out.
    """
    from parc_jax.app.cli.help import fitted
    from parc_jax.app.files.answer_file import load_answer
    from parc_jax.app.study.recorded import replay_recorded
    from parc_jax.learning.runs.loaders import load_rollouts

    asked = load_answer(answer)
    points = None if asked.model.n_points == 1 else asked.model.points
    runs = load_rollouts(log, asked.model.time, points=points)
    found = replay_recorded(asked, runs)
    if shell.json:
        counts = {"runs": runs.n, "with_start": 0} if found is None else found.counts()
        print(json.dumps(counts, indent=1))
    elif found is None:
        print(fitted(f"None of {runs.n:,} runs was found a start that is proved safe for its k."))
    else:
        print(fitted(found.statement()))
    return 1 if found is None else 0
