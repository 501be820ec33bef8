"""One run of an FMU, for worker processes. Loads NumPy alone until then."""

import functools
import hashlib
import shutil
import tempfile
from dataclasses import dataclass
from multiprocessing.util import Finalize
from pathlib import Path

import numpy as np

ORDERLY = 10  # exit priority: before the folders for temporary files go
SEEDS = 2**31 - 1  # of them, such that they fit every kind of whole number that FMI has


@dataclass(frozen=True)
class FmuRun:
    """simulate(rng, k): one co-simulation from time 0, in a new instance.

    _path, sha256: of the FMU, the same bytes on every worker. parameters: set by k. p, q: outputs.
    start: (name, value) of further variables. seed: variable for a whole number that decides all
    randomness, or None. t_f, dt_record [s]. substeps: communication steps per record. n_points:
    reference points, over which p is laid out.
    """

    _path: str
    sha256: str
    parameters: tuple[str, ...]
    p: tuple[str, ...]
    q: tuple[str, ...]
    start: tuple[tuple[str, object], ...]
    seed: str | None
    t_f: float
    dt_record: float
    substeps: int
    n_points: int

    def __call__(self, rng: np.random.Generator, k: np.ndarray):
        """p (n_record + 1, n_p), or (n_record + 1, n_points, n_p), and q (n_q,)."""
        import fmpy

        folder, described = unpacked(self._path, self.sha256)
        values = dict(self.start) | dict(zip(self.parameters, map(float, k), strict=True))
        if self.seed is not None:
            values[self.seed] = int(rng.integers(SEEDS))
        ran = fmpy.simulate_fmu(
            folder,
            model_description=described,
            fmi_type="CoSimulation",
            start_time=0.0,
            stop_time=self.t_f,
            output_interval=self.dt_record / self.substeps,
            start_values=values,
            output=list(dict.fromkeys(self.p + self.q)),
        )[:: self.substeps]
        at = self.dt_record * np.arange(round(self.t_f / self.dt_record) + 1)
        if len(ran) != len(at) or not np.allclose(ran["time"], at, atol=1e-6 * self.dt_record):
            raise RuntimeError(f"the FMU ended at {ran['time'][-1]:g} of {self.t_f:g} s")
        p = np.column_stack([ran[name] for name in self.p])
        p = p if self.n_points == 1 else p.reshape(len(p), self.n_points, -1)
        return p, np.array([ran[name][-1] for name in self.q])


@functools.cache
def unpacked(path: str, sha256: str):
    """The folder of an FMU's files, once per process, and its description. Raises ImportError where
    the file is missing or another one.
    """
    import fmpy

    present = digest_of(path) if Path(path).is_file() else "no file"
    if present != sha256:  # no failure of the robot
        raise ImportError(
            f"{path}: expected the FMU with sha256 {sha256[:12]}; {present[:12]} is there"
        )
    folder = tempfile.mkdtemp(prefix="parc_jax_fmu_")
    Finalize(None, shutil.rmtree, (folder, True), exitpriority=ORDERLY)
    fmpy.extract(path, folder)
    return folder, fmpy.read_model_description(folder, validate=False)


def digest_of(path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()
