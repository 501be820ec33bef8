"""The entries of an answer, checked one after another, here or in several processes."""

import concurrent.futures
import hashlib
import json
import multiprocessing
import signal

from .doubt import check_doubt
from .exact import Rejected, array, number, rejecting
from .plans import Context

LISTS = ("samples", "sets", "corridors", "doubt")  # in the order in which they are checked


def canonical(part):
    """The one JSON text of a part, of which its hash is taken."""
    return json.dumps(part, sort_keys=True, separators=(",", ":"))


def hash_of(part):
    """SHA-256 of that text."""
    return hashlib.sha256(canonical(part).encode()).hexdigest()


def valued(part):
    """The same with numbers for their spellings, and tuples for lists."""
    if type(part) is list:
        return tuple(map(valued, part))
    return number(part) if type(part) is str else part


def check_entry(context, part, entry):
    """Checks an entry of one of the LISTS; returns what tells it from others that prove as much."""
    if part == "samples":
        p0, k = context.check_sample(entry)
        return (*p0, *k)
    if part == "sets":
        context.check_set(entry)
        return entry["bin"], entry["pattern"], valued(entry["sep"])
    if part == "corridors":
        context.check_sample(entry)  # its plan is one of those that it stands for
        return valued(entry["sep"])
    return tuple(check_doubt(context, entry))


def check_entries(context, question, lists, processes):
    """Checks all entries of {part: list}; returns {part: the different ones}.

    question: what context was made of, for other processes. Whatever their number, the verdict is
    the same: the first rejected entry is told, and all processes together spend one allowance.
    """
    entries = []
    for part in LISTS:
        entries += [(part, i, entry) for i, entry in enumerate(array(lists[part]))]
    processes = min(processes, len(entries))
    proved: list = []
    if processes <= 1:
        check_in_turn(context, entries, proved)
    else:
        check_in_shares(context, question, entries, processes, proved)
    found: dict = {part: set() for part in LISTS}
    for part, what in proved:
        found[part].add(what)
    return found


def check_in_turn(context, entries, proved):
    """Adds (part, what it proves) of each entry; raises Rejected at the first that is rejected."""
    for part, i, entry in entries:
        with rejecting(f"{part}[{i}]: "):
            proved.append((part, check_entry(context, part, entry)))


def check_in_shares(context, question, entries, processes, proved):
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
    rejections = []
    for first, (done, refused, spent) in enumerate(answers):
        proved += done
        if refused is None:
            context.spend(spent)
        else:
            rejections.append((first + processes * len(done), refused))
    if rejections:
        raise Rejected(min(rejections)[1])


def check_share(question, entries, work):
    """What entries prove, in a process of its own; why the first that is rejected is, or None; the
    work that they took.
    """
    context = Context(*question)
    context.work_left = work
    proved: list = []
    refused = None
    try:
        check_in_turn(context, entries, proved)
    except Rejected as why:
        refused = str(why)
    return proved, refused, work - context.work_left
