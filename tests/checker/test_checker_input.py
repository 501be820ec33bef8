"""Nothing but Rejected ever leaves the checker, whatever it is given; and the command line."""

import json
import random
import shutil
import subprocess
import sys
from fractions import Fraction as F
from pathlib import Path

import answer_files as build
import known
import pytest
from effort import calls_of

from parc_jax import checker
from parc_jax.checker.exact import integers, whole_numbers

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

    def refused():
        with pytest.raises(checker.Rejected):
            checker.check_answer(checker.load(path))

    assert calls_of(refused) < 1000


NUMBERS = "nan NaN inf -inf 1e9999 0x1p+99999 0x1p 0x.8p0 0X1P0 1/0 1/-2 +1 1_000 \u0661"
NUMBERS += " 1. .5 1e --1 0b1 1/2/3 1,5 1j"
NUMBERS = [*NUMBERS.split(), "", " 1", "1 ", "0x1p0/2", "9" * 2000]


@pytest.mark.parametrize("text", NUMBERS)
def test_odd_numbers_are_rejected(text):
    with pytest.raises(checker.Rejected):
        checker.check_answer(known.change(known.plain(), {"samples__0__k": [text]}))


EXACT = {
    "31.3": F(313, 10),
    "-0.05": F(-1, 20),
    "7/3": F(7, 3),
    "-7/21": F(-1, 3),
    "1e-3": F(1, 1000),
}
EXACT |= {"2.5e+2": F(250), "0x1.8p+1": F(3), "-0x1p-1074": -F(1, 2**1074), "0x0.0p+0": F(0)}
EXACT |= {"0x1.00000000000000000001p+0": 1 + F(1, 16**20)}


@pytest.mark.parametrize("text, value", EXACT.items())
def test_numbers_are_read_exactly(text, value):
    """A hex literal longer than a float keeps all its digits."""
    assert checker.number(text) == value


def places(part, path=()):
    """Every place of a JSON value."""
    yield path
    for key in (
        part if isinstance(part, dict) else range(len(part)) if isinstance(part, list) else ()
    ):
        yield from places(part[key], (*path, key))


ODD = [
    None,
    True,
    False,
    0,
    -1,
    1,
    10**17,
    "",
    "0",
    "-1",
    "1/0",
    "0x1p+5000",
    [],
    [[]],
    ["0"],
    [None],
    {},
    {"A": 1},
]


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
        for method in (
            context.check_sample,
            context.check_set,
            checker.check_answer,
        ):
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

        monkeypatch.setattr(checker.plans, "integers", fail)
        with pytest.raises(checker.Rejected):
            checker.check_answer(known.plain())


def run(arguments, cwd):
    return subprocess.run([sys.executable, *arguments], cwd=cwd, capture_output=True, text=True)


@pytest.fixture
def folder(tmp_path):
    """A folder with a copy of the checker, a good answer, a bad one, the same of corridors, and a
    proof.
    """
    shutil.copytree(
        Path(checker.__file__).parent,
        tmp_path / "checker",
        ignore=shutil.ignore_patterns("__pycache__", "proved"),
    )
    (tmp_path / "good.json").write_text(json.dumps(known.plain()))
    (tmp_path / "bad.json").write_text(known.CASES["touching"][0]())
    (tmp_path / "corridor.json").write_text(json.dumps(known.corridor()))
    (tmp_path / "left.json").write_text(
        known.CASES["a corridor whose plan does not keep to it"][0]()
    )
    (tmp_path / "bracket.json").write_text(json.dumps(known.bracket()))
    return tmp_path


@pytest.mark.parametrize("command", [["checker"], ["-m", "checker"], ["-I", "checker"]])
def test_the_copied_folder_checks_alone(folder, command):
    good, bad = run([*command, "good.json"], folder), run([*command, "bad.json"], folder)
    assert (good.returncode, bad.returncode) == (0, 1), good.stderr
    assert "  1 sample (p0, k): the goal" in good.stdout
    assert "  1 polytope of (p0, k): so" in good.stdout
    assert "corridor" not in good.stdout
    assert "borders between\n    bins of k are no part of it" in good.stdout
    assert "rests on the tube" in good.stdout
    assert good.stderr == bad.stderr == ""
    assert bad.stdout.startswith(
        "REJECTED: samples[0]: the condition of obstacle 0 at knot 0, point 0 fails"
    )
    corridor, left = (
        run([*command, "corridor.json"], folder),
        run([*command, "left.json"], folder),
    )
    assert (corridor.returncode, left.returncode) == (0, 1)
    assert "  1 corridor: so does every (p0, k) of the domain" in corridor.stdout
    assert left.stdout.startswith(
        "REJECTED: corridors[0]: the condition of obstacle 0 at knot 0, point 0 fails"
    )


def test_exit_codes_and_json(folder):
    assert "safe 11.764 %" in run(["checker", "bracket.json"], folder).stdout
    result = run(["checker", "bracket.json", "--json"], folder)
    report = json.loads(result.stdout)
    assert result.returncode == 0
    assert report["accepted"] is True
    assert report["no_plan"] == {
        "kind": "bracket",
        "safe": "3/2",
        "unsafe": "61/16",
        "undecided": "119/16",
    }
    kinds = ["samples", "sets", "corridors", "doubt"]
    rest = "no_plan scene said moving seconds bins without_model without_claim".split()
    rest += ["claim", "arithmetic", "hash"]
    assert list(report) == ["accepted", *kinds, *rest]
    counts = json.loads(run(["checker", "corridor.json", "--json"], folder).stdout)
    assert [counts[kind] for kind in build.KINDS] == [0, 0, 1]
    assert json.loads(run(["checker", "--json", "bad.json"], folder).stdout)["accepted"] is False


NO_ANSWERS = {
    "missing.json": (None, "No such file"),
    ".": (None, "directory"),
    "model.npz": (b"PK\x03\x04 and so on", "saved models"),
    "photo.json": (b"\xff\xd8\xff\xe0", "not text"),
    "scene.toml": (b"[goal]\nlo = [1, 2]\n", "not JSON"),
    "nothing.json": (b"", "not JSON"),
    "half.json": (json.dumps(known.plain()).encode()[:500], "not JSON"),
    "package.json": (b'{"name": "something else"}', "without this format"),
    "list.json": (b"[1, 2]", "without this format"),
}


@pytest.mark.parametrize("name", NO_ANSWERS)
def test_what_is_no_answer_file_ends_with_what_was_expected(folder, name, capsys):
    content, words = NO_ANSWERS[name]
    if content is not None:
        (folder / name).write_bytes(content)
    assert checker.main([str(folder / name)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and "expected an answer file (JSON of format parc_jax.answer/3," in err
    assert words in err and len(err.splitlines()) == 1


def test_the_module_runs_without_jax(folder):
    """`python -m parc_jax.checker` may import the package, but neither JAX nor NumPy."""
    code = "import sys, runpy; sys.argv = ['checker', 'good.json']\n"
    code += "try:\n    runpy.run_module('parc_jax.checker', run_name='__main__')\n"
    code += "except SystemExit as e:\n    assert e.code == 0\n"
    code += "assert not {'jax', 'numpy'} & set(sys.modules)\n"
    (folder / "go.py").write_text(
        f"import sys; sys.path.insert(0, {str(Path(checker.__file__).parents[2])!r})\n{code}"
    )
    result = run(["go.py"], folder)
    assert result.returncode == 0, result.stderr


def cube(n_k, width, leaves):
    """A short file whose leaves have very many cells: hyperplanes across a cube of k."""
    rng, answer = random.Random(1), known.line()
    first = [[str(rng.randint(-9, 9)) for _ in range(n_k)] for _ in range(width)]
    biases = [[str(rng.randint(-2, 2)) for _ in range(width)], ["0"]]
    answer["network"] = {"weights": [first, [["1"] * width]], "biases": biases}
    answer["problem"] |= {"n_k": n_k, "domain": {"lo": ["-1"] * n_k, "hi": ["1"] * n_k}}
    answer["tube"] |= {"edges": [["-1", "1"]] * n_k}
    answer = known.with_plan(answer, "bracket", ["-9"], ["9"], {"safe": []})
    tree = [node for i in range(1, leaves) for node in ({"split": [1, f"{i}/{leaves}"]}, SAFE)]
    answer["no_plan"]["tree"] = [*tree, SAFE]
    return build.rehash(answer)


SAFE = {"safe": []}


def long_integers():
    """Each layer multiplies numbers of thousands of bits."""
    answer = known.line()
    weights = [[["0x1p-8000"]] * 4, *[[["0x1p-8000"] * 4] * 4] * 60, [["0x1p-8000"] * 4]]
    answer["network"] = {"weights": weights, "biases": [["0x1p-8000"] * 4] * 61 + [["0"]]}
    return build.rehash(answer | {"samples": answer["samples"] * 100})


def many_bins():
    """Each sample lies on the corner of 256 bins."""
    answer, n = known.line(), 8
    answer["network"]["weights"] = [[["1"] * n]]
    answer["problem"] |= {"n_k": n, "domain": {"lo": ["-1"] * n, "hi": ["1"] * n}, "steps": 100}
    answer["network"] = {"weights": [[["1"] * n], [["1"]] * 100], "biases": [["0"], ["0"] * 100]}
    answer["tube"] = {
        "edges": [["-1", "0", "1"]] * n,
        "interval": [[[["0"]]] * 100] * 256,
        "final": [["0"]] * 256,
    }
    sample = {"p0": ["0"], "k": ["0"] * n, "sep": []}
    return build.rehash(answer | {"samples": [sample] * 200})


@pytest.mark.slow
@pytest.mark.soundness
@pytest.mark.parametrize(
    "make",
    [lambda: cube(8, 6, 1), lambda: cube(3, 60, 60), lambda: cube(4, 40, 20), long_integers],
)
def test_a_small_file_cannot_ask_for_long_work(make):
    """Cells of a cube with 256 corners, many cells in few leaves, long integers: all are refused
    after a second or two.
    """
    answer = make()
    assert len(json.dumps(answer)) < 50_000

    def refused():
        with pytest.raises(checker.Rejected, match="more work than the size of the file allows"):
            checker.check_answer(answer)

    assert calls_of(refused) < 10_000_000


@pytest.mark.slow
def test_the_work_that_is_allowed_grows_with_the_file():
    """A file in which every entry asks for what its size allows is accepted, however long it is."""
    assert checker.check_answer(many_bins()).samples == 200
    assert checker.allowance("x" * 1000) - checker.allowance("") == 1000 * 1000


def test_unknown_keys_are_refused_but_not_meta():
    answer = known.plain()
    assert checker.check_answer(answer | {"meta": {"what": ["ever", 1]}}).samples == 1
    with pytest.raises(checker.Rejected, match="expected the fields"):
        checker.check_answer(answer | {"notes": {}})


def test_values_may_be_nested_as_deep_as_the_limit_says():
    deep = json.loads("[" * 500 + "]" * 500)
    assert checker.check_answer(known.plain() | {"meta": deep}).samples == 1


def test_a_bin_that_nothing_has_cannot_be_asked_for():
    """No bin is never taken for no error."""
    context = checker.Context(*(known.plain()[part] for part in checker.PARTS))
    outside = context.bins_meeting([F(2)], [F(2)], closed=True)
    assert outside == []
    with pytest.raises(ValueError, match="not enough values"):
        context.errors(outside, max)


def test_lists_of_hex_floats_read_without_fractions_are_the_same_numbers(rng):
    """Integers over the least common denominator, as of fractions one by one; mixed lists too."""
    for size in (1, 3, 40):
        x = rng.normal(size=size) * 2.0 ** rng.integers(-40, 40, size)
        texts = [float(v).hex() for v in x] + ["0x0.0p+0", "-0x1.8p+1", "0x10p-3"]
        for some in (texts, [*texts, "1/3"], ["0x1p+5", "0x3p+2"], ["0x0p-90"], []):
            assert whole_numbers(some) == integers([checker.number(text) for text in some])
    for bad in ("0x1p-9000", "0x1p+17000", "nan", "0x1p0 0x1p0", "0x" + "1" * 999, ""):
        with pytest.raises(checker.Rejected):
            whole_numbers(["0x1p+0", bad])
    with pytest.raises(checker.Rejected):  # one too large for the denominator of the others
        whole_numbers(["0x1p+9999", "0x1p-8000"])
