"""What every simulator promises, whatever it simulates. A new system is one more row of SYSTEMS."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from parc_jax.learning.system import BlackBoxSystem, points_of

pytestmark = pytest.mark.slow


class Case(NamedTuple):
    """A system, its options, and how far a batch may differ from a loop: atol up to sure_until [s],
    rough after.
    """

    name: str
    options: dict
    sure_until: float
    atol: float
    rough: float


SYSTEMS = [
    pytest.param(
        Case("drift_parking", {"plant": "ode"}, 4.8, 1e-9, 0.06),
        id="drift_parking-ode",
        marks=pytest.mark.slow,
    ),
    pytest.param(
        Case("drift_parking", {"plant": "mjx"}, 4.8, 1e-9, 0.06),
        id="drift_parking-mjx",
        marks=pytest.mark.night,
    ),
    pytest.param(Case("f110", {}, 4.9, 0.0, 0.0), id="f110", marks=pytest.mark.slow),
    pytest.param(
        Case("f110", {"body": "rectangle"}, 4.9, 0.0, 0.0),
        id="f110-rectangle",
        marks=pytest.mark.night,
    ),
    pytest.param(Case("jackal", {"threads": 2}, 1.2, 0.0, 0.0), id="jackal"),
    pytest.param(Case("jackal", {"plant": "twin"}, 1.2, 1e-9, 1e-9), id="jackal-twin"),
    pytest.param(Case("drone", {}, 2.0, 1e-9, 1e-9), id="drone"),
    pytest.param(Case("tractor", {}, 8.0, 1e-9, 1e-9), id="tractor", marks=pytest.mark.night),
]


class Runs(NamedTuple):
    """Trajectories of the same rows (3,) as a batch, as the same batch again, and one by one."""

    system: object
    case: Case
    batch: tuple
    again: tuple
    single: list


@pytest.fixture(scope="module", params=SYSTEMS)
def runs(request):
    case = request.param
    system = sims.load(case.name, **case.options)
    lo, hi = np.asarray(system.domain.lo), np.asarray(system.domain.hi)
    ks = jnp.asarray(lo + (hi - lo) * np.random.default_rng(11).random((3, lo.size)))
    keys = drawn_keys(4, 3)
    batched = getattr(system, "rollout_batch", None) or jax.jit(jax.vmap(system.rollout))
    # Row i alone, in a batch of copies of itself: the program is compiled once, and no other row
    # can leak into it.
    alone = [jnp.full(3, i) for i in range(3)]
    single = [jax.tree.map(lambda a: a[2], batched(keys[i], ks[i])) for i in alone]
    return Runs(system, case, batched(keys, ks), batched(keys, ks), single)


def test_it_is_a_black_box_whose_runs_are_on_its_grid_and_move_from_the_origin(runs):
    system = runs.system
    assert isinstance(system, BlackBoxSystem)
    assert system.name == runs.case.name and system.domain.volume > 0
    n_points = len(points_of(system))
    each = (system.n_p,) if n_points == 1 else (n_points, system.n_p)
    assert runs.batch.p.shape == (3, system.time.n_record + 1, *each)
    assert runs.batch.q.shape == (3, system.n_q)
    assert runs.batch.p.dtype == runs.batch.q.dtype == jnp.float64
    assert (runs.batch.p[:, 0].reshape(3, -1, system.n_p)[:, 0] == 0.0).all()
    assert all(np.isfinite(a).all() for a in runs.batch)
    assert (np.ptp(runs.batch.p, axis=1) > 0.0).all()
    assert not np.array_equal(runs.batch.p[0], runs.batch.p[1])


def test_same_key_same_result(runs):
    for a, b in zip(runs.batch, runs.again, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_batch_is_a_loop(runs):
    sure = round(runs.case.sure_until / runs.system.time.dt_record) + 1
    for i, alone in enumerate(runs.single):
        np.testing.assert_allclose(
            runs.batch.p[i, :sure], alone.p[:sure], rtol=0, atol=runs.case.atol
        )
        np.testing.assert_allclose(runs.batch.p[i], alone.p, rtol=0, atol=runs.case.rough)
        np.testing.assert_allclose(runs.batch.q[i], alone.q, rtol=0, atol=runs.case.rough)
