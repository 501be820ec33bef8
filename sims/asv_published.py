"""The boat as the released data behave: one sample per control period of 0.2 s, labelled 0.02 s. See docs/asv.md."""

from sims.asv.scenario import AsvSystem, problem
from sims.asv.scenario import system as _system
from sims.asv.study import PUBLISHED as STUDY

__all__ = ["STUDY", "problem", "system"]


def system(**options) -> AsvSystem:
    """`sims.asv.system` with published_time=True; takes its other options."""
    return _system(published_time=True, **options)
