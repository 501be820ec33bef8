"""Sixteen Jackals swap the sides of a yard: `python -m sims.jackal.fleet`.

They share a clock and a frame. In each cycle they decide one after the other, and who decides
avoids all places that the manoeuvres under way of all others may take, where these will rest among
them. So none needs to know why another does what it does. [T45]
"""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from time import process_time

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.spelling import rounded_down, rounded_up
from sims.jackal import learn as jackal
from sims.jackal.driven import Driven
from sims.rectangle import centre_and_corners, rectangle

ROBOTS, HALF = 16, 6.0  # how many, [m] half width of the yard
FAR, APART, NEAR = 4.9, 1.4, 0.4  # [m] of the two rows from the middle, in a row, from the goal
OFF = 0.01  # [m] by which a place that is told is off, at most, along each axis
EVERY = 2  # intervals of a manoeuvre per obstacle
COMMANDS = (13, 13)  # of speed and turning
TIMEOUT = 90.0  # [s]
# Of what is liked: [m] within which others are disliked, and what each [m] less costs; [m] within
# which who comes towards one is passed on the right, and by how much
ROOM, DISLIKED, AHEAD, ASIDE = 0.9, 1.5, 2.5, 1.2
LANE, CLEARED, COSTS = 3.0, 1.0, 4.0  # [m] of the way of who has the right of way, kept so wide


@dataclass(frozen=True)
class Yard:
    """What came of it. path (n, robots, 3): true poses, a tick each; nearest: [m] of any two, or of
    one and the border, 0 or less is contact; arrived (robots,): s, infinite for who did not. left:
    how many left a tube. steps: of each robot. plan_s: of processor time of each step.
    """

    path: np.ndarray = field(repr=False)
    nearest: float
    arrived: np.ndarray
    left: int
    steps: list[list] = field(repr=False)
    plan_s: list[float] = field(repr=False)

    @property
    def said(self) -> str:
        """The result, a sentence."""
        came = self.arrived[np.isfinite(self.arrived)]
        many = sum(step.new for steps in self.steps for step in steps)
        took = np.quantile(1e3 * np.array(self.plan_s), [0.5, 0.95, 1.0])
        last = f", the last after {came.max():.1f} s" if len(came) else ""
        return (
            f"{len(came)} of {len(self.arrived)} arrived{last}; "
            f"nearest {rounded_down(100 * self.nearest)} cm; "
            f"{self.left} left a tube in {many:,} manoeuvres; a step took {took[0]:.0f} ms of "
            f"processor time, {took[1]:.0f} at 95 %, {rounded_up(took[2])} at most"
        )


@cache
def first_loop() -> pj.drive.Loop:
    """A loop, made once in a process; each robot has a copy."""
    speed = np.linspace(-0.4, 1.2, COMMANDS[0])
    turning = np.linspace(-jackal.TURNING, jackal.TURNING, COMMANDS[1])
    return pj.drive.Loop(
        jackal.model(),
        rectangle(),
        leave=jackal.HELD,
        uncertainty=pj.Uncertainty(start=(OFF,)),
        candidates=np.stack(np.meshgrid(speed, turning, indexing="ij"), axis=-1).reshape(-1, 2),
        thinking=jackal.thinking(),
        effort=pj.drive.Effort(judged=192, looks=16384, room=0.02, deadline=jackal.THINKS),
        clock=lambda: 0.0,  # the robots wait: a busy machine decides nothing
    )


def places(rng: np.random.Generator, robots: int) -> tuple[np.ndarray, np.ndarray]:
    """Starts (robots, 3) in two rows that face each other, and goals (robots, 2): any places of the
    other row. robots: an even number.
    """
    n = robots // 2
    y = APART * (np.arange(n) - (n - 1) / 2)
    starts = [[side * FAR, at, np.pi * (side > 0)] for side in (-1, 1) for at in y]
    goals = [[-side * FAR, at] for side in (-1, 1) for at in rng.permutation(y)]
    return np.array(starts), np.array(goals)


def walls() -> list:
    """The border of the yard."""
    out = HALF + 1.0
    sides = [([-out, -out], [-HALF, out]), ([HALF, -out], [out, out])]
    sides += [([-out, -out], [out, -HALF]), ([-out, HALF], [out, out])]
    return [pj.box(*side) for side in sides]


def drive(seed: int, robots: int = ROBOTS) -> Yard:
    """Drive until all have arrived and rest, or the time is out. robots: how many, even."""
    rng, key = np.random.default_rng(seed), jax.random.PRNGKey(seed)
    starts, goals = places(rng, robots)
    system, first = jackal.robot(), first_loop()
    loops = [first.another() for _ in starts]
    jackals = [
        Driven(system, *one) for one in zip(starts, jax.random.split(key, robots), strict=True)
    ]
    grid, border = first.model.time, walls()
    stands = [outline(start, system.size) for start in starts]
    steps: list[list] = [[] for _ in starts]
    arrived, plan_s, cycle = np.full(robots, np.inf), [], 0
    while jackals[0].time + jackal.HELD <= TIMEOUT and not _rest(arrived, jackals):
        now = jackals[0].time
        # the first that has not arrived has the right of way: so somebody always gets on
        first_one = int(np.argmax(~np.isfinite(arrived)))
        lane = jackals[first_one].pose[:2], goals[first_one]
        for i in np.roll(np.arange(robots), -cycle):  # whoever was first is last now
            here = jackals[i].pose
            if np.linalg.norm(here[:2] - goals[i]) <= NEAR:
                arrived[i] = min(arrived[i], now)
            outside = any(one.under_way and one.under_way.seen_outside for one in loops)
            if outside or np.isfinite(arrived[i]):
                # the manoeuvre under way goes on to its stop, and is looked at until then
                why = "somebody was seen outside of its tube" if outside else "it has arrived"
                steps[i].append(loops[i].go_on(why, None, here, now))
                continue
            begin = process_time()
            obstacles, spans = list(border), [None] * len(border)
            for j, other in enumerate(loops):
                if j == i:
                    continue
                parts, when = [stands[j]], [None]
                if other.under_way is not None:
                    parts, when = pj.drive.reserved(other.under_way, now, grid, every=EVERY)
                obstacles += parts
                spans += when
            told = here + np.append(rng.uniform(-OFF, OFF, 2), 0.0)
            others = np.array([one.pose for j, one in enumerate(jackals) if j != i])
            asked = {"at": now, "spans": spans, "explain": False}
            prefer = liking(goals[i], here, others, None if i == first_one else lane)
            step = loops[i].step(told, jackals[i].measured, obstacles, prefer, **asked)
            plan_s.append(process_time() - begin)
            steps[i].append(step)
            if step.new:
                jackals[i].begin(*step.committed.k[-2:])
        for one in jackals:
            one.drive(jackal.HELD)
        cycle += 1
    path = np.stack([one.path for one in jackals], axis=1)
    left = sum(_left(own, path[:, i], system.size) for i, own in enumerate(steps))
    return Yard(path, nearest(path, system.size), arrived, left, steps, plan_s)


def _rest(arrived: np.ndarray, jackals: list[Driven]) -> bool:
    return bool(np.isfinite(arrived).all() and all(one.rests for one in jackals))


def _left(steps: list, path: np.ndarray, size) -> bool:
    begun = [step.committed for step in steps if step.new]
    points = centre_and_corners(path[:, :2], path[:, 2], *size)
    return bool(begun) and pj.drive.left_tube(begun, points, path[:, 2])


def outline(pose: np.ndarray, size):
    """A robot that stands at a pose (3,), as an obstacle."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    A = np.array([[cos, sin], [-cos, -sin], [-sin, cos], [sin, -cos]])
    return pj.hpolytope(A, A @ pose[:2] + np.repeat(size, 2) / 2)


def liking(goal: np.ndarray, here: np.ndarray, others: np.ndarray, lane):
    """Likes to rest near the goal, headed there, and not near others (m, 3); who comes towards it
    is passed on the right. lane: place and goal of who has the right of way; None for that one.
    """
    away = goal - here[:2]
    far = np.linalg.norm(away)
    along = away / max(far, 1e-9)
    seen = others[:, :2] - here[:2]
    near = np.linalg.norm(seen, axis=1)
    heads = np.stack([np.cos(others[:, 2]), np.sin(others[:, 2])], axis=1) @ along
    comes = (near < min(AHEAD, far)) & (seen @ along > 0.7 * near) & (heads < -0.3)
    right = np.array([along[1], -along[0]])
    target = here[:2] + AHEAD * along + ASIDE * right if comes.any() else goal

    def prefer(outlook) -> np.ndarray:
        rest = outlook.path[:, -1]
        nose = 0.3 * np.stack([np.cos(outlook.heading), np.sin(outlook.heading)], axis=1)
        close = np.linalg.norm(rest[:, None] - others[None, :, :2], axis=-1)
        cost = np.linalg.norm(rest + nose - target, axis=1)
        cost = cost + DISLIKED * np.maximum(0.0, ROOM - close).sum(axis=1)
        if lane is None:
            return cost
        place, end = lane
        way = (end - place) / max(np.linalg.norm(end - place), 1e-9)
        share = np.clip((rest - place) @ way, 0.0, min(LANE, np.linalg.norm(end - place)))
        beside = np.linalg.norm(rest - place - share[:, None] * way, axis=1)
        return cost + COSTS * np.maximum(0.0, CLEARED - beside)

    return prefer


def nearest(path: np.ndarray, size) -> float:
    """The judge: [m] by which outlines at true poses (n, robots, 3) are apart along some side of
    either, of any two at any tick, or from the border; 0 or less is contact.
    """
    corners = centre_and_corners(path[..., :2], path[..., 2], *size)[..., 1:, :]
    found = HALF - np.abs(corners).max()
    for i in range(path.shape[1]):
        for j in range(i):
            gaps = []
            for angle in (
                path[:, (i, i, j, j), 2].T + np.array([0, np.pi / 2, 0, np.pi / 2])[:, None]
            ):
                w = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
                one, other = (np.einsum("ncd,nd->nc", corners[:, a], w) for a in (i, j))
                gaps.append(np.maximum(one.min(1) - other.max(1), other.min(1) - one.max(1)))
            found = min(found, np.max(gaps, axis=0).min())
    return float(found)


@dataclass(frozen=True)
class Options:
    """Which yards."""

    seeds: tuple[int, ...] = (0,)
    """Of goals, robots and what is told."""
    out: Path = Path("runs/fleet")
    """A folder for a file of every robot, which `parc-jax check` verifies."""


def main(options: Options) -> None:
    """Drive, and say what came of it."""
    for seed in options.seeds:
        yard = drive(seed)
        folder = options.out / str(seed)
        folder.mkdir(parents=True, exist_ok=True)
        for i, steps in enumerate(yard.steps):
            pj.drive.save_episode(folder / f"robot_{i}.json", [s.committed for s in steps if s.new])
        print(f"{seed}: {yard.said}", flush=True)


if __name__ == "__main__":
    import tyro

    main(tyro.cli(Options, description=__doc__))
