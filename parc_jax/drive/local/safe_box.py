"""The largest box of parameters around a plan that is proved safe from its start. [T21]"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import Sealed
from parc_jax.common.sets.box import Box
from parc_jax.common.shapes import Params, Vector
from parc_jax.common.spelling import exact, hex_text
from parc_jax.proof.certificate.prove import proves_box
from parc_jax.proof.certificate.write import corridor_part
from parc_jax.safe_set.corridors.sampling import points
from parc_jax.safe_set.corridors.search import corridors_around
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene, unpruned_scene

HALVINGS = 24  # of the box of all K, until a box of safe plans is found
SAMPLED = 256  # plans of a box with a verdict, before a corridor is tried on all of it
SHRINK = 0.85  # [1] from a box that the checker refuses to the next one
ATTEMPTS = 10
# [bits] corners of a box are multiples of its side, rounded to a power of two, over 2^GRID
GRID = 12
INWARD = 1 - 2.0**-40  # [1] middle and half widths are rounded: their box stays inside the other


@dataclass(frozen=True, eq=False)
class SafeBox(Sealed):
    """A box of k from one start, every plan of it proved safe in exact arithmetic.

    p0 (n_p,): the start. middle, half (n_k,): the box. share: exact, of K. certificate: for the
    checker's `check_doubt`.
    """

    p0: np.ndarray
    middle: np.ndarray
    half: np.ndarray
    share: Fraction
    certificate: dict

    @property
    def lo(self) -> np.ndarray:
        """(n_k,) lower corner."""
        return _side(self.middle, -self.half)

    @property
    def hi(self) -> np.ndarray:
        """(n_k,) upper corner."""
        return _side(self.middle, self.half)


def _side(middle: np.ndarray, half: np.ndarray) -> np.ndarray:
    """middle + half, rounded towards the middle: what is told lies inside of what is proved."""
    side = middle + half
    off = [Fraction(x) - Fraction(m) for x, m in zip(side, middle, strict=True)]
    beyond = [abs(x) > abs(Fraction(h)) for x, h in zip(off, half, strict=True)]
    return np.where(beyond, np.nextafter(side, middle), side)


def sides_of(names: Iterable[str], box: Box | SafeBox) -> str:
    """A box of k in exact numbers, for people."""
    of = zip(names, box.lo, box.hi, strict=True)
    return " x ".join(f"{name} in [{exact(lo)}, {exact(hi)}]" for name, lo, hi in of)


def safe_box(scene: Scene, p0: Vector, k: Params, within: Box) -> SafeBox | None:
    """A large box around k, cut to `within`, every plan of it from p0 proved safe; or None. [T21]

    Its sides are in the ratio of those of `within`. Large, not largest: sampled plans propose its
    size, the exact checker accepts or refuses it.
    """
    model, rng = scene.model, np.random.default_rng(0)
    scene = unpruned_scene(scene)  # the checker tests all obstacles, pruned ones too
    if not verdicts(scene, p0[None], k[None]).safe.all():
        return None
    scale = 2.0
    for _ in range(HALVINGS):
        x = _plans_of(*_cut(k, scale, within), rng)
        if verdicts(scene, np.broadcast_to(p0, (len(x), len(p0))), x).safe.all():
            break
        scale *= 0.5**0.5
    else:
        return None
    for _ in range(ATTEMPTS):
        box = _cut(k, scale, within)
        for certificate in _certificates(scene, p0, box, rng):
            if proves_box(scene.problem, model, certificate):
                return SafeBox(p0, *box, share_of(Box(-box[1], box[1]), model.domain), certificate)
        scale *= SHRINK
    return None


def box_around(k: np.ndarray, scale: float | np.ndarray, within: Box) -> Box:
    """The box around k (n_k,) with `scale` times the sides of `within`, moved into it at borders.

    scale: one factor, or (n_k,). Corners are short binary fractions, so that the middle is one too.
    """
    side = scale * (within.hi - within.lo)
    lo = np.clip(k - side / 2, within.lo, within.hi - side)
    unit = 2.0 ** (np.floor(np.log2(side)) - GRID)
    return Box(np.ceil(lo / unit) * unit, np.floor((lo + side) / unit) * unit)


def _cut(k: Float[np.ndarray, " n_k"], scale: float, within: Box) -> tuple[np.ndarray, np.ndarray]:
    """Middle and half widths of the box around k, cut to `within`; exactly inside of it."""
    side = scale * (within.hi - within.lo) / 2
    lo, hi = np.maximum(k - side, within.lo), np.minimum(k + side, within.hi)
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    # middle ± half rounds: a side that leaves `within` by an ulp is drawn inwards
    m, h, least, most = (_exact(x) for x in (middle, half, within.lo, within.hi))
    inside = ((least <= m - h) & (m + h <= most)).astype(bool)
    return middle, np.where(inside, half, half * INWARD)


def _plans_of(middle: np.ndarray, half: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(SAMPLED, n_k) corners of a box, its middle, and uniform draws, a little inside of it."""
    n = len(middle)
    # corners of the first six axes, or there would be 2^n; draws cover the others
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * min(n, 6))).reshape(min(n, 6), -1).T
    corners = np.pad(signs, ((0, 0), (0, n - signs.shape[1])))[: SAMPLED // 2]
    drawn = rng.uniform(-1, 1, (SAMPLED - len(corners) - 1, n))
    return middle + half * np.concatenate([np.zeros((1, n)), corners, drawn]) * INWARD


def _certificates(
    scene: Scene, p0: Vector, box: tuple[np.ndarray, np.ndarray], rng: np.random.Generator
):
    """Certificates for the box: of corridors around its plans, those of most plans first."""
    x = _plans_of(*box, rng)
    starts = np.broadcast_to(p0, (len(x), len(p0)))
    e = verdicts(scene, starts, x)
    safe = points(starts, x, e).at(e.safe)
    if not len(safe.k):
        return
    corridors = corridors_around(scene, rng, safe)
    margin = {"p0": hex_text(np.zeros(len(p0))), "k": hex_text(box[1])}
    for corridor in corridors[:4]:
        part = corridor_part(corridor, scene.problem)
        yield {"p0": hex_text(p0), "k": hex_text(box[0]), "room": margin, "sep": part["sep"]}


def share_of(part: Box, domain: Box) -> Fraction:
    """Exact share of the volume of a domain that the box `part` in it takes."""
    lo, hi, least, most = (_exact(x) for x in (part.lo, part.hi, domain.lo, domain.hi))
    return ((hi - lo) / (most - least)).prod()


def _exact(x: np.ndarray) -> np.ndarray:
    return np.array([Fraction(float(value)) for value in x], object)
