"""Runs on workers, ours or the user's: the same numbers on any number of them, a run that is lost
with its worker has failed unless the user says that workers go away, nothing is taken from a worker
with another program.
"""

import importlib
import logging
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial, wraps

import jax
import numpy as np
import pytest
from needs import need
from scipy import spatial, stats
from walkers import (
    logged,
    remembers,
    remembers_from,
    rough,
    slowly,
    smooth,
    unequipped,
    upright,
    walk,
)

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.start_gap import translation_gap
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.systems.fleet import Processes

DOMAIN, TIME = pj.box([0.0], [1.0]), pj.learning.time_grid(0.5, 1.0)
KEY = jax.random.PRNGKey(3)


def system(executor, simulate=walk, **more):
    about = {"name": "walk", "n_p": 2, "n_q": 1}
    if executor is None:
        return pj.python_system(simulate, DOMAIN, TIME, **about, **{"workers": 0} | more)
    return pj.python_system(simulate, DOMAIN, TIME, **about, executor=executor, **more)


def runs(executor, n=40, simulate=walk, workers=2, lost="failed", **more):
    made = system(executor, simulate, lost=lost, workers=workers if executor else 0)
    try:
        return pj.learning.collect(made, KEY, n=n, quiet=True, **more)
    finally:
        made.close()


@pytest.fixture(autouse=True)
def fresh_worker(monkeypatch):
    """Executors in this process make it a worker that has seen nothing."""
    monkeypatch.setattr("parc_jax.learning.systems.python_worker._AT", [])
    monkeypatch.setattr("parc_jax.learning.systems.python_worker._LEFT", {})


@pytest.fixture(scope="module")
def alone():
    return pj.learning.collect(system(None), KEY, n=40, quiet=True)


def same(one, other) -> bool:
    pairs = ((one.k, other.k), (one.p, other.p), (one.q, other.q))
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


class Inline:
    """An executor of one thread, this one, that misbehaves when told: `losing` says which calls
    (numbers) are lost, and with what.
    """

    def __init__(self, losing=None):
        self.losing = losing or {}
        self.calls, self.asked = -1, set()  # the first is empty
        self.lock = threading.Lock()

    def submit(self, function, *arguments):
        with self.lock:
            number = self.calls
            self.calls += 1
            self.asked.add(pickle.dumps((function, arguments)))
        future = Future()
        if number in self.losing:
            future.set_exception(self.losing[number])
        else:
            function, arguments = pickle.loads(pickle.dumps((function, arguments)))
            try:
                future.set_result(function(*arguments))
            except ImportError as error:
                future.set_exception(error)
        return future


def pool(losing):
    """One of the standard library, whose calls go astray as those of `Inline` do."""
    made = ThreadPoolExecutor(2)
    made.submit = Inline(losing).submit
    return made


@pytest.mark.parametrize(
    "workers",
    [pytest.param(1, marks=pytest.mark.slow), 3, pytest.param(50, marks=pytest.mark.slow)],
)
def test_numbers_do_not_depend_on_how_many_work(workers, alone):
    with ThreadPoolExecutor(workers) as pool:
        assert same(runs(pool, workers=None), alone)
    assert alone.failed.any() and not alone.failed.all()


GONE = ConnectionError("the worker is gone")


def test_a_lost_run_has_failed_and_no_other_is_begun_twice(alone):
    executor = Inline({i: GONE for i in (0, 3, 9)})
    found = runs(executor)
    more = found.failed & ~alone.failed
    # one more, as the first is repeated
    assert executor.calls == 41 and found.failed.sum() <= 3 + 40
    assert same(found.select(~found.failed), alone.select(~found.failed))
    # it is no executor of the standard library, and may make calls again in silence; which calls
    # are lost depends on the threads, and some of them may fail by themselves
    assert set(found.lost) == {-1, 0} and (found.lost == 0).sum() == 3
    assert (found.lost[more] == 0).all()


def test_a_lost_run_is_made_again_and_counted_where_workers_go_away(alone, tmp_path):
    astray = {i: GONE for i in (0, 3, 4, 5, 9)}
    executor, counted = Inline(astray), pool(astray)
    found = runs(executor, lost="again")
    # what it makes again in silence beside those nobody counts, whatever is declared
    assert same(found, alone) and (found.lost == -1).all()
    assert len(executor.asked) == executor.calls + 1  # dask would take equal ones for one
    found = runs(counted, lost="again", path=tmp_path / "runs.npz")
    assert same(found, alone)
    assert executor.calls == 41 + 5 and found.lost.sum() == 5
    assert 2 <= (found.lost > 0).sum() <= 5  # none was lost three times
    for kept in (
        pj.load_rollouts(tmp_path / "runs.npz"),
        concatenate([found, alone.replace(rows=alone.rows + 40)]),
    ):
        assert np.array_equal(kept.lost[:40], found.lost) and not kept.lost[40:].any()
    assert found.select(found.lost == 0).lost.sum() == 0 and alone.lost is None
    with pytest.raises(InputError, match='expected lost = "failed", or "again" beside an executor'):
        pj.python_system(walk, DOMAIN, TIME, name="walk", n_p=2, n_q=1, lost="again")


def test_a_claim_says_how_many_runs_were_made_again():
    made = system(pool({1: GONE}), lost="again", workers=2, simulate=upright)
    data = pj.learning.collect(made, KEY, n=24, quiet=True)
    net = pj.learning.train(data, hidden=(4,), key=KEY, seeds=1, steps=20)
    # after those of the trial of starts, and one to begin with
    made = system(pool({15: GONE, 16: GONE}), lost="again", workers=2, simulate=upright)
    about = {"eps": 0.2, "delta": 0.2, "train": data, "quiet": True}
    claim = pj.learning.bound_error(net, made, KEY, **about)
    assert "WORKERS_LOST(2, independent of the run)" in claim.assumptions
    assert "WORKERS_LOST(2, " in claim.details() and claim.evidence["lost"] == 2
    for one, said in ((Inline, True), (lambda: ThreadPoolExecutor(2), False)):
        for lost in ("failed", "again"):  # no declaration takes the premise away
            made = system(one(), workers=2, simulate=upright, lost=lost)
            told = pj.learning.bound_error(net, made, KEY, **about).details()
            assert ("WORKERS_LOST(uncounted, independent of the run)" in told) == said


def test_an_executor_that_makes_lost_calls_again_in_silence_is_told_apart(alone):
    secret = type("ClientExecutor", (Inline,), {"__module__": "distributed.cfexecutor"})
    with pytest.raises(InputError, match=r'ClientExecutor makes them again.*lost="again"'):
        system(secret())
    found = runs(secret(), lost="again")
    assert same(found, alone) and (found.lost == -1).all()


def test_what_is_always_lost_ends_in_one_sentence_that_names_it(monkeypatch):
    class Deaf(Inline):
        def submit(self, function, *arguments):
            if not any(0.2 < k[0] < 0.25 for (k,) in arguments[5]):
                return super().submit(function, *arguments)
            future = Future()
            future.set_exception(OSError("no route"))
            return future

    executor = Deaf()
    words = r"the one with k = \[0\.2.*lost 3 times, the last time with OSError: no route\."
    with pytest.raises(InputError, match=words):
        runs(executor, lost="again")
    assert executor.calls < 40
    assert runs(Deaf()).failed.sum() > 0


def test_an_executor_that_broke_is_made_again(alone):
    made = []

    def make():
        losing = {1: BrokenProcessPool("dead")} if len(made) < 2 else {}
        made.append(Inline(losing))
        made[-1].shutdown = lambda wait: None
        return made[-1]

    assert same(runs(make, lost="again"), alone) and len(made) == 3
    with pytest.raises(InputError, match=r"it broke with BrokenProcessPool: dead. Give a function"):
        runs(Inline({1: BrokenProcessPool("dead")}))


def test_a_worker_with_other_code_is_refused():
    class Elsewhere(Inline):
        """Its name for the function means another one."""

        def submit(self, function, sending, code, both, *arguments):
            return super().submit(function, sending, code, (slowly, None), *arguments)

    with pytest.raises(InputError, match="expected workers with the program that is here; process"):
        runs(Elsewhere())


def test_what_a_machine_lacks_is_no_failed_run():
    lacks = "ModuleNotFoundError: No module named 'no_such_sim"
    for executor in (None, Inline()):
        with pytest.raises(InputError, match="simulate to find what it imports; " + lacks):
            runs(executor, simulate=unequipped)


def test_what_is_no_executor_is_refused():
    with pytest.raises(InputError, match=r"expected an executor with `submit`.*got str and None"):
        system("dask")
    with pytest.raises(InputError, match="one or more workers; got Inline and 0"):
        system(Inline(), workers=0)


SPAWN = partial(ProcessPoolExecutor, 2, mp_context=multiprocessing.get_context("spawn"))
ONE = partial(ProcessPoolExecutor, 1, mp_context=multiprocessing.get_context("spawn"))


@pytest.mark.slow
@pytest.mark.parametrize("executor", [None, ONE, SPAWN])
def test_who_ends_its_process_has_failed_on_any_workers(executor, tmp_path):
    """Its deaths do not follow from its seed: a second chance would be a share of successes."""
    workers = 2 if executor is None else None
    made = system(executor, partial(logged, folder=str(tmp_path)), workers=workers)
    found = pj.learning.collect(made, KEY, n=40, quiet=True)
    made.close()
    begun = [path.read_text() for path in tmp_path.iterdir()]
    dead = sum(text == "begun" for text in begun)
    # none was begun twice: it would have raised
    if executor is SPAWN:  # one dead process breaks it, and takes the other's run with it
        assert 0 < dead <= 40 - begun.count("ended") <= found.failed.sum() <= 2 * dead
    else:
        assert 0 < dead == found.failed.sum() < 30 and len(begun) == 40


SCRIPT = """
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
import jax, numpy as np, parc_jax as pj

STEP = 0.5

class Walk:
    far = 2.0
    def __call__(self, rng, k):
        steps = STEP * k[0] + self.far * rng.normal(size=(2, 2))
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), []

if __name__ == "__main__":
    make = partial(ProcessPoolExecutor, 2, mp_context=get_context("spawn"))
    ends = []
    for more in ({"executor": make}, {"workers": 0}):
        box, time = pj.box([0.0], [1.0]), pj.learning.time_grid(0.5, 1.0)
        system = pj.python_system(Walk(), box, time, name="walk", n_p=2, **more)
        ends.append(pj.learning.collect(system, jax.random.PRNGKey(0), n=30, quiet=True).p)
        system.close()
    print((ends[0] == ends[1]).all())
    Walk.far = 1.0                                     # here alone: other processes read the file
    for more in ({"executor": make}, {"workers": 2}):
        system = pj.python_system(Walk(), box, time, name="walk", n_p=2, **more)
        try:
            pj.learning.collect(system, jax.random.PRNGKey(0), n=30, quiet=True)
        except ValueError as error:
            print("has another __main__.Walk. Set globals where" in str(error))
"""


def test_workers_that_do_not_start_end_before_the_first_run_in_one_sentence():
    """Else each row would begin anew in workers that break, and the work would never end."""
    never = Inline(dict.fromkeys(range(-1, 99), BrokenProcessPool("it broke")))
    never.shutdown = lambda wait: None
    with pytest.raises(InputError, match=r"workers that start; an empty call, before the first r"):
        runs(lambda: never)
    assert never.calls < 6


UNGUARDED = """
import numpy as np, jax, parc_jax as pj

def walk(rng, k):
    return np.outer(np.linspace(0, 1, 3), [k[0], 0.0]), []

box, time = pj.box([0.0], [1.0]), pj.learning.time_grid(0.5, 1.0)
system = pj.python_system(walk, box, time, name="walk", n_p=2)
pj.learning.collect(system, jax.random.PRNGKey(0), n=30, quiet=True)
"""


def test_a_process_that_takes_no_call_leaves_its_place(monkeypatch):
    """As at the end of Python, in a thread that still collects: it waited for ever."""

    def refuses(*_):
        raise RuntimeError("cannot schedule new futures after interpreter shutdown")

    def collects():
        with pytest.raises(InputError, match="it refused 3 times, the last time with Runtime"):
            pj.learning.collect(made, KEY, n=4, quiet=True)
        ended.set()

    made, ended = system(None, workers=1), threading.Event()
    monkeypatch.setattr(ProcessPoolExecutor, "submit", refuses)
    threading.Thread(target=collects, daemon=True).start()
    assert ended.wait(20)
    made.close()


def test_a_process_that_died_while_it_was_free_takes_no_call_with_it():
    """As of a simulator that crashes as it cleans up, after its run."""
    processes, broken = Processes(1), ProcessPoolExecutor(1)
    processes._free.queue[:] = [broken]
    broken._broken = "a process in the pool was terminated abruptly"
    assert processes.submit(abs, -3).result() == 3
    assert processes.submit(abs, -4).result() == 4
    processes.shutdown()


@pytest.mark.slow
def test_a_script_that_does_not_guard_its_start_is_told_so(tmp_path):
    (tmp_path / "walk.py").write_text(UNGUARDED)
    command = [sys.executable, tmp_path / "walk.py"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode and "A script guards its own start with `if __name__" in done.stderr


@pytest.mark.slow
def test_a_script_is_the_same_program_in_its_workers_until_it_changes_itself(tmp_path):
    path = tmp_path / "walk.py"
    path.write_text(SCRIPT)
    done = subprocess.run([sys.executable, path], capture_output=True, text=True)
    assert done.stdout == 3 * "True\n" and "Exception ignored" not in done.stderr, done.stderr


@pytest.mark.slow
def test_a_pool_that_runs_of_another_system_changed_is_refused():
    """It was asked for its program before its first run alone: 975 of 1,000 left "at most 0.05"."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as made:
        first, others = (runs(made, 20, of, workers=1) for of in (rough, smooth))
        assert not same(first, others)
        with pytest.raises(InputError, match=r"has another walkers\.FLOOR\. Set globals"):
            runs(made, 20, rough, workers=1)


def test_a_sweep_may_return_to_its_first_value_in_threads(monkeypatch):
    with ThreadPoolExecutor(1) as made:
        ends = []
        for drift in (1.0, 2.0, 1.0):
            monkeypatch.setattr("walkers.DRIFT", drift)
            ends.append(runs(made, 5, upright, workers=1))
    assert same(ends[0], ends[2]) and not same(ends[0], ends[1])


@pytest.mark.slow
def test_what_a_worker_remembers_between_runs_is_no_other_program():
    about = {"name": "walk", "n_p": 2, "n_q": 1, "workers": 2, "simulate_from": remembers_from}
    made = pj.python_system(remembers, DOMAIN, TIME, **about)
    try:
        assert not pj.learning.collect(made, KEY, n=40, quiet=True).failed.any()
        assert translation_gap(made, KEY, np.ones((20, 2))).p.max() < 1e-12
        assert not pj.learning.collect(made, KEY, n=40, quiet=True).failed.any()
    finally:
        made.close()


LOG, MAP = logging.getLogger("walk"), {i: (float(i), "free") for i in range(50_000)}


def checked(function):
    """As beartype writes it: beside the function it keeps what no other process has."""
    file, made = "<@beartype(walk) at 0x7f>", {}
    text = "def checked(*all, function=function, conf=conf): return function(*all)"
    exec(compile(text, file, "exec"), {"function": function, "conf": os.urandom(8)}, made)
    return wraps(function)(made["checked"])


@checked
def asserts(rng, k):
    assert k.shape == (1,), "written anew by pytest, in its own process"
    LOG.debug("on a map of %s", len(MAP))
    return upright(rng, k)


def equipped(rng, k, turn, grid, law, curve):
    assert turn.as_matrix().shape == (3, 3) and grid[1] == law.mean() + curve(0) == 1
    return asserts(rng, k)


def by_jax(rng, k):
    return upright(rng, np.asarray(jax.numpy.asarray(k)))


@pytest.mark.slow
def test_what_is_the_same_in_own_workers_is_taken_as_such():
    """Sent by a pickle, a library's, or of code that was written anew for one process."""
    turn, curve = spatial.transform.Rotation.from_euler("z", 0.3), np.polynomial.Polynomial([1, 2])
    tools = {"turn": turn, "grid": np.arange(3, dtype=">f8"), "law": stats.norm(0, 1)}
    function, ends = partial(equipped, curve=curve, **tools), []
    for workers in (0, 2):
        made = system(None, function, workers=workers)
        ends.append(pj.learning.collect(made, KEY, n=8, quiet=True))
        made.close()
    assert same(*ends) and not ends[0].failed.any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "name"), [(upright, r"walkers\.DRIFT"), (by_jax, "jax_enable_x64")]
)
def test_what_own_workers_hold_otherwise_is_named(function, name, monkeypatch):
    """They import modules anew, without what was set here: a global, an option of JAX."""
    made = system(None, function, workers=1)
    if function is upright:
        monkeypatch.setattr("walkers.DRIFT", 2.0)
    with pytest.raises(InputError, match=rf"the program that is here; .* has another {name}\. Set"):
        pj.learning.collect(made, KEY, n=8, quiet=True)
    made.close()


PRIVATE = """
class Site:
    {}
    def __init__(self): self.__gust = 0.0
    gust = property(lambda self: self.__gust)
SITE = Site()"""
# what a module holds, a number that its run takes from there, a change of it, and its name
HELD = {
    "a function in a library's wrapper": (
        """
GUST = 0.0
@functools.singledispatch
def drift(of): return 0.0
@drift.register
def _of_int(of: int): return GUST""",
        *("drift(1)", "GUST = 1.0", "drift"),
    ),
    "what a library's wrapper calls with": (
        """
def _drift(gust): yield gust
drift = contextlib.contextmanager(functools.partial(_drift, 0.0))""",
        "drift().__enter__()",
        "drift = contextlib.contextmanager(functools.partial(_drift, 1.0))",
        "contextmanager.<locals>.helper",
    ),
    "a function with an assert": (
        "def drift(): assert np; return 0.0",
        "drift()",
        "drift.__code__ = drift.__code__.replace(co_consts=(None, 1.0))",
        "drift",
    ),
    "numbers for a library in C": (
        """
class Site(ctypes.Structure): _fields_ = [("P", ctypes.c_double), ("of", ctypes.c_char_p)]
SITE = [(2 * ctypes.c_double)(), Site(0.0, b"north")]""",
        *("SITE[0][1] + SITE[1].P", "SITE[0][1] = 1.0", "SITE"),
    ),
    "objects of the user's in one of a library": (
        """
class Post: pass
POSTS, JUNK = weakref.WeakSet(), [object() for _ in range(os.getpid())]
SITE = types.SimpleNamespace(gust=0.0, post=Post(), sides={"left", "right", "middle"})
POSTS.add(SITE.post)""",
        *("SITE.gust + 0 * len(POSTS)", "SITE.gust = 1.0", "SITE"),
    ),
    "a function in an object of the user's that wraps": (
        """
class Calls:
    def __init__(self, f): self.gain = 0.0; functools.update_wrapper(self, f)
    def __call__(self): return self.gain * self.__wrapped__()
@Calls
def drift(): return 1.0""",
        *("drift()", "drift.gain = 1.0", "drift"),
    ),
    "a table after many objects": (
        """
class Post: pass
POSTS, SITE = [Post() for _ in range(25_000)], {"gust": np.zeros(1)}""",
        *("0 * len(POSTS) + SITE['gust'][0]", "SITE['gust'][0] = 1.0", "SITE"),
    ),
    "a private attribute": (PRIVATE.format(""), "SITE.gust", "SITE._Site__gust = 1.0", "SITE"),
    "a private slot": (
        PRIVATE.format("__slots__ = '__gust'"),
        *("SITE.gust", "SITE._Site__gust = 1.0", "SITE"),
    ),
    "a function of arrays": (
        "GUST, drift = 0.0, np.frompyfunc(lambda of: GUST, 1, 1)",
        *("float(drift(1.0))", "GUST = 1.0", "GUST"),
    ),
    "a property of a class": (
        """
GUST = 0.0
class Kind(type): gust = property(lambda cls: GUST)
class Site(metaclass=Kind): pass""",
        *("Site.gust", "GUST = 1.0", "GUST"),
    ),
    "arrays in a table": (
        "SITE = [np.array(['north', 0.0], object), np.zeros(1)]",
        *("SITE[1][0]", "SITE[1] = np.zeros((1, 1), '>i4')", "SITE"),
    ),
    "a pointer, and a weak reference": (
        "GUST, ONE = 0.0, np.zeros(1)\nSITE = [ctypes.pointer(ctypes.c_int(0)), weakref.ref(ONE)]",
        *("SITE[0].contents.value + 0 * bool(SITE[1]()) + GUST", "GUST = 1.0", "GUST"),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("what", HELD)
def test_own_workers_are_taken_until_what_they_do_not_import_has_changed(
    what, tmp_path, monkeypatch
):
    made, used, change, name = HELD[what]
    module = f"held_{[*HELD].index(what)}"
    (tmp_path / f"{module}.py").write_text(
        f"import contextlib, ctypes, functools, os, types, weakref\nimport numpy as np\n{made}\n"
        f"def walk(rng, k): return k[0] + {used} + np.zeros((3, 2)), [k[0]]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delenv("PYTEST_CURRENT_TEST")  # which writes no asserts of these modules anew
    walk = importlib.import_module(module).walk
    walk(None, np.zeros(1))  # a run here fills what a library keeps
    own = system(None, walk, workers=1)
    assert not pj.learning.collect(own, KEY, n=4, quiet=True).failed.any()
    exec(change, walk.__globals__)
    with pytest.raises(
        InputError, match=rf"has another (functools|{module})\.{name}\. Set globals"
    ):
        pj.learning.collect(own, KEY, n=4, quiet=True)
    own.close()


@pytest.mark.night
@pytest.mark.filterwarnings("default")  # of somebody else's shutdown
def test_a_dask_cluster_whose_workers_are_killed_half_way(tmp_path):
    need("distributed")
    import dask
    from distributed import Client, LocalCluster

    # after this time a local cluster closes places whose worker came back at another address
    patient = dask.config.set({"distributed.deploy.lost-worker-timeout": "1h"})
    about = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0"}
    with (
        patient,
        LocalCluster(**about, local_directory=tmp_path) as cluster,
        Client(cluster) as client,
    ):
        made = system(client.get_executor(), slowly, workers=2, lost="again")
        ends, killed = [], set()
        for batch in stream_rollouts(made, KEY, 200, quiet=True):
            ends.append(batch.p)
            if len(ends) in (3, 12):
                client.wait_for_workers(2)
                alive = set(client.run(os.getpid, on_error="ignore").values())
                for pid in alive:
                    os.kill(pid, signal.SIGKILL)
                killed |= alive
        assert len(killed) > 2  # all of them, twice
    expected = pj.learning.collect(system(None), KEY, 200, quiet=True)
    assert np.array_equal(np.concatenate(ends), expected.p, equal_nan=True)
