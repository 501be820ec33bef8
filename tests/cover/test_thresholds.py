"""Thresholds of corridors that are looked up: those of the corridor itself, in every bin."""

import numpy as np
import pytest
from toy_bodies import points_model, points_problem

from parc_jax.safe_set.corridors.choose import allowed_of
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors, Thresholds
from parc_jax.safe_set.verdict.scene import scene_of
from sims.boxes_of_k import under


def drawn(rng, scene, n: int) -> list[Corridor]:
    """Corridors of directions drawn from the table, and one that is in no table."""
    table, active = scene.directions, scene.obstacles.active
    o = np.arange(len(active))[:, None]
    none = np.zeros(0)
    out = []
    for _ in range(n):
        d = rng.integers(0, table.w.shape[1], active.shape)
        w = table.w[o, d].copy()
        w[0, 0] = rng.normal(size=2)
        support = np.where(active, table.support[o, d] - 2.0, -np.inf)
        out.append(Corridor(w, support, None, scene.obstacles.points, none, none))
    return out


@pytest.mark.slow
def test_they_are_those_of_the_corridor_and_plans_keep_to_it_as_by_hand():
    rng = np.random.default_rng(3)
    model = points_model(rng, m=3, bins=(3, 1), size=0.05, fitted=True)
    scene = scene_of(points_problem(rng, model), model)
    tube, chosen = model.tube, drawn(rng, scene, 5)
    knots = np.array([0, 2])
    for some, atol, known in (
        (np.s_[:], 1e-12, Thresholds(tube.errors)),
        (knots, 1e-5, Thresholds(tube.errors, knots, np.float32)),
    ):
        for _ in range(2):  # the second time some are known
            corridor, bins = rng.integers(0, 5, 10), rng.integers(0, 3, 10)
            row, found = map(np.array, known.lookup(tuple(chosen), corridor, bins))
            for c, b in zip(corridor, bins, strict=True):
                exact = chosen[c].threshold(tube.during(int(b)))[:, some].swapaxes(1, 2)
                own = found[row[c, b]][: len(exact)]
                np.testing.assert_allclose(own, exact, rtol=0, atol=atol)
        # of no corridor, and of pairs that were not asked for this time: nobody keeps to those
        row[corridor, bins] = -1
        assert (row == -1).all() and (found[-1] == np.inf).all()
    path = rng.normal(size=(200, model.time.n_steps + 1, model.n_c)) * 0.3
    bins = rng.integers(0, 3, 200)
    corridors = Corridors(tube, chosen[:2]).with_more(chosen[2:])
    kept = corridors.kept(path, bins)
    for c, one in enumerate(chosen):
        for b in range(3):
            mine = path[bins == b].reshape(-1, model.time.n_steps + 1, model.n_points, 2)
            near = mine[:, :, one.points]  # (b, T + 1, o, i, 2)
            along = np.stack(
                [np.einsum("btoip,otp->boti", near[:, s], one.w) for s in (np.s_[:-1], np.s_[1:])]
            )
            clear = (along.min(axis=0) > one.threshold(tube.during(b))).all(axis=(1, 2, 3))
            np.testing.assert_array_equal(kept[bins == b, c], clear)
    assert 0 < kept.mean() < 1


def test_what_errors_take_along_the_table_is_known_in_all_bins():
    rng = np.random.default_rng(4)
    model = points_model(rng, m=3, bins=(2, 1), size=0.05, fitted=True)
    scene = scene_of(points_problem(rng, model), model)
    shared = allowed_of(scene)
    for o, d in ((0, 3), (1, 20), (2, 47)):
        w = scene.directions.w[o, d]
        exact = model.tube.errors.support(-np.broadcast_to(w, (2, 4, 3, 2)))
        found = np.asarray(shared.known)[shared.which[o, d]].transpose(0, 2, 1)
        np.testing.assert_allclose(found, exact, rtol=1e-5, atol=1e-6)
    assert allowed_of(under(scene, points_model(rng, m=3))).known is None
