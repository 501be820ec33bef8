"""The plan that a study would drive: chosen, run afresh, claimed near. Sentence (D). [T23]"""

from pathlib import Path
from threading import Thread

import jax

from parc_jax.answer.answer import Answer
from parc_jax.local.local_model import Local
from parc_jax.study.settings import Study

LOOKS = 2  # this very plan, and a claim near it


def drive(
    system,
    answer: Answer,
    study: Study,
    key: jax.Array,
    out: Path,
    quiet: bool,
    ahead: Thread | None = None,
) -> dict:
    """What is known of the plan with most room: plan and sentences. The answer under the local
    claim is written beside the other one, as near.json, for the checker. ahead: what compiles for
    that one's query.
    """
    chosen = answer.choose(delta=study.delta, looks=LOOKS)
    chosen = chosen.run(system, key, eps=study.eps, quiet=quiet)
    if ahead is not None:
        ahead.join()
    chosen = chosen.claim_near(system, key, Local(eps=study.eps, gap=study.gap), quiet=quiet)
    near = chosen.near
    if near.answer is not None:
        near.answer.save(out / "near.json")
    return {
        "plan": chosen.plan.tolist(),
        "runs": chosen.tested.n,
        "failures": chosen.tested.failures,
        "share_of_k": float(near.share),
        "proved_share_of_near": float(near.held),
        "narrower_at_end": near.widths.times_end,
        "narrower_on_the_way": near.widths.times_path,
        "statement": chosen.statement(),
    }
