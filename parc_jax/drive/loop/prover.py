"""The exact proof of every commitment, in a second process, while the loop goes on."""

import multiprocessing
import pickle
import signal
import time
from io import BytesIO
from multiprocessing.connection import Connection
from multiprocessing.queues import Queue
from typing import NamedTuple

from parc_jax import checker
from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.episode_file import head_part, manoeuvre_part
from parc_jax.learning.model import TrajectoryModel

MOST = 10  # commitments that may wait
READY = "ready"


class Proof(NamedTuple):
    """Of one commitment. proved: it is safe over all of its time, from its pose. follows: it began
    where the one before may have been left; False where a tube was left, or a pose was wrong.
    why: reason where it is not proved. seconds: processor time that it took.
    """

    number: int
    proved: bool
    follows: bool
    why: str
    seconds: float


class Prover:
    """Proves the commitments of a loop in exact arithmetic, by the independent checker, in a second
    process: `with pj.drive.Prover() as prover: loop = pj.drive.Loop(..., prover=prover)`.

    Every commitment is proved in float64 before it is driven, with a margin for all rounding; the
    exact proof follows some milliseconds later. A commitment that it rejects would
    be a fault of this package: from then on the loop commits to nothing, the stop in hand goes on,
    and leaving the `with` raises SoundnessError. most: commitments that may wait for their proof;
    where there are more, and where the process ended, the loop commits to nothing either.

    proofs: so far, in the order of commitments, also whether each began where the one before may
    have been left, and how long it took. Takes seconds to start.
    """

    def __init__(self, most: int = MOST):
        if isinstance(most, bool) or not isinstance(most, int) or most < 1:
            raise InputError(f"Prover: expected 1 or more that may wait; got {most!r:.40}.")
        self.most, self.proofs = most, []
        self._sent, self._packer = 0, Packer()
        context = multiprocessing.get_context("spawn")
        self._tasks = context.Queue()  # a thread of it waits where its pipe is full, no loop does
        self._tasks.cancel_join_thread()
        self._answers, there = context.Pipe(duplex=False)
        self._process = context.Process(target=serve, args=(self._tasks, there), daemon=True)
        self._process.start()
        there.close()
        self._wait_ready()

    def __enter__(self) -> "Prover":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_) -> None:
        try:
            if kind is None:
                self.finish()
        finally:
            self.close()

    def add(self, one: Commitment) -> None:
        """Prove it, as soon as those before it are."""
        self._tasks.put(self._packer.pack(one))
        self._sent += 1

    def rehearse(self, one: Commitment) -> None:
        """Read its model and compile its proof; waits for both."""
        self._tasks.put(self._packer.pack(one, rehearsal=True))
        self._wait_ready()

    @property
    def behind(self) -> int:
        """Commitments whose proof has not come yet."""
        self._read()
        return self._sent - len(self.proofs)

    @property
    def rejected(self) -> Proof | None:
        """The first that is not proved, if any."""
        self._read()
        return next((proof for proof in self.proofs if not proof.proved), None)

    def trouble(self) -> str:
        """Why a loop may commit to nothing more, empty where it may."""
        behind, rejected = self.behind, self.rejected
        if rejected is not None:
            return (
                f"the exact checker rejects commitment {rejected.number}: {rejected.why}; this is "
                "a fault of this package, please report it with the certificate"
            )
        if behind and not self._process.is_alive():
            return f"the prover's process ended with exit code {self._process.exitcode}"
        if behind > self.most:
            return f"{behind} commitments wait for their exact proof, more than {self.most}"
        return ""

    def finish(self) -> list[Proof]:
        """All proofs, waited for. Raises SoundnessError where one is missing or rejected."""
        while self.behind and self.rejected is None:
            try:
                self.proofs.append(self._answers.recv())
            except (EOFError, OSError):
                self._process.join()
                break
        if self.rejected is not None or self.behind:
            raise SoundnessError(f"Prover: {self.trouble()}.")
        return self.proofs

    def close(self) -> None:
        """End the process; waiting commitments stay unproved."""
        self._tasks.close()
        self._process.kill()
        self._process.join()
        self._answers.close()

    def _read(self) -> None:
        """Receive the proofs that are ready."""
        try:
            while self._answers.poll():
                self.proofs.append(self._answers.recv())
        except (EOFError, OSError):  # the process ended: `trouble` says so
            return

    def _wait_ready(self) -> None:
        try:
            ready = self._answers.recv()
        except (EOFError, OSError):
            ready = None
        if ready != READY:
            self.close()
            raise InputError(
                "Prover: expected its process to start; it ended at once. Guard the script's own "
                'start with `if __name__ == "__main__":`.'
            )


class Packed(NamedTuple):
    """A commitment on its way. model: pickled, where it was not sent before."""

    commitment: bytes
    model: bytes | None
    rehearsal: bool = False  # read the model, compile what it needs, say nothing


class Packer:
    """Packs commitments; the model, which is large, goes once."""

    def __init__(self):
        self._models: dict[int, tuple[int, TrajectoryModel]] = {}  # number of each, by identity

    def pack(self, one: Commitment, rehearsal: bool = False) -> Packed:
        """The bytes of a commitment."""
        models, new = self._models, []

        class Pickler(pickle.Pickler):
            def persistent_id(self, x: object):
                if not isinstance(x, TrajectoryModel):
                    return None
                # by identity: a model is megabytes, and each commitment holds two
                if id(x) not in models:
                    models[id(x)] = len(models), x
                    new.append(x)
                return models[id(x)][0]

        buffer = BytesIO()
        Pickler(buffer).dump(one)
        return Packed(buffer.getvalue(), pickle.dumps(new) if new else None, rehearsal)


class Unpacker:
    """The other side of a Packer."""

    def __init__(self):
        self._models: list[TrajectoryModel] = []

    def unpack(self, packed: Packed) -> Commitment:
        """The commitment that was packed."""
        if packed.model is not None:
            self._models += pickle.loads(packed.model)

        class Unpickler(pickle.Unpickler):
            persistent_load = staticmethod(self._models.__getitem__)

        return Unpickler(BytesIO(packed.commitment)).load()


class Proving:
    """Commitments of one loop after another, proved in their order. Network and tube, which take
    the checker seconds to read, are read once for all episodes of a loop.
    """

    def __init__(self):
        self._model: TrajectoryModel | None = None
        self._robust: tuple | None = None
        self._chain: checker.Chain | None = None

    def proof(self, one: Commitment) -> Proof:
        """Serialise and check it in exact arithmetic; an error proves nothing."""
        begin = time.process_time()
        follows, why = False, ""
        uncertainty = one.asked.query.problem.uncertainty
        model, robust = one.asked.model, None if uncertainty is None else uncertainty.of_model
        try:
            if self._chain is None or model is not self._model or robust != self._robust:
                chain = checker.Chain(head_part(one.asked))
                self._model, self._robust, self._chain = model, robust, chain
            if one.number == 0:  # another episode: the robot was moved, so it follows no manoeuvre
                self._chain.last = None
            follows = self._chain.add(manoeuvre_part(one))
        except checker.Rejected as error:
            why = str(error)
        except Exception as error:
            why = f"{type(error).__name__}: {error}"
        return Proof(one.number, not why, follows, why, time.process_time() - begin)


def serve(tasks: Queue, answers: Connection) -> None:
    """Prove commitments of the queue `tasks`, send proofs by `answers`, until None comes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, which ends this process
    unpacker, proving = Unpacker(), Proving()
    answers.send(READY)
    while (packed := tasks.get()) is not None:
        one = unpacker.unpack(packed)
        proof = proving.proof(one)
        answers.send(READY if packed.rehearsal else proof)
