"""The sentences of an answer: what is proved of the model and its tube, what a drawn plan risks."""

from collections.abc import Iterable, Mapping
from fractions import Fraction

from parc_jax.common.spelling import counted, listed, rounded_down, rounded_up
from parc_jax.learning.bound.counts import NoStatement, Risk
from parc_jax.safe_set.verdict.infeasible import Why

MOST_NUMBERS = 8  # that are listed


def nothing_found(reason: Why | None) -> str:
    """No plan was found, and nobody looked for a proof. reason: why none can be, where known."""
    if reason is not None and reason.sure:
        return f"No plan is safe: {reason.words}"
    why = "." if reason is None else f": {reason.words}"
    return f"No safe plan was found{why} This is not a proof that none exists."


def about_plans(samples: int, polytopes: int, corridors: int, proved: bool) -> str:
    """What holds for each of so many samples and for every plan of so many polytopes and corridors.
    proved: the exact checker accepted them.
    """
    how = "proved in exact arithmetic" if proved else "shown in float64 with a rounding margin"
    told = {
        "the sample": ("each of the {} samples", samples),
        "every (p0, k) in the safe polytope": (
            "every (p0, k) in the {} safe polytopes",
            polytopes,
        ),
        "every (p0, k) that meets all conditions of the corridor": (
            "every (p0, k) that meets all conditions of one of the {} corridors",
            corridors,
        ),
    }
    there = [one if n == 1 else many.format(f"{n:,}") for one, (many, n) in told.items() if n]
    return (
        f"For {listed(there)}, and for every trajectory inside the tube: the goal is reached and "
        f"nothing is touched; {how}."
    )


def about_place(k_lo, k_hi) -> str:
    """Of what the coverage speaks, where plans are so rare that only a box was drawn from."""
    box = " x ".join(f"[{lo:.6g}, {hi:.6g}]" for lo, hi in zip(k_lo, k_hi, strict=True))
    return (
        "Safe plans are rare: hardly a uniform draw met one, a search did. Coverage and volume are "
        f"of the safe set around what it found, with k in {box}; beyond that box nothing is known."
    )


def about_uncertainty(withstood: str) -> str:
    """What every plan of the answer withstands."""
    return (
        "Robust: all this is said of a question that allows for the uncertainty, and so it holds "
        f"for {withstood}. A plan that is absent is not shown to withstand all of it."
    )


def about_pose(place: Iterable[float], heading: float | None) -> str:
    """Where all plans of the answer start."""
    where = ", ".join(f"{x:g}" for x in place)
    if heading is None:
        return f"Here: all plans start at ({where}) m."
    return (
        f"Here: all plans start at ({where}) m with heading {heading:g} rad. Scene, plans and "
        "certificates are told in the robot's frame: its start is the origin, its heading 0. That "
        "a run turns with its heading is declared by the system."
    )


def about_sensing(risk: Risk | NoStatement, sensing_eps: Fraction) -> str:
    """The risk of the tube and that of the sensing together: the sum of two probabilities. [T21]"""
    eps = rounded_up(sensing_eps)
    if isinstance(risk, NoStatement):
        return f"What was measured lies outside of its uncertainty with probability at most {eps}."
    both = rounded_up(min(Fraction(1), risk.bound + sensing_eps))
    return (
        f"What was measured lies outside of its uncertainty with probability at most {eps}: "
        f"together at most {both}, if the deviations do not depend on the plan."
    )


def about_risk(
    risk: Risk | NoStatement,
    drawn: str,
    density: float | None,
    measured: float,
    delta: Fraction | None,
) -> str:
    """What a plan drawn by `Answer.sample` risks. drawn: what from, in words. density: bound on
    that of its k, which rests on a coverage known with confidence `measured`; None where nothing
    is said. delta: error probability of the claim.
    """
    if isinstance(risk, NoStatement):
        return f"Risk: no statement, since {risk.reason}."
    confidence = rounded_down(1 if delta is None else 1 - delta, 10)
    volume = f"confidence 0.999 and {float(measured)!r}"
    return (
        f"Risk: a plan drawn by `sample`, uniformly from {drawn}, leaves the tube with "
        f"probability at most {rounded_up(risk.bound)} (the density of its k is at most "
        f"{rounded_up(density)} times uniform, measured with {volume}; "
        f"the claim has confidence {confidence})."
    )


def about_loop() -> str:
    """The sentence (C) of a loop. [T38]"""
    return (
        "(C) Whatever happens inside the tubes, nothing is ever touched, while every pose is "
        "inside its uncertainty, what was said of obstacles is so, and a robot rests where a "
        "manoeuvre ends. What moves is told of until that rest: it may run into a robot that rests."
    )


def about_episodes(
    n: int,
    bad: int,
    counts: Mapping[str, int | None],
    eps: Fraction,
    look,
    contradictions: list[int],
) -> str:
    """Both sentences of a loop. [T40] counts: of episodes in which each thing happened, None where
    nobody looked. look: with its share of delta. contradictions: numbers of episodes that
    contradict the sentence (C).
    """
    sure = rounded_down(1 - look.delta, 10)
    which = f", look {look.number} of {look.planned}" if look.planned > 1 else ""
    watched = counts["a tube was left"] is not None
    what = "leaves a tube, or touches anything," if watched else "touches anything"
    seen = listed([f"in {m:,} {words}" for words, m in counts.items() if m is not None])
    sentences = [
        about_loop(),
        f"(E) Of {counted(n, 'fresh episode')} {bad:,} were bad: {seen}.",
        f"With confidence {sure} over them, an episode of this law {what} with probability at most "
        f"{rounded_up(eps)}{which}, for whatever reason. What runs into a robot that rests is not "
        "counted.",
    ]
    if contradictions:
        first = [str(i) for i in contradictions[:MOST_NUMBERS]]
        more = ["others"] if len(contradictions) > MOST_NUMBERS else []
        sentences.append(
            f"CONTRADICTED: in {counted(len(contradictions), 'episode')} ({listed(first + more)}) "
            "something was touched inside the tubes, so something that (C) assumes does not hold."
        )
    return " ".join(sentences)
