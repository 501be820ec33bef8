"""Entries are run as a newcomer's are: three programs, files, runs that are counted."""

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from suite_cases import robust, text

from benchmarks.suite import __main__ as command
from benchmarks.suite.answer import SOME, read
from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import load
from benchmarks.suite.certified import FILE, certified
from benchmarks.suite.door import Door
from benchmarks.suite.enter import LARGEST, NOTHING, enter
from benchmarks.suite.fresh import fresh
from benchmarks.suite.instances import instances
from benchmarks.suite.result import freeze, frozen, scored
from benchmarks.suite.scene import load_scene
from benchmarks.suite.table import table
from benchmarks.suite.wire import receive

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "docs" / "examples" / "suite_entry"


def entry(folder, answer, prepare="", name="entry"):
    """An entry whose programs are a few lines of shell."""
    place = folder / name
    place.mkdir()
    for program, lines in (("install", ""), ("prepare", prepare), ("answer", answer)):
        (place / program).write_text(f"#!/bin/sh\n{lines}\n")
        (place / program).chmod(0o755)
    return str(place)


def asked(name="puck_01", **changes):
    (one,) = instances("large", [name])
    return type(one)(**{key: getattr(one, key) for key in type(one).__annotations__} | changes)


def test_the_example_of_the_page_answers_a_plan_that_stands(tmp_path, capsys):
    out = ["--out", str(tmp_path / "out"), "--only", "puck_01"]
    assert command.main([*out, "--entries", str(EXAMPLE)]) == 0
    assert "suite_entry" in capsys.readouterr().out
    report = json.loads((tmp_path / "out" / "scores.json").read_text())
    one = report["instances"]["puck_01"]
    found = one["entries"]["suite_entry"]
    assert found["status"] == "stands" and found["points"] == 2
    assert found["rollouts"] == 2000 and not found["why"]
    assert command.main([*out, "--again"]) == 0
    again = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert again["instances"]["puck_01"] == one
    assert command.main([*out, "--score", "--figure", str(tmp_path / "x.png")]) == 0
    other = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert other["instances"]["puck_01"]["chance"] != one["chance"]
    assert (tmp_path / "x.png").stat().st_size > 1000
    # a scene of the folder that nobody asks for is in no table, one without scores is told
    scores = tmp_path / "out" / "scores.json"
    other["instances"]["bar_01"] = other["instances"]["puck_01"]
    scores.write_text(json.dumps(other))
    capsys.readouterr()
    assert command.main([*out, "puck_02", "--again"]) == 0
    said = capsys.readouterr()
    assert "| suite_entry | 1 | 2.0 |" in said.out
    assert "1 of 2 instances that were asked for have no scores yet" in said.err
    assert command.main([*out[:-1], "puck_02", "--again"]) == 2
    assert "expected scores of what was asked for" in capsys.readouterr().err


def test_what_breaks_or_hangs_answers_nothing_and_says_why(tmp_path):
    broken = enter(entry(tmp_path, "echo no luck; exit 3"), [asked()])["puck_01"]
    assert broken["answer"] == NOTHING and "exit code 3: no luck" in broken["why"]
    hangs = entry(tmp_path, "sleep 60", name="hangs")
    late = enter(hangs, [asked(limit_s=0.3)])["puck_01"]
    assert late["answer"] == NOTHING and late["why"] == "answer: stopped at the limit"
    nothing = enter(entry(tmp_path, "", name="nothing"), [asked()])["puck_01"]
    assert nothing["answer"] == NOTHING and "none was written" in nothing["why"]
    unnamed = Path(entry(tmp_path, "", "exit 7", name="unnamed"))
    (unnamed / "answer").write_bytes(b"\x00")
    told = enter(str(unnamed), [asked()])["puck_01"]["why"]
    assert "prepare: exit code 7" in told and "expected a first line such as #!" in told


def instance(result, good=10):
    """An instance with so many good plans, of one entry's result."""
    return {"truth": {"plans": 99, "good": good}, "entries": {"one": result}}


def test_a_first_plan_counts_where_the_answer_stands():
    said = {"points": 0, "rollouts": 0, "prepare_s": 0.0, "answer_s": 1.0, "first_s": 0.25}
    stands = said | {"status": "stands", "points": 2, "first_s": 0.5}
    both = {"a": said | {"status": "unknown"}, "b": stands}
    each = {name: instance(result) for name, result in both.items()}
    told = table({"instances": each})
    assert "| 0.5 | 1.0 |" in told and "first plan of those that stand, median [s]" in told
    assert "|  | 1.0 |" in table({"instances": {"a": each["a"]}})


def test_a_scene_with_plans_and_no_answer_that_stands_has_no_yield():
    """Two scenes with plans, one of them refuted, and one without: three instances, two yields."""
    said = {"points": 0, "rollouts": 7, "prepare_s": 0.0, "answer_s": 1.0, "first_s": 0.5}
    stands = said | {"status": "stands", "yield": [0.6, 0.5, 0.7], "held": [6, 10]}
    refuted = said | {"status": "refuted"}
    each = {"a": instance(stands), "b": instance(refuted)}
    each["c"] = instance(said | {"status": "right"}, good=0)
    header, _, row = table({"instances": each}).splitlines()
    assert "| entry | instances | points |" in header and "| one | 3 | 0 |" in row
    assert "| yield where plans are, mean | of those that stand |" in header
    assert "| 30 % | 60 % |  | 7 |" in row
    assert "| 0 % |  |  | 7 |" in table({"instances": {"b": each["b"]}})
    assert "|  |  |  | 7 |" in table({"instances": {"c": each["c"]}})


def test_what_is_certified_is_told_as_a_share_of_the_yield():
    said = {"points": 3, "rollouts": 7, "prepare_s": 0.0, "answer_s": 1.0, "first_s": 0.5}
    stands = said | {"status": "stands", "held": [1, 2]}
    some = stands | {"yield": [0.6, 0.5, 0.7], "certified": 0.8}
    none = stands | {"yield": [0.2, 0.1, 0.3], "certified": None}
    each = {name: instance(one) for name, one in {"a": some, "b": none}.items()}
    assert "| 40 % | 40 % | 60 % | 7 |" in table({"instances": each})
    assert "| 20 % | 20 % |  | 7 |" in table({"instances": {"b": each["b"]}})


def test_what_was_refused_at_the_door_is_told_and_rooms_are_kept(tmp_path):
    line = (
        'python3 -c "import numpy as n; n.savez(\\"a.npz\\", p0=n.zeros((9,2)), k=n.zeros((9,2)))"'
    )
    answer = f'echo looking; {line}; "$SUITE_ROLLOUT" a.npz r.npz || {{ echo lost; exit 1; }}'
    place, keep = entry(tmp_path, answer), tmp_path / "keep"
    why = enter(place, [asked("puck_06")], keep=keep)["puck_06"]["why"]
    assert "k between k_lo and k_hi" in why and why.endswith("lost")
    room = keep / "entry" / "0" / "scene_0"
    assert (room / "answer.txt").read_text().startswith("looking\n")
    scene = room / "scene.toml"
    assert "# " in asked("puck_06").scene_path.read_text() and "#" not in scene.read_text()
    assert load_scene(scene, ("reference",), 2, 0).start.shape == (2, 2)


def test_runs_are_counted_and_end_with_the_budget(tmp_path):
    with Door(load("puck"), 100, tmp_path) as door:

        def ask(n, **changes):
            p0, k = np.zeros((n, 2)), np.full((n, 2), 1.0)
            np.savez(tmp_path / "ask.npz", **{"p0": p0, "k": k} | changes)
            command = [sys.executable, door.environment["SUITE_ROLLOUT"]]
            command += [tmp_path / "ask.npz", tmp_path / "runs.npz"]
            done = subprocess.run(command, env=door.environment, capture_output=True, text=True)
            return done.stderr.strip()

        assert ask(60) == "" and door.used == 60
        with np.load(tmp_path / "runs.npz") as runs:
            assert runs["p"].shape == (60, 21, 1, 2) and runs["q"].shape == (60, 0)
            first = runs["p"]
        assert ask(30) == "" and door.used == 90
        with np.load(tmp_path / "runs.npz") as runs:
            assert (runs["p"] != first[:30]).any()  # another seed
        assert "at most 10 runs" in ask(11) and door.used == 90
        assert "p0 (n, 2)" in ask(5, p0=np.zeros((5, 3)))
        assert "between k_lo and k_hi" in ask(5, k=np.full((5, 2), np.nan))
        assert "p0 and k" in ask(5, k=np.array([{}], object))


@pytest.mark.parametrize(
    "head",
    [b'{"shapes": {"p0": [99999999999, 2]}}', b"[1]", b'{"shapes": {"p0": [-1]}}', b"\x80\x04."],
    ids=["too many", "no head", "no shape", "a pickle"],
)
def test_what_is_no_request_is_refused_and_runs_nothing(tmp_path, head):
    with Door(load("puck"), 100, tmp_path) as door, socket.socket(socket.AF_UNIX) as line:
        line.connect(str(tmp_path / "door"))
        line.sendall(struct.pack("<I", len(head)) + head)
        said, runs = receive(line)
        assert said.startswith("rollout: expected 1 to") and not runs and not door.used


def test_a_door_that_closes_while_a_client_enters_waits_for_nobody(tmp_path, monkeypatch):
    enters, closes, accept = threading.Event(), threading.Event(), socket.socket.accept

    def late(listener):
        found = accept(listener)
        enters.set()
        closes.wait()
        return found

    monkeypatch.setattr(socket.socket, "accept", late)
    door = Door(load("puck"), 100, tmp_path)
    door.__enter__()
    joins = door._thread.join  # asked for once the door has looked for whom to wake
    monkeypatch.setattr(door._thread, "join", lambda: (closes.set(), joins()))
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(str(tmp_path / "door"))
        assert enters.wait(20.0)
        closing = threading.Thread(target=door.__exit__, args=(None,) * 3, daemon=True)
        closing.start()
        closing.join(20.0)  # [s], where a client may say nothing for half as long again
        assert not closing.is_alive()


STOPPED = """
import os, signal, socket, struct, sys
sys.path.insert(0, sys.argv[1])
from benchmarks.suite.wire import receive
line = socket.socket(socket.AF_UNIX)
line.connect(os.environ["SUITE_DOOR"])
line.sendall(struct.pack("<I", 1000))
print("stops", flush=True)
os.kill(os.getpid(), signal.SIGSTOP)  # in the middle of a request, until the next scene is asked
line.sendall(b" " * 1000)
print(receive(line), flush=True)
"""


def test_a_client_that_was_stopped_gets_nothing_from_the_next_scene(tmp_path):
    first, script = Door(load("puck"), 100, tmp_path), tmp_path / "stopped.py"
    script.write_text(STOPPED)
    first.__enter__()
    command = [sys.executable, script, ROOT]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen(command, env=first.environment, **pipes) as client:
        try:
            assert client.stdout.readline() == "stops\n"
            os.waitid(os.P_PID, client.pid, os.WSTOPPED | os.WNOWAIT)
            closing = threading.Thread(target=first.__exit__, args=(None,) * 3, daemon=True)
            closing.start()
            closing.join(20.0)  # [s], where a client may say nothing for half as long again
            assert not closing.is_alive()
            with Door(load("puck"), 100, tmp_path) as door:
                client.send_signal(signal.SIGCONT)
                assert client.stdout.read() == "" and client.wait()
                assert not door.used and not first.used
        finally:
            client.kill()


def test_runs_of_one_scene_are_not_there_for_the_next(tmp_path):
    answer = 'ls "$2" . >"$4.txt"; echo hoard >"$2/hoard"; echo hoard >hoard; cat "$4.txt"'
    place = entry(tmp_path, f'{answer}; echo "{{}}" >"$4"', 'echo made >"$2/made"')
    keep = tmp_path / "keep"
    enter(place, [asked(), asked("puck_02")], keep=keep)
    for number in range(2):
        there = (keep / "entry" / "0" / f"scene_{number}" / "answer.txt").read_text()
        assert "made" in there and "hoard" not in there


def test_an_answer_that_is_too_large_is_not_read(tmp_path):
    large = enter(entry(tmp_path, 'truncate -s 100M "$4"'), [asked()])["puck_01"]
    assert large["answer"] == NOTHING and "at most 64 MB" in large["why"]


@pytest.mark.parametrize("place", ["$2/large", "/dev/stdout"], ids=["kept", "said"])
def test_files_that_would_fill_a_disk_are_not_written(tmp_path, place):
    """Files that are sparse for their entry and would be whole for who copies or reads them."""
    write = f'truncate -s 64G "{place}"'
    keep = tmp_path / "keep"
    found = enter(entry(tmp_path, 'echo "{}" >"$4"', write), [asked()], keep=keep)["puck_01"]
    assert "prepare: exit code" in found["why"]
    sizes = [path.stat().st_size for path in keep.rglob("*") if path.is_file()]
    assert sizes and max(sizes) <= LARGEST


@pytest.mark.slow
def test_fresh_instances_are_other_scenes_and_the_same_for_the_same_seed(tmp_path, capsys):
    once, again, other = (fresh(asked("bar_02"), seed).scene_text for seed in ("7", "7", "8"))
    assert once == again != other and once != asked("bar_02").scene_text
    known = asked("bar_05")
    assert (np.diff(fresh(known, "7").scene.start, axis=0) > 0).all()
    out = ["--out", str(tmp_path / "out"), "--only", "puck_01"]
    assert command.main([*out, "--entries", str(EXAMPLE), "--instances", "7"]) == 0
    report = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert report["instances"]["puck_01"]["entries"]["suite_entry"]["status"] == "stands"
    assert command.main([*out, "--again"]) == 0
    assert json.loads((tmp_path / "out" / "scores.json").read_text()) == report
    assert command.main([*out, "--entries", str(EXAMPLE), "--instances", "8"]) == 2
    assert "has others" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("name", ["parc_jax", "neural_parc"])
def test_entries_that_learn_answer_what_the_scorer_takes(name, tmp_path):
    one = asked(budget=4000, eps=0.05)
    found = enter(name, [one], keep=tmp_path)[one.id]
    assert not found["why"] and found["first_s"] is not None
    answer = read(found["answer"], *one.bounds)
    assert answer.verdict == SOME and (len(answer.plans) or answer.pieces)
    room = tmp_path / name / "0" / "scene_0"
    if name != "parc_jax":
        assert found["certified"] is None
        return
    # nearly all of the sets, but nothing in another scene, nor by a file that was changed
    assert found["certified"] > 0.95
    assert certified(asked("puck_02"), found["answer"], room) == 0.0
    text = (room / FILE).read_text()
    (room / FILE).write_text(text.replace('"steps":', '"steps" :', 1))
    assert certified(one, found["answer"], room) == found["certified"]
    own = json.loads(text)["hash"]
    (room / FILE).write_text(text.replace(own["tube"], own["network"]))
    assert certified(one, found["answer"], room) == 0.0


def test_an_answer_that_was_changed_later_is_refused(tmp_path):
    one = asked()
    found = {"answer": text(polytopes=[robust()]), "prepare_s": 0.0, "first_s": None}
    freeze(tmp_path, "one", {one.id: found | {"answer_s": 0.0, "rollouts": 0}})
    assert scored(tmp_path, [one], "0")["instances"][one.id]["entries"]["one"]["status"] == "stands"
    place = tmp_path / "answers" / "one" / f"{one.id}.json.gz"
    freeze(tmp_path, "two", {one.id: found | {"answer": NOTHING}})
    place.write_bytes((tmp_path / "answers" / "two" / place.name).read_bytes())
    with pytest.raises(Refused, match="ledger"):
        frozen(tmp_path, one)


def test_bad_input_at_the_command_is_a_sentence(tmp_path, capsys):
    unable = Path(entry(tmp_path, "", name="unable"))
    (unable / "answer").chmod(0o644)
    entries = [["--only", "puck_01", "--entries", name] for name in ("./nobody", str(unable))]
    bad = (["--only", "nothing"], *entries, ["--again"], ["--score"])
    for arguments in bad:
        assert command.main([*arguments, "--out", str(tmp_path)]) == 2
        assert "expected" in capsys.readouterr().err


def test_numpy_is_all_that_the_scorer_needs():
    code = "import sys, benchmarks.suite.__main__; import benchmarks.suite.boxes.bar; "
    code += (
        "print([m for m in ('jax', 'scipy', 'parc_jax', 'sims', 'matplotlib') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.stdout.strip() == "[]", run.stderr
