"""Freshness of a calibration set: independent runs, none of them twice, none of training."""

from collections import Counter
from collections.abc import Iterable, Iterator, Set
from functools import reduce
from itertools import islice
from operator import or_

import numpy as np

from parc_jax.checker.entries import hash_of
from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import hex_floats, hex_text
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.measure import Scores
from parc_jax.learning.runs.batch import RolloutBatch, require_failed
from parc_jax.learning.runs.groups import NAMED
from parc_jax.learning.runs.independent import (
    LEVEL,
    REPEATS,
    Marks,
    check_uniform,
    marks_by_k,
    marks_of,
    near_copies,
    repeated,
)
from parc_jax.learning.runs.joined import joined_source
from parc_jax.learning.runs.law import STATED, TO_ALL

# in evidence, and uses of runs there; a monitor asks for the first two
SEEN, TRAINING, SHAPE, CALIBRATION = "seen", "training", "profile", "calibration"
MARKED = 128  # runs of an entry of a ledger, by which copies of all or much of it are recognised
_NEAR = f"k within {TOLERANCES.near_k:g} of its range, p {TOLERANCES.near_p:g} of its length, "
_NEAR += "each of q as much of its largest"
_NAME = "Name them (groups of texts: `groups` of an .npz, names in groups.csv), or load all runs "
_NAME += "together and split: batch.split(share)."


def check_fresh(scores: Scores, train: RolloutBatch | None) -> None:
    """Refuse repeated runs, near copies, runs of the training data, missing rows of a seed, k that
    are not uniform where the law says so, and a K fitted to these very runs. Raises InputError.
    """
    if scores.law.fitted == TO_ALL:
        raise InputError(
            "holdout: expected a K that these runs had no part in; it is the smallest box of their "
            "k. Declare it (domain=), split the runs, or pass the training runs to bound_error."
        )
    ids = scores.ids[~_stand(scores)]
    if copies := len(ids) - len(np.unique(ids)):
        raise InputError(
            f"holdout: {copies} of {len(scores.ids)} runs occur twice; remove the copies."
        )
    require_failed("holdout", scores.law)
    if scores.law.k_law == "uniform":
        # the law of a seed is that of the program itself: refuse hardly ever by chance
        level = LEVEL if scores.seed is None else REPEATS
        check_uniform("holdout", scores.k, scores.subject.domain, scores.groups, level=level)
    if scores.seed is None:  # the rows of a seed are independent by construction
        pairs = near_copies(scores.marks, None, 2 * scores.subject.domain.radius)
        if scores.groups is not None:
            one, other = scores.groups[pairs].T
            pairs = pairs[(one != other) & ~_stand(scores)[pairs[:, 0]]]
        if len(pairs):
            first, second = scores.rows[pairs[0]]
            raise InputError(
                f"holdout: expected independent runs; rows {first} and {second} are copies of each "
                f"other ({_NEAR}), at least {len(pairs):,} pairs in all. Parts of one "
                "recording belong to one group (groups=); remove other copies."
            )
    elif gaps := left_out(scores, train, between=True):
        raise InputError(
            f"holdout: expected all rows from {scores.rows.min():,} to {scores.rows.max():,} of "
            f"their seed; {gaps:,} are missing. A failed run counts as one that "
            "leaves the tube: pass runs as they were collected, split before any is left out."
        )
    if train is not None:
        _check_unseen(scores, train)


def left_out(scores: Scores, train: RolloutBatch | None, between: bool = False) -> int:
    """Number of rows of the source of calibration runs that are neither in these nor in training
    runs. between: only those between first and last of these, beyond which a seed has no end.
    """
    # such rows were left out of the runs, as failed ones are by `finite`
    both = [scores, train] if train is not None and _one_log(scores, train) else [scores]
    rows = np.concatenate([one.rows for one in both])
    _, first, last = joined_source(both)
    first, last = (rows.min(), rows.max()) if between else (first, last)
    return int(last - first) + 1 - len(np.unique(rows))


def left_out_beside(claim: ErrorClaim, runs: RolloutBatch) -> int:
    """Number of rows of the log of these runs that neither they have nor the training of a claim,
    nor its calibration set. Where some of either are in a file, all others of it were left out.
    """
    gone, ids, told = left_out(runs, None), short_ids(runs.hashes()), set[str]()
    for part in (claim.evidence.get("training", {}), claim.evidence):
        rest = iter(part.get("runs", []))
        for log, n in _logs(part):
            known, one_log = set(islice(rest, n)) - told, log == _log(runs)
            told |= known  # an update trains on runs of before, too
            met = len(known.intersection(ids))
            if one_log and not met:
                gone -= len(known)
            elif met and not one_log:  # of its own log the others are missing above
                gone += len(known) - met
    return gone


def identity_of(runs: RolloutBatch | Scores) -> str:
    """Hash of runs of a log, in any order: of all that a sentence about them rests on."""
    ids = runs.ids if isinstance(runs, Scores) else runs.hashes()
    lost = np.zeros(len(ids), int) if runs.lost is None else runs.lost
    about = [one for one in (ids, runs.rows, lost, runs.groups) if one is not None]
    order, source = np.argsort(ids), [runs.law.hash, *map(str, joined_source([runs]))]
    return hash_of([source, *(np.asarray(one)[order].astype(str).tolist() for one in about)])


def trained_on(train: RolloutBatch | None, scores: Scores) -> dict:
    """Evidence of training runs beside calibration runs."""
    if train is None:
        return {}
    told = {"train": content_hash(train.k, train.q), SEEN: [entry_of(TRAINING, train)]}
    return told | ({"training": names_of(train)} if None in (train.seed, scores.seed) else {})


def entry_of(use: str, runs: RolloutBatch) -> list:
    """An entry of `ledger_of`: use, generator, seed and stage, first and last row of each part
    without a gap, and `marks_in`; of a log None, None, and its runs by content.
    """
    ids, marks = runs.hashes(), marks_in(runs.k, runs.hashes())
    if runs.seed is None:
        return [use, runs.law.generator, None, None, sorted(short_ids(ids)), marks]
    rows = np.sort(runs.rows)
    parts = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    ends = [[int(part[0]), int(part[-1])] for part in parts]
    return [use, runs.law.generator, list(runs.seed), runs.stage, ends, marks]


def marks_in(k: np.ndarray, hashes: np.ndarray) -> list[str]:
    """Marks by k, each with the content behind it, of MARKED of some runs: the least ones."""
    return sorted(map(str.__add__, marks_by_k(k), short_ids(hashes)))[:MARKED]


def noted(ledger: list, use: str, batches: Iterable[RolloutBatch]) -> Iterator[RolloutBatch]:
    """The batches as they come, each of them entered into a ledger."""
    for batch in batches:
        new = entry_of(use, batch)
        if ledger and ledger[-1][:4] == new[:4]:  # chunks of one source are one entry
            *_, rows, marks = ledger.pop()
            new[4:] = rows + new[4], sorted(marks + new[5])[:MARKED]
        ledger.append(new)
        yield batch


def ledger_of(claim: ErrorClaim) -> list[list]:
    """All runs that claim, network and error shape were made from and name: as of `entry_of`."""
    known = claim.evidence
    entries = [*known.get(SEEN, [])]
    if "holdout_rows" in known:
        rows = known["runs"] if known["seed"] is None else [known["holdout_rows"]]
        source = claim.law.generator, known["seed"], known["stage"]
        entries.append([CALIBRATION, *source, rows, known.get("marks", [])])
    return [entry if len(entry) > 5 else [*entry, []] for entry in entries]  # some have no marks


def used_by(claim: ErrorClaim, runs: RolloutBatch) -> np.ndarray:
    """(n,) text: the use that was made of each run, of one that it copies, in its `ledger_of`, or
    of its recording, by name; "" of a fresh one.
    """
    uses, ids = np.full(runs.n, "", "U20"), short_ids(runs.hashes())
    for use in (CALIBRATION, TRAINING):  # all that some files tell
        uses[_met(claim, use, runs)] = use
    for use, *source, rows, marks in ledger_of(claim):
        by_k, contents = [mark[:12] for mark in marks], [mark[12:] for mark in marks]
        old = np.isin(ids, contents) | repeated(runs, by_k)
        if source[1] is None:
            old |= np.isin(ids, rows)
        elif runs.seed is not None and source == [runs.name, list(runs.seed), runs.stage]:
            first, last = np.array(rows).T
            part = np.searchsorted(first, runs.rows, side="right") - 1
            old |= (part >= 0) & (runs.rows <= last[part])
        uses[old & ~_stand(runs)] = use
    return uses


def _met(claim: ErrorClaim, use: str, runs: RolloutBatch) -> np.ndarray:
    """(n,) bool: runs of a use in files, by content, by k and end, or by name of the recording."""
    told = claim.evidence.get(use, {})
    met = np.isin(short_ids(runs.hashes()), told.get("runs", []))
    if told.get("ends"):
        ends = np.split(np.array(hex_floats(told["ends"])), [runs.n_k, runs.n_k + runs.n_c], axis=1)
        ours = Marks(runs.k, runs.p[:, -1].astype(float), runs.q)
        met[near_copies(ours, Marks(*ends), 2 * claim.domain.radius)[:, 0]] = True
    names = [name for name in map(int, told.get("recordings", [])) if name >= NAMED]
    return met if runs.groups is None else met & ~_stand(runs) | np.isin(runs.groups, names)


def not_named(claim: ErrorClaim, logs: bool, met: Set[str] = frozenset()) -> list[str]:
    """What is assumed of other runs, which no test could tell: that they are none of a use that its
    ledger does not tell of, as a file of a network alone tells of none. logs: whether others, or
    some, are of a log; then, or where the claim's are, also no copies of those beside marked ones.
    met: uses of which it need not be assumed.
    """
    ledger = ledger_of(claim)
    in_files = [entry for entry in ledger if entry[4] and (logs or entry[2] is None)]
    known, bare = {entry[0] for entry in ledger}, {x[0] for x in in_files if not x[5]}
    kept = {x: claim.evidence.get(x, {}) for x in (TRAINING, CALIBRATION)}
    held = sum(len(x[4]) for x in in_files if x[0] == CALIBRATION and x[2] is None)
    older = {CALIBRATION} if held > len(kept[CALIBRATION].get("ends", [])) else set()
    named = {x for x, told in kept.items() if told.get("runs") or told.get("ends")} - older
    marked = f" beside {MARKED} of each part of these, compared by content and by uniform k"
    uses = {
        ", whose network does not say what it was trained on": {TRAINING, SHAPE} - known,
        "": bare,
        marked: {entry[0] for entry in in_files} - bare,
        ", nor a part of its recording by another name or number": named if logs else (),
        ", nor a part of its recording, of which it keeps no name": older if logs else (),
    }
    said = ((" or ".join(sorted({*use} - met)), more) for more, use in uses.items())
    return [f"none is a {use} run of the claim{more}" for use, more in said if use]


def named_runs(scores: Scores) -> dict[str, list]:
    """Runs of a log by content, and the log, as stored in evidence; of both and of seeds marks."""
    marks = {"marks": marks_in(scores.k, scores.ids)}
    if scores.seed is not None:
        return marks
    told = names_of(scores)
    known = {name: told.pop(name) for name in ("recordings", "ends")}
    return marks | told | {"held": identity_of(scores), CALIBRATION: known}


def short_ids(hashes: np.ndarray) -> list[str]:
    """The first 48 bits of content hashes, as stored in evidence of recorded runs."""
    return [text.decode()[:12] for text in hashes.tolist()]


def names_of(runs: RolloutBatch | Scores) -> dict[str, list]:
    """The runs of a log by content, k and end, its recordings by name, and the log itself, as
    stored in evidence; nothing of runs of a seed.
    """
    if runs.seed is not None:
        return {"runs": [], "recordings": [], "ends": [], "log": []}
    scored = isinstance(runs, Scores)
    ids, marks = (runs.ids, runs.marks) if scored else (runs.hashes(), marks_of(runs))
    k, p, q = (x[np.unique(ids, return_index=True)[1]] for x in marks)  # a run twice has one end
    groups = [] if runs.groups is None else np.unique(runs.groups).astype(str).tolist()
    ends, log = hex_text(np.hstack([k, p[:, -1], q])), _log(runs)
    return {"runs": sorted(short_ids(ids)), "recordings": groups, "ends": ends, "log": log}


def remembered(claim: ErrorClaim, new: ErrorClaim) -> dict:
    """Evidence of all that a claim and its update saw: the network may be the old one."""
    seen: dict = {SEEN: [*ledger_of(claim), *new.evidence[SEEN]]}
    for use in (TRAINING, CALIBRATION):
        before, after = (one.evidence.get(use, {}) for one in (claim, new))
        both = {x: [*before.get(x, []), *after.get(x, [])] for x in ("runs", "recordings", "ends")}
        if use == TRAINING:  # an update may train on runs of before again
            ends = (Counter(map(tuple, one.get("ends", []))) for one in (before, after))
            both["ends"] = list(map(list, reduce(or_, ends).elements()))
        both = before | after | both | {"logs": [*_logs(before), *_logs(after)]}
        seen |= {use: both} if before or after else {}
    return seen


def _logs(named: dict) -> list[list]:
    """Logs of runs in evidence, as they come, and how many are of each."""
    return named.get("logs", [[named.get("log"), len(named.get("runs", []))]])


def seen_in_training(claim: ErrorClaim, runs: RolloutBatch) -> np.ndarray:
    """(n,) bool: runs of a log that training has seen, of those that the claim records, their
    copies, and parts of the same recordings. Raises InputError where these cannot be told.
    """
    trained, seen = claim.evidence.get(TRAINING, {}), _met(claim, TRAINING, runs)
    if trained.get("recordings"):
        names = np.array(trained["recordings"], np.int64)
        groups = np.zeros(0, np.int64) if runs.groups is None else runs.groups
        kinds = [set((some >= NAMED).tolist()) for some in (names, groups)]
        one_log = _log(runs)[1] and trained.get("log") == _log(runs) and kinds[0] & kinds[1]
        if not (kinds == [{True}, {True}] or one_log):
            raise InputError(
                "validate: expected recordings that can be told from those of training; in "
                f"{runs.name} or in training they have numbers, or none. {_NAME}"
            )
        seen |= np.isin(groups, names)
    return seen


def _log(runs: RolloutBatch | Scores) -> list[str]:
    """Name and content of the log of runs."""
    return [runs.law.generator, joined_source([runs])[0]]


def _check_unseen(scores: Scores, train: RolloutBatch) -> None:
    """Refuse runs of the holdout that are training runs, parts of the same recordings, or told in
    other coordinates. Raises InputError.
    """
    # training may be of another robot, as of a simulator: the claim is about these runs alone
    where = f"holdout: runs of {scores.law.generator} and those of training"
    scores.subject.agree(where, train.subject, ("K", *STATED))
    if scores.seed is None and train.given:  # a log does not drop what is measured, by silence
        scores.subject.agree(where, train.subject, ("K", *STATED[:-1]))
    seen = np.isin(scores.ids, train.hashes())
    if scores.seed is not None and (scores.seed, scores.stage) == (train.seed, train.stage):
        seen |= np.isin(scores.rows, train.rows)
    if scores.seed is None or train.seed is None:
        seen |= repeated(scores, marks_by_k(train.k))
        if scores.marks is not None:
            width = 2 * scores.subject.domain.radius
            seen[near_copies(scores.marks, marks_of(train), width)[:, 0]] = True
        seen &= ~_stand(scores)  # their recordings are compared below
    if seen.any():
        raise InputError(
            f"holdout: {'at least ' * (not seen.all())}{seen.sum()} of {len(seen)} runs are "
            f"training runs or copies of them ({_NEAR}), the first is row "
            f"{scores.rows[seen][0]}; expected fresh ones. Draw from stage BOUND, or set "
            "recordings aside before training."
        )
    if scores.groups is None or train.groups is None:
        return
    shared = np.isin(scores.groups, train.groups)
    # names, unlike numbers, mean the same recording in every file
    named = min(int(scores.groups.min()), int(train.groups.min())) >= NAMED
    if not (named or _one_log(scores, train)):
        raise InputError(
            f"holdout: expected recordings that can be told from those of training; in "
            f"{scores.law.generator} or {train.law.generator} they have numbers, which two files "
            f"may give to the same recording or to others. {_NAME}"
        )
    if shared.any():
        raise InputError(
            f"holdout: {int(shared.sum())} of {len(shared)} runs belong to recordings of which "
            f"training has seen a part, the first is row {scores.rows[np.argmax(shared)]}. Names "
            "that differ in case or spaces alone are one. Split by group: batch.split(share)."
        )


def freshness(scores: Scores, train: RolloutBatch | None) -> tuple[str, ...]:
    """Assumptions on freshness beyond the tests of `check_fresh`."""
    if scores.seed is not None:
        return ()
    if train is None:
        return ("FRESH(there were no training runs to compare with)",)
    said = f"copies {'of runs that stand, and ' * any(_stand(scores))}other than with {_NEAR},"
    if train.seed is None and (scores.groups is None or train.groups is None):
        said = f"other windows of recordings that training saw, or {said}"
    elif train.seed is None:
        said += " or parts of its recordings by another name or number,"
    return (f"FRESH({said} would not be recognised)",)


def _stand(runs: RolloutBatch | Scores) -> np.ndarray:
    """(n,) bool: runs that stand, of recordings. Those of any two are alike, and no copies."""
    if runs.groups is None or runs.seed is not None:
        return np.zeros(runs.n, bool)
    marks = runs.marks if isinstance(runs, Scores) else marks_of(runs)
    return ~(marks.p.any(axis=(1, 2)) | marks.q.any(axis=1) | marks.k.any(axis=1))


def _one_log(scores: Scores, train: RolloutBatch) -> bool:
    """Whether these are disjoint rows of one source; two files of one name share rows."""
    of = [(x.law.generator, x.seed, x.stage, joined_source([x])[0]) for x in (scores, train)]
    return of[0] == of[1] and not np.isin(scores.rows, train.rows).any()
