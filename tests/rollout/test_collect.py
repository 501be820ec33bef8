"""Rows depend on (key, stage, row) alone; killed runs continue; failures stay."""

import re
import threading
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import disturbed, failing, noisy, plant

from parc_jax.common.errors import InputError
from parc_jax.common.keys import SEEDS, Stage, folded, key_of, stream
from parc_jax.learning.bound.start_gap import translation_gap
from parc_jax.learning.runs import collect as collecting
from parc_jax.learning.runs.chunks import run_chunks
from parc_jax.learning.runs.collect import collect, stream_rollouts
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.system import Trajectory

KEY = jax.random.PRNGKey(3)


@pytest.fixture(scope="module")
def system():
    return plant(noisy)


def equal(a, b):
    return all(
        np.array_equal(getattr(a, f), getattr(b, f), equal_nan=True)
        for f in ("rows", "k", "p", "q")
    )


def test_rows_do_not_depend_on_chunking_or_on_how_many_are_asked_for(system):
    whole = collect(system, KEY, 300, chunk=64, quiet=True)
    other = collect(system, KEY, 300, chunk=32, quiet=True)
    np.testing.assert_array_equal(whole.k, other.k)
    np.testing.assert_allclose(
        whole.p, other.p, rtol=0, atol=1e-14
    )  # another program may round differently
    assert equal(collect(system, KEY, 70, chunk=64, quiet=True), whole.select(slice(70)))
    tail = collect(system, KEY, 108, first_row=192, chunk=64, quiet=True)
    assert equal(tail, whole.select(slice(192, None)))


def test_the_users_dtype_flag_changes_nothing(system):
    wide = collect(system, KEY, 20, quiet=True)
    with jax.enable_x64(False):
        narrow = collect(system, jax.random.PRNGKey(3), 20, quiet=True)
    assert equal(wide, narrow) and wide.p.dtype == np.float64


def test_stages_share_no_numbers(system):
    train, bound = (
        collect(system, KEY, 64, stage, quiet=True) for stage in (Stage.TRAIN, Stage.BOUND)
    )
    assert not np.isin(train.k, bound.k).any()
    assert len(np.unique(np.concatenate([train.hashes(), bound.hashes()]))) == 128


def test_parameters_are_uniform_on_the_domain(system):
    k = collect(system, KEY, 4000, quiet=True).k
    assert system.domain.contains(k).all()
    for axis in range(2):
        counts = np.histogram(k[:, axis], bins=10, range=(0, 1))[0]
        assert ((counts - 400) ** 2 / 400).sum() < 33  # chi-squared, 9 degrees: 1e-4


def test_k_and_disturbance_are_independent():
    runs = collect(plant(disturbed), KEY, 2000, quiet=True)
    error = runs.p[:, -1] - runs.k
    correlation = np.corrcoef(np.concatenate([runs.k, error], axis=1).T)
    assert np.abs(correlation[:2, 2:]).max() < 4 / np.sqrt(2000)


def test_given_and_sampled_parameters_are_run_as_they_are(system):
    rows = np.random.default_rng(0).uniform(size=(40, 2))
    np.testing.assert_array_equal(collect(system, KEY, 40, k=rows, chunk=16, quiet=True).k, rows)
    one = collect(system, KEY, 5, k=[0.25, 0.5], quiet=True)
    assert (one.k == [0.25, 0.5]).all() and len(
        np.unique(one.p[:, -1, 0])
    ) == 5  # fresh disturbances
    corner = collect(system, KEY, 30, k=lambda key: 0.5 * jax.random.uniform(key, (2,)), quiet=True)
    assert corner.k.max() < 0.5 and corner.law.k_law != "uniform"
    with pytest.raises(InputError, match="inside the domain"):
        collect(system, KEY, 5, k=[2.0, 0.5], quiet=True)


@pytest.mark.parametrize("dtype", [np.float16, np.int32, "float16", np.longdouble, bool, "x", 3])
def test_places_are_stored_in_single_or_double(system, dtype):
    """Anything shorter would round metres off places that no allowance covers."""
    with pytest.raises(InputError, match="dtype: expected float64 or float32; got"):
        collect(system, KEY, 5, dtype=dtype, quiet=True)
    for good in (np.float32, "float32", np.dtype("float32"), jnp.float32):
        assert collect(system, KEY, 5, dtype=good, quiet=True).p.dtype == np.float32


def test_failed_runs_stay_and_are_counted():
    batch = collect(plant(failing), KEY, 400, quiet=True)
    assert batch.n == 400 and 5 < batch.failed.sum() < 45


def test_an_interrupted_run_continues_with_the_same_numbers(system, tmp_path, monkeypatch):
    path, whole, calls = tmp_path / "train.npz", collect(system, KEY, 160, chunk=16, quiet=True), []
    simulate_rows = collecting.simulate_rows

    def interrupted(*args):
        calls.append(args[3][0])
        if len(calls) == 5:
            raise KeyboardInterrupt
        return simulate_rows(*args)

    monkeypatch.setattr(collecting, "simulate_rows", interrupted)
    with pytest.raises(KeyboardInterrupt):
        collect(system, KEY, 160, chunk=16, path=path, quiet=True)
    assert not path.exists() and len(list(Path(f"{path}.parts").glob("chunk_*"))) >= 3
    calls[:] = range(100)  # no more interruptions; count again
    assert equal(
        collect(system, KEY, 160, path=path, quiet=True), whole
    )  # the chunk size is remembered
    assert len(calls) - 100 <= 7 and path.exists() and not Path(f"{path}.parts").exists()
    assert equal(collect(system, KEY, 160, path=path, quiet=True), whole)
    with pytest.raises(InputError, match="other rollouts"):
        collect(system, jax.random.PRNGKey(4), 160, path=path, quiet=True)


def test_a_folder_of_other_work_is_refused_and_a_damaged_chunk_is_computed_again(system, tmp_path):
    first = concatenate(stream_rollouts(system, KEY, 64, chunk=16, path=tmp_path, quiet=True))
    (tmp_path / "chunk_000001.npz").write_bytes(b"half a file")
    assert equal(concatenate(stream_rollouts(system, KEY, 64, path=tmp_path, quiet=True)), first)
    with pytest.raises(InputError, match="seed"):
        list(stream_rollouts(system, jax.random.PRNGKey(9), 64, path=tmp_path, quiet=True))


def test_new_style_keys_are_the_same_keys(system):
    assert equal(
        collect(system, jax.random.key(3), 20, quiet=True), collect(system, KEY, 20, quiet=True)
    )


@pytest.mark.parametrize(
    ("key", "n", "words"),
    [
        (40, KEY, "key: expected a random key; got 40. Try jax.random.PRNGKey(40)."),
        (KEY, KEY, "n: expected a whole number >= 1; got "),
        (KEY, 40.0, "n: expected a whole number >= 1; got 40.0. Try collect(system, key, n=1000)."),
        (KEY, 0, "n: expected a whole number >= 1; got 0."),
    ],
)
def test_what_is_no_key_or_no_number_of_runs_is_refused(system, tmp_path, key, n, words):
    for path in (None, tmp_path / "runs.npz"):
        with pytest.raises(InputError, match=re.escape(words)):
            collect(system, key, n, path=path, quiet=True)
    for first in (-1, 1.5):
        with pytest.raises(InputError, match=r"first_row: expected a whole number >= 0; got"):
            collect(system, KEY, 3, first_row=first, quiet=True)
    for stage in ("train", np.array([1, 2]), 99):
        with pytest.raises(InputError, match=r"stage: expected a Stage, as Stage.TRAIN; got "):
            collect(system, KEY, 3, stage, quiet=True)


def test_a_system_that_breaks_its_word_about_shapes_is_refused():
    short = plant(lambda key, k, s: (s[:-1, None] * k[None], k[:1]))
    with pytest.raises(InputError, match="n_record"):
        collect(short, KEY, 4, quiet=True)


class NotJax:
    """A batch simulator in NumPy that reports failures as NaN."""

    def __init__(self, like):
        self.name, self.domain, self.time, self.n_p, self.n_q = (
            "numpy",
            like.domain,
            like.time,
            2,
            1,
        )
        self.calls = []

    def rollout_batch(self, keys, ks):
        ks = np.asarray(ks)
        self.calls.append(len(ks))
        p = np.linspace(0, 1, self.time.n_record + 1)[None, :, None] * ks[:, None]
        p[ks[:, 0] > 0.9] = np.nan
        return Trajectory(p, ks[:, :1])


def test_a_system_that_is_not_jax_offers_rollout_batch(system):
    numpy_system = NotJax(system)
    batch = collect(numpy_system, KEY, 100, chunk=32, quiet=True)
    assert numpy_system.calls == [32, 32, 32, 4]  # nothing is run to be thrown away
    np.testing.assert_array_equal(batch.failed, batch.k[:, 0] > 0.9)


class Reused(NotJax):
    """Returns the same memory in each call of a size; its start matters."""

    def rollout_batch(self, keys, ks):
        return self.rollout_from_batch(keys, ks, np.zeros((len(ks), 2)))

    def rollout_from_batch(self, keys, ks, starts):
        new = super().rollout_batch(keys, ks)
        self.memory = getattr(self, "memory", {})
        p, q = self.memory.setdefault(len(new.p), (new.p.copy(), np.array(new.q)))
        p[:], q[:] = new.p + new.p * np.asarray(starts)[:, None], new.q
        return Trajectory(p, q)


def test_memory_that_a_simulator_uses_again_is_copied(system):
    held = list(stream_rollouts(Reused(system), KEY, 96, chunk=32, quiet=True))
    for batch in held:
        np.testing.assert_array_equal(batch.q, batch.k[:, :1])
        some = ~batch.failed
        np.testing.assert_allclose(batch.p[some, -1], batch.k[some])
    assert translation_gap(Reused(system), KEY, [[0.0, 9.0]] * 8).p.max() > 0.1


def test_a_float32_system_sees_the_k_on_record():
    narrow = plant.__wrapped__(disturbed)  # not the cached one: it is changed
    object.__setattr__(narrow, "dtype", np.float32)
    batch = collect(narrow, KEY, 50, quiet=True)
    np.testing.assert_array_equal(batch.k, batch.k.astype(np.float32))
    assert narrow.domain.contains(batch.k).all()


def test_chunks_come_in_order_and_the_workers_do_not_run_ahead():
    """Of two workers one finishes each chunk of even number after the next one."""
    started, ended = [], [threading.Event() for _ in range(40)]

    def work(index, device):
        started.append(index)
        if index % 2 == 0:
            ended[index + 1].wait()
        ended[index].set()
        return {"x": np.array([index])}

    seen = []
    for arrays in run_chunks(work, 40, ["a", "b"]):
        seen.append(int(arrays["x"][0]))
        assert len(started) <= len(seen) + 5
    assert seen == list(range(40))


@pytest.mark.parametrize("seed", [0, 7, SEEDS - 1])
def test_the_key_of_a_seed_is_that_of_jax(seed):
    assert (key_of(seed) == np.asarray(jax.random.PRNGKey(seed))).all()
    for x in (*Stage, SEEDS - 1):  # on the host too
        there = jax.random.fold_in(jax.random.PRNGKey(seed), int(x))
        np.testing.assert_array_equal(folded(key_of(seed), int(x)), there)
    ours, theirs = (stream(key, Stage.BOUND) for key in (key_of(seed), jax.random.PRNGKey(seed)))
    np.testing.assert_array_equal(ours, theirs)


def test_draws_of_a_law_outside_of_k_are_refused_and_not_moved_to_its_border():
    def wide(key):
        return 2.0 * jax.random.uniform(key, (2,))

    with pytest.raises(InputError, match=r"draws of k within K; .*% are outside\. Draw again"):
        collect(plant(noisy), KEY, 30, k=wide, quiet=True)
