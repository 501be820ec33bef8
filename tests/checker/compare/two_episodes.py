"""Episodes with one thing changed: of what both checkers look at they must say the same. The proved
one does not ask where the next manoeuvre began, whether anybody could rest, or for the premises.
"""

import copy
import json
from unittest import mock

import episode_mutants
import leaves
from episode_files import sealed

from parc_jax import checker
from parc_jax.checker import episode
from parc_jax.checker.answer import allowance_of

PLACES = ("manoeuvres", "manoeuvres", "manoeuvres", "tube", "network", "copies", "doubt")
KNOWN: dict = {}


def batch(rng, left, valid=None):
    """So many of a few episodes: leaves, lists and fields, and what episode_mutants.py changes."""
    seed = rng.randrange(60)
    file = valid or KNOWN.setdefault(seed, episode_mutants.valid(seed))
    edits: dict = {part: list(leaves.edits(file[part])) for part in set(PLACES)}
    for _ in range(min(left, 100)):
        if rng.random() < 0.1:
            kind = "frame"
            mutant = attempt(lambda: framed(file, rng))
        elif rng.random() < 0.5 and valid is None:
            kind = rng.choice(episode_mutants.KINDS[:-1])
            mutant = attempt(lambda kind=kind: episode_mutants.changed(file, kind, rng))
        else:
            part = rng.choice(PLACES)
            kind, put = rng.choice(edits[part])
            kind = (part, *kind)
            changed = copy.deepcopy(file) | {part: put}
            mutant = attempt(lambda changed=changed: sealed(changed, told=False))
        if mutant is not None:
            yield kind, json.dumps(mutant)


def framed(file, rng):
    """Another heading for one manoeuvre, or its place in the world: the origin, where a plan of
    either frame starts.
    """
    file = copy.deepcopy(file)
    one = file["manoeuvres"][rng.randrange(len(file["manoeuvres"]))]
    n_p = one["problem"]["n_p"]
    heading = [] if n_p != 2 else rng.choice([[], ["8"], ["-8"], ["8.0000001"], ["-0x1p+3"], ["9"]])
    one["pose"] = [*rng.choice([["0"] * n_p, one["pose"][:n_p]]), *heading]
    one["sample"]["p0"] = ["0"] * n_p
    return sealed(file, told=False)


def attempt(make):
    """What is made, or None where nothing can be."""
    try:
        return make()
    except (checker.Rejected, KeyError, IndexError, TypeError, ValueError):
        return None


def judge(what, text, said):
    """Whether it is accepted."""
    with (
        mock.patch.object(episode.Chain, "follows", check_begins),
        mock.patch.object(episode.Chain, "moves_at_end", lambda self: (0, 0)),
        mock.patch.object(episode, "checked_premises", lambda file: file["premises"]),
    ):
        try:
            checker.check_episode(json.loads(text), allowance_of)
            python = None
        except checker.Rejected as why:
            python = str(why)
    same = (python is None) == (said["code"] == 0)
    yield python is None, None if same else (what, python, said["lines"][0])


def check_begins(self, one, other):
    """That the next one begins late enough, whatever its pose."""
    return 2 * (other.begin - one.begin) >= self.context.dt
