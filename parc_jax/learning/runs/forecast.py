"""What a long computation will cost, said before it is spent."""

import sys
import threading
import time
from collections.abc import Callable

LONG_S = 30.0  # what takes longer is announced


class Forecast:
    """The cost of all runs that a command will make, said once, at the rate of the first ones.

    runs: of all stages together. advice: what would be cheaper, in words. quiet: say nothing.
    """

    def __init__(self, runs: int, advice: str = "", quiet: bool = False):
        self.runs = runs
        self.advice = advice
        self._is_said = quiet
        self._lock = threading.Lock()

    def measured(self, name: str, seconds_per_run: float) -> None:
        """Tell the forecast how long a run of the system `name` takes, all workers together."""
        with self._lock:
            if self._is_said:
                return
            self._is_said = True
        if self.runs * seconds_per_run > LONG_S:
            from tqdm import tqdm

            tqdm.write(self.sentence(name, seconds_per_run), file=sys.stderr)

    def sentence(self, name: str, seconds_per_run: float) -> str:
        """For example "cart: 12,300 runs x 0.6 s = 2 h; eps = 0.01 needs 690 runs"."""
        cost = (
            f"{name}: {self.runs:,} runs x {spell(seconds_per_run)} = "
            f"{spell(self.runs * seconds_per_run)}"
        )
        return f"{cost}; {self.advice}" if self.advice else cost


class Pace:
    """Seconds per run from the chunks that workers hand in. The first one does not count, nor what
    ran beside it: it waits for a compiler, or for the start of a simulator's own processes, which
    is soon over: one of LONG_S without a compiler counts. forecast: is told the pace of the system
    `name`.
    """

    def __init__(
        self, workers: int, compiles: bool, forecast: Forecast | None = None, name: str = ""
    ):
        self._workers = workers
        self._compiles = compiles
        self._forecast = forecast
        self._name = name
        self._from: float | None = None
        self._lock = threading.Lock()

    def timed(self, runs: int, work: Callable):
        """What work() gives, which makes so many runs."""
        began = time.perf_counter()
        done = work()
        each = self.of(runs, began, time.perf_counter())
        if each is not None and self._forecast is not None:
            self._forecast.measured(self._name, each)
        return done

    def of(self, runs: int, began: float, ended: float) -> float | None:
        """Seconds per run of one chunk that ran from `began` to `ended` [s], or None."""
        with self._lock:
            first = self._from is None
            if first:
                self._from = ended
        counts = ended - began >= LONG_S and not self._compiles if first else began >= self._from
        return (ended - began) / runs / self._workers if counts else None


def spell(seconds: float) -> str:
    """A duration for people: two digits and a unit."""
    sizes = {"d": 86_400, "h": 3_600, "min": 60, "s": 1}
    unit = next((name for name, size in sizes.items() if seconds >= size), "s")
    if seconds < 0.1:
        return f"{1e3 * seconds:.2g} ms"
    amount = seconds / sizes[unit]
    return f"{amount:,.0f} {unit}" if amount >= 100 else f"{amount:.2g} {unit}"
