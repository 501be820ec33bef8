"""The sentences of episodes, printed from what came of each: the proof about their manoeuvres (C),
how often an episode is bad (E), and what contradicts both. [T38, T40]
"""

from collections import Counter
from collections.abc import Sequence

from parc_jax.common.said import about_said, most_and_often
from parc_jax.common.spelling import counted, exact, listed, rounded_down, rounded_up, some_of
from parc_jax.drive.loop.workers import Driven


def about_episodes(episodes) -> str:
    """Both sentences of a loop, from its `Episodes`. [T40]"""
    left, look, contradictions = episodes.left, episodes.look, episodes.contradictions
    event = "touches anything" if left is None else "leaves a tube, or touches anything,"
    found = Counter(one.left for one in episodes.driven)
    events = [f"in {found[True]:,} a tube was left"] if left is not None or found[True] else []
    if events and left is None:
        events[0] += f", of {found[True] + found[False]:,} in which that was tested"
    events += [f"in {n:,} {words}" for words, n in found.items() if isinstance(words, str)]
    events.append(f"in {episodes.touched:,} something was touched")
    events.append(f"in {episodes.failed:,} there was no outcome")
    begun = [one.before for one in episodes.driven if one.before is not None]
    sentences = [
        about_loops(episodes.driven),
        f"(E) Of {counted(episodes.n, 'fresh episode')} {episodes.bad:,} were bad: "
        f"{listed(events)}.",
        f"With confidence {look.sure} over them, an episode of this law {event} with probability "
        f"at most {rounded_up(episodes.eps)}{look.numbered(', look')}, for whatever reason. What "
        "runs into a robot that rests is not counted. Assumes: worlds, starts and disturbances of "
        f"use come from this law ({episodes.law}); the driver ({episodes.drive}) and all else that "
        f"decides were settled before the first episode and stay so (episodes: {episodes.again}); "
        f"no episodes were driven for it but those of its {counted(look.planned, 'look')}, under "
        "any key; what stopped the work, if anything, had nothing to do with how episodes went"
        f"{f': {sum(begun):,} had begun by then, and were driven again' if begun else ''}.",
    ]
    if contradictions:
        sentences.append(
            f"CONTRADICTED: in {counted(len(contradictions), 'episode')} "
            f"({some_of(contradictions)}) something was touched inside the tubes, so something "
            "that (C) assumes does not hold, or it is about nothing that was told of for the "
            "manoeuvre under way."
        )
    return " ".join(sentences)


def about_loops(driven: Sequence[Driven]) -> str:
    """The sentence (C) of the loops that committed to manoeuvres in some of the episodes. [T38]"""
    loops = sorted({loop for one in driven for loop in one.loops})
    if not loops:
        return "(C) is not said: no episode tells of a manoeuvre that a loop committed to."
    others = sum(not one.loops for one in driven)
    more = f" Of {counted(others, 'episode')} without one nothing is shown." if others else ""
    short = [one.told_for for one in driven if one.loops and one.told_for is not None]
    first = f", of some for the first {rounded_down(min(short))} s alone" if short else ""
    most, told = most_and_often((one.rests_on, one.told_in) for one in driven)
    rests = f" {about_said(most, told, sum(len(one.manoeuvres) for one in driven))}" if most else ""
    drifted = max(one.drifted for one in driven)
    rests += f" Of each episode is assumed: {about_drift(drifted)}." if drifted else ""
    return (
        f"(C) Of the manoeuvres of {some_of([f'a loop ({loop})' for loop in loops])}, shown in "
        "float64 with a rounding margin: whatever happens inside the tubes, nothing is touched "
        "that was told of for the manoeuvre under way, while every pose is inside its uncertainty, "
        "what was said of obstacles is so, and a robot rests where a manoeuvre ends. What moves is "
        f"told of for its intervals alone, until that rest at most{first}: later it may run into a "
        f"robot, also one that rests.{rests}{more}"
    )


def about_drift(drifted: float) -> str:
    """What obstacles and a goal rest on in a frame that may have drifted [m] in an episode."""
    off = f"may have turned, and drifted by {rounded_up(exact(drifted), 3)} m where the robot is"
    told = "obstacles and a goal are where they are told to be"
    return f"{told}, in a frame that {off}, since the episode began"
