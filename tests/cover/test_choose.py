"""The choice of directions around a seed: masks of plans, and who is inside of what is chosen."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_bodies import points_model, points_problem
from toy_models import toy_case

from parc_jax.common.arrays import x64
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.safe_set.corridors import build as building
from parc_jax.safe_set.corridors import choose as choosing
from parc_jax.safe_set.corridors.choose import Allowed
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.verdict.scene import scene_of


def seed_and_neighbours(model, problem, rng):
    """Paths and errors of one seed with 63 neighbours, and the directions chosen for them."""
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 20_000).safe.at(slice(0, choosing.PLANS))
    path, error = seen.path.astype(np.float32), model.tube.interval[seen.bin].astype(np.float32)
    own = Allowed(ErrorBox(error[:, :, None]), np.arange(len(error))[None])
    with x64():
        choice = jax.device_get(choosing.choose_batch(scene.tabled, path[None], own))
    return scene, path, error, choice


@pytest.mark.night
def test_masks_say_which_plans_a_direction_separates(rng):
    model, problem = toy_case(4)
    scene, path, error, _ = seed_and_neighbours(model, problem, rng)
    grown, table = scene.obstacles, scene.directions
    with x64():
        places, errors = jnp.asarray(path, float), ErrorBox(jnp.asarray(error, float)[:, :, None])
        lost = partial(Allowed(errors, jnp.arange(len(path))).lost_along_table, 0)
        rooms = choosing._rooms(
            *map(jnp.asarray, (table.w[:1], grown.points[0], places[:, :, None])), lost
        )
        masks = choosing._separated(rooms, jnp.asarray(table.support[:1]))
    masks = np.asarray(masks)
    for t, d, b in zip(
        *(rng.integers(0, n, 400) for n in (len(masks), table.w.shape[1], len(path))), strict=True
    ):
        w = table.w[0, d]
        gap = (
            min(path[b, t] @ w, path[b, t + 1] @ w) - table.support[0, d] - error[b, t] @ np.abs(w)
        )
        if abs(gap) > 1e-6:
            assert bool(masks[t, d] >> np.uint64(b) & np.uint64(1)) == (gap > 0)


@pytest.mark.night
def test_the_seed_keeps_to_what_is_built_around_it_and_most_neighbours_do(rng):
    model, problem = toy_case(4)
    scene, _, _, choice = seed_and_neighbours(model, problem, rng)
    assert choice.kept.all()
    seen = draw(scene, rng, 20_000).safe.at(slice(0, 400))
    seeds = np.arange(0, 400, 40)
    state = building.nothing_built(model.tube, seen)
    around = building._around(scene, state, building._with_neighbours(seen, seeds, rng))
    kept = Corridors(model.tube, around).kept(seen.path, seen.bin)
    assert kept[seeds, np.arange(len(seeds))].all() and kept.sum(axis=0).max() > 100


@pytest.mark.night
def test_in_space_a_direction_for_several_plans_leaves_them_the_most_room(rng):
    model = points_model(rng, 3, 4, 4)
    scene = scene_of(points_problem(rng, model), model)
    seen = draw(scene, rng, 20_000).safe.at(slice(0, 4))
    errors = ErrorBox(np.asarray(model.tube.errors.half)[seen.bin])
    with x64():
        pairs = jax.tree.map(jnp.asarray, scene.arrays.obstacles)
        paths, allowed = jnp.asarray(seen.path), Allowed(errors, jnp.arange(4))
        of_seed, of_all = (choosing._from_cluster(pairs, paths, allowed, n) for n in (1, 4))
        rooms = [least_room(pairs, paths, errors, w) for w in (of_seed, of_all)]
    apart = np.maximum(*rooms) > 0
    assert apart.mean() > 0.5 and (rooms[1] - rooms[0])[apart].min() > -1e-6
    assert (rooms[1] - rooms[0])[apart].max() > 1e-3


def least_room(pairs, paths, errors, w):
    """(o, T) [m] that directions w (o, T, n_p) leave between pairs and the nearest of some
    plans.
    """
    w = np.asarray(w)
    places = np.asarray(paths).reshape(*paths.shape[:2], -1, w.shape[-1])
    room = np.full(w.shape[:2], np.inf)
    for o, t in np.ndindex(*room.shape):
        own = np.asarray(pairs.points)[o]
        along = np.minimum(places[:, t, own] @ w[o, t], places[:, t + 1, own] @ w[o, t])
        room[o, t] = (along - errors.half[:, t, own] @ np.abs(w[o, t])).min()
    return room - np.asarray(pairs.support(jnp.asarray(w)))
