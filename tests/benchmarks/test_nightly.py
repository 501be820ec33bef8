"""The night goes on where it was, says what failed, and never calls a stopped campaign finished."""

import subprocess
import sys

import pytest

from benchmarks import nightly
from benchmarks.nightly import Campaign, Options, campaigns, last_line, run


@pytest.fixture
def night(tmp_path, monkeypatch):
    """A repository of its own with one file of code; a campaign counts its runs in a file."""
    for command in (["init", "-q"], ["config", "user.email", "a@b"], ["config", "user.name", "a"]):
        subprocess.run(["git", *command], cwd=tmp_path, check=True)
    (tmp_path / "tests").mkdir()
    for name in ("good", "bad"):
        commit(tmp_path, name, "one")
    monkeypatch.setattr(nightly, "ROOT", tmp_path)
    return tmp_path


def commit(folder, name, text):
    (folder / "tests" / f"{name}.py").write_text(text)
    subprocess.run(["git", "add", "tests"], cwd=folder, check=True)
    subprocess.run(["git", "commit", "-qm", text], cwd=folder, check=True)


def counting(folder, name, code):
    """A campaign that adds a line to a file of its name and ends with an exit code."""
    file = folder / f"{name}.count"
    script = (
        f"open({str(file)!r}, 'a').write('x'); print('said', {name!r}); raise SystemExit({code})"
    )
    return Campaign(name, "counts", (sys.executable, "-c", script), (f"tests/{name}.py",)), file


def test_what_is_finished_is_not_run_again_and_what_failed_is(night):
    good, of_good = counting(night, "good", 0)
    bad, of_bad = counting(night, "bad", 3)
    page = night / "nightly.md"
    options = Options(folder=night / "kept", jobs=1)
    for n in (1, 2):
        assert run(options, [good, bad], page) == 1
        assert of_good.read_text() == "x" and of_bad.read_text() == "x" * n
    assert "**Counts**" in page.read_text() and "| `good` | said good |" in page.read_text()
    assert "where this was written: no line." in page.read_text()
    assert "campaigns at a time in the last night: 1. " in page.read_text()
    assert "**failed**: said bad" in page.read_text() and "Failed: bad." in page.read_text()
    assert run(Options(folder=night / "kept", again=True), [good], page) == 0
    assert of_good.read_text() == "xx"
    commit(night, "bad", "two")  # not what it reads
    assert run(options, [good], page) == 0 and of_good.read_text() == "xx"
    commit(night, "good", "two")
    assert run(options, [good], page) == 0
    assert of_good.read_text() == "xxx" and "None failed." in page.read_text()
    assert "Still to be run" not in page.read_text()
    other, _ = counting(night, "other", 0)
    assert run(Options(only=("good",), folder=night / "kept"), [good, bad, other], page) == 0
    # the last that is known of what was not asked for, with its own commit
    assert "Still to be run: 1 of 3 campaigns. Failed: bad." in page.read_text()
    assert "where this was written: bad." in page.read_text()  # it has changed since


def test_code_that_is_not_committed_has_no_results(night):
    (night / "tests" / "good.py").write_text("changed")
    with pytest.raises(SystemExit, match="expected committed code"):
        run(Options(folder=night / "kept"), [], night / "nightly.md")


def test_the_line_of_result_is_what_says_most():
    text = "....\n= 3 passed, 1 failed in 2.0s =\nprograms 12\n"
    assert last_line(text, 1) == "3 passed, 1 failed in 2.0s"
    assert last_line("a\n20 of 20 faults noticed\n\n", 0) == "20 of 20 faults noticed"
    assert last_line("", 9) == "nothing, exit code 9"


def test_every_campaign_has_a_name_of_its_own_and_every_test_file_is_in_one():
    known = campaigns()
    names = [campaign.name for campaign in known]
    assert len(set(names)) == len(names)
    asked = {word for campaign in known for word in campaign.command}
    files = {str(p.relative_to(nightly.ROOT)) for p in nightly.ROOT.glob("tests/**/test_*.py")}
    assert {f for f in files - asked if not f.startswith("tests/sims/foreign/")} == set()


def test_a_campaign_is_asked_again_where_a_file_that_it_reads_has_changed():
    by_name = {campaign.name: campaign for campaign in campaigns()}
    assert {"parc_jax", "tests/helpers", "tests/lp/test_solve.py"} <= set(by_name["tests-lp"].reads)
    assert (
        "tests" in by_name["faults-checker"].reads
        and "tests/sims/foreign" in by_name["foreign"].reads
    )
    assert {"parc_jax/common/premises.py"} <= set(by_name["mutations-premises"].reads)
    whole = (campaign for name, campaign in by_name.items() if not name.startswith("mutations"))
    assert all(set(nightly.CODE) <= set(campaign.reads) for campaign in whole)
