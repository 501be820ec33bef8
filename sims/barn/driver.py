"""A Jackal with its loop, made once in each process: it drives worlds, an episode a call."""

import gc
import time
from dataclasses import dataclass, replace
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path

import numpy as np
from scipy.stats import qmc

import parc_jax as pj
from parc_jax.common.spelling import rounded_up
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.systems.content import whole_digest
from sims.barn.drive import LIDAR, Drive, drive
from sims.barn.film import film
from sims.barn.sight import AROUND, WIDTH
from sims.barn.worlds import World, numbers, world
from sims.driving import Driving
from sims.jackal.learn import HELD, THINKS, robot, thinking
from sims.jackal.params import DRIFT_TICK, TICK
from sims.lidar import Lidar, lidar
from sims.rectangle import centre_and_corners, rectangle

MODEL = Path(__file__).with_name("model.npz")  # by `sims.barn.learn`
SLOW = 1.7  # power of the share of the speed: more candidates are slow than fast
TURNS_ON_THE_SPOT = 101
BACKWARDS = 7  # 2 to the power of this many candidates go back
OUTLINE = 0.01  # [m] by which a network may be off where a manoeuvre begins
DRIFTED = "odometry went wrong by more than is allowed for in a cycle"
FILMED = ".gif", ".html"  # a film and its page
LOOKS = 512  # of a step, at pairs: so that it takes less than it thinks where nothing is safe


def any_world(seed) -> World:
    """The law of episodes: each of the 200 worlds alike."""
    return world(int(np.random.default_rng(seed).choice(numbers())))


@dataclass(frozen=True)
class Driver:
    """Drives a world with the randomness of a seed, (2,) words; returns an `Outcome`.

    model: file of the Jackal's model. content: `content_of` it, so that episodes of two models are
    never taken for those of one. odometry, known: as of `drive`. sweep: [s] of its lidar. clock:
    that of the machine ends a step in time. prove: every commitment in exact arithmetic, after the
    episode. save: folder for a file of every episode, which `parc-jax check` verifies. film: folder
    for a film and a page of every episode.
    """

    model: Path
    content: str
    odometry: bool = False
    known: bool = False
    sweep: float = 0.0
    clock: bool = False
    prove: bool = False
    save: Path | None = None
    film: Path | None = None

    @cached_property
    def digest(self) -> str:
        """Of all that decides an episode: the code of the drive, model and options."""
        return whole_digest(replace(self, model=Path(), prove=False, save=None, film=None))

    @property
    def told(self) -> dict:
        """What a line of an episode says of who drove it."""
        about = {"odometry": self.odometry, "map": self.known, "sweep": self.sweep}
        about |= {"clock": self.clock, "driver": self.digest[:16]}
        return {"model": self.content[:16]} | about

    def has(self, one: dict) -> bool:
        """Is a line of an episode of this driver, with the proofs and files that are asked for?"""
        if not self.told.items() <= one.items() or (self.prove and "proved" not in one):
            return False
        name = file_name(self.digest, one["world"], (one["world"], one["seed"]))
        files = [self.save / f"{name}.json"] if self.save else []
        files += [self.film / f"{name}{kind}" for kind in FILMED] if self.film else []
        return not one["committed"] or all(file.exists() for file in files)

    def __call__(self, world: World, seed) -> pj.drive.Outcome:
        system = robot()
        key = np.asarray(seed, np.uint32)
        loop = loop_of(self.model, self.content, self.clock)
        asked = {"odometry": self.odometry, "known": self.known}
        asked |= {"clock": time.perf_counter if self.clock else None}  # as of the loop
        scanner = lidar(**LIDAR, sweep=self.sweep)
        one = drive(world, system, loop, key, scanner, **asked, explain=self.film is not None)
        new = [step.committed for step in one.steps if step.new]
        points = centre_and_corners(one.path[:, :2], one.path[:, 2], *system.size)
        left = bool(new) and pj.drive.left_tube(new, points, one.path[:, 2])
        told = told_of(one) | {"left": left} | self.told
        if self.prove:
            told["proved"] = all(each.proved() for each in new)
        name = file_name(self.digest, world.number, seed)
        if self.save is not None and new:
            said = {"reasons": one.reasons}
            assumed = assumed_of(one, None if self.known else scanner, system.ramp)
            pj.drive.save_episode(self.save / f"{name}.json", new, said, one.drift, assumed)
        if self.film is not None and new:
            film(self.film / f"{name}{FILMED[0]}", world, one)
        return pj.drive.Outcome(one.touched, left or (one.drifted > 0 and DRIFTED), told, new)

    def line(self, world: World, seed) -> dict:
        """What is told of a drive, which other processes can send back."""
        return {**self(world, seed).told}


def assumed_of(one: Drive, scanner: Lidar | None, ramp: tuple[float, float]) -> dict[str, str]:
    """What manoeuvres of a drive rest on beside model and tube: by name, in words with their
    numbers. scanner: None with the map. ramp: [m/s^2], [rad/s^2] of the robot.
    """
    told = "its place and heading are truly known"
    if one.allowed:
        ahead, aside, turned = (rounded_up(float(each), 4) for each in np.max(one.allowed, axis=0))
        told = (
            f"dead reckoning from the start: in a cycle of {HELD!r} s a place is off within an "
            f"ellipse of half axes {ahead} m ahead and {aside} m aside, and a heading by {turned} "
            f"rad, at most; in a tick of {TICK!r} s by {DRIFT_TICK[0]!r} m and {DRIFT_TICK[1]!r} "
            "rad; what is remembered to be free shrinks by what is allowed for each cycle"
        )
        if one.drifted:
            told += f"; in this drive {one.drifted} cycles were off by more"
    if scanner is None:
        known = Driving().premises
    else:
        accelerates = {"acceleration": ramp[0], "acceleration_turning": ramp[1]}
        sensor = {"sensor": scanner.mount, "noise": scanner.noise, "width": WIDTH, "margin": AROUND}
        known = Driving(**sensor, **accelerates).premises
        known["what stands"] += (
            f"; its range_max is {scanner.max_range!r} m, a sweep takes {scanner.sweep!r} s"
        )
    return known | {"measured poses": told}


def file_name(digest: str, world: int, seed) -> str:
    """What the files of an episode are called. digest: of the driver."""
    return f"world_{world}_{'_'.join(map(str, seed))}_{digest[:8]}"


def content_of(model: Path) -> str:
    """sha256 of a file. Raises InputError."""
    try:
        return sha256(model.read_bytes()).hexdigest()
    except OSError as error:
        raise pj.InputError(f"{model}: cannot be read ({error.strerror}).") from None


@cache
def loop_of(model: Path, content: str, clock: bool = False) -> pj.drive.Loop:
    """The loop of a model, made once in a process. Raises InputError where the file has changed."""
    if content_of(model) != content:
        raise pj.InputError(f"{model}: expected the model that the drive began with; it changed.")
    known = pj.load(model)
    require_outline(known)
    loop = pj.drive.Loop(
        known,
        rectangle(),
        leave=HELD,
        candidates=candidates(known.domain),
        thinking=thinking(),
        effort=pj.drive.Effort(judged=512, looks=LOOKS, room=0.05, deadline=THINKS),
        **({} if clock else {"clock": lambda: 0.0}),  # else the robot waits
    )
    gc.collect()
    gc.freeze()  # else Python looks through all of JAX now and then, for 0.1 s, within a step
    return loop


def require_outline(model: pj.types.TrajectoryModel) -> None:
    """Raises InputError for a model of a robot with another outline: its corners are elsewhere."""
    middle = (model.domain.lo + model.domain.hi)[None] / 2
    told = trajectories(model.net, model.layout, middle)[0][0, 0].reshape(-1, 2)
    length, width = robot().size
    true = centre_and_corners(np.zeros(2), 0.0, length, width)
    off = np.abs(told - true).max()
    if not off <= OUTLINE:
        raise pj.InputError(
            f"model: expected one of a Jackal of {length:g} m x {width:g} m; its corners are off "
            f"by {off:.3f} m. Learn it anew."
        )


def candidates(domain: pj.types.Box) -> np.ndarray:
    """Commands (b, 2) within K: speed [m/s] and turning [rad/s]."""
    (back, right), (ahead, left) = domain.lo[-2:], domain.hi[-2:]
    even = qmc.Sobol(2, seed=0)
    share, behind = even.random_base2(10), even.reset().random_base2(BACKWARDS)
    share[:, 0] = ahead * share[:, 0] ** SLOW
    behind[:, 0] *= back
    on_the_spot = np.stack([np.zeros(TURNS_ON_THE_SPOT), np.linspace(0, 1, TURNS_ON_THE_SPOT)], 1)
    found = np.concatenate([share, on_the_spot, behind])
    found[:, 1] = right + (left - right) * found[:, 1]
    return found


def told_of(one: Drive) -> dict:
    """What is kept of an episode: times in milliseconds of processor time, and in how many cycles
    it took longer than the robot thinks.
    """

    def quantiles(seconds):
        return [round(1e3 * float(q), 2) for q in np.quantile(seconds, [0.5, 0.95, 1.0])]

    cycle = np.sum([one.plan_s, one.see_s, one.guide_s], axis=0)
    return {
        "world": one.world,
        "reached": one.reached,
        "touched": one.touched,
        "seconds": round(one.seconds, 2),
        "metric": round(one.metric, 4),
        "clearance": float(one.clearance),
        "drifted": one.drifted,
        "refuted": sum(bool(free.said) for free in one.free),
        "cycles": len(one.steps),
        "committed": sum(step.new for step in one.steps),
        "late": int(sum(cycle > THINKS)),
        "edges": [round(float(np.mean(one.edges)), 1), max(one.edges)],
        "cycle_ms": quantiles(cycle),
        "plan_ms": quantiles(one.plan_s),
        "see_ms": quantiles(one.see_s),
        "guide_ms": quantiles(one.guide_s),
    }
