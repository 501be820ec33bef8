"""One interactive page of an answer: a single file that needs no network and no server."""

import json
from pathlib import Path

from parc_jax.errors import InputError
from parc_jax.plot.page_data import page_data
from parc_jax.rollout.files import write_atomic

PARTS = Path(__file__).with_name("page")


def write_page(answer_path, html_path) -> Path:
    """Write the page of an answer.json: scene, time slider, p0 and k by dragging, live verdict, certificates.

    The page computes verdicts in double precision: pictures, not proofs. What it calls proved are the file's own
    samples and sets, as `parc-jax check` verifies them. Raises InputError.
    """
    try:
        answer = json.loads(Path(answer_path).read_bytes())
    except FileNotFoundError:
        raise InputError(f"{answer_path}: no such file.") from None
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"{answer_path}: expected an answer.json; {error}. Save the answer again.") from None
    if not isinstance(answer, dict):
        raise InputError(f"{answer_path}: expected an answer.json; got a {type(answer).__name__}.")
    return write_atomic(html_path, page_of(page_data(answer)).encode())


def page_of(data: dict) -> str:
    """The page around its data."""
    page = (PARTS / "page.html").read_text(encoding="utf-8")
    numbers = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    parts = {"STYLE": "page.css", "MODEL": "model.js", "VIEW": "view.js", "MAIN": "main.js"}
    for mark, name in parts.items():
        page = page.replace(f"/*{mark}*/", (PARTS / name).read_text(encoding="utf-8"))
    return page.replace("/*DATA*/", numbers)
