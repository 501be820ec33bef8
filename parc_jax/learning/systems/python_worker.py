"""What runs in the worker processes of a plain Python system. Imports NumPy alone, so that workers
start at once.
"""

import os
import socket
from typing import NamedTuple

import numpy as np

from parc_jax.learning.systems.content import Reader
from parc_jax.learning.systems.user_code import own_place, said

UNCOUNTED = -1  # losses of a run, where an executor makes lost ones again and tells nobody


class Call(NamedTuple):
    """One finished call. p (n_record + 1, n_p), of a robot with several reference points (n_record
    + 1, m, n_p), q (n_q,), both NaN when it failed; why: where and with which error, or "". lost:
    how often it was lost before, and made again; UNCOUNTED where nobody knows.
    """

    p: np.ndarray
    q: np.ndarray
    why: str
    lost: int = 0


class OtherCode(NamedTuple):
    """A worker does not hold what it was to run. where: which one, in words."""

    where: str


def run_one(
    simulate, seed: tuple[int, ...], arguments: tuple, shape_p: tuple, shape_q: tuple
) -> Call:
    """simulate(rng, *arguments), rng made from the seed alone; an exception or a wrong shape is a
    failed run. What cannot be imported is missing on the machine, and no failure of the robot:
    raises ImportError.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    try:
        p, q = simulate(rng, *arguments)
        p, q = np.asarray(p, np.float64), np.asarray(q, np.float64)
        if p.shape != shape_p or q.shape != shape_q:
            raise ValueError(
                f"expected p {shape_p} on the record grid and q {shape_q}; got {p.shape} and "
                f"{q.shape}"
            )
        start = p.reshape(-1, p.shape[-1])[0]  # of the first reference point
        return Call(p - start, q, "")
    except ImportError:
        raise
    except Exception as error:
        why = f"in {own_place(error) or 'what it returned'}: {said(error)}"
        return failed(shape_p, shape_q, why)


def failed(shape_p: tuple, shape_q: tuple, why: str) -> Call:
    """A run that came to nothing."""
    return Call(np.full(shape_p, np.nan), np.full(shape_q, np.nan), why)


def run_many(simulate, seeds, arguments, shape_p: tuple, shape_q: tuple) -> list[Call]:
    """Several runs, one after another."""
    return [
        run_one(simulate, s, a, shape_p, shape_q) for s, a in zip(seeds, arguments, strict=True)
    ]


def run_sent(
    sending: str, code: str, simulate, seeds, arguments, shape_p: tuple, shape_q: tuple
) -> list[Call] | OtherCode:
    """The same for a process that may hold another program than the one that sent it this.
    sending: a word of its own, since dask takes equal calls for one. code: `code_of` the function
    there, "" where none is compared.
    """
    if code and code not in _HELD:
        _HELD[code] = code_of(simulate)  # before its first run, which may fill caches of its own
    if code and _HELD[code] != code:
        return OtherCode(f"process {os.getpid()} on {socket.gethostname()}")
    return run_many(simulate, seeds, arguments, shape_p, shape_q)


def code_of(simulate) -> str:
    """What decides the numbers of a run, but for its row: the function with all that it refers to,
    what calls it, and the version of the generators.
    """
    return f"{Reader(lasting=True).digest([simulate, run_one.__code__])} numpy {np.__version__}"


_HELD: dict[str, str] = {}  # code asked for, code held
