"""The door through which an entry gets runs, and where they are counted: a program `rollout ASK.npz
RUNS.npz` that the entry calls, and what answers it.
"""

import socket
import threading
import time
from pathlib import Path

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox
from benchmarks.suite.wire import receive, send

CLIENT = Path(__file__).with_name("rollout")
MOST = 1 << 16  # runs of one request
CHUNK = 4096
PATIENCE = 30.0  # [s] for a client that says nothing, or takes nothing, before it is left


class Door:
    """Answers requests for runs of a box while it is open, up to a budget, with seeds that nobody
    chooses. used: runs so far. seconds: [s] spent on them. Once closed it answers nobody, and no
    thread of it is left.
    """

    def __init__(self, box: BlackBox, budget: int, folder: Path):
        self.box, self.budget, self.used, self.seconds = box, budget, 0, 0.0
        self._address = str(folder / "door")
        self._rng = np.random.default_rng()
        self._line: socket.socket | None = None  # of the client that is served
        self._open = False

    @property
    def environment(self) -> dict[str, str]:
        """What the entry's program must find in its environment."""
        return {"SUITE_ROLLOUT": str(CLIENT), "SUITE_DOOR": self._address}

    def __enter__(self) -> "Door":
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(self._address)
        self._listener.listen()
        self._open = True
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._open = False
        for line in (self._listener, self._line):
            try:  # wakes whoever waits in accept or recv: a client may have been stopped in between
                if line is not None:
                    line.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
        self._thread.join()
        self._listener.close()
        Path(self._address).unlink(missing_ok=True)

    def _serve(self) -> None:
        while self._open:
            try:
                self._line, _ = self._listener.accept()
            except OSError:
                return
            with self._line as line:
                if not self._open:  # closed before it knew of this client, whom nobody else wakes
                    return
                line.settimeout(PATIENCE)
                try:
                    send(line, *self._answered(line))
                except (OSError, EOFError):
                    continue

    def _answered(self, line: socket.socket) -> tuple[str, dict[str, np.ndarray]]:
        """A sentence that says what is wrong, and no runs; or none, and the runs."""
        try:
            p0, k = _request(line, self.box)
        except Refused as why:
            return str(why), {}
        begin = time.monotonic()
        try:
            left = self.budget - self.used
            if not self._open or len(k) > left:
                return f"rollout: expected at most {left} runs, which are left; got {len(k)}.", {}
            self.used += len(k)
            p, q = self._run(p0, k)
            return "", {"p": p, "q": q}
        except Exception as error:  # the entry hears of it, and the harness goes on
            return f"rollout: the box failed; {type(error).__name__}: {error}", {}
        finally:
            self.seconds += time.monotonic() - begin

    def _run(self, p0: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        seen = [
            self.box.rollout(p0[i : i + CHUNK], k[i : i + CHUNK], int(self._rng.integers(2**62)))
            for i in range(0, len(k), CHUNK)
        ]
        p, q = (np.concatenate(parts) for parts in zip(*seen, strict=True))
        return p[:, :: self.box.fine], q


def _request(line: socket.socket, box: BlackBox) -> tuple[np.ndarray, np.ndarray]:
    """p0 (n, n_p) and k (n, n_k) that a client asks for. Raises Refused, EOFError, OSError."""
    try:
        _, asked = receive(line, most=8 * MOST * (box.n_p + len(box.k_lo)))
        p0, k = asked["p0"], asked["k"]
    except (KeyError, ValueError, TypeError) as error:
        raise Refused(
            f"rollout: expected 1 to {MOST} runs at a time, their p0 and k; {error}."
        ) from None
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
