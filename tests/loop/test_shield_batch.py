"""The shield of a batch decides as that of one environment does."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from needs import need
from toy_models import told

import parc_jax as pj
import sims.point
import sims.point.sensing
from parc_jax.checker.claim import OURS
from parc_jax.common.backend import ACCELERATOR, CPU
from parc_jax.drive import shield_batch
from parc_jax.learning.bound.claim import derived

need("gymnasium")
from platform_env import HELD, Platform, PlatformSystem, platform_model, shielded  # noqa: E402

WIDE = 0.05
POSTS = ([[1.0, -0.1], [-9.0, 3.0]], [[0.55, -0.1], [0.1, 0.6]], [[9.0, 9.0], [-0.7, -0.7]])


def shield_of(model, radius=0.2, ask=jnp.nan_to_num):  # which hides what is not finite
    return pj.drive.BatchShield(
        model,
        system=PlatformSystem(),
        radius=radius,
        every=HELD,
        ask=ask,
        act=lambda k, seconds, given: jnp.where(seconds < HELD / 2, k[2:], 0.0 * given),
        room=0.05,
        far=20.0,
    )


def wider_later():
    """The model with a tube that is wider after a command."""
    model = platform_model()
    interval, knot = model.tube.interval.copy(), round(HELD / model.time.dt)
    interval[:, knot:] = WIDE
    return told(model, tube=pj.learning.tube(model.tube.edges, interval, model.tube.final))


@pytest.fixture(scope="module")
def batch():
    """The shield, and its two functions, compiled."""
    made = shield_of(wider_later())
    return made, jax.jit(made.start), jax.jit(made.step)


def arrays(posts, places, speeds):
    square = 0.2 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    corners = np.array(posts)[:, :, None] + square
    return places, speeds, corners, np.ones(corners.shape[:2], bool)


def test_ranking_leaves_out_nothing_that_is_safe(monkeypatch):
    """Where all that is nearer than the brake is judged, every decision is the same."""
    model, draw, n = wider_later(), np.random.default_rng(1), 64
    posts, speeds = draw.uniform(-1.0, 1.0, (n, 4, 2)), draw.uniform(-0.5, 0.5, (n, 2))
    now = arrays(posts + 0.1 * np.sign(posts), np.zeros((n, 2)), speeds)
    actions, told = draw.uniform(-1.0, 1.0, (n, 2)), []
    with jax.enable_x64(True):
        for seen in (shield_batch.SEEN, np.inf):
            monkeypatch.setattr(shield_batch, "SEEN", seen)
            made = shield_of(model)
            under_way = jax.jit(made.start)(*now)
            told.append(jax.device_get(jax.jit(made.step)(under_way, *now, actions)))
    for ranked, every in zip(*map(jax.tree.leaves, told), strict=True):
        np.testing.assert_array_equal(ranked, every)
    changed, reason = told[0][1].changed, told[0][1].reason
    assert 5 < (changed & (reason == 0)).sum() and 5 < (reason == 4).sum()


@pytest.mark.parametrize("kind", [CPU, ACCELERATOR], ids=["in turn", "at once"])
def test_it_decides_as_the_shield_of_one_environment(kind, monkeypatch):
    """Proposals at random, mostly ahead, posts all around; nothing goes to the host and back."""
    monkeypatch.setattr(shield_batch, "backend", lambda: kind)
    made = shield_of(platform_model())
    start, step = jax.jit(made.start), jax.jit(made.step)
    model = platform_model()
    envs = [shielded(Platform(posts=posts), model, room=0.05) for posts in POSTS]
    for env in envs:
        env.reset()
    draw, changed = np.random.default_rng(0), []
    seen = [np.zeros((3, 2)), np.zeros((3, 2))]
    with jax.enable_x64(True):
        under_way = start(*jax.device_put(arrays(POSTS, *seen)))
        assert under_way.certified.all()
        for _ in range(12):
            actions = draw.uniform([-0.4, -1.0], 1.0, (3, 2))
            now = jax.device_put((*arrays(POSTS, *seen), actions))
            with jax.transfer_guard("disallow"):
                under_way, driven = step(under_way, *now)
            for i, env in enumerate(envs):
                info = env.step(actions[i])[4]
                told = info["shield"]
                assert np.allclose(driven.action[i], told["driven"], atol=1e-6)
                assert bool(driven.changed[i]) == told["changed"] and info["cost"] == 0
                assert (driven.reason[i] == 0) == (told["reason"] == "")
                clear = float(under_way.clearance[i])  # a lower bound, of some centimetres here
                assert told["clearance"] - 0.05 < clear < told["clearance"] + 1e-8
                changed.append(told["changed"])
            places = [env.unwrapped.place for env in envs]
            seen = [np.array(places), np.array([env.unwrapped.speed for env in envs])]
    assert 3 < sum(changed) < len(changed)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"action": np.nan}, 1),
        ({"action": 2.0}, 1),
        ({"given": np.nan}, 2),
        ({"given": 2.0}, 2),
        ({"pose": np.nan}, 2),
        ({"corner": 50.0}, 2),
        ({"corner": np.nan}, 2),
        ({"pose": 0.5}, 3),
        ({"pose": 0.6 * WIDE}, 3),  # at a knot, which belongs to the interval before it, too
    ],
)
def test_what_is_wrong_in_one_environment_is_its_brake_alone(batch, wrong, reason):
    _, start, step = batch
    pose, speed, corners, there = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    corners = corners + 5.0  # nothing near
    action = np.full((3, 2), 0.5)
    with jax.enable_x64(True):
        under_way, _ = step(start(pose, speed, corners, there), pose, speed, corners, there, action)
        pose = pose + 0.5 * (HELD - 0.1 * (1 - np.exp(-HELD / 0.1)))
        speed = speed + 0.5 * (1 - np.exp(-HELD / 0.1))
        for name, of in (("action", action), ("given", speed), ("pose", pose), ("corner", corners)):
            of[1] += wrong.get(name, 0.0)
        after, driven = step(under_way, pose, speed, corners, there, action)
    assert driven.reason.tolist() == [0, reason, 0]
    assert (driven.action[1] == 0).all() and bool(driven.changed[1])
    assert np.allclose(driven.action[::2], action[::2]) and after.steps.tolist() == [1, 2, 1]
    assert np.isfinite(after.given).all()


def test_once_a_tube_was_left_nothing_begins_until_another_start(batch):
    """As `Shield`: a robot that was seen elsewhere is not what was proved, also once it is back."""
    _, start, step = batch
    seen = arrays(POSTS[2:], np.zeros((1, 2)), np.zeros((1, 2)))
    away = (np.full((1, 2), 0.5), *seen[1:])
    with jax.enable_x64(True):
        under_way = start(*seen)
        for now in (seen, away, seen):
            under_way, driven = step(under_way, *now, np.zeros((1, 2)))
        assert driven.reason[0] == 3 and under_way.left[0] and under_way.clearance[0] == -np.inf
        under_way, driven = step(start(*seen), *seen, np.zeros((1, 2)))
        assert driven.reason[0] == 0 and not under_way.left[0]


def test_a_pose_elsewhere_at_the_first_step_is_not_where_the_stop_was_certified(batch):
    """Where nothing new is safe the stop goes on, certified of a robot inside of the post."""
    _, start, step = batch
    seen = arrays(POSTS[:1], np.zeros((1, 2)), np.zeros((1, 2)))
    inside = (np.array([[1.1, 0.0]]), *seen[1:])
    with jax.enable_x64(True):
        under_way, driven = step(start(*seen), *inside, np.zeros((1, 2)))
        assert driven.reason[0] == 3 and under_way.left[0]
        assert under_way.clearance[0] == -np.inf
        # whatever else is not known, as in `Shield`
        under_way, driven = step(
            start(*seen), inside[0], np.full((1, 2), np.nan), *seen[2:], np.zeros((1, 2))
        )
        assert driven.reason[0] == 3 and under_way.left[0]
        assert under_way.clearance[0] == -np.inf
        # a manoeuvre that is safe from there begins
        free = (np.full((1, 2), -3.0), *seen[1:])
        under_way, driven = step(start(*seen), *free, np.zeros((1, 2)))
        assert driven.reason[0] == 0 and not under_way.left[0]


def test_a_start_without_a_stop_is_not_certified_and_float32_is_refused(batch):
    made, start, _ = batch
    pose, speed, corners, there = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    pose[1] = np.nan
    with jax.enable_x64(True):
        alone = start(pose, speed, corners, np.zeros_like(there))
    assert alone.certified.tolist() == [True, False, True]  # nothing around, but nobody knows where
    seen = arrays(([[0.1, -0.1]] * 2, POSTS[0], POSTS[1]), np.zeros((3, 2)), np.zeros((3, 2)))
    with jax.enable_x64(True):
        assert start(*seen).certified.tolist() == [False, True, True]
        with pytest.raises(pj.InputError, match="active: expected bool"):
            made.start(*seen[:3], seen[3].astype(int))
    with jax.enable_x64(False), pytest.raises(pj.InputError, match="expected float64"):
        made.start(*seen)


def test_nothing_around_is_safe_and_an_edge_at_rest_is_refused(batch):
    _, start, step = batch
    pose, speed, corners, there = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    nothing = pose, speed, corners[:, :0], there[:, :0]
    with jax.enable_x64(True):
        under_way = start(*nothing)
        assert under_way.certified.all() and (step(under_way, *nothing, pose)[1].reason == 0).all()
    model = platform_model()
    edges = [[-1.0, 0.0, 1.0], *[[-1.0, 1.0]] * 3]
    halves = (np.repeat(x, 2, axis=0) for x in (model.tube.interval, model.tube.final))
    tube = pj.learning.tube(edges, *halves)
    known = {"system": "platform", "given": (0, 1)}
    claim = pj.learning.declared_claim(tube, "this test", model.net, model.time, **known)
    with pytest.raises(pj.InputError, match="without an edge between bins at 0"):
        shield_of(pj.learning.trajectory_model(model.net, claim))


@pytest.mark.parametrize("corner", [0.0, np.nan, np.inf])
def test_what_is_not_there_changes_nothing_whatever_its_corners_are(batch, corner):
    _, start, step = batch
    pose, speed, corners, there = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    there[:, 1] = False
    ahead, decided = np.tile([1.0, 0.0], (3, 1)), []
    with jax.enable_x64(True):
        for other in (9.0, corner):
            corners[:, 1] = other
            under_way, told = step(
                start(pose, speed, corners, there), pose, speed, corners, there, ahead
            )
            decided.append((np.asarray(under_way.k), np.asarray(told.reason)))
    assert (decided[0][1] == 0).all()
    assert all(np.array_equal(a, b) for a, b in zip(*decided, strict=True))


def test_a_manoeuvre_is_left_when_those_of_the_runs_were(batch):
    model = platform_model()

    def chained(first, last):
        law = f"a chain of 2 manoeuvres before it, each left after {first:g} to {last:g} s"
        claim = derived(model.claim, law=replace(model.claim.law, k_law=law))
        return model.replace(claim=claim)

    with pytest.raises(
        pj.InputError, match=r"every: expected a manoeuvre to be left from 0\.\d+ s"
    ):
        shield_of(chained(2 * HELD, 3 * HELD))
    late = ((f"{OURS}begin", "0.3 s after a command, new or resumed"),)  # as of bags
    law = replace(model.claim.law, parameters=late)
    with pytest.raises(pj.InputError, match=r"^model: expected one whose runs begin"):
        shield_of(model.replace(claim=derived(model.claim, law=law)))
    far = np.full((3, 2, 2), 10.0)
    pose, speed, corners, there = arrays(far, np.zeros((3, 2)), np.zeros((3, 2)))
    made, rests = shield_of(chained(HELD, HELD)), model.time.t_f / HELD
    step = jax.jit(made.step)
    with jax.enable_x64(True):
        seen = pose, speed, corners, there
        one = batch[1](*seen).replace(shield=jax.eval_shape(made.start, *seen).shield)
        for steps, reason in ((1, 0), (2, 5), (rests, 0)):
            since = one.replace(steps=np.full(3, float(steps)))
            new, driven = step(since, pose, speed, corners, there, 0.5 * there)
            assert driven.reason.tolist() == [reason] * 3
            assert new.steps.tolist() == [steps * (reason > 0) + 1] * 3


def test_what_another_shield_has_under_way_is_refused(batch):
    """Of another model, robot or door: when it is traced, so that a compiled step pays nothing."""
    _, start, step = batch
    seen = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    model = wider_later()
    wider = model.replace(claim=derived(model.claim, law=replace(model.claim.law, k_law="other")))
    others = [shield_of(wider), shield_of(model, radius=0.3), shield_of(model, ask=jnp.tanh)]
    with jax.enable_x64(True):  # traced alone, for nothing has to be compiled to refuse it
        mine, same = (jax.eval_shape(f, *seen) for f in (start, shield_of(model).start))
        jax.eval_shape(step, same, *seen, 0.5 * seen[3])  # made again of the same
        for other in others:
            with pytest.raises(pj.InputError, match="under_way: expected what this shield has"):
                jax.eval_shape(step, jax.eval_shape(other.start, *seen), *seen, 0.5 * seen[3])
            with pytest.raises(pj.InputError, match="Begin anew with `start`"):
                jax.eval_shape(other.step, mine, *seen, 0.5 * seen[3])


@pytest.mark.parametrize(
    ("place", "wrong", "words"),
    [
        (0, np.zeros((2, 2)), "expected one batch, pose"),
        (0, np.zeros((3, 1)), "expected one batch, pose"),
        (0, np.zeros((3, 3)), r"pose \(b, 2; its model declares no rotation\), given"),
        (1, np.zeros(3), "expected one batch, pose"),
        (1, np.zeros((3, 1)), r"given \(b, 2\), corners"),
        (2, np.zeros((3, 2, 4, 3)), r"corners \(b, o, v, 2\), active"),
        (3, np.ones((3, 1), bool), r"active \(b, o\), action"),
        (3, np.array(True), "expected one batch, pose"),
        (2, np.zeros((3, 2, 0, 2)), "expected one batch, pose"),
        (0, np.full((3, 2), 1j), "expected real numbers"),
        (1, "fast", "arrays of numbers; got TypeError"),
    ],
)
def test_arrays_of_other_shapes_are_refused_in_a_sentence(batch, place, wrong, words):
    made, *_ = batch
    of = [*arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))]
    of[place] = wrong
    with jax.enable_x64(True), pytest.raises(pj.InputError, match=words):
        made.start(*of)


def test_a_model_that_turns_wants_headings():
    """Without one each was taken for 0."""
    shield = pj.drive.BatchShield(sims.point.model(), **sims.point.sensing.batch_door())
    of = np.zeros((1, 2)), np.zeros((1, 3)), np.zeros((1, 1, 4, 2)), np.zeros((1, 1), bool)
    with jax.enable_x64(True), pytest.raises(pj.InputError, match=r"pose \(b, 3\), given"):
        shield.start(*of)


def test_an_action_of_one_number_is_not_taken_for_two(batch):
    made, *_ = batch
    seen = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    with jax.enable_x64(True):
        one = jax.eval_shape(made.start, *seen)
        with pytest.raises(pj.InputError, match=r"chosen parameters \(3, 2\); got \(3, 1\)"):
            jax.eval_shape(made.step, one, *seen, np.zeros((3, 1)))
        with pytest.raises(pj.InputError, match=r"action \(b, m\); got .*, \(3,\)\]"):
            jax.eval_shape(made.step, one, *seen, np.zeros(3))
        fewer = [x[:2] for x in seen]
        with pytest.raises(pj.InputError, match=r"that of poses \(2, 2\); got \(3, 2\)"):
            jax.eval_shape(made.step, one, *fewer, np.zeros((2, 2)))


@pytest.mark.parametrize("wrong", [{"room": -1.0}, {"far": -1.0}, {"radius": True}])
def test_numbers_that_mean_nothing_are_refused(wrong):
    door = sims.point.sensing.batch_door() | wrong
    with pytest.raises(pj.InputError, match=f"{next(iter(wrong))}: expected (a )?number"):
        pj.drive.BatchShield(sims.point.model(), **door)


@pytest.mark.parametrize("of", ["ask", "act"])
def test_complex_numbers_of_its_functions_are_refused(of):
    """Of a parameter half was dropped, and the action that was driven was complex."""
    made = pj.drive.BatchShield(
        sims.point.model(), **sims.point.sensing.batch_door() | {of: lambda *_: jnp.full(2, 1j)}
    )
    seen = np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 1, 4, 2)), np.zeros((1, 1), bool)
    with pytest.raises(pj.InputError, match=f"{of}: expected real numbers; got complex ones"):
        with jax.enable_x64(True):
            one = jax.eval_shape(made.start, *seen)
            jax.eval_shape(made.step, one, *seen, np.zeros((1, 2)))


def test_what_comes_in_float32_is_computed_in_float64(batch):
    """As Brax has it: margins pay for the rounding of float64 alone."""
    made, *_ = batch
    *numbers, there = arrays(POSTS, np.zeros((3, 2)), np.zeros((3, 2)))
    of = [*(x.astype(np.float32) for x in numbers), there]
    with jax.enable_x64(True):
        one = jax.eval_shape(made.start, *of)
        new, driven = jax.eval_shape(made.step, one, *of, np.zeros((3, 2), np.float32))
    for under_way in (one, new):  # the same kind, so that a loop may carry it
        numbers = under_way.k, under_way.pose, under_way.given, under_way.clearance, driven.action
        assert all(x.dtype == np.float64 for x in numbers)
    # to the type of its numbers: else a compiled step would be compiled again for its own results
    kinds = [[(x.shape, x.dtype, x.weak_type) for x in jax.tree.leaves(of)] for of in (one, new)]
    assert kinds[0] == kinds[1]
