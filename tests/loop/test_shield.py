"""A shield: whatever the policy proposes, only certified manoeuvres are driven."""

import itertools
import pickle
import re
from fractions import Fraction
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from episodes import PATIENT
from needs import need
from toy_models import line_model

import parc_jax as pj
from parc_jax import checker
from parc_jax.app.cli.check import brief
from parc_jax.checker.answer import allowance_of
from parc_jax.common.errors import SoundnessError
from parc_jax.drive.loop import loop
from parc_jax.learning.systems.content import whole_digest

need("gymnasium")
import gymnasium  # noqa: E402
from platform_env import (  # noqa: E402
    HELD,
    TIME,
    WIDTH,
    Platform,
    act,
    platform_model,
    sense,
    shielded,
)

AHEAD = np.array([1.0, 0.0])  # into the post


@pytest.fixture(scope="module")
def model():
    return platform_model()


def test_a_policy_that_drives_at_a_post_never_touches_it(model, tmp_path):
    bare = Platform()
    bare.reset()
    assert any(bare.step(AHEAD)[4]["cost"] for _ in range(4))  # it would, without
    env = shielded(model=model, assumed={"creep": "at most 1 cm"})
    _, info = env.reset(seed=0)
    assert info["shield"]["certified_until"] == pytest.approx(1.2)
    told = []
    for _ in range(12):
        *_, info = env.step(AHEAD)
        assert info["cost"] == 0 and info["shield"]["clearance"] > 0
        told.append(info["shield"])
    first = told[0]
    assert not first["changed"] and first["reason"] == "" and (first["driven"] == AHEAD).all()
    assert any(one["changed"] for one in told) and env.unwrapped.place[0] > 0.4
    numbers = [one.number for one in env.commitments]
    assert numbers == [*range(len(numbers))]
    file = checker.load(env.certificate(tmp_path / "drive.json"))
    assert checker.check_episode(file, allowance_of).manoeuvres == len(numbers)
    assert ["creep", "assumed", "at most 1 cm"] in file["premises"]
    drive = lambda world, seed: pj.drive.Outcome(False, committed=env.commitments)  # noqa: E731
    law = {"law": lambda seed: 0, "key": jax.random.key(0), "n": 1, "workers": 0, "quiet": True}
    done = pj.drive.drive_episodes(drive, **law)
    assert "assumed creep: at most 1 cm, premises" in done.details()


def test_a_slow_machine_decides_as_a_quick_one(model, monkeypatch):
    """Its first step compiled for longer than ten seconds: no stop was certified."""
    clock = itertools.count(0.0, 1000.0)
    monkeypatch.setattr(loop, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    env = shielded(model=model, effort=None)
    assert env.reset(seed=0)[1]["shield"]["clearance"] > 0


def test_what_is_certified_ends_where_what_moves_is_told_of_no_more(model):
    def seen(env, now):
        at = env.unwrapped.clock
        post = pj.box([9.0, 9.0], [9.2, 9.2])
        parts, spans = pj.problem.moving(post, [0.1, 0.0], (0, 4), model.time.dt, at=at)
        return pj.drive.Sensed(now[:2], now[2:], parts, spans)

    world = Platform(posts=[[9.0, 9.0]])
    world.clock = 0.0
    env = shielded(world, model, sense=seen)
    _, info = env.reset(seed=0)
    assert info["shield"]["certified_until"] == pytest.approx(0.5)
    one = env.commitments[0]
    assert f"{one!r}".endswith(" m clear until 0.5 s under a declared tube>")
    one.seen_outside.append(Fraction(1, 4))
    assert f"{one!r}".endswith(" s, its tube left by 0.25 s>")


def test_what_is_free_is_driven_as_proposed(model):
    env = shielded(Platform(posts=[[9.0, 9.0]]), model)
    env.reset(seed=0)
    draw = np.random.default_rng(0)
    for _ in range(6):
        action = draw.uniform(-1, 1, 2)
        *_, info = env.step(action)
        assert not info["shield"]["changed"] and np.allclose(info["shield"]["driven"], action)


def test_the_nearest_in_the_metric_is_driven(model):
    """Of two certified candidates the one that is nearer."""
    both, proposed = np.array([[0.0, 0.6], [0.3, 0.0]]), np.array([1.0, 0.5])
    for weight, expected in ((0.1, both[1]), (3.0, both[0])):

        def metric(one, others, weight=weight):
            return np.linalg.norm((others - one) * [1.0, weight], axis=1)

        env = shielded(Platform(posts=[[0.55, -0.1]]), model, candidates=both, metric=metric)
        env.reset()
        *_, info = env.step(proposed)
        assert info["shield"]["changed"] and np.allclose(info["shield"]["driven"], expected)


def test_room_is_asked_of_what_is_begun_and_less_the_longer_the_brake_lasts(model):
    """Without it the platform comes nearer to the post than with it."""
    nearest, told = [], []
    for room in (0.0, 0.3):
        env = shielded(model=model, room=room)
        env.reset()
        told = [env.step(AHEAD)[4]["shield"] for _ in range(2)]
        nearest.append(env.unwrapped.place[0])
    # a third of the brake of the step before has passed
    assert told[1]["clearance"] >= 0.2
    assert nearest[1] < nearest[0]


@pytest.mark.parametrize(
    ("action", "said"),
    [
        ([np.nan, 0.0], "expected finite numbers"),
        ([np.inf, 0.0], "expected finite numbers"),
        ([0.5], r"expected shape \(2,\)"),
        ([[1], [1, 2]], "expected numbers"),
        ([10**400, 0.0], "expected numbers"),
        ("left", "expected numbers"),
        ([2.0, 0.0], "within K for the action"),
    ],
)
def test_an_action_that_is_none_ends_in_the_stop_under_way(model, action, said):
    env = shielded(model=model)
    env.reset()
    env.step(AHEAD)
    for _ in range(3):
        *_, info = env.step(action)
        assert (info["shield"]["driven"] == 0).all() and info["shield"]["changed"]
        assert re.search(said, info["shield"]["reason"])
    assert np.linalg.norm(env.unwrapped.speed) < 1e-4
    *_, info = env.step(AHEAD / 4)
    assert not info["shield"]["changed"]  # it goes on


@pytest.mark.parametrize("wrong", ["given", "drift", "ask", "metric"])
def test_what_the_user_s_code_gets_wrong_ends_in_the_stop_under_way(model, wrong):
    """From the second step on: what it returns cannot be used, or it raises."""

    def sensed(env, seen):
        told = {"given": {"given": "ab"}, "drift": {"drift": 10**400}}.get(wrong, {})
        return sense(env, seen)._replace(**(told if late else {}))

    def asked(action):
        return 1 / 0 if late and wrong == "ask" and not action.any() else action

    def far(proposed, candidates):
        return np.linalg.norm(candidates - proposed, axis=1) / (wrong != "metric" or not late)

    late = False
    env = shielded(model=model, sense=sensed, ask=asked, metric=far)
    env.reset()
    env.step(AHEAD / 2)
    late = True
    told = env.step(AHEAD)[4]["shield"]
    assert told["changed"] and told["reason"] and (told["driven"] == 0).all()


@pytest.mark.parametrize("kind", [SoundnessError, MemoryError, KeyboardInterrupt])
def test_a_proof_that_cannot_be_trusted_and_an_end_of_the_program_are_no_stop(
    model, kind, monkeypatch
):
    def fails(*_, **__):
        raise kind("here.")

    env = shielded(model=model)
    env.reset()
    env.step(AHEAD / 2)
    monkeypatch.setattr("parc_jax.drive.loop.loop.preferred", fails)
    with pytest.raises(kind):
        env.step(AHEAD / 2)


def test_what_the_user_s_code_raises_before_a_start_is_told_with_its_cause(model):
    def fails(*_):
        raise FileNotFoundError("calibration")

    with pytest.raises(pj.InputError, match=r"to sense at reset.*calibration") as told:
        shielded(model=model, sense=fails).reset()
    assert isinstance(told.value.__cause__, FileNotFoundError)
    with pytest.raises(pj.InputError, match="ask: expected to take actions") as told:
        shielded(model=model, ask=lambda action: 1 / 0)
    assert isinstance(told.value.__cause__, ZeroDivisionError)


@pytest.mark.soundness
def test_an_environment_that_writes_into_its_action_does_not_change_what_is_told(model):
    class InPlace(Platform):
        def step(self, action):
            done = super().step(action.copy())
            action *= 0.0
            return done

    env = shielded(InPlace(posts=[[9.0, 9.0]]), model)
    env.reset(seed=0)
    *_, info = env.step(np.array([0.5, 0.3]))
    assert np.allclose(info["shield"]["driven"], [0.5, 0.3])


def test_a_policy_that_writes_into_what_it_got_changes_nothing_of_what_is_sensed(model):
    """One that normalises its observation in place was certified into the post."""

    class Seeing(Platform):
        def seen(self):
            return np.concatenate([self.place, self.speed, self.posts[0]])

    def sensed(_, seen):
        return pj.drive.Sensed(seen[:2], seen[2:4], [pj.box(seen[4:], seen[4:] + 0.2)])

    env = shielded(Seeing(), model, sense=sensed)
    seen, _ = env.reset(seed=0)
    for _ in range(6):
        seen *= [1, 1, 1, 1, 10, 10]
        seen, *_, info = env.step(AHEAD)
        assert info["cost"] == 0


def test_an_action_that_is_none_is_no_reason_to_forget_the_drift(model):
    def drifted(env, seen):
        return sense(env, seen)._replace(pose=seen[:2] + np.array([off, 0.0]), drift=0.15)

    env, off = shielded(Platform(posts=[[9.0, 9.0]]), model, sense=drifted), 0.0
    env.reset(seed=0)
    env.step(AHEAD / 2)
    off = 0.1  # less than is told
    for action in ([np.nan, 0.0], AHEAD / 2):
        *_, info = env.step(action)
        assert not info["shield"].get("left") and info["shield"]["clearance"] > 0


def test_what_poses_may_be_off_by_is_kept_clear_of(model, tmp_path):
    rng, off = np.random.default_rng(0), 0.1

    def noisy(env, seen):
        one = sense(env, seen)
        return one._replace(pose=one.pose + rng.uniform(-off, off, 2))

    touched = {}
    for uncertainty, drift in ((pj.Uncertainty(start=off), 0.0), (None, 2 * np.sqrt(2) * off)):

        def told(env, seen, drift=drift):
            return noisy(env, seen)._replace(drift=drift)

        touched[drift], left = 0, False
        for _ in range(6):
            env = shielded(model=model, sense=told, uncertainty=uncertainty)
            env.reset(seed=0)
            for _ in range(20):
                *_, info = env.step(AHEAD)
                touched[drift] += info["cost"] > 0
                left |= bool(info["shield"].get("left"))
        assert not left
        file = checker.load(env.certificate(tmp_path / "drive.json"))
        assert checker.check_episode(file, allowance_of).manoeuvres
    (known, as_drift) = touched.values()
    assert known == 0 < as_drift  # noise that is told as drift buys no room


def test_a_reset_inside_of_a_hazard_is_refused(model):
    env = shielded(Platform(posts=[[0.1, -0.1]]), model)
    with pytest.raises(pj.InputError, match="certified stop where the environment is reset"):
        env.reset()
    with pytest.raises(pj.InputError, match="expected a reset"):
        env.step(AHEAD)


def test_what_does_not_belong_together_is_refused(model):
    with pytest.raises(pj.InputError, match="ask: expected shape"):
        shielded(Platform(actions=3), model)
    with pytest.raises(pj.InputError, match="environment of Gymnasium"):
        shielded(object(), model)

    class Other:
        name, n_p, n_q, given = "other", 2, 0, (0, 1)
        domain, time = model.domain, model.time

        def rollout_batch(self, keys, ks): ...

    with pytest.raises(pj.InputError, match=r"the system of this model, .* agree; system is"):
        shielded(model=model, system=Other())


def test_an_action_that_the_environment_does_not_take_as_it_is_is_none(model):
    """What it would cut off or round to whole numbers is not what was proved."""
    whole, narrow = Platform(), Platform()
    whole.action_space = gymnasium.spaces.Box(-2, 2, (2,), np.int32)
    with pytest.raises(pj.InputError, match="expected actions of float32 or float64; got int32"):
        shielded(whole, model)
    with pytest.raises(pj.InputError, match=r"act: expected an action within Box\(-1.0, 1.0"):
        shielded(model=model, act=lambda *of: 3 * act(*of))
    with pytest.raises(pj.InputError, match=r"got \[1.3, 1.3\]"):  # not when it has to stop
        shielded(model=model, act=lambda k, t, given: k[2:] if t < 0.2 else -1.3 * given)
    narrow.action_space = gymnasium.spaces.Box(-0.5, 0.5, (2,))
    env = shielded(narrow, model, candidates=[[0.5, 0.0]])
    env.reset()
    *_, info = env.step(AHEAD)  # itself within K
    assert "act: expected an action within Box(-0.5" in info["shield"]["reason"]
    assert (info["shield"]["driven"] == 0).all() and env.unwrapped.speed[0] == 0
    assert env.step(AHEAD / 2)[4]["shield"]["reason"] == ""


@pytest.mark.parametrize(("kind", "by"), [(np.float32, 1.2e-7), (np.float64, 2.3e-16)])
def test_an_action_that_rounding_left_beyond_a_bound_is_driven_at_it(model, kind, by):
    """As `act` in JAX's float32 may: it is no other action."""
    bare = Platform(posts=[[5.0, 5.0]])
    bare.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), kind)
    env = shielded(bare, model, act=lambda *of: (1 + by) * act(*of))
    env.reset()
    shield = env.step(AHEAD)[4]["shield"]
    assert shield["reason"] == "" and (shield["driven"] == AHEAD).all()
    with pytest.raises(pj.InputError, match="act: expected an action within Box"):
        shielded(bare, model, act=lambda *of: (1 + 1e-5) * act(*of))


def test_an_environment_that_is_not_the_model_s_comes_to_its_stop(model, tmp_path, capsys):
    """It goes a third farther than the model says: the tube is left, and nothing new begins. The
    file of the drive says so, since what it proves is not of this drive.
    """
    env = shielded(Platform(posts=[[3.0, -0.1]], heavier=1.3), model)
    env.reset()
    told = [env.step(AHEAD * 0.7)[4]["shield"] for _ in range(6)]
    assert "a pose was beyond what tube" in told[-1]["reason"] and (told[-1]["driven"] == 0).all()
    assert told[-1]["clearance"] == -np.inf and told[-1]["certified_until"] < 0.4 * 6
    report = checker.check_episode(
        checker.load(env.certificate(tmp_path / "left.json")), allowance_of
    )
    last, at = len(env.commitments) - 1, 0.4 * [one.get("left") for one in told].index(True)
    said = f"manoeuvres[{last}], by {at:g} s: it is none inside the tube"
    assert report.premises[-1] == ["TUBE_LEFT", "measured", [said]]
    assert f"  measured TUBE_LEFT: {said}" in checker.episode.summary_of_episode(report)
    brief([str(tmp_path / "left.json")])
    assert f"  measured TUBE_LEFT: {said}" in capsys.readouterr().out


@pytest.mark.parametrize("ends", [(True, False), (False, True)])
def test_a_tube_that_was_left_when_the_episode_ended_is_told_of(model, tmp_path, ends):
    """Its last pose decides nothing; without it a robot that goes too far and ends there, step
    after step, is never seen outside of a tube.
    """

    class Ends(Platform):
        def step(self, action):
            seen, reward, *_, info = super().step(action)
            return seen, reward, *ends, info

    def seen(env, observation):
        if env.unwrapped.place[0] > 0.2 and gone:
            raise OSError("no scan")
        return sense(env, observation)

    gone, bare = [], Ends(posts=[[3.0, -0.1]])
    env = shielded(bare, model, sense=seen)
    for heavier, left in ((1.0, False), (1.3, True)):
        bare.heavier = heavier
        assert "left_at_end" not in env.reset()[1]["shield"]
        told = env.step(AHEAD * 0.7)[4]["shield"]
        assert told["left_at_end"] == left and told["reason"] == "" and not told["changed"]
        assert told["followed_at_end"] == pytest.approx(env.every / float(env.loop.lasts))
        assert (told["clearance"] == -np.inf) is left
        file = checker.load(env.certificate(tmp_path / "end.json"))
        assert ("TUBE_LEFT" in [name for name, *_ in file["premises"]]) is left
    env.reset()
    gone.append(True)
    told = env.step(AHEAD * 0.7)[4]["shield"]
    assert told["left_at_end"] is None and told["clearance"] > 0
    assert told["reason"] == "what is sensed at the end is not known: OSError: no scan"


def test_sensing_that_disagrees_with_itself_ends_in_the_stop(model):
    """A pose that jumps, one that is not known, and speeds that are not."""
    for wrong, said in ((5.0, "beyond what tube"), (np.nan, "finite"), (None, "what is sensed")):
        broken = []

        def seen(env, observation, broken=broken, wrong=wrong):
            if broken and wrong is None:
                raise OSError("no scan")
            one = sense(env, observation)
            return one._replace(pose=one.pose + (wrong if broken else 0.0))

        env = shielded(model=model, sense=seen)
        env.reset()
        env.step(AHEAD / 2)
        broken.append(True)
        *_, info = env.step(AHEAD / 2)
        assert said in info["shield"]["reason"] and (info["shield"]["driven"] == 0).all()


def test_a_pose_that_jumps_is_told_of_also_where_the_action_is_none(model):
    env = shielded(model=model)
    env.reset()
    env.unwrapped.place = env.unwrapped.place + 40.0
    env.step(AHEAD)
    told = env.step([np.nan, 0.0])[4]["shield"]
    assert told["left"] and env.commitments[-1].seen_outside
    assert "beyond what tube" in told["reason"] and "expected finite numbers" in told["reason"]


def test_a_pose_elsewhere_at_the_first_step_is_told_of(model):
    """The world went on between reset and step, into the reach of the post: "certified", still."""
    env = shielded(model=model, sense=lambda env, _: sense(env, env.unwrapped.seen()))
    env.reset()
    env.unwrapped.place = np.array([0.79, 0.0])
    told = env.step(AHEAD)[4]["shield"]
    assert told["left"] and told["clearance"] == -np.inf and "beyond what tube" in told["reason"]


def test_after_an_error_of_the_environment_nothing_is_certified_until_a_reset(model):
    """It may have moved on: the same action was driven again from what was sensed before."""

    class Late(Platform):
        late = False

        def step(self, action):
            answer = super().step(action)
            if self.late:
                raise TimeoutError("the reply was late")
            return answer

    env = shielded(Late(), model)
    env.reset()
    env.step(AHEAD)
    env.unwrapped.late = True
    with pytest.raises(TimeoutError):
        env.step(AHEAD)
    env.unwrapped.late = False
    with pytest.raises(pj.InputError, match="expected a reset that certified a stop before"):
        env.step(AHEAD)
    assert env.restart(env.unwrapped.seen() * [1, 1, 0, 0])["shield"]["clearance"] > 0


def test_speeds_that_disagree_with_the_poses_end_in_the_stop(model):
    """They stick at rest while it goes on: one step later the pose tells."""
    stuck = []

    def seen(env, observation):
        one = sense(env, observation)
        return one._replace(given=one.given * (0.0 if stuck else 1.0))

    env = shielded(Platform(posts=[[9.0, 9.0]]), model, sense=seen)
    env.reset()
    env.step(AHEAD * 0.7)
    assert env.step(AHEAD * 0.7)[4]["shield"]["reason"] == ""
    stuck.append(True)
    told = [env.step(AHEAD * 0.7)[4]["shield"] for _ in range(2)]
    assert [one["left"] for one in told] == [False, True]
    assert "beyond what tube" in told[1]["reason"] and (told[1]["driven"] == 0).all()


def test_a_tube_that_was_left_is_told_though_its_action_failed_once(model):
    """The step that raised told nothing; a monitor never heard of a run that left."""
    faults = []

    def seen(env, observation):
        one = sense(env, observation)
        return one._replace(pose=np.add(one.pose, [0.3, 0.0])) if faults else one

    def driven(*of):
        if faults == ["bus"]:
            raise OSError("the bus is down")
        return act(*of)

    env = shielded(Platform(posts=[[9.0, 9.0]]), model, sense=seen, act=driven)
    env.reset()
    for _ in range(2):
        assert env.step(AHEAD * 0.7)[4]["shield"].get("left") in (None, False)
    faults.append("bus")
    with pytest.raises(pj.InputError, match="the bus is down"):
        env.step(AHEAD * 0.7)
    faults.append("mended")
    assert env.step(AHEAD * 0.7)[4]["shield"]["left"]


def test_the_brake_goes_on_with_what_was_measured_last(model):
    """It needs speeds, and they become NaN."""
    broken = []

    def seen(env, observation):
        one = sense(env, observation)
        return one._replace(given=one.given + (np.nan if broken else 0.0))

    def brake(k, seconds, given):
        return act(k, seconds, given) + 0.0 * given

    env = shielded(model=model, sense=seen, act=brake)
    env.reset()
    env.step(AHEAD / 2)
    broken.append(True)
    *_, info = env.step(AHEAD / 2)
    assert "given: expected finite" in info["shield"]["reason"]
    assert (info["shield"]["driven"] == 0).all()


def test_where_an_episode_has_ended_nothing_is_certified(model):
    class Ends(Platform):
        def step(self, action):
            seen, reward, _, _, info = super().step(action)
            return seen, reward, True, False, info

    env = shielded(Ends(), model)
    env.reset()
    assert env.step(AHEAD * 0.7)[2]
    with pytest.raises(pj.InputError, match="expected a reset that certified a stop"):
        env.step(AHEAD * 0.7)
    assert not env.commitments[-1].k.flags.writeable


def test_an_environment_that_resets_itself_is_refused(model):
    """In one step it begins another world, in which no stop is certified."""
    import gymnasium

    for env in (
        gymnasium.wrappers.Autoreset(Platform()),
        gymnasium.wrappers.TimeLimit(gymnasium.wrappers.Autoreset(Platform()), 9),
    ):
        with pytest.raises(pj.InputError, match=r"waits for reset.*Leave that wrapper out"):
            shielded(env, model)
    shielded(gymnasium.wrappers.TimeLimit(Platform(), 9), model)


def test_what_is_assumed_has_a_name_and_says_something(model, tmp_path):
    """An empty one was told as ": x"."""
    for wrong in ({"": "x"}, {"floor": ""}):
        with pytest.raises(pj.InputError, match="Shield: expected assumed as some text by name"):
            shielded(model=model, assumed=wrong)
    env = shielded(model=model)
    env.reset(seed=0)
    with pytest.raises(pj.InputError, match="episode: expected assumed as some text"):
        pj.drive.save_episode(tmp_path / "drive.json", env.commitments, assumed={"floor": ""})


def test_what_is_assumed_is_told_by_whatever_tells_of_its_manoeuvres(model, tmp_path):
    """By whichever door the episode is saved, by one manoeuvre's file, by who keeps clear of it,
    and of copies, as from another process, from which none may be left out either.
    """
    env = shielded(Platform(posts=[[5.0, 5.0]]), model, assumed={"creep": "at most 1 cm"})
    env.reset(seed=0)
    for _ in range(4):
        env.step(AHEAD / 4)
    path = tmp_path / "drive.json"
    for again in (None, {"creep": "at most 1 cm"}, {"floor": "dry"}):
        file = checker.load(pj.drive.save_episode(path, env.commitments, assumed=again))
        assert ["creep", "assumed", "at most 1 cm"] in file["premises"]
        report = checker.check_episode(file, allowance_of)
        assert "creep" in "\n".join(checker.episode.summary_of_episode(report))
    assert ["floor", "assumed", "dry"] in file["premises"]
    with pytest.raises(pj.InputError, match="expected creep as its loop assumes it"):
        pj.drive.save_episode(path, env.commitments, assumed={"creep": "none"})
    last = env.commitments[-1]
    assert "creep: at most 1 cm" in last.certificate()["meta"]["rests_on"]
    at = float(last.begin) + 0.1
    *_, span = pj.drive.reserved(env.loop.under_way, at, model.time)[1]
    assert "assumed creep: at most 1 cm" in span.rests_on
    law = {"law": lambda seed: 0, "key": jax.random.key(0), "n": 1, "workers": 0, "quiet": True}
    copies = pickle.loads(pickle.dumps(env.commitments))
    assert not any(one.under_way for one in copies)
    said = [
        pj.drive.drive_episodes(
            lambda world, seed, some=some: pj.drive.Outcome(False, False, committed=some), **law
        ).details()
        for some in (env.commitments, copies)
    ]
    since = ", assumed it was copied, and no pose outside of its tube was seen since"
    assert said[0].partition("(E)")[0] == said[1].replace(since, "").partition("(E)")[0]
    assert since in said[1] and since not in said[0]
    file = checker.load(pj.drive.save_episode(path, copies))
    assert file["premises"][-1][:2] == ["COPIED", "assumed"]
    assert "assumed creep: at most 1 cm" in said[0]
    for some in (env.commitments[:2], copies[:2]):
        bare = lambda *_, some=some: pj.drive.Outcome(False, committed=some)  # noqa: E731
        with pytest.raises(pj.InputError, match="expected all that the robot drove; got 2 of 4"):
            pj.drive.drive_episodes(bare, **law)


def test_a_shield_beside_a_robot_that_left_its_tube_says_that_nothing_is_certified(model):
    line, goes = line_model(4, 0.01, rests=True), lambda seen: -seen.path[:, -1, 0]
    loop = pj.drive.Loop(line, 0.05, leave=0.5, given=(1,), effort=PATIENT)
    other = loop.step(np.array([9.0, 9.0]), [0.0], [], goes, at=0.0).committed
    beside = pj.drive.reserved(other, 0.0, model.time)

    def sense(env, seen):
        return pj.drive.Sensed(seen[:2], seen[2:], *beside)

    env = shielded(Platform(posts=[[5.0, 5.0]]), model, sense=sense)
    about = env.reset(seed=0)[1]["shield"]
    assert about["certified_until"] > 0 and about["clearance"] > 1
    loop.step(np.zeros(2), [0.0], [], goes, at=0.25)
    about = env.step(AHEAD)[4]["shield"]
    assert (about["certified_until"], about["clearance"]) == (0.0, -np.inf)
    assert "left its tube by 0.25 s" in about["reason"]


def test_a_vector_environment_tells_of_each_tube_once(model):
    """What there is nothing to say of is not in `info`: of None it makes a False."""
    envs = gymnasium.vector.SyncVectorEnv(
        [
            lambda heavier=heavier: shielded(
                Platform(posts=[[5.0, 5.0]], heavier=heavier), model, uncertainty=None
            )
            for heavier in (1.0, 1.3)
        ]
    )
    envs.reset(seed=0)
    told = [[], []]
    for _ in range(6):
        *_, infos = envs.step(np.stack([AHEAD * 0.7] * 2))
        about = infos["shield"]
        for i, of in enumerate(told):
            if "left" in about and about["_left"][i]:
                of.append(bool(about["left"][i]))
    assert told == [[False] * 5, [True]] or told == [[False] * 5, [False, True]]


def test_a_tube_within_what_poses_are_uncertain_by_is_not_told_as_kept(model):
    """A robot that goes a quarter farther was told as inside; one that is inside by more is."""
    for uncertain, heavier, found in ((0.1, 1.25, None), (0.002, 1.0, False), (0.002, 1.25, True)):
        known = pj.Uncertainty(start=uncertain)
        env = shielded(Platform(posts=[[9.0, 9.0]], heavier=heavier), model, uncertainty=known)
        env.reset()
        told = [env.step(AHEAD * 0.7)[4]["shield"] for _ in range(2)]
        assert "left" not in told[0] and told[1]["left"] == found


def test_once_unknown_of_a_manoeuvre_stays_so(model):
    """A look that says nothing between two that say "inside": it may have left then."""
    poses = []

    def seen(env, observation):
        one = sense(env, observation)
        return one._replace(pose=one.pose * (np.nan if poses else 1.0))

    env = shielded(Platform(posts=[[9.0, 9.0]]), model, sense=seen)
    env.reset()
    for unknown, told in ((0, ""), (1, ""), (0, "left")):
        poses[:] = [1] * unknown
        shield = env.step(AHEAD / 2)[4]["shield"]
        assert ("left" in shield) == bool(told)
    assert shield["left"] is None


class Trailer(Platform):
    """A platform of two points; the other one, measured, is 8 cm aside after a step."""

    def __init__(self):
        super().__init__(posts=[[9.0, 9.0]])
        self.ends = False

    def step(self, action):
        self.place = self.place + np.asarray(action) * HELD
        return np.array([*self.place, 0.08]), 0.0, False, self.ends, {}

    def reset(self, **options):
        super().reset(**options)
        return np.zeros(3), {}


def trailer_shield(bare):
    """k: how far aside the second point is, and a speed for `HELD` seconds."""
    ways = np.minimum(TIME.dt * np.arange(TIME.n_steps + 1), HELD)
    place = np.array([[[0, t, 0], [0, 0, t], [0, t, 0], [1, 0, t]] for t in ways])
    weight = np.concatenate([place[0, 2:], *place[1:]])
    net = pj.learning.relu_network([weight], [np.zeros(len(weight))])
    domain = pj.box([-0.3, -1.0, -1.0], [0.3, 1.0, 1.0])
    tube = pj.learning.tube(
        [[a, b] for a, b in zip(domain.lo, domain.hi, strict=True)],
        *(np.full(shape, WIDTH) for shape in ((1, TIME.n_steps, 4), (1, 4))),
        n_points=2,
    )
    about = {"system": "trailer", "points": ("hull", "trailer"), "given": (0,)}
    claim = pj.learning.declared_claim(tube, "this test declares it", net, TIME, **about)
    system = SimpleNamespace(
        name="trailer", n_p=2, n_q=0, points=about["points"], given=(0,), domain=domain, time=TIME
    )
    system.rollout_batch = None
    return shielded(
        bare,
        pj.learning.trajectory_model(net, claim),
        system=system,
        body=pj.problem.hull("hull", "trailer", radius=0.15),
        sense=lambda env, seen: pj.drive.Sensed(seen[:2], seen[2:], []),
        act=lambda k, seconds, given: np.asarray(k)[1:] * (seconds < HELD / 2),
    )


@pytest.mark.parametrize("how", ["ends", "none", "ends, given not known"])
def test_a_trailer_that_left_is_seen_by_all_of_its_points(how):
    """At the end, and where an action is none, the first point alone was looked at."""
    bare = Trailer()
    env = trailer_shield(bare)
    if "given" in how:
        of = env._sense
        env._sense = lambda env, seen: of(env, seen)._replace(given=[0.0 if not bare.ends else 9.0])
    env.reset()
    bare.ends = how != "none"
    told = env.step(AHEAD / 2)[4]["shield"]
    if how == "none":
        assert env.step(AHEAD * np.nan)[4]["shield"]["left"]
    elif how == "ends":
        assert told["left_at_end"]
    else:
        assert told["left_at_end"] is None and "nobody knows whether" in told["reason"]


@pytest.mark.parametrize("kind", ["NEXT_STEP", "SAME_STEP"])
def test_a_vector_environment_keeps_what_is_not_known(model, kind):
    """Beside bools None became False; in SAME_STEP the last manoeuvre's is in `final_info`."""

    def one(known):
        bare = gymnasium.wrappers.TimeLimit(Platform(posts=[[9.0, 9.0]]), 3)
        return shielded(bare, model, uncertainty=known)

    envs = gymnasium.vector.SyncVectorEnv(
        [lambda: one(None), lambda: one(pj.Uncertainty(start=0.1))],
        autoreset_mode=gymnasium.vector.AutoresetMode[kind],
    )
    envs.reset(seed=0)
    for _ in range(3):
        *_, infos = envs.step(np.stack([AHEAD / 2] * 2))
    last = infos if kind == "NEXT_STEP" else infos["final_info"]
    assert list(last["shield"]["left_at_end"]) == [False, None]
    assert last["shield"]["_left_at_end"].all()


def test_a_certificate_of_no_episode_is_refused_with_what_to_do(model, tmp_path):
    with pytest.raises(pj.InputError, match="The first is of a loop's step, or of a Shield's res"):
        shielded(model=model).certificate(tmp_path / "none.json")


def test_where_no_stop_is_certified_no_episode_begins_anew(model):
    env = shielded(model=model)
    seen, _ = env.reset()
    env.step(AHEAD / 4)
    env.unwrapped.posts = np.array([[0.1, -0.1]])
    with pytest.raises(pj.InputError, match="certified stop where"):
        env.restart(seen)
    with pytest.raises(pj.InputError, match="expected a reset"):
        env.step(AHEAD)


def test_what_the_user_s_code_gets_wrong_at_a_reset_is_one_sentence(model):
    for wrong, said in (
        ({"sense": lambda env, seen: 1 / 0}, r"to sense at reset; it fails in .*ZeroDivision"),
        ({"sense": lambda env, seen: None}, "expected to sense at reset; got TypeError"),
        ({"metric": lambda one, others: 1 / 0}, r"to decide at reset; it fails in .*ZeroDivision"),
        ({"act": lambda k, seconds, given: 1 / 0}, r"action of a manoeuvre; it fails in .*ZeroDiv"),
        ({"act": lambda k, seconds, given: k[2:] * np.nan}, "act: expected finite numbers"),
        ({"act": lambda k, seconds, given: k}, r"act: expected shape \(2,\); got \(4,\)"),
    ):
        with pytest.raises(pj.InputError, match=said):
            shielded(model=model, **wrong).reset()


def test_a_shield_is_told_by_what_it_was_made_from_whatever_it_has_driven(model):
    """Else a folder of episodes of a driver that has one would be refused once it has driven."""
    env = shielded(model=model)
    told = []
    for actions in ([AHEAD / 4], [AHEAD, -AHEAD], []):  # the environment is as after a reset
        env.reset(seed=0)
        for action in actions:
            env.step(action)
        kept, env.env = env.env, None
        told.append(whole_digest(env))
        env.env = kept
    assert len({*told}) == 1
    assert whole_digest(shielded(model=model, room=0.1)) != whole_digest(shielded(model=model))
