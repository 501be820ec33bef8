"""The episode track: drive worlds of the BARN challenge on a lidar alone, by a program that speaks
lines of JSON: `python -m benchmarks.suite.episodes --driver DRIVE --worlds 1 57 299`.

The plant is a unicycle of a Jackal's size, in NumPy, that follows its commands with a lag and slips
by chance. A contact costs what a false answer costs; a drive without one is worth the challenge's
metric.
"""

import argparse
import json
import secrets
import subprocess
import sys
from pathlib import Path

try:
    import numpy as np

    from benchmarks.suite.bad import Refused
    from benchmarks.suite.score import LOST, WHOLE
    from sims.barn.contact import distance_to_cylinders
    from sims.barn.worlds import TIMEOUT, World, metric, numbers, world
    from sims.lidar import lidar, shapes
except ModuleNotFoundError as missing:
    if __name__ != "__main__":
        raise
    hint = "pip install -e '.[dev]' in the clone"
    sys.exit(f"episodes: expected parc_jax and its simulators; {missing}; {hint}.")

SIZE = (0.458, 0.416)  # [m] length and width, over chassis and wheels
PERIOD, TICK = 0.1, 0.02  # [s] between commands, of the plant
FASTEST, TURNING = 2.0, 2.0  # [m/s], [rad/s]
LAG = 0.1  # [s] from a command to what it does
SLIP = 0.02  # most that a speed is off, of itself, another in every period
BEST = 0.5  # of the challenge's metric
BEAMS = 181


def episode(number: int, driver: list[str], seed: int) -> dict:
    """What came of one world. The driver reads {"t", "pose": [x, y, heading], "goal": [x, y],
    "angles", "ranges"} [s, m, rad] a line and answers {"v", "w"} [m/s, rad/s]; it is ended at the
    goal, at a contact, or after the challenge's time. Raises Refused for a line that makes no
    sense.
    """
    course, rng = world(number), np.random.default_rng(seed)
    around = shapes(course.cylinders, course.radius)
    scanner = lidar(beams=BEAMS)
    pose, speed, t, path = course.start.copy(), np.zeros(2), 0.0, []
    process = subprocess.Popen(driver, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        while t < TIMEOUT and not course.reached(pose) and not _touched(course, path[-6:]):
            scan = scanner.scan(pose, around, rng)
            seen = {"t": t, "pose": pose.tolist(), "goal": course.goal.tolist()}
            seen |= {"angles": scan.angles.tolist(), "ranges": scan.ranges.tolist()}
            asked = _command(process, seen)
            slip = 1 + SLIP * rng.uniform(-1, 1, 2)
            for _ in range(round(PERIOD / TICK)):
                speed += TICK / LAG * (asked - speed)
                v, w = speed * slip
                pose = pose + TICK * np.array([v * np.cos(pose[2]), v * np.sin(pose[2]), w])
                path.append(pose)
            t = round(t + PERIOD, 6)
    finally:
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()
    clearance = float(_clearance(course, path).min(initial=np.inf))
    worth = metric(bool(course.reached(pose)), t, course.path_length)
    points = LOST if clearance <= 0 else WHOLE * worth / BEST
    told = {"reached": bool(course.reached(pose)), "seconds": t, "clearance": clearance}
    return {"world": number, "seed": seed, "points": round(points, 3), **told}


def _command(process, seen: dict) -> np.ndarray:
    """v, w that the driver asks for, as far as they are allowed. Raises Refused."""
    try:
        process.stdin.write(json.dumps(seen) + "\n")
        process.stdin.flush()
        line = process.stdout.readline()
        asked = json.loads(line)
        command = np.array([asked["v"], asked["w"]], float)
    except (OSError, ValueError, KeyError, TypeError):
        raise Refused("driver: expected a line with v and w for every scan.") from None
    if command.shape != (2,) or not np.isfinite(command).all():
        raise Refused(f"driver: expected finite v and w; got {line.strip()[:80]}.")
    return np.clip(command, (-FASTEST, -TURNING), (FASTEST, TURNING))


def _clearance(course: World, path: list) -> np.ndarray:
    if not path:
        return np.empty(0)
    return distance_to_cylinders(np.array(path), SIZE, course.cylinders, course.radius)


def _touched(course: World, path: list) -> bool:
    return bool((_clearance(course, path) <= 0).any())


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 done, 2 bad input."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--driver", required=True, help="a program that can be executed")
    parser.add_argument("--worlds", type=int, nargs="+", default=numbers()[::40])
    parser.add_argument("--out", type=Path, help="a file for the results")
    options = parser.parse_args(arguments)
    try:
        found = [episode(n, [options.driver], secrets.randbits(62)) for n in options.worlds]
    except (ValueError, OSError) as why:
        print(f"episodes: {why}", file=sys.stderr)
        return 2
    for one in found:
        print(json.dumps(one))
    touched = sum(one["points"] == LOST for one in found)
    points = sum(one["points"] for one in found)
    print(f"{points:.1f} points in {len(found)} worlds, {touched} of them touched")
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
