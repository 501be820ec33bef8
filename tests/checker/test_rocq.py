"""The checker that is itself proved (parc_jax/checker/proved): its proofs, what they rest on, and
that it says the same as the Python one.

Needs coqc, ocamlfind and zarith (Debian: coq, ocaml-findlib, libzarith-ocaml-dev). Without them
everything here but the length of the specification is skipped.
"""

import hashlib
import json
import math
import random
import re
import shlex
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import answer_files as build
import jax
import known
import known_points
import numpy as np
import pytest
from toy_bodies import points_model, points_problem

from parc_jax import checker
from parc_jax.checker.proved import PROVED_JS
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.settings import Settings

sys.path.insert(0, str(Path(__file__).parent / "compare"))

import kernel
import two
from campaign import campaign

SOURCE = PROVED_JS.parent
COMPARE = Path(__file__).parent / "compare"
THEORIES = SOURCE / "theories"
DOCS = Path(__file__).parents[2] / "docs"
# What the engine wrote for helpers/toy_models.py's case 4, some entries of each kind: a random
# network, a disc, two obstacles, two bins.
ENGINE = COMPARE / "engine_answer.json"
# Some entries of an answer of the drone study: space, nine points, two layers of eight.
ENGINE_POINTS = COMPARE / "engine_points.json"
VALID = known.VALID | known_points.VALID
BAD = known.CASES | known_points.CASES
# of Spec.v, ClaimSpec.v, Episode.v, Json.v, Format.v and Statements.v: as they are, and as the
# maintainers last read them (then without Episode.v, Json.v and Format.v)
STATED = "4ca64800f31ff037a82b81bddef3f327be5b0e43d1c648ad449042c27ef0f4fc"
REVIEWED = "4184df609b3a8bdd7badbccedfb28cb6b508869c5b5571a91dba32fc59090cb1"
REALS = {  # the axioms of Coq's real numbers, and nothing else
    "ClassicalDedekindReals.sig_forall_dec",
    "FunctionalExtensionality.functional_extensionality_dep",
}
LIBRARY = REALS | {  # the same files of the library state these too; no theorem here uses them
    "ClassicalDedekindReals.sig_not_dec",
    "Classical_Prop.classic",
}
MADE = shutil.ignore_patterns(*(SOURCE / ".gitignore").read_text().split())
ON_NODE = ["node", SOURCE / "js" / "run.js"]
needs_coq = pytest.mark.needs("coq")


def run(command, folder, code=0):
    done = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True)
    assert done.returncode == code, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A copy of the sources, with all proofs and the program made anew."""
    folder = tmp_path_factory.mktemp("proved") / "proved"
    shutil.copytree(SOURCE, folder, ignore=MADE)
    run(["make"], folder)
    return folder


def test_the_specification_is_short():
    lines = (THEORIES / "Spec.v").read_text().splitlines()
    assert len(lines) <= 165
    for path in THEORIES.glob("*.v"):
        assert max(map(len, path.read_text().splitlines())) <= 100, path.name


@pytest.mark.parametrize("name, least", [("guarantees", 1), ("proved_checker", 3)])
def test_the_pages_quote_the_specification(name, least):
    page = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    quoted = re.findall(r"^Definition .*?(?=\n\n|\n```)", page, re.MULTILINE | re.DOTALL)
    assert len(quoted) >= least
    assert not [q for q in quoted if q not in (THEORIES / "Spec.v").read_text(encoding="utf-8")]


def proved(kinds, text):
    """Names of what a Coq file states in these ways."""
    return set(re.findall(rf"^(?:{kinds}) (\w+)", text, re.MULTILINE))


def test_what_is_proved_is_what_was_read():
    """Who changes a definition of Spec.v or ClaimSpec.v, or a statement, says on the page that they
    are to be read again; who has read them says when.
    """
    names = ("Spec", "ClaimSpec", "Episode", "Json", "Format", "Statements")
    texts = [(THEORIES / f"{name}.v").read_bytes() for name in names]
    assert hashlib.sha256(b"".join(texts)).hexdigest() == STATED
    page = (DOCS / "proved_checker.md").read_text(encoding="utf-8")
    assert re.search(rf"`{REVIEWED}`, read by the maintainers on \d{{4}}-\d\d-\d\d", page)
    assert (f"`{STATED}`, to be read again by a maintainer" in page) == (STATED != REVIEWED)


def test_every_theorem_that_the_pages_name_is_stated_in_full():
    texts = {path.name: path.read_text() for path in THEORIES.glob("*.v")}
    stated = proved(r"Theorem|Definition(?= \w+ : forall)", texts["Statements.v"])
    named = set()
    for page in ("proved_checker", "certificates", "guarantees", "theorems", "no_plan"):
        named |= set(re.findall(r"`(\w+)`", (DOCS / f"{page}.md").read_text(encoding="utf-8")))
    assert named & proved("Theorem|Corollary", "\n".join(texts.values())) <= stated
    assert len(stated) >= 14 and stated == proved("Print Assumptions", texts["Assumptions.v"])


NOWHERE = "Admitted|admit|Axioms?|Parameters?|Conjectures?|bypass_check|give_up|Declare ML Module"
NOWHERE += r"|Unset\s+(?:Guard|Positivity|Universe)\s+Checking|Set\s+Type\s+In\s+Type"
# in a section these become what a theorem asks for, elsewhere they are axioms
IN_SECTIONS = "Hypothesis|Hypotheses|Variables?|Context"


def on_trust(text):
    """What a Coq file takes on trust."""
    text, depth = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL), 0
    found = re.findall(rf"\b(?:{NOWHERE})\b", text)
    for word in re.findall(rf"^\s*(Section|End|{IN_SECTIONS})\b", text, re.MULTILINE):
        depth += {"Section": 1, "End": -1}.get(word, 0)
        found += [word] * (depth == 0 and word not in ("Section", "End"))
    return found


def test_nothing_is_admitted():
    for path in THEORIES.glob("*.v"):
        assert not on_trust(path.read_text()), path.name
    proof = "Section S.\nHypothesis H : False.\nLemma l : False. Proof. exact H. Qed.\nEnd S.\n"
    assert not on_trust(proof)
    for planted in (
        "Hypothesis H : False.",
        "  Variable H : False.",
        "Context (H : False).",
        "Axioms H G : False.",
        "Parameters H G : False.",
        "Unset Guard Checking.",
        "#[bypass_check(guard)] Fixpoint f (n : nat) : False := f n.",
        "Lemma l : False. Admitted.",
    ):
        assert on_trust(proof + planted), planted


@pytest.mark.night
@needs_coq
def test_the_theorems_rest_on_the_axioms_of_the_reals_only(built):
    out = run(["make", "-s", "assumptions"], built)
    blocks = out.split("Axioms:\n")[1:]
    asked = proved("Print Assumptions", (THEORIES / "Assumptions.v").read_text())
    assert len(blocks) + out.count("Closed under the global context") == len(asked)
    for block in blocks:
        assert set(re.findall(r"^([A-Za-z_.]+)$", block, flags=re.MULTILINE)) == REALS


@pytest.mark.night
@needs_coq
def test_coqs_small_checker_agrees(built):
    out = run(["sh", "-c", "make -s coqchk 2>&1"], built)
    axioms = out.split("* Axioms:")[1].split("* Constants")[0].split()
    assert {".".join(name.split(".")[-2:]) for name in axioms} <= LIBRARY
    assert out.count("<none>") == 3  # nothing was taken on trust: types, fixpoints, positivity


def test_every_seed_fits_the_proofs():
    """What seeded.sh changes is there, so that no seed is left out unseen."""
    lines = (COMPARE / "seeded.sh").read_text().splitlines()
    seeds = [shlex.split(line)[3:5] for line in lines if line.startswith("try ")]
    assert len(seeds) > 60
    for name, old in seeds:
        pattern = r"\s+".join(map(re.escape, old.split()))
        assert re.search(pattern, (THEORIES / name).read_text()), old


@pytest.mark.night
@needs_coq
def test_unsound_checkers_break_a_proof(built):
    """The first few, and a harmless change; the script alone tries all."""
    out = run(["bash", COMPARE / "seeded.sh", "3", built], built)
    assert out.count("as it must") == 4 and "WRONG" not in out


@pytest.mark.parametrize(
    "name", ["claims", "readers", pytest.param("mutants", marks=pytest.mark.slow)]
)
def test_a_checker_that_accepts_everything_is_noticed(tmp_path, name):
    program = tmp_path / "program"
    accepted = json.dumps({"code": 0, "lines": ["ACCEPTED."], "entries": {}})
    program.write_text(f"#!/bin/sh\nshift\nfor file; do echo '{accepted}'; done\n")
    program.chmod(0o755)
    assert campaign(name, [program], 20).different


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize(
    ("name", "count", "least", "most"),
    [
        ("mutants", 3000, 0.2, 0.8),
        ("bodies", 500, 0.1, 0.8),
        ("no_plan", 300, 0.2, 0.8),
        ("claims", 500, 0.15, 0.9),
        ("readers", 1500, 0.05, 0.5),
        ("terms", 3000, 0.5, 0.9),
        ("episodes", 1000, 0.3, 0.8),
    ],
)
def test_both_checkers_say_the_same(built, name, count, least, most):
    """Of what the file of the campaign tells; neither nearly all nor nearly nothing is accepted."""
    found = campaign(name, [built / "check"], count)
    assert found.different == []
    assert found.seen >= count and least * found.seen < found.accepted < most * found.seen


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize(
    ("name", "path", "count"),
    [("mutants", ENGINE, 300), ("changed_bytes", ENGINE, 300), ("borders", ENGINE, 1)],
)
def test_both_checkers_say_the_same_of_an_answer_of_the_engine(built, name, path, count):
    """Of points of polytopes on borders between bins that each is a sample, and on no face that
    bins share.
    """
    found = campaign(name, [built / "check"], count, valid=json.loads(path.read_text()))
    assert found.different == [] and found.accepted > 10 and found.seen >= count


@pytest.mark.night
@needs_coq
@pytest.mark.needs("node")
@pytest.mark.parametrize(("name", "count"), [("readers", 300), ("claims", 100), ("episodes", 200)])
def test_the_javascript_program_says_the_same_as_the_python_checker(built, name, count):
    found = campaign(name, [*ON_NODE, PROVED_JS], count)
    assert found.different == [] and 0.05 * count < found.accepted < 0.9 * count


@pytest.mark.night
@needs_coq
def test_bad_files_are_refused(built):
    """Every bad file of the Python checker's tests, but for its limits, and for one that is bad to
    coarser roots alone: its room is enough, by less than 2^-80.
    """
    bad = {why: make() for why, (make, limits) in BAD.items() if not limits}
    assert bad.pop("touching by less than the rounding of a root")
    assert len(bad) > 190
    said = two.proved_verdicts([built / "check"], bad.values())
    for why, verdict in zip(bad, said, strict=True):
        assert verdict["code"] == 1, why


def said(built, folder, answer, code=0):
    """What the program says of an answer."""
    path = folder / "answer.json"
    path.write_text(json.dumps(answer))
    return run([built / "check", path], built, code)


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize("name", VALID)
def test_valid_answers_are_accepted(built, tmp_path, name):
    answer = build.rehash(VALID[name]())
    out = said(built, tmp_path, answer)
    assert out.startswith("ACCEPTED.")
    plan = checker.check_answer(answer).no_plan
    if plan is not None and plan["kind"] == "proved":
        assert "no (p0, k) of the domain is safe" in out
    elif plan is not None:
        whole = sum(Fraction(plan[part]) for part in ("safe", "unsafe", "undecided"))
        for part in ("safe", "unsafe"):
            share = math.floor(100_000 * Fraction(plan[part]) / whole)
            assert f"{part} at least {share // 1000}.{share % 1000:03} %" in out
    run([built / "check", tmp_path / "absent.json"], built, code=2)


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize(
    ("depth", "second", "code"),
    [("1/100", "0.25", 0), ("1/100", "0", 0), ("1/1000", "0.25", 0), ("1/1000", "0", 1)],
)
def test_a_contact_at_a_knot_fits_both_intervals_or_is_inside(built, tmp_path, depth, second, code):
    answer = known.at_a_knot(Fraction(depth), second)
    said(built, tmp_path, answer, code)
    assert (two.rejected(checker.check_answer, answer) is None) == (code == 0)


def costly(neurons):
    """A proof over a square of k that many neurons of one layer cut."""
    rng = random.Random(0)
    weights = [[str(rng.randint(-999, 999)) for _ in range(2)] for _ in range(neurons)]
    answer = known.line()
    answer["problem"] |= {"n_k": 2, "domain": {"lo": ["-1"] * 2, "hi": ["1"] * 2}}
    answer["tube"]["edges"] = [["-1", "1"]] * 2
    biases = [str(rng.randint(-99, 99)) for _ in weights]
    answer["network"] = {"weights": [weights, [["1"] * neurons]], "biases": [biases, ["0"]]}
    return build.rehash(known.with_plan(answer, "bracket", ["-9"], ["9"], {"safe": []}))


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize(
    ("neurons", "text", "blanks"), [(400, "", 0), (140, "", 10**6), (140, "x" * 10**6, 0)]
)
def test_a_short_file_cannot_ask_for_long_work(built, tmp_path, neurons, text, blanks):
    """Nor one that is long by what is not checked: of 140 neurons, for two megabytes it would be
    done.
    """
    answer = costly(neurons)
    assert len(json.dumps(answer)) < 20_000
    path = tmp_path / "answer.json"
    path.write_text(json.dumps(answer | {"meta": text}) + " " * blanks)
    out = run([built / "check", path], built, code=1)
    assert "more work than the size of the file allows" in out


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize("path", [ENGINE, ENGINE_POINTS], ids=lambda path: path.stem)
def test_an_answer_of_the_engine_in_the_kernel(built, path):
    """Neither extraction nor OCaml nor the reader: Coq's kernel computes the check itself."""
    answer = json.loads(path.read_text())
    (built / "Real.v").write_text(kernel.script(answer, path.name, 1))
    out = run(["coqc", "-q", "-Q", "theories", "ParcJax", "Real.v"], built)
    assert "whole_is_true" in out and "meaning whole" in out
    assert set(re.findall(r"^([A-Za-z]+\.[A-Za-z_]+)$", out, flags=re.MULTILINE)) == REALS


@pytest.mark.night
@needs_coq
def test_a_drive_in_plain_words(built):
    """What is proved of an episode, without a word of the specification."""
    plain = shutil.copy(COMPARE / "PlainDrive.v", built)
    out = run(["coqc", "-q", "-Q", "theories", "ParcJax", plain], built)
    assert set(re.findall(r"^([A-Za-z]+\.[A-Za-z_]+)$", out, flags=re.MULTILINE)) == REALS


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize("path", [ENGINE, ENGINE_POINTS], ids=lambda path: path.stem)
def test_an_answer_of_the_engine_is_accepted(built, path):
    run([built / "check", path], built)


ASKED = (("terms", 200), ("readers", 200), ("claims", 300))
READER_FAULTS = {
    "what is not drawn left out": ('match String.concat ", " names with', 'match "" with'),
}


@pytest.mark.night
@needs_coq
@pytest.mark.parametrize("name", READER_FAULTS)
def test_a_reader_that_hands_over_something_else_is_noticed(built, tmp_path, name):
    for path in (built / "program").glob("*.ml*"):
        shutil.copy(path, tmp_path)
    right, wrong = READER_FAULTS[name]
    sources = [tmp_path / f"{file}.ml" for file in ("json", "reader")]
    (source,) = [path for path in sources if path.read_text().count(right) == 1]
    source.write_text(source.read_text().replace(right, wrong))
    modules = "work.ml check.mli check.ml json.ml sha256.ml reader.ml verdict.ml terms.ml main.ml"
    compiler = "ocamlfind ocamlopt -w -a -package zarith -linkpkg".split()
    run([*compiler, *modules.split(), "-o", "check"], tmp_path)
    assert any(campaign(kind, [tmp_path / "check"], count).different for kind, count in ASKED)


@pytest.mark.night
@needs_coq
@pytest.mark.needs("node")
def test_the_javascript_program_says_the_same(built):
    files = [json.dumps(make()) for make in known.VALID.values()]
    files += [ENGINE.read_text(), json.dumps(build.scene(1))]
    native = two.proved_verdicts([built / "check"], files)
    assert two.proved_verdicts([*ON_NODE, PROVED_JS], files) == native


@pytest.mark.night
@needs_coq
def test_no_plan_of_the_engine_between_faces_and_its_mutants(built, tmp_path):
    """Two parts of four points under templates: hits of mixtures, with corners of what a bin
    allows, and rows of the goal with errors that are named.
    """
    rng = np.random.default_rng(3)
    model = points_model(rng, n_p=2, m=4, size=0.03, fitted=True, around_zero=True)
    asked = points_problem(rng, model)
    filled = [hpolytope(part.A, part.b + 0.4) for part in asked.obstacles]
    problem = reach_avoid(asked.goal, filled, asked.body)
    settings = Settings(samples=1, samples_only=True)
    answer = Planner(model).solve(problem, jax.random.key(0), settings)
    path = answer.save(tmp_path / "answer.json")
    written = json.loads(path.read_text())
    names = {name for node in written["no_plan"]["tree"] for name in node}
    assert written["no_plan"]["kind"] == "proved" and names == {"split", "hit", "bounded"}
    run([built / "check", path], built)
    found = campaign("no_plan", [built / "check"], 60, valid=written)
    assert 0 < found.accepted < found.seen and found.different == []
