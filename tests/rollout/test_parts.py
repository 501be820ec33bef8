"""A folder that several jobs fill is whole and of one program, or refused."""

import shutil

import jax
import numpy as np
import pytest
import toy_walker

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.runs.parts import collect_part, part_of

KEY, WHOLE = jax.random.PRNGKey(0), range(5, 35)


def fill(folder, *numbers, parts=3, key=KEY, whole=WHOLE, plant="plain", program="mine"):
    for number in numbers:
        rows = part_of(whole, number, parts)
        made = toy_walker.system(plant)
        collect_part(made, key, whole, rows, folder, program, quiet=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts") / "whole"
    fill(folder, 3, 1, 2)
    return folder


@pytest.fixture
def copied(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "parts")


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_parts_are_the_rows_that_one_job_would_run(whole):
    merged = pj.load_rollouts(whole)
    at_once = pj.collect(toy_walker.system(), KEY, 30, first_row=5, quiet=True)
    for name in ("rows", "k", "p", "q"):
        assert np.array_equal(getattr(merged, name), getattr(at_once, name), equal_nan=True)
    assert merged.law == at_once.law and merged.law.k_law == "uniform" and merged.failed.any()
    assert names(whole)[0] == "meta.json" and len(names(whole)) == 4  # nothing else is left


@pytest.mark.parametrize("n, parts", [(1, 1), (10, 3), (100, 7), (7, 7)])
def test_every_row_is_in_one_part(n, parts):
    rows = range(4, 4 + n)
    cut = [part_of(rows, number, parts) for number in range(1, parts + 1)]
    assert [row for part in cut for row in part] == list(rows)
    assert max(map(len, cut)) - min(map(len, cut)) <= 1 and min(map(len, cut)) > 0
    for number, of in ((0, parts), (parts + 1, parts), (1, n + 1)):
        with pytest.raises(InputError, match="part: expected NUMBER/PARTS"):
            part_of(rows, number, of)


@pytest.mark.parametrize(
    "lost, words", [(0, "rows 5 to 14 are"), (1, "rows 15 to 24 are"), (2, "rows 25 to 34 are")]
)
def test_rows_that_are_missing_are_named(copied, lost, words):
    sorted(copied.glob("rows_*"))[lost].unlink()
    with pytest.raises(InputError, match=f"{words} missing, and which they are may depend"):
        pj.load_rollouts(copied)


def test_rows_that_are_there_twice_are_refused(copied):
    fill(copied, 2, parts=2)
    with pytest.raises(InputError, match=r"rows_000000015_000000024.npz and rows_0.* overlap"):
        pj.load_rollouts(copied)


OTHERS = {
    "key": {"key": jax.random.PRNGKey(1)},
    "law": {"plant": "windy"},
    "program": {"program": "yours"},
    "rows": {"whole": range(5, 36)},
}


@pytest.mark.parametrize("what", OTHERS)
def test_a_job_of_other_work_is_refused_before_it_runs(copied, what):
    before = names(copied)
    with pytest.raises(InputError, match=rf"holds chunks of other work; expected the same.*{what}"):
        fill(copied, 1, **OTHERS[what])
    assert names(copied) == before


@pytest.mark.parametrize("what", ["key", "law"])
def test_a_part_from_elsewhere_is_refused(copied, tmp_path, what):
    fill(tmp_path / "other", 2, **OTHERS[what])
    part = next((tmp_path / "other").glob("rows_*"))
    shutil.copy(part, copied)
    with pytest.raises(InputError, match=f"part of other work; .* the same .*{what}"):
        pj.load_rollouts(copied)


def test_a_part_of_other_code_is_refused(copied, tmp_path, monkeypatch):
    monkeypatch.setattr("walkers.DRIFT", 2.0)
    fill(tmp_path / "other", 2)
    shutil.copy(next((tmp_path / "other").glob("rows_*")), copied)
    with pytest.raises(InputError, match=r"part of other work; .* attribute simulate"):
        pj.load_rollouts(copied)


def test_what_is_no_part_is_refused(copied):
    part = sorted(copied.glob("rows_*"))[0]
    whole = part.read_bytes()
    part.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="truncated or damaged"):
        pj.load_rollouts(copied)
    np.savez(part, k=np.zeros(3))
    with pytest.raises(InputError, match="expected a part that `collect` wrote"):
        pj.load_rollouts(copied)
    for text in ("{", "[]", '{"rows": [3, 1], "format": "parc_jax.parts/1"}', '{"rows": 3}'):
        (copied / "meta.json").write_text(text)
        with pytest.raises(InputError, match=r"its meta\.json says otherwise"):
            pj.load_rollouts(copied)
        with pytest.raises(InputError, match=r"its meta\.json says otherwise"):
            fill(copied, 1)


def test_rows_that_were_taken_out_are_missed(copied):
    part = sorted(copied.glob("rows_*"))[1]
    with np.load(part) as stored:
        arrays = dict(stored)
    kept = np.arange(len(arrays["k"])) != 4  # a run that nobody liked
    arrays = {
        name: x[kept] if len(np.shape(x)) and len(x) == 10 else x for name, x in arrays.items()
    }
    np.savez(part, **arrays)
    with pytest.raises(InputError, match="expected rows 5 to 34 in order"):
        pj.load_rollouts(copied)
