"""The main job end to end on a toy system: files, exit codes, output modes."""

import json
import shutil
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import toy_query

import parc_jax as pj
from parc_jax import checker
from parc_jax.app.cli import main
from parc_jax.app.cli.process import COMPILING, SEARCHING
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.study.job import run_study
from parc_jax.app.study.report import Studied, _replayed, explained, report
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.learning.bound import measure, pipeline
from parc_jax.learning.bound.counts import required_runs
from parc_jax.learning.bound.settings import BoundSettings, ModelBound
from parc_jax.learning.model import load

KEY = jax.random.PRNGKey(0)

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))


def run(*arguments) -> int:
    with pytest.raises(SystemExit) as stop:
        main(["run", "toy_system", "--no-cache", *map(str, arguments)])
    return stop.value.code


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One complete run: folder, exit code."""
    out = tmp_path_factory.mktemp("study") / "cart"
    return out, run("--out", out, "--quiet")


@pytest.mark.smoke
def test_all_files_are_written_and_accepted(finished, capsys):
    out, code = finished
    assert code == 0
    written = {f.name for f in out.iterdir()}
    pictures = {f"{name}.{kind}" for name in ("samples", "regions") for kind in ("png", "pdf")}
    assert (
        written == {"model.npz", "answer.json", "metrics.json"} | pictures
    )  # and no unfinished work
    assert checker.main([str(out / "answer.json")]) == 0
    capsys.readouterr()


class Hall:
    """Gusts on one plant, none on the other."""

    name, n_p, n_q = "hall", 2, 0
    domain, time = pj.box([0.5, -0.5], [1.0, 0.5]), pj.learning.time_grid(0.25, 1.0, 0.05)

    def __init__(self, plant):
        self.plant = plant

    def rollout(self, key, k):
        s = jnp.linspace(0.0, 1.0, 21)[:, None]
        gust = 0.01 * jax.random.normal(key, (2,)) if self.plant == "windy" else 0.001 * k
        return pj.Trajectory(s * k[None] + s**2 * jnp.broadcast_to(gust, (1, 2)), k[:0])


def test_a_replay_says_what_was_tried_on_its_own_plant(tmp_path):
    """Its twenty runs of a plan were one run, and it said what (E) assumes of the other plant."""
    goal, wall = pj.box([0.6, -0.35], [1.4, 0.35]), pj.box([0.2, 0.35], [0.5, 0.6])
    problem = pj.reach_avoid(goal, [wall], 0.05)
    few = {"rollouts": 100, "hidden": (4,), "seeds": 1, "steps": 100, "profile_runs": 50}
    asked = Study().replace(eps=0.1, delta=0.05, repeats=4, samples=3, driven=False, **few)
    options = {"quiet": True, "learn_from": Hall("windy")}
    done = run_study(Hall("still"), problem, asked, tmp_path, 0, **options)
    told = report(done, tmp_path)
    assert "of their plant, and TRANSLATION_INVARIANCE(within 1e-05; not measured), NO_DIST" in told
    assert told.split("Replay")[0].count("NO_DISTURBANCE") == 0
    assert "NO_DISTURBANCE(of 8 k" in explained(tmp_path)


@pytest.mark.smoke
def test_metrics_tell_what_was_claimed_and_replayed(finished):
    out, _ = finished
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["claim"]["looks"] == 1 and len(metrics["claim"]["bin_eps"]) == 2
    seen = metrics["replay"]
    assert (seen["plans"], seen["repeats"], seen["runs"]) == (5, 20, 100)
    assert (
        seen["failed"] == sum(seen["failure_by_plan"])
        and seen["reached"] + seen["failed"] >= seen["runs"]
    )
    if (
        seen["failed"] == 0
    ):  # Clopper-Pearson without failures is 1 - delta^(1/n); the two bounds share delta
        assert seen["failure_mean_at_most"] == pytest.approx(1 - 0.025 ** (1 / 100), rel=1e-6)
        assert seen["every_plan_at_most"] == pytest.approx(1 - 0.005 ** (1 / 20), rel=1e-6)
    model = load(out / "model.npz", "cart")
    assert model.claim.bin_eps is not None and model.tube.claimed.all()


def test_runs_made_again_are_told_however_often_a_plan_was_run():
    many = {"repeats": 20, "runs": 100, "failed": 0, "lost": 2, "confidence": 0.95}
    many |= {"plans": 5, "reached": 5, "touched": 0, "left_tube": 0, "worst_plan_failed": 0}
    many |= {"failure_mean_at_most": 0.1, "every_plan_at_most": 0.2}
    many["law"], claim = "toy (plant = mjx)", toy_query.answer().model.claim
    for told in (many, many | {"repeats": 1, "runs": 5}):
        said = "\n".join(_replayed(told, claim))
        assert ", of toy (plant = mjx): 5 reached" in said and "(claimed of toy (" in said
        assert "assume" in said and "WORKERS_LOST(2, independent of the run)" in said
        assert "LOST" not in "\n".join(_replayed(told | {"lost": 0}, claim))


@pytest.mark.slow
def test_the_end_of_a_run_says_how_often_a_new_run_of_its_plan_fails(tmp_path):
    driven = {"plan": [0.5, -0.25, 0.75, -0.5], "runs": 1000, "failures": 2}
    driven |= {"sure": "0.9995", "at_most": "0.013", "law": "toy (plant = mjx)", "beside": []}
    metrics = {"replay": None, "driven": driven}
    told = report(Studied(toy_query.answer(), None, None, metrics), tmp_path)
    assert (
        "; 2 of 1,000 fresh runs of toy (plant = mjx) failed: with confidence 0.9995 a new one does"
        in told
    )
    assert "with probability <= 0.013." in told
    driven["beside"] = ["WORKERS_LOST(4, independent of the run)"]
    told = report(Studied(toy_query.answer(), None, None, metrics), tmp_path)
    assert "<= 0.013; assumed beside: WORKERS_LOST(4, independent of the run)." in told


def test_a_plan_of_another_scene_is_not_explained_beside_an_answer(finished, tmp_path):
    out, _ = finished
    folder = shutil.copytree(out, tmp_path / "cart")
    metrics = json.loads((folder / "metrics.json").read_text())
    written = json.dumps(metrics | {"driven": {"statement": "(D) This very plan ..."}})
    (folder / "metrics.json").write_text(written)
    replayed = "which nothing checks:\nReplay: "  # `run` printed it, and said that all is here
    assert replayed in explained(folder) and "\n(D) This very plan" in explained(folder)
    problem, planner = load_answer(out / "answer.json").problem, pj.Planner(load(out / "model.npz"))
    few = pj.Settings(samples=2)
    planner.solve(problem, KEY, few).save(folder / "answer.json")
    assert "(D)" in explained(folder) and "Replay" not in explained(folder)  # of other plans
    planner.solve(problem.replace(obstacles=()), KEY, few).save(folder / "answer.json")
    with pytest.raises(InputError, match=r"metrics\.json: expected numbers of the claim, problem"):
        explained(folder)


def test_the_fresh_runs_are_enough_for_every_bin(finished):
    out, _ = finished
    claim = load(out / "model.npz").claim
    assert min(claim.evidence["bin_runs"]) >= required_runs(0.1, 0.05 / 2, 0)


@pytest.mark.night
def test_same_seed_same_model_and_json_alone_on_stdout(finished, tmp_path, capsys):
    out, _ = finished
    capsys.readouterr()
    assert run("--out", tmp_path / "again", "--quiet", "--json", "--no-figures") == 0
    printed = capsys.readouterr()
    metrics = json.loads(printed.out)
    assert printed.err == ""
    assert metrics["system"] == "cart" and "figures" not in metrics
    first, again = load(out / "model.npz"), load(tmp_path / "again" / "model.npz")
    assert again.net.hash == first.net.hash and again.tube.hash == first.tube.hash


def test_a_saved_model_skips_learning(finished, tmp_path, capsys):
    out, _ = finished
    for name in ("regions.png", "samples.pdf"):  # of an older study, of another claim and scene
        shutil.copy(out / name, tmp_path)
    assert run("--model", out / "model.npz", "--out", tmp_path, "--no-figures") == 0
    assert not [*tmp_path.glob("*.p*")]
    assert "training" not in json.loads((tmp_path / "metrics.json").read_text())["stages"]
    printed = capsys.readouterr()
    assert "fresh rollouts" not in printed.out
    for line in (COMPILING, SEARCHING):
        assert f"{line} ...\n" in printed.err  # as `solve` says


@pytest.mark.slow
def test_stopped_run_goes_on_with_the_same_numbers(tmp_path, capsys, monkeypatch):
    """Stopped at the third chunk of the fresh runs, started again: chunks are reused, and the claim
    is the same.
    """
    scored, real = [], measure.score_arrays

    def stop_at_third(*arguments):
        scored.append(1)
        if len(scored) == 3:
            raise KeyboardInterrupt
        return real(*arguments)

    monkeypatch.setattr(measure, "score_arrays", stop_at_third)
    assert run("--out", tmp_path, "--quiet", "--fresh", 2000) == 130
    assert "continues" in capsys.readouterr().err
    kept = sorted((tmp_path / "unfinished" / "fresh").glob("chunk_*.npz"))
    assert kept and not (tmp_path / "answer.json").exists()
    before = {f: f.stat().st_mtime_ns for f in kept}
    seen_again = []

    def watch(*arguments):
        seen_again.append({f for f in kept if f.exists() and f.stat().st_mtime_ns == before[f]})
        return real(*arguments)

    monkeypatch.setattr(measure, "score_arrays", watch)
    assert run("--out", tmp_path, "--quiet", "--fresh", 2000, "--no-figures") == 0
    assert seen_again[-1] == set(kept)  # not one was computed again
    assert not (tmp_path / "unfinished").exists()
    monkeypatch.setattr(measure, "score_arrays", real)
    assert run("--out", tmp_path / "whole", "--quiet", "--fresh", 2000, "--no-figures") == 0
    assert (
        load(tmp_path / "model.npz").tube.hash == load(tmp_path / "whole" / "model.npz").tube.hash
    )


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--repeats", "0"), "repeats"),
        (("--discard", "-1"), "discard"),
        (("--fresh", "30"), "calibrate_bins"),
        (("--plant", "mjx"), "plant"),
    ],
)
def test_bad_input_is_refused_with_code_2(arguments, word, tmp_path, capsys):
    assert run("--out", tmp_path, "--quiet", "--no-figures", *arguments) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and word in said and "expected" in said


def test_settings_are_checked():
    assert Study().claims.claims == ("one",)
    assert Study().replace(blocks=(2,)).claims.claims == ("bins",)
    with pytest.raises(InputError, match="claims"):
        BoundSettings(claims=())
    for tail in ("tube", 1.0):
        with pytest.raises(InputError, match=r"^tail: expected a power of at least 2, or None"):
            Study(tail=tail)
    for discard in (-1, 0.5, "all"):
        with pytest.raises(InputError, match="discard"):
            Study(bound=ModelBound(discard=discard))


def test_fresh_runs_grow_with_the_smallest_bin():
    from parc_jax.learning.bound.tube import tube

    def profile(edges):
        n = len(edges) - 1
        return tube([edges, [0.0, 1.0]], np.ones((n, 4, 2)), np.ones((n, 2)))

    asked = BoundSettings(eps=0.1, delta=0.05, claims=("bins",))
    even, uneven = profile([0.0, 0.5, 1.0]), profile([0.0, 0.1, 1.0])
    assert pipeline.fresh_runs(asked, uneven, 1) == pytest.approx(
        5 * pipeline.fresh_runs(asked, even, 1), abs=8
    )
    one = BoundSettings(eps=0.1, delta=0.05)
    assert pipeline.fresh_runs(one, even, 1) == required_runs(0.1, 0.05, 0)
    assert pipeline.fresh_runs(Study().replace(fresh=77).claims, even, 1) == 77
