"""An answer: plans (p0, k), boxes and polytopes of plans, "none" or "unknown", out of JSON that
anybody may have written.
"""

import json
from dataclasses import dataclass, field

import numpy as np

from benchmarks.suite.bad import Refused

SOME, NONE, UNKNOWN = "some", "none", "unknown"
WORDS = {"verdict", "plans", "boxes", "polytopes"}
SETS, ROWS, PLANS = 2_000, 100_000, 100_000  # that an answer may have, rows in all its polytopes
FIRST, LAST = 1 << 12, 1 << 20  # draws that measure a piece: at first, and where hardly one is in
ENOUGH = 50  # draws inside of a piece that measure it; a piece with fewer holds nothing
DUST = LAST // 4  # draws after which none inside decides: ENOUGH would follow once in 10^8 pieces
AT_ONCE = 8  # rows of a polytope tested together: few of the draws around dust pass the first
ALONE = 1 / 50  # of what is drawn from sets one by one must be left when a plan comes only once


@dataclass(frozen=True)
class Piece:
    """The plans z (n_p + n_k,) between lo and hi with A z <= b."""

    lo: np.ndarray
    hi: np.ndarray
    A: np.ndarray
    b: np.ndarray

    def holds(self, plans: np.ndarray) -> np.ndarray:
        """Which of plans (n, d) are in it."""
        found = ((self.lo <= plans) & (plans <= self.hi)).all(axis=1)
        if len(self.b) and found.any():
            found[found] = (plans[found] @ self.A.T <= self.b).all(axis=1)
        return found

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """What of n uniform draws between lo and hi is in it."""
        plans = rng.uniform(self.lo, self.hi, (n, len(self.lo)))
        for first in range(0, len(self.b), AT_ONCE):
            rows = slice(first, first + AT_ONCE)
            plans = plans[(plans @ self.A[rows].T <= self.b[rows]).all(axis=1)]
        return plans


@dataclass(frozen=True)
class Answer:
    """verdict: one of SOME, NONE, UNKNOWN. plans (n, d): single ones. pieces: sets of plans."""

    verdict: str
    plans: np.ndarray
    pieces: tuple[Piece, ...] = ()


@dataclass
class Sets:
    """The sets of an answer, measured by draws, so that plans can be drawn evenly from their union.

    volumes: of each, zero where hardly a draw fell into it; shares of flat sets, if all are flat.
    """

    pieces: tuple[Piece, ...]
    rng: np.random.Generator
    volumes: np.ndarray = field(init=False)
    flat: bool = field(init=False)

    def __post_init__(self) -> None:
        sides = np.array([piece.hi - piece.lo for piece in self.pieces])
        solid = sides.min(axis=1) > 0
        shares = np.array([self._share(piece) for piece in self.pieces])
        self.flat = not (solid & (shares > 0)).any()
        self.volumes = shares * (np.ones(len(sides)) if self.flat else sides.prod(axis=1))

    def _share(self, piece: Piece) -> float:
        tried = inside = 0
        size = FIRST
        while inside < ENOUGH and tried < LAST:
            if inside or tried < DUST:
                inside += len(piece.draw(self.rng, size))
            else:  # of the same chance as if they were drawn
                self.rng.bit_generator.advance(size * len(piece.lo))
            tried += size
            size = min(4 * size, LAST // 4)
        return inside / tried if inside >= ENOUGH else 0.0

    def __bool__(self) -> bool:
        return bool(self.volumes.sum() > 0)

    def holds(self, plans: np.ndarray) -> np.ndarray:
        """Which of plans (n, d) are in one of the sets that are drawn from."""
        found = np.zeros(len(plans), bool)
        for piece in self._drawn_from:
            left = np.flatnonzero(~found)
            found[left] = piece.holds(plans[left])
        return found

    @property
    def _drawn_from(self) -> list[Piece]:
        return [piece for piece, v in zip(self.pieces, self.volumes, strict=True) if v > 0]

    def draw(self, n: int) -> np.ndarray:
        """n plans (n, d), uniform over the union; of flat sets, from each as often. Raises Refused
        for copies upon copies of a set.
        """
        out, missing, tried = [], n, 0
        while missing > 0:
            if tried > n / ALONE:
                raise Refused(
                    "answer: expected sets that hardly overlap; most plans are in dozens of them. "
                    "Leave copies out."
                )
            tried += 2 * missing
            counts = self.rng.multinomial(2 * missing, self.volumes / self.volumes.sum())
            drawn = [self._exactly(self.pieces[i], counts[i]) for i in np.flatnonzero(counts)]
            plans = self.rng.permutation(np.concatenate(drawn))
            if not self.flat:  # a plan in several sets may come only once
                many = np.sum([piece.holds(plans) for piece in self._drawn_from], axis=0)
                plans = plans[self.rng.uniform(size=len(plans)) * many < 1]
            out.append(plans[:missing])
            missing -= len(out[-1])
        return np.concatenate(out)

    def _exactly(self, piece: Piece, n: int) -> np.ndarray:
        out, missing, size = [], n, 4 * n
        while missing > 0:
            out.append(piece.draw(self.rng, size)[:missing])
            missing -= len(out[-1])
            size = min(4 * size, LAST)
        return np.concatenate(out)


def read(text: str | bytes, lo: np.ndarray, hi: np.ndarray) -> Answer:
    """The answer in a JSON text, about plans between lo and hi (d,): starts of the scene and
    parameters of the box. Sets are cut to these; a single plan outside of them is refused. Raises
    Refused.
    """
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise Refused(f"answer: expected JSON; {error}.") from None
    if not isinstance(data, dict) or not data.keys() <= WORDS:
        raise Refused(f"answer: expected an object with {', '.join(sorted(WORDS))}.")
    verdict = data.get("verdict")
    if verdict not in (SOME, NONE, UNKNOWN):
        raise Refused(f"answer: expected verdict some, none or unknown; got {verdict!r:.40}.")
    d = len(lo)
    plans = _array("plans", data.get("plans", []), d)
    pieces = [_box(one, d) for one in _list("boxes", data)]
    pieces += [_polytope(one, d) for one in _list("polytopes", data)]
    if verdict != SOME and (len(plans) or pieces):
        raise Refused(f"answer: expected no plans beside the verdict {verdict}.")
    rows = sum(len(piece.b) for piece in pieces)
    if len(pieces) > SETS or rows > ROWS or len(plans) > PLANS:
        raise Refused(
            f"answer: expected at most {SETS} sets, {ROWS} rows and {PLANS} plans; got "
            f"{len(pieces)}, {rows}, {len(plans)}."
        )
    if not ((lo <= plans) & (plans <= hi)).all():
        raise Refused("answer: expected plans that start in the scene's start, with k in K.")
    cut = (Piece(np.maximum(p.lo, lo), np.minimum(p.hi, hi), p.A, p.b) for p in pieces)
    once = {b"".join(x.tobytes() for x in (p.lo, p.hi, p.A, p.b)): p for p in cut}
    return Answer(verdict, plans, tuple(p for p in once.values() if (p.lo <= p.hi).all()))


def _no_number(word: str):
    raise Refused(f"answer: expected numbers; got {word}.")


def _list(name: str, data: dict) -> list[dict]:
    value = data.get(name, [])
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        raise Refused(f"answer: expected {name}, a list of objects.")
    return value


def _array(name: str, value, d: int) -> np.ndarray:
    """(n, d) finite numbers. Raises Refused."""
    try:
        array = np.array(value)
        if array.dtype.kind not in "iuf":  # strings, say, which NumPy would take for numbers
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise Refused(f"answer: expected {name}, rows of {d} finite numbers.") from None
    if array.size == 0:
        return np.empty((0, d))
    if array.ndim != 2 or array.shape[1] != d or not np.isfinite(array).all():
        raise Refused(
            f"answer: expected {name}, rows of {d} finite numbers; got an array {array.shape}."
        )
    return array


def _box(table: dict, d: int, words=frozenset({"lo", "hi"})) -> Piece:
    if table.keys() != words:
        raise Refused(f"answer: expected {', '.join(sorted(words))} of a set; got {[*table]}.")
    bounds = _array("lo and hi of a set", [table["lo"], table["hi"]], d)
    if len(bounds) != 2:
        raise Refused(f"answer: expected lo and hi of a set, {d} numbers each.")
    return Piece(*bounds, np.empty((0, d)), np.empty(0))


def _polytope(table: dict, d: int) -> Piece:
    around = _box(table, d, frozenset({"lo", "hi", "A", "b"}))
    A = _array("A of a polytope", table["A"], d)
    b = _array("b of a polytope", [table["b"]], len(A)).ravel()
    if len(A) != len(b):
        raise Refused(f"answer: expected a number in b for each row of A; got {len(b)}, {len(A)}.")
    return Piece(around.lo, around.hi, A, b)
