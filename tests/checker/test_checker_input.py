"""Nothing but Rejected ever leaves the checker, whatever it is given; and the command line."""

import json
import random
import shutil
import subprocess
import sys
import time
from fractions import Fraction as F
from pathlib import Path

import answer_files as build
import known
import pytest

from parc_jax import checker, checker_cells

BAD_JSON = {
    "nothing": b"",
    "half a file": json.dumps(known.plain()).encode()[:500],
    "not UTF-8": b'{"format": "\xff"}',
    "a byte order mark": b"\xef\xbb\xbf" + json.dumps(known.plain()).encode(),
    "a list": b"[]",
    "null": b"null",
    "a string": b'"answer"',
    "nested a million deep": b"[" * 1_000_000,
    "objects nested a million deep": b'{"a":' * 1_000_000,
    "nested and closed": b'{"meta": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
    "a huge integer": b'{"meta": ' + b"9" * 100_000 + b"}",
    "NaN": b'{"format": NaN}',
    "minus infinity": b'{"format": -Infinity}',
    "an exponent": b'{"format": 1e5}',
    "a key twice, deep down": b'{"meta": [{"a": 1, "a": 1}]}',
    "text after the end": json.dumps(known.plain()).encode() + b"{}",
}


@pytest.mark.parametrize("name", BAD_JSON)
def test_files_that_are_not_strict_json_are_rejected(name, tmp_path):
    path = tmp_path / "answer.json"
    path.write_bytes(BAD_JSON[name])
    start = time.perf_counter()
    with pytest.raises(checker.Rejected):
        checker.check_answer(checker.load(path))
    assert time.perf_counter() - start < 5


NUMBERS = "nan NaN inf -inf 1e9999 0x1p+99999 0x1p 0x.8p0 0X1P0 1/0 1/-2 +1 1_000 \u0661 1. .5 1e --1 0b1 1/2/3 1,5 1j"
NUMBERS = [*NUMBERS.split(), "", " 1", "1 ", "0x1p0/2", "9" * 2000]


@pytest.mark.parametrize("text", NUMBERS)
def test_odd_numbers_are_rejected(text):
    with pytest.raises(checker.Rejected):
        checker.check_answer(known.change(known.plain(), {"samples__0__k": [text]}))


EXACT = {"31.3": F(313, 10), "-0.05": F(-1, 20), "7/3": F(7, 3), "-7/21": F(-1, 3), "1e-3": F(1, 1000)}
EXACT |= {"2.5e+2": F(250), "0x1.8p+1": F(3), "-0x1p-1074": -F(1, 2**1074), "0x0.0p+0": F(0)}
EXACT |= {"0x1.00000000000000000001p+0": 1 + F(1, 16**20)}


@pytest.mark.parametrize("text, value", EXACT.items())
def test_numbers_are_read_exactly(text, value):
    """A hex literal longer than a float keeps all its digits."""
    assert checker.number(text) == value


def places(part, path=()):
    """Every place of a JSON value."""
    yield path
    for key in part if isinstance(part, dict) else range(len(part)) if isinstance(part, list) else ():
        yield from places(part[key], (*path, key))


ODD = [None, True, False, 0, -1, 1, 10**17, "", "0", "-1", "1/0", "0x1p+5000", [], [[]], ["0"], [None], {}, {"A": 1}]


def swap(answer, rng):
    """Replaces, removes or repeats something anywhere."""
    *keys, last = rng.choice([place for place in places(answer) if place])
    part = answer
    for key in keys:
        part = part[key]
    action = rng.randrange(4)
    if action == 0:
        del part[last]
    elif action == 1 and isinstance(part, list):
        part.append(part[last])
    else:
        part[last] = rng.choice(ODD)


@pytest.mark.parametrize("name", known.VALID)
def test_random_changes_of_type_are_rejected_or_accepted_but_never_crash(name):
    rng, fresh, rejected = random.Random(name), json.dumps(build.rehash(known.VALID[name]())), 0
    for _ in range(400):
        answer = json.loads(fresh)
        swap(answer, rng)
        if set(answer) >= {"problem", "network", "tube"} and type(answer.get("claim")) is dict:
            build.rehash(answer)
        try:
            "\n".join(checker.summary(checker.check_answer(answer)))
        except checker.Rejected as why:
            rejected += 1
            assert str(why)
    assert rejected > 200


def test_methods_of_the_context_raise_nothing_but_rejected():
    answer = known.plain()
    context = checker.Context(*(answer[part] for part in ("problem", "network", "tube")))
    for odd in (*ODD, object(), 1.5):
        for method in (context.check_sample, context.check_set, context.set_rows, checker.check_answer):
            with pytest.raises(checker.Rejected):
                method(odd)
        with pytest.raises(checker.Rejected):
            checker.Context(odd, answer["network"], answer["tube"])
        with pytest.raises(checker.Rejected):
            checker.Context(answer["problem"], answer["network"], odd)


def test_floats_are_refused_even_in_memory():
    answer = known.plain()
    context = checker.Context(*(answer[part] for part in ("problem", "network", "tube")))
    with pytest.raises(checker.Rejected):
        context.check_sample(answer["samples"][0] | {"k": [0.5]})


def test_recursion_and_memory_errors_are_rejections(monkeypatch):
    for error in (RecursionError, MemoryError, ZeroDivisionError, KeyError):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr(checker, "integers", fail)
        with pytest.raises(checker.Rejected):
            checker.check_answer(known.plain())


def run(arguments, cwd):
    return subprocess.run([sys.executable, *arguments], cwd=cwd, capture_output=True, text=True, timeout=60)


@pytest.fixture
def folder(tmp_path):
    """A folder with the checker's two files, a good answer, a bad one, the same of corridors, and a proof."""
    for module in (checker, checker_cells):
        shutil.copy(module.__file__, tmp_path)
    (tmp_path / "good.json").write_text(json.dumps(known.plain()))
    (tmp_path / "bad.json").write_text(known.CASES["touching"][0]())
    (tmp_path / "corridor.json").write_text(json.dumps(known.corridor()))
    (tmp_path / "left.json").write_text(known.CASES["a corridor whose plan does not keep to it"][0]())
    (tmp_path / "bracket.json").write_text(json.dumps(known.bracket()))
    return tmp_path


def test_the_copied_file_checks_alone(folder):
    (folder / "checker_cells.py").unlink()
    good, bad = run(["checker.py", "good.json"], folder), run(["checker.py", "bad.json"], folder)
    assert (good.returncode, bad.returncode) == (0, 1)
    assert "1 samples" in good.stdout
    assert "1 polytopes" in good.stdout
    assert "0 corridors" in good.stdout
    assert "rests on the tube" in good.stdout
    assert bad.stdout.startswith("REJECTED: samples[0]: the condition of obstacle 0 at knot 0 fails")
    corridor, left = run(["checker.py", "corridor.json"], folder), run(["checker.py", "left.json"], folder)
    assert (corridor.returncode, left.returncode) == (0, 1)
    assert "  1 corridors: so does every (p0, k) of the domain that meets all conditions of one\n" in corridor.stdout
    assert left.stdout.startswith("REJECTED: corridors[0]: the condition of obstacle 0 at knot 0 fails")
    proof = run(["checker.py", "bracket.json"], folder)
    assert proof.returncode == 1, "without its second file the checker must not accept a no_plan part"


def test_exit_codes_and_json(folder):
    assert "safe 11.76 %" in run(["checker.py", "bracket.json"], folder).stdout
    result = run(["checker.py", "bracket.json", "--json"], folder)
    report = json.loads(result.stdout)
    assert result.returncode == 0
    assert report["accepted"] is True
    assert report["no_plan"] == {"kind": "bracket", "safe": "3/2", "unsafe": "61/16", "undecided": "119/16"}
    assert list(report) == ["accepted", "samples", "sets", "corridors", "no_plan", "claim", "hash"]
    counts = json.loads(run(["checker.py", "corridor.json", "--json"], folder).stdout)
    assert [counts[kind] for kind in build.KINDS] == [0, 0, 1]
    assert json.loads(run(["checker.py", "--json", "bad.json"], folder).stdout)["accepted"] is False
    for arguments in (["missing.json"], [], ["good.json", "bad.json"], ["--help"], ["."]):
        assert run(["checker.py", *arguments], folder).returncode == 2


def test_the_module_runs_without_jax(folder):
    """`python -m parc_jax.checker` may import the package, but neither JAX nor NumPy."""
    code = "import sys, runpy; sys.argv = ['checker', 'good.json']\n"
    code += "try:\n    runpy.run_module('parc_jax.checker', run_name='__main__')\n"
    code += "except SystemExit as e:\n    assert e.code == 0\nassert not {'jax', 'numpy'} & set(sys.modules)\n"
    (folder / "go.py").write_text(f"import sys; sys.path.insert(0, {str(Path(checker.__file__).parents[1])!r})\n{code}")
    result = run(["go.py"], folder)
    assert result.returncode == 0, result.stderr
