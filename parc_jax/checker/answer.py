"""A whole answer file: reading it, checking all that it claims, saying what was proved."""

import argparse
import collections
import hashlib
import itertools
import json
import math
import os
import sys
from fractions import Fraction

from .claim import checked_claim, told
from .entries import LISTS, canonical, check_entries
from .episode import check_episode, is_episode, summary_of_episode
from .exact import NotAnAnswer, Rejected, decimal, fields, need, rejecting
from .no_plan import check_no_plan
from .plans import Context
from .question import about_open_bins, about_the_model
from .rests_on import part_of, printable

FORMAT = "parc_jax.answer/3"
PARTS = ("problem", "network", "tube")  # of the question
HASHED = (*PARTS, "claim")  # each has a hash
MAX_BYTES = 1 << 26  # of a file
MAX_VALUES = 1 << 22  # commas and opening brackets in a file: what its numbers and lists weigh
MAX_DEPTH = 500  # of values inside of each other
MAX_REMARK = 1 << 20  # characters of what no work is allowed for: meta and claim
DESCRIPTION = "Checks an answer of parc_jax in exact arithmetic."
MAX_PROCESSES = 60  # some systems wait for no more
WORK_AT_LEAST = 4_000_000  # products of short integers, a second or two
WORK_PER_CHARACTER = 1000

# What was proved: how many samples, sets, corridors and boxes of doubt; None, or kind and exact
# volumes of no_plan. Of the bins, how many have a tube without the model's own trajectory, and one
# that stands for no claim. scene: body, obstacles and starts in words; said: what the file says of
# it; moving: obstacles that are there for a while; seconds: of a plan. The claim is quoted;
# arithmetic: of `checked_claim`.
Report = collections.namedtuple(
    "Report",
    "samples sets corridors doubt no_plan scene said moving seconds bins without_model "
    "without_claim claim arithmetic hash",
)


def allowance(*parts):
    """Work that a file made of these parts may ask for. See Context.spend."""
    return allowance_of([canonical(part) for part in parts])


def allowance_of(texts):
    """The same of parts that are spelled already."""
    return WORK_AT_LEAST + WORK_PER_CHARACTER * sum(map(len, texts))


def unique(pairs):
    """An object of JSON, in which no key may appear twice."""
    found = dict(pairs)
    need(len(found) == len(pairs), "a key appears twice")
    return found


def shallow(value):
    """Is nothing in a value nested deeper than MAX_DEPTH?"""
    found = [value]
    for _ in range(MAX_DEPTH + 1):
        outer = [x.values() if type(x) is dict else x for x in found if type(x) in (dict, list)]
        found = list(itertools.chain.from_iterable(outer))
    return not found


def refuse(text):
    """Called for a JSON number that is not whole."""
    raise Rejected(f"the JSON number {text[:40]} is not whole; numbers are strings here")


@rejecting()
def load(path):
    """The content of an answer file. Raises OSError if the file cannot be read, NotAnAnswer if it
    is another kind of file, Rejected if it is not strictly spelled.
    """
    with open(path, "rb") as file:
        data = file.read(MAX_BYTES + 1)
    need(len(data) <= MAX_BYTES, "the file is too large")
    values = data.count(b",") + data.count(b"[") + data.count(b"{")
    need(values <= MAX_VALUES, "the file has too many numbers and lists")
    if data.startswith(b"PK\x03\x04"):
        raise NotAnAnswer("got an archive, as saved models (.npz) are; they hold no certificates")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        raise NotAnAnswer("got a file that is not text") from None
    try:
        return json.loads(text, object_pairs_hook=unique, parse_float=refuse, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise NotAnAnswer(f"got a file that is not JSON ({error})") from None


@rejecting()
def check_answer(answer, processes=1):
    """Checks all that an answer (as `load` returns it) claims; returns a Report or raises
    Rejected. Entries are shared among so many processes.
    """
    if type(answer) is not dict or answer.get("format") != FORMAT:
        what = "an episode" if is_episode(answer) else "JSON without this format"
        raise NotAnAnswer(f"got {what}")
    needed = ("format", *PARTS, "claim", "hash", "samples", "sets", "no_plan")
    fields(answer, needed, ("corridors", "doubt", "meta"))
    need(shallow(answer), "too deep a nesting")
    answer = {"corridors": [], "doubt": [], "meta": None, **answer}
    need(len(canonical(answer["meta"])) <= MAX_REMARK, "the part meta is too long")
    texts = {part: canonical(answer[part]) for part in (*HASHED, *LISTS, "no_plan")}
    hashes = {part: hashlib.sha256(texts[part].encode()).hexdigest() for part in HASHED}
    need(len(texts.pop("claim")) <= MAX_REMARK, "the claim is too long")
    need(answer["hash"] == hashes, "a hash does not match its content")
    context = Context(answer["problem"], answer["network"], answer["tube"])
    domain = context.lo, context.hi
    arithmetic = checked_claim(
        answer["claim"], hashes, context.n_bins, domain, context.dt, answer["corridors"]
    )
    context.work_left = allowance_of(texts.values())
    question = tuple(answer[part] for part in PARTS)
    check_entries(context, question, {part: answer[part] for part in LISTS}, processes)
    volumes = None
    if answer["no_plan"] is not None:
        with rejecting("no_plan: "):
            volumes = check_no_plan(context, answer["no_plan"])
    return Report(
        **{part: len(answer[part]) for part in LISTS},
        no_plan=volumes,
        scene=scene_of(answer["problem"]),
        said=said_of(answer["meta"]),
        moving=sum(last - first + 1 < context.T for _, first, last in context.obstacles),
        seconds=decimal(context.T * context.dt),
        bins=context.n_bins,
        without_model=context.bins_without_model(),
        without_claim=context.bins_without_claim(),
        claim=answer["claim"],
        arithmetic=arithmetic,
        hash=hashes,
    )


def summary(report):
    """What was proved and what it rests on, in lines for a terminal: quotes are escaped."""
    yield "ACCEPTED. Proved in exact arithmetic, for every trajectory inside the tube:"
    if report.samples:
        yield f"  {counted(report.samples, 'sample')} (p0, k): the goal is reached, nothing touched"
    if report.sets:
        yield f"  {counted(report.sets, 'polytope')} of (p0, k): so at every point (borders between"
        yield "    bins of k are no part of it)"
    if report.corridors:
        yield f"  {counted(report.corridors, 'corridor')}: so does every (p0, k) of the domain that"
        yield "    meets all conditions of one (at a border between bins with the errors of each)"
    if report.doubt:
        boxes = counted(report.doubt, "box", "boxes")
        yield f"  {boxes} of doubt: so does every (p0, k) within the room of one"
    if report.no_plan is not None and report.no_plan["kind"] == "proved":
        yield "  no (p0, k) of the model is safe for them all: a longer search cannot find one"
    elif report.no_plan is not None:
        names = ("safe", "unsafe", "undecided")
        sizes = [Fraction(report.no_plan[name]) for name in names]
        listed = ", ".join(
            f"{name} {percent(size / sum(sizes), up=name == 'undecided')}"
            for name, size in zip(names, sizes, strict=True)
        )
        yield "  of the (p0, k) whose first point ends in the file's box z, whatever else"
        yield f"    the goal asks, by volume: {listed}"
    if not any([*(getattr(report, part) for part in LISTS), report.no_plan]):
        yield "  nothing: the file holds no plan, and no proof of none"
    yield f"It is of {report.scene}."
    for text in report.said:
        yield f"  The file says of it, unchecked: {text}"
    if report.no_plan is None or report.no_plan["kind"] != "proved":
        yield f"NOT PROVED: anything later than the {report.seconds} s of a plan"
    if report.moving:
        yield f"NOT PROVED: {counted(report.moving, 'obstacle')} told of by intervals: nothing is"
        yield "  said of them at other times"
    yield about_the_model(report)
    yield from about_open_bins(report)
    yield from told(report.claim, report.arithmetic, report.hash)


def scene_of(problem, starts="any p0"):
    """Body, obstacles and starts of a problem that was read, in words. starts: where none is."""
    parts = printable("; ".join(part_of(part, 1) for part in problem["body"]["parts"]))
    rows = problem["start"] and len(problem["start"]["b"])
    where = f"from p0 within {counted(rows, 'half-space')}" if rows else f"from {starts}"
    among = counted(len(problem["obstacles"]), "convex obstacle")
    return f"a body ({parts}) among {among}, {where}"


def said_of(meta):
    """Sentences that the remark of a file says its scene rests on: no verdict depends on them."""
    texts = meta.get("rests_on") if type(meta) is dict else None
    return [printable(t) for t in texts if type(t) is str] if type(texts) is list else []


def percent(share, up):
    """An exact share to a thousandth of a percent: never above it if proved, else never below."""
    thousandths = math.ceil(10**5 * share) if up else math.floor(10**5 * share)
    return f"{thousandths // 1000}.{thousandths % 1000:03d} %"


def counted(n, one, many=None):
    """So many, in English."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def main(arguments=None):
    """Command line. Returns 0 for an accepted file, 1 for a rejected one, 2 if there is none, 130
    when it is stopped.
    """
    try:
        asked = command_line().parse_args(arguments)
    except SystemExit as told:
        return told.code
    try:
        file = load(asked.answer)
        if is_episode(file):
            report = check_episode(file, allowance_of)
            lines = list(summary_of_episode(report))
            exact = {name: str(getattr(report, name)) for name in ("begin", "end")}
            report = report._replace(**exact, moves=list(map(str, report.moves)))
        else:
            report = check_answer(file, asked.processes)
            lines = list(summary(report))
        result = {"accepted": True, **report._asdict()}
        code = 0
    except NotAnAnswer as why:
        return unreadable(asked.answer, why)
    except OSError as error:
        return unreadable(asked.answer, f"it cannot be read ({error.strerror})")
    except Rejected as why:
        result = {"accepted": False, "reason": str(why)}
        lines = [f"REJECTED: {ascii(str(why))[1:-1]}"]
        code = 1
    except KeyboardInterrupt:
        print("stopped.", file=sys.stderr)
        return 130
    tell(json.dumps(result, indent=1) if asked.json else "\n".join(lines))
    return code


def command_line():
    """What may be asked for."""
    parser = argparse.ArgumentParser("checker", allow_abbrev=False, description=DESCRIPTION)
    parser.add_argument("answer", help="the answer file")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument(
        "--processes", type=count, default=1, metavar="N", help="share the entries among so many"
    )
    return parser


def count(text):
    """A number of processes."""
    n = int(text)
    if not 1 <= n <= MAX_PROCESSES:
        raise argparse.ArgumentTypeError(f"expected a number from 1 to {MAX_PROCESSES}")
    return n


def unreadable(path, why):
    """Says that there is no answer to check; the exit code."""
    expected = f"expected an answer file (JSON of format {FORMAT}, from `Answer.save` or `solve`)"
    print(f"{ascii(path)[1:-1]}: {expected}; {ascii(str(why))[1:-1]}.", file=sys.stderr)
    return 2


def tell(text):
    """Prints; a reader who has seen enough, as `head` does, ends it quietly."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
