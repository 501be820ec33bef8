"""The law that rollouts are drawn from, which every statistical claim is about, and their subject:
system, K, time grid, reference points.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass, replace
from itertools import chain

import numpy as np

from parc_jax.checker.claim import BOX, FITTED, OURS, PART, described, drawn, hash_of_law
from parc_jax.checker.entries import hash_of
from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError, check_text, reading
from parc_jax.common.premises import MEASURED, Premises, agree, premises
from parc_jax.common.sets.box import Box, box
from parc_jax.common.spelling import exact, hex_floats, hex_text, listed, nearest_floats
from parc_jax.learning.labels import (
    OF_BODY,
    PARTS,
    Labels,
    axes_in_all,
    axes_of,
    labels_of,
    name_of,
    plain_parts,
    require_unit,
    unit_of,
    words_in,
)
from parc_jax.learning.labels import labels as valid_labels
from parc_jax.learning.system import (
    ONE_POINT,
    TURNS,
    Layout,
    TimeGrid,
    check_points,
    check_rotation,
    check_system,
    points_of,
    rotation_of,
    time_grid,
)
from parc_jax.learning.systems.content import Reader, told_whole
from parc_jax.learning.systems.user_code import blamed

LOG = "file:"  # begins the generator of runs that were logged
# of a law whose K was not declared but fitted to logged k, the runs of that fit
FITS = [f"the smallest box of {whose} runs" for whose in ("these", "the training", "other")]
TO_ALL, TO_TRAINING, TO_OTHERS = FITS  # where not one of a log's runs was left out
SAMPLER = "the sampler "  # begins the law of k of a function: no name of one reads as another law
CHAIN = "a chain of "  # begins that of chained manoeuvres
GIVEN, LISTED = "given ", "values, sha256 "  # begins that of values; in that of a list
LEFT = " left out"  # ends the number of windows that are no runs
OF_EACH = f"{OURS}runs", "one drawn from those of each recording with k in K"  # of groups
PLACES = f"{OURS}places"  # names how the places of a log were told; of two logs they may differ
APART = " s apart in the median"  # ends how far the clocks of these recordings were
EVEN = "a uniform draw"  # as of `told_of_part`
SAID = {"p": "axes", "q": "goal states", "k": "parameters"}  # parts of labels, in words
STATED = ("system", "rotation", "given")  # of a subject, what a log does not state


@dataclass(frozen=True)
class LawSpec:
    """Where rollouts come from. Two laws with the same hash are the same declared distribution.

    generator:  source of the rollouts: a system's name, or file:<name>.
    parameters: (name, value) pairs as text, sorted: the disturbance law of the system.
    k_law:      how k is drawn: "uniform" on [lo, hi], "given" with the values, "logged", "the
        sampler" with its name, as a chained system has it, or as of `told_of_part`.
    lo, hi:     (n_k,) corners of K, or of what K is a part of, as hex floats.
    """

    generator: str
    parameters: tuple[tuple[str, str], ...]
    k_law: str
    lo: tuple[str, ...]
    hi: tuple[str, ...]

    def __post_init__(self) -> None:
        for text in (self.generator, self.k_law, *chain(*self.parameters)):
            check_text("law", text)

    @property
    def hash(self) -> str:
        """SHA-256 of the canonical JSON of all fields."""
        return hash_of_law(asdict(self))

    @property
    def source(self) -> tuple:
        """Generator, and the parameters that a system declares."""
        return self.generator, [pair for pair in self.parameters if not pair[0].startswith(OURS)]

    @property
    def box(self) -> str:
        """Name of the box [lo, hi] in sentences: K, or N for a small box inside it."""
        return dict(self.parameters).get(BOX, "K")

    @property
    def is_even(self) -> bool:
        """Is k uniform on [lo, hi]?"""
        return self.k_law in ("uniform", told_of_part(replace(self, k_law="uniform")).k_law)

    @property
    def draws_on_box(self) -> bool:
        """Is k drawn on all of [lo, hi], alone or for each manoeuvre of a chain?"""
        return self.is_even or self.k_law.startswith(CHAIN)

    @property
    def fitted(self) -> str | None:
        """Runs that K was fitted to, or that a declared K left out, in words; None for neither."""
        return dict(self.parameters).get(FITTED)

    def of(self, k: np.ndarray) -> "LawSpec":
        """The law of runs that have these k (n, n_k): of a part of a given list, that part."""
        listed = self.k_law.startswith(GIVEN) and LISTED in self.k_law
        return replace(self, k_law=given_law(k)) if listed else self

    def lacks(self, K: Box) -> bool:
        """Were runs left out of these whose k may lie in K?"""
        whole = box(hex_floats(self.lo), hex_floats(self.hi))
        return not (self.fitted in (None, *FITS) or whole.contains([K.lo, K.hi]).all())

    @property
    def cut(self) -> Premises:
        """How its runs were cut out of what was logged; none where nobody says."""
        told = (x for x in self.parameters if x[0] not in (BOX, FITTED, OF_EACH[0], PLACES))
        how = (x for x in told if x[0].startswith(OURS) and not x[1].endswith((LEFT, APART)))
        return premises((name.removeprefix(OURS), MEASURED, value) for name, value in how)

    def describe(self) -> str:
        """One phrase for people."""
        return described(asdict(self))

    @property
    def how_drawn(self) -> str:
        """How k is drawn, in words that follow "k"."""
        return drawn(asdict(self))


def law_spec(
    generator: str, domain: Box, k_law: str = "uniform", parameters: Mapping | None = None
) -> LawSpec:
    """The law of a named generator over K = domain, with the parameters of its disturbances."""
    told = ((str(name), told_whole(value)) for name, value in (parameters or {}).items())
    lo, hi = (tuple(hex_text(corner)) for corner in (domain.lo, domain.hi))
    return LawSpec(generator, tuple(sorted(told)), k_law, lo, hi)


def given_law(values) -> str:
    """The law of given k: of one (n_k,) for all runs, or of a list (n, n_k), each driven once."""
    values = np.asarray(values, np.float64)
    if values.ndim == 1:
        return f"{GIVEN}({', '.join(map(str, values))})"
    return f"{GIVEN}({len(values):,} {LISTED}{content_hash(values)[:12]})"


def told_of_part(law: LawSpec) -> LawSpec:
    """The law where plans choose k from a part of its box, which is called K from there on: how k
    is drawn is said with the whole box.
    """
    if law.k_law.endswith(PART):
        return law
    how = {"uniform": EVEN, "logged": "the log's law"}.get(law.k_law, law.k_law)
    whole = box(hex_floats(law.lo), hex_floats(law.hi))
    return replace(law, k_law=f"{how} on {whole.text}{PART}")


def logged_on(law: LawSpec, K: Box) -> LawSpec:
    """The law of recordings for plans of a K that need not be theirs, nor a part of it."""
    if (tuple(hex_text(K.lo)), tuple(hex_text(K.hi))) == (law.lo, law.hi):
        return law
    told = [pair for pair in law.parameters if pair[0] != FITTED or pair[1] not in FITS]
    law = replace(law, parameters=tuple(told))
    if box(hex_floats(law.lo), hex_floats(law.hi)).contains(np.stack([K.lo, K.hi])).all():
        return told_of_part(law)
    return law_spec(law.generator, K, "logged", dict(law.parameters))


def law_of(system, k_law: str = "uniform") -> LawSpec:
    """The law of a system: its `law` (mapping or dataclass), and `plant` when that is a name.
    Raises InputError for a parameter with a name of ours.
    """
    with blamed(f"{system.name}: expected a law that can be read"):
        law = getattr(system, "law", None)
    with reading(f"{system.name}: its law", "values by name"):
        parameters = dict((asdict(law) if is_dataclass(law) else law) or {})
    named = {x: y for x in ["plant"] if isinstance(y := getattr(system, x, None), str)}
    if ours := [name for name in parameters if str(name).startswith(OURS) or name in named]:
        raise InputError(
            f"{system.name}: expected parameters of a law that do not begin with {OURS!r}, and "
            f"plant once; got {', '.join(map(str, ours))}. Rename them."
        )
    return law_spec(system.name, system.domain, k_law, parameters | named)


def identity_of(system) -> dict:
    """JSON-able identity across processes: law, grid, sizes, and a hash of the code and of every
    public attribute, but those in `content.OPERATIONAL` and opaque objects. Raises InputError.
    """
    check_system(system)
    reader = Reader(lasting=True)
    time = system.time
    identity = {
        "law": law_of(system).hash,
        "grid": hex_text([time.dt, time.t_f, time.dt_record]),
        "n_p": int(system.n_p),
        "n_q": int(system.n_q),
        "points": list(points_of(system)),
        "dtype of the system": np.dtype(getattr(system, "dtype", np.float64)).name,
        "code": reader.digest_of_type(system),
    }
    for name, value in reader.attributes(system):
        if name not in ("domain", "time", "law", "points"):  # above
            identity[f"attribute {name}"] = reader.digest(value)
    return identity


@dataclass(frozen=True, eq=False)
class Subject:
    """Subject of runs, of a claim about them and its model. Build with `subject`, which validates.

    system: name of the black box. domain: K. time: knots, records and horizon. points: names of the
    robot's reference points, in the order of their coordinates. rotation: declared behaviour of the
    heading, as of `rotation_of`. labels: names of coordinates, for people. given: axes of k that
    are measured at the start and not chosen, as of `given_of`. [T37]
    """

    system: str
    domain: Box
    time: TimeGrid
    points: tuple[str, ...]
    rotation: tuple[str, ...] | None
    labels: Labels
    given: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        check_text("system", self.system)
        turns = zip(self.labels.q, self.rotation or (), strict=False)
        units = [(label, "m") for label in self.labels.p]
        units += [(label, "rad") for label, word in turns if word == TURNS]
        for label, unit in units:
            require_unit(label, unit, self.points)
        axes = axes_in_all(self.labels.p, self.points)
        if self.rotation:  # of a robot that no heading turns these are but names
            named = ({*map(OF_BODY.get, words_in(x))} - {None} for x in self.labels.p)
            axes = [axis or body for axis, body in zip(axes, named, strict=True)]
        told = [*chain(*(x for x in axes if len(x) == 1))]
        if told != sorted(told) or "" in told:
            raise InputError(
                "labels of p: expected axes in the order x, y, z (east, north; ahead, left), as in "
                f"maps; got {', '.join(self.labels.p)}, maybe a mirrored world. Swap them."
            )

    @property
    def n_p(self) -> int:
        """Dimension of the workspace."""
        return len(self.labels.p)

    @property
    def n_q(self) -> int:
        """Number of further goal states."""
        return len(self.labels.q)

    @property
    def hidden(self) -> tuple[str, ...]:
        """What is assumed of the part of the start that is not measured, if any is. [T37]"""
        names = [name_of(self.labels.k[axis]) for axis in self.given]
        return (f"HIDDEN_START(given {listed(names)})",) if names else ()

    @property
    def layout(self) -> Layout:
        """Layout of the outputs of its network."""
        return Layout(self.time.n_steps, self.n_p, len(self.points))

    @property
    def identity(self) -> dict:
        """All but the labels, as plain values; equal for the same subject."""
        return ({"given": list(self.given)} if self.given else {}) | {
            "system": self.system,
            "domain": {"lo": hex_text(self.domain.lo), "hi": hex_text(self.domain.hi)},
            "time": hex_text([self.time.dt, self.time.t_f, self.time.dt_record]),
            "n_p": self.n_p,
            "n_q": self.n_q,
            "points": list(self.points),
            "rotation": None if self.rotation is None else list(self.rotation),
        }

    @property
    def premises(self) -> Premises:
        """The same for people, with the names of the parameters, to be compared with others."""
        told = {
            "system": self.system,
            "K": [list(map(exact, x)) for x in (self.domain.lo, self.domain.hi)],
            "time": [*map(exact, (self.time.dt, self.time.t_f, self.time.dt_record))],
            "sizes": [f"{SAID[x]}: {len(getattr(self.labels, x))}" for x in PARTS],
            "points": list(self.points),
            "rotation": "none" if self.rotation is None else ["heading", *self.rotation],
            "given": [str(axis) for axis in self.given],
        }
        told |= {SAID[part]: list(getattr(self.labels, part)) for part in PARTS}
        return premises((name, MEASURED, value) for name, value in told.items())

    def agree(
        self, where: str, other: "Subject", free: Iterable[str] = ("K",), hint: str = ""
    ) -> None:
        """Refuse the subject of others that are not of one robot. Coordinates without names of
        their own may have any, and where both say how they turn they must say the same. free, hint:
        as of `agree`. Raises InputError.
        """
        free = {*free, *(SAID[part] for one in (self, other) for part in plain_parts(one.labels))}
        if None not in (self.rotation, other.rotation):
            free.discard("rotation")
        agree(where, self.premises, other.premises, free=free, hint=hint)

    def unordered(self, other: "Subject") -> bool:
        """Test whether the order of parameters of either is not known by names."""
        return self.domain.n > 1 and any("k" in plain_parts(x.labels) for x in (self, other))

    def to_json(self) -> dict:
        """A JSON-able dictionary; numbers are strings."""
        words = {part: list(given) for part, given in self.labels._asdict().items()}
        # for people, and so in no hash of a claim; swapped ones would tell of another column
        return self.identity | {"labels": words, "labels_hash": hash_of(words)}

    def with_labels(self, given: Labels | Mapping[str, Sequence[str]]) -> "Subject":
        """The subject with other labels; a mapping gives some of p, q, k. Raises InputError."""
        words = self.labels._asdict() | words_of(given)
        return replace(self, labels=valid_labels(self.n_p, self.n_q, self.domain.n, **words))

    def check_renamed(self, where: object, part: str, columns: Sequence[str]) -> None:
        """Refuse labels in other units than columns, by another's name or in more words of another
        than of their own, as "right" for "left wheel" beside "right wheel". Raises InputError.
        """
        names = [_words_in(x) for x in columns]
        for i, y in enumerate(getattr(self.labels, part)[: len(names)]):
            shared, unit = [len(_words_in(y) & name) for name in names], unit_of(columns[i])
            if (unit and unit_of(y) != unit) or max(shared) > shared[i]:
                raise InputError(
                    f"{where}: expected a label of {part} for the column {columns[i]!r}, in its "
                    f"unit and with no other's name; got {y!r}."
                )


def _words_in(label: str) -> set[str]:
    """The name, as it is written, and its numbers and words of three letters or more."""
    parts = re.findall(r"\d+|[^\W\d_]{3,}", " ".join(words_in(label)))
    return {name_of(label), *parts}


def subject(
    system: str,
    domain: Box,
    time: TimeGrid,
    n_p: int,
    n_q: int,
    points: Sequence[str] | None = None,
    rotation: Sequence[str] | None = None,
    labels: Labels | Mapping[str, Sequence[str]] | None = None,
    given: Sequence[str | int] = (),
) -> Subject:
    """Validated subject. labels: `Labels`, or a mapping of some of p, q and k; others are plain.
    given: parameters by label, name or number. Raises InputError.
    """
    named = valid_labels(n_p, n_q, domain.n, **words_of(labels))
    return Subject(
        str(system),
        domain,
        time,
        ONE_POINT if points is None else check_points("runs", tuple(points)),
        None if rotation is None else check_rotation("runs", rotation, n_p, n_q),
        named,
        check_given("runs", given, named.k),
    )


def subject_of(system) -> Subject:
    """The subject of the runs of a system. Raises InputError."""
    about = (system.name, system.domain, system.time, system.n_p, system.n_q)
    named = points_of(system), rotation_of(system), labels_of(system)
    return subject(*about, *named, given_of(system))


def given_of(system) -> tuple[int, ...]:
    """Axes of k that a system declares to be measured at the start: `given`. Raises InputError."""
    return check_given(system.name, getattr(system, "given", ()), labels_of(system).k)


def check_given(owner: str, words, k_labels: Sequence[str]) -> tuple[int, ...]:
    """Axes of the parameters named by label, name or number. Raises InputError."""
    axes = axes_of(words if isinstance(words, tuple | list) else (words,), k_labels)
    if axes is None or len(axes) == len(k_labels):
        raise InputError(
            f"{owner}: expected given, a tuple of parameters that are measured at the start, of "
            f"{', '.join(k_labels)}, each once, not all of them; got {words!r:.60}."
        )
    return axes


def words_of(given: Labels | Mapping[str, Sequence[str]] | None) -> dict[str, Sequence[str]]:
    """Labels by part, none for None. Raises InputError for a part that there is none of."""
    with reading("labels", "names by part"):
        words = given._asdict() if isinstance(given, Labels) else dict(given or {})
    if words.keys() - {*PARTS}:
        raise InputError(
            f"labels: expected those of {', '.join(PARTS)}, as {{'k': ('speed [m/s]', ...)}}; got "
            f"{', '.join(map(str, words))}."
        )
    return words


def subject_from_json(data: dict) -> Subject:
    """The subject of `Subject.to_json`. Raises InputError, KeyError, TypeError."""
    if data.get("labels_hash") != hash_of(data["labels"]):  # none: edited by anybody
        raise InputError("labels: expected those that were written; got others. Save them anew.")
    lo, hi = (nearest_floats(data["domain"][side]) for side in ("lo", "hi"))
    about = [data[name] for name in ("n_p", "n_q", "points", "rotation", "labels")]
    time = time_grid(*nearest_floats(data["time"]))
    return subject(data["system"], box(lo, hi), time, *about, data.get("given", ()))
