"""Is k uniform, as a log says? Refused with the figure that refutes it; honest logs pass."""

import re

import numpy as np
import pytest
from scipy.stats import qmc

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.runs.independent import (
    LEAST,
    LEVEL,
    check_uniform,
    marks_by_k,
    repeated,
)
from parc_jax.learning.runs.loaders import load_rollouts
from parc_jax.learning.system import time_grid

K = box([-3.0, -3.0], [3.0, 3.0])


def drawn(n=100, seed=0, n_k=2):
    return np.random.default_rng(seed).uniform(-3, 3, (n, n_k))


def together(k):
    """The second wheel follows the first."""
    return np.stack([k[:, 0], 0.6 * k[:, 0] + 0.4 * k[:, 1]], axis=1)


def off_centre(k):
    return 3 * np.sign(k) * (np.abs(k) / 3) ** 2


def cut(k):
    """No command with the left wheel far ahead and the right one far back: 12 % of K."""
    return k[~((k[:, 0] > 1) & (k[:, 1] < -0.9))]


@pytest.mark.parametrize(
    ("k", "word"),
    [
        (together(drawn()), r"the rank correlation of k0 and k1 is 0\.\d\d over 100 draws"),
        (off_centre(drawn()), r"10 equal parts of the range of k[01] hold .* of 100 draws"),
        (
            cut(drawn(140)),
            r"a corner of 11 % of K, at the upper end of k0 and the lower end of k1, holds 0 of 1",
        ),
        (np.repeat(drawn(60), 2, axis=0), "60 of 120 rows repeat the k of another one"),
    ],
)
def test_a_log_that_is_not_uniform_is_refused_with_the_figure(k, word, tmp_path):
    with pytest.raises(InputError, match=f"drawn uniformly, as declared; {word}"):
        check_uniform("log", k, K)
    p = np.linspace(0, 1, 5)[None, :, None] * k[:, None]
    np.savez(tmp_path / "log.npz", k=k, p=p)
    time = time_grid(0.5, 1.0, 0.25)
    with pytest.raises(InputError, match=f"log.npz: .*{word}.*eave k_law out"):
        load_rollouts(tmp_path / "log.npz", time, K, k_law="uniform")
    assert load_rollouts(tmp_path / "log.npz", time, K).law.k_law == "logged"


def test_uniform_logs_pass():
    """At most as often refused as is said, with room for chance: two of 200 where 0.2 are due."""
    refused = 0
    for seed in range(200):
        n = (20, 47, 100, 1000)[seed % 4]
        try:
            check_uniform("log", drawn(n, seed, n_k=2), K)
        except InputError:
            refused += 1
    assert refused <= 2 and LEVEL == 1e-3
    check_uniform("log", drawn(300, n_k=5), box([-3.0] * 5, [3.0] * 5))
    check_uniform("log", together(drawn(LEAST - 1)), K)  # too few to tell
    fixed = np.column_stack([drawn(50, n_k=1), np.full(50, 2.0)])  # an axis without width
    check_uniform("log", fixed, box([-3.0, 2.0], [3.0, 2.0]))


def lattice(*n, ends=True):
    """A full grid of K, with or without its edge."""
    steps = [(np.arange(m) if ends else np.arange(m) + 0.5) / (m - 1 if ends else m) for m in n]
    return 6 * np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, len(n)) - 3


@pytest.mark.parametrize(
    "k",
    [
        lattice(40, 40),
        lattice(5, 5),
        lattice(11, 21, ends=False),
        lattice(61, 61),  # of 0.1, a resolution in which draws may stand
        lattice(601),
        np.random.default_rng(0).permutation(lattice(40, 40))[:500],
        6 * qmc.Sobol(2, scramble=False).random(64) - 3,
        6 * qmc.Sobol(2, seed=0).random(1024) - 3,
        np.round(6 * qmc.Sobol(2, seed=0).random(1024) - 3, 3),
        6 * qmc.LatinHypercube(2, seed=0).random(100) - 3,
        np.round(6 * qmc.LatinHypercube(2, seed=0).random(1000) - 3, 2),
    ],
)
def test_a_plan_of_experiments_is_no_draw(k, tmp_path):
    """Grids and sequences that fill K evenly: what lies between their rows was never tried."""
    np.savez(tmp_path / "log.npz", k=k, p=np.linspace(0, 1, 5)[None, :, None] * k[:, None])
    K, time = box([-3.0] * k.shape[1], [3.0] * k.shape[1]), time_grid(0.5, 1.0, 0.25)
    with pytest.raises(InputError, match=r"as declared; .*(as on a grid|more even than draws)"):
        load_rollouts(tmp_path / "log.npz", time, K, k_law="uniform")


@pytest.mark.parametrize("decimals", [1, 2, 3, 5])
def test_draws_may_be_printed_with_few_decimals(decimals, tmp_path):
    """Equal ones are then of chance, in a log and between the halves of it; copies are not."""
    n, time = 400, time_grid(0.5, 1.0, 0.25)
    for seed, dtype in enumerate([np.float64] * 10 + [np.float32] * 10):
        k = np.round(drawn(n, seed), decimals).astype(dtype)
        p = np.linspace(0, 1, 5)[None, :, None] * (k + 0.01 * drawn(n, seed + 99))[:, None]
        np.savez(tmp_path / "log.npz", k=k, p=p)
        runs = load_rollouts(tmp_path / "log.npz", time, K, k_law="uniform")
    assert not repeated(runs.select(slice(200, None)), marks_by_k(runs.k[:200])).any()
    if decimals > 1:  # of 61 x 61 values 200 copies are few
        np.savez(tmp_path / "log.npz", k=np.tile(k[:200], (2, 1)), p=p)
        with pytest.raises(InputError, match="200 of 400 rows repeat the k of another one"):
            load_rollouts(tmp_path / "log.npz", time, K, k_law="uniform")
        assert repeated(runs, marks_by_k(runs.k[:200])).sum() >= 200


def test_draws_may_be_told_in_other_units_or_in_single_precision():
    """Tenths of a degree told in rad, counts of an encoder, floats that are finer towards 0."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        for n in (50, 1000):
            turn = np.deg2rad(np.round(rng.uniform(-30.0, 30.0, n), 1))
            counts = 0.0127 * np.round(rng.uniform(-118.0, 118.0, n) / 0.5) * 0.5
            k, edge = np.column_stack([turn, counts]), np.array([np.deg2rad(30.0), 0.0127 * 118])
            check_uniform("log", k, box(-edge, edge))
            check_uniform("log", np.float32(k), box(-edge - 1e-6, edge + 1e-6))
        single = rng.uniform(0.0, 1.0, (20_000, 1)).astype(np.float32)
        check_uniform("log", single, box([0.0], [1.0]))
        six = np.round(rng.uniform([0.5, -0.6], [2.0, 0.6], (5000, 2)), 6).astype(np.float32)
        check_uniform("log", six, box([0.499999, -0.600001], [2.000001, 0.600001]))
        with pytest.raises(InputError, match=r"rows repeat|as on a grid"):
            check_uniform("log", np.tile(k[:100], (10, 1)), box(-edge, edge))
    with pytest.raises(InputError, match="as on a grid"):  # 60 choices of the one of two
        k = np.column_stack([rng.choice(np.linspace(-3, 3, 60), 400), drawn(400)[:, 1]])
        check_uniform("log", k, K)


def test_only_recordings_are_taken_as_independent():
    """Ten rows of a recording that drift from its first k say nothing against 40 uniform ones."""
    first = drawn(40)
    rng = np.random.default_rng(1)
    k = np.clip(np.repeat(first, 10, axis=0) + 0.3 * rng.standard_normal((400, 2)), -3, 3)
    k[::10] = first
    groups = np.repeat(np.arange(40), 10)
    order = rng.permutation(40).repeat(10) * 10 + np.tile(np.arange(10), 40)
    check_uniform("log", k[order], K, groups[order])
    with pytest.raises(InputError, match="as declared"):
        check_uniform("log", together(k), K, groups)
    names = ("left [rad/s]", "right [rad/s]")
    with pytest.raises(InputError, match=re.escape("left [rad/s] and right [rad/s] is")):
        check_uniform("log", together(first), K, names=names)
