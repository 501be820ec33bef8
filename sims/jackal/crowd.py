"""A Jackal among discs that wander, of which it knows where they are and how fast they are at most:
`python -m sims.jackal.crowd`.

While a manoeuvre is under way, its stop included, nothing may be touched. Who rests may be run
into: discs see nobody.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.spelling import rounded_down
from sims.barn.contact import distance_to_cylinders
from sims.barn.driver import content_of, loop_of
from sims.jackal import params as c
from sims.jackal.driven import Driven
from sims.jackal.learn import MODEL, robot
from sims.rectangle import centre_and_corners

DISCS, RADIUS, FASTEST = 6, 0.25, 0.3  # how many, [m], [m/s] that each is known to be at most
LASTING = 1.5  # [s] for which one keeps its velocity, in the mean
FIELD = np.array([[0.0, -3.0], [10.0, 3.0]])  # [m] where they wander
START, GOAL, NEAR = np.array([-1.5, 0.0, 0.0]), np.array([11.0, 0.0]), 0.5  # [m]
SEEN = 3.0  # [m] within which they are obstacles: farther ones are not reached by any manoeuvre
EVERY = 3  # intervals of a manoeuvre for which a disc has one outline
LIKED, DISLIKED = 0.7, 1.0  # [m] from a disc that are liked at rest, what each less costs
TIMEOUT = 60.0  # [s]
SIDES = np.pi / 4 * np.arange(8)
NORMALS = np.stack([np.cos(SIDES), np.sin(SIDES)], axis=1)


def crowd(seed) -> np.ndarray:
    """The law of worlds: (ticks, DISCS, 2) [m] where discs are, until the time is out. Places are
    uniform, velocities uniform in the disc of FASTEST, kept for a time that is exponential; at the
    border they turn back.
    """
    draw = np.random.default_rng(seed)
    ticks = round(TIMEOUT / c.TICK) + 1
    place, velocity = draw.uniform(*FIELD, (DISCS, 2)), _velocities(draw)
    path = [place]
    for _ in range(ticks - 1):
        again = draw.uniform(size=DISCS) < c.TICK / LASTING
        velocity = np.where(again[:, None], _velocities(draw), velocity)
        place = place + c.TICK * velocity
        beyond = (place < FIELD[0]) & (velocity < 0) | (place > FIELD[1]) & (velocity > 0)
        velocity = np.where(beyond, -velocity, velocity)
        path.append(place)
    return np.array(path)


def _velocities(draw) -> np.ndarray:
    angle = draw.uniform(0, 2 * np.pi, DISCS)
    speed = FASTEST * np.sqrt(draw.uniform(size=DISCS))
    return speed[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def outlines(discs: np.ndarray, n_steps: int, dt: float, at: float) -> tuple[list, list]:
    """Where discs (m, 2) [m], there at [s], may be until a manoeuvre rests: obstacles and their
    spans.
    """
    obstacles, spans = [], []
    for disc in discs:
        now = pj.hpolytope(NORMALS, NORMALS @ disc + RADIUS)
        known = {"at": at, "every": EVERY, "off_by": FASTEST}
        parts, when = pj.problem.moving(now, [0.0, 0.0], (0, n_steps - 1), dt, **known)
        obstacles += parts
        spans += when
    return obstacles, spans


class Contacts(NamedTuple):
    """Of an episode. under_way, at_rest: was a disc touched while a manoeuvre was under way, and
    while the robot rested at the end of one, or had none yet? nearest: [m] while under way.
    """

    under_way: bool
    at_rest: bool
    nearest: float


def contacts(path: np.ndarray, discs: np.ndarray, size, begun: list[float], t_f: float) -> Contacts:
    """Of poses (n, 3) and discs (n, m, 2) tick by tick. begun: [s] when manoeuvres began."""
    distance = np.array(
        [
            distance_to_cylinders(pose[None], size, here, RADIUS)[0]
            for pose, here in zip(path, discs, strict=False)
        ]
    )
    time = c.TICK * np.arange(len(distance))
    since = time[:, None] - np.array([-np.inf, *begun])
    last = np.where(since >= -1e-9, since, np.inf).min(axis=1)
    moves = last <= t_f + 1e-9
    touched = distance <= 0
    nearest = float(distance[moves].min(initial=np.inf))
    return Contacts(bool(touched[moves].any()), bool(touched[~moves].any()), nearest)


@dataclass(frozen=True)
class Driver:
    """Drives through a crowd with the randomness of a seed; `pj.drive.drive_episodes` takes it.
    model: file; content: `content_of` it. save: folder for a file of every episode.
    """

    model: Path
    content: str
    save: Path

    def __call__(self, discs: np.ndarray, seed) -> pj.drive.Outcome:
        system = robot()
        loop = loop_of(self.model, self.content)
        loop.restart()
        jackal = Driven(system, START, np.asarray(seed, np.uint32))
        grid, steps, nearest = loop.model.time, [], np.inf
        while jackal.time + system.moving <= TIMEOUT and nearest > NEAR:
            here = jackal.pose
            now = discs[round(jackal.time / c.TICK)]
            if distance_to_cylinders(here, system.size, now, RADIUS)[0] <= 0:
                break
            around = now[np.linalg.norm(now - here[:2], axis=1) < SEEN]
            obstacles, spans = outlines(around, grid.n_steps, grid.dt, jackal.time)
            asked = {"at": jackal.time, "spans": spans}
            step = loop.step(here, jackal.measured, obstacles, liking(around), **asked)
            if step.new:
                jackal.begin(*step.committed.k[-2:])
            steps.append(step)
            jackal.drive(system.moving)
            nearest = np.linalg.norm(jackal.pose[:2] - GOAL)
        new = [step.committed for step in steps if step.new]
        path = jackal.path
        begun = [float(one.begin) for one in new]
        met = contacts(path, discs, system.size, begun, grid.t_f)
        points = centre_and_corners(path[:, :2], path[:, 2], *system.size)
        if new:
            name = "_".join(map(str, seed))
            pj.drive.save_episode(self.save / f"crowd_{name}.json", new)
        told = {
            "reached": bool(nearest <= NEAR),
            "seconds": round(jackal.time, 1),
            "clearance": float(met.nearest),
            "under_way": met.under_way,
            "at_rest": met.at_rest,
            "committed": len(new),
            "cycles": len(steps),
        }
        left = bool(new) and pj.drive.left_tube(new, points, path[:, 2])
        return pj.drive.Outcome(met.under_way, left, told, new)


def liking(discs: np.ndarray):
    """Likes to come to rest near the goal, headed there, and not near discs (m, 2)."""

    def prefer(seen) -> np.ndarray:
        rest = seen.path[:, -1]
        ahead = 0.5 * np.stack([np.cos(seen.heading), np.sin(seen.heading)], axis=1)
        far = np.linalg.norm(rest[:, None] - discs[None], axis=-1) - RADIUS
        near = np.maximum(0.0, LIKED - far).sum(axis=1)
        return np.linalg.norm(rest + ahead - GOAL, axis=1) + DISLIKED * near

    return prefer


@dataclass(frozen=True)
class Options:
    """How many, with which model."""

    model: Path = MODEL
    """A saved model of the Jackal that thinks; the one that comes along."""
    episodes: int = 100
    """Each in a crowd of its own."""
    out: Path = Path("runs/crowd")
    """A folder for episodes; what was driven there is not driven again."""
    jobs: int = 1
    """Processes."""


def drive(options: Options) -> pj.drive.Episodes:
    """Drive, and say what it showed."""
    save = options.out / "episodes"
    save.mkdir(parents=True, exist_ok=True)
    driver = Driver(options.model, content_of(options.model), save)
    asked = {"folder": options.out / "drives", "workers": options.jobs}
    key = jax.random.PRNGKey(0)
    done = pj.drive.drive_episodes(driver, crowd, key, options.episodes, **asked)
    told = [one.told for one in done.driven if not one.failed]
    print(f"{summary(told, done.n, done.touched)} Files: {save}.")
    print(done.details())
    return done


def summary(told: list[dict], n: int, touched: int) -> str:
    """What came of n episodes, of which so many touched a disc. told: of those with an outcome."""
    clear = [one for one in told if not (one["under_way"] or one["at_rest"])]
    reached = [one["seconds"] for one in clear if one["reached"]]
    took = (
        f", in {np.median(reached):.1f} s (median), at most {max(reached):.1f} s" if reached else ""
    )
    nearest = [min(one["clearance"] for one in told)] if told else []
    return (
        f"{len(reached)} of {n} reached the goal and were not touched{took}. While a "
        f"manoeuvre was under way a disc was touched in {touched}"
        + "".join(f", nearest {rounded_down(metres, 3)} m" for metres in nearest)
        + f"; discs ran into the robot at rest in {sum(one['at_rest'] for one in told)}"
        + f"; {n - len(told)} had no outcome" * (len(told) < n)
        + "."
    )


if __name__ == "__main__":
    import tyro

    try:
        drive(tyro.cli(Options, description=__doc__))
    except pj.InputError as error:
        sys.exit(f"error: {error}")
