"""What the page says and draws is of this plan and this answer: cells, links, words."""

from dataclasses import replace
from pathlib import Path

import driven_browser
import numpy as np
import pytest
import toy_query
import toy_whole
from needs import need
from toy_file import SEP, answer_file, save, toy_file, toy_scene
from toy_models import model_of, uniform_tube

from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot.page import page_data, write_page
from parc_jax.app.plot.shapes import TOP, SceneView
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.runs.law import BOX, law_spec
from parc_jax.problem.robust.pose import Pose

SAID = "$('verdict').textContent"
HALF = [[-1.0, 0.95, 1.0], [-1.0, 1.0]]  # two bins


def loaded(folder: Path, file: dict | None = None):
    """A hand-made answer."""
    return load_answer(save(folder / "answer.json", toy_file() if file is None else file))


def half_claimed(folder: Path):
    """One whose second bin has no claim."""
    folded, problem = toy_scene()
    interval, final = (np.repeat(w, 2, axis=0) for w in uniform_tube(4, 0.02))
    interval[1] = final[1] = np.inf
    model = model_of(folded.net, folded.domain, interval, final, HALF)
    plan = {"p0": ["-0.875", "-0.05"], "k": ["0.875", "0.0625"], "sep": SEP}
    return loaded(folder, answer_file(model, problem, corridors=[plan]))


def unproved(answer):
    """The same, shown in float64."""
    return replace(answer, cover=answer.cover._replace(proved=False))


def local(answer):
    """The same of a claim about the box N."""
    claim = answer.model.claim
    law = law_spec("toy", answer.model.domain, parameters={BOX: "N"})
    model = answer.model.replace(claim=derived(claim, law=law))
    nominal = replace(answer.scene.nominal, model=model)
    return replace(answer, scene=answer.scene.replace(nominal=nominal))


def opened(answer, folder: Path):
    """Its page in a browser."""
    need("chromium")
    page = write_page(answer, folder / "page.html")
    return driven_browser.Browser(driven_browser.found(), page)


def test_axes_say_whose_frame_they_are_of(tmp_path):
    answer = loaded(tmp_path)
    assert page_data(answer)["labels"]["p"] == ["x [m]", "y [m]"]
    nominal = replace(answer.scene.nominal, pose=Pose(np.zeros(2), 0.5))
    turned = replace(answer, scene=answer.scene.replace(nominal=nominal))
    said = ["x [m], robot's frame", "y [m], robot's frame"]
    assert page_data(turned)["labels"]["p"] == said == SceneView(turned, TOP).labels


def test_a_bin_without_a_claim_has_no_numbers(tmp_path):
    first, second = page_data(half_claimed(tmp_path))["tube"]["lost"]
    assert first == pytest.approx([0.02] * 6) and second is None


def test_the_box_of_a_local_answer_keeps_its_name(tmp_path):
    answer = loaded(tmp_path)
    assert page_data(answer)["box"] == "K" and page_data(local(answer))["box"] == "N"


@pytest.mark.night
def test_cells_of_another_k_or_start_are_not_drawn(tmp_path):
    with opened(toy_query.answer(), tmp_path) as browser:
        ready, anew = "document.body.dataset.starts", "delete document.body.dataset.starts"
        counts = "[state.starts[0].length, state.cells.length]"
        browser.wait(ready)
        starts, cells = browser.run(counts)
        assert starts > 0 and cells > 0
        # the next moment is drawn with them
        moved = "state.p0, [state.k[0] + 0.02, state.k[1]]"
        assert browser.run(f"{anew}; move({moved}); {counts}") == [0, cells]
        browser.wait(ready)
        wrong = """state.starts[0].filter(({ corners: [a, , c], level }) =>
            model.level([(a[0] + c[0]) / 2, (a[1] + c[1]) / 2], state.k) !== level).length"""
        assert browser.run(wrong) == 0
        starts, _ = browser.run(counts)
        other = "[state.p0[0] + 0.01, state.p0[1]], state.k"
        assert browser.run(f"move({other}); {counts}") == [starts, 0]
        # with the end held its own cells stay while k moves, and go where the end does
        browser.run(f"{anew}; select(0); $('anchor').checked = true; update()")
        browser.wait(ready)
        _, cells = browser.run(counts)
        assert cells > 0
        assert browser.run(f"move(state.p0, [-0.7, -0.7]); {counts}") == [0, cells]
        assert browser.run(f"move([0.5, 0.5], state.k); {counts}")[1] == 0


@pytest.mark.night
def test_words_are_by_the_level_of_the_answer(tmp_path):
    answer = loaded(tmp_path)
    keys = "[...document.querySelectorAll('.by')].map((word) => word.textContent)"
    with opened(answer, tmp_path) as browser:
        assert browser.run(keys) == ["proved"] * 2
        assert "proved in exact arithmetic by" in browser.run(SAID)
    with opened(unproved(answer), tmp_path) as browser:
        assert browser.run(keys) == ["shown in float64"] * 2
        assert "shown in float64 by" in browser.run(SAID)
        seen = "document.querySelector('main').innerText"
        assert browser.run(seen).count("proved in the middle") == 0


@pytest.mark.night
def test_the_verdict_names_what_fails(tmp_path):
    with opened(local(half_claimed(tmp_path)), tmp_path) as browser:
        said = browser.run(f"move([-0.875, -0.05], [0.875, 0.0625]); {SAID}")
        assert said.startswith("Safe: keeps to corridor 0")
        said = browser.run(f"move([-0.685, -0.05], [0.875, 0.0625]); {SAID}")
        assert said.startswith("Not shown safe: not all of the tube ends in the goal")
        said = browser.run(f"move([-0.6, -0.05], [0.875, 0.0625]); {SAID}")
        assert said.startswith("Not shown safe: misses the goal")
        said = browser.run(f"move([-0.975, -0.05], [0.975, 0.0625]); {SAID}")
        assert said == "Not shown safe: no claim is about this kThere is no tube in this bin of N."
        said = browser.run(f"move([-0.975, -0.05], [2, 0.0625]); {SAID}")
        assert said.endswith("k0 = 2 is outside of N, which ends there at 1: that is shown.")


LINKS = [
    "p0=0.66&k=-0.8,-0.8",
    "p0=0.66,-1",
    "k=-0.8,-0.8",
    "p0=,&k=,",
    "p0=0.66,&k=-0.8,-0.8",
    "p0=nan,1&k=0,0",
    "p0=0.66,-1&k=0.5",
    "t=0.75",
    "t=5",
    "t=-1",
    "t=",
    "sample=1.7",
    "sample=2",
    "plan=1",
    "sample=1&p0=0.5,-0.5&k=-0.25,0.5",
    "sample=1&sample=0",
    "p0=0.5,-0.5&k=-0.25,0.5&k=0,0",
    "t=1&t=2",
]


@pytest.mark.night
def test_a_link_that_cannot_be_read_shows_no_plan_as_asked(tmp_path):
    with opened(loaded(tmp_path), tmp_path) as browser:

        def follow(link):
            browser.run(f"location.hash = '{link}'; readAddress()")
            return browser.run("[$('verdict').dataset.kind, state.p0, state.k, state.t]")

        _, p0, k, t = follow("sample=0&t=1")
        assert t == 1
        for link in LINKS:
            assert follow(link) == ["unread", p0, k, t], link
            assert browser.run(SAID).startswith("This link is not of this answer"), link
        assert follow("t=3") == ["proved", p0, k, 3]
        assert follow("sample=1")[::2] == ["proved", [0.9, -0.0625]]
        assert follow("p0=0.5,-0.5&k=-0.25,0.5&t=2") == ["unsafe", [0.5, -0.5], [-0.25, 0.5], 2]
        own = browser.run("$('link').getAttribute('href').slice(1)")
        assert follow("p0=") and follow(own) == ["unsafe", [0.5, -0.5], [-0.25, 0.5], 2]
        browser.run("location.hash = 'p0='")
        browser.wait("state.unread")
        assert browser.run("select(0); $('verdict').dataset.kind") == "proved"


@pytest.mark.night
def test_where_no_obstacle_is_no_clearance_is_told(tmp_path):
    with opened(toy_whole.answer(), tmp_path) as browser:
        assert browser.run(SAID).endswith("There is no obstacle.")
    with opened(toy_query.answer(), tmp_path) as browser:
        browser.run("model.pairs.forEach((pair) => { pair.steps = [9, 9]; })")
        said = browser.run(f"update(); {SAID}")
        assert said.endswith("No obstacle is there in that time.")


@pytest.mark.night
def test_times_digits_and_curves_are_whole(tmp_path):
    with opened(toy_query.answer(), tmp_path) as browser:
        # towards the obstacle until 1 s: no interval is told by its beginning
        assert browser.run(SAID).endswith("from obstacle 0 between 0.75 and 1.00 s.")
        browser.run("move([-0.6610215148896459, -1.0097925], [-0.18261067361990561, 0])")
        cut = """[...document.querySelectorAll('#starts input, #sliders input[type=number]')]
            .filter((field) => { const pen = document.createElement('canvas').getContext('2d');
                const { font, paddingLeft } = getComputedStyle(field); pen.font = font;
                const room = field.clientWidth - 2 * parseFloat(paddingLeft);
                return pen.measureText(field.value).width > room; }).length"""
        assert browser.run(cut) == 0
        wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert browser.run(wide) == 0
        words = """(() => { const told = []; strip.text = (word) => told.push(word);
            drawClearance(strip, data, model, state); return told; })()"""
        assert not [word for word in browser.run(words) if "clearance" in word]
