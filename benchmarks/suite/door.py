"""The door through which an entry gets runs, and where they are counted: a program `rollout ASK.npz
RUNS.npz` that the entry calls, and what answers it.
"""

import os
import threading
import time
from multiprocessing.connection import Listener
from pathlib import Path

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox

CLIENT = Path(__file__).with_name("rollout")
MOST = 1 << 16  # runs of one request
CHUNK = 4096


class Door:
    """Answers requests for runs of a box while it is open, up to a budget, with seeds that nobody
    chooses. used: runs so far. seconds: [s] spent on them.
    """

    def __init__(self, box: BlackBox, budget: int, folder: Path):
        self.box, self.budget, self.used, self.seconds = box, budget, 0, 0.0
        self._address = str(folder / "door")
        self._rng = np.random.default_rng()

    @property
    def environment(self) -> dict[str, str]:
        """What the entry's program must find in its environment."""
        return {"SUITE_ROLLOUT": str(CLIENT), "SUITE_DOOR": self._address}

    def __enter__(self) -> "Door":
        self._listener = Listener(self._address, "AF_UNIX")
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._listener.close()
        Path(self._address).unlink(missing_ok=True)

    def _serve(self) -> None:
        while True:
            try:
                with self._listener.accept() as line:
                    ask, runs = line.recv()
                    line.send(self._answered(ask, runs))
            except (EOFError, ConnectionError):
                continue
            except OSError:
                return

    def _answered(self, ask: str, runs: str) -> str:
        """A sentence that says what is wrong; empty where the runs were written."""
        begin = time.monotonic()
        try:
            p0, k = _request(ask, self.box)
            left = self.budget - self.used
            if len(k) > left:
                return f"rollout: expected at most {left} runs, which are left; got {len(k)}."
            self.used += len(k)
            p, q = self._run(p0, k)
            part = f"{runs}.part"
            with Path(part).open("wb") as file:
                np.savez(file, p=p, q=q)
            os.replace(part, runs)
            return ""
        except Refused as why:
            return str(why)
        except Exception as error:  # the entry hears of it, and the harness goes on
            return f"rollout: the box failed; {type(error).__name__}: {error}"
        finally:
            self.seconds += time.monotonic() - begin

    def _run(self, p0: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        seen = [
            self.box.rollout(p0[i : i + CHUNK], k[i : i + CHUNK], int(self._rng.integers(2**62)))
            for i in range(0, len(k), CHUNK)
        ]
        p, q = (np.concatenate(parts) for parts in zip(*seen, strict=True))
        return p[:, :: self.box.fine], q


def _request(path: str, box: BlackBox) -> tuple[np.ndarray, np.ndarray]:
    """p0 (n, n_p) and k (n, n_k) of a file. Raises Refused."""
    try:
        with np.load(path, allow_pickle=False) as file:
            p0, k = (np.asarray(file[name], np.float64) for name in ("p0", "k"))
    except (OSError, KeyError, ValueError, EOFError) as error:
        raise Refused(f"rollout: expected an .npz file with p0 and k; {error}") from None
    n_k = len(box.k_lo)
    if p0.ndim != 2 or p0.shape[1:] != (box.n_p,) or k.shape != (len(p0), n_k):
        raise Refused(
            f"rollout: expected p0 (n, {box.n_p}) and k (n, {n_k}); got {p0.shape}, {k.shape}."
        )
    if not 0 < len(k) <= MOST:
        raise Refused(f"rollout: expected 1 to {MOST} runs at a time; got {len(k)}.")
    fine = np.isfinite(p0).all(axis=1) & ((box.k_lo <= k) & (k <= box.k_hi)).all(axis=1)
    if not fine.all():
        i = int(np.argmin(fine))
        raise Refused(
            "rollout: expected finite starts, and k between k_lo and k_hi; "
            f"row {i} has p0 {p0[i].tolist()}, k {k[i].tolist()}, and nothing was run."
        )
    return p0, k
