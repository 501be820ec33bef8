"""One interactive page of an answer or an episode: one file that needs no network and no server."""

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from itertools import combinations
from pathlib import Path

import numpy as np

from parc_jax.answer.answer import Answer, answer_data
from parc_jax.app.plot import shapes
from parc_jax.app.plot.episode import Stage, Truth, rings_of
from parc_jax.app.plot.shapes import span, views_of
from parc_jax.checker import PARTS
from parc_jax.checker.proved import PROVED_JS
from parc_jax.common.spelling import rounded_down
from parc_jax.drive.loop.episode_file import Episode
from parc_jax.learning.bound.error_set import NO_CLAIM
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.body import Disc, numbered
from parc_jax.proof.certificate.prove import corridor_of
from parc_jax.proof.certificate.write import corridor_part, part_hash, question_parts
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.polytopes import Polytopes
from parc_jax.safe_set.separation.directions import Run
from parc_jax.safe_set.separation.pruning import spans_of
from parc_jax.safe_set.verdict.scene import unpruned_scene
from parc_jax.statement import resting_on, set_of

FILES = Path(__file__).with_name("page")
SCRIPTS = ("geometry", "model", "view", "scene", "player", "main", "proof", "episode")
MARKS = {"STYLE": "page.css"} | {name.upper(): f"{name}.js" for name in SCRIPTS}
MAX_ANSWER = 20_000_000  # bytes of an answer that a page carries for the proved checker
DIGITS = 6  # significant digits of an outline: enough for a screen
RATE = 25.0  # [1/s] moments that one can scrub to
DECIMALS = 4  # of a metre


def write_page(
    source: Answer | Episode | str | Path,
    html_path,
    *,
    polytopes: Polytopes | None = None,
    truth: Truth | None = None,
) -> Path:
    """Write the page of an answer, or of an episode in the plane: one file without a server.

    Of an answer: scene, time slider, p0 and k by dragging or typing, live verdict, certificates.
    The page judges in double precision: pictures, not proofs. It calls a plan proved (of an answer
    without a proof: shown in float64) only inside one of the answer's samples, corridors or, where
    they are given, polytopes, which `parc-jax check` verifies. Answers up to 20 MB are stored in
    the page, and a button has the proved checker check them there.

    Of an episode, or of its file, which is checked anew first: from its first manoeuvre on the
    robot, its way, its reachable set until it rests, the obstacles of that proof, and, where the
    file's `meta` has `{"reasons": [[seconds, why], ...]}`, why it went on with the stop in hand.

    polytopes: of `answer.polytopes`, whose outlines are drawn too. truth: the true run of an
    episode. Returns the path. Raises InputError.
    """
    if isinstance(source, Episode | str | Path):
        page = filled("episode.html", episode_data(Stage(source, truth)))
    else:
        answer = json.dumps(answer_data(source, polytopes), separators=(",", ":"))
        parts = {"ANSWER": _within(answer) if len(answer) <= MAX_ANSWER else ""}
        parts["PROVED"] = PROVED_JS.read_text(encoding="utf-8").replace("</script", "<\\/script")
        page = filled("page.html", page_data(source, polytopes), BYTES=str(len(answer)), **parts)
    return write_atomic(html_path, page.encode())


def filled(name: str, data: dict, **parts: str) -> str:
    """A template with its marks: styles and scripts from their files, its data, other parts."""
    parts["DATA"] = _within(json.dumps(data, separators=(",", ":"), allow_nan=False))
    text = (FILES / name).read_text(encoding="utf-8")

    def part(mark: re.Match) -> str:
        given = parts.get(mark[1])
        return (FILES / MARKS[mark[1]]).read_text(encoding="utf-8") if given is None else given

    # in one pass: nothing within a part is taken for a mark
    return re.sub(r"/\*([A-Z]+)\*/", part, text)


def _within(text: str) -> str:
    """JSON that cannot end the script which holds it: `<` occurs in strings only."""
    return text.replace("<", "\\u003c")


def page_data(answer, polytopes=None) -> dict:
    """JSON-able numbers of an answer: scene, network, tube, certificates, and outlines of its
    polytopes, where any are given.
    """
    polytopes = () if polytopes is None else polytopes
    model, problem, asked = answer.model, answer.problem, answer.scene.nominal
    sides = [view.axes for view in views_of(model.n_p)]
    goals = shapes.goals(problem.goal, model.n_p, model.n_points, sides)
    parts = zip(PARTS, question_parts(problem, model), strict=True)
    return {
        **model_data(model, problem),
        "domain": {"lo": answer.scene.k_lo.tolist(), "hi": answer.scene.k_hi.tolist()},
        **_plans(answer, polytopes),
        "rounding": [
            (float(answer.scene.slack) * np.abs(rows.A).sum(axis=1)).tolist()
            for rows in (problem.goal, problem.start)
            if rows is not None
        ],
        "system": model.system,
        "labels": model.labels._asdict() | {"p": shapes.axes_of(answer)},
        "box": answer.scene.box_of_k,
        "level": answer.status.label,
        "absence": "" if answer.absence is None else answer.absence.details(),
        "at": None if asked.at is None else asked.at.tolist(),
        "doubt": asked.uncertainty is not None,
        "about": resting_on(asked),
        "statement": answer.details(),
        "claim": in_short(model.claim),
        "hash": {name: part_hash(part) for name, part in parts},
        "share": polytopes.coverage.at_least if polytopes else 0.0,
        "corridor_share": answer.coverage.at_least,
        "sure": {
            word: rounded_down(str(of.coverage.confidence), 10)
            for word, of in (("corridor", answer), ("polytope", polytopes))
            if of
        },
        "set": set_of(answer),
        "views": [view._asdict() for view in views_of(model.n_p)],
        "goal_box": {"lo": answer.scene.z_lo.tolist(), "hi": answer.scene.z_hi.tolist()},
        "goals": [
            {"points": points, "outlines": [outline.tolist() for outline in outlines]}
            for points, outlines in goals
        ],
        "outlines": outlines(answer, polytopes),
    }


def model_data(model, problem) -> dict:
    """Data of the page's verdict on a plan: network, tube, body, goal, start, obstacles."""
    tube, faces = model.tube, model.tube.templates
    lost = tube.support_at_end(problem.goal.A, np.arange(tube.n_bins)).tolist()
    return {
        "n_p": model.n_p,
        "n_k": model.n_k,
        "points": model.points,
        "steps": model.time.n_steps,
        "dt": model.time.dt,
        "domain": {"lo": model.domain.lo.tolist(), "hi": model.domain.hi.tolist()},
        "goal": _rows(problem.goal),
        "start": None if problem.start is None else _rows(problem.start),
        "parts": [_part(part, model.n_p) for part in numbered(problem.body, model.points)],
        "obstacles": _obstacles(problem, model.time.n_steps, views_of(model.n_p)),
        "network": {
            "weights": [W.tolist() for W in model.net.weights],
            "biases": [b.tolist() for b in model.net.biases],
        },
        "tube": {
            "edges": [edge.tolist() for edge in map(np.asarray, tube.edges)],
            "interval": tube.finite_widths[0].tolist(),
            "faces": None if faces is None else _faces(faces.interval),
            "lost": [row if ok else None for row, ok in zip(lost, tube.claimed, strict=True)],
        },
    }


def _plans(answer, polytopes) -> dict:
    """Samples, corridors and polytopes, with their directions by number."""
    n_p, problem = answer.model.n_p, answer.problem
    scene = unpruned_scene(answer.scene)
    numbers: dict[bytes, int] = {}
    directions: list[list] = []  # each once: the runs of every obstacle and part of the body

    def sep(corridor: Corridor) -> int:
        w, support = (np.asarray(part, np.float64) for part in (corridor.w, corridor.support))
        content = w.tobytes() + support.tobytes()
        if content not in numbers:
            numbers[content] = len(directions)
            pairs = zip(w, support, corridor.runs, strict=False)  # rows behind the pairs only pad
            directions.append([_runs(*pair) for pair in pairs])
        return numbers[content]

    def unpruned(one: Corridor) -> Corridor:
        return one if one.apart is None else corridor_of(scene, corridor_part(one, problem))

    plans = zip(answer.samples, answer.certificates, strict=True)
    return {
        "samples": [
            {"p0": x[:n_p].tolist(), "k": x[n_p:].tolist(), "sep": sep(corridor_of(scene, proof))}
            for x, proof in plans
        ],
        "corridors": [{"sep": sep(unpruned(corridor))} for corridor in answer.corridors],
        "polytopes": [
            {
                "sep": sep(unpruned(polytope.corridor)),
                "bin": int(polytope.bin),
                "pattern": "".join("1" if on else "0" for on in polytope.pattern),
            }
            for polytope in polytopes
        ],
        "directions": directions,
    }


def _runs(w: np.ndarray, support: np.ndarray, runs: Sequence[Run]) -> list[list]:
    """[first, end, w, support of obstacle and part along w] of each run of a pair."""
    return [[*run[:2], w[run.first].tolist(), float(support[run.first])] for run in runs]


def outlines(answer, polytopes) -> dict[str, list]:
    """Per pair of coordinates of (p0, k), written "i,j", the outlines [[x, y], ...] of the safe
    polytopes, if any: of every view of the workspace, and of all pairs of parameters.
    """
    n_p, n_k = answer.model.n_p, answer.model.n_k
    sides = [view.axes for view in views_of(n_p)]
    pairs = [*sides, *((n_p + i, n_p + j) for i, j in combinations(range(n_k), 2))]
    return {
        f"{i},{j}": [
            [[float(f"{x:.{DIGITS}g}") for x in place] for place in shapes.hull(points)]
            for points in (polytopes.project((i, j)) if polytopes else ())
        ]
        for i, j in pairs
    }


def _faces(faces) -> dict:
    return {
        "directions": faces.directions.tolist(),
        "centre": faces.centre.tolist(),
        "half": np.minimum(faces.half, NO_CLAIM).tolist(),
    }


def _part(part, n_p: int) -> dict:
    """A part: its points by number, and the hull of the shape and the radius that grow it."""
    disc = isinstance(part.shape, Disc)
    return {
        "points": list(part.points),
        "shape": [[0.0] * n_p] if disc else part.shape.vertices.tolist(),
        "radius": float(part.shape.radius) if disc else 0.0,
    }


def _obstacles(problem, n_steps: int, views) -> list[dict]:
    """Corners, an outline for every view, first and last interval."""
    pairs = zip(map(shapes.corners_of, problem.obstacles), spans_of(problem, n_steps), strict=True)
    return [
        {
            "vertices": v.tolist(),
            "outlines": [shapes.hull(view.of(v)).tolist() for view in views],
            "steps": [int(step) for step in steps],
        }
        for v, steps in pairs
    ]


def _rows(polytope) -> dict:
    return {"A": polytope.A.tolist(), "b": polytope.b.tolist()}


def episode_data(stage: Stage) -> dict:
    """JSON-able numbers of an episode, in metres and in seconds of the loop's clock."""
    lo, hi = span(*(one.tube for one in stage.shown))
    truth = Truth(np.zeros(0), np.zeros((0, 3))) if stage.truth is None else stage.truth
    return {
        "name": stage.name,
        "statement": stage.driven.statement,
        "k": stage.driven.model.labels.k,
        "step": 1 / RATE,
        "begin": stage.begin,
        "reach": float(stage.reach),
        "lo": lo.tolist(),
        "hi": hi.tolist(),
        "true": stage.truth is not None,
        "doubt": stage.driven.copies > 1,
        "notes": "".join(f" {note.capitalize()}: see the statement." for note in stage.notes),
        "moments": [
            {"time": float(now.time), "number": now.number}
            | {"body": _rounded(now.body), "middle": _rounded(now.middle)}
            for now in map(stage.at, stage.times(RATE))
        ],
        "manoeuvres": [
            {
                "begin": one.begin,
                "end": one.end,
                "k": one.k.tolist(),
                "tube": _rounded(one.tube),
                "obstacles": _rounded(one.obstacles),
                "rest": _rounded(one.rest),
            }
            for one in stage.shown
        ],
        "obstacles": [len(one.problem.obstacles) for one in stage.driven.manoeuvres],
        "spans": [any(one.problem.all_spans) for one in stage.driven.manoeuvres],
        "standing": _rounded(truth.standing),
        "seen": [[float(time), [*map(_rounded, rings_of(region))]] for time, region in truth.free],
        "reasons": reasons(stage.driven.meta),
    }


def reasons(meta) -> list[tuple[float, str]]:
    """Times [s] without a new manoeuvre, and why, in order, from unchecked meta: the valid ones."""
    pairs, told = [], meta.get("reasons") if isinstance(meta, dict) else None
    for one in told if isinstance(told, list | tuple) else ():
        with suppress(TypeError, ValueError, OverflowError):
            time, why = one
            pairs.append((float(time), str(why)))
    return sorted(one for one in pairs if np.isfinite(one[0]))


def _rounded(places) -> list:
    """Outlines (v, 2), or one place, rounded for a screen."""
    return [np.round(np.asarray(place), DECIMALS).tolist() for place in places]
