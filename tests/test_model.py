"""The model of a system: what it shows of itself, and what it refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest
from toy_models import line_model, random_model

import parc_jax as pj
from parc_jax.common.spelling import hex_text
from parc_jax.learning.system import TURNS


def test_a_model_is_one_short_line():
    model = random_model(np.random.default_rng(1), 4, (6, 5), (1, 2), 0.02)
    text = repr(model)
    assert len(text) < 300 and "\n" not in text
    assert "6-5" in text and "assumed" in text and "2 bins" in text
    assert len(repr(model.net)) < 60


def small():
    return random_model(np.random.default_rng(1), 4, (6, 5), (1, 2), 0.02)


LARGER = pj.box([-2, -2], [2, 2])


def test_a_model_is_a_network_and_a_claim_and_nothing_else():
    """K, time, points and rotation are those of the claim: there is no way to say otherwise."""
    model = small()
    about = model.claim.subject
    said = (model.domain, model.time, model.system, model.labels, model.points, model.rotation)
    of_claim = (about.domain, about.time, about.system, about.labels, about.points, about.rotation)
    assert said == of_claim
    for part in ("domain", "time", "system", "labels", "points", "rotation"):
        with pytest.raises(TypeError):
            replace(model, **{part: getattr(model, part)})


def test_a_claim_with_a_part_from_elsewhere_makes_no_planner():
    """The claim about K = [-1, 1]^2 beside another K, grid, tube, network or rotation."""
    model = small()
    claim, about = model.claim, model.claim.subject
    narrow = replace(model.tube, interval=model.tube.interval * 1e-3)
    wide = pj.learning.tube([[-2, 2], [-2, 0, 2]], model.tube.interval, model.tube.final)
    others = [
        replace(claim, tube=narrow),
        replace(claim, tube=wide, subject=replace(about, domain=LARGER)),
        replace(claim, subject=replace(about, time=pj.learning.time_grid(0.5, 2.0))),
        replace(claim, subject=replace(about, points=("nose",))),
        replace(claim, subject=replace(about, rotation=(TURNS,))),
        replace(claim, network=line_model().net.hash),
    ]
    for other in others:
        with pytest.raises(pj.InputError, match="made about"):
            pj.learning.trajectory_model(model.net, other)
        with pytest.raises(pj.InputError, match="made about"):
            pj.Planner(model.replace(claim=other))
    net = pj.learning.relu_network(model.net.weights, [b + 1 for b in model.net.biases])
    for make in (
        lambda: pj.learning.trajectory_model(net, claim),
        lambda: pj.Planner(model.replace(net=net)),
    ):
        with pytest.raises(pj.InputError, match="network its claim was measured on"):
            make()


EDITS = {
    "K": lambda s: s | {"domain": {"lo": hex_text([-2, -2]), "hi": hex_text([2, 2])}},
    "time grid": lambda s: s | {"time": hex_text([0.5, 2.0, 0.5])},
    "points": lambda s: s | {"points": ["nose"]},
    "rotation": lambda s: s | {"rotation": ["turns"]},
    "system": lambda s: s | {"system": "another"},
}


def edited(path, arrays=None, subject=None):
    """The model file with other arrays, or another subject of its claim."""
    with np.load(path) as file:
        kept = dict(file) | (arrays or {})
    meta = json.loads(str(kept["meta"]))
    if subject is not None:
        meta["claim"]["subject"] = subject(meta["claim"]["subject"])
    other = path.with_name("edited.npz")
    np.savez(other, **(kept | {"meta": np.array(json.dumps(meta))}))
    return other


@pytest.mark.parametrize("part", EDITS)
def test_a_file_that_was_edited_by_hand_is_refused(part, tmp_path):
    path = small().save(tmp_path / "model.npz")
    assert pj.load(edited(path)).claim.hash == pj.load(path).claim.hash
    spanning = {"edges0": np.array([-2.0, 2.0]), "edges1": np.array([-2.0, 0.0, 2.0])}
    with pytest.raises(pj.InputError, match="made about"):
        pj.load(edited(path, spanning if part == "K" else None, EDITS[part]))


def test_names_that_were_exchanged_by_hand_are_refused(tmp_path):
    named = small().with_labels({"k": ("speed [m/s]", "steer [rad]")})
    path = named.save(tmp_path / "model.npz")
    assert pj.load(edited(path)).labels.k == ("speed [m/s]", "steer [rad]")

    def exchanged(about):
        return about | {"labels": about["labels"] | {"k": about["labels"]["k"][::-1]}}

    def without_hash(about):
        return {name: value for name, value in exchanged(about).items() if name != "labels_hash"}

    for edit in (exchanged, without_hash):
        with pytest.raises(pj.InputError, match="labels: expected those that were written"):
            pj.load(edited(path, None, edit))


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("k", ("steer [m/s]", "speed [rad]")),  # each the name of the other column
        ("k", ("turn [m/s]", "speed [rad]")),
        ("k", ("speed [km/h]", "steer [rad]")),
        ("k", ("speed", "steer [rad]")),
    ],
)
def test_a_new_label_is_of_the_same_column_in_its_unit(part, words):
    named = small().with_labels({"k": ("speed [m/s]", "steer [rad]")})
    with pytest.raises(pj.InputError, match="in its unit and with no other's name; got"):
        named.with_labels({part: words})
    with pytest.raises(pj.InputError, match=r"column 'k0', in its unit .* got 'k1'"):
        small().with_labels({"k": ("k1", "k0")})
    wheels = small().with_labels({"k": ("left wheel [m/s]", "right wheel [m/s]")})
    for other in ("Right wheel [m/s]", "right [m/s]", "v_right [m/s]"):
        with pytest.raises(pj.InputError, match=r"column 'left wheel .*with no other's name"):
            wheels.with_labels({"k": (other, "v [m/s]")})
    assert wheels.with_labels({"k": ("v_left [m/s]", "wheel 2 [m/s]")}).n_k == 2
    assert named.with_labels({"k": ("v [m/s]", "steer [rad]")}).labels.k[0] == "v [m/s]"


def test_a_model_is_asked_for_by_the_name_of_its_system(tmp_path):
    path = small().save(tmp_path / "model.npz")
    assert pj.load(path, system=small().system).claim.hash == small().claim.hash
    with pytest.raises(pj.InputError, match="load: system, the name of one: expected str"):
        pj.load(path, system=small())


ODD = {
    "eps": "1/10x",
    "delta": "1/0",
    "bin_eps": ["1/x"],
    "intersample": ["0x1p-3x"],
    "subject": {"time": ["0x1p-3x", "1", "1"]},
    "law": {"parameters": [["a"]]},
}


@pytest.mark.parametrize("part", ODD)
def test_values_that_cannot_be_read_end_in_one_sentence(part, tmp_path):
    path = small().save(tmp_path / "model.npz")
    with np.load(path) as file:
        kept = dict(file)
    meta, value = json.loads(str(kept["meta"])), ODD[part]
    value = meta["claim"][part] | value if isinstance(value, dict) else value
    meta["claim"][part] = value
    np.savez(path, **(kept | {"meta": np.array(json.dumps(meta))}))
    with pytest.raises(pj.InputError, match=r"^claim: expected .*\.$"):
        pj.load(path)


def test_a_tube_or_network_of_another_file_is_refused(tmp_path):
    model = small()
    path = model.save(tmp_path / "model.npz")
    with pytest.raises(pj.InputError, match="made about"):
        pj.load(edited(path, {"interval": model.tube.interval * 1e-3}))
    with pytest.raises(pj.InputError, match="network its claim was measured on"):
        pj.load(edited(path, {"b0": model.net.biases[0] + 1}))


def test_a_file_of_an_older_format_is_refused(tmp_path):
    path = small().save(tmp_path / "model.npz")
    old = {"meta": np.array(json.dumps({"format": "parc_jax.model/1"}))}
    np.savez(tmp_path / "old.npz", **(dict(np.load(path)) | old))
    with pytest.raises(pj.InputError, match=r"format parc_jax\.model/2; got 'parc_jax\.model/1'"):
        pj.load(tmp_path / "old.npz")


def test_a_saved_model_comes_back_equal(tmp_path):
    model = random_model(np.random.default_rng(1), 4, (6, 5, 6), (1, 2), 0.02)
    again = pj.load(model.save(tmp_path / "model.npz"))
    assert again.net.hash == model.net.hash and again.tube.hash == model.tube.hash
    assert (again.time, again.system) == (model.time, model.system)
    assert (again.domain.lo == model.domain.lo).all() and (again.domain.hi == model.domain.hi).all()
    assert again.claim.to_json() == model.claim.to_json()
