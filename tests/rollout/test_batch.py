"""A run that failed anywhere has failed, two runs are the same only if all of them is, rows that
belong together stay together, and messages name the row.
"""

import copy
import pickle

import jax
import numpy as np
import pytest
from synthetic_plants import noisy, plant

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.learning.runs.independent import marks_by_k
from parc_jax.learning.runs.joined import concatenate, joined_source
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.runs.loaders import load_rollouts

GRID = pj.learning.time_grid(0.25, 1.0, 0.05)


@pytest.fixture(scope="module")
def runs():
    return collect(plant(noisy), jax.random.PRNGKey(1), 30, quiet=True)


def grouped(runs, groups):
    return rollout_batch(
        runs.k, runs.p, runs.q, time=runs.time, domain=runs.domain, law=runs.law, groups=groups
    )


def test_a_batch_in_one_line(runs):
    assert repr(runs) == f"RolloutBatch({runs.n} runs of {runs.name})"


def test_a_split_never_tears_a_group(runs):
    groups = np.repeat(np.arange(10), 3)[np.random.default_rng(0).permutation(30)]
    batch = grouped(runs, groups)
    train, held = batch.split(0.3, seed=4)
    assert (train.n, held.n) == (21, 9) and not np.isin(held.groups, train.groups).any()
    assert sorted([*train.rows, *held.rows]) == list(range(30))
    alone = grouped(runs, None).split(0.3, seed=4)
    assert [part.n for part in alone] == [21, 9]
    again = batch.split(0.3, seed=4)[1]
    np.testing.assert_array_equal(again.rows, held.rows)
    for share in (0.0, 1.0):
        with pytest.raises(InputError, match="between 0 and 1"):
            batch.split(share)
    with pytest.raises(InputError, match="got 1 groups"):
        grouped(runs, np.zeros(30, int)).split(0.5)


def test_the_value_of_a_group_is_its_worst():
    values = np.array([1.0, 5.0, np.inf, 2.0, 3.0])
    np.testing.assert_array_equal(worst_by_group(values, np.array([7, 2, 9, 7, 2])), [2, 5, np.inf])
    assert worst_by_group(values, None) is values
    left = worst_by_group(np.array([False, True, False]), np.array([1, 1, 0]))
    assert left.tolist() == [True, False]


def test_names_of_groups_mean_the_same_in_every_file(runs, tmp_path):
    names = np.array(["monday", "tuesday", "sunday"] * 10)
    batch = grouped(runs, names)
    np.savez(tmp_path / "log.npz", k=runs.k, p=runs.p, q=runs.q, groups=names[::-1])
    other = load_rollouts(tmp_path / "log.npz", GRID, runs.domain)
    np.testing.assert_array_equal(other.groups, batch.groups[::-1])
    back = load_rollouts(save_rollouts(tmp_path / "own.npz", batch))
    np.testing.assert_array_equal(back.groups, batch.groups)
    np.savez(tmp_path / "log.npz", k=runs.k, p=runs.p, q=runs.q)
    given = load_rollouts(tmp_path / "log.npz", GRID, runs.domain, groups=np.arange(30) // 3)
    assert len(np.unique(given.groups)) == 10
    whole = concatenate([batch.select(slice(3)), batch.select(slice(3, 30))])
    np.testing.assert_array_equal(whole.groups, batch.groups)
    with pytest.raises(InputError, match=r"differ in groups \(given; none\)"):
        concatenate([batch, grouped(runs, None)])
    for bad in (np.arange(29), np.linspace(0, 1, 30)):
        with pytest.raises(InputError, match="for each of 30 rows"):
            grouped(runs, bad)


def test_batches_become_one_as_they_come(runs):
    parts = [runs.select(slice(at, at + 10)) for at in (0, 10, 20)]
    whole = concatenate(iter(parts), runs.n)
    for name in ("rows", "k", "p", "q"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(runs, name))
    np.testing.assert_array_equal(whole.hashes(), concatenate(parts).hashes())
    for some, n in ((parts[:2], runs.n), (parts, 20)):  # rows that nobody wrote are no runs
        with pytest.raises(InputError, match=f"expected {n} rows in all batches together"):
            concatenate(iter(some), n)
    single = runs.replace(p=np.asarray(runs.p, np.float32))
    with pytest.raises(InputError, match=r"differ in storage \(float64; float32\)\. Load"):
        concatenate([runs, single])
    wider = parts[1].replace(domain=pj.box(runs.domain.lo - 1, runs.domain.hi))
    with pytest.raises(InputError, match=r"differ in K \(\["):
        concatenate([parts[0], wider])


def test_a_parameter_that_is_not_known_is_named_by_its_row(runs, tmp_path):
    k = np.array(runs.k)
    k[[7, 9], 1] = np.nan
    for domain in (runs.domain, None):
        np.savez(tmp_path / "log.npz", k=k, p=runs.p)
        with pytest.raises(InputError, match=r"row 7 is \[.* nan\], 2 of 30 rows"):
            load_rollouts(tmp_path / "log.npz", GRID, domain)


def test_ragged_runs_get_advice(runs, tmp_path):
    ragged = np.empty(30, object)
    ragged[:] = [track[: 15 + i % 2] for i, track in enumerate(runs.p)]
    np.savez(tmp_path / "log.npz", k=runs.k, p=ragged)
    with pytest.raises(InputError, match="Runs of different lengths go onto one record grid"):
        load_rollouts(tmp_path / "log.npz", GRID)
    (tmp_path / "p").mkdir()
    np.savetxt(tmp_path / "k.csv", runs.k, delimiter=",")
    for i, track in enumerate(ragged):
        np.savetxt(tmp_path / "p" / f"{i:03d}.csv", track, delimiter=",")
    with pytest.raises(InputError, match=r"001.csv.*row 1 has \(16, 2\).*one record grid"):
        load_rollouts(tmp_path, GRID)


@pytest.fixture(scope="module")
def batch():
    return collect(plant(noisy), jax.random.PRNGKey(2), 6, quiet=True)


def test_one_record_that_is_no_number_fails_its_run(batch):
    p, q = np.array(batch.p), np.array(batch.q)
    p[1, 3, 1], p[2, -1, 0], q[4, 0] = np.nan, -np.inf, np.nan
    assert batch.replace(p=p, q=q).failed.tolist() == [False, True, True, False, True, False]


def test_runs_that_are_found_wanting_later_have_failed(batch):
    own = batch.replace(p=(places := np.array(batch.p)))
    assert own.finite is own
    places[2, 1] = np.nan
    assert own.failed.tolist() == [False, False, True, False, False, False] and own.finite.n == 5


def test_what_was_hashed_is_not_written_over(batch):
    """Recordings edited in place were tested as those that a claim had held out, by their hash."""
    k, p, q = (np.array(getattr(batch, name)) for name in ("k", "p", "q"))
    told = {"time": batch.time, "domain": batch.domain, "law": batch.law}
    own = rollout_batch(k, p, q, groups=np.arange(6), **told)
    before = own.hashes().copy()
    for array in (k, p, q):  # of the caller
        array += 0.25
    assert (own.p == batch.p).all() and (own.q == batch.q).all() and (own.k == batch.k).all()
    assert (own.replace(seed=None).hashes() == before).all()
    rows, lost = np.arange(6), np.arange(6)
    more = rollout_batch(own.k, own.p, own.q, rows=rows, lost=lost, **told)
    rows += 1
    assert more.rows[0] == 0 and more.source[1:] == (0, 5)
    copies = [copy.deepcopy(own), pickle.loads(pickle.dumps(own)), copy.copy(own)]
    assert all((one.hashes() == before).all() for one in copies)
    for name in ("rows", "k", "p", "q", "groups", "lost"):
        for runs in (own, own.select(slice(0, 3)), batch, more, *copies):
            if (array := getattr(runs, name)) is not None:
                with pytest.raises(ValueError, match="read-only"):
                    array[:1] = 0


@pytest.mark.parametrize("field", ["k", "p", "q"])
def test_the_hash_of_a_run_sees_k_path_and_end(batch, field):
    changed = np.array(getattr(batch, field))
    changed[3].flat[-1] += 1e-3
    same = batch.replace(**{field: changed}).hashes() == batch.hashes()
    assert same.tolist() == [True, True, True, False, True, True]


def test_a_zero_with_another_sign_makes_no_other_run(batch):
    """A log and its copy with -0.0 for 0.0 were 120 runs to a monitor, of 60."""
    zero = {"k": np.zeros_like(batch.k), "p": np.zeros_like(batch.p), "q": np.zeros_like(batch.q)}
    own, other = batch.replace(**zero), batch.replace(**{name: -x for name, x in zero.items()})
    assert (own.hashes() == other.hashes()).all() and marks_by_k(own.k) == marks_by_k(other.k)


def test_recorded_runs_of_any_name_know_their_log():
    K, k = pj.box([0.0], [1.0]), np.array([[0.1], [0.2]])
    places, law = np.zeros((2, 21, 2)), law_spec("robot", K, "logged")
    about = {"time": GRID, "domain": K, "law": law, "groups": [0, 1]}
    runs = rollout_batch(k, places, np.zeros((2, 0)), **about)
    logs = [joined_source([part])[0] for part in runs.split(0.5)]
    assert logs[0] and logs[0] == logs[1]
