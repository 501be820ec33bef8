"""The proved checker in the page: the page carries it and the whole answer, and says its
verdict.
"""

import html
import json
import re
import subprocess

import driven_browser
import pytest
from needs import need
from toy_file import save, toy_file

from parc_jax import checker
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot import page as page_file
from parc_jax.app.plot.page import FILES, write_page
from parc_jax.checker.proved import PROVED_JS
from parc_jax.proof.certificate.write import part_hash


def block(page: str, name: str) -> str:
    """The content of one script of a page."""
    return re.search(rf'<script id="{name}"[^>]*>(.*?)</script>', page, re.S).group(1)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    loaded = load_answer(save(folder / "answer.json", toy_file()))
    return write_page(loaded, folder / "page.html")


def tampered(page: str) -> str:
    """With its first sample moved to where it misses the goal."""
    answer = json.loads(block(page, "answer"))
    old = json.dumps(answer["samples"][0], separators=(",", ":"))
    answer["samples"][0]["k"][0] = "0.5"
    new = json.dumps(answer["samples"][0], separators=(",", ":"))
    assert page.count(old) == 1
    return page.replace(old, new)


def test_the_page_carries_the_whole_answer_and_the_program(page, tmp_path):
    text = page.read_text()
    answer = json.loads(block(text, "answer"))
    whole = toy_file()
    for part in ("problem", "network", "tube", "hash", "claim", "samples"):
        assert answer[part] == whole[part]
    (tmp_path / "answer.json").write_text(block(text, "answer"))
    report = checker.check_answer(checker.load(tmp_path / "answer.json"))
    assert (report.samples, report.sets, report.corridors) == (2, 0, 1)
    assert "</script" not in block(text, "answer")  # the name of this system has one
    program = PROVED_JS.read_text()
    assert block(text, "proved").strip() == program.replace("</script", "<\\/script").strip()
    assert "<!--" not in program and "<script" not in program
    assert text.count("<script") == text.count("</script>") == 4


def test_no_part_is_taken_for_another(page, tmp_path):
    system = "/*ANSWER*/ /*PROVED*/ \\1"
    loaded = load_answer(save(tmp_path / "answer.json", toy_file(system)))
    text = write_page(loaded, tmp_path / "page.html").read_text()
    assert json.loads(block(text, "data"))["system"] == system
    assert json.loads(block(text, "answer"))["claim"]["subject"]["system"] == system


def test_too_large_an_answer_stays_out(page, monkeypatch):
    loaded = load_answer(save(page.with_name("large.json"), toy_file()))
    monkeypatch.setattr(page_file, "MAX_ANSWER", 5_000)
    text = write_page(loaded, page.with_name("large.html")).read_text()
    assert block(text, "answer") == "" and re.search(r'id="answer".*data-bytes="\d{4,}"', text)


@pytest.mark.needs("node")
@pytest.mark.parametrize("tamper", [False, True])
def test_what_the_worker_says(page, tmp_path, tamper):
    """The worker's text under node, with the messages that it would post."""
    text = tampered(page.read_text()) if tamper else page.read_text()
    worker = re.search(r"const WORKER = `(.*?)`;", (FILES / "proof.js").read_text(), re.S).group(1)
    (tmp_path / "answer.json").write_text(block(text, "answer"))
    (tmp_path / "worker.js").write_text(
        "globalThis.postMessage = (news) => console.log(JSON.stringify(news));\n"
        + block(text, "proved")
        + worker
        + '\nonmessage({ data: require("fs").readFileSync(process.argv[2], "utf8") });\n'
    )
    command = ["node", tmp_path / "worker.js", tmp_path / "answer.json"]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    *progress, last = map(json.loads, out.splitlines())
    assert last["entries"] == 3 and last["verdict"]["code"] == int(tamper)
    last_of_kind = {news["kind"]: news["done"] for news in progress}
    assert last_of_kind == {"samples": 2, "corridors": 1}
    said = last["verdict"]["lines"][0]
    assert said.startswith("REJECTED: 1 entries" if tamper else "ACCEPTED. Proved by a checker")


def driven(page):
    need("chromium")
    return driven_browser.Browser(driven_browser.found(), page)


PRESS = "document.getElementById('prove').click()"
SAID = "document.getElementById('second')"


@pytest.mark.night
def test_the_button_in_a_browser(page, tmp_path):
    """From a file, without network: accepted, tampered with, and about another problem."""
    text = page.read_text()
    (tmp_path / "page.html").write_text(text)
    with driven(tmp_path / "page.html") as browser:
        assert browser.run("document.getElementById('first').textContent").startswith("accepted")
        assert browser.run(f"{SAID}.textContent") == "not asked yet"
        browser.run(PRESS)
        browser.wait(f"{SAID}.dataset.code")
        seen = browser.run(f"[{SAID}.className, {SAID}.textContent, {SAID}.dataset.code]")
        assert seen[0] == "proved" and seen[1].startswith("accepted all of it (3 entries in ")
        assert "2 samples (p0, k): the goal is reached" in browser.run("document.body.innerText")

        # the same page with another answer in it
        bad = json.dumps(block(tampered(text), "answer"))
        browser.run(f"document.getElementById('answer').textContent = {bad}; {PRESS}")
        browser.wait(f"{SAID}.dataset.code")
        seen = browser.run(f"[{SAID}.className, {SAID}.textContent, {SAID}.dataset.code]")
        assert seen[0] == "unsafe" and seen[1].startswith("rejected") and seen[2] == "1"
        assert "REJECTED: 1 entries" in browser.run("document.getElementById('said').textContent")

        # an answer that holds, but not the one that is drawn
        answer = toy_file()
        for widths in answer["tube"]["final"]:
            widths[:] = ["0"] * len(widths)
        answer["hash"]["tube"] = answer["claim"]["tube_hash"] = part_hash(answer["tube"])
        answer["hash"]["claim"] = part_hash(answer["claim"])
        other = json.dumps(json.dumps(answer))
        browser.run(f"document.getElementById('answer').textContent = {other}; {PRESS}")
        browser.wait(f"{SAID}.dataset.code")
        assert browser.run(f"{SAID}.textContent").startswith("no verdict: what it read is not")

        # a program that does not run
        browser.run(f"document.getElementById('proved').textContent = 'no program'; {PRESS}")
        browser.wait(f"{SAID}.textContent.startsWith('no verdict: it could not run')")
        assert browser.run(f"[{SAID}.className, {SAID}.dataset.code || null]") == ["unsafe", None]


@pytest.mark.night
def test_a_part_that_it_cannot_look_at_is_never_accepted_bare(tmp_path):
    """The verdict with code 3, and a page without the answer."""
    text = write_page(
        load_answer(save(tmp_path / "answer.json", toy_file())), tmp_path / "page.html"
    ).read_text()
    with driven(tmp_path / "page.html") as browser:
        lines = (
            "['problem', 'network', 'tube'].map((part) => `  sha256 ${part} ${data.hash[part]}`)"
        )
        browser.run(f"judge({{ verdict: {{ code: 3, lines: {lines} }}, entries: 5, ms: 1 }})")
        assert browser.run(f"{SAID}.className") == "safe"
        assert "not all" in browser.run(f"{SAID}.textContent")
        browser.run(f"judge({{ verdict: {{ code: 4, lines: {lines} }}, entries: 5, ms: 1 }})")
        assert browser.run(f"{SAID}.className") == "unsafe"
    bare = text.replace(block(text, "answer"), "")
    (tmp_path / "bare.html").write_text(bare)
    with driven(tmp_path / "bare.html") as browser:
        assert browser.run("document.getElementById('prove').disabled")
        said = html.unescape(browser.run(f"{SAID}.textContent"))
        assert said.startswith("not here: the answer has 0 MB")
