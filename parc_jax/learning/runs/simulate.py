"""Random-stream rows -> parameters, trajectories: a compiled program per system and chunk shape."""

import random
import re
import threading
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.backend import backend, options
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, row_keys, stream
from parc_jax.learning.runs.chunks import worker_devices
from parc_jax.learning.system import Retried, Trajectory, check_system, points_of
from parc_jax.learning.systems.chained import Chained, ToRun, begun, links_of, lost_in
from parc_jax.learning.systems.content import Content, content_of, whole_digest
from parc_jax.learning.systems.user_code import blamed

SAME = 1e-6  # [widths of K] by which a draw may be outside of it for rounding
_KEPT = 8  # compiled systems held at a time: enough for a few plants side by side, bounded memory


class Simulator:
    """The present content of a system, compiled once per chunk shape. Made by `simulator`."""

    def __init__(self, system):
        check_system(system)
        self.system = system
        self.traceable = is_traceable(system)
        # named in every call: XLA compiles for a named and for the default device separately
        self._device = worker_devices(system)[0]
        self.double = np.dtype(getattr(system, "dtype", np.float64)) == np.float64
        self._many = jitted_rollouts(system) if self.traceable else system.rollout_batch
        self._links = links_of(system, self.traceable) if isinstance(system, Chained) else None
        # what the program was made from; one that is not compiled reads its attributes at every run
        self.content = content_of(system) if self.traceable else Content("", [])
        self._compiled: set = set()
        self._compiling = threading.Lock()

    def is_current(self) -> bool:
        """Whether a compiled program is still that of the system."""
        with self._compiling:  # while it is traced, a system may fill caches of its own
            return not self.traceable or content_of(self.system).digest == self.content.digest

    def rows(self, key: jax.Array, stage: Stage, rows: np.ndarray, k=None, device=None) -> ToRun:
        """Keys and parameters of global rows (B,), from (key, stage, row) alone.

        k: None = uniform on K, or as the chain of a chained system leads to, run on the device;
            (n_k,) = that one; (B, n_k) = as given; a function key -> (n_k,) = its draws.
        Raises InputError, also for draws outside of K by more than rounding.
        """
        lo, hi = self._bounds()
        with x64():
            of_stage, numbers = stream(key, stage), np.asarray(rows, np.uint32)
            if k is None and self._links is None:
                keys, drawn = _drawn(of_stage, numbers, lo, hi)
                return ToRun(keys, self.as_run(np.asarray(drawn)))
            k_keys, keys = _row_keys(of_stage, numbers)
            if callable(k):
                drawn = np.asarray(jax.vmap(k)(k_keys), np.float64)
                outside = ~(np.abs(drawn - np.clip(drawn, lo, hi)) <= SAME * (hi - lo))
                if outside.any():
                    raise InputError(
                        f"{self.system.name}: expected draws of k within K; "
                        f"{outside.any(axis=1).mean():.1%} are outside. Draw again until they are "
                        "inside, or widen K: the claim is about what is drawn."
                    )
            elif k is not None:
                drawn = np.broadcast_to(np.asarray(k, np.float64), (len(rows), len(lo)))
            if k is not None:
                return ToRun(keys, self.as_run(drawn))
        device = device or self._device
        k_keys, keys = jax.device_put((k_keys, keys), device)

        def run():
            with jax.enable_x64(self.double):
                return begun(self.system, self._links, k_keys, keys, lo, hi)

        last = self._once(("chain", keys.shape, device), run)
        return last._replace(k=self.as_run(last.k))

    def as_run(self, k: np.ndarray) -> np.ndarray:
        """k (B, n_k) as the system gets it: inside K, rounded for a float32 system."""
        k = np.clip(k, *self._bounds())
        return k if self.double else k.astype(np.float32).astype(np.float64)

    def run(self, rows: ToRun, device=None) -> Trajectory | Retried:
        """Trajectories (B, ...) of the rows, on the device (None: the first), p as columns (B,
        n_record + 1, n_c); float64 unless the system declares dtype = float32. Raises InputError.
        """
        device = device or self._device
        shape = (rows.states is None, rows.k.shape, device)
        return self._once(shape, lambda: self._run(rows, device))

    def _once(self, shape, run):
        """run(), after which the system must stay as it is: the first run of a shape compiles."""
        if self.traceable and shape not in self._compiled:
            with self._compiling:  # else two workers would compile a new shape twice
                if shape not in self._compiled:
                    before = _global_chance()
                    result = run()
                    # perhaps by another thread, or from a seed
                    if _global_chance() != before or self._varies:
                        self._require_again(result, run)
                    self._compiled.add(shape)
                    self.content = content_of(self.system)
                    return result
        return run()

    @cached_property
    def _varies(self) -> bool:
        """Is it another program each time it is traced? Parts that are jitted stay as they were."""
        made = [traced(self.system, self.double) for _ in range(2)]
        told = ([re.sub("0x[0-9a-f]+", "", str(x.jaxpr)), x.consts] for x in made)  # no addresses
        return len(set(map(whole_digest, told))) > 1

    def _require_again(self, result, run) -> None:
        """Raises InputError where what `run` gives is another when it is compiled anew."""
        jax.clear_caches()
        pairs = zip(jax.tree.leaves(result), jax.tree.leaves(run()), strict=True)
        if not all(np.array_equal(one, two, equal_nan=True) for one, two in pairs):
            jax.clear_caches()  # else the next call finds it compiled
            raise InputError(
                f"{self.system.name}: expected randomness from the key alone; the system is "
                "another each time it is compiled, as one that draws from `np.random`, once for "
                "all runs. Draw with jax.random, from its key."
            )

    def _run(self, rows: ToRun, device) -> Trajectory | Retried:
        with jax.enable_x64(self.double):
            dtype = np.float64 if self.double else np.float32
            k = jax.device_put(jnp.asarray(rows.k, dtype), device)
            keys = jax.device_put(rows.keys, device)
            with blamed(f"{self.system.name}: expected rollout(key, k) to run"):
                if rows.states is None:
                    out = self._many(keys, k)
                else:
                    out = self._links.go_on(keys, rows.states, k)[0]
        if (lost := lost_in(out, rows.lost)) is not None:
            out = Retried(out.p, out.q, lost)
        if isinstance(out, Retried):
            return in_columns(self.system, out)
        if not isinstance(out, tuple) or len(out) != 2:
            raise InputError(
                f"{self.system.name}: expected rollout(key, k) to return Trajectory(p, q); got "
                f"{type(out).__name__}."
            )
        return in_columns(self.system, Trajectory(*out))

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of K; for a float32 system the outermost float32 numbers inside K."""
        domain = self.system.domain
        lo, hi = (np.asarray(corner, np.float64) for corner in (domain.lo, domain.hi))
        if self.double:
            return lo, hi
        lo32, hi32 = lo.astype(np.float32), hi.astype(np.float32)
        lo32 = np.where(lo32 < lo, np.nextafter(lo32, np.float32(np.inf)), lo32)
        hi32 = np.where(hi32 > hi, np.nextafter(hi32, np.float32(-np.inf)), hi32)
        return lo32.astype(np.float64), hi32.astype(np.float64)


def simulator(system) -> Simulator:
    """The compiled form of a system as it is now; the last few are cached, so later calls do not
    compile again. A system that was changed in place is compiled anew.
    """
    with _REMEMBERING:
        known = next((s for s in _RECENT if s.system is system), None)
        if known is not None and known.is_current():
            return known
        if known is not None:
            _RECENT.remove(known)
            jax.clear_caches()  # jitted parts with the system as an argument are of old values
        _RECENT.append(Simulator(system))
        del _RECENT[:-_KEPT]
        return _RECENT[-1]


def remembered(system) -> Simulator:
    """The result of the last call of `simulator`, without reading the system again."""
    with _REMEMBERING:
        cached = next((s for s in _RECENT if s.system is system), None)
    return cached or simulator(system)


def in_columns(system, trajectory: Trajectory | Retried) -> Trajectory | Retried:
    """Trajectories (B, ...) with p as columns (B, n_record + 1, n_c): the coordinates of all
    reference points, point by point. Raises InputError for other shapes than declared.
    """
    n_record, n_points = system.time.n_record, len(points_of(system))
    each = (system.n_p,) if n_points == 1 else (n_points, system.n_p)
    want_p, want_q = (n_record + 1, *each), (system.n_q,)
    have_p, have_q = np.shape(trajectory.p)[1:], np.shape(trajectory.q)[1:]
    if have_p != want_p or have_q != want_q:
        raise InputError(
            f"{system.name}: expected rollout(key, k) to return p {want_p} on the record grid and "
            f"q {want_q}; got p {have_p} and q {have_q}. p holds n_record + 1 samples, the start "
            f"included{'.' if n_points == 1 else ', of all reference points.'}"
        )
    if n_points == 1:
        return trajectory
    p = trajectory.p if isinstance(trajectory.p, jax.Array) else np.asarray(trajectory.p)
    return trajectory._replace(p=p.reshape(-1, n_record + 1, n_points * system.n_p))


def jitted_rollouts(system):
    """jit(vmap(rollout)), compiled as suits the kind of device."""
    return jax.jit(jax.vmap(system.rollout), compiler_options=options(backend()))


def traced(system, double: bool):
    """The program of runs of a system in JAX, chained ones too, traced anew. Raises InputError."""

    def run(key, k):
        if not isinstance(system, Chained):
            return system.rollout(key, k)
        state = system.start_state(key)
        of_chain = system.measured(state), system.rollout_from_state(key, state, k)
        return system.rollout(key, k), of_chain

    k = jax.ShapeDtypeStruct((system.domain.n,), np.float64 if double else np.float32)
    with jax.enable_x64(double), blamed(f"{system.name}: expected rollout(key, k) to run"):
        return jax.make_jaxpr(run)(jax.ShapeDtypeStruct((2,), np.uint32), k)


def is_traceable(system) -> bool:
    """Whether JAX runs it: a system without `rollout_batch`."""
    return not callable(getattr(system, "rollout_batch", None))


def _global_chance() -> str:
    return f"{random.getstate()} {np.random.get_state()}"  # noqa: NPY002


def uniform(key, lo, hi):
    """k (n_k,) uniform on the box lo, hi. Kernel."""
    return jnp.clip(lo + jax.random.uniform(key, lo.shape, lo.dtype) * (hi - lo), lo, hi)


@jax.jit
def _drawn(key, rows, lo, hi):
    """Keys (B, 2) of the systems and k (B, n_k), uniform on K, of rows (B,) of a stage."""
    k_keys, keys = row_keys(key, rows)
    return keys, jax.vmap(uniform, in_axes=(0, None, None))(k_keys, lo, hi)


_row_keys = jax.jit(row_keys)
_RECENT: list[Simulator] = []
_REMEMBERING = threading.Lock()
