"""The exact proof of every commitment, in a process of its own, while the loop goes on."""

import multiprocessing

from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.proving import READY, Packer, Proof, serve

MOST = 10  # commitments that may wait


class Prover:
    """Proves what a loop commits to, in exact arithmetic, by the independent checker, in a second
    process: `with pj.loop.Prover() as prover: loop = pj.loop.Loop(..., prover=prover)`.

    Every commitment is proved in float64 before it is driven, with a margin for all rounding; the
    exact proof follows some ten to hundred milliseconds later. A commitment that it rejects would
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
        self._asked = context.Queue()  # a thread of it waits where its pipe is full, no loop does
        self._asked.cancel_join_thread()
        self._told, there = context.Pipe(duplex=False)
        self._process = context.Process(target=serve, args=(self._asked, there), daemon=True)
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
        self._asked.put(self._packer.pack(one))
        self._sent += 1

    def rehearse(self, one: Commitment) -> None:
        """Read its model and compile what a proof of such a commitment needs; waits for it."""
        self._asked.put(self._packer.pack(one, rehearsal=True))
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
                self.proofs.append(self._told.recv())
            except (EOFError, OSError):
                self._process.join()
                break
        if self.rejected is not None or self.behind:
            raise SoundnessError(f"Prover: {self.trouble()}.")
        return self.proofs

    def close(self) -> None:
        """End the process; what waits is not proved."""
        self._asked.close()
        self._process.kill()
        self._process.join()
        self._told.close()

    def _read(self) -> None:
        """What has come by now."""
        try:
            while self._told.poll():
                self.proofs.append(self._told.recv())
        except (EOFError, OSError):  # the process ended: `trouble` says so
            return

    def _wait_ready(self) -> None:
        try:
            ready = self._told.recv()
        except (EOFError, OSError):
            ready = None
        if ready != READY:
            self.close()
            raise InputError(
                "Prover: expected its process to start; it ended at once. Guard the script's own "
                'start with `if __name__ == "__main__":`.'
            )
