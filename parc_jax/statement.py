"""The sentences of an answer, printed from premises and counts: the proof about the model and its
tube (C), the error bound of the tube (E), the risk of a drawn plan.
"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from parc_jax.checker.answer import scene_of
from parc_jax.common.premises import ASSUMED, Premises
from parc_jax.common.said import about_said
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted, exact, listed, rounded_down, rounded_up, some_of
from parc_jax.common.status import Status
from parc_jax.learning.bound.counts import NoStatement, Risk
from parc_jax.learning.bound.statement import (
    AS_RECORDED,
    UNSHOWN,
    VALIDATED,
    about_open_bins,
    confidence_of,
    in_box,
)
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.system import TURNS, TimeGrid
from parc_jax.problem.body import numbered
from parc_jax.problem.problem import Problem, box_of_rows
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.problem.robust.pose import Pose
from parc_jax.proof.certificate.write import problem_part
from parc_jax.safe_set.corridors.sampling import FEW
from parc_jax.safe_set.corridors.search import Share
from parc_jax.safe_set.corridors.stopping import Coverage
from parc_jax.safe_set.verdict.infeasible import Reason, any_end_is_in, why_none
from parc_jax.safe_set.verdict.scene import Scene

IN_THE_BOX = "the plans whose first point ends in the goal's box, whatever else the goal asks"


def nothing_found(reason: Reason | None, box: str = "K") -> str:
    """No plan was found, and no proof was searched. reason: why, if it is clear. box: of k."""
    if reason is not None and reason.sure:
        return f"No plan is safe: {reason.words}"
    why = "." if reason is None else f": {reason.words}"
    return f"No safe plan was found{in_box(box)}{why} This is not a proof that none exists."


def about_plans(samples: int, polytopes: int, corridors: int, t_f: float, proved: bool) -> str:
    """The sentence (C) of numbers of samples, polytopes and corridors.

    t_f: [s] how long a plan is. proved: the exact checker accepted them.
    """
    how = "proved in exact arithmetic" if proved else "shown in float64 with a rounding margin"
    sets = {
        "the sample": ("each of the {} samples", samples),
        "every (p0, k) in the safe polytope": ("every (p0, k) in the {} safe polytopes", polytopes),
        "every (p0, k) that meets all conditions of the corridor": (
            "every (p0, k) that meets all conditions of one of the {} corridors",
            corridors,
        ),
    }
    there = [one if n == 1 else many.format(f"{n:,}") for one, (many, n) in sets.items() if n]
    return (
        f"For {listed(there)}, and for every trajectory inside the tube: the goal is reached and "
        f"nothing is touched in its {exact(t_f)} s, and nothing is said of later; {how}."
    )


def about_obstacles(problem: Problem, time: TimeGrid) -> str:
    """What obstacles rest on: how many exist for some intervals of a plan alone, and when such a
    plan has to begin; empty for nothing.
    """
    told, of = [x for x in problem.all_spans if x is not None], len(problem.obstacles)
    # what is told of for a whole plan is told of for that of its moment alone
    some = sum(tuple(x) != (0, time.n_steps - 1) or x.at is not None for x in told)
    rests = about_said(problem.rests_on)
    # a file does not see it, and says so; whose manoeuvre is over has no place any more
    over = sorted({x.void for x in told if x.void and not isinstance(x.of, str)})
    rests = " ".join([rests, *(f"Not any more: what is in the way {words}." for words in over)])
    if not some:
        return rests
    told_for = Fraction(exact(time.dt)) * problem.told_for(time.n_steps)
    until = f", until {rounded_down(told_for, 4)} s of it at least" if told_for else ""
    whom, when = "it" if some == 1 else "some", "later" if told_for else "at other times"
    moments = [x.at for x in told if x.at is not None]
    begins = f" that begins at {float(moments[0])!r} s of a clock" if moments else ""
    return (
        f"{counted(some, 'obstacle')} of {of:,} {'is' if some == 1 else 'are'} told of for some "
        f"of the {time.n_steps} intervals of {exact(time.dt)} s of a plan{begins} "
        f"alone{until}: of {whom} nothing is said {when}. {rests}"
    ).rstrip()


def about_points(problem: Problem) -> str:
    """Where on the robot a footprint says that its points are; empty for another body."""
    places = dict.fromkeys(getattr(problem.body, "places", ()))
    told = [f"{name} ({exact(x)}, {exact(y)})" for name, x, y in places]
    return f"Its footprint tells where points are on the robot: {listed(told)} m." if told else ""


def about_measured(model: TrajectoryModel) -> str:
    """Which of k is measured at the start; empty where nothing is."""
    names = ", ".join(name_of(model.labels.k[i]) for i in model.given)
    return f"Measured at the start, and not to be chosen: {names}." if names else ""


def resting_on(asked: NominalProblem, world: bool = False) -> list[str]:
    """What a question rests on, for the remark of its file. world: all is told in its frame."""
    told = [about_points(asked.problem), about_obstacles(asked.problem, asked.model.time)]
    told += [] if asked.uncertainty is None else [asked.uncertainty.meaning]
    told += [about_measured(asked.model), about_pose(asked.pose, asked.told.model, world)]
    return [text for text in told if text]


def about_pose(pose: Pose | None, model: TrajectoryModel, world: bool = False) -> str:
    """The pose from which all plans start, None for any. world: all is told in its frame."""
    if pose is None:
        return "All plans start with the heading of the model's runs."
    place, heading = pose
    where = ", ".join(map(exact, place))
    if heading is None:
        return f"Here: all plans start at ({where}) m, with the heading of the model's runs."
    words = zip(model.labels.q, model.rotation or (), strict=False)
    turn = some_of([name_of(label) for label, word in words if word == TURNS] or ["none"])
    goal = f", and of its goal states {turn}," if model.n_q else ""
    frame = "Scene, plans and certificates are told in the robot's frame: its start is the origin, "
    frame = "" if world else f"{frame}its heading 0. "
    return (
        f"Here: all plans start at ({where}) m with heading {exact(heading)} rad. {frame}That a "
        f"run turns with its heading{goal} is declared by the system."
    )


def about_file(found: bool, robust: bool, pose: bool, rests: bool, part: bool) -> str:
    """What the checker of a file does not see, of an answer with plans (found), an uncertainty, a
    pose in the world or a moment of the clock, obstacles that rest on more, and a part of K; empty
    for nothing.
    """
    words = {
        "how much of the safe set is covered, its share of all plans, the risk that rests on it, "
        "and what was looked at before": found,
        "what obstacles rest on": rests,
        "the part of K that was asked for": part,
        "the uncertainty that the scene allows for": robust,
        "the place of the robot's frame in the world, and the moment when a plan begins": pose,
    }
    told = [text for text, holds in words.items() if holds]
    return f"Read from a file, whose word alone it is: {listed(told)}." if told else ""


def about_sensing(risk: Risk | NoStatement, sensing_eps: Fraction) -> str:
    """The risk of the tube and that of the sensing together: the sum of two probabilities. [T21]"""
    eps = rounded_up(sensing_eps)
    alone = f"What was measured lies outside of its uncertainty with probability at most {eps}"
    if isinstance(risk, NoStatement):
        return f"{alone}."
    both = rounded_up(min(Fraction(1), risk.bound + sensing_eps))
    return f"{alone}: together at most {both}, if the deviations do not depend on the plan."


def about_risk(
    risk: Risk | NoStatement, drawn: str, density: float | None, measured: float, p: Premises
) -> str:
    """The risk of a plan drawn by `Answer.sample`.

    drawn: the set, in words. density: bound on that of k, which rests on a coverage measured with
    confidence `measured`; None where nothing is stated. p: premises of the claim.
    """
    if isinstance(risk, NoStatement):
        return f"Risk: no statement, since {risk.reason}."
    if "rows" in p:  # of recordings
        drawn += AS_RECORDED
    return (
        f"Risk: a plan drawn by `sample`, uniformly from {drawn}, leaves the tube with "
        f"probability at most {rounded_up(risk.bound)} (the density of its k is at most "
        f"{rounded_up(density)} times uniform, measured with confidence 0.999 and "
        f"{float(measured)!r}; the claim has confidence {confidence_of(p)})."
    )


def about_coverage(coverage: Coverage, part: str = "the safe set") -> str:
    """How much of the safe set, or of a part of it, is covered."""
    if coverage.share == 0:
        return f"how much of {part} they cover was not measured"
    return (
        f"covering {100 * coverage.share:.2f} % of {part} (at least "
        f"{rounded_down(100 * coverage.at_least, 4)} % with "
        f"confidence {rounded_down(str(coverage.confidence), 10)})"
    )


def all_plans(from_here: bool, box: str) -> str:
    """The plans that a share is of. from_here: all have one start. box: of k."""
    return f"all k in {box}" if from_here else IN_THE_BOX.replace("plans", f"plans{in_box(box)}", 1)


def about_share(
    share: Share | None,
    safe: int,
    *,
    from_here: bool,
    around: bool,
    box: str = "K",
    doubt: bool = False,
) -> str:
    """The number to tune by: the share of all plans that tube and obstacles leave in the goal.

    safe: draws that were safe; of a few no estimate is stated. from_here: all plans have one start.
    around: draws were made in a place alone, and only plans in it are counted. box: of k. doubt: it
    is of plans for all that is uncertain.
    """
    if share is None:
        return "what share of the plans was not measured"
    of_all = all_plans(from_here, box)
    low, high = rounded_down(100 * share.at_least, 3), rounded_up(100 * share.at_most, 3)
    sure = f"with confidence {rounded_down(str(share.confidence), 10)}"
    text = f"{_percent(share.share)} of {of_all} ({low} % to {high} % {sure})"
    if safe < FEW:
        text = f"{low} % to {high} % of {of_all}, {sure}"
    if around or safe < FEW:
        text += ", for all that is uncertain" * doubt
        return text + ", counting only those around what a search found" * around
    left = share.share / share.reaching if share.reaching else 0.0
    ends = f"{_percent(share.reaching)} end in the goal whatever happens in the tube, from where"
    ends = "with all that is uncertain, " * doubt + ends
    return f"{text}: {ends} they may start; obstacles leave {_percent(left)} of these"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def headline(answer) -> str:
    """An `Answer` in one line."""
    name = answer.model.system or "unnamed system"
    if not answer.status.found:
        return f"Answer for {name}: {answer.status}{told_under(answer.scene)}"
    told = [counted(len(answer.samples), "plan"), counted(len(answer.corridors), "corridor")]
    if answer.coverage.share:
        share = f"at least {rounded_down(100 * answer.coverage.at_least, 3)} % of {set_of(answer)}"
        told.append(f"{share} (confidence {rounded_down(str(answer.coverage.confidence), 10)})")
    else:
        told[-1] += told_under(answer.scene)
    return f"Answer for {name}: {answer.status}, {', '.join(told)}"


def set_of(answer, name: str = "the model's safe set") -> str:
    """The set that the coverage of an `Answer` is of."""
    around = "" if answer.cover.within is None else " around what a search found"
    return f"{name}{told_under(answer.scene)}{around}"


def told_under(scene: Scene) -> str:
    """What all that is said of the plans of a scene is under, for one line."""
    asked, box = scene.nominal, in_box(scene.box_of_k)
    tube = UNSHOWN.get(asked.model.claim.kind, "")
    doubt = "" if asked.uncertainty is None else " for all that is uncertain"
    start = "" if scene.at is None else " from one start"
    moments = [x.at for x in asked.problem.all_spans if x is not None and x.at is not None]
    begin = f" for a begin at {float(moments[0])!r} s of a clock" if moments else ""
    return f"{tube}{box}{doubt}{start}{begin}"


def summary(answer, drawn: str) -> str:
    """`Answer.summary`. drawn: the sentence about a drawn plan, of an answer with plans."""
    cover, asked, claim = answer.cover, answer.scene.nominal, answer.model.claim
    doubt = asked.uncertainty
    none = ", or none shown to withstand what is uncertain" * bool(doubt and answer.absence)
    lines = [f"{headline(answer)}.", f"Status: {answer.status.text}{none}."]
    why = None if answer.status.found or answer.absence else why_none(answer.scene)
    if why is not None and why.sure:
        lines[1] = nothing_found(why)
    if answer.status.found:
        share = about_share(
            answer.share,
            cover.safe,
            from_here=answer.scene.at is not None,
            around=cover.within is not None,
            box=answer.scene.box_of_k,
            doubt=doubt is not None,
        )
        held = about_coverage(answer.coverage, set_of(answer, "the safe set"))
        lines.append(f"Safe{UNSHOWN.get(claim.kind, '')}: {share}.")
        lines.append(f"{counted(len(answer.corridors), 'corridor').capitalize()}: {held}.")
        if cover.refused:
            lines.append(f"Refused by the checker, and left out: {cover.refused:,}.")
        lines.append(drawn)
    elif answer.absence is not None:
        lines.append(answer.absence.details())
    lines += about_open_bins(claim.premises)
    more = [
        about_points(asked.problem),
        about_obstacles(asked.problem, answer.model.time),
        about_measured(asked.model),
        cover.ended and cover.ended.sentence,
        about_pose(asked.pose, asked.told.model),
        # a proof that no plan is safe says in its own sentence what it is robust to
        doubt and answer.status.found and f"Robust to: {doubt.words}.",
        doubt and not (answer.status.found or answer.absence) and doubt.meaning,
        answer.validation and answer.validation.summary(),
        answer.status is Status.NOT_FOUND and about_start(asked.told.problem, asked.model.labels.p),
    ]
    lines += [text for text in more if text]
    # a tube that is itself assumed or declared says so here too: "tube (ASSUMED, not shown)"
    tested = answer.validation and answer.validation.answer
    assumed = dict.fromkeys(
        {"law": "LAW", "tube": f"tube ({str(e.value).partition(':')[0]})"}.get(e.name, e.name)
        for one in (claim, *([tested.model.claim] if tested else []))
        for e in one.premises
        # of a tested set the tube is a name, and runs may leave it
        if e.standing == ASSUMED and (one.kind, e.name) != (VALIDATED, "tube")
    )
    lines.append(f"Holds if ({counted(len(assumed), 'assumption')}): {', '.join(assumed)}.")
    return "\n".join([*lines, answer.unchecked] if answer.unchecked else lines)


def about_start(problem: Problem, axes: Sequence[str]) -> str:
    """What to try where no search finds a plan, since the start set has no width; or empty."""
    ends = problem.start and zip(axes, *box_of_rows(problem.start), strict=True)
    flat = [name_of(axis) for axis, lo, hi in ends or () if lo == hi]
    told = "The start set has no width along {}: give it some, or ask from one place, with at=."
    return told.format(listed(flat)) if flat else ""


def about_scene(pose: Pose | None, problem: Problem, model: TrajectoryModel) -> str:
    """What a question is of, in the words of the checker, which reads the same part, and what the
    numbers of its plans are.
    """
    starts = "any p0" if pose is None else "one start"
    numbers = ", ".join(f"k[{i}] is {label}" for i, label in enumerate(model.labels.k))
    numbers = " ".join([f"{numbers}.", about_measured(model)]).rstrip()
    where = f"{', '.join(model.labels.p)} of reference point 0 at the start"
    scene, goal = scene_of(problem_part(problem, model), starts), about_goal(problem, model)
    parts = {i for part in numbered(problem.body, model.points) for i in part.points}
    out = [name for i, name in enumerate(model.points) if i not in parts]
    beside = f" No part of it is told by {some_of(out)}: of those nothing is said." if out else ""
    return f"It is of {scene}.{beside} {goal} Of a plan (p0, k), p0 is {where}; {numbers}"


def about_goal(problem: Problem, model: TrajectoryModel) -> str:
    """The goal in numbers, and with which of its states runs end whatever their k."""
    points = [f" of {point}" for point in model.points] if len(model.points) > 1 else [""]
    names = [*(label + of for of in points for label in model.labels.p), *model.labels.q]
    lo, hi = box_of_rows(problem.goal)
    asked = [axis for axis in range(len(lo)) if np.isfinite([lo[axis], hi[axis]]).any()]
    told = [f"{names[i]} from {exact(lo[i])} to {exact(hi[i])}" for i in asked]
    across = problem.goal.A[np.count_nonzero(problem.goal.A, axis=1) > 1]
    if len(across):
        told.insert(0, f"{counted(len(across), 'half-space')} across axes")
    inside = any_end_is_in(lo, hi, model)
    idle = [name_of(names[i]) for i in inside if not across[:, i].any()]
    # inside the tube alone: a run that leaves it may fail by this, and tests of plans count it
    of_k = f" Whatever k{in_box(model.claim.law.box, ' in ')}, every run inside the tube ends so in"
    free = f"{of_k} {listed(idle)}, of which nothing is asked there." if idle else ""
    return f"Its goal: {some_of(told)}.{free}"


def details(answer, drawn: str, polytopes: int) -> str:
    """`Answer.details`, with a number of polytopes. drawn: as of `summary`."""
    asked, cover, absence = answer.scene.nominal, answer.cover, answer.absence
    uncertainty, claim = asked.uncertainty, answer.model.claim
    tube = [about_pose(asked.pose, asked.told.model)]
    told = [about_scene(asked.pose, answer.problem, answer.model), about_points(asked.problem)]
    told.append(about_obstacles(asked.problem, answer.model.time))
    scene = " ".join(filter(None, told))
    if (box := answer.scene.box_of_k) != claim.law.box:
        tube.append(f"Plans were asked for{in_box(box)}, a part of {claim.law.box}, and no others.")
    if answer.status.found and uncertainty is not None:
        tube.append(
            "Robust: all this is said of a question that allows for the uncertainty, and so it "
            f"holds for {uncertainty.words}. A plan that is absent is not shown to withstand all "
            "of it."
        )
    tube.append(f"({'V' if claim.kind == VALIDATED else 'E'}) {claim.details()}")
    if answer.status.found:
        counts = len(answer.samples), polytopes, len(answer.corridors)
        lines = [f"(C) {about_plans(*counts, answer.model.time.t_f, cover.proved)} {scene}"]
        if cover.within is not None:
            place = Box(*(side[-answer.model.n_k :] for side in cover.within.box)).text
            lines.append(
                "Plans were drawn in a place alone, as where uniform draws hardly meet a safe one: "
                f"coverage and volume are of the safe set there, with k in {place} and {box}; "
                "beyond nothing is known."
            )
        lines += [*tube, drawn]
    elif absence is not None:
        lines = [f"{absence.details()} {scene}", *tube]
    else:
        none = nothing_found(why_none(answer.scene), box)
        none = none if uncertainty is None else f"{none} {uncertainty.meaning}"
        lines = [none, scene, *tube]
    lines += [] if cover.ended is None else [cover.ended.sentence]
    lines += [] if answer.validation is None else [answer.validation.sentence]
    return "\n".join([*lines, answer.unchecked] if answer.unchecked else lines)
