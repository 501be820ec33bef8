"""`parc-jax collect`: a file of rows, which `learn` takes."""

from pathlib import Path

import pytest

import parc_jax as pj


@pytest.fixture(autouse=True)
def found(cart):
    pass


FILE = "runs/rows_000000020_000000059.npz"


def collect(shell, *more, rows="20:60", into="runs"):
    asked = ("--rows", rows, "--into", into, "--quiet", "--no-cache")
    return shell("collect", "toy_walker", *asked, *more)


def test_rows_are_in_a_file_that_learn_takes(shell, tmp_path, monkeypatch):
    seen = []

    def learned(runs, *_, **__):
        seen.append(sorted(runs.rows))
        raise pj.InputError("enough seen.")

    monkeypatch.setattr("parc_jax.app.cli.logged.learn_report", learned)
    code, said, _ = collect(shell)
    assert code == 0 and said == f"Rows 20 to 59 are in {FILE}.\n"
    assert [path.name for path in (tmp_path / "runs").iterdir()] == [Path(FILE).name]
    for other, words in ((("--seed", 1), "seed"), (("--plant", "windy"), "law")):
        code, _, why = collect(shell, *other)
        assert code == 2 and "holds other rollouts than the ones asked for" in why and words in why
    assert collect(shell)[0] == 0  # again: looked at, not run
    _, _, why = shell("learn", FILE, "--out", "m.npz", "--eps", 0.3, "--delta", 0.2, "--no-cache")
    assert why == "parc-jax: enough seen.\n" and seen == [list(range(20, 60))]


@pytest.mark.parametrize(
    "options, words",
    [
        ({"rows": "10"}, "rows: expected BEGIN:END, such as 0:10000; got '10'"),
        ({"rows": "-3:10"}, "rows: expected BEGIN:END"),
        ({"rows": "9:9"}, "rows: expected BEGIN:END with BEGIN < END, and row"),
        ({"rows": "0:9999999999"}, "row numbers below 4,294,967,296; got 0:9999999999"),
        ({"into": "file"}, "file: cannot be written, since file is a file and no folder"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_nothing_is_written(shell, tmp_path, options, words):
    (tmp_path / "file").touch()
    code, _, why = collect(shell, **options)
    assert code == 2 and words in why
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
