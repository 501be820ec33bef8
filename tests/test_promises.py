"""The table of docs/testing.md is true: each promise stands on its page, has a test that README's
command runs and a campaign of the night, and no promise of the page is without.
"""

import re
from pathlib import Path

from benchmarks.attacks.levels import LEVELS, level_of_test
from benchmarks.nightly import campaigns

ROOT = Path(__file__).resolve().parents[1]
PAGES = {"docs/guarantees.md": "", "README.md": "What is guaranteed"}  # and the section meant
# blocks that promise nothing: where to look, and what is said not to be promised
NOTHING = (
    "Where.",
    "How to run it.",
    "The claim is statistical",
    "Anything outside the model",
    "Not guaranteed:",
    "Optimality.",
    "docs/](docs/) explains",
)


def plain(text: str) -> str:
    """Words alone, without Markdown's marks."""
    return " ".join(re.sub(r"[*`>\[]|^\* ", " ", text).split())


def rows() -> list[tuple[str, str, str]]:
    """(promise, test, campaign) of the table."""
    text = (ROOT / "docs" / "testing.md").read_text(encoding="utf-8")
    _, table = text.split("| promise | test of the first level | campaign |\n|---|---|---|\n")
    cells = [line.strip("| ").split(" | ") for line in table.strip().splitlines()]
    return [(plain(promise), test.strip("`"), name.strip("`")) for promise, test, name in cells]


def blocks(page: str, section: str) -> list[str]:
    """Paragraphs, bullets and rows of tables, without headings, code and lists of pages."""
    text = re.sub(
        r"^```.*?^```\n?", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.S | re.M
    )
    if section:
        text = re.search(rf"^## {section}\n(.*?)(?=^## |\Z)", text, re.S | re.M)[1]
    found = []
    for block in re.split(r"\n\s*\n", text):
        lines = block.strip().splitlines()
        if lines and lines[0].startswith("|"):
            found += [] if "| page |" in lines[0] else lines[2:]
        elif lines and not lines[0].startswith("#"):
            found += re.split(r"\n(?=\* )", block.strip())
    return [plain(block) for block in found]


def unguarded(found: list[str], promises: list[str]) -> list[str]:
    """Blocks that no row speaks of."""
    return [
        block
        for block in found
        if not block.startswith(NOTHING) and not any(promise in block for promise in promises)
    ]


def always_runs(test: str) -> bool:
    try:
        return LEVELS[level_of_test(test)] == "default"
    except (KeyError, OSError):
        return False  # it is not there


def test_every_promise_has_a_row_a_test_that_always_runs_and_a_campaign():
    made = [block for page, section in PAGES.items() for block in blocks(page, section)]
    known = {campaign.name for campaign in campaigns()}
    promises = [promise for promise, _, _ in rows()]
    wrong = [promise for promise in promises if not any(promise in block for block in made)]
    wrong += [test for _, test, _ in rows() if not always_runs(test)]
    wrong += [name for _, _, name in rows() if name not in known] + unguarded(made, promises)
    assert not wrong, "\n".join(wrong)
    assert unguarded(["The moon is a cheese."], promises) == ["The moon is a cheese."]
