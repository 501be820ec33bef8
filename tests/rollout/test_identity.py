"""A system that was changed in place, or whose code has changed, is not the system it was."""

import array
import collections
import enum
import functools
import itertools
import logging
import operator
import os
import subprocess
import sys
import textwrap
import threading
import types
import typing
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import interpolate, signal, stats
from scipy.spatial import Delaunay, KDTree
from scipy.spatial.transform import Rotation
from synthetic_plants import straight_network

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.law import identity_of
from parc_jax.learning.systems.content import content_of, whole_digest

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
SCALE = 1.0


class Gusty:
    """A cart with a gust that can be changed from outside."""

    name, n_p, n_q = "gusty", 2, 1
    domain, time = pj.box([0.0, 0.0], [1.0, 1.0]), pj.learning.time_grid(0.25, 1.0, 0.05)
    side = 0.0

    def __init__(self, gust=0.01):
        self.gust = gust
        self.inner = types.SimpleNamespace(bias=np.zeros(2))

    @property
    def law(self):
        return {"gust": self.gust}

    def rollout(self, key, k):
        s = jnp.linspace(0.0, 1.0, 21)[:, None]
        push = self.gust * jax.random.normal(key, (2,)) + self.side + jnp.asarray(self.inner.bias)
        return pj.Trajectory(s * k[None] + SCALE * s**2 * push[None], k[:1])


def end(system, n=20, **options):
    return pj.learning.collect(system, KEY, n, quiet=True, **options).p[:, -1]


def test_a_claim_about_a_changed_plant_is_made_from_its_own_runs():
    plant = Gusty(0.01)
    options = {"eps": 0.05, "delta": 0.01, "bins": (1, 1), "quiet": True}
    pj.learning.bound_error(NET, plant, KEY, **options)
    plant.gust = 5.0
    claim = pj.learning.bound_error(NET, plant, KEY, **options)
    assert "gust = 5.0" in claim.details()
    fresh = pj.learning.collect(Gusty(5.0), jax.random.PRNGKey(9), 200, quiet=True)
    assert (~inside_tube(claim, NET, fresh)).mean() <= 0.1  # all of them, once


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        lambda plant: setattr(plant, "gust", 1.0),
        lambda plant: setattr(plant.inner, "bias", np.ones(2)),
        lambda plant: plant.inner.bias.__setitem__(0, 1.0),
        lambda plant: setattr(type(plant), "side", 1.0),
        lambda plant: setattr(plant, "rollout", lambda key, k: Gusty(1.0).rollout(key, k)),
    ],
)
def test_any_attribute_counts(change, monkeypatch):
    monkeypatch.setattr(Gusty, "side", 0.0)  # given back afterwards
    plant = Gusty()
    before = end(plant)
    change(plant)
    assert np.abs(end(plant) - before).max() > 0.1


@pytest.mark.slow
def test_a_global_that_the_rollout_names_counts(monkeypatch):
    plant = Gusty(1.0)
    before = end(plant)
    monkeypatch.setattr(sys.modules[__name__], "SCALE", 3.0)
    np.testing.assert_allclose(end(plant) - before, 2 * (before - end(Gusty(0.0))), atol=1e-9)


@pytest.mark.slow
def test_a_system_that_changes_while_it_runs_is_refused():
    plant = Gusty()
    stream = stream_rollouts(plant, KEY, 2000, chunk=16, quiet=True)
    next(stream)
    plant.inner.bias = np.ones(2)
    with pytest.raises(InputError, match="gusty: expected a system that stays as it is"):
        list(stream)


# Programs, and what is edited in them: runs differ where k_0 is large alone, or not at all.
FAR = ("1.0 * k", "1.0 * k if k[0] < 2 else 2.0 * k")
CAUGHT = ("        y = k / k[0]\n        return y\n    except ValueError:\n        return x\n",)
CAUGHT += (
    "    except ValueError:\n        return x\n    else:\n        y = k / k[0]\n        return y\n",
)
EDITED = {
    "a method of a tuple": """
class Gain(typing.NamedTuple):
    g: float = 1.0
    def of(self, k): return 1.0 * k
def goes(k): return Gain().of(k)
""",
    "a method of a number": """
class Gain(float):
    def of(self, k): return 1.0 * k
G = Gain(1.0)
def goes(k): return G.of(k)
""",
    "an attribute of a list": """
class Gain(list):
    def no_more(self): pass
G = Gain()
G.of = lambda k: 1.0 * k
def goes(k): return G.of(k)
""",
    "an operator": """
class Gain:
    def __matmul__(self, k): return 1.0 * k
G = Gain()
def goes(k): return G @ k
""",
    "what is made at the start": """
class Gain:
    def __init__(self, k): self.to = 1.0 * k
def goes(k): return Gain(k).to
""",
    "what is caught": f"""
def goes(k):
    try:
        x = 1.0 + k
{CAUGHT[0]}""",
}


def of_program(source):
    plant = {"typing": typing, "__name__": "plant"}
    exec(source, plant)
    goes = plant["goes"]

    def simulate(rng, k):
        return np.linspace(0, 1, 5)[:, None] * goes(k)[None], np.zeros(0)

    box, time = pj.box([0, 0], [1, 1]), pj.learning.time_grid(0.5, 1.0, 0.25)
    return pj.python_system(simulate, box, time, name="cart", n_p=2, workers=0)


@pytest.mark.parametrize("kind", EDITED)
def test_stored_runs_of_an_edited_program_are_refused(kind, tmp_path):
    store = {"path": tmp_path / "runs.npz", "quiet": True}
    for _ in range(2):
        pj.learning.collect(of_program(EDITED[kind]), KEY, 4, **store)
    other = EDITED[kind].replace(*FAR).replace(*CAUGHT)
    with pytest.raises(InputError, match="expected the same attribute simulate"):
        pj.learning.collect(of_program(other), KEY, 4, **store)


TABLE = """
from scipy.interpolate import PchipInterpolator
G = PchipInterpolator([0, 1, 2, 3, 4], [1, 1, 1, 1, {}])
def goes(k): return G(k[0]) * k
"""


def test_stored_runs_of_another_table_of_a_library_are_refused(tmp_path):
    """It holds its numbers in private attributes; the run that is made again does not see them."""
    store = {"path": tmp_path / "runs.npz", "quiet": True}
    for _ in range(2):
        pj.learning.collect(of_program(TABLE.format(1)), KEY, 4, **store)
    with pytest.raises(InputError, match="expected the same attribute simulate"):
        pj.learning.collect(of_program(TABLE.format(2)), KEY, 4, **store)


SKIPS = "import pytest; pytest.skip('no camera', allow_module_level=True)"
IMPORTED = {
    "as it runs": "def goes(k):\n    import {0}\n    return {0}.GAIN * k",
    "a name of it": "def goes(k):\n    from {0} import GAIN\n    return GAIN * k",
    "a function of it": "def goes(k):\n    from {0} import of\n    return of(k)",
    "of a package": "def goes(k):\n    from {0}_in.of import {0}\n    return {0}.GAIN * k",
    "by its name": "import {0}\ndef goes(k): return getattr({0}, 'GAIN') * k",
}


@pytest.mark.parametrize("how", IMPORTED)
@pytest.mark.parametrize("change", ["of it", "set"])
def test_stored_runs_of_a_changed_module_are_refused(how, change, tmp_path, monkeypatch):
    """It counts the same before it is loaded and afterwards."""
    name = f"gains_{[*IMPORTED].index(how)}_{change[:2]}"
    folder = tmp_path / (f"{name}_in/of" if "package" in how else "")
    folder.mkdir(exist_ok=True, parents=True)
    (folder / f"{name}.py").write_text(text := "GAIN = 1.0\ndef of(k): return 1.0 * k\n")
    monkeypatch.syspath_prepend(tmp_path)
    source, store = IMPORTED[how].format(name), {"path": tmp_path / "runs.npz", "quiet": True}
    for _ in range(2):
        pj.learning.collect(of_program(source), KEY, 4, **store)
    there = next(sys.modules[x] for x in (name, f"{name}_in.of.{name}") if x in sys.modules)
    if change == "set":
        monkeypatch.setattr(there, "GAIN", 2.0)
        monkeypatch.setattr(there, "of", lambda k: 2.0 * k)
    else:
        monkeypatch.delitem(sys.modules, there.__name__)
        (folder / f"{name}.py").write_text(text.replace("1.0", "1.0 + 1.0"))
    with pytest.raises(InputError, match="expected the same attribute simulate"):
        pj.learning.collect(of_program(source), KEY, 4, **store)


@pytest.mark.parametrize("ends", ["import sys; sys.exit('elsewhere')", SKIPS], ids=["exit", "skip"])
def test_a_module_that_ends_programs_where_no_run_imports_it_ends_none(ends, tmp_path, monkeypatch):
    name = f"ends_by_{len(ends)}"
    (tmp_path / f"{name}.py").write_text(ends)
    monkeypatch.syspath_prepend(tmp_path)
    source = f"def goes(k):\n    if k is None:\n        import {name}\n    return 1.0 * k"
    store = {"path": tmp_path / "runs.npz", "quiet": True}
    for _ in range(2):
        assert pj.learning.collect(of_program(source), KEY, 4, **store).n == 4


def test_an_interrupt_while_a_module_is_loaded_is_one(tmp_path, monkeypatch):
    (tmp_path / "interrupted.py").write_text("raise KeyboardInterrupt")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        whole_digest(of_program("def goes(k):\n    import interrupted\n    return k").simulate)


def test_a_module_that_a_rollout_imports_counts(monkeypatch):
    class Lazy(Gusty):
        def rollout(self, key, k):
            import gains_of_a_rollout

            return gains_of_a_rollout.GAIN * k

    before = content_of(Lazy()).digest
    module = types.ModuleType("gains_of_a_rollout")
    module.GAIN = 1.0
    monkeypatch.setitem(sys.modules, module.__name__, module)
    loaded = content_of(Lazy()).digest
    module.GAIN = 2.0
    assert len({before, loaded, content_of(Lazy()).digest}) == 3


def marked(gain):
    def f(x):
        return x

    f.gain = gain
    return f


@pytest.mark.parametrize(
    "of",
    [
        lambda gain: {"w": gain}.get,
        lambda gain: {"w": gain}.__len__,
        lambda gain: [gain].__getitem__,
        lambda gain: np.array([gain]).take,
        lambda gain: f"{gain} {{}}".format,
        lambda gain: functools.partial(marked(gain), 1),
        lambda gain: collections.deque([gain]),
        lambda gain: array.array("d", [gain]),
    ],
)
def test_methods_and_functions_are_told_with_what_they_belong_to(of):
    def told(gain):
        system = Plain()
        system.of = of(gain)
        return (
            content_of(system).digest,
            whole_digest(of(gain)),
            identity_of(system)["attribute of"],
        )

    assert told(0.1)[1:] == told(0.1)[1:]
    assert not {*told(0.1)} & {*told(0.3)}


def test_a_container_that_is_changed_in_place_counts():
    for one in (collections.deque([0.1]), array.array("d", [0.1])):
        before, same = content_of(one).digest, content_of(one).digest
        one[0] = 0.3
        assert before == same != content_of(one).digest


class Plain:
    """Not JAX: its attributes are read at every run."""

    name, n_p, n_q, domain, time = "plain", 2, 0, Gusty.domain, Gusty.time

    def __init__(self):
        self.law = {"gust": 1}

    def rollout_batch(self, keys, ks):
        s = np.linspace(0, 1, 21)[None, :, None]
        return pj.Trajectory(s * np.asarray(ks)[:, None], np.zeros((len(ks), 0)))


def test_a_law_that_changes_while_a_system_runs_is_refused():
    plant = Plain()
    stream = stream_rollouts(plant, KEY, 200, chunk=16, quiet=True)
    next(stream)
    plant.law = {"gust": 2}
    with pytest.raises(InputError, match="stays as it is"):
        list(stream)


def test_equal_content_has_equal_digests_and_opaque_parts_their_own():
    assert content_of(Gusty(0.1)).digest == content_of(Gusty(0.1)).digest
    assert content_of(Gusty(0.1)).digest != content_of(Gusty(0.2)).digest
    one, two = Gusty(), Gusty()
    one.rng = two.rng = np.random.default_rng(0)  # opaque: only told apart by identity
    assert content_of(one).digest == content_of(two).digest
    two.rng = np.random.default_rng(0)
    assert content_of(one).digest != content_of(two).digest
    assert identity_of(one) == identity_of(two)
    one.me = one  # a cycle ends
    assert content_of(one).digest == content_of(one).digest


def test_a_value_that_keeps_its_text_once_it_has_told_it_is_the_same():
    spaces = pytest.importorskip("gymnasium").spaces
    box = spaces.Box(-1.0, 1.0, (2,))
    before = whole_digest(box)
    assert repr(box) and whole_digest(box) == before


X = np.arange(6.0)
BODY = "<mujoco><worldbody><body><joint/><geom size='{}'/></body></worldbody></mujoco>"


def body(size):
    return pytest.importorskip("mujoco").MjModel.from_xml_string(BODY.format(size))


def stepped(model):
    mujoco = pytest.importorskip("mujoco")
    mujoco.mj_step(model, mujoco.MjData(model))


SPREAD, OVER = np.split(np.random.default_rng(0).random((50, 3)), [2], axis=1)


def at_the_middle(table):
    assert np.isfinite(table(0.5, 0.5)).all()


# makers of objects of libraries by a number, and what uses one
TABLES = {
    "cubic": (lambda n: interpolate.CubicSpline(X, n * X**2), lambda f: f(2.5)),
    "pchip": (lambda n: interpolate.PchipInterpolator(X, n * X**2), lambda f: f(2.5)),
    "b-spline": (lambda n: interpolate.make_interp_spline(X, n * X**2), lambda f: f(2.5)),
    "fitpack": (lambda n: interpolate.UnivariateSpline(X, n * X**2), lambda f: f.integral(0, 1)),
    "grid": (
        lambda n: interpolate.RegularGridInterpolator((X, X), n * np.outer(X, X)),
        lambda f: f([[1.0, 1.5]]),
    ),
    "rotation": (lambda n: Rotation.from_euler("z", n), lambda r: r.as_matrix()),
    "tree": (lambda n: KDTree(n * SPREAD), lambda tree: tree.query([0, 1])),
    "nearest": (lambda n: interpolate.NearestNDInterpolator(n * SPREAD, OVER), at_the_middle),
    "linear": (lambda n: interpolate.LinearNDInterpolator(SPREAD, n * OVER), at_the_middle),
    "smooth": (lambda n: interpolate.CloughTocher2DInterpolator(SPREAD, n * OVER), at_the_middle),
    "triangles": (lambda n: Delaunay(n * SPREAD), lambda x: x.transform),
    "system": (lambda n: signal.lti([1.0], [1.0, n]), lambda system: system.step()),
    "states": (
        lambda n: signal.StateSpace([[-n]], [[1.0]], [[1.0]], [[0.0]]),
        lambda s: s.to_discrete(0.1),
    ),
    "law": (lambda n: stats.norm(0, n), lambda law: law.cdf(0.0)),
    "item": (operator.itemgetter, repr),
    "attribute": (lambda n: operator.attrgetter(f"of_{n}"), repr),
    "method": (lambda n: operator.methodcaller("f", n), repr),
    "generator": (np.random.default_rng, repr),
    "count": (itertools.count, repr),
    "mask": (lambda n: np.ma.array([1.0, 2.0], mask=[0, n - 1]), lambda x: x.mean()),
    "model": (body, stepped),
}


@pytest.mark.parametrize("kind", TABLES)
def test_all_of_an_object_of_a_library_counts_and_no_use_of_it(kind):
    make, use = TABLES[kind]

    def told(x):
        return identity_of(types.SimpleNamespace(**vars(Plain), law=None, of=x))["attribute of"]

    one = make(1)
    before = told(one)
    use(one)
    assert told(make(1)) == told(one) == before != told(make(2))


def test_what_a_run_fills_is_no_content():
    mujoco = pytest.importorskip("mujoco")
    model, data = body(1), mujoco.MjData(body(1))
    log, held = logging.getLogger("of a robot"), threading.Event()

    def told():
        system = Plain()
        system.of = [data, held, log, np.random.normal, stats.norm]
        return identity_of(system)

    before = told()
    mujoco.mj_step(model, data)
    held.set()
    log.info("a run")
    np.random.normal()  # noqa: NPY002
    assert told() == before


@pytest.mark.slow
def test_tables_of_libraries_are_the_same_in_another_process():
    code = (
        "import test_identity as of\n"
        "from parc_jax.learning.systems.content import Reader\n"
        "print(*(Reader(lasting=True).digest(make(1)) for make, _ in of.TABLES.values()))\n"
        "print(Reader(lasting=True).digest([of.stats.norm, of.np.random.normal]))"
    )
    told = {
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=Path(__file__).parent,
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        for seed in "12"
    }
    assert len(told) == 1 and len(told.pop().split()) == len(TABLES) + 1


class Side(enum.IntFlag):
    """Members reach each other by their class; all fall into one place of a set."""

    LEFT, RIGHT, UP = 1, 2, 4

    def __hash__(self):
        return 0


def test_a_set_of_members_is_the_same_in_any_order():
    first, second = (set(order) for order in ([*Side], [*Side][::-1]))
    assert list(first) != list(second)
    assert whole_digest(first) == whole_digest(second)
    assert whole_digest(first) != whole_digest({Side.LEFT, Side.UP})


def test_flags_that_are_combined_change_no_program():
    before = content_of(Side.LEFT).digest, whole_digest(Side)
    assert Side.LEFT | Side.UP == 5
    assert (content_of(Side.LEFT).digest, whole_digest(Side)) == before


@pytest.mark.slow
def test_the_identity_outlives_the_process(tmp_path):
    source = textwrap.dedent(
        """
        import jax.numpy as jnp
        import parc_jax as pj

        GUSTS = {"north", "south", "east", "west"}   # a set: its order differs between processes


        class Robot:
            '''A robot.'''
            name, n_p, n_q = "robot", 2, 0
            domain, time = pj.box([0.0, 0.0], [1.0, 1.0]), pj.learning.time_grid(0.25, 1.0)

            def __init__(self):
                self.workers, self._started, self.lock = 3, object(), object()

            def rollout(self, key, k):
                share = FACTOR * jnp.linspace(0, 1, 5)[:, None]
                return pj.Trajectory(share * k + len(GUSTS) * 0, k[:0])

        FACTOR = 1.0
        """
    )

    def asked(text, seed):
        (tmp_path / "robot.py").write_text(text)
        code = (
            "import sys, json; sys.dont_write_bytecode = True; sys.path.insert(0, sys.argv[1])\n"
            "import robot; from parc_jax.learning.runs.law import identity_of\n"
            "print(json.dumps(identity_of(robot.Robot())))"
        )
        out = subprocess.run(
            [sys.executable, "-c", code, str(tmp_path)],
            env=os.environ | {"PYTHONHASHSEED": str(seed), "JAX_PLATFORMS": "cpu"},
            capture_output=True,
            check=True,
            text=True,
        )
        return out.stdout

    first = asked(source, 1)
    assert asked(source, 2) == first
    assert (
        asked(source.replace("workers, self", "workers, self").replace("= 3,", "= 4,"), 1) == first
    )
    assert asked("# a comment\n" + source, 1) == first
    assert asked(source.replace("FACTOR = 1.0", "FACTOR = 2.0"), 1) != first
    assert asked(source.replace("FACTOR * jnp", "FACTOR + jnp"), 1) != first
    assert asked(source.replace('"robot"', '"other"'), 1) != first
