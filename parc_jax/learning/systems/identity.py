"""What a system is: the code that runs it, the numbers it holds, and whatever these refer to.

A compiled program and a folder of finished runs belong to one system. Both are given up when any of
this has changed, though name and law are the same.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.spelling import hex_text
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.system import check_system, points_of
from parc_jax.learning.systems.content import Reader


class Content(NamedTuple):
    """What a system holds at one moment of one process. held keeps its parts alive, so that no id
    is used twice.
    """

    digest: str
    held: list


def content_of(system) -> Content:
    """Code and data that the system reaches: attributes (nested), closures, defaults, and the
    globals that its own functions name. Opaque objects are told apart by identity alone.
    """
    reader = Reader(lasting=False)
    return Content(reader.digest(system), reader.held)


def identity_of(system) -> dict:
    """JSON-able identity that outlives the process: law, grid, sizes, and a hash of the code and of
    every public attribute.

    Left out: attributes that begin with an underscore, those in `content.OPERATIONAL`, and
    opaque objects. Raises InputError for what is no system.
    """
    check_system(system)
    reader = Reader(lasting=True)
    time = system.time
    identity = {
        "law": law_of(system).hash,
        "grid": hex_text([time.dt, time.t_f, time.dt_record]),
        "n_p": int(system.n_p),
        "n_q": int(system.n_q),
        "points": list(points_of(system)),
        "dtype of the system": np.dtype(getattr(system, "dtype", np.float64)).name,
        "code": reader.digest(type(system)),
    }
    for name, value in reader.attributes(system):
        if name not in ("domain", "time", "law", "points"):  # said above
            identity[f"attribute {name}"] = reader.digest(value)
    return identity


def lasting_digest(x) -> str:
    """Of code and data that a function or an object reaches, the same in another process: what
    `identity_of` says of a system's code and attributes.
    """
    return Reader(lasting=True).digest(x)
