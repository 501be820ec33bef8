"""Looking for bad runs on purpose: what is found can only make the tube wider. [T8]"""

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.climb import Ranked, climb, ranked
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, key_data, stream
from parc_jax.common.spelling import hex_text
from parc_jax.learning.bound.calibrate import scaled
from parc_jax.learning.bound.claim import ErrorClaim, weaker
from parc_jax.learning.bound.measure import Allowance, allowance
from parc_jax.learning.bound.score import check_profile, score_arrays
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.chunks import ChunkStore
from parc_jax.learning.runs.forecast import Forecast, Pace
from parc_jax.learning.runs.resume import require_same_runs
from parc_jax.learning.runs.rows import chunk_of, seed_of
from parc_jax.learning.runs.simulate import Simulator, ToRun, simulator
from parc_jax.learning.system import System
from parc_jax.learning.systems.identity import identity_of

MOST_RUNS = 2048  # of a search that nobody sized
_ROUNDS = 8
_ELITE = 0.1  # share of all runs so far that have children
_FRESH_K = 0.2  # share of children that start anew in K
_FRESH_KEY = 0.5  # share of children that meet a new disturbance
# spread of children around their parent, as a share of K, in the first round and in the last
_WIDEST = 0.2
_NARROWEST = 0.005
_PIECE = 16  # runs between two steps of the bar, for a system that is not compiled


class Attack(NamedTuple):
    """All runs that a search tried, worst first: k (m, n_k), system's keys (m, 2), score (m,)."""

    k: np.ndarray
    keys: np.ndarray
    score: np.ndarray

    @property
    def best(self) -> int:
        """Index of the worst finite run."""
        return int(np.argmax(np.where(np.isfinite(self.score), self.score, -np.inf)))


def search_size(asked: int | None, fresh: int) -> int:
    """Runs of a search: as asked; by default the fresh runs of the claim, at most MOST_RUNS."""
    return min(MOST_RUNS, fresh) if asked is None else asked


def search_worst(
    net: ReLUNetwork,
    system: System,
    key: jax.Array,
    profile: Tube,
    runs: int = 1024,
    *,
    path: str | Path | None = None,
    quiet: bool = False,
    forecast: Forecast | None = None,
) -> Attack:
    """Cross-entropy search for the largest score over k and the disturbance, from the SEARCH stream
    of `key`.

    Each round runs a batch on the device: children of the best tenth so far (k perturbed, the
    spread shrinking from round to round; half keep their parent's disturbance, half meet a new one)
    and fresh k. Eight rounds, or one per run when there are fewer.
    path: a folder that keeps finished rounds, so a killed search continues with the same numbers.
    quiet, forecast: as in `collect`.
    Proves nothing; see `enlarge`. Raises InputError.
    """
    rounds = min(_ROUNDS, runs)
    if rounds < 1:
        raise InputError(f"search: expected at least one run; got {runs}.")
    from tqdm import tqdm

    layout = layout_of(system)
    check_profile(net, profile, layout, system.domain)
    sim = simulator(system)
    piece = int(getattr(system, "chunk", None) or _PIECE)
    chunk = chunk_of(system, runs, None, None) if sim.traceable else piece
    slack = allowance(net, system.domain, layout)
    rng = generator(stream(key, Stage.SEARCH))
    search = _Search(net, sim, key, profile, runs // rounds, rounds, chunk, slack, rng)
    store = None if path is None else _store(path, search)
    told = None if quiet else forecast or Forecast(runs)
    pace = Pace(1, sim.traceable, told, system.name)
    numbers = itertools.count()
    ratio = _NARROWEST / _WIDEST
    shares = [_WIDEST * ratio ** (number / (rounds - 1)) for number in range(1, rounds)]
    title = f"{system.name}: search for bad runs"
    with tqdm(total=rounds * search.batch, unit="rollout", desc=title, disable=quiet) as bar:

        def scores(runs: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
            number = next(numbers)
            score = None if store is None else _stored(store, search, number, *runs)
            if score is not None:
                bar.update(search.batch)
                return score
            score = pace.timed(search.batch, lambda: search.run(*runs, bar))
            if store is not None:
                store.put(number, {"k": runs[0], "keys": runs[1], "score": score})
            return score

        first = search.fresh(0)
        found = climb(ranked(first, scores(first)), search.children, scores, shares)
    return Attack(*found.x, found.value)


@dataclass(frozen=True, eq=False)
class _Search:
    """What stays the same from round to round."""

    net: ReLUNetwork
    sim: Simulator
    key: jax.Array
    profile: Tube
    batch: int
    rounds: int
    chunk: int
    slack: Allowance
    rng: np.random.Generator

    def fresh(self, first: int) -> tuple[np.ndarray, np.ndarray]:
        """k (batch, n_k) as the system will see it and keys (batch, 2), of rows from `first` on."""
        drawn = self.sim.rows(self.key, Stage.SEARCH, np.arange(first, first + self.batch))
        return self.sim.as_run(drawn.k), key_data(drawn.keys)

    def children(self, tried: Ranked, spread: float) -> tuple[np.ndarray, np.ndarray]:
        """The fresh ones of the next round, most of them replaced by children of the best runs so
        far; failed runs are as good as any. spread: [sides of K].
        """
        n = len(tried.value)
        k, keys = self.fresh(n)
        lo, hi = self.sim.system.domain.lo, self.sim.system.domain.hi
        parent = self.rng.choice(max(1, int(_ELITE * n)), len(k))
        step = self.rng.normal(size=k.shape) * (spread * (hi - lo))
        child = np.clip(tried.x[0][parent] + step, lo, hi)
        is_fresh = self.rng.random(len(k)) < _FRESH_K
        new_key = is_fresh | (self.rng.random(len(k)) < _FRESH_KEY)
        k = self.sim.as_run(np.where(is_fresh[:, None], k, child))
        return k, np.where(new_key[:, None], keys, tried.x[1][parent])

    def run(self, k: np.ndarray, keys: np.ndarray, bar: Any = None) -> np.ndarray:
        """Scores (n,) of runs, chunk by chunk; of a compiled system all chunks are full, the last
        run repeated: the program of all other runs serves.
        """
        n, scores = len(k), []
        if self.sim.traceable:
            rows = np.minimum(np.arange(-(-n // self.chunk) * self.chunk), n - 1)
            k, keys = k[rows], keys[rows]
        for start in range(0, len(k), self.chunk):
            part = slice(start, start + self.chunk)
            trajectory = self.sim.run(ToRun(jnp.asarray(keys[part]), k[part]))
            found = score_arrays(self.net, self.slack, self.profile, k[part], *trajectory[:2])[0]
            scores.append(found[: n - start])
            if bar is not None:
                bar.update(len(scores[-1]))
        return np.concatenate(scores)


def _store(path: str | Path, search: _Search) -> ChunkStore:
    """The folder of finished rounds. Raises InputError when it holds another search."""
    meta = identity_of(search.sim.system) | {
        "what": "search",
        "network": search.net.hash,
        "profile": search.profile.hash,
        "seed": list(seed_of(search.key)),
        "chunk": search.batch,
        "rounds": search.rounds,
    }
    return ChunkStore(path, meta)


def _stored(
    store: ChunkStore, search: _Search, number: int, k: np.ndarray, keys: np.ndarray
) -> np.ndarray | None:
    """Scores of a finished round; of the first one, a part is run again and compared."""
    arrays = store.get(number)
    if arrays is None or not (
        np.array_equal(arrays["k"], k) and np.array_equal(arrays["keys"], keys)
    ):
        return None
    if number == 0:
        again = slice(0, search.batch if search.sim.traceable else 1)
        require_same_runs(
            store.folder,
            {"k": arrays["k"], "score": arrays["score"]},
            {"k": k[again], "score": search.run(k[again], keys[again])},
            search.sim.system,
        )
    return arrays["score"]


def enlarge(claim: ErrorClaim, profile: Tube, attack: Attack) -> ErrorClaim:
    """The claim with its tube widened, bin by bin, to hold every finite run of the attack; all
    labels stay true. [T8]

    Failed runs cannot be held by any tube; their number is put on record.
    """
    finite = np.isfinite(attack.score)
    scale = np.zeros(profile.n_bins)
    for column in profile.bins_of(attack.k[finite]).T:
        np.maximum.at(scale, column, attack.score[finite])
    held = scaled(profile, scale, np.asarray(claim.intersample))
    both = zip(claim.tube.halves, held.halves, strict=True)
    wider = claim.tube.with_halves(*(np.maximum(had, found) for had, found in both))
    grew = wider.halves[0] > claim.tube.halves[0]
    grown = int(grew.reshape(len(grew), -1).any(axis=1).sum())
    found = {"runs": len(attack.score), "failed": int((~finite).sum()), "bins_widened": grown}
    if finite.any():
        found |= {
            "score": hex_text(attack.score[attack.best]),
            "k": hex_text(attack.k[attack.best]),
        }
    return weaker(claim, wider, search=found)
