"""Whatever tells of an answer says what its plans rest on: every surface, every premise. A
surface that may leave one out is named here.
"""

import html
import json
import re

import matplotlib.text
import pytest
from answers_of_arcs import FROM, KEY, MEASURED, SETTINGS, Arc, Sure, model, question
from needs import need

import parc_jax as pj
from parc_jax.app.cli.scene import as_json, verdict
from parc_jax.app.live_page import about_set
from parc_jax.app.plot.film import _PlanCanvas
from parc_jax.app.plot.page import page_data
from parc_jax.app.plot.regions import regions
from parc_jax.checker import main as check
from parc_jax.proof.regions import enumerate_regions

need("matplotlib")


def written(figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(matplotlib.text.Text))


def checked(answer, folder, capsys) -> str:
    capsys.readouterr()
    assert check([str(answer.save(folder / "answer.json"))]) == 0
    return capsys.readouterr().out


def plan(answer):
    return answer.samples[0, :2], answer.samples[0, 2:]


SURFACES = {
    "repr": lambda answer, *_: repr(answer),
    "summary": lambda answer, *_: answer.summary(),
    "details": lambda answer, *_: answer.details(),
    "notebook": lambda answer, *_: answer._repr_html_(),
    "terminal": lambda answer, folder, _: verdict(answer, folder / "answer.json"),
    "json": lambda answer, folder, _: as_json(answer, folder / "answer.json", None),
    "page": lambda answer, *_: json.dumps(page_data(answer)),
    "live": lambda answer, *_: "\n".join(about_set(answer)),
    "samples": lambda answer, *_: written(pj.figures.samples(answer)),
    "regions": lambda answer, *_: written(
        regions(answer, enumerate_regions(answer.model.net, answer.model.domain))
    ),
    "film": lambda answer, *_: written(_PlanCanvas(answer, 0, None).figure),
    "path": lambda answer, *_: answer.path(*plan(answer)).to_csv().partition("\n")[0],
    "choice": lambda answer, *_: answer.choose().details(),
    "header": lambda answer, folder, _: (
        pj.exchange.write_c(answer, folder / "one.h").read_text().replace("\n * ", " ")
    ),
    "file, read again": lambda answer, folder, _: repr(
        pj.load_answer(answer.save(folder / "answer.json"))
    ),
    "checker": checked,
}

UNCERTAIN = {"start": 0.01, "sensing_eps": "0.013"}
SAID = "A friend of ours has promised it"


def asked(claims="one", at=None, said="", validate=None, arc=Sure, **unsure):
    problem = question(bool(said), **unsure)
    if said:
        spans = [type(x)(x, x.dt, x.at, None, said, x.mover) for x in problem.all_spans]
        problem = problem.replace(spans=tuple(spans))
    return pj.Planner(model(claims, arc)).solve(problem, KEY, SETTINGS, at=at, validate=validate)


def of_tests():
    validate = pj.drive.Validate(Sure(), risk=0.1, delta=0.05, tests=300, scales=(1.0, 0.5))
    return asked(validate=validate).validation.answer


# of each premise: an answer that rests on it, and words of which some tell of it
PREMISES = {
    "what is uncertain": (lambda: asked(**UNCERTAIN), "uncertain|withstand|every start within"),
    "sensing": (lambda: asked(**UNCERTAIN), r"0\.013|13/1000"),
    "one start": (lambda: asked(at=FROM["a place"]), "one start|all plans start|start at"),
    "whose frame": (lambda: asked(at=FROM["a pose"]), "robot's frame"),
    "when": (lambda: asked(said=SAID), "at other times|of the 4 intervals"),
    "whose word": (lambda: asked(said=SAID), SAID),
    "assumed": (lambda: asked("assumed"), "(?i)assumed"),
    "declared": (lambda: asked("declared"), "(?i)declared"),
    "tested": (of_tests, "may leave"),
    "measured": (lambda: asked(arc=Arc, **MEASURED), "(?i)measured"),
    "measured when it begins": (lambda: asked(arc=Arc, given={"v0": "free"}), "Measured at"),
    "and of which nothing is shown": (
        lambda: asked("assumed", arc=Arc, given={"v0": "free"}),
        "Measured at",
    ),
}
# names and pictures say which plans they are of, whose sentences say what these rest on; a table of
# a path is of one prediction, and says of its tube what it leaves out
SHORT = {"repr", "file, read again", "samples", "regions", "path"}
LEFT = {
    "what is uncertain": {"path"},
    "sensing": {*SHORT, "film"},
    "one start": {"path"},
    "whose frame": {
        "repr",
        "file, read again",
        "regions",
        "live",
    },  # which tells all in the world's
    "when": {*SHORT, "film"},
    "whose word": {*SHORT, "film"},
    "assumed": {"path"},
    "declared": {"path"},
    "tested": {"path"},
    "measured": SHORT,  # of the film's one plan it is said
    "measured when it begins": {*SHORT, "film"},
    "and of which nothing is shown": {*SHORT, "film"},
}


@pytest.mark.slow
@pytest.mark.parametrize("premise", PREMISES)
def test_every_surface_tells_of_every_premise(premise, tmp_path, capsys):
    make, words = PREMISES[premise]
    answer, silent = make(), set()
    assert answer.status.found
    for name, tell in SURFACES.items():
        try:
            said = tell(answer, tmp_path, capsys)
        except pj.InputError:  # who refuses says nothing
            assert name in ("header", "choice")
            continue
        if not re.search(words, html.unescape(" ".join(said.split()))):
            silent.add(name)
    assert silent == LEFT[premise]


@pytest.mark.slow
def test_a_name_says_so_where_no_share_was_measured():
    few = pj.Settings(samples=2, samples_only=True)
    told = pj.Planner(model("assumed", Sure)).solve(question(False, start=0.01), KEY, few)
    assert repr(told).endswith("under an assumed tube for all that is uncertain>")


@pytest.mark.slow
def test_a_batch_says_what_its_plans_are_under_and_is_of_one_probability():
    planner, sure = pj.Planner(model("assumed", Sure)), question(False)
    two = [question(False, **UNCERTAIN), question(False, **UNCERTAIN)]
    told = repr(planner.solve_batch(two, KEY, draws=64))
    assert told.endswith(" under an assumed tube for all that is uncertain>")
    assert repr(planner.solve_batch([sure], KEY, draws=64)).endswith(" under an assumed tube>")
    some = [sure, question(False, goal=[0.001, 0.001])]  # of neither a probability
    assert repr(planner.solve_batch(some, KEY, draws=64)).endswith(" for all that is uncertain>")
    two[1] = question(False, **UNCERTAIN | {"sensing_eps": "0.5"})
    with pytest.raises(pj.InputError, match="with one sensing_eps; problem 1 is under another"):
        planner.solve_batch(two, KEY)
