"""Many devices and many hosts: `jax.distributed`, one mesh with one axis of rows, and nothing
home-made below that.

Every host runs the same program with the same arguments. Rows are split over hosts and devices and
gathered again, so every host ends with all results, equal to those of a single process. Rollouts,
errors and scores are split inside of `shared()` only, where every host is bound to make the same
calls; scenes are split over the mesh that they are given.
"""

import contextlib
import contextvars
import io
import json

import jax
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.errors import HostLost, InputError

AXIS = "rows"


def init(hosts: str = "auto", *, timeout_s: int = 300) -> None:
    """Join the other processes. Call before anything else touches JAX; a single process needs no
    call.

    hosts: "auto" reads the environment of the cluster (SLURM, Open MPI, Kubernetes, TPU);
    "ADDRESS:PORT,COUNT,NUMBER" names the first process, how many there are and which one this is.
    timeout_s: [s] to wait for the others.
    Raises InputError, or HostLost when the others do not come.
    """
    where = {}
    if hosts != "auto":
        parts = hosts.rsplit(",", 2)
        if len(parts) != 3 or ":" not in parts[0] or not all(p.isdigit() for p in parts[1:]):
            raise InputError(
                f'hosts: expected "auto" or "ADDRESS:PORT,COUNT,NUMBER"; got {hosts!r}.'
            )
        where = {
            "coordinator_address": parts[0],
            "num_processes": int(parts[1]),
            "process_id": int(parts[2]),
        }
        if not where["process_id"] < where["num_processes"]:
            raise InputError(
                f"hosts: expected a number below the count {parts[1]}; got {parts[2]}. They begin "
                "at 0."
            )
    try:
        jax.distributed.initialize(**where, initialization_timeout=timeout_s)
    except ValueError as error:
        raise InputError(
            f"hosts: no cluster was recognised ({error}). Name the processes: "
            '"ADDRESS:PORT,COUNT,NUMBER".'
        ) from None
    except RuntimeError as error:
        raise HostLost(
            f"hosts: the other processes did not come within {timeout_s} s, or JAX ran before: "
            f"{error}"
        ) from None


def mesh(devices=None) -> jax.sharding.Mesh:
    """All devices of all hosts, or the given ones, in one axis; of Auto type, so code for one
    device works as it is.
    """
    devices = jax.devices() if devices is None else devices
    return jax.make_mesh(
        (len(devices),), (AXIS,), axis_types=(jax.sharding.AxisType.Auto,), devices=devices
    )


_SHARING = contextvars.ContextVar("sharing", default=False)


@contextlib.contextmanager
def shared():
    """In here, or in a function so decorated, hosts share rollouts, errors and scores."""
    token = _SHARING.set(True)
    try:
        yield
    finally:
        _SHARING.reset(token)


def rank_and_size() -> tuple[int, int]:
    """The number of this host and how many there are; (0, 1) outside of `shared`."""
    return (jax.process_index(), jax.process_count()) if _SHARING.get() else (0, 1)


def pad(n: int, over: jax.sharding.Mesh) -> int:
    """The least number of rows from n on that divides over the devices."""
    return -(-n // over.size) * over.size


def shard_rows(over: jax.sharding.Mesh, tree):
    """Host arrays (rows, ...) -> global arrays split over devices; each host moves its own rows."""
    return _placed(jax.sharding.NamedSharding(over, jax.P(over.axis_names[0])), tree)


def replicate(over: jax.sharding.Mesh, tree):
    """Host arrays -> global arrays that every device holds in full."""
    return _placed(jax.sharding.NamedSharding(over, jax.P()), tree)


def _placed(sharding, tree):
    def one(x):
        x = np.asarray(x)
        return jax.make_array_from_callback(x.shape, sharding, lambda index: x[index])

    return jax.tree.map(one, tree)


def all_rows(tree):
    """All rows of global arrays, as NumPy, on every host."""
    if all(x.is_fully_addressable for x in jax.tree.leaves(tree)):
        return jax.device_get(tree)
    from jax.experimental.multihost_utils import process_allgather

    with reporting_lost_hosts(), x64():
        return jax.tree.map(lambda x: np.asarray(process_allgather(x, tiled=True)), tree)


def gather_arrays(arrays: dict[str, np.ndarray]) -> list[dict[str, np.ndarray]]:
    """What every host brings, in order, on every host; of any shapes and dtypes, bit for bit.

    Like everything below: inside of `shared`; outside, this host is the only one.
    """
    if rank_and_size()[1] == 1:
        return [arrays]
    from jax.experimental.multihost_utils import process_allgather

    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    mine = np.frombuffer(buffer.getbuffer(), np.uint8)
    with reporting_lost_hosts():
        sizes = np.asarray(process_allgather(np.array([len(mine)], np.int32))).ravel()
        joined = np.asarray(process_allgather(np.pad(mine, (0, int(sizes.max()) - len(mine)))))
    out = []
    for row, size in zip(joined, sizes, strict=True):
        with np.load(io.BytesIO(row[:size].tobytes())) as file:
            out.append({name: file[name] for name in file.files})
    return out


def gather(value) -> list:
    """One JSON value of every host, in the order of hosts, on every host."""
    return [
        json.loads(str(part["value"]))
        for part in gather_arrays({"value": np.array(json.dumps(value))})
    ]


def broadcast(tree):
    """The arrays of the first host, on every host: machines may round training differently."""
    leaves, structure = jax.tree.flatten(tree)
    first = gather_arrays({str(i): np.asarray(x) for i, x in enumerate(leaves)})[0]
    return jax.tree.unflatten(structure, [first[str(i)] for i in range(len(leaves))])


def require_same(name: str, value) -> None:
    """Refuse to share work that hosts describe in different words. Raises InputError."""
    said = gather(value)
    if any(other != said[0] for other in said):
        number = next(i for i, other in enumerate(said) if other != said[0])
        raise InputError(
            f"{name}: expected the same work on every host; host {number} differs from host 0 in "
            f"{sorted(f for f in said[0] if said[number].get(f) != said[0][f])}. Same command, "
            "files and versions?"
        )


@contextlib.contextmanager
def reporting_lost_hosts():
    """Around every step that needs all hosts: an error of the connection becomes HostLost."""
    try:
        yield
    except (jax.errors.JaxRuntimeError, ValueError) as error:
        raise HostLost(
            f"host {jax.process_index()} of {jax.process_count()}: another process of this run has "
            f"ended ({str(error).splitlines()[0][:120]}). Finished chunks are kept; start the same "
            "command again everywhere."
        ) from error
