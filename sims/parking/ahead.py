"""A parking proved before the first wheel turns, as far as that goes: each manoeuvre for all poses
in which the one before may leave the car, at rest. `python -m sims.parking.ahead --case 8`
"""

from dataclasses import dataclass

import numpy as np

import parc_jax as pj
from parc_jax.common.spelling import rounded_up
from parc_jax.drive.loop.candidates import moved_last
from parc_jax.drive.loop.commitment import Commitment
from sims.parking.cases import case, numbers
from sims.parking.guide import Guide
from sims.parking.kinematics import compose, steering
from sims.parking.known import Learned
from sims.parking.predict import MODEL, predicted, told, tube_at
from sims.parking.prove import Moving, goal_of, link, loop_of


@dataclass(frozen=True)
class Chain:
    """proved: manoeuvres that are, one after another, of `links` that lead into the goal. place,
    heading (proved,): [m], [rad] by which the car may be off, along each axis, after each of them.
    driven (proved,): their commitments. poses (proved + 1, 3): from which they begin, when nothing
    is off, and where the last ends.

    A file (`pj.drive.save_episode`) of one of them states as its doubt what the one before leaves.
    """

    proved: int
    links: int
    place: list[float]
    heading: list[float]
    driven: list[Commitment]
    poses: list[np.ndarray]

    @property
    def said(self) -> str:
        """What is proved, and all that it rests on."""
        off = zip(self.place, self.heading, strict=True)
        told = "; ".join(
            f"by {rounded_up(100 * p)} cm, {rounded_up(np.degrees(h))}°" for p, h in off
        )
        if not self.driven:
            return f"0 of {self.links} manoeuvres are proved ahead."
        last = max(moved_last(one.asked.query.model, one.k[None])[0][0] for one in self.driven)
        claim = self.driven[0].asked.query.model.claim
        return (
            f"{self.proved} of {self.links} manoeuvres are proved ahead, in float64 with a margin "
            "that covers rounding, each for every run inside its tube and every pose that the one "
            f"before may leave: along each axis it is off {told} after them, one after another. "
            "Assumed: the first pose is exact; at the start of each the steering is known, which "
            "is what the one before asked for at its end, the wheels straight at first; it rests "
            f"at its end, where a prediction moves by {rounded_up(last, 2)} m at most in the last "
            f"interval; the outlines of the case are all there is, and stand still. Of each "
            f"manoeuvre: (E) {claim.details()}"
        )


def ahead(number: int) -> Chain:
    """Prove a case's manoeuvres ahead, until one is not proved. The steering at rest is known: the
    car turns its own wheels. Raises InputError.
    """
    known = case(number)
    model = pj.load(MODEL, system="parking")
    way = Guide(known, Learned(known, model), rolling=False).search()
    if way is None:
        return Chain(0, 0, [], [], [], [known.start])
    pose, wheels, off, turned = known.start, 0.0, 0.0, 0.0
    places, headings, driven, poses = [], [], [], [pose]
    for i in range(len(way.k)):
        loop = loop_of(MODEL, off, turned)
        loop.restart()
        goal = goal_of(known, pose) if i == len(way.k) - 1 else None
        step = link(loop, known.pieces, Moving(pose, wheels), way, i, goal, 0.0)
        if not step.new:
            break
        driven.append(step.committed)
        k = step.committed.k
        asked = told(k[None])
        move = predicted(model, wheels, k[1])(asked)[0, -1]
        final = tube_at(model, k[None])[1][0]
        # the heading before turns the whole move, its error included
        least = float(np.hypot(final[0], final[1]))
        off += least + 2 * np.sin(turned / 2) * (float(np.hypot(*move[:2])) + least)
        turned += float(final[-1])
        pose, wheels = compose(pose, move), float(steering(asked)[1][0])
        places.append(off)
        headings.append(turned)
        poses.append(pose)
    return Chain(len(places), len(way.k), places, headings, driven, poses)


if __name__ == "__main__":
    import tyro

    @dataclass(frozen=True)
    class Options:
        case: tuple[int, ...] = numbers()

    for one in tyro.cli(Options, description=__doc__).case:
        chain = ahead(one)
        print(f"case {one}: {chain.said}", flush=True)
