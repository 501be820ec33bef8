"""Sets, numbers, tables and the uncertainty of a scene file: read exactly, or refused in a sentence
that names the entry.
"""

from dataclasses import fields
from decimal import Decimal
from fractions import Fraction

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.hull import polytope_around
from parc_jax.problem.uncertainty import FREE, Uncertainty

KINDS = "`lo` and `hi`, or rows `A` and `b`"


def grown_set_of(name: str, part, further: tuple[str, ...] = ()) -> HPolytope:
    """The set of a table as `set_of`, or the hull of vertices, which may come out a little larger,
    as an obstacle may. Raises InputError.
    """
    if not (isinstance(part, dict) and "vertices" in part):
        return set_of(name, part, further, kinds=f"{KINDS}, or `vertices`")
    table_of(name, part, ("vertices", *further))
    name = f"{name} vertices"
    return polytope_around(numbers_of(name, part["vertices"], 2), name)


def set_of(name: str, part, further: tuple[str, ...] = (), kinds: str = KINDS) -> HPolytope:
    """The set of a table with lo and hi, or A and b; maybe further entries. Raises InputError."""
    table_of(name, part, ("lo", "hi", "A", "b", *further))
    given = {key for key in ("lo", "hi", "A", "b") if key in part}
    if given == {"A", "b"}:
        A = numbers_of(f"{name} A", part["A"], 2)
        return hpolytope(A, numbers_of(f"{name} b", part["b"], 1))
    if given != {"lo", "hi"}:
        raise InputError(f"{name}: expected {kinds}; got {', '.join(sorted(given)) or 'none'}.")
    lo = numbers_of(f"{name} lo", part["lo"], 1)
    hi = numbers_of(f"{name} hi", part["hi"], 1)
    try:
        return from_box(box(lo, hi))
    except InputError as error:
        raise InputError(f"{name}: {str(error).removeprefix('box: ')}") from None


def table_of(name: str, part, known: tuple[str, ...], needed: tuple[str, ...] = ()) -> dict:
    """The table, if all its entries are allowed and none needed is missing. Raises InputError."""
    if not isinstance(part, dict):
        raise InputError(f"{name}: expected a table with {', '.join(known)}; got {part!r:.60}.")
    foreign = sorted(set(part) - set(known))
    if foreign:
        raise InputError(
            f"{name}: expected {', '.join(known)}; got {foreign[0]!r}. Is it misspelled?"
        )
    for key in needed:
        if key not in part:
            raise InputError(f"{name}: expected an entry {key!r}; there is none.")
    return part


def numbers_of(name: str, value, ndim: int) -> np.ndarray:
    """Floats whose shortest decimals are the file's numbers, of the given depth of nesting."""

    def one(v):
        if isinstance(v, list):
            return [one(x) for x in v]
        if isinstance(v, bool) or not isinstance(v, int | Decimal) or not Decimal(v).is_finite():
            raise InputError(f"{name}: expected finite numbers; got {v!s:.40}.")
        nearest = float(Decimal(v))  # infinite for a whole number beyond all floats
        if not np.isfinite(nearest) or Decimal(repr(nearest)) != v:
            raise InputError(
                f"{name}: expected a decimal that a float64 keeps (up to 15 digits); got "
                f"{v!s:.40}. Round it."
            )
        return nearest

    floats = one(value)
    try:
        array = np.array(floats, np.float64)
    except ValueError:
        array = np.zeros((0,) * (ndim + 1))
    if array.ndim != ndim:
        wanted = ("one number", "a list of numbers", "a list of rows of as many numbers each")[ndim]
        raise InputError(f"{name}: expected {wanted}; got {value!s:.60}.")
    return array


def written_set(part: HPolytope) -> dict:
    """lo and hi where the rows are exactly those of a box, else the rows."""
    n, eye = part.n, np.eye(part.n)
    if part.A.shape == (2 * n, n) and (part.A == np.concatenate([eye, -eye])).all():
        return {"lo": (0.0 - part.b[n:]).tolist(), "hi": part.b[:n].tolist()}
    return {"A": part.A.tolist(), "b": part.b.tolist()}


def _numbers(name: str, value):
    """A number, a list of numbers, or a table of such by name."""
    if isinstance(value, dict):
        return tuple((key, _numbers(f"{name} of {key}", part)) for key, part in value.items())
    if value == FREE:
        return FREE
    array = numbers_of(name, value, 1 if isinstance(value, list) else 0)
    return float(array) if np.ndim(array) == 0 else tuple(array.tolist())


def _by_name(pairs: tuple) -> dict:
    """A table of pairs (parameter, value); an interval of one value is that value."""
    single = {p: v[0] if isinstance(v, tuple) and v[0] == v[1] else v for p, v in pairs}
    return {str(p): list(v) if isinstance(v, tuple) else v for p, v in single.items()}


def _decimal(x: Fraction) -> float | str:
    """The number whose decimal it is; its fraction as text where no float has that decimal."""
    return near if Fraction(str(near := float(x))) == x else str(x)


# fields of an uncertainty in a file, in its order: how an entry is read, and how it is written
UNCERTAINTY = {
    "start": (_numbers, list),
    "heading": (lambda name, value: float(numbers_of(name, value, 0)), float),
    "goal": (_numbers, list),
    "k": (_numbers, _by_name),
    "given": (_numbers, _by_name),
    "unknown": (_numbers, _by_name),
    "sensing_eps": (lambda _, x: x if isinstance(x, list | dict) else str(x), _decimal),
    "obstacles": (grown_set_of, None),  # written with each obstacle
}
UNCERTAINTY_ENTRIES = tuple(field.name for field in fields(Uncertainty))


def uncertainty_of(data: dict, obstacles: list) -> Uncertainty | None:
    """The uncertainty of a scene file, None where it has none. Raises InputError.

    [uncertainty] the fields of `Uncertainty`: numbers and lists, parameters by name in tables,
        obstacles a set: lo and hi, A and b, or vertices.
    [[obstacles]] uncertainty = {lo = ..., hi = ...}: of this one alone.
    """
    own = [part.get("uncertainty") for part in obstacles]
    if data.get("uncertainty") is None and not any(own):
        return None
    table = table_of("uncertainty", data.get("uncertainty") or {}, UNCERTAINTY_ENTRIES)
    values = {
        name: UNCERTAINTY[name][0](f"uncertainty {name}", part) for name, part in table.items()
    }
    of_all = values.pop("obstacles", None)
    sets = [
        of_all if part is None else grown_set_of(f"uncertainty of obstacle {i}", part)
        for i, part in enumerate(own)
    ]
    if any(part is not None for part in sets):
        values["obstacles"] = sets
    return Uncertainty(**values)


def written_uncertainty(uncertainty: Uncertainty | None, n: int) -> tuple[dict, list]:
    """The table of an uncertainty without exact fields, and that of each of n obstacles, None for
    an exact one. Raises InputError for another number of sets.
    """
    if uncertainty is None:
        return {}, [None] * n
    table = {}
    for name, (_, write) in UNCERTAINTY.items():
        value = getattr(uncertainty, name)
        if write is not None and (any(value) if isinstance(value, tuple) else value):
            table[name] = write(value)
    sets = uncertainty.of_obstacles(n)
    return table, [None if part is None else written_set(part) for part in sets]
