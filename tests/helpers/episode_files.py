"""Episodes made by hand, of a robot of several points whose network is affine, and in which way the
next one begins too far away: plain Python and fractions, nothing shared with the checker.
"""

import hashlib
import json
import random
from fractions import Fraction as F

from answer_files import text

from parc_jax.checker.rests_on import known_premises

DT = F(1, 4)


def sha(part) -> str:
    canonical = json.dumps(part, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def sealed(file: dict, told: bool = True) -> dict:
    """The file as it comes from JSON, all of its hashes right; told: its premises too, but for what
    it adds.
    """
    file = json.loads(json.dumps(file))
    if told:
        known = known_premises(file)
        file["premises"] = known + file.get("premises", [])[len(known) :]
    parts = ("network", "tube", "manoeuvres", "claim", "copies", "doubt", "premises")
    hashes = {part: sha(file[part]) for part in ("network", "tube")}
    if file["claim"] is not None:
        file["claim"] |= {f"{part}_hash": value for part, value in hashes.items()}
    hashes["episode"] = sha({part: file[part] for part in parts})
    return file | {"format": "parc_jax.episode/3", "hash": hashes}


class Robot:
    """points: its own, each told by so many copies. The offset of copy c of point i at knot s is
    places[s][i][c] + k ways[s], with errors widths[t][i][c]; over the last interval it stands.
    """

    def __init__(self, seed: int, T: int = 4, points: int = 2, copies: int = 1):
        draw = random.Random(seed)

        def some(size):
            return [F(draw.randint(-size, size), 64) for _ in range(2)]

        self.T, self.points, self.copies = T, points, copies
        shape = [
            [[F(i, 2), F(0)] if c == 0 else some(6) for c in range(copies)] for i in range(points)
        ]
        shape[0][0] = [F(0), F(0)]
        self.places = [
            [[[x + y for x, y in zip(at, some(4), strict=True)] for at in each] for each in shape]
            for _ in range(T)
        ]
        self.places[0] = shape
        self.places.append(self.places[-1])
        self.ways = [[F(s, T), F(s, 2 * T)] for s in (*range(T), T - 1)]
        self.widths = [
            [[[abs(x) + F(1, 64) for x in some(9)] for _ in range(copies)] for _ in range(points)]
            for _ in range(T)
        ]

    def at(self, s: F | int, i: int, c: int, k) -> list:
        """Where it is after so many intervals, from the start: straight between knots."""
        first = min(int(s), self.T - 1)
        ends = (zip(self.places[t][i][c], self.ways[t], strict=True) for t in (first, first + 1))
        begin, end = ([a + k * b for a, b in pairs] for pairs in ends)
        return [a + (s - first) * (b - a) for a, b in zip(begin, end, strict=True)]

    def network(self) -> dict:
        rows, biases = [], []
        for s in range(self.T + 1):
            for i in range(self.points):
                for c in range(self.copies):
                    if (s, i, c) != (0, 0, 0):
                        rows += [[b] for b in self.ways[s]]
                        biases += self.places[s][i][c]
        return {"weights": [text(rows)], "biases": [text(biases)]}

    def tube(self) -> dict:
        flat = [[e for each in by_point for e in each] for by_point in self.widths]
        end = [F(1) for _ in range(2 * self.points * self.copies)]
        return {"edges": [["-1", "1"]], "interval": [text(flat)], "final": [text(end)]}

    def problem(self, obstacles: int = 1) -> dict:
        n = self.points * self.copies
        far = {"A": text([[1, 0], [0, 1], [-1, 0], [0, -1]]), "b": ["101", "101", "-100", "-100"]}
        return {
            "n_p": 2,
            "points": n,
            "n_q": 0,
            "n_k": 1,
            "steps": self.T,
            "dt": str(DT),
            "domain": {"lo": ["-1"], "hi": ["1"]},
            "goal": {"A": text([[1] + [0] * (2 * n - 1)]), "b": ["1000"]},
            "start": None,
            "obstacles": [far] * obstacles,
            "body": {"parts": [{"points": list(range(n)), "radius": "1/20"}]},
        }

    def manoeuvre(self, begin, pose, k, obstacles: int = 1) -> dict:
        """From a pose, with a heading where it has three numbers."""
        p0 = [0, 0] if len(pose) == 3 else pose
        sep = [[[[self.T, [[2, "1"]]]]]] * obstacles
        return {
            "begin": text(begin),
            "pose": text(pose),
            "problem": self.problem(obstacles),
            "sample": {"p0": text(p0), "k": [text(k)], "sep": sep},
        }

    def episode(self, manoeuvres, doubt=(0, 0, 0, 0)) -> dict:
        """The file, sealed."""
        return sealed(
            {
                "network": self.network(),
                "tube": self.tube(),
                "claim": None,
                "copies": self.copies,
                "doubt": text(list(doubt)),
                "manoeuvres": list(manoeuvres),
                "meta": None,
            }
        )

    def driven(self, n: int = 3, heading=None) -> list:
        """n manoeuvres, each left after two steps, none of which turns."""
        k, place, out = F(1, 8), [F(0), F(0)], []
        for j in range(n):
            pose = place if heading is None else [*place, heading]
            out.append(self.manoeuvre(2 * DT * j, pose, k))
            place = [a + b for a, b in zip(place, self.at(2, 0, 0, k), strict=True)]
        return out


def beyond(robot: Robot, one, other, passed, doubt, turn_one=None, turn_other=None) -> F:
    """[m] by which the reference points of the other one, (place, k), lie outside of where those of
    the one may be after a time: the most over points and over both ways along both axes; not above
    zero where it may have begun there. doubt: as of a file. turns: (cosine, sine) of a heading.
    """
    (place, k), (next_place, next_k) = one, other
    knot = min(passed / DT, robot.T)
    held = {min(int(knot), robot.T - 1)}  # a knot belongs to both its intervals
    held |= {int(knot) - 1} if knot == int(knot) else set()
    cos, sin = turn_one or (F(1), F(0))
    next_cos, next_sin = turn_other or (F(1), F(0))
    found = []
    for axis in range(2):
        # unit vector of the axis of the one, in the world and for the other one
        e = (cos, sin) if axis == 0 else (-sin, cos)
        f = (next_cos * e[0] + next_sin * e[1], next_cos * e[1] - next_sin * e[0])
        off = [b - a for a, b in zip(place, next_place, strict=True)]
        way = sum(a * b for a, b in zip(e, off, strict=True))
        room = 2 * (doubt[0] + doubt[1]) + doubt[3] + doubt[2] * sum(map(abs, off))
        for i in range(robot.points):
            there = [(way, F(0))]
            if i > 0:
                there = []
                for c in range(robot.copies):
                    at = sum(a * b for a, b in zip(f, robot.at(0, i, c, next_k), strict=True))
                    half = robot.widths[0][i][c]
                    wide = sum(abs(a) * b for a, b in zip(f, half, strict=True))
                    there.append((way + at, wide))
            next_low, next_high = min(a - e for a, e in there), max(a + e for a, e in there)
            for t in held:
                here = [
                    (robot.at(knot, i, c, k)[axis], robot.widths[t][i][c][axis])
                    for c in range(robot.copies)
                ]
                highest, lowest = max(a + e for a, e in here), min(a - e for a, e in here)
                found += [next_low - highest - room, lowest - next_high - room]
    return max(found)
