"""The process in which a prover proves: commitments come in, verdicts go out."""

import pickle
import signal
import time
from io import BytesIO
from multiprocessing.connection import Connection
from multiprocessing.queues import Queue
from typing import NamedTuple

from parc_jax import checker
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.drive.loop.log import head_part, manoeuvre_part
from parc_jax.learning.model import TrajectoryModel

READY = "ready"


class Proof(NamedTuple):
    """Of one commitment. proved: it is safe over all of its time, from its pose. follows: it began
    where the one before may have been left; False says that a tube was left, or a pose was wrong.
    why: where it is not proved. seconds: of processor time that all this took.
    """

    number: int
    proved: bool
    follows: bool
    why: str
    seconds: float


class Packed(NamedTuple):
    """A commitment on its way. model: pickled, where it was not sent before."""

    commitment: bytes
    model: bytes | None
    rehearsal: bool = False  # read the model, compile what it needs, say nothing


class Packer:
    """Packs commitments; the model, which is large, goes once."""

    def __init__(self):
        self._models: list[TrajectoryModel] = []

    def pack(self, one: Commitment, rehearsal: bool = False) -> Packed:
        """It, ready to be sent."""
        new: list[TrajectoryModel] = []

        class Pickler(pickle.Pickler):
            def persistent_id(pickler: pickle.Pickler, x: object):
                return self._number(x, new) if isinstance(x, TrajectoryModel) else None

        buffer = BytesIO()
        Pickler(buffer).dump(one)
        return Packed(buffer.getvalue(), pickle.dumps(new) if new else None, rehearsal)

    def _number(self, model: TrajectoryModel, new: list) -> int:
        for number, known in enumerate(self._models):
            if known is model:
                return number
        self._models.append(model)
        new.append(model)
        return len(self._models) - 1


class Unpacker:
    """The other side of a Packer."""

    def __init__(self):
        self._models: list[TrajectoryModel] = []

    def unpack(self, packed: Packed) -> Commitment:
        """What was packed."""
        if packed.model is not None:
            self._models += pickle.loads(packed.model)

        class Unpickler(pickle.Unpickler):
            def persistent_load(unpickler: pickle.Unpickler, number: int):
                return self._models[number]

        return Unpickler(BytesIO(packed.commitment)).load()


class Proving:
    """Commitments of one loop after another, proved in their order. Network and tube, which take
    the checker seconds to read, are read once for all episodes of a loop.
    """

    def __init__(self):
        self._about: tuple = ()
        self._chain: checker.Chain | None = None

    def proof(self, one: Commitment) -> Proof:
        """Spelled, and checked in exact arithmetic. Nothing is proved by an error."""
        begin = time.process_time()
        follows, why = False, ""
        try:
            follows = self._chain_of(one).add(manoeuvre_part(one))
        except checker.Rejected as error:
            why = str(error)
        except Exception as error:
            why = f"{type(error).__name__}: {error}"
        seconds = time.process_time() - begin
        return Proof(one.number, not why, follows, why, seconds)

    def _chain_of(self, one: Commitment) -> checker.Chain:
        """The chain that it goes on with; a first commitment follows nothing."""
        uncertainty = one.asked.query.problem.uncertainty
        about = one.asked.model, None if uncertainty is None else uncertainty.of_model
        known = self._about and about[0] is self._about[0] and about[1] == self._about[1]
        if self._chain is None or not known:
            self._about, self._chain = about, checker.Chain(head_part(one.asked))
        if one.number == 0:
            self._chain.last = None
        return self._chain


def serve(asked: Queue, told: Connection) -> None:
    """Proves what comes by the queue `asked`, tells by the connection `told`, until None comes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, who ends this process
    unpacker, proving = Unpacker(), Proving()
    told.send(READY)
    while (packed := asked.get()) is not None:
        one = unpacker.unpack(packed)
        proof = proving.proof(one)
        told.send(READY if packed.rehearsal else proof)
