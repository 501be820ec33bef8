"""The published method's linear programs, solved as fast as the same solver allows: the yardstick
for everything that claims to be faster than they are.

Our own LP door proves each verdict, which costs more than the solver. A comparison against that
would count our care as their slowness. So the programs are recorded while the published method
runs, and then solved once more with nothing around the solver: rows straight into sparse columns,
the solver's default accuracy, no verdict taken. How the rows came about (hulls, sums) is not timed
at all, in favour of the published method.
"""

import contextlib
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.neuralparc import lp_solve as door
from benchmarks.neuralparc.lp_program import LinearProgram


class Lean(NamedTuple):
    """Of `programs` programs: wall [s] from dense rows to the solver's answer, and what the solver
    says of its own share [s].
    """

    programs: int
    seconds: float
    solver_seconds: float


@contextlib.contextmanager
def recorded() -> Iterator[list[LinearProgram]]:
    """Every program that goes to the solver inside, in order."""
    seen: list[LinearProgram] = []
    ask = door.clarabel_hint

    def remember(program: LinearProgram):
        seen.append(program)
        return ask(program)

    door.clarabel_hint = remember
    try:
        yield seen
    finally:
        door.clarabel_hint = ask


def solve_lean(programs: list[LinearProgram]) -> Lean:
    """Solve all of them, one after another on one thread."""
    import clarabel
    from scipy.sparse import csc_matrix

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.presolve_enable = False
    quadratic: dict[int, csc_matrix] = {}
    inside = 0.0
    begin = time.perf_counter()
    for program in programs:
        rows, offsets = program.bound_rows()
        matrix = np.concatenate([program.E, program.A, rows])
        bounds = np.concatenate([program.f, program.b, offsets])
        height, n = matrix.shape
        across = matrix.T
        at, row = np.nonzero(across)  # stored zeros would make the solver factorise a dense matrix
        ends = np.searchsorted(at, np.arange(n + 1))
        columns = csc_matrix((across[at, row], row, ends), shape=matrix.shape)
        if n not in quadratic:
            quadratic[n] = csc_matrix((n, n))
        equalities = len(program.f)
        cones = [clarabel.NonnegativeConeT(height - equalities)]
        if equalities:
            cones.insert(0, clarabel.ZeroConeT(equalities))
        solver = clarabel.DefaultSolver(quadratic[n], program.c, columns, bounds, cones, settings)
        inside += solver.solve().solve_time
    return Lean(len(programs), time.perf_counter() - begin, inside)
