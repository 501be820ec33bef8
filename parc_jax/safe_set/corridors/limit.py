"""Seconds above the work of a search. Work alone decides what a search finds; where seconds cut
some of it off, that is remembered, for the answer to say.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Limit:
    """Most seconds of a search, from `start` on. cut: something was left undone for them."""

    def __init__(self, seconds: float):
        self.seconds = seconds
        self.cut = False
        self._begin: float | None = None

    def start(self) -> None:
        """Count from now, if not from earlier on: what comes before mostly compiles."""
        if self._begin is None:
            self._begin = time.perf_counter()

    @contextmanager
    def uncounted(self) -> Iterator[None]:
        """What compiles inside does not count."""
        begin = time.perf_counter()
        yield
        if self._begin is not None:
            self._begin += time.perf_counter() - begin

    def over(self, reserved: float = 0.0) -> bool:
        """Asked where there is more to do, which True cuts off. reserved [s]: what comes after."""
        if self._begin is not None:
            spent = time.perf_counter() - self._begin
            self.cut = self.cut or spent + reserved > self.seconds
        return self.cut
