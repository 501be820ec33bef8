"""One interactive page of an answer: a single file that needs no network and no server."""

import json
import re
from pathlib import Path

from parc_jax.answer.answer import answer_data
from parc_jax.app.plot.page_data import page_data
from parc_jax.checker.proved import PROVED_JS
from parc_jax.learning.runs.files import write_atomic

PARTS = Path(__file__).with_name("page")
MARKS = {
    "STYLE": "page.css",
    "GEOMETRY": "geometry.js",
    "MODEL": "model.js",
    "VIEW": "view.js",
    "SCENE": "scene.js",
    "PLAYER": "player.js",
    "MAIN": "main.js",
    "PROOF": "proof.js",
    "EPISODE": "episode.js",
}
MAX_ANSWER = 20_000_000  # bytes of an answer that a page carries for the proved checker


def write_page(answer, html_path, polytopes=None) -> Path:
    """Write the page of an answer: scene, time slider, p0 and k by dragging or typing, live
    verdict, certificates.

    The page judges in double precision: pictures, not proofs. What it calls proved are plans that
    satisfy one of the answer's samples, corridors or, where they are given, polytopes, which
    `parc-jax check` verifies. Answers up to 20 MB are in the page, and a button has the proved
    checker check them there. polytopes: of `answer.polytopes`, whose outlines are drawn too.
    Raises InputError.
    """
    whole = json.dumps(answer_data(answer, polytopes), separators=(",", ":"))
    return write_atomic(html_path, page_of(page_data(answer, polytopes), whole).encode())


def page_of(data: dict, whole: str) -> str:
    """The page around its data and the text of the answer's file."""
    return filled(
        "page.html",
        data,
        PROVED=PROVED_JS.read_text(encoding="utf-8").replace("</script", "<\\/script"),
        ANSWER=_within(whole) if len(whole) <= MAX_ANSWER else "",
        BYTES=str(len(whole)),
    )


def filled(name: str, data: dict, **parts: str) -> str:
    """A template with its marks: styles and scripts from their files, its data, other parts."""
    parts["DATA"] = _within(json.dumps(data, separators=(",", ":"), allow_nan=False))
    text = (PARTS / name).read_text(encoding="utf-8")

    def part(mark: re.Match) -> str:
        own = parts.get(mark[1])
        return (PARTS / MARKS[mark[1]]).read_text(encoding="utf-8") if own is None else own

    # in one pass: nothing within a part is taken for a mark
    return re.sub(r"/\*([A-Z]+)\*/", part, text)


def _within(text: str) -> str:
    """JSON that cannot end the script which holds it: `<` occurs in strings only."""
    return text.replace("<", "\\u003c")
