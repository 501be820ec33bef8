"""What a pilot states of its steps: the guarantee, and all that it rests on."""

from parc_jax.common.said import about_said
from parc_jax.common.spelling import rounded_up
from parc_jax.drive.loop.candidates import moved_last
from parc_jax.drive.loop.commitment import START, Step


def assumed(pilot, premises: dict[str, str], straight: bool = True) -> str:
    """Premises of a `Pilot`, and what else its manoeuvres and plans rest on, in one clause.
    straight: a twist is taken at a heading of 0 alone, where it takes one.
    """
    straight = straight and pilot.readings.takes_twist
    memory, told = pilot.memory, [f"{name}: {value}" for name, value in premises.items()]
    if not pilot.loop.given:
        told.append(f"its start is {START}")
    if pilot.model.rotation is None:
        asked = "only compared with that of its runs" if pilot.model.n_points > 1 else "not asked"
        asked = "asked to be 0, as for its twist" if straight else asked
        told.append(f"the model goes along the frame's axes, and the heading of a pose is {asked}")
    if memory.added is not None:
        told.append(f"the last scan is {(memory.stamp - memory.added) / 1e9!r} s older")
    if pilot.movers is not None:
        age = (memory.stamp - pilot.movers.stamp) / 1e9
        when = f"{age!r} s before" if age >= 0 else f"{-age!r} s after the pose"
        told.append(f"who moves was told {when}, and nobody has come since")
    return "; ".join(told)


def stated(pilot, step: Step) -> str:
    """The guarantee of a step of a `Pilot`, and its premises."""
    now = step.committed
    if now is None:
        return f"Nothing is committed to: {step.reason}."
    begun = f"{now!r}".strip("<>")
    if not step.new:
        return f"Going on with {begun}, to its stop: {step.reason}."
    moves = pilot.driving.mover_radius > 0  # also where none can come so near in this one
    after = "; who moves may run into it there" if moves else ""
    model, body = pilot.model, "; ".join(now.shared["body"])
    last, n = moved_last(model, now.k[None])[0][0], len(now.asked.problem.obstacles)
    told = [f"{model.labels.k[i]} = {float(now.k[i])!r}" for i in pilot.loop.given]
    known = [f"its measured start is exact: {', '.join(told)}"] if told else []
    if moves:
        known.append(f"what moves is told of until {float(now.told_until)!r} s")
    if rests := about_said(now.asked.problem.rests_on):  # what moves, and edges of free space
        known.append(rests.rstrip("."))
    return (
        f"{begun}, a body ({body}) among {n} obstacles. Proved in float64 with a margin that "
        "covers rounding: for every run inside the tube and every pose inside the uncertainty "
        "nothing is touched. Assumed: that it rests at its end, where its prediction moves by "
        f"{rounded_up(last, 2)} m in the last {model.time.dt:g} s{after}; "
        f"{'; '.join([*known, pilot.assumed])}. (E) {now.asked.model.claim.details()}"
    )
