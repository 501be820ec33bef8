"""The page holds the numbers of the file, nothing foreign, and refuses what is no answer."""

import copy
import json
import re

import numpy as np
import pytest
from toy_file import save, toy_file, toy_scene
from toy_models import host_outputs

from parc_jax.errors import InputError
from parc_jax.plot.html import write_page
from parc_jax.plot.page_data import page_data
from parc_jax.plot.page_pieces import corners_of, piece_rows


def embedded(page: str) -> dict:
    """The data block of a page."""
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S).group(1))


def test_the_page_is_whole_and_needs_no_network(tmp_path):
    page = write_page(save(tmp_path / "answer.json", toy_file()), tmp_path / "page.html").read_text()
    for foreign in ("http:", "https:", " src=", "@import", "url(", "fetch(", "import(", "XMLHttpRequest", "WebSocket"):
        assert foreign not in page
    assert not re.search(r"/\*[A-Z]+\*/", page)  # every part is in
    assert page.count("<script") == page.count("</script>") == 2  # a name from the file cannot end the data block
    assert embedded(page)["system"] == "toy </script><b>"


def test_numbers_survive_exactly():
    model, problem = toy_scene()
    data = page_data(toy_file())
    assert all((np.array(W) == V).all() for W, V in zip(data["network"]["weights"], model.net.weights, strict=True))
    assert (np.array(data["tube"]["interval"]) == model.tube.interval).all()
    assert (np.array(data["goal"]["b"]) == problem.goal.b).all()
    assert data["samples"][0]["k"] == [0.9, 0.0625]
    first, last = data["samples"][0]["sep"][0]
    assert first[:4] == [0, 2, -1.0, -1.0] and first[4] == pytest.approx(0.5 - 0.3 + 0.1 * np.sqrt(2))
    assert last[:2] == [2, 4] and data["samples"][0]["sep"][1][0][2:] == pytest.approx([0, 0.75, 0.75 * (-0.3 + 0.1)])


def test_polytopes_of_the_page_are_safe_plans_of_the_model(rng):
    model, problem = toy_scene()
    data = page_data(toy_file())
    for number, piece in enumerate(data["sets"]):
        rows = piece_rows(data["network"], data["tube"], problem, piece, 4)
        corners = corners_of(rows, np.array(piece["p0"] + piece["k"]))
        assert len(corners) > 5 and (corners @ rows.A.T <= rows.b + 1e-9).all()
        inner = rng.dirichlet(np.full(len(corners), 0.3), 300) @ corners
        y = host_outputs(model.net, inner[:, 2:])
        path = inner[:, None, :2] + np.concatenate([np.zeros((300, 1, 2)), y[:, :8].reshape(-1, 4, 2)], axis=1)
        assert (np.abs(path[:, -1]) <= 0.2 - 0.02 + 1e-9).all()
        assert (path[:, 2:, 1] < 0.3 - 0.12 + 1e-9).all() and (path[:, :, 1] > -0.3 + 0.12 - 1e-9).all()
        assert ((inner[:, 3] >= -1e-9) if number == 0 else (inner[:, 3] <= 1e-9)).all()  # its own region
    starts, parameters = data["outlines"]["0,1"], data["outlines"]["2,3"]
    assert len(starts) == len(parameters) == 2
    assert min(y for _, y in parameters[0]) == pytest.approx(0, abs=1e-6)


def test_a_point_outside_its_piece_gives_no_outline():
    _, problem = toy_scene()
    data = page_data(toy_file())
    rows = piece_rows(data["network"], data["tube"], problem, data["sets"][0], 4)
    assert corners_of(rows, np.array([5.0, 5.0, 0.5, 0.5])) is None


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda a: a.update(format="other/1"), "expected an answer of format"),
        (lambda a: a.pop("network"), "complete answer file"),
        (lambda a: a["problem"].update(n_p=3), "planar workspace"),
    ],
)
def test_files_that_are_no_answers_are_refused(tmp_path, change, match):
    answer = copy.deepcopy(toy_file())
    change(answer)
    with pytest.raises(InputError, match=match):
        write_page(save(tmp_path / "answer.json", answer), tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


def test_missing_and_broken_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        write_page(tmp_path / "none.json", tmp_path / "page.html")
    for text in ('{"format": ', "[1, 2]", "\xff"):
        (tmp_path / "broken.json").write_bytes(text.encode("latin-1"))
        with pytest.raises(InputError, match="expected an answer"):
            write_page(tmp_path / "broken.json", tmp_path / "page.html")
