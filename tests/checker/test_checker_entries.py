"""Entries shared among processes: the verdict is that of one process, whatever it is."""

import copy
import json

import answer_files as build
import known
import pytest

from parc_jax import checker
from parc_jax.checker import answer as whole


def several():
    """The plain scene with seven samples, a polytope and two corridors."""
    answer = known.plain()
    (sample,) = answer["samples"]
    answer["samples"] = [sample | {"p0": [f"{i}/100", "0"]} for i in range(7)]
    answer["corridors"] = [sample, sample | {"sep": [[[[1, known.TOP], [2, known.TOP]]]]}]
    return build.rehash(answer)


def verdict(answer, processes):
    """The report, or why not."""
    try:
        return checker.check_answer(answer, processes)
    except checker.Rejected as why:
        return str(why)


@pytest.mark.slow
@pytest.mark.parametrize("processes", [2, 3, 40])
def test_several_processes_report_what_one_does(processes):
    report = verdict(several(), 1)
    assert (report.samples, report.sets, report.corridors) == (7, 1, 2)
    assert verdict(several(), processes) == report


@pytest.mark.slow
@pytest.mark.parametrize(
    "bad",
    [[("samples", 4)], [("samples", 6), ("samples", 3)], [("corridors", 1), ("sets", 0)]],
    ids=str,
)
def test_the_first_rejected_entry_is_told(bad):
    """The last entry of one process and the first of another may both be bad."""
    answer = several()
    for part, i in bad:
        entry = copy.deepcopy(answer[part][i])
        answer[part][i] = entry | {"p0": ["9", "9"]}
    said = verdict(answer, 1)
    part, i = min(bad, key=lambda place: (["samples", "sets", "corridors"].index(place[0]), place))
    assert said.startswith(f"{part}[{i}]: ")
    assert verdict(answer, 2) == verdict(answer, 3) == said


def test_what_is_known_of_a_problem_is_not_known_of_another():
    answer = known.plain()
    context = checker.Context(*(answer[part] for part in checker.PARTS))
    context.check_sample(answer["samples"][0])
    higher = context.about(known.plain(((0.5, -3), (1.5, 0)))["problem"])
    with pytest.raises(checker.Rejected, match="obstacle 0"):
        higher.check_sample(answer["samples"][0])
    context.check_sample(answer["samples"][0])


def test_processes_share_one_allowance(monkeypatch):
    """Half of what all entries need is enough for each of two processes, and not for both."""
    context = checker.Context(*(several()[part] for part in checker.PARTS))
    context.work_left = 10**9
    for entry in several()["samples"]:
        context.check_sample(entry)
    spent = 10**9 - context.work_left
    answer = build.rehash(several() | {"sets": [], "corridors": []})
    monkeypatch.setattr(whole, "WORK_PER_CHARACTER", 0)
    for allowed, accepted in ((spent, True), (spent - 1, False)):
        monkeypatch.setattr(whole, "WORK_AT_LEAST", allowed)
        for processes in (1, 2):
            said = verdict(answer, processes)
            assert (type(said) is checker.Report) is accepted
            assert accepted or "more work than the size of the file allows" in said


@pytest.mark.parametrize("n", ["0", "-1", "61", "two", "1.5"])
def test_a_wrong_number_of_processes_ends_with_the_usage(n, capsys):
    assert checker.main(["answer.json", "--processes", n]) == 2
    assert "--processes" in capsys.readouterr().err


def test_the_program_takes_a_number_of_processes(tmp_path, capsys):
    path = tmp_path / "answer.json"
    path.write_text(json.dumps(several()))
    said = []
    for more in ([], ["--processes", "2"]):
        assert checker.main([str(path), *more]) == 0
        said.append(capsys.readouterr().out)
    assert said[0] == said[1] and "7 samples" in said[0]
