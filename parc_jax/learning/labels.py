"""Names of coordinates, for pictures, page, films and messages. No verdict reads them."""

import math
import re
from collections.abc import Iterable, Sequence
from numbers import Integral
from typing import NamedTuple

from parc_jax.common.errors import InputError, is_text

LONGEST = 80  # characters of a label
HEADINGS = ("heading", "yaw", "theta", "θ")  # names by which a goal state is taken as a heading
# words beside an axis or TURNED, which tell, that leave no doubt about what is told, nor its unit
PLACED = """p m meter meters metre metres pos position coord coordinate pose odom qpos transform
    translation base link robot rigid body utm map world field t""".split()
TURNED = re.compile("|".join((*HEADINGS, "orientation", "rotation", "rot", r"q\d*")))
BESIDE = "rad radian radians in execution world map odom robot pose field t".split()
# of a map's frame; a column of another place would be mirrored
AXES = {"east": "x", "easting": "x", "north": "y", "northing": "y"}
# of a robot's frame, beside a heading that turns it, and words of no axis of either
OF_BODY = {"ahead": "x", "forward": "x", "longitudinal": "x", "left": "y", "lateral": "y"}
OF_BODY |= dict.fromkeys(("right", "south", "west"), "")
LONE = {"e": "x", "n": "y"}  # where all columns are so named, and by nothing else
_GLUED = re.compile(r"(?:[pt]|pos|position)?([xyz])(?:pos|position|coord)?\d*")
# round brackets hold a unit only where they hold a known one
_UNIT = re.compile(r"(.+?)(?: \[([^[]*)\]| ?\(((?:m?rad|deg|°|%|[cdkmnuµμ]?[msg])(?:/s2?|/h)?)\))")
PARTS = ("p", "q", "k")


class Labels(NamedTuple):
    """One label per coordinate: a name and, in brackets, its unit, as in "speed [m/s]".

    p (n_p,): workspace. q (n_q,): the other goal states. k (n_k,): parameters. Build with `labels`
    or `labels_of`, which validate.
    """

    p: tuple[str, ...]
    q: tuple[str, ...]
    k: tuple[str, ...]

    @property
    def plan(self) -> tuple[str, ...]:
        """Of (p0, k): the coordinates of a plan."""
        return (*self.p, *self.k)

    @property
    def goal(self) -> tuple[str, ...]:
        """Of (p, q): the coordinates of the goal."""
        return (*self.p, *self.q)

    @property
    def heading(self) -> int | None:
        """Index in q of the final heading [rad], by its name (HEADINGS); None for none."""
        named = (i for i, x in enumerate(self.q) if {*words_in(x)} & {*HEADINGS})
        return next((i for i in named if unit_of(self.q[i]) == "rad"), None)


def labels(
    n_p: int,
    n_q: int,
    n_k: int,
    p: Sequence[str] | None = None,
    q: Sequence[str] | None = None,
    k: Sequence[str] | None = None,
) -> Labels:
    """Validated labels; None leaves the plain ones: x [m], y [m], z [m], then q0, q1, k0, k1.

    Raises InputError for a wrong number of labels, one that is no short plain text, and names that
    are numbers or not unique within a part, since they refer to coordinates.
    """
    axes = ("x [m]", "y [m]", "z [m]")
    plain = {
        "p": axes[:n_p] if n_p <= len(axes) else tuple(f"p{i} [m]" for i in range(n_p)),
        "q": tuple(f"q{i}" for i in range(n_q)),
        "k": tuple(f"k{i}" for i in range(n_k)),
    }
    for part, given in (("p", p), ("q", q), ("k", k)):
        if given is not None:
            plain[part] = _checked(part, given, len(plain[part]))
    return Labels(**plain)


def plain_parts(named: Labels) -> set[str]:
    """Those of PARTS whose coordinates have plain names."""
    plain = labels(*map(len, named))
    return {part for part in PARTS if getattr(named, part) == getattr(plain, part)}


def labels_of(system) -> Labels:
    """The p_labels, q_labels and k_labels of a system, where it has them. Raises InputError."""
    given = {part: getattr(system, f"{part}_labels", None) for part in PARTS}
    return labels(system.n_p, system.n_q, system.domain.n, **given)


def name_of(label: str) -> str:
    """The label without its unit."""
    return found[1] if (found := _UNIT.fullmatch(label)) else label


def unit_of(label: str) -> str:
    """The unit in the label's brackets, or nothing, as for other words in round ones."""
    return (found[2] or found[3] or "") if (found := _UNIT.fullmatch(label)) else ""


def words_in(label: str) -> list[str]:
    """The words of its name, in lower case: two of `xPos` and `x_mm`."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|_", " ", name_of(label))
    return re.findall(r"[^\W_]+|[°%]", name.lower())


def axes_in(label: str) -> set[str]:
    """Axes that words of its name tell, as `x0`, `px` and `Easting` tell x; and `dx` in a unit,
    else a change or a speed.
    """
    named = (x[1:] if x[0] == "d" and unit_of(label) else x for x in words_in(label))
    return {axis for x in named if (axis := _axis_of(x))}


def _axis_of(word: str) -> str | None:
    return found[1] if (found := _GLUED.fullmatch(word)) else AXES.get(word)


def axes_in_all(columns: Sequence[str], points: Sequence[str]) -> list[set[str]]:
    """Axes that each column tells, its point's name aside. `x1`, `x2` of a state tell none."""
    own = {word for name in points for word in words_in(name)} & {*"xyzen"}
    axes = [axes_in(column) - own for column in columns]
    if not any(axes):
        lone = [{LONE[x] for x in words_in(c) if x in LONE and x not in own} for c in columns]
        return lone if all(lone) else axes
    alike = len(columns) > 1 and all(one == axes[0] for one in axes)
    return [set()] * len(axes) if alike and all(map(unit_of, columns)) else axes


def require_unit(label: str, unit: str, points: Sequence[str] = ()) -> None:
    """Raises InputError for a label of another unit; and for one without a unit, unless all its
    words tell a place [m], of points of these names, or a heading [rad], and no scale (`x_1000`).
    """
    words, rad = words_in(label), unit == "rad"
    named = [word for point in points for word in (*words_in(point), "".join(words_in(point)))]
    told = [x for x in words if (TURNED.fullmatch(x) if rad else x in LONE or _axis_of(x))]
    known = {*told, *(BESIDE if rad else (*PLACED, *named))}
    known -= {"px"} if len({*told}) > 1 else set()  # a unit, as in `x_px`
    scale = any(re.search(r"\d{3}", x) for x in {*words}.difference(named))
    plain = told and not scale and all(x in known or x.isdecimal() for x in words)
    if unit_of(label) != unit and (unit_of(label) or not plain):
        raise InputError(
            f"labels: expected {name_of(label)} in [{unit}], as its numbers are read; got "
            f"{label!r}. Places are in m, axis by axis, by names such as x or pose.position.y; a "
            "heading, such as yaw, is q, with rotation, in rad; times, speeds and goals are left "
            f"out. By other names they are told with their unit, as 'left foot x [{unit}]'."
        )


def axes_of(words: Iterable, labels: Sequence[str]) -> tuple[int, ...] | None:
    """Indices of coordinates by label, name or number; None where one is none, or named twice."""
    told = {(name_of(x), unit): i for i, x in enumerate(labels) for unit in ("", unit_of(x))}
    axes = [told.get((name_of(x), unit_of(x))) if isinstance(x, str) else x for x in words]
    whole = all(isinstance(axis, Integral) and not isinstance(axis, bool) for axis in axes)
    known = whole and {*axes} <= {*range(len(labels))}
    return tuple(map(int, axes)) if known and len({*axes}) == len(axes) else None


def named_of(label: str, more: object) -> str:
    """The label of one of several that share it, with `more` behind its name."""
    unit = unit_of(label)
    return f"{name_of(label)} {more}" + (f" [{unit}]" if unit else "")


def degrees_hint(label: str, lo: float, hi: float) -> str:
    """A hint for a range of an angle in rad that looks like degrees; else nothing."""
    ends = [abs(end) for end in (lo, hi) if math.isfinite(end)]
    if unit_of(label) != "rad" or max(ends, default=0.0) <= 2 * math.pi:
        return ""
    return f" Is it in degrees? {name_of(label)} is in rad: 90 degrees are 1.571."


def _checked(part: str, given, n: int) -> tuple[str, ...]:
    words = (given,) if isinstance(given, str) else tuple(given)
    if len(words) != n:
        raise InputError(
            f"labels of {part}: expected {n}, as 'speed [m/s]', one each; got {len(words)}."
        )
    for word in words:
        plain = is_text(word) and "$" not in word
        if not plain or not 0 < len(word) <= LONGEST:
            raise InputError(
                f"labels of {part}: expected 1 to {LONGEST} characters, no '$'; got {word!r:.60}."
            )
        name = name_of(word)
        if name.isdecimal() or [name_of(other) for other in words].count(name) > 1:
            raise InputError(
                f"labels of {part}: expected a name for every coordinate that is its own and no "
                f"number; got {', '.join(words)}."
            )
    return words
