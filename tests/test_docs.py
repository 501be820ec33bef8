"""Everything shown in README and docs runs. Blocks of a page share their names, as a reader would
expect.

A block after the comment `<!-- slow -->` needs minutes: it and the rest of its page run under the
slow marker only.
"""

import functools
import importlib
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from needs import need

import parc_jax

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "benchmarks/neuralparc/README.md",
    *sorted((ROOT / "docs").glob("*.md")),
]
BLOCK = re.compile(r"^(<!-- slow -->\n+)?```python\n(.*?)^```", re.M | re.S)
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
DOORS = ("02_jax_function", "03_python_environment", "04_logged_data", "05_mujoco_model")
# by tests/rollout/test_fmu.py, which makes what it needs; wants stable-baselines3, with PyTorch
ELSEWHERE = {"06_fmu_model", "14_trained_policy"}
POINT_MODEL = ROOT / "tests" / "data" / "drift_4x8.npz"
# the small one that comes along: pages start from it instead of learning one
MODEL = ROOT / "sims" / "drift_parking" / "model.npz"
ARGUMENTS = {"10_replanning": (str(POINT_MODEL), "3")}
HEAVY = {
    "batch.md",
    "claims.md",
    "devices.md",
    "uncertainty.md",
    "no_plan.md",
    "safe_sets.md",
    "your_own_robot.md",
}  # more than a few seconds: under the slow marker as a whole
FIRST = {"README.md", "tutorial.md", "your_own_robot.md"}


def blocks(page: Path) -> list[tuple[str, bool]]:
    """Code and slowness of every block, padded so that tracebacks show the page's own line
    numbers.
    """
    text, found, slow = page.read_text(encoding="utf-8"), [], False
    for match in BLOCK.finditer(text):
        slow |= match.group(1) is not None
        found.append(("\n" * text[: match.start(2)].count("\n") + match.group(2), slow))
    return found


def run(page: Path, with_slow: bool) -> None:
    names = {"__name__": "__docs__"}
    for code, slow in blocks(page):
        if with_slow or not slow:
            exec(compile(code, str(page), "exec"), names)


DEEP = re.compile(r"(?:from|import) parc_jax\.\w+\.\w+")  # a file inside a room


def test_nothing_shown_needs_a_deep_import():
    books = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
    shown = {page.name: "".join(code for code, _ in blocks(page)) for page in PAGES}
    shown |= {path.name: path.read_text(encoding="utf-8") for path in (*books, *EXAMPLES)}
    assert [name for name, code in shown.items() if DEEP.search(code)] == []
    assert DEEP.search("from parc_jax.common.sets.box import box")  # what it looks for
    assert not DEEP.search("from parc_jax.problem import box")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to write in, from which the pages find the test data as from a clone."""
    (tmp_path / "tests").symlink_to(ROOT / "tests", target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


QUICK = [p for p in PAGES if p.name not in HEAVY and any(not slow for _, slow in blocks(p))]
LONG = [p for p in PAGES if p.name in HEAVY or any(slow for _, slow in blocks(p))]


def by_level(pages, level: str):
    """All but the pages that newcomers follow have a level of their own."""
    marks = getattr(pytest.mark, level)
    return [p if p.name in FIRST else pytest.param(p, marks=marks) for p in pages]


@pytest.mark.parametrize("page", by_level(QUICK, "slow"), ids=lambda p: p.name)
def test_blocks_run(page, folder):
    run(page, with_slow=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", by_level(LONG, "night"), ids=lambda p: p.name)
def test_slow_blocks_run(page, folder):
    """Pages that start from the main job's model find a small one of the same robot."""
    target = folder / "runs" / "drift_parking" / "model.npz"
    target.parent.mkdir(parents=True)
    target.symlink_to(MODEL)
    run(page, with_slow=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        p if p.stem == DOORS[0] else pytest.param(p, marks=pytest.mark.night)
        for p in EXAMPLES
        if p.stem not in ELSEWHERE
    ],
    ids=lambda p: p.stem,
)
def test_examples_run(path, folder):
    """In a process of its own, with JAX's own settings, as a stranger runs them."""
    environment = os.environ | {"JAX_PLATFORMS": "cpu"}
    command = [sys.executable, str(path), *ARGUMENTS.get(path.stem, ())]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "(E) " in done.stdout or path.stem not in DOORS


@pytest.mark.parametrize("cycles", ["0", "-3", "1", "x"])
def test_too_few_cycles_are_told_before_anything_is_planned(cycles, monkeypatch):
    path = ROOT / "docs" / "examples" / "10_replanning.py"
    monkeypatch.setattr(sys, "argv", [str(path), str(POINT_MODEL), cycles])
    with pytest.raises(SystemExit, match="CYCLES: expected a whole number >= 2"):
        runpy.run_path(str(path), run_name="__main__")


def test_every_door_has_an_example():
    assert {path.stem for path in EXAMPLES} >= set(DOORS)
    guide = (ROOT / "docs" / "your_own_robot.md").read_text(encoding="utf-8")
    assert all(f"examples/{name}.py" in guide for name in DOORS)


def test_every_example_has_a_number_and_a_line_on_its_page():
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| (\d+) \| \[(\w+)\.py\]\(examples/\2\.py\) \|", page, re.M)
    assert [(str(i), path.stem) for i, path in enumerate(EXAMPLES, 1)] == listed


def command_lines(page: Path) -> list[list[str]]:
    """The arguments of every line of a block that calls parc-jax, without comments and
    redirections.
    """
    text, found = page.read_text(encoding="utf-8"), []
    for block in re.findall(r"^```(?:bash)?\n(.*?)^```|^((?: {4}.*\n)+)", text, re.M | re.S):
        for line in "".join(block).splitlines():
            for call in re.findall(r"(?:^|\s|/)parc-jax (\S.*)", line):
                found.append(
                    re.split(r"\s{2,}|\s#|\s>|\s&&", call)[0]
                    .replace("[", "")
                    .replace("]", "")
                    .split()
                )
    return found


def test_commands_shown_are_commands_that_the_shell_takes(monkeypatch):
    """Every option and argument is parsed as shown; nothing is run."""
    from parc_jax import checker
    from parc_jax.app import cli
    from parc_jax.app.cli import check

    monkeypatch.setattr(checker, "main", lambda arguments: 0)
    monkeypatch.setattr(check, "both", lambda answer, arguments: 0)
    for name, file in cli.COMMANDS.items():
        module = importlib.import_module(f"parc_jax.app.cli.{file}")
        idle = functools.wraps(getattr(module, name))(lambda *given, **options: 0)
        monkeypatch.setattr(module, name, idle)
    calls = [(page.name, call) for page in PAGES for call in command_lines(page)]
    refused = []
    for page, arguments in calls:
        with pytest.raises(SystemExit) as stop:
            cli.main(arguments)
        refused += [f"{page}: parc-jax {' '.join(arguments)}"] if stop.value.code else []
    assert len(calls) > 50 and not refused, "\n".join(refused)


def test_scenes_shown_are_scenes():
    from scene_text import problem_of_text

    import sims.rectangle

    wrong = []
    for page in PAGES:
        points = sims.rectangle.POINTS if page.name == "tutorial.md" else ("tail", "nose")
        for block in re.findall(r"^```toml\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
            try:
                assert problem_of_text(block, page.name, points=points).obstacles, page.name
            except (AssertionError, parc_jax.InputError) as why:
                wrong.append(str(why))
    assert not wrong, "\n".join(wrong)


@functools.cache
def anchors(page: Path) -> set[str]:
    """What can stand behind the # of a link to the page: its headings, and anchors set by hand."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    heads = [
        re.sub(r"\[(.*?)\]\(.*?\)|[`*]", r"\1", h) for h in re.findall(r"^#+ (.*)", text, re.M)
    ]
    slugs = {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", h).strip().lower()) for h in heads}
    by_hand = set(re.findall(r'(?:id=|\{#)"?([\w-]+)', text))
    return by_hand | {slug for slug in slugs if slug.isascii()}


def test_links_inside_the_repository_lead_somewhere():
    lost = []
    for page in PAGES:
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
        for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", text):
            there = page.parent / target if target else page
            page_of_ours = anchor and there.suffix == ".md" and there.is_file()
            known = anchors(there) if page_of_ours else {anchor}
            inside = not target.startswith(("http:", "https:", "mailto:"))
            if inside and not (there.exists() and anchor in known):
                lost.append(f"{page.name} links to {target}#{anchor}")
    assert not lost, "\n".join(lost)


def test_files_named_are_there():
    """From the repository's root, or the package's, or those of the proved checker."""
    proved = ROOT / "parc_jax" / "checker" / "proved"
    homes = (ROOT, ROOT / "parc_jax", proved, proved / "theories", ROOT / "tests" / "checker")
    path = r"`((?:[\w.]+/)+\w+\.(?:py|v|ml)|(?:parc_jax|sims|benchmarks|tests)/[\w./]+)`"
    texts = {page.name: page.read_text("utf-8") for page in PAGES if page.name != "changelog.md"}
    named = [(page, name) for page, text in texts.items() for name in re.findall(path, text)]
    named = [(page, name) for page, name in named if "NAME" not in name]
    lost = [f"{p} names {n}" for p, n in named if not any((home / n).exists() for home in homes)]
    assert not lost, "\n".join(lost)


def test_the_map_has_every_room_and_names_what_is_there():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    made = runpy.run_path(str(ROOT / "docs" / "make_api.py"))
    for room, said in made["rooms"]():
        assert said, f"write the docstring of parc_jax/{room}: first a sentence on what it is for"
    assert page == made["with_rooms"](page), "run: python docs/make_api.py"
    source = "".join(p.read_text(encoding="utf-8") for p in (ROOT / "parc_jax").rglob("*.py"))
    for name in re.findall(r"`((?:[A-Z][a-z]+)+)[`.]|`(ReLUNetwork)`", page.split("## Three")[0]):
        record = "".join(name)
        assert f"class {record}" in source, f"docs/architecture.md names the record {record}"


def test_the_api_page_is_up_to_date():
    made = runpy.run_path(str(ROOT / "docs" / "make_api.py"))["page"]()
    shown = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    assert shown == made, "run: python docs/make_api.py"


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    need("zensical")
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("site"))

    def build():
        command = [
            sys.executable,
            "-m",
            "zensical",
            "build",
            "--strict",
            "-f",
            str(tmp_path / "docs" / "mkdocs.yml"),
        ]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)

    done = build()
    assert done.returncode == 0, done.stdout + done.stderr
    site = tmp_path / "docs" / "site"
    assert (site / "tutorial" / "index.html").exists()
    made = {page: page.read_text(encoding="utf-8") for page in site.rglob("*.html")}
    fetched = r"<(?:script|img|iframe)[^>]*https?:|<link[^>]*(?:stylesheet|preconnect)[^>]*https?:"
    for page, html in made.items():
        assert "©" not in html and "&copy;" not in html, f"{page}: a part (c) became another sign"
        assert not re.search(fetched, html), f"{page} asks another host"
    theorems = made[site / "theorems" / "index.html"]
    assert theorems.count('class="arithmatex"') == theorems.count(r"\(") + theorems.count(r"\[")
    assert theorems.count('class="arithmatex"') > 1000
    (tmp_path / "docs" / "faq.md").write_text("[nowhere](nowhere.md)")
    assert build().returncode != 0


KNOWN = """bar circ cos dots enspace frac hat inf lVert lbrace left ln lvert mathcal mathrm max min
    operatorname qquad rVert rbrace right rvert setminus sin sum sup text tfrac tilde top""".split()


def test_formulas_can_be_set():
    wrong = []
    for page in PAGES:
        text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.S)
        for formula in re.findall(r"\$\$(.+?)\$\$|\$([^$]+)\$", text, flags=re.S):
            tex = "".join(formula)
            known = set(re.findall(r"\\([A-Za-z]+|.)", tex)) <= set(KNOWN)
            if not known or tex.count("{") != tex.count("}"):
                wrong.append(f"{page.name}: {tex}")
        outside = re.sub(r"\$\$.+?\$\$|\$[^$]+\$", "", text, flags=re.S)
        if re.search(r"[_^]\{", outside):
            wrong.append(f"{page.name}: a formula stands outside of $...$")
    assert not wrong, "\n".join(wrong)


def test_every_page_is_in_the_site_and_on_its_first_page():
    docs = ROOT / "docs"
    pages = {page.name for page in docs.glob("*.md")}
    listed = re.findall(r"- (\w+\.md)", (docs / "mkdocs.yml").read_text(encoding="utf-8"))
    linked = re.findall(r"\]\((\w+\.md)\)", (docs / "index.md").read_text(encoding="utf-8"))
    assert pages == set(listed), "list it in docs/mkdocs.yml"
    assert pages == {"index.md", *linked}, "link it in docs/index.md"
