"""The theorem about the header's code (drive/onboard/proved), and what Eva finds in that code.

Needs coqc with Flocq (Debian: coq, libcoq-flocq), and Frama-C (frama-c-base) for the memory.
"""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from toy_header import TUBES, toy_tables, write_toy

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "parc_jax" / "drive" / "onboard" / "proved"
THEORIES = SOURCE / "theories"
PAGE = ROOT / "docs" / "onboard.md"
REALS = {  # the axioms of Coq's real numbers, and that a proposition holds or does not
    "ClassicalDedekindReals.sig_forall_dec",
    "ClassicalDedekindReals.sig_not_dec",
    "FunctionalExtensionality.functional_extensionality_dep",
    "Classical_Prop.classic",
}
WEAKER = {  # what the theorem would be of, were it of another code or of margins that do not pay
    "one knot of an interval": ("Header.v", " /\\ less F least finish = true", ""),
    "no tube": ("Header.v", "sum F (run_support T run) lost least", "least = run_support T run"),
    "borders of bins": (
        "Header.v",
        "if (0 <? along)%nat && at_most F x (e along) then None else Some along",
        "Some along",
    ),
    "starts anywhere": ("Header.v", "at_most F (p0 c) (far T c) = true)", "True)"),
    "a row without its rounding": (
        "Sound.v",
        "norm * off_ + lost_by (S n) (2 * n) (norm * size_) <= room * norm",
        "norm * off_ <= room * norm",
    ),
    "a direction without its support's": ("Sound.v", "+ Rabs support + least", "+ least"),
    "numbers of a tube that cancel": ("Sound.v", "+ norm * excess in", "in"),
    "rounding of a tube": ("Sound.v", "+ g * ((1 + 2 * g) * (rest + least))", ""),
    "faces about zero": ("Tube.v", "- value F (centre B j) * across w B j).", "+ 0)."),
    "faces as steep as may be": (
        "Tube.v",
        "Rabs (value F (dual B j c)) <= steep)",
        "True)",
    ),
    "half of a slanted face that cancels": (
        "Tube.v",
        "\\/ along_an_axis (dual B j)))",
        "\\/ True))",
    ),
    "an error of one basis": (
        "Header.v",
        "forall b, (b < n_bases T)%nat ->\n  between_faces (n_p T) (errors T bin t point b) e.",
        "between_faces (n_p T) (errors T bin t point 0) e.",
    ),
    "nothing said of overflow": ("Sound.v", "0 <= most /\\ sized <= largest", "0 <= most /\\ True"),
    "a network that is off": ("Network.v", "off_after L off size i <= beta", "True"),
}
DRIVE = """#include "toy.h"
volatile double any;  /* every double: infinite, NaN */
int main(void)
{
    double p0[toy_N_P], k[toy_N_K], plan[toy_N_K];
    for (int c = 0; c < toy_N_P; ++c)
        p0[c] = any;
    for (int j = 0; j < toy_N_K; ++j)
        k[j] = plan[j] = any;
    return toy_is_safe(p0, k) + toy_nearest_plan(p0, k, plan);
}
"""
EVA = (
    *("frama-c", "-eva", "-eva-precision", "3", "-eva-slevel", "200", "-eva-no-show-progress"),
    *("-eva-auto-loop-unroll", "400", "-warn-special-float", "none", "-eva-no-print"),
    *("-machdep", "gcc_x86_64"),
)


def copied(folder: Path) -> Path:
    made_here = shutil.ignore_patterns("*.vo*", "*.glob", ".*", "Makefile.coq*")
    return Path(shutil.copytree(SOURCE, folder, ignore=made_here))


def made(folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run(["make"], cwd=folder, capture_output=True, text=True)


@pytest.mark.slow
@pytest.mark.needs("flocq")
def test_the_theorem_is_proved_and_rests_on_the_reals_alone(tmp_path):
    done = made(copied(tmp_path / "proved"))
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    told = done.stdout
    assert told.count("Axioms:") == 6
    assert set(re.findall(r"^([A-Z]\w+\.\w+)\s*:", told, re.M)) <= REALS
    written = "".join(p.read_text() for p in THEORIES.glob("*.v"))
    assert not re.search(r"\b(Admitted|admit|Axiom|Axioms|Parameter|Conjecture)\b", written)


@pytest.mark.night
@pytest.mark.needs("flocq")
@pytest.mark.parametrize("weaker", list(WEAKER))
def test_of_other_code_and_other_margins_it_is_not(weaker, tmp_path):
    name, old, new = WEAKER[weaker]
    folder = copied(tmp_path / "proved")
    theory = folder / "theories" / name
    text = theory.read_text()
    assert text.count(old) == 1
    theory.write_text(text.replace(old, new))
    done = made(folder)
    assert done.returncode != 0
    assert re.search(r'File "./theories/(Bins|Header|Network|Sound|Tube).v"', done.stderr)


def test_the_page_quotes_the_theorem():
    theorem = re.search(
        r"Check \(safe_is_kept.*?\)\.\n", (THEORIES / "Statements.v").read_text(), re.S
    )
    assert theorem[0] in PAGE.read_text()


def test_every_theory_is_among_those_proved():
    listed = re.findall(r"^theories/(\w+\.v)$", (SOURCE / "_CoqProject").read_text(), re.M)
    assert sorted(listed) == sorted(p.name for p in THEORIES.glob("*.v"))


@pytest.mark.night
@pytest.mark.needs("eva")
@pytest.mark.parametrize(
    ("tube", "old", "new"),
    [
        *((tube, "", "") for tube in TUBES),  # as it is
        ("boxes", "t < NAME_run_end[run]; ++t", "t <= NAME_run_end[run]; ++t"),
        (
            "boxes",
            "path[(NAME_N_STEPS + 1) * NAME_N_C + NAME_N_Q]",
            "path[NAME_N_STEPS * NAME_N_C]",
        ),
        ("boxes", "int along = 0;", "int along;"),
        ("faces", "basis < NAME_N_BASES; ++basis", "basis <= NAME_N_BASES; ++basis"),
    ],
)
def test_no_input_makes_the_code_read_or_write_elsewhere(tube, old, new, tmp_path):
    """Eva looks at every input at once. What is broken on purpose it notices."""
    path = write_toy(toy_tables(tube), tmp_path / "toy.h")
    old, new = (text.replace("NAME", "toy") for text in (old, new))
    text = path.read_text()
    if old:
        assert text.count(old) == 1
        path.write_text(text.replace(old, new))
    drive = tmp_path / "drive.c"
    drive.write_text(DRIVE)
    done = subprocess.run([*EVA, str(drive)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:]
    assert ("\n  0 alarms generated" in done.stdout) == (not old), done.stdout[-2000:]
    assert old or "11 functions analyzed (out of 11): 100% coverage" in done.stdout
