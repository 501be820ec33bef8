"""Checks a saved answer in exact arithmetic, independently of the program that wrote it.

    python -m parc_jax.checker answer.json [--json] [--processes N]
    python checker answer.json [--json]              this folder alone, copied anywhere

Standard library only; nothing of parc_jax is imported. Every number is a rational and every
comparison exact: there is no tolerance. A check passes only on `is True`, and any exception is a
rejection. docs/certificates.md has the format and what an accepted answer proves.

Letters: p position, q further goal states, k parameters, y = (c_1 .. c_T, q) the outputs of the
network, p_s = p0 + c_s the position at knot s, z = p_T, t the interval from knot t to knot t + 1,
e the widths of the tube, w a direction. Where a robot has several reference points, c_s are the
offsets of all of them, of point 0 first; those of knot 0 are outputs too, but for point 0. Vectors
are integers over one common denominator ("scale").
"""

from .answer import FORMAT, PARTS, Report, allowance, check_answer, load, main, summary
from .doubt import check_doubt
from .episode import Chain, check_episode, is_episode
from .exact import NotAnAnswer, Rejected, integers, number, rejecting
from .no_plan import check_no_plan
from .plans import Context
from .question import MAX_PARAMETERS

__all__ = [
    "FORMAT",
    "MAX_PARAMETERS",
    "PARTS",
    "Chain",
    "Context",
    "NotAnAnswer",
    "Rejected",
    "Report",
    "allowance",
    "check_answer",
    "check_doubt",
    "check_episode",
    "check_no_plan",
    "integers",
    "is_episode",
    "load",
    "main",
    "number",
    "rejecting",
    "summary",
]
