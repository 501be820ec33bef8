"""The pictures of a study."""

from pathlib import Path

from parc_jax.study.job import Studied
from parc_jax.study.replay import Replay
from parc_jax.study.settings import Study


def figures(outcome: Studied, study: Study, out: Path) -> list[Path]:
    """Draw everything that this outcome supports; returns the files."""
    from parc_jax.plot.errors import Entry, errors
    from parc_jax.plot.regions import region_seconds, regions
    from parc_jax.plot.samples import samples
    from parc_jax.plot.spread import spread as spread_of_runs
    from parc_jax.published.verdicts import region_verdicts

    answer = outcome.answer
    drawn = []
    if answer.found:
        drawn.append(out / "samples.png")
        runs = outcome.runs
        first = None if runs is None else Replay(*(part[:: study.repeats] for part in runs))
        samples(answer, first, drawn[-1])
        if runs is not None and study.repeats > 1:
            drawn.append(out / "spread.png")
            spread_of_runs(answer, runs, study.repeats, drawn[-1])
    if answer.doubt is None and 2 <= answer.model.n_k <= 3:
        drawn.append(out / "regions.png")
        verdicts = region_verdicts(answer, outcome.table)
        when = region_seconds(answer, outcome.table) if answer.polytopes else None
        regions(outcome.table, verdicts, when, drawn[-1], names=answer.model.labels.k)
    if outcome.learned is not None:
        drawn.append(out / "errors.png")
        entries = [Entry(m.name, m.assumed.claim, m.honest.claim) for m in outcome.learned.networks]
        errors(entries, answer.model.time, drawn[-1])
    return drawn
