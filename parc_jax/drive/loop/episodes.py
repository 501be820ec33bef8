"""The claim about a loop: fresh episodes of a law, counted, and their folder. [T40]"""

import fcntl
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np
from jax import Array

from parc_jax.answer.looks import DELTA, Look
from parc_jax.common.errors import InputError, check_count, check_kind, reading
from parc_jax.common.keys import Stage, key_data, stream
from parc_jax.drive.loop.statement import about_episodes
from parc_jax.drive.loop.workers import Driven, Outcome, Task, driven
from parc_jax.learning.bound.counts import as_probability, clopper_pearson
from parc_jax.learning.runs.chunks import BEGUN, begin, cores, describe_work
from parc_jax.learning.runs.collect import seed_of
from parc_jax.learning.systems.content import whole_digest, with_digest

FORMAT = "parc_jax.episodes/9"
HOPELESS = 4  # episodes, all failed, after which driving ends
EACH = 100  # of so many episodes one is driven again
OTHER = 2**64  # a number that no episode has: of the first world another drive
LINES, ABOUT = "episodes.jsonl", "meta.json"


@dataclass(frozen=True)
class Episodes:
    """Results of fresh episodes of a law. [T40]

    driven: all of them, by number. look: which of the looks this is, with its share of delta. law,
    drive: name and content of each. again: how some came out when they were driven again.
    """

    driven: tuple[Driven, ...] = field(repr=False)
    look: Look
    law: str
    drive: str
    again: str = "not tried"

    @property
    def n(self) -> int:
        """Episodes."""
        return len(self.driven)

    @property
    def touched(self) -> int:
        """In which anything was touched."""
        return sum(one.touched is True for one in self.driven)

    @property
    def left(self) -> int | None:
        """In which a tube was left; None where that was not tested in all of them."""
        left = [one.left for one in self.driven if not one.failed]
        return None if None in left else left.count(True)

    @property
    def failed(self) -> int:
        """Without an outcome; they count as bad."""
        return sum(bool(one.failed) for one in self.driven)

    @property
    def bad(self) -> int:
        """In which a tube was left, anything touched, or that is unknown or told as bad."""
        return sum(one.bad for one in self.driven)

    @property
    def contradictions(self) -> tuple[int, ...]:
        """Numbers of episodes in which anything was touched inside the tubes, all of it told of."""
        told = (x for x in self.driven if x.loops and (x.told_for is None or x.told_then))
        return tuple(x.number for x in told if x.left is False and x.touched)

    @property
    def eps(self) -> Fraction:
        """Bound, with confidence 1 - look.delta, on the probability that an episode is bad."""
        return clopper_pearson(self.bad, self.n, float(self.look.delta))

    def details(self) -> str:
        """The sentences (C) and (E) of a loop."""
        return about_episodes(self)


def drive_episodes(
    drive: Callable[..., Outcome],
    law: Callable,
    key: Array,
    n: int,
    *,
    folder: str | Path | None = None,
    workers: int | None = None,
    delta: Fraction | float | str = DELTA,
    looks: Sequence[int] = (),
    quiet: bool = False,
) -> Episodes:
    """Drive n fresh episodes of a law and bound the probability that the next one is bad. [T40]

    drive: (world, seed) -> Outcome, with all decisions made before: planner, model and tube,
        sensors, end of an episode. One that fails, by an exception or its process, is bad. The
        first is driven again at once; at the end, and before others that go on, it and one more of
        each hundred: refused where what counts differs; the first also by a seed that is of no
        other, as is told. A driver names its files by the seed, or one replaces another's.
    law: seed -> a world with its start and goal, all that differs between episodes. A seed is an
        array (2,) of uint32: a random key of JAX, or `numpy.random.default_rng(seed)`. All
        randomness comes from seeds, which depend on key and number of the episode alone and meet no
        other stream. It is called twice for the first one in this process, before any is driven:
        refused where that tells two worlds, or changes it.
    folder: gets a line for each episode when it ends; a killed run continues there. Episodes of
        another drive, law or key are refused: of what cannot be pickled the kind alone is compared.
    workers: processes, None for one per core, 0 for none; each gets drive and law once, pickled.
    delta: error probability of all looks together. looks: all numbers n at which the claim may ever
        be evaluated, declared before the first episode, each with its share of delta; by default n
        alone. Results in between, or in a folder, may then decide nothing.

    Assumed: when and why a run is killed does not depend on its episodes. Raises InputError.
    """
    from tqdm import tqdm

    check_count("episodes", n, 1, "how many to drive")
    workers = cores() if workers is None else workers
    check_count("workers", workers, 0, "processes")
    for name, given in (("drive", drive), ("law", law)):
        check_kind(f"episodes: {name}", given, Callable)
    delta, declared = as_probability("delta", delta), list(looks) if np.iterable(looks) else [looks]
    for one in declared:
        check_count("looks", one, 1, "the numbers of episodes at which the claim is evaluated")
    declared = sorted(map(int, declared)) or [n]
    if n not in declared or len(set(declared)) < len(declared):
        raise InputError(
            f"looks: expected the numbers of episodes, each once, at which the claim may be "
            f"evaluated, {n} among them; got {', '.join(map(str, declared))}."
        )
    look = Look(declared.index(n) + 1, len(declared), delta / len(declared))
    words = key_data(stream(key, Stage.EPISODE))
    require_of_seeds(law, task_of(words, 0).of_world)
    named = [with_digest(getattr(x, "__name__", type(x).__name__), x) for x in (law, drive)]
    meta = {
        "format": FORMAT,
        "drive": whole_digest(drive),
        "law": whole_digest(law),
        "seed": list(seed_of(key)),
        "delta": str(delta),
        "looks": declared,
    }
    with Ledger(folder, meta) as ledger:
        done = ledger.done
        tasks = [task_of(words, i) for i in range(n) if i not in done]
        more, again = [], [task_of(words, i)._replace(number=~i) for i in range(1 + n // EACH)]
        stored = [one for one in again if tasks and ~one.number in done]
        again.append(again[0]._replace(number=~n, of_drive=task_of(words, OTHER).of_drive))
        with tqdm(total=n, initial=n - len(tasks), unit="episode", disable=quiet) as bar:
            asked = [*stored, *tasks[:1], *again[: 0 not in done], *tasks[1:], *again]
            for one in driven(drive, law, map(ledger.mark, asked), min(workers, len(asked))):
                if one.number < 0:
                    more.append(one)
                    told_again(done, more, n)  # at once, before others are driven in vain
                    continue
                ledger.add(one)
                if one.number == 0:  # of two workers the other may have driven it again by now
                    told_again(done, more, n)
                bar.update()
                if len(done) >= min(n, HOPELESS) and all(each.failed for each in done.values()):
                    raise InputError(
                        f"episodes: expected drive(world, seed) to work; all {len(done)} so far "
                        f"failed, the last {one.failed}."
                    )
        named.append(told_again(done, more, n))
        return Episodes(tuple(done[i] for i in range(n)), look, *named)


def told_again(done: dict[int, Driven], more: Sequence[Driven], n: int) -> str:
    """How episodes came out that were driven again, each as ~ its number; as ~n the first, by
    another seed. Raises InputError where what counts of one differs, which its seeds do not decide.
    """
    clock: set[str] = set()
    others = {~one.number: one for one in more}
    for i, one in ((~one.number, one) for one in more if ~one.number in done.keys() - {n}):
        clock |= (differs := done[i].differs(one))
        if differs & {"touched", "left"}:
            raise InputError(
                f"episodes: expected that world and seed decide an episode; number {i}, driven "
                "again, came out otherwise. Its driver goes on learning, or a file that it reads "
                "has changed, or it draws what does not come from its seed, as by a reset without "
                "one, or reads a clock: cure that, begin each episode anew, and drive all again."
            )
    same = 0 in done and n in others and not done[0].differs(others[n]) - clock
    but = f" but for {', '.join(sorted(clock))}" if clock else ""
    none = f"of its drive no {'other ' * bool(clock)}randomness was seen"
    other = f"the same{but}: {none}" if same else "otherwise"
    return f"{len(others) - 1:,} driven again, the same{but}; the first, by another seed, {other}"


def require_of_seeds(law: Callable, seed: np.ndarray) -> None:
    """Refuse a law that a call changes, or that tells two worlds of one seed. Raises InputError."""
    try:
        one = whole_digest(law(seed.copy()))
        before = whole_digest(law)  # what it keeps of a seed, or loads at its first call, is there
        two = whole_digest(law(seed.copy()))
    except (Exception, SystemExit):  # a failed episode, which is told when it is driven
        return
    if one != two or whole_digest(law) != before:
        got = "another world of the same seed" if one != two else "that a call of it changes it"
        raise InputError(
            f"episodes: expected a law whose worlds are of their seeds alone; got {got}. Draw from "
            "logged worlds by the seed, as worlds[default_rng(seed).integers(len(worlds))]; name "
            "files by the seed, too."
        )


class Ledger:
    """Open while it is written: `with Ledger(folder, meta) as ledger`.

    folder: None to keep nothing on disk. meta: identity of the episodes; a folder of others is
    refused. done: episodes by their number.
    """

    def __init__(self, folder: str | Path | None, meta: dict):
        self.folder, self.meta = None if folder is None else Path(folder), meta
        self.done: dict[int, Driven] = {}
        self._before: dict[int, int] = {}  # earlier begins of those that were begun here

    def __enter__(self) -> "Ledger":
        if self.folder is None:
            return self
        with reading(self.folder, "a folder for episodes"):
            self.folder.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.folder / LINES, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            self._open()
        except BaseException:
            os.close(self._file)
            raise
        return self

    def __exit__(self, *_) -> None:
        if self.folder is not None:
            os.close(self._file)

    def mark(self, task: Task) -> Task:
        """This task, begun as the folder tells from now on; not what is driven again."""
        if self.folder is not None and task.number >= 0:
            self._before[task.number] = begin(self.folder, task.number)
        return task

    def add(self, one: Driven) -> None:
        """Append an episode; it is on disk when this returns."""
        if self.folder is not None:
            one = one._replace(before=self._before[one.number])
            told = json.loads(json.dumps(one._asdict()))  # as it is read, of which the hash is
            told["hash"] = whole_digest([self.meta, told])
            os.write(self._file, (json.dumps(told) + "\n").encode())
            os.fsync(self._file)
            (self.folder / BEGUN.format(one.number)).unlink(missing_ok=True)
        self.done[one.number] = one

    def _open(self) -> None:
        with reading(self.folder, "a folder that no run writes to; another run does"):
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # ends with the process
        describe_work(self.folder / ABOUT, self.meta)
        text = (self.folder / LINES).read_bytes()
        # a line that a killed run did not finish is dropped, and its episode driven again
        whole = text.rfind(b"\n") + 1
        os.ftruncate(self._file, whole)
        for i, line in enumerate(text[:whole].splitlines()):
            with reading(f"{self.folder / LINES}, line {i + 1}", "an episode as it was written"):
                told = json.loads(line)
                known = told.pop("hash", None) == whole_digest([self.meta, told])
                if not known or told["number"] in self.done:
                    raise InputError(
                        f"{self.folder / LINES}, line {i + 1}: expected an episode of this folder, "
                        f"as it was written; number {told['number']!r:.20} is of another one, "
                        "stands there twice, or was changed. Begin anew in another folder."
                    )
                one = Driven(**told)
            self.done[one.number] = one


def task_of(words: np.ndarray, number: int) -> Task:
    """The seeds of one episode: hashed from the key of the stream and its number."""
    entropy = [*(int(word) for word in words.ravel()), number]
    seeds = np.random.SeedSequence(entropy).generate_state(4)
    return Task(number, seeds[:2], seeds[2:])
