"""An autonomous surface vessel steered to a point by a neural policy, under disturbances it cannot
see.
"""

from sims.asv.disturbance import LAWS, Law
from sims.asv.policy import Policy, load_policy
from sims.asv.scenario import BODIES, AsvSystem, problem, system
from sims.asv.study import STUDY

__all__ = [
    "BODIES",
    "LAWS",
    "STUDY",
    "AsvSystem",
    "Law",
    "Policy",
    "load_policy",
    "problem",
    "system",
]
