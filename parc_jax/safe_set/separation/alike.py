"""Pairs of an obstacle and a part that share their directions: boxes of a map, one obstacle at many
times. How far plans are along those is worked out once for all of them. [T14, T20]
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from parc_jax.common.shapes import Index


class Alike(NamedTuple):
    """The pairs of a scene by kind, those of one kind one after another.

    order (o,): pairs by kind. first (o + 1,): where each kind begins in it, and the last ends.
    kinds (): how many kinds there are.
    """

    order: np.ndarray
    first: np.ndarray
    kinds: np.ndarray

    def look(self, of_kind: Callable, of_pair: Callable, state: Any):
        """The state after all pairs: of_pair(pair, known, state), with known = of_kind(pair) of one
        pair of its kind. Kernel.
        """
        order, first = (jnp.asarray(x) for x in (self.order, self.first))

        def kind(number: Index, state: Any):
            known = of_kind(order[first[number]])
            return jax.lax.fori_loop(
                first[number],
                first[number + 1],
                lambda at, state: of_pair(order[at], known, state),
                state,
            )

        return jax.lax.fori_loop(0, self.kinds, kind, state)


def alike(w: Float[np.ndarray, "n d n_p"], points: Int[np.ndarray, "n i"], room: int) -> Alike:
    """Of n pairs, with room for more: alike are those with equal directions and points."""
    kinds: dict[bytes, list[int]] = {}
    for pair, told in enumerate(zip(w, points, strict=True)):
        kinds.setdefault(b"".join(x.tobytes() for x in told), []).append(pair)
    order, first = np.zeros(room, np.int32), np.zeros(room + 1, np.int32)
    order[: len(w)] = [pair for pairs in kinds.values() for pair in pairs]
    first[1 : len(kinds) + 1] = np.cumsum([len(pairs) for pairs in kinds.values()])
    return Alike(order, first, np.int32(len(kinds)))
