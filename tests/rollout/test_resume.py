"""Work goes on only with the system, grid and sizes that it was begun with."""

import dataclasses
import types

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_system
from synthetic_plants import noisy, plant, straight_network

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.runs import chunks
from parc_jax.learning.runs.chunks import require_same_runs
from parc_jax.learning.runs.collect import collect, stream_rollouts
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.loaders import load_rollouts
from parc_jax.learning.systems.python_system import python_system

KEY, NET = jax.random.PRNGKey(0), straight_network(4)


@pytest.fixture(scope="module")
def system():
    return plant(noisy)


def with_grid(system, dt_record):
    return dataclasses.replace(system, time=pj.learning.time_grid(0.25, 1.0, dt_record))


def test_another_record_grid_is_refused(system, tmp_path):
    coarse, fine = with_grid(system, 0.25), with_grid(system, 0.025)
    profile = training_profile(NET, collect(fine, KEY, 50, quiet=True), (1, 1))
    score_system(NET, coarse, KEY, profile, 60, path=tmp_path / "scores", quiet=True)
    with pytest.raises(InputError, match="expected the same grid"):
        score_system(NET, fine, KEY, profile, 60, path=tmp_path / "scores", quiet=True)
    collect(coarse, KEY, 20, path=tmp_path / "a.npz", quiet=True)
    with pytest.raises(InputError, match=r"other rollouts.*the same grid"):
        collect(fine, KEY, 20, path=tmp_path / "a.npz", quiet=True)


def test_another_storage_is_refused(system, tmp_path):
    collect(system, KEY, 20, path=tmp_path / "a.npz", quiet=True)
    with pytest.raises(InputError, match="the same dtype"):
        collect(system, KEY, 20, path=tmp_path / "a.npz", dtype=np.float32, quiet=True)


def test_chunks_of_another_version_are_refused(system, tmp_path, monkeypatch):
    list(stream_rollouts(system, KEY, 32, chunk=16, path=tmp_path, quiet=True))
    monkeypatch.setattr(chunks, "__version__", "0.0.1")
    with pytest.raises(InputError, match="the same version"):
        list(stream_rollouts(system, KEY, 32, chunk=16, path=tmp_path, quiet=True))


def moved(by):
    """A plant of other code with the same name and law, wrong by `by` metres."""

    def run(key, k, s):
        p, q = noisy(key, k, s)
        return p + by * s[:, None] ** 2, q

    return run


def test_changed_code_is_refused(system, tmp_path):
    other = plant(moved(1.0))
    list(stream_rollouts(system, KEY, 32, chunk=16, path=tmp_path / "parts", quiet=True))
    with pytest.raises(InputError, match="the same attribute run"):
        list(stream_rollouts(other, KEY, 32, chunk=16, path=tmp_path / "parts", quiet=True))
    collect(system, KEY, 20, path=tmp_path / "a.npz", quiet=True)
    with pytest.raises(InputError, match="the same attribute run"):
        collect(other, KEY, 20, path=tmp_path / "a.npz", quiet=True)


@pytest.fixture
def opaque(system):
    """A plant with a part that nobody sees into."""
    push = types.SimpleNamespace(by=0.0)

    class Opaque:
        name, n_p, n_q, domain, time = "opaque", 2, 0, system.domain, system.time

        def __init__(self):
            self._push = push  # a private attribute: not part of the identity

        def rollout(self, key, k):
            s = jax.numpy.linspace(0.0, 1.0, 21)[:, None]
            return pj.Trajectory(s * k[None] + self._push.by * s**2, k[:0])

    return Opaque(), push


@pytest.mark.slow
def test_stored_runs_are_simulated_again(opaque, tmp_path):
    robot, push = opaque
    list(stream_rollouts(robot, KEY, 32, chunk=16, path=tmp_path / "parts", quiet=True))
    collect(robot, KEY, 20, path=tmp_path / "a.npz", quiet=True)
    list(stream_rollouts(robot, KEY, 64, path=tmp_path / "parts", quiet=True))
    collect(robot, KEY, 20, path=tmp_path / "a.npz", quiet=True)
    push.by = 1.0
    with pytest.raises(InputError, match=r"repeat themselves.*p comes out differently"):
        list(stream_rollouts(robot, KEY, 64, path=tmp_path / "parts", quiet=True))
    with pytest.raises(InputError, match="repeat themselves"):
        collect(robot, KEY, 20, path=tmp_path / "a.npz", quiet=True)


@pytest.mark.parametrize("said", ["attribute slip", "code", "runs"])
def test_finished_runs_of_another_work_are_refused(said, tmp_path):
    """Their first run, which is made again, comes out the same."""
    path, robot = tmp_path / "a.npz", dataclasses.replace(plant(noisy))
    runs = collect(robot, KEY, 20, path=path, quiet=True)
    assert (collect(robot, KEY, 20, path=path, quiet=True).hashes() == runs.hashes()).all()
    if said == "attribute slip":
        object.__setattr__(robot, "slip", 0.1)
    elif said == "runs":  # edited
        with np.load(path) as file:
            arrays = dict(file)
        arrays["p"][19] *= 1.1
        np.savez(path, **arrays)
        with pytest.raises(InputError, match="other rollouts than were made"):
            load_rollouts(path)
    else:  # by hand
        save_rollouts(path, runs)
    with pytest.raises(InputError, match=f"other rollouts.*expected the same .*{said}"):
        collect(robot, KEY, 20, path=path, quiet=True)


def walk(rng, k):
    return np.cumsum(np.vstack([np.zeros(2), k[0] + rng.normal(size=(4, 2))]), axis=0), []


def strided(rng, k):
    p, q = walk(rng, k)
    return 2 * p, q


@pytest.mark.parametrize("change", ["other work", "another number", "changed"])
def test_chunks_from_elsewhere_are_refused(system, tmp_path, change):
    """Beside the first one they were taken as they were: of a calmer plant, say."""

    def run(system, name):
        return list(stream_rollouts(system, KEY, 48, chunk=16, path=tmp_path / name, quiet=True))

    assert len(run(system, "one")) == len(run(system, "one")) == 3
    run(plant(moved(0.001)), "other")
    path = tmp_path / "one" / "chunk_000001.npz"
    if change == "changed":
        with np.load(path) as file:
            arrays = dict(file)
        np.savez(path, **arrays | {"p": 0.5 * arrays["p"]})
    else:
        name = "other/chunk_000001.npz" if change == "other work" else "one/chunk_000002.npz"
        path.write_bytes((tmp_path / name).read_bytes())
    with pytest.raises(InputError, match=r"chunk_000001.npz: expected a chunk of this folder, as"):
        run(system, "one")
    path.write_bytes(path.read_bytes()[:99])  # a damaged one is computed again
    assert len(run(system, "one")) == 3


@pytest.mark.slow
def test_a_plain_function_is_told_by_its_code(tmp_path):
    make = lambda f: python_system(  # noqa: E731
        f, pj.box([0.0], [1.0]), pj.learning.time_grid(0.25, 1.0), name="walk", n_p=2, workers=0
    )
    first = collect(make(walk), KEY, 8, path=tmp_path / "a.npz", quiet=True)
    again = collect(make(walk), KEY, 8, path=tmp_path / "a.npz", quiet=True)
    np.testing.assert_array_equal(first.p, again.p)
    with pytest.raises(InputError, match="attribute simulate"):
        collect(make(strided), KEY, 8, path=tmp_path / "a.npz", quiet=True)


def test_rounding_passes_and_a_millimetre_does_not():
    old = {"p": np.array([[1.0, np.nan, np.inf]])}
    require_same_runs("here", old, {"p": old["p"] + 1e-9}, None)
    with pytest.raises(InputError):
        require_same_runs("here", old, {"p": old["p"] + 1e-3}, None)
    with pytest.raises(InputError):
        require_same_runs("here", old, {"p": np.array([[1.0, 2.0, np.inf]])}, None)
