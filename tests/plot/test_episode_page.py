"""The page of an episode: all of it is in the file, and what it shows at a time is what was under
way then.
"""

import json
import re

import driven_browser
import numpy as np
import pytest
from covered import covered
from episodes import driven
from needs import need

import parc_jax as pj
from parc_jax.app import cli, figures
from parc_jax.app.plot.episode import Stage
from parc_jax.app.plot.page import RATE, episode_data, reasons
from parc_jax.drive.loop.episode_file import load_episode

WHY = "none is safe </script><b>"


@pytest.fixture(scope="module", params=[False, True], ids=["", "turning"])
def file(request, tmp_path_factory):
    """Four manoeuvres; in the middle of the second nothing new was found."""
    done = driven(request.param)
    late = float(done[1].begin + done[2].begin) / 2
    place = tmp_path_factory.mktemp("drive") / "drive.json"
    return pj.drive.save_episode(place, done, {"reasons": [[late, WHY]]}), late


def embedded(page: str) -> dict:
    """The data block of a page."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S)
    return json.loads(found.group(1))


def test_the_page_is_whole_and_the_body_is_inside_of_what_it_may_reach(file, tmp_path):
    page = figures.write_page(file[0], tmp_path / "drive.html").read_text()
    for words in ("http:", "https:", " src=", "@import", "url(", "fetch(", "import("):
        assert words not in page
    assert not re.search(r"/\*[A-Z]+\*/", page)
    # beside what is proved: that it rests is nobody's proof
    assert re.search(r"Proved against .* that it rests at its end, at .* s, is assumed\.", page)
    assert page.count("<script") == page.count("</script>") == 2
    data = embedded(page)
    assert data["reasons"] == [[file[1], WHY]]
    for now in data["moments"]:
        begun = [one["begin"] <= now["time"] + 1e-9 for one in data["manoeuvres"]]
        assert now["number"] == sum(begun) - 1
        one = data["manoeuvres"][now["number"]]
        for outline in now["body"]:
            assert covered(np.array(outline), np.array(one["tube"])).all()
    assert {now["number"] for now in data["moments"]} == {0, 1, 2, 3}
    assert data["moments"][0]["time"] == data["begin"] and now["time"] == one["end"]
    np.testing.assert_allclose(now["body"], one["rest"], atol=1e-3)


def test_the_truth_is_shown_where_it_is_known(file):
    shapely = pytest.importorskip("shapely")
    known = load_episode(file[0])
    free = shapely.box(-3, -3, 3, 3).difference(shapely.box(1, 1, 2, 2))
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]])
    post = np.array([[1.2, 1.2], [1.4, 1.2], [1.2, 1.4]])
    data = episode_data(
        Stage(known, figures.Truth(np.array([0.0, 1.0]), poses, [post], [(0, free)]))
    )
    middles = np.array([now["middle"] for now in data["moments"]])
    np.testing.assert_allclose(np.diff(middles, axis=0)[:, 1], 2 / RATE, atol=2e-4)
    assert data["standing"] == [post.tolist()] and data["true"]
    ((time, (rings,)),) = data["seen"]
    assert time == 0 and len(rings) == 2 and [1.0, 2.0] in rings[1]


def test_a_reason_that_cannot_be_read_takes_no_other_with_it():
    some = [[0.3, "x"], ["bad"], ["bad", "y"], None, ["0.1", "z"], [10**400, "w"], ["nan", "v"]]
    assert reasons({"reasons": some}) == [(0.1, "z"), (0.3, "x")]
    for none in (None, {}, [], {"reasons": 3}, {"reasons": None}, {"reasons": "ab"}):
        assert reasons(none) == []


def test_nothing_is_said_to_be_proved_of_what_was_before_the_first_manoeuvre(file):
    known = load_episode(file[0])
    begin = float(known.manoeuvres[0].begin)
    times, poses = begin + np.linspace(-2.0, 1.0, 5), np.zeros((5, 3))
    poses[:, 0] = np.linspace(0.0, 1.5, 5)
    data = episode_data(Stage(known, figures.Truth(times, poses)))
    assert data["begin"] == data["moments"][0]["time"] == begin
    middle = np.mean([now["middle"] for now in data["moments"][:1]], axis=0)
    assert np.abs(middle - [1.0, 0.0]).max() < 0.2  # where it was by then


@pytest.mark.parametrize(
    ("times", "poses", "words"),
    [
        ([0.0, 2.0, 1.0], np.zeros((3, 3)), "truth: expected sorted times, some from"),
        ([-2.0, -1.0, -0.5], np.zeros((3, 3)), "truth: expected sorted times, some from"),
        ([], np.zeros((0, 3)), "truth: expected sorted times, some from"),
        ([0.0, np.nan, 1.0], np.zeros((3, 3)), "truth: times: expected finite numbers"),
        ([0.0, 1.0, 2.0], np.full((3, 3), np.nan), "truth: poses: expected finite numbers"),
        ([0.0, 1.0], np.zeros((3, 3)), r"truth: poses: expected shape \(2, 3\); got \(3, 3\)"),
        ([0.0, 1.0, 2.0], np.zeros((3, 2)), r"expected shape \(3, 3\); got \(3, 2\)"),
    ],
)
def test_a_truth_that_is_none_is_refused(file, times, poses, words, tmp_path):
    truth = figures.Truth(np.array(times), poses)
    for write in (
        lambda: figures.write_page(file[0], tmp_path / "drive.html", truth=truth),
        lambda: figures.film(file[0], tmp_path / "drive.gif", run=truth),
    ):
        with pytest.raises(pj.InputError, match=words):
            write()
    assert not list(tmp_path.iterdir())


def test_the_shell_writes_it(file, tmp_path, capsys):
    place = tmp_path / "drive.html"
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", str(file[0]), "--html", str(place)])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"{place}\n" and len(embedded(place.read_text())["k"]) == 2
    with pytest.raises(SystemExit) as stop:
        cli.main(["plot", str(file[0])])
    assert stop.value.code == 2
    assert "expected --html FILE, its page, or --video FILE" in capsys.readouterr().err


@pytest.mark.night
def test_one_scrubs_to_what_was_said(file, tmp_path):
    need("chromium")
    page = figures.write_page(file[0], tmp_path / "drive.html")
    begins = [float(one.begin) for one in load_episode(file[0]).manoeuvres]
    with driven_browser.Browser(driven_browser.found(), page) as browser:
        shown = "[document.body.dataset.number, document.body.dataset.kept, $('clock').textContent]"
        number, kept, clock = browser.run(f"go(momentOf({begins[2]})); {shown}")
        assert (number, kept) == ("2", "") and clock.startswith(f"{begins[2]:.2f} of ")
        number, kept, _ = browser.run(
            f"$('time').value = {int(file[1] * RATE) + 1}; $('time').oninput(); {shown}"
        )
        assert (number, kept) == ("1", WHY) and WHY in browser.run("$('why').textContent")
        assert browser.run("$('previous').onclick();" + shown)[0] == "0"
        assert browser.run("$('play').onclick(); $('play').textContent") == "❚❚"
        browser.wait("$('play').textContent === '▶'")  # it plays to its end
        assert browser.run("Number($('time').value) === last")
        ink = "[...scene.pen.getImageData(0, 0, scene.canvas.width, scene.canvas.height).data]"
        blue = f"{ink}.filter((v, i, all) => i % 4 === 0 && v === 0 && all[i + 1] === 114).length"
        assert browser.run(blue) > 100
        # times are told, and a moment is linked to, as they are: by two digits it was another one
        whole = "data.moments[3].time += 0.0049; go(3); const to = $('link').href.split('#t=')[1];"
        told = f"{whole} [$('clock').textContent, to, momentOf(Number(to))]"
        clock, to, moment = browser.run(told)
        assert len(to) > 4 and clock.startswith(f"{to} of ") and moment == 3
        later = "data.manoeuvres[2].begin = 5.0625; data.reasons[0][0] += 0.0005; select(1);"
        said = browser.run(f"{later} go(momentOf(data.reasons[0][0])); $('verdict').textContent")
        assert "Left for manoeuvre 2 at 5.0625 s." in said
        assert f"{file[1] + 0.0005:.4f} s: no new one" in browser.run("$('why').textContent")
        # from where a new one begins no reason is told why there is none
        begun = "data.reasons[0][0] = data.manoeuvres[1].begin; select(1);"
        assert browser.run(f"{begun} document.body.dataset.kept") == ""
        times = browser.run("[2, 0.125, 3 * 0.1, 1 / 3].map(spelled)")
        assert times == ["2.00", "0.125", "0.30", "0.333333333"]
