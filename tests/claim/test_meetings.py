"""Two things that meet agree in every entry of what they are about, or are refused in words, or say
in their sentence what differs. Entries are read off the records: a new one without a rule fails.
"""

from dataclasses import fields, replace

import jax
import numpy as np
import pytest
from synthetic_plants import noisy, plant, straight_network

import parc_jax as pj
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import LawSpec, Subject, law_spec, subject_of
from parc_jax.safe_set.batch.box_scenes import lay_out_boxes
from parc_jax.safe_set.verdict.outline import require_same

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
N, K = 40, {"k": ("speed [m/s]", "turn [rad]")}
pytestmark = pytest.mark.soundness
DATA = "what was run: it is in the tube and in the hash of the claim"
WATCHED = "which runs they are: each is counted once"


def runs_of(stage, name="plant", **options):
    runs = pj.learning.collect(plant(noisy, name=name), KEY, N, stage, quiet=True, **options)
    named = runs.subject.with_labels(K | {"q": ("yaw [rad]",)}).labels
    return runs.replace(labels=named)


TRAIN, HELD, NEW = (runs_of(stage) for stage in (Stage.TRAIN, Stage.BOUND, Stage.REPLAY))


def logged(runs, **changes):
    """The same as a law with other fields."""
    return runs.replace(law=replace(runs.law, **changes))


def swapped(runs):
    named = runs.labels._replace(k=runs.labels.k[::-1])
    return runs.replace(labels=named)


# Of runs, each field, and each field of their law, made another.
OTHER = {
    "rows": lambda runs: runs.select(slice(1, N)),
    "k": lambda runs: runs.replace(k=runs.k[::-1]),
    "p": lambda runs: runs.replace(p=runs.p + 0.01 * runs.p**2),
    "q": lambda runs: runs.replace(q=runs.q + 0.01),
    "domain": lambda runs: runs.replace(domain=pj.box([0, 0], [2, 2])),
    "time": lambda runs: runs.replace(time=pj.learning.time_grid(0.5, 2.0, 0.1)),
    "seed": lambda runs: runs.replace(seed=(7, 7)),
    "stage": lambda runs: runs.replace(stage=5),
    "groups": lambda runs: runs.replace(groups=np.arange(runs.n)),
    "points": lambda runs: runs.replace(points=("nose",)),
    "rotation": lambda runs: runs.replace(rotation=("turns",)),
    "labels": swapped,
    "given": lambda runs: runs.replace(given=(0,)),
    "lost": lambda runs: runs.replace(lost=np.arange(runs.n) % 2),
    "source": lambda runs: runs.replace(source=("", 0, 2 * N)),
    "law.generator": lambda runs: logged(runs, generator="other"),
    "law.parameters": lambda runs: logged(runs, parameters=(("gust", "9"),)),
    "law.k_law": lambda runs: logged(runs, k_law="logged"),
    "law.lo": lambda runs: logged(runs, lo=tuple(x.hex() for x in (-1.0, -1.0))),
    "law.hi": lambda runs: logged(runs, hi=tuple(x.hex() for x in (2.0, 2.0))),
}
# By meeting, those that are neither refused nor said, each with its reason.
LEFT = {
    "training": dict.fromkeys(("rows", "k", "p", "q", "seed", "stage", "lost", "source"), DATA)
    | dict.fromkeys(("groups", "given", "rotation"), "a simulator's may be others: none is claimed")
    | {name: "the claim is about the calibration runs alone" for name in OTHER if "law." in name},
    "calibration": dict.fromkeys(("k", "p", "q", "seed", "stage"), DATA),
    "monitored runs": dict.fromkeys(("q", "seed", "stage"), WATCHED)
    | {"domain": "another box: each k is looked at"},
}
LEFT |= {"updating runs": LEFT["calibration"], "seen runs": LEFT["training"]}
ONE_BIN = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}


def claim_of(held, train):
    return pj.learning.bound_error(NET, held, None, train=train, **ONE_BIN)


CLAIM = claim_of(HELD, TRAIN)


def updated(seen, fresh):
    return pj.learning.update(CLAIM, NET, seen, fresh)[1]


MEET = {
    "training": (TRAIN, lambda other: claim_of(HELD, other).details()),
    "calibration": (HELD, lambda other: claim_of(other, TRAIN).details()),
    "monitored runs": (NEW, lambda other: pj.monitor(CLAIM, NET).observe(other).details()),
    "updating runs": (NEW, lambda other: updated(TRAIN, other).details()),
    "seen runs": (TRAIN, lambda other: updated(other, NEW).details()),
}


def test_every_field_of_runs_and_of_their_law_is_made_another():
    assert {field.name for field in fields(Subject)} <= ROBOT.keys()
    of_runs = {field.name for field in fields(RolloutBatch)} - {"law"}
    assert of_runs | {f"law.{field.name}" for field in fields(LawSpec)} == OTHER.keys()
    for left in LEFT.values():
        assert left.keys() <= OTHER.keys()


@pytest.mark.parametrize("entry", OTHER)
@pytest.mark.parametrize("meeting", MEET)
def test_runs_that_meet_others_agree_or_say_it(meeting, entry):
    runs, meet = MEET[meeting]
    said = meet(runs)
    try:
        other = meet(OTHER[entry](runs))
    except pj.InputError as error:
        told = str(error)
        assert told != said and entry not in LEFT[meeting], told
        return
    assert (other == said) == (entry in LEFT[meeting]), other


CUT = {"pose": "/odom", "cut short": "failed"}


def cut(runs, **changes):
    """The same, as cut out of bags."""
    told = [(f"parc_jax:{name}", value) for name, value in (CUT | changes).items()]
    return logged(runs, parameters=(*runs.law.parameters, *told))


@pytest.mark.parametrize("entry", CUT)
def test_watched_runs_are_cut_out_of_logs_as_those_of_the_claim(entry):
    """Dropped ones would be silent; poses of another topic are another robot's."""
    watch = pj.monitor(claim_of(cut(HELD), TRAIN), NET)
    assert watch.observe(cut(NEW, dropped="3 left out")).seen == watch.observe(NEW).seen == N
    with pytest.raises(pj.InputError, match=f"premises that agree; {entry} is"):
        watch.observe(cut(NEW, **{entry: "other"}))


NETS = {
    "monitor": lambda net: pj.monitor(CLAIM, net),
    "bound again": lambda net: pj.learning.update(CLAIM, net, TRAIN, NEW),
    "tuned": lambda net: pj.learning.update(CLAIM, net, TRAIN, NEW, lambda *_: NET),
    "model": lambda net: pj.learning.trajectory_model(net, CLAIM),
}


@pytest.mark.parametrize("meeting", NETS)
def test_a_claim_meets_its_own_network_alone(meeting):
    NETS[meeting](NET)
    other = NET.replace(biases=(NET.biases[0] + 1e-6, *NET.biases[1:]))
    with pytest.raises(pj.InputError, match="expected the network its claim was measured on"):
        NETS[meeting](other)


def boxes(model):
    goal = np.array([[0.0, -1.0, -4.0]]), np.array([[2.0, 1.0, 4.0]])
    wall = np.array([[[0.4, -2.0]]]), np.array([[[0.5, 2.0]]])
    return pj.problem.box_scenes(model, *goal, *wall, 0.05)


def of_subject(**changes):
    """A model with other entries of its subject."""
    about = replace(CLAIM.subject, **changes)
    return pj.learning.trajectory_model(NET, derived(CLAIM, subject=about))


SUBJECTS = {
    "system": {"system": "van"},
    "rotation": {"rotation": ("turns",)},
    "given": {"given": (0,)},
    "time": {"time": pj.learning.time_grid(0.5, 2.0, 0.1)},
    "points": {"points": ("nose",)},
    "goal states": {"labels": HELD.labels._replace(q=("roll [rad]",))},
    "parameters": {"labels": swapped(HELD).labels},
}


@pytest.mark.parametrize("entry", SUBJECTS)
def test_scenes_of_a_batch_are_told_for_this_robot_and_its_intervals(entry):
    """Spans count intervals: with those of a shorter model obstacles ended too early."""
    own = of_subject()
    assert len(pj.Planner(own).solve_batch(boxes(own), KEY, draws=16).found) == 1
    told = boxes(of_subject(**SUBJECTS[entry]))
    with pytest.raises(pj.InputError, match=f"premises that agree; {entry} is"):
        pj.Planner(own).solve_batch(told, KEY, draws=16)


def test_scenes_of_a_claim_that_names_no_system_are_taken():
    assert lay_out_boxes(boxes(of_subject(system="")), of_subject())


class Robot:
    """A system with an attribute for each entry of what is known of one."""

    law = (("gust", 2),)

    def __init__(self, **changes):
        about = subject_of(plant(noisy))
        own = vars(about) | {"n_p": about.n_p, "n_q": about.n_q, "labels": HELD.labels} | changes
        self.name, self.p_labels, self.q_labels, self.k_labels = own.pop("system"), *own["labels"]
        for name, value in own.items():
            setattr(self, name, value)

    def rollout(self, key, k):
        raise NotImplementedError


def test_runs_that_turn_and_runs_that_stay_do_not_meet():
    """The word of the held-out ones won in silence, and plans were proved with their heading."""
    turns, stays = ({"rotation": (word,)} for word in ("turns", "stays"))
    for one, other in ((turns, stays), (stays, turns)):
        with pytest.raises(pj.InputError, match="premises that agree; rotation is"):
            claim_of(HELD.replace(**one), TRAIN.replace(**other))
        claim = claim_of(HELD.replace(**one), TRAIN.replace(**one))
        with pytest.raises(pj.InputError, match="premises that agree; rotation is"):
            pj.learning.update(claim, NET, TRAIN.replace(**one), NEW.replace(**other), quiet=True)
        with pytest.raises(pj.InputError, match="premises that agree; rotation is"):
            pj.monitor(claim, NET, share=1.0).observe(NEW.replace(**other))


ROBOT = {
    "system": "other",
    "n_p": 3,
    "n_q": 2,
    "points": ("nose",),
    "time": pj.learning.time_grid(0.5, 2.0, 0.1),
    "domain": pj.box([0.2, 0.2], [0.5, 0.5]),
    "labels": swapped(HELD).labels,
    "rotation": ("stays",),
    "given": (1,),
    "law": (("gust", 9),),
}


@pytest.mark.parametrize("entry", ROBOT)
def test_a_system_is_the_one_of_the_claim_in_every_entry(entry):
    law = law_spec("plant", HELD.domain, "uniform", {"gust": 2})
    held = HELD.replace(law=law, rotation=("turns",), given=(0,))
    model = pj.learning.trajectory_model(NET, claim_of(held, TRAIN))
    whole = {"rotation": ("turns",), "given": (0,)}
    require_same(Robot(**whole), model)
    other = {entry: ROBOT[entry]}
    if entry in ("n_p", "n_q"):
        other |= {"labels": (None, None, None), "rotation": None}
    words = {
        "n_p": "sizes",
        "n_q": "sizes",
        "domain": "K",
        "law": "law: gust",
        "labels": "parameters",
    }
    told = f"premises that agree; {words.get(entry, entry)} is"
    with pytest.raises(pj.InputError, match=told):
        require_same(Robot(**(whole | other)), model)
