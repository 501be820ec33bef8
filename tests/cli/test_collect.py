"""`parc-jax collect`: jobs fill a folder, `learn` takes it whole."""

from pathlib import Path

import pytest
import toy_cart

import parc_jax as pj
from parc_jax.app import cli


@pytest.fixture
def shell(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(Path(toy_cart.__file__).parent))

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main([str(a) for a in arguments])
        return (stop.value.code or 0), *capsys.readouterr()

    return run


def collect(shell, part, *more, rows="0:60", into="runs"):
    asked = ("--rows", rows, "--part", part, "--into", into, "--quiet", "--no-cache")
    return shell("collect", "toy_walker", *asked, *more)


def learn(shell):
    return shell("learn", "runs", "--out", "m.npz", "--eps", 0.3, "--delta", 0.2, "--no-cache")


def test_jobs_fill_a_folder_and_learn_takes_it_whole(shell, tmp_path, monkeypatch):
    seen = []

    def learned(train, held, *_):
        seen.append(sorted([*train.rows, *held.rows]))
        raise pj.InputError("enough seen.")

    monkeypatch.setattr("parc_jax.app.cli.learning.learn_recorded", learned)
    code, said, _ = collect(shell, "2/2")
    assert code == 0 and "Rows 30 to 59 are in runs/rows_000000030_000000059.npz: 30 runs" in said
    code, _, why = learn(shell)
    assert code == 2 and "runs: expected every row once; rows 0 to 29 are missing" in why
    code, _, why = collect(shell, "1/2", "--seed", 1)
    assert code == 2 and "holds chunks of other work; expected the same key" in why
    code, _, why = collect(shell, "1/2", "--plant", "windy")
    assert code == 2 and "holds chunks of other work; expected the same law" in why
    assert collect(shell, "1/2")[0] == 0
    assert collect(shell, "1/2")[0] == 0  # again: looked at, not run
    assert learn(shell)[2] == "parc-jax: enough seen.\n" and seen == [list(range(60))]
    assert not list(tmp_path.glob("m.npz*"))


@pytest.mark.parametrize(
    "options, words",
    [
        ({"rows": "10"}, "rows: expected BEGIN:END, such as 0:10000; got '10'"),
        ({"rows": "-3:10"}, "rows: expected BEGIN:END"),
        ({"rows": "9:9"}, "rows: expected BEGIN:END with BEGIN < END; got 9:9"),
        ({"rows": "0:9999999999"}, "rows: expected row numbers below 4,294,967,296"),
        ({"part": "3"}, "part: expected NUMBER/PARTS, such as 3/100; got '3'"),
        ({"part": "3/2"}, "part: expected NUMBER/PARTS with 1 <= NUMBER <= PARTS <= 60"),
        ({"part": "0/2"}, "part: expected NUMBER/PARTS with 1"),
        ({"into": "file"}, "file: cannot be written, since file is a file and no folder"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_nothing_is_written(shell, tmp_path, options, words):
    (tmp_path / "file").touch()
    code, _, why = collect(shell, **{"part": "1/2"} | options)
    assert code == 2 and words in why
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.slow
def test_from_jobs_to_a_claim(shell, tmp_path):
    for part in ("1/3", "3/3", "2/3"):
        assert collect(shell, part, rows="0:300")[0] == 0
    small = ("--hidden", 4, "--seeds", 1, "--steps", 40, "--bins", 1)
    code, said, why = shell(
        "learn", "runs", "--out", "m.npz", "--eps", 0.3, "--delta", 0.2, *small, "--no-cache"
    )
    assert code == 0 and "180 for training" in said, why
    assert "k uniform on K" in pj.load(tmp_path / "m.npz").claim.statement()
