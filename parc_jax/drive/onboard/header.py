"""An answer as a C99 header: `is_safe(p0, k)` and `nearest_plan`, for the computer of a robot."""

import re
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.common.errors import InputError
from parc_jax.drive.onboard.compared import require_kept
from parc_jax.drive.onboard.paid import require_fitting, require_paid
from parc_jax.drive.onboard.tables import Tables, tables
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.model import check_model
from parc_jax.learning.runs.files import write_atomic

CODE = Path(__file__).with_name("safe_set.h")
GUARDS = Path(__file__).with_name("guards.h")  # against compilers that change sums
LONGEST = 100  # characters of a line
WARNING = (
    "What is_safe says is tested in float64: every decision keeps a margin that pays for the "
    "rounding of float64 in any order of additions, fused or not. It rests on IEEE's double, "
    "rounded to nearest, with nothing wider in its place, on literals that are doubles, and on a "
    "compiler that changes no sums: compile without -ffast-math and the options that it stands "
    "for. Where the compiler tells that it is otherwise, this file does not compile. The processor "
    "is asked in each call: under another rounding mode, where subnormal numbers count as zero, as "
    "in a program that is linked with -ffast-math, or where a number of p0 or k is infinite or "
    "none, is_safe gives 0. These guards stand outside of the code that is proved, and can only "
    "refuse. No probability of leaving the tube that is told here is of a k that nearest_plan "
    "finds: it is picked, not drawn."
)
COMPARED = (
    "As this file was written, its tables were compared with the checker's own conditions in exact "
    "rationals: a plan that keeps to them, as the theorem about the code says of each that is_safe "
    "lets pass, belongs to a corridor of the answer. Left out were only obstacles from which each "
    "plan that ends in the goal keeps apart, by float64 and its margins. The conditions are those "
    "of"
)


def write_c(answer: Answer, path, name: str | None = None) -> Path:
    """Write an answer's corridors as a C99 header without dependencies, all of it or nothing.

    name: prefix of its functions; default: the name of the file. A plan that the header calls safe
    satisfies one of the answer's corridors, tested in float64 with the margins of the answer
    [T10, T11], and every such plan is safe [T27]. Raises InputError, also where these margins would
    not pay for all rounding.
    """
    path = Path(path)
    name = path.stem if name is None else name
    if path.suffix != ".h":
        raise InputError(f"export: expected a file that ends in .h; got {path.name}.")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(
            f"export: expected a name that C allows, of letters, digits and _; got {name!r}. Name "
            "another file, or give a name."
        )
    check_model(answer.model)
    table = tables(answer)
    require_fitting(table, answer.model)
    slack = float(answer.scene.slack)
    require_paid(table, answer.model, slack)
    hashes = require_kept(table, answer, slack)
    guard = f"{name.upper()}_H"
    own = replace(answer, validation=None)  # whose set is another than that of these tables
    compared = [COMPARED, *(f"sha256 {part} {value}" for part, value in hashes.items())]
    lines = [f"#define {name}_{size} {number}" for size, number in _sizes(answer, table).items()]
    lines.append("")
    for kind, of, array in _arrays(answer, table):
        lines += _table(kind, f"{name}_{of}", array)
    lines += [CODE.read_text().replace("NAME", name), "#endif", ""]
    said = "\n".join([own.details(), WARNING, *compared]).replace("*/", "* /")
    said = [f" * {line}" for part in said.split("\n") for line in _wrapped(part, LONGEST - 3)]
    text = "\n".join(lines)
    mark = f"0x{sha256(text.encode()).hexdigest()[:8]}"
    # of two of one name in one program the second would silently be left out
    once = f"#if defined({guard}) && {guard} != {mark}\n#error two headers are named {name}\n#endif"
    once += f"\n#ifndef {guard}\n#define {guard} {mark}\n"
    return write_atomic(
        path, "\n".join(["/*", *said, " */", once, GUARDS.read_text(), text]).encode()
    )


def _sizes(answer: Answer, table: Tables) -> dict[str, int]:
    model = answer.model
    boxes, biases = isinstance(table.errors, ErrorBox), model.net.biases
    return {
        "N_P": model.n_p,
        "N_C": model.n_c,
        "N_Q": model.n_q,
        "N_K": model.n_k,
        "N_STEPS": model.time.n_steps,
        "N_LAYERS": len(model.net.weights),
        # of one layer alone a compiler sees that its outputs would not fit, were they hidden
        "WIDEST": max(model.n_k, *(len(b) for b in biases[:-1] or biases), 1),
        "N_CORRIDORS": len(table.probes),
        "N_PROBES": table.probes.shape[1],
        "N_PART": table.pair_points.shape[1],
        "N_BASES": 0 if boxes else table.errors.half.shape[-2],
        "N_START": len(table.start_b),
        "N_GOAL": len(table.goal_A),
        "N_PLANS": len(table.plans),
        "N_MEASURED": len(model.given),
    }


def _arrays(answer: Answer, table: Tables) -> Iterator[tuple[str, str, np.ndarray]]:
    """Type, name and values of every table. An empty one has a zero that is never read."""
    net = answer.model.net
    yield "int", "widths", np.array([answer.model.n_k, *(len(b) for b in net.biases)])
    yield "double", "weights", np.concatenate([W.T.ravel() for W in net.weights])
    yield "double", "biases", np.concatenate(net.biases)
    yield "double", "edges", np.concatenate(table.edges)
    yield "int", "first_edge", np.cumsum([0, *(len(e) for e in table.edges)])
    if not isinstance(table.errors, ErrorBox):
        yield "double", "dual", table.errors.dual
        yield "double", "centre", table.errors.centre
    yield "double", "half", table.errors.half
    yield "int", "pair_points", table.pair_points
    for of, column in table.runs._asdict().items():
        kind = "double" if of in ("w", "support") else "int"
        yield kind, of if of == "first_run" else f"run_{of}", column
    yield "int", "probes", table.probes
    for of in ("far", "start_A", "start_b", "goal_A", "goal_b", "plans"):
        yield "double", of, getattr(table, of)
    yield "int", "measured", np.isin(np.arange(answer.model.n_k), answer.model.given).astype(int)
    yield "double", "ends", table.ends
    yield "double", "near", table.near


def _table(kind: str, name: str, array) -> Iterator[str]:
    """A constant table; several axes as C wants them."""
    array = np.asarray(array)
    if not array.size:
        array = np.zeros([max(1, n) for n in array.shape], array.dtype)
    extent = "".join(f"[{n}]" for n in array.shape)
    *rows, last = _initialiser(array, float.hex if kind == "double" else str)
    yield f"static const {kind} {name}{extent} ="
    yield from rows
    yield f"{last.removesuffix(',')};"


def _initialiser(array: np.ndarray, spell: Callable) -> Iterator[str]:
    """Lines of nested braces, each closed by a comma."""
    if array.ndim == 1:
        row = ", ".join(spell(x) for x in array.tolist())
        yield from _wrapped(f"{{{row}}},", LONGEST)
        return
    yield "{"
    for part in array:
        yield from _initialiser(part, spell)
    yield "},"


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)
