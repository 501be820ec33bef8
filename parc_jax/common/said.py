"""Sentences whose numbers stand in braces, as "within {0.5} m/s": of texts that differ in these
alone one is told, with each number from the least to the most.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from decimal import Decimal

from parc_jax.common.spelling import rounded_down, rounded_up

NUMBER = r"-?\d+(?:\.\d*)?(?:e[+-]?\d+)?"
SLOT = re.compile(rf"{{({NUMBER})(?: to ({NUMBER}))?}}")


def slot(*numbers: str) -> str:
    """Decimals as they stand in braces, exactly: one, or the least and the most."""
    least, most = min(numbers, key=Decimal), max(numbers, key=Decimal)
    return f"{{{least}}}" if Decimal(least) == Decimal(most) else f"{{{least} to {most}}}"


def together(texts: Iterable[str]) -> dict[str, str]:
    """By each text the one that tells of all which differ in numbers in braces alone."""
    alike, found = defaultdict(list), {}
    for text in dict.fromkeys(texts):
        alike[SLOT.sub("{}", text)].append(text)
    for of in alike.values():
        places = zip(*map(SLOT.findall, of), strict=True)  # the same one of each text
        ends = iter([slot(*(x for pair in one for x in pair if x)) for one in places])
        found |= dict.fromkeys(of, SLOT.sub(lambda _, ends=ends: next(ends), of[0]))
    return found


def most_and_often(of: Iterable[tuple[Mapping, Mapping]]) -> tuple[Counter[str], Counter[str]]:
    """Of texts how many hold at a time, at most, and in how many manoeuvres: of several such pairs,
    in each of which one alone is told of those that differ in numbers alone.
    """
    of, most, often = list(of), Counter[str](), Counter[str]()
    one = together(text for at_once, _ in of for text in at_once)
    for at_once, told in of:
        most |= Counter({one[text]: n for text, n in at_once.items()})
        often.update({one[text]: n for text, n in told.items()})
    return most, often


def without_braces(text: str) -> str:
    """For people: of two numbers the least is rounded down, the most up."""
    return SLOT.sub(_ends, text)


def _ends(hit: re.Match) -> str:
    least, most = hit.groups()
    return least if most is None else f"{rounded_down(least)} to {rounded_up(most)}"


def about_said(rests: Mapping[str, int], told: Mapping[str, int] | None = None, of: int = 0) -> str:
    """What obstacles rest on: `Problem.rests_on`, or the most of several manoeuvres. told: in how
    many `of` them each was said.
    """
    n, words = told or {}, []
    for said, most in sorted(rests.items()):
        some = f", in {n[said]:,} of {of:,} manoeuvres alone" if n.get(said, of) < of else ""
        words.append(f"Of at most {most} at a time{some}: {without_braces(said)}")
    return " ".join(words)
