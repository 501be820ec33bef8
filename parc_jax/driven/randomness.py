"""Does a system use its random key? Found out from its program, never from a few equal runs: a rare
gust leaves a thousand runs alike.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Literal

from parc_jax.rollout.simulate import is_traceable
from parc_jax.rollout.user_code import blamed
from parc_jax.system import check_system

# primitives that leave the program; what their host code draws is not seen
_OUTSIDE = "callback"


def ignores_key(system) -> bool:
    """Whether no output of the compiled rollout depends on its key, as its program shows.

    False also where that cannot be shown: a system that is not run by JAX, that calls back into
    Python, or whose program is another one each time it is traced. Raises InputError for what is no
    system.
    """
    check_system(system)
    if not is_traceable(system):
        return False
    with blamed(f"{system.name}: expected rollout(key, k) to run"):
        first = _program(system)
        again = _program(system)
    if _OUTSIDE in str(first) or not _alike(first, again):
        return False
    return not _reaches_an_output(first.jaxpr, first.jaxpr.invars[0])


def _program(system):
    double = np.dtype(getattr(system, "dtype", np.float64)) == np.float64
    with jax.enable_x64(double):
        k = jnp.asarray(system.domain.center, np.float64 if double else np.float32)
        key = jnp.zeros(2, jnp.uint32)

        def fresh(key, k):  # another function each time, so that nothing traced before is used
            return system.rollout(key, k)

        return jax.make_jaxpr(fresh)(key, k)


def _alike(first, again) -> bool:
    """The same program with the same constants: none was drawn while it was traced."""
    pairs = list(zip(first.consts, again.consts, strict=False))
    same = all(np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True) for a, b in pairs)
    return same and len(first.consts) == len(again.consts) and str(first) == str(again)


def _reaches_an_output(jaxpr, source) -> bool:
    """Whether anything computed from the variable is returned. An equation spreads it from any
    input to all its outputs; inner programs are not looked into, which errs towards yes.
    """
    touched = {source}
    for equation in jaxpr.eqns:
        inputs = (v for v in equation.invars if not isinstance(v, Literal))
        if any(v in touched for v in inputs):
            touched.update(equation.outvars)
    return any(v in touched for v in jaxpr.outvars if not isinstance(v, Literal))
