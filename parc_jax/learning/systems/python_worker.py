"""Worker processes of a plain Python system. Imports NumPy alone, so that workers start at once."""

import os
import socket
from typing import NamedTuple

import numpy as np

from parc_jax.learning.systems.content import Reader
from parc_jax.learning.systems.own_workers import OwnWorkers
from parc_jax.learning.systems.user_code import own_place, said

UNCOUNTED = -1  # losses of a run, where an executor makes lost ones again and tells nobody


class Call(NamedTuple):
    """One finished call. p: (n_record + 1, n_p), of m reference points (n_record + 1, m, n_p). q:
    (n_q,). Both are NaN when it failed; why: place and error, or "". lost: number of losses before,
    after which it was made again; UNCOUNTED where it is unknown.
    """

    p: np.ndarray
    q: np.ndarray
    why: str
    lost: int = 0


class OtherCode(NamedTuple):
    """Refusal of a worker with other code. where: process and machine, in words. named: its own."""

    where: str
    named: dict[str, str]


def run_one(simulate, seed: tuple[int, ...], arguments: tuple, shape_p, shape_q) -> Call:
    """simulate(rng, *arguments), rng made from the seed alone; an exception or a wrong shape is a
    failed run. Raises ImportError: a missing package is no failure of the robot.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    try:
        p, q = (_own(x) for x in simulate(rng, *arguments))
        if p.shape != shape_p or q.shape != shape_q:
            raise ValueError(
                f"expected p {shape_p} on the record grid and q {shape_q}; got {p.shape} and "
                f"{q.shape}"
            )
        return Call(p - p.reshape(-1, p.shape[-1])[0], q, "")  # from its first reference point
    except ImportError:
        raise
    except (Exception, SystemExit) as error:  # a run that ends its program has failed
        why = f"in {own_place(error) or 'what it returned'}: {said(error)}"
        return failed(shape_p, shape_q, why)


def _own(x) -> np.ndarray:
    """A copy in float64: what a simulator returns may be a view of its state, which the next run
    changes. What is masked is NaN. Raises ValueError for complex numbers: NumPy would drop half.
    """
    if np.iscomplexobj(x):
        raise ValueError("expected real numbers; got complex ones")
    return np.array(np.ma.filled(x, np.nan) if np.ma.isMA(x) else x, np.float64)


def failed(shape_p: tuple, shape_q: tuple, why: str) -> Call:
    """A failed run."""
    return Call(np.full(shape_p, np.nan), np.full(shape_q, np.nan), why)


def run_many(both, which: int, seeds, arguments, *shapes) -> list[Call]:
    """Several runs of both[which], one after another."""
    return [run_one(both[which], s, a, *shapes) for s, a in zip(seeds, arguments, strict=True)]


def run_sent(sending: str, code: tuple[bool, str], both, *runs) -> list[Call] | OtherCode:
    """`run_many`, for a process that may hold another program than the sender.

    sending: unique, since dask takes equal calls for one. code: `code_of` both.
    """
    if not _AT or _AT[0] != code:  # not at each run, since its own may fill caches
        if _AT:
            _LEFT[_AT[0]] = code_of(_AT[1], _AT[0][0])[1]
        held, named = code_of(both, code[0])
        if held != code and named != _LEFT.get(code):
            return OtherCode(f"process {os.getpid()} on {socket.gethostname()}", named)
        _AT[:] = code, both
    return run_many(both, *runs)


def code_of(both, own: bool) -> tuple[tuple[bool, str], dict[str, str]]:
    """Digests of what decides the numbers of a row, functions with all that they refer to, caller
    and generators, and of what has a name; own, of processes that are sent the rest: of this alone.
    """
    reader = (OwnWorkers if own else Reader)(lasting=True)
    digest = reader.digest([both, run_one.__code__])
    code = reader.digest(reader.named) if own else f"{digest} numpy {np.__version__}"
    return (own, code), reader.named


_AT: list = []  # code and functions of the sender whose run was the last here
_LEFT: dict = {}  # code of a sender -> names of `code_of`, as its last run before others left them
