"""The page in a real browser: verdicts equal the engine's, dragging and sliders move the plan, the canvas is drawn."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from toy_file import answer_file, save, toy_file, toy_scene
from toy_models import model_of, random_network, uniform_tube

from parc_jax.certify.evaluate import evaluate
from parc_jax.certify.scene import scene
from parc_jax.plot.html import write_page
from parc_jax.sets.box import box

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--window-size=1300,900", "--virtual-time-budget=20000",
)  # fmt: skip

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def browser():
    found = next((path for path in map(shutil.which, BROWSERS) if path), None)
    if found is None:
        pytest.skip("no chromium installed")
    return found


def run(browser, page: Path, *flags: str, script: str = "", address: str = "") -> str:
    """What the browser prints of a page, with a script run at its end."""
    if script:
        text = page.read_text().replace("</body>", f'<pre id="result"></pre><script>{script}</script></body>')
        page = page.with_name("scripted.html")
        page.write_text(text)
    command = [browser, *FLAGS, f"--user-data-dir={page.with_name('profile')}", *flags, f"{page.as_uri()}{address}"]
    return subprocess.run(command, check=True, capture_output=True, timeout=120, text=True).stdout


def result(dom: str):
    """What the script left in #result."""
    return json.loads(html.unescape(re.search(r'<pre id="result">(.*?)</pre>', dom, re.S).group(1)))


@pytest.fixture
def toy_page(tmp_path):
    return write_page(save(tmp_path / "answer.json", toy_file()), tmp_path / "page.html")


def test_verdicts_equal_the_engine_s(browser, tmp_path, rng):
    import parc_jax as pj
    from sims.drift_parking.scenario import problem as parking

    model = pj.load(Path(__file__).parents[1] / "data" / "drift_4x8.npz")
    problem = parking()
    page = write_page(save(tmp_path / "answer.json", answer_file(model, problem)), tmp_path / "page.html")
    k = rng.uniform(model.domain.lo, model.domain.hi, (300, 2))
    end = rng.uniform([29.5, -17.0], [31.5, -15.0], (300, 2))
    laid_out = scene(problem, model)
    p0 = end - evaluate(model, laid_out, np.zeros_like(k), k).path[:, -1]
    seen = evaluate(model, laid_out, p0, k)
    script = (
        f"const P = {p0.tolist()}, K = {k.tolist()}; const out = P.map((p, i) => {{ const v = model.verdict(p, K[i]);"
        " return [v.clearance, v.goal.least, v.bin, Number(v.safe), Number(model.isSafe(p, K[i])), v.q[0],"
        " v.path[40][0]]; });"
        "document.getElementById('result').textContent = JSON.stringify(out);"
    )
    got = np.array(result(run(browser, page, "--dump-dom", script=script)))
    slack = 4 * float(laid_out.slack) * max(1.0, float(np.abs(problem.goal.A).sum(axis=1).max()))
    assert 0 < slack < 1e-6
    assert np.abs(got[:, 0] - seen.clearance).max() < slack
    assert np.abs(got[:, 1] - seen.goal).max() < slack
    assert (got[:, 2] == seen.bin).all() and np.abs(got[:, 5] - seen.q[:, 0]).max() < 1e-9
    assert np.abs(got[:, 6] - seen.path[:, 40, 0]).max() < 1e-9
    assert (got[:, 3] == got[:, 4]).all() and (got[:, 3].astype(bool) == seen.safe).all()
    assert 10 < seen.safe.sum() < 290  # both verdicts occur
    # a page that forgot the tube must be caught by the same numbers
    forgot = page.read_text().replace("o.sign[i][0] * e[0]", "0").replace("o.sign[i][1] * e[1]", "0")
    page.write_text(forgot)
    wrong = np.array(result(run(browser, page, "--dump-dom", script=script)))
    assert np.abs(wrong[:, 0] - seen.clearance).max() > 0.01 and (wrong[:, 3] > seen.safe).any()


def test_sets_and_samples_are_called_proved_and_nothing_else(browser, toy_page):
    points = {
        "sample": ([-0.9, -0.05], [0.9, 0.0625]),
        "set": ([-0.9, -0.045], [0.905, 0.06]),
        "safe": ([-0.1, 0.0], [0.1, 0.01]),  # near the goal all along: another direction would be needed
        "miss": ([-0.9, -0.05], [0.5, 0.0625]),
        "touch": ([-0.9, 0.9], [0.9, -0.9]),
    }
    script = (
        f"const out = {{}}; for (const [name, [p, k]] of Object.entries({json.dumps(points)})) {{ move(p, k);"
        " out[name] = [$('verdict').dataset.kind, Number($('verdict').dataset.set), $('verdict').textContent]; }"
        "document.getElementById('result').textContent = JSON.stringify(out);"
    )
    got = result(run(browser, toy_page, "--dump-dom", script=script))
    assert got["sample"][0] == got["set"][0] == "proved" and got["set"][1] == 0
    assert "sample 1" in got["sample"][2] and "inside set 1" in got["set"][2]
    assert got["safe"][:2] == ["safe", -1] and "not proved" in got["safe"][2]
    assert got["miss"][0] == got["touch"][0] == "unsafe" and "misses the goal" in got["miss"][2]


def test_dragging_sliders_and_time_change_the_plan(browser, toy_page):
    script = """
const fire = (canvas, kind, at) => { const r = canvas.getBoundingClientRect();
  canvas.dispatchEvent(new PointerEvent(kind, {clientX: r.left + at[0], clientY: r.top + at[1], pointerId: 1})); };
View.prototype.fit.call(scene); frameScene();
scene.canvas.setPointerCapture = plane.canvas.setPointerCapture = () => {};
const out = {before: [state.p0.slice(), state.k.slice()]};
const from = scene.px(state.p0);
fire(scene.canvas, "pointerdown", from); fire(scene.canvas, "pointermove", [from[0] + 20, from[1] - 10]);
fire(scene.canvas, "pointerup", from);
out.p0 = state.p0.slice(); out.expected = scene.at(from[0] + 20, from[1] - 10);
const to = plane.px([0.5, 0.5]);
fire(plane.canvas, "pointerdown", to); fire(plane.canvas, "pointerup", to);
out.k = state.k.slice();
$("anchor").checked = true; const end = model.plan(state.p0, state.k).path[model.T];
sliders[0].value = 0.25; sliders[0].oninput();
out.slid = state.k.slice(); out.kept = model.plan(state.p0, state.k).path[model.T].map((v, i) => v - end[i]);
$("time").value = 3; $("time").oninput(); out.clock = $("clock").textContent;
$("next").onclick(); out.sample = [state.sample, state.k.slice()];
out.rows = document.querySelectorAll("#certificate tr").length;
document.getElementById("result").textContent = JSON.stringify(out);
"""
    got = result(run(browser, toy_page, "--dump-dom", script=script))
    assert got["p0"] == pytest.approx(got["expected"]) and got["p0"] != got["before"][0]
    assert got["k"] == pytest.approx([0.5, 0.5], abs=0.02)
    assert got["slid"][0] == 0.25 and got["kept"] == pytest.approx([0, 0], abs=1e-12)
    assert got["clock"] == "0.75 of 1.00 s"
    assert got["sample"] == [1, [0.9, -0.0625]] and got["rows"] == 4


def test_the_address_holds_the_state_and_safe_cells_agree_with_the_engine(browser, toy_page):
    dom = run(browser, toy_page, "--dump-dom", address="#p0=-0.85,-0.02&k=0.85,0.03&t=2")
    assert 'data-ready="1"' in dom and "0.50 of 1.00 s" in dom
    cells = int(re.search(r'data-cells="(\d+)"', dom).group(1))
    model, problem = toy_scene()
    middle = (np.arange(36) + 0.5) / 36 * 2 - 1
    k = np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
    safe = evaluate(model, scene(problem, model), np.broadcast_to([-0.85, -0.02], k.shape), k).safe
    assert cells == safe.sum() > 0


def test_the_canvas_is_drawn(browser, toy_page, tmp_path):
    from matplotlib.image import imread

    run(browser, toy_page, f"--screenshot={tmp_path / 'page.png'}", address="#t=2")
    picture = imread(tmp_path / "page.png")[..., :3]
    inks = {"path": (0, 114, 178), "goal": (0, 158, 115), "start": (230, 159, 0), "block": (110, 110, 110)}
    for name, color in inks.items():
        near = np.abs(picture * 255 - np.array(color)).max(axis=-1) < 12
        assert near.sum() > 20, name


@pytest.mark.parametrize("n_k", [1, 3])
def test_any_number_of_parameters_is_shown(browser, tmp_path, rng, n_k):
    net, domain = random_network(rng, T=4, n_k=n_k), box(-np.ones(n_k), np.ones(n_k))
    model, (_, problem) = model_of(net, domain, *uniform_tube(4, 0.01)), toy_scene()
    page = write_page(save(tmp_path / "answer.json", answer_file(model, problem)), tmp_path / "page.html")
    script = (
        "const choice = document.querySelectorAll('#axes select'); if (choice.length) {"
        " choice[1].value = 2; choice[1].onchange(); }"
        "document.getElementById('result').textContent = JSON.stringify([state.axes, sliders.length, state.k]);"
    )
    axes, sliders, k = result(run(browser, page, "--dump-dom", script=script))
    assert axes == ([0, 0] if n_k == 1 else [0, 2]) and sliders == n_k and k == [0.0] * n_k
