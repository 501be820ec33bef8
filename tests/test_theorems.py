"""Every theorem that is cited can be looked up in docs/theorems.md, and nothing stands there
uncited.

A citation is `[T14]`, `[T1, T2]`, `[T12a]` (part (a) of T12), `[A7]` or a place of a paper such as
`[NP, Thm. 1]`. In Python it stands in comments and strings; elsewhere anywhere.
"""

import io
import json
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "theorems.md"
REFERENCES = ROOT / "docs" / "references.md"
FOLDERS = ("parc_jax", "sims", "benchmarks", "tests", "docs")
ALONE = ("README.md", "pyproject.toml")
KINDS = (".py", ".pyi", ".md", ".ipynb", ".toml")
# Written down before the code that will use them. Whoever cites one takes it out here.
ANNOUNCED = {"T25"}

ITEM = r"[TA]\d{1,2}[a-z]?"
CITATION = re.compile(rf"\[({ITEM}(?:,\s+{ITEM})*)\]")
OF_A_PAPER = re.compile(r"\[((?:NP|PARC|RPM)\b[^\]]*)\]")
BARE = re.compile(rf"(?<![\w.\-]){ITEM}(?!\w)")
HEADING = re.compile(r"^### (?:\[([^\]]+)\]|([TA]\d+)) — \S", re.M)
LINK = re.compile(r"theorems\.md#([\w-]+)")


def text_of(path: Path) -> str:
    """What a reader reads in a file: of Python, comments and strings."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        return "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    if path.suffix not in (".py", ".pyi"):
        return text
    tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    strings = [t.string for t in tokens if t.type == tokenize.STRING]
    comments = [t.string.lstrip("# ") for t in tokens if t.type == tokenize.COMMENT]
    return "\n".join([*strings, *comments])


def sources() -> dict[str, str]:
    """Text of every file that may cite, by its path in the repository."""
    paths = [ROOT / name for name in ALONE]
    for folder in FOLDERS:
        paths += [p for p in sorted((ROOT / folder).rglob("*")) if p.suffix in KINDS]
    skipped = {PAGE, Path(__file__).resolve()}
    made = ROOT / "docs" / "site"
    return {
        str(p.relative_to(ROOT)): text_of(p)
        for p in paths
        if p not in skipped and made not in p.parents
    }


def sections(page: str) -> dict[str, str]:
    """Name of every entry of the page, such as T14 or "NP, Thm. 1", and its text."""
    found = list(HEADING.finditer(page))
    ends = [match.start() for match in found[1:]] + [len(page)]
    names = [match.group(1) or match.group(2) for match in found]
    assert len(set(names)) == len(names), "an entry stands on the page twice"
    return {
        name: page[match.end() : end] for name, match, end in zip(names, found, ends, strict=True)
    }


def cited(text: str) -> Iterator[str]:
    """Names cited in a text: T14, T12a, "NP, Thm. 1"."""
    for match in CITATION.finditer(text):
        yield from re.split(r",\s+", match.group(1))
    for match in OF_A_PAPER.finditer(text):
        yield " ".join(match.group(1).split())


def complaints(page: str, references: str, texts: dict[str, str], announced: set[str]) -> list[str]:
    """Everything that keeps a reader from looking up a citation, or an entry from being needed."""
    entries, out, used = sections(page), [], set()
    papers = set(re.findall(r"\*\*\[(\w+)\]\*\*", references))
    anchors = set(re.findall(r'<a id="([\w-]+)"></a>', page))
    for path, text in texts.items():
        for name in cited(text):
            entry = re.sub(r"(?<=\d)[a-z]$", "", name)
            used.add(entry)
            if entry not in entries and entry not in papers:
                out.append(f"{path} cites [{name}], which is not on the page")
            elif entry != name and f"({name[-1]})" not in entries[entry]:
                out.append(f"{path} cites [{name}], and {entry} has no part ({name[-1]})")
        for match in BARE.finditer(CITATION.sub("", text)):
            out.append(
                f"{path} says {match.group()}: a citation is [T14], [T1, T2], [T12a] or [A7]"
            )
        if "SOUNDNESS" in text:
            out.append(f"{path} names a page that is not here: SOUNDNESS")
        for anchor in set(LINK.findall(text)) - anchors:
            out.append(f"{path} links to #{anchor}, which is not on the page")
    out += [
        f"{name} is on the page and cited nowhere" for name in entries.keys() - used - announced
    ]
    out += [f"{name} is announced, and used: strike it from the list" for name in announced & used]
    out += [f"{name} is announced, and not written" for name in announced - entries.keys()]
    return out


def test_every_citation_leads_to_a_theorem_and_every_theorem_is_cited():
    page, references = PAGE.read_text(encoding="utf-8"), REFERENCES.read_text(encoding="utf-8")
    assert complaints(page, references, sources(), ANNOUNCED) == []


def test_every_theorem_has_a_proof_and_every_entry_an_anchor():
    page = PAGE.read_text(encoding="utf-8")
    for name, text in sections(page).items():
        anchor = re.sub(r"\W+", "-", name.lower()).strip("-")
        assert f'<a id="{anchor}"></a>' in page, f"{name} has no anchor {anchor}"
        if name.startswith("T"):
            assert text.count("**Proof.**") == 1 and "∎" in text, f"{name} has no proof"
