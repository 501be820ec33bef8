"""The page in a real browser: verdicts equal the engine's, dragging and sliders move the plan."""

import html
import json
import re
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import drawn_bodies
import driven_browser
import jax
import numpy as np
import pytest
import toy_query
from needs import need
from toy_file import SEP, answer_file, hashed, save, toy_file, toy_scene
from toy_models import model_of, uniform_tube

import parc_jax as pj
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.page import write_page
from parc_jax.problem.robust.realisations import OF_MORE, Robustness
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from sims import drift_parking

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1300,900",
    "--virtual-time-budget=20000",
)

pytestmark = pytest.mark.night


@pytest.fixture(scope="module")
def browser():
    need("chromium")
    return driven_browser.found()


def run(browser, page: Path, *flags: str, script: str = "", address: str = "") -> str:
    """What the browser prints of a page, with a script run at its end."""
    if script:
        text = page.read_text().replace(
            "</body>", f'<pre id="result"></pre><script>{script}</script></body>'
        )
        page = page.with_name("scripted.html")
        page.write_text(text)
    command = [
        browser,
        *FLAGS,
        f"--user-data-dir={page.with_name('profile')}",
        *flags,
        f"{page.as_uri()}{address}",
    ]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def result(dom: str):
    """What the script left in #result."""
    return json.loads(html.unescape(re.search(r'<pre id="result">(.*?)</pre>', dom, re.S).group(1)))


@pytest.fixture
def toy_page(tmp_path):
    return page_of_file(tmp_path, toy_file())


def page_of_file(folder: Path, answer: dict) -> Path:
    """The page of a hand-made answer file."""
    return write_page(load_answer(save(folder / "answer.json", answer)), folder / "page.html")


def test_verdicts_equal_the_engine_s(browser, tmp_path, rng):
    model = pj.load(Path(__file__).parents[1] / "data" / "drift_4x8.npz")
    problem = drift_parking.problem()
    page = page_of_file(tmp_path, answer_file(model, problem))
    k = rng.uniform(model.domain.lo, model.domain.hi, (300, 2))
    end = rng.uniform([29.5, -17.0], [31.5, -15.0], (300, 2))
    scene = scene_of(problem, model)
    p0 = end - verdicts(scene, np.zeros_like(k), k).path[:, -1]
    seen = verdicts(scene, p0, k)
    script = (
        f"const P = {p0.tolist()}, K = {k.tolist()}; const out = P.map((p, i) => "
        f"{{ const v = model.verdict(p, K[i]);"
        " return [v.clearance, v.goal.least, v.bins[0], Number(v.safe), model.level(p, K[i]), "
        "v.q[0],"
        " v.path[40][0][0]]; });"
        "document.getElementById('result').textContent = JSON.stringify(out);"
    )
    got = np.array(result(run(browser, page, "--dump-dom", script=script)))
    slack = 4 * float(scene.slack) * max(1.0, float(np.abs(problem.goal.A).sum(axis=1).max()))
    assert 0 < slack < 1e-6
    assert np.abs(got[:, 0] - seen.clearance).max() < slack
    assert np.abs(got[:, 1] - seen.goal).max() < slack
    assert (got[:, 2] == seen.bin).all() and np.abs(got[:, 5] - seen.q[:, 0]).max() < 1e-9
    assert np.abs(got[:, 6] - seen.path[:, 40, 0]).max() < 1e-9
    assert (got[:, 3] == got[:, 4]).all() and (got[:, 3].astype(bool) == seen.safe).all()
    assert 10 < seen.safe.sum() < 290  # both verdicts occur
    # a page that forgot the tube must be caught by the same numbers
    ends = "[seen.path[t][i], seen.path[t + 1][i]]"
    page.write_text(page.read_text().replace(f"sums({ends}, seen.tube.errors[t][i])", ends))
    wrong = np.array(result(run(browser, page, "--dump-dom", script=script)))
    assert np.abs(wrong[:, 0] - seen.clearance).max() > 0.01 and (wrong[:, 3] > seen.safe).any()


def test_what_the_engine_proves_by_corridors_the_page_calls_proved(browser, tmp_path, rng):
    """Of 400 plans near the samples those that keep to a corridor, with polytopes and without."""
    model = pj.load(Path(__file__).parents[1] / "data" / "drift_4x8.npz")
    for polytopes in (False, True):
        answer = pj.Planner(model).solve(
            drift_parking.problem(),
            jax.random.PRNGKey(1),
            pj.Settings(samples=40, target=0.1, budget_s=300),
        )
        cut = answer.polytopes(jax.random.PRNGKey(2), 4000) if polytopes else None
        page = write_page(answer, tmp_path / "page.html", polytopes=cut)
        plans = np.repeat(answer.samples, 10, axis=0)
        plans = plans + rng.normal(size=(400, 4)) * [0.3, 0.3, 0.02, 0.01]
        p0, k = plans[:, :2], np.clip(plans[:, 2:], model.domain.lo, model.domain.hi)
        proved = answer.contains(p0, k)
        script = (
            f"const P = {p0.tolist()}, K = {k.tolist()}; const out = P.map((p, i) => {{"
            " move(p, K[i]); return [$('verdict').dataset.kind === 'proved' ? 1 : 0,"
            " model.level(p, K[i]) === 2 ? 1 : 0]; });"
            "document.getElementById('result').textContent = JSON.stringify(out);"
        )
        said, painted = np.array(result(run(browser, page, "--dump-dom", script=script))).T
        assert (said == proved).all() and (painted == proved).all()
        assert 40 < proved.sum() < 360  # both occur
        if polytopes:  # they hold most of what the corridors hold
            continue
        # a page that forgot the corridors must be caught by the same numbers
        script = script.replace("const out", "data.corridors.length = 0; const out", 1)
        forgot, _ = np.array(result(run(browser, page, "--dump-dom", script=script))).T
        assert (forgot < proved).sum() > 10


@pytest.mark.parametrize("robot", [lambda: drawn_bodies.car(parts=2), drawn_bodies.drone])
def test_bodies_are_judged_by_corridors_and_polytopes_of_their_parts(browser, tmp_path, rng, robot):
    """Of 300 plans near the samples those that keep to a corridor or lie in a polytope."""
    model, problem = robot()
    settings = pj.Settings(samples=30, target=0.6, budget_s=300)
    answer = pj.Planner(model).solve(problem, jax.random.PRNGKey(1), settings)
    cut = answer.polytopes(jax.random.PRNGKey(2), 2000)
    page = write_page(answer, tmp_path / "page.html", polytopes=cut)
    n_p = model.n_p
    plans = np.repeat(answer.samples, 10, axis=0)
    plans = plans + rng.normal(size=plans.shape) * np.repeat([0.1, 0.05], [n_p, model.n_k])
    p0, k = plans[:, :n_p], np.clip(plans[:, n_p:], model.domain.lo, model.domain.hi)
    proved = answer.contains(p0, k)
    script = (
        f"const P = {p0.tolist()}, K = {k.tolist()}; const out = P.map((p, i) => {{"
        " move(p, K[i]); return [$('verdict').dataset.kind === 'proved' ? 1 : 0,"
        " model.level(p, K[i]) === 2 ? 1 : 0]; });"
        "document.getElementById('result').textContent = JSON.stringify(out);"
    )
    said, painted = np.array(result(run(browser, page, "--dump-dom", script=script))).T
    assert (said == proved).all() and (painted == proved).all()
    assert 30 < proved.sum() < 270  # both occur
    # a page that took every part for the first must be caught by the same numbers
    wrong = "for (const pair of model.pairs) pair.points = pair.points.slice(0, 1); const out"
    script = script.replace("const out", wrong, 1)
    fooled, _ = np.array(result(run(browser, page, "--dump-dom", script=script))).T
    assert (fooled > proved).any()


def test_on_a_border_between_bins_the_widest_tube_counts(browser, tmp_path):
    """At k_0 = 7/8 two bins meet: the corridor holds with the wide one's widths or not at all."""
    folded, problem = toy_scene()
    interval, final = (np.repeat(w, 2, axis=0) for w in uniform_tube(4, 0.02))
    interval[1] = 0.04
    final[1] = 0.04
    edges = [[-1.0, 0.875, 1.0], [-1.0, 1.0]]
    model = model_of(folded.net, folded.domain, interval, final, edges)
    plan = {"p0": ["-0.875", "-0.05"], "k": ["0.875", "0.0625"], "sep": SEP}
    file = answer_file(model, problem, corridors=[plan])
    page = page_of_file(tmp_path, file)
    script = (
        "const out = [[-0.875, -0.05], [-0.705, -0.05]].map((p) => { move(p, [0.875, 0.0625]);"
        " return [state.seen.bins, state.seen.tube.lost[0], $('verdict').dataset.kind]; });"
        "document.getElementById('result').textContent = JSON.stringify(out);"
    )
    near, far = result(run(browser, page, "--dump-dom", script=script))
    assert near == [[0, 1], 0.04, "proved"]
    assert far == [[0, 1], 0.04, "unsafe"]  # |p| = 0.17 at the end: 0.2 - 0.02 would do


def test_sets_and_samples_are_called_proved_and_nothing_else(browser, toy_page):
    points = {
        "sample": ([-0.9, -0.05], [0.9, 0.0625]),
        "corridor": ([-0.9, -0.045], [0.905, 0.06]),  # a saved answer is read without polytopes
        "safe": (
            [-0.1, 0.0],
            [0.1, 0.01],
        ),  # near the goal all along: another direction would be needed
        "miss": ([-0.9, -0.05], [0.5, 0.0625]),
        "touch": ([-0.9, 0.9], [0.9, -0.9]),
    }
    script = (
        f"const out = {{}}; for (const [name, [p, k]] of Object.entries({json.dumps(points)})) "
        f"{{ move(p, k);"
        " const box = $('verdict');"
        " out[name] = [box.dataset.kind, Number(box.dataset.polytope), box.textContent]; }"
        "document.getElementById('result').textContent = JSON.stringify(out);"
    )
    got = result(run(browser, toy_page, "--dump-dom", script=script))
    assert {got[name][0] for name in ("sample", "corridor")} == {"proved"}
    assert "sample 0" in got["sample"][2] and "keeps to corridor 0" in got["corridor"][2]
    assert got["safe"][:2] == ["safe", -1] and "not proved" in got["safe"][2]
    assert got["miss"][0] == got["touch"][0] == "unsafe" and "misses the goal" in got["miss"][2]


def test_dragging_sliders_and_time_change_the_plan(browser, toy_page):
    script = """
const fire = (canvas, kind, at) => {
  const r = canvas.getBoundingClientRect(), [clientX, clientY] = [r.left + at[0], r.top + at[1]];
  canvas.dispatchEvent(new PointerEvent(kind, {clientX, clientY, pointerId: 1}));
};
const scene = scenes[0]; scene.fit(); frameScene();
scene.canvas.setPointerCapture = plane.canvas.setPointerCapture = () => {};
const out = {before: [state.p0.slice(), state.k.slice()]};
const from = scene.px(state.p0);
fire(scene.canvas, "pointerdown", from);
fire(scene.canvas, "pointermove", [from[0] + 20, from[1] - 10]);
fire(scene.canvas, "pointerup", from);
out.p0 = state.p0.slice(); out.expected = scene.at(from[0] + 20, from[1] - 10);
const to = plane.px([0.5, 0.5]);
fire(plane.canvas, "pointerdown", to); fire(plane.canvas, "pointerup", to);
out.k = state.k.slice();
$("anchor").checked = true; const end = endOf(state.p0, state.k);
sliders[0].slider.value = 0.25; sliders[0].slider.oninput();
out.slid = state.k.slice(); out.kept = endOf(state.p0, state.k).map((v, i) => v - end[i]);
$("time").value = 3; $("time").oninput(); out.clock = $("clock").textContent;
$("next").onclick(); out.sample = [state.sample, state.k.slice()];
out.rows = document.querySelectorAll("#certificate tr").length;
select(0); move(state.p0, [0.123456789012, 0.5]);
state.within ??= { kind: "sample", number: 0, sep: 0 };
certificate();
out.told = $("certificate").textContent;
document.getElementById("result").textContent = JSON.stringify(out);
"""
    got = result(run(browser, toy_page, "--dump-dom", script=script))
    assert got["p0"] == pytest.approx(got["expected"]) and got["p0"] != got["before"][0]
    assert got["k"] == pytest.approx([0.5, 0.5], abs=0.02)
    assert got["slid"][0] == 0.25 and got["kept"] == pytest.approx([0, 0], abs=1e-12)
    assert got["clock"] == "0.75 of 1.00 s"
    assert got["sample"] == [1, [0.9, -0.0625]] and got["rows"] == 4
    assert "k = (0.123456789012, 0.5)" in got["told"]  # of another plan nothing is proved


def opened(page: Path):
    """The page, driven."""
    return driven_browser.Browser(driven_browser.found(), page)


@pytest.mark.usefixtures("browser")
def test_of_an_answer_from_one_start_that_start_alone_is_judged(tmp_path):
    """Of others nothing is said: no start set is left in it, and free space was seen from there."""
    answer = toy_file()
    place = {"at": ["-0.9", "-0.05"], "pose": ["-0.9", "-0.05", None]}
    answer["meta"] = hashed(answer["meta"] | place)
    judged = "[$('verdict').dataset.kind, model.level(state.p0, state.k), $('verdict').textContent]"
    with opened(page_of_file(tmp_path, answer)) as page:
        assert page.run(f"move([-0.9, -0.05], [0.905, 0.06]); {judged}")[:2] == ["proved", 2]
        other = page.run(f"move([-0.9, -0.045], [0.905, 0.06]); {judged}")
        assert other[:2] == ["unsafe", 0] and page.run("$('anchor').disabled")
        assert "all plans of this answer start at (-0.9, -0.05)" in other[2]
        painted = "document.body.dataset.{} === '0' && document.body.dataset.{}"
        page.wait(painted.format("cells", "starts") + " === '0'")
        page.run("select(0)")
        page.wait(painted.format("starts", "cells") + " > 0")


@pytest.mark.usefixtures("browser")
def test_an_obstacle_is_solid_while_it_is_told_of_alone(tmp_path):
    """Also around a body that is one point; from interval 1 on."""
    ink = (
        "drawScene(scenes[0], data, model, state);"
        " [...scenes[0].pen.getImageData(...scenes[0].px([-0.45, 0.35]), 1, 1).data].slice(0, 3)"
    )
    with opened(write_page(toy_query.answer(), tmp_path / "page.html")) as page:
        assert page.run("model.single")
        before, during = (page.run(f"state.t = {t}; {ink}") for t in (0, 2))
        assert before == [0xEC] * 3 and during != before
        assert "dashed while nothing is said of it" in page.run(KEY)
        assert "told of for some of the 4 intervals" in page.run("$('about').innerText")


KEY = "document.querySelector('.key').innerText"
DOUBT = ("obstacle, grown by what is uncertain", "goal, less what is", "of one possible run")


@pytest.mark.usefixtures("browser")
def test_what_is_drawn_under_an_uncertainty_is_called_that(tmp_path):
    known = pj.Uncertainty(given={0: 0.5}, goal=0.01)
    asked = toy_query.gap().replace(uncertainty=known)
    settings = pj.Settings(samples=5, target=0.1, budget_s=300)
    answer = toy_query.planner().solve(asked, jax.random.PRNGKey(0), settings)
    for one, expected in ((answer, True), (toy_query.answer(), False)):
        with opened(write_page(one, tmp_path / "page.html")) as page:
            told = page.run(KEY), page.run("$('about').innerText")
            assert [words in told[0] for words in DOUBT] == [expected] * 3
            assert ("k0 = 0.5 (measured)" in told[1]) == expected


@pytest.mark.usefixtures("browser")
def test_that_there_is_no_plan_is_said_as_it_was_proved(tmp_path):
    answer = toy_query.answer(wall=True)
    doubt = Robustness("every start", Fraction(0), (2, 2), 4.0, True)
    robust = replace(answer, absence=answer.absence._replace(uncertainty=doubt, box="N"))
    for one in (answer, robust):
        with opened(write_page(one, tmp_path / "page.html")) as page:
            assert page.run("$('first').textContent").endswith(one.absence.details())
    assert "with k in N" in robust.absence.details() and OF_MORE in robust.absence.details()
