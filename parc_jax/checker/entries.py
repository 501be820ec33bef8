"""The entries of an answer, checked one after another, here or in several processes."""

import concurrent.futures
import hashlib
import json
import multiprocessing
import signal

from .doubt import check_doubt
from .exact import Rejected, array, rejecting
from .plans import Context

LISTS = ("samples", "sets", "corridors", "doubt")  # in the order in which they are checked


def canonical(part):
    """The one JSON text of a part, of which its hash is taken."""
    return json.dumps(part, sort_keys=True, separators=(",", ":"))


def hash_of(part):
    """SHA-256 of that text."""
    return hashlib.sha256(canonical(part).encode()).hexdigest()


def check_entry(context, part, entry):
    """Checks an entry of one of the LISTS."""
    if part == "sets":
        context.check_set(entry)
    elif part == "doubt":
        check_doubt(context, entry)
    else:  # a corridor by its plan, which is one of those that it stands for
        context.check_sample(entry)


def check_entries(context, question, lists, processes):
    """Checks all entries of {part: list}; raises Rejected.

    question: what context was made of, for other processes. Whatever their number, the verdict is
    the same: the first rejected entry is told, and all processes together spend one allowance.
    """
    entries = [(part, i, entry) for part in LISTS for i, entry in enumerate(array(lists[part]))]
    processes = min(processes, len(entries))
    if processes <= 1:
        first = first_rejected(context, entries)
    else:
        first = first_rejected_in_shares(context, question, entries, processes)
    if first is not None:
        raise first[1]


def first_rejected(context, entries):
    """Number of the first entry (part, its number there, entry) that is rejected, and why; None."""
    for number, (part, i, entry) in enumerate(entries):
        try:
            with rejecting(f"{part}[{i}]: "):
                check_entry(context, part, entry)
        except Rejected as why:
            return number, why
    return None


def first_rejected_in_shares(context, question, entries, processes):
    """The same, every n-th entry in one of n processes of their own."""
    spawn = multiprocessing.get_context("spawn")  # forked ones may inherit locks of the caller
    with concurrent.futures.ProcessPoolExecutor(
        processes,
        mp_context=spawn,
        # Ctrl-C ends all of them at once, and one of them speaks
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_DFL),
    ) as pool:
        shares = [entries[first::processes] for first in range(processes)]
        asked = [pool.submit(check_share, question, some, context.work_left) for some in shares]
        answers = [each.result() for each in asked]
    rejected = []
    for first, (found, spent) in enumerate(answers):
        if found is None:
            context.spend(spent)
        else:
            rejected.append((first + processes * found[0], found[1]))
    return min(rejected, default=None)


def check_share(question, entries, work):
    """What `first_rejected` finds in a process of its own, and the work that it took."""
    context = Context(*question)
    context.work_left = work
    return first_rejected(context, entries), work - context.work_left
