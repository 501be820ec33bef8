"""Episodes changed at random, sealed as an honest program would seal them, and judged by an oracle
that shares nothing with the checker.
"""

import collections
import copy
import itertools
import math
import random
from fractions import Fraction as F

from answer_files import text, value
from episode_files import DT, Robot, beyond, sealed

from parc_jax import checker
from parc_jax.checker.answer import allowance_of

NEAR = F(1, 10**9)  # [m] of cosine and sine in floats


def valid(seed: int) -> dict:
    """An episode of a robot with one to three points, with headings or without."""
    draw = random.Random(seed)
    robot = Robot(seed, points=draw.choice([1, 2, 3]), copies=draw.choice([1, 3]))
    doubt = [F(draw.randint(0, 2), 128) for _ in range(4)]
    heading = draw.choice([None, F(1, 3)])
    if heading is not None and robot.copies == 1:
        doubt[2] = F(0)
    return robot.episode(robot.driven(4, heading), doubt)


KINDS = ("begin", "pose", "k", "radius", "doubt", "width", "left out", "premise")


def changed(file: dict, kind: str, draw: random.Random) -> dict:
    """The file, in which one thing of this kind is not as it was."""
    file = copy.deepcopy(file)
    many, by = file["manoeuvres"], F(draw.randint(-64, 64), draw.choice([32, 128, 2048]))
    i = draw.randrange(len(many))
    one = many[i]
    if kind == "begin":
        one["begin"] = text(value(one["begin"]) + by)
    elif kind == "pose":
        axis = draw.randrange(len(one["pose"]))
        one["pose"][axis] = text(value(one["pose"][axis]) + by)
        if len(one["pose"]) == 2:
            one["sample"]["p0"] = list(one["pose"])
    elif kind == "k":
        one["sample"]["k"] = text([max(F(-1), min(F(1), value(one["sample"]["k"][0]) + by))])
    elif kind == "radius":
        one["problem"]["body"]["parts"][0]["radius"] = text(abs(by))
    elif kind == "doubt":
        axis = draw.randrange(4)
        file["doubt"][axis] = text(value(file["doubt"][axis]) + by / 16)
    elif kind == "width":
        interval = file["tube"]["interval"][0]
        at = draw.randrange(len(interval)), draw.randrange(len(interval[0])), draw.randrange(2)
        interval[at[0]][at[1]][at[2]] = text(abs(by) / 8)
    elif kind == "left out":
        del many[i]
    else:
        at = draw.randrange(len(file["premises"]))
        part = draw.choice([1, 2])
        file["premises"][at][part] = draw.choice(["checked", "assumed", "0 m", 0])
    return sealed(file, told=kind != "premise")


def true(robot: Robot, file: dict) -> bool:
    """Is it as an accepted one has to be? robot: whose network it has."""
    copies, tube = robot.copies, value(file["tube"]["interval"][0])
    robot.widths = [
        [row[i * copies : (i + 1) * copies] for i in range(robot.points)] for row in tube
    ]
    doubt, many = value(file["doubt"]), file["manoeuvres"]
    bodies = [one["problem"]["body"]["parts"][0]["radius"] for one in many]
    if min(doubt) < 0 or len({value(radius) for radius in bodies}) > 1:
        return False
    for a, b in itertools.pairwise(many):
        passed = value(b["begin"]) - value(a["begin"])
        (*place, turn), (*there, next_turn) = ([*value(one["pose"]), F(0)][:3] for one in (a, b))
        turns = [(F(math.cos(x)), F(math.sin(x))) for x in (turn, next_turn)]
        k, next_k = (value(one["sample"]["k"][0]) for one in (a, b))
        if passed < DT / 2:
            return False
        if beyond(robot, (place, k), (there, next_k), passed, doubt, *turns) > NEAR:
            return False
    return True


def check_episode_mutants(seed: int, count: int) -> collections.Counter:
    """How many mutants of one episode were rejected, accepted and true, or false, by what was
    changed.
    """
    file, draw = valid(seed), random.Random(seed + 1)
    checker.check_episode(file, allowance_of)
    points = random.Random(seed).choice([1, 2, 3])
    robot = Robot(seed, points=points, copies=file["copies"])
    tally: collections.Counter = collections.Counter()
    for _ in range(count):
        kind = draw.choice(KINDS)
        try:
            mutant = changed(file, kind, draw)
            checker.check_episode(mutant, allowance_of)
        except checker.Rejected:
            tally[f"episode: {kind}", "rejected"] += 1
            continue
        same = kind != "premise" or mutant["premises"] == file["premises"]
        verdict = "accepted" if same and true(robot, mutant) else "false"
        tally[f"episode: {kind}", verdict] += 1
    return tally
