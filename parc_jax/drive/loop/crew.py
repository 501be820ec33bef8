"""Episodes in worker processes, one at a time in each, so that it is known whose episode ended its
process.
"""

import multiprocessing
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from parc_jax.common.errors import InputError
from parc_jax.drive.loop.outcome import READY, Driven, Task, failed, run_one, serve


def driven(drive: Callable, law: Callable, tasks: Iterable[Task], workers: int) -> Iterator[Driven]:
    """The episodes of tasks, in the order in which they end. workers: 0 for none, all in this
    process. Raises InputError for what cannot be sent to workers.
    """
    if not workers:
        yield from (run_one(drive, law, task) for task in tasks)
        return
    crew = _Crew(_pickled(drive, law), deque(tasks))
    with closing(crew):
        for _ in range(min(workers, len(crew.waiting))):
            crew.begin()
        while crew.at_work:
            yield from crew.some()


class _Crew:
    """Processes, and what each is about. waiting: tasks that nobody has begun."""

    def __init__(self, pickled: bytes, waiting: deque[Task]):
        self.pickled, self.waiting = pickled, waiting
        self.at_work: dict[Connection, tuple] = {}  # connection: process and its task, if any
        # fresh processes: a fork of one that runs JAX may hang
        self._context = multiprocessing.get_context("spawn")

    def begin(self) -> None:
        """One process more."""
        here, there = self._context.Pipe()
        process = self._context.Process(target=serve, args=(there, self.pickled), daemon=True)
        process.start()
        there.close()  # so that its end is seen here
        self.at_work[here] = process, None

    def some(self) -> Iterator[Driven]:
        """What ended by now: waits for one at least, or for a process that is ready."""
        for here in wait(list(self.at_work)):
            process, task = self.at_work[here]
            try:
                told = here.recv()
            except (EOFError, OSError):
                yield self._lost(here, process, task)
                continue
            if isinstance(told, Driven):
                yield told
            elif told != READY:
                raise InputError(f"episodes: expected to be sent to a worker process; {told}.")
            self._go_on(here, process)

    def _go_on(self, here: Connection, process: BaseProcess) -> None:
        if not self.waiting:
            del self.at_work[here]
            here.close()
            return
        task = self.waiting.popleft()
        self.at_work[here] = process, task
        here.send(task)

    def _lost(self, here: Connection, process: BaseProcess, task: Task | None) -> Driven:
        """An episode that ended its process; another process takes its place."""
        del self.at_work[here]
        here.close()
        process.join()
        if task is None:
            raise InputError(
                "episodes: expected worker processes to start; one ended before its first episode. "
                'Guard the script\'s own start with `if __name__ == "__main__":`, or pass '
                "workers=0."
            )
        if self.waiting:
            self.begin()
        return failed(task.number, f"its process ended with exit code {process.exitcode}")

    def close(self) -> None:
        for here, (process, _) in self.at_work.items():
            process.kill()
            process.join()
            here.close()


def _pickled(drive: Callable, law: Callable) -> bytes:
    try:
        return pickle.dumps((drive, law))
    except Exception as error:  # pickle raises whatever the object's own hooks do
        raise InputError(
            f"episodes: expected a drive and a law that can be sent to worker processes; {error}. "
            "Define them at the top level of a module, or pass workers=0."
        ) from None
