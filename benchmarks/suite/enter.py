"""Runs an entry: its three programs, with files, timed and counted from outside."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path

from benchmarks.suite.bad import Refused
from benchmarks.suite.certified import certified
from benchmarks.suite.door import Door
from benchmarks.suite.instances import Instance

PROGRAMS = ("install", "prepare", "answer")
ENTRIES = Path(__file__).parent / "entries"
OURS = sorted(path.parent.name for path in ENTRIES.glob("*/answer"))
ROOT = Path(__file__).parents[2]
NOTHING = b'{"verdict": "unknown"}'  # what counts as the answer of an entry that gave none
LOOK = 0.01  # [s] between looks for a first plan
LONGEST = 1 << 26  # bytes of an answer
# bytes of any file that a program writes, sparse or not; of what it said at last, that is read
LARGEST, SAID = 1 << 30, 1 << 16


@dataclass
class Ran:
    """One program. code: its exit code, None where it was stopped. first_s: [s] until the file of a
    first plan was there. said: its last line, after what was last said to it of runs.
    """

    code: int | None
    seconds: float
    first_s: float | None
    said: str


def programs_of(entry: str) -> Path:
    """The folder of an entry: of ours by name, of anybody by path. Raises Refused."""
    folder = Path(entry) if os.sep in entry else ENTRIES / entry
    if not folder.is_dir():
        raise Refused(
            f"{entry}: expected one of {', '.join(OURS)}, or a folder, such as ./{entry}."
        )
    for path in (folder / name for name in PROGRAMS):
        if not path.is_file():
            raise Refused(f"{entry}: expected a program {path}; there is none.")
        if not os.access(path, os.X_OK):
            raise Refused(f"{entry}: expected a program that can be executed; chmod +x {path}.")
    return folder.resolve()


def enter(entry: str, asked: list[Instance], say=lambda line: None, keep=None) -> dict[str, dict]:
    """What an entry answers, and what that took, by instance. It prepares once for all instances
    with the same box and task; the runs and seconds of that count for each of these. keep: folder
    for its working folders, by default one that is removed. Raises Refused.
    """

    def task(one):
        return one.box, json.dumps(one.task)

    folder, found = programs_of(entry), {}
    with tempfile.TemporaryDirectory() as place:
        work = Path(place) if keep is None else Path(keep).resolve() / folder.name
        work.mkdir(parents=True, exist_ok=True)
        installed = call([folder / "install"], work, 600.0)
        if installed.code != 0:
            raise Refused(f"{entry}: install ended with {installed.code}; {installed.said}")
        for number, (_, some) in enumerate(groupby(sorted(asked, key=task), key=task)):
            room = work / str(number)
            (room / "model").mkdir(parents=True, exist_ok=True)
            at_door = Path(place) / str(number)  # a short name, which sockets must have
            at_door.mkdir(exist_ok=True)
            found |= _prepared(folder, room, at_door, list(some), say)
    return found


def _prepared(folder: Path, room: Path, at_door: Path, some: list[Instance], say):
    first = some[0]
    task, model = room / "task.json", room / "model"
    task.write_text(json.dumps(first.task))
    with Door(first.black_box, first.budget, at_door) as door:
        made = call([folder / "prepare", task, model], room, first.limit_s, door)
        spent, simulating = door.used, door.seconds
        found = {}
        for number, instance in enumerate(some):
            door.used, door.seconds = spent, 0.0
            own = (
                room / f"scene_{number}"
            )  # what another answer left is not there: runs are counted
            shutil.rmtree(own, ignore_errors=True)
            shutil.copytree(model, own / "model")
            answer = own / "answer.json"
            arguments = [folder / "answer", task, own / "model", _scene(instance, own), answer]
            ran = call(arguments, own, instance.limit_s, door, own / "first.json")
            given, not_read = _read(answer) if ran.code == 0 else (NOTHING, "")
            why = [_why("prepare", made), _why("answer", ran), not_read]
            why = "; ".join(filter(None, why))
            begin = time.monotonic()
            share = certified(instance, given, own)
            found[instance.id] = {
                "answer": given,
                "rollouts": door.used,
                "prepare_s": round(made.seconds, 2),
                "first_s": ran.first_s,
                "answer_s": round(ran.seconds, 2),
                "simulating_s": round(simulating + door.seconds, 2),
                "certified": share,
                "check_s": None if share is None else round(time.monotonic() - begin, 2),
                "why": why,
            }
            say(f"{folder.name} {instance.id}: {ran.seconds:.1f} s, {door.used} runs {why}")
    return found


def _read(path: Path) -> tuple[bytes, str]:
    """The answer in a file, and why there is none."""
    if not path.is_file():
        return NOTHING, "answer: expected a file at its fourth argument; none was written"
    if path.stat().st_size > LONGEST:
        return NOTHING, f"answer: expected a file of at most {LONGEST >> 20} MB"
    return path.read_bytes(), ""


def _scene(instance: Instance, room: Path) -> Path:
    """The scene, which tells nothing beside it: no id, no comment."""
    path = room / "scene.toml"
    path.write_text(instance.scene_text)
    return path


def _why(program: str, ran: Ran) -> str:
    if ran.code == 0:
        return ""
    ended = "stopped at the limit" if ran.code is None else f"exit code {ran.code}: {ran.said}"
    return f"{program}: {ended}"


def call(arguments, room: Path, limit_s: float, door: Door | None = None, plan=None) -> Ran:
    """Run a program in a folder; it is stopped, with all that it started, at the limit. Its
    `python3` is the one that runs the suite, which need not be the shell's.
    """
    first_looked_at = {"PYTHONPATH": str(ROOT), "PATH": str(Path(sys.executable).parent)}
    environment = dict(os.environ)
    for name, folder in first_looked_at.items():
        environment[name] = os.pathsep.join(filter(None, [folder, os.environ.get(name)]))
    environment |= {} if door is None else door.environment
    begin, first = time.monotonic(), None
    printed = room / f"{Path(arguments[0]).name}.txt"
    with printed.open("wb") as said:
        try:
            process = subprocess.Popen(
                list(map(str, arguments)),
                cwd=room,
                env=environment,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=partial(resource.setrlimit, resource.RLIMIT_FSIZE, (LARGEST, LARGEST)),
            )
        except OSError as error:
            why = f"{error.strerror}; expected a first line such as #!/usr/bin/env python3"
            return Ran(126, 0.0, None, why)
        try:
            while process.poll() is None and time.monotonic() - begin < limit_s:
                if first is None and plan is not None and plan.is_file():
                    first = round(time.monotonic() - begin, 2)
                time.sleep(LOOK)
            code = process.poll()
        finally:
            _end(process)
    with printed.open("rb") as said:
        said.seek(-min(SAID, printed.stat().st_size), os.SEEK_END)
        lines = said.read().decode(errors="replace").strip().splitlines()
    refused = [line for line in lines[:-1] if line.startswith("rollout:")]
    last = " ".join(refused[-1:] + lines[-1:])[:300]
    return Ran(code, time.monotonic() - begin, first, last)


def _end(process: subprocess.Popen) -> None:
    """Stop a program and all that it started, if it still runs."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
