"""The boat as the released data behave: one sample per control period of 0.2 s, labelled 0.02 s.
See docs/asv.md.
"""

from pathlib import Path

from sims.asv.policy import HOVER, Policy
from sims.asv.scenario import AsvSystem, problem
from sims.asv.scenario import system as _system
from sims.asv.study import PUBLISHED as STUDY

__all__ = ["STUDY", "problem", "system"]


def system(
    plant: str = "mjx",
    law: str = "study",
    policy: Policy | str | Path = HOVER,
    body: str = "disc",
) -> AsvSystem:
    """`sims.asv.system` with published_time=True."""
    return _system(plant, law, policy, published_time=True, body=body)
