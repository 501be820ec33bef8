"""What a study runs: sizes, probabilities and budgets. Frozen; the same record fills the shell's
options.
"""

from dataclasses import dataclass

from parc_jax.claim.counts import MOST, check_discard
from parc_jax.claim.pipeline import GAP, BoundSettings, check_shape
from parc_jax.claim.start_gap import check_gap
from parc_jax.errors import InputError

CLAIMS = ("one", "bins")


@dataclass(frozen=True)
class Study:
    """Settings of a study of one system, from rollouts to a proved safe set.

    hidden: widths of the network whose answer is returned. others: further networks for the
    comparison table; without hidden layers, (), it is PARC's affine map.
    bins: bins per axis of K over which the tube's profile varies; None = cut where the main
        network's error changes.
    shape: of the tube, "box" or "fitted", as in `BoundSettings`.
    rollouts: training runs.
    eps, delta: with confidence 1 - delta, for all networks at once, a new run leaves the tube with
        probability <= eps.
    claims: made for every network, the returned one first. "one": over all of K, one number scales
    the whole profile. [T1, T2] "bins": in every bin at once, each with its own number. [T4]
    blocks: claims along each axis of K where "bins" is asked for, each about the neighbouring bins
        of a block; None = in every bin.
    fresh: runs behind the claims, None = as many as they need. More leave room to discard the
        worst.
    discard: how many of the worst are left outside, fixed before any is seen; "most" = as many as
        fresh, eps and delta allow. Without discards the claims carry the eps that the runs support.
    profile_runs: runs beside the training ones from which the tube's profile is learnt. even: a
        quarter of them only to widen every bin by what it lacked, as in `BoundSettings`.
    plant: plant of the simulator that all of these are drawn from, None = the system's own, which
        also runs the replay.
    body: body of the robot in the scene, and so which reference points the simulator reports;
        None = the system's own.
    search: runs spent looking for bad ones of the returned network on purpose, in eight rounds;
        None = as many as there are fresh runs, 2,048 at most (then a round has the size of a chunk
        of rollouts on a CPU, and shares its compiled code); 0 = none. What they find only widens
        the tube. [T8]
    gap: [m or rad] most that the start of a run may matter; tried from a few starts, and added to
        the tube.
    seeds, steps: training. tail: power of the error that the last layer is refitted to; None =
        least squares.
    samples: safe plans to return. repeats: runs of each in the replay, with fresh randomness.
    driven: choose one plan, run it afresh and make a local claim near it: sentence (D). [T23]
    target, confidence: what may be left uncovered, and how sure. work, budget_s: the most that is
        done to cover the safe set, and a limit [s] above it, as in `pj.Settings`.
    """

    hidden: tuple[int, ...] = (8, 8, 8, 8)
    others: tuple[tuple[int, ...], ...] = ((6, 6, 6, 6), (7, 7, 7, 7), ())
    bins: tuple[int, ...] | None = None
    shape: str = "box"
    rollouts: int = 10_000
    eps: float = 1e-3
    delta: float = 1e-3
    claims: tuple[str, ...] = ("one",)
    blocks: tuple[int, ...] | None = None
    fresh: int | None = None
    discard: int | str = MOST
    profile_runs: int = 0
    even: bool = False
    search: int | None = None
    gap: float = GAP
    plant: str | None = None
    body: str | None = None
    seeds: int = 6
    steps: int = 3000
    tail: float | None = None
    samples: int = 100
    repeats: int = 1
    driven: bool = False
    target: float = 0.01
    confidence: float = 0.99
    work: float = 1.0
    budget_s: float = 600.0

    @property
    def bound(self) -> BoundSettings:
        """What is asked of the claims."""
        return BoundSettings(
            eps=self.eps,
            delta=self.delta,
            claims=self.claims,
            blocks=self.blocks,
            bins=self.bins,
            shape=self.shape,
            profile_runs=self.profile_runs,
            even=self.even,
            fresh=self.fresh,
            discard=self.discard,
            search=self.search,
        )

    @property
    def networks(self) -> tuple[tuple[int, ...], ...]:
        """All sizes, the returned one first."""
        return (self.hidden, *(h for h in self.others if h != self.hidden))


def name_of(hidden: tuple[int, ...]) -> str:
    """A network's name: its widths, or PARC."""
    return "-".join(map(str, hidden)) or "PARC"


def checked(study: Study) -> Study:
    """The same settings when they make sense. Raises InputError."""
    if study.rollouts < 20:
        raise InputError(f"rollouts: expected at least 20 training runs; got {study.rollouts}.")
    if study.samples < 1 or study.repeats < 1:
        raise InputError(
            f"samples, repeats: expected at least 1; got {study.samples}, {study.repeats}."
        )
    check_discard(study.discard)
    if not (0 < study.eps < 1 and 0 < study.delta < 1):
        raise InputError(
            f"eps, delta: expected probabilities between 0 and 1; got {study.eps}, {study.delta}."
        )
    if (
        not study.claims
        or len(set(study.claims)) < len(study.claims)
        or set(study.claims) - set(CLAIMS)
    ):
        raise InputError(
            f"claims: expected one or more of {', '.join(CLAIMS)}, each once; got {study.claims}."
        )
    check_gap(study.gap)
    check_shape(study.shape)
    if study.tail is not None and (isinstance(study.tail, str) or not study.tail >= 2):
        raise InputError(f"tail: expected a power of at least 2, or None; got {study.tail!r}.")
    if study.search is not None and study.search < 0:
        raise InputError(f"search: expected runs >= 0, 0 for none; got {study.search}.")
    return study
