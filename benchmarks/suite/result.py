"""Results as files: a folder for an entry with its answers, and one file with the scores, from
which anybody scores again.
"""

import gzip
import hashlib
import json
from pathlib import Path

from benchmarks.suite.bad import Refused
from benchmarks.suite.instances import Instance
from benchmarks.suite.score import score

FORMAT = "blackbox-suite/1"
SCORES = "scores.json"


def freeze(folder: Path, entry: str, found: dict[str, dict]) -> None:
    """Write what an entry answered; other instances of an earlier run stay."""
    place = folder / "answers" / entry
    place.mkdir(parents=True, exist_ok=True)
    ledger = place / "ledger.json"
    told = json.loads(ledger.read_text()) if ledger.exists() else {}
    for name, one in found.items():
        given = one["answer"]
        told[name] = {key: value for key, value in one.items() if key != "answer"}
        told[name]["sha256"] = hashlib.sha256(given).hexdigest()
        (place / f"{name}.json.gz").write_bytes(gzip.compress(given, mtime=0))
    ledger.write_text(json.dumps(dict(sorted(told.items())), indent=1) + "\n")


def frozen(folder: Path, instance: Instance) -> tuple[dict[str, bytes], dict[str, dict]]:
    """The answers to an instance by entry, and what they took. Raises Refused where an answer is
    not the one that was frozen.
    """
    answers, told = {}, {}
    if not (folder / "answers").is_dir():
        raise Refused(
            f"expected frozen answers in {folder}; run entries with --out {folder} first."
        )
    for place in sorted((folder / "answers").iterdir()):
        ledger = json.loads((place / "ledger.json").read_text())
        if instance.id not in ledger:
            continue
        given = gzip.decompress((place / f"{instance.id}.json.gz").read_bytes())
        if hashlib.sha256(given).hexdigest() != ledger[instance.id]["sha256"]:
            raise Refused(f"{place.name}: the answer to {instance.id} is not that of its ledger.")
        answers[place.name], told[place.name] = given, ledger[instance.id]
    return answers, told


def scored(folder: Path, asked: list[Instance], chance: str, say=lambda line: None) -> dict:
    """Scores of all that is frozen in a folder, merged into its file."""
    path = folder / SCORES
    before = json.loads(path.read_text())["instances"] if path.exists() else {}
    for number, instance in enumerate(asked, 1):
        answers, told = frozen(folder, instance)
        if not answers:
            continue
        say(f"{instance.id} ({number} of {len(asked)}): scoring {', '.join(answers)}")
        found = score(instance, answers, chance)
        for name, one in found["entries"].items():
            why = "; ".join(filter(None, (told[name].get("why"), one.get("why"))))
            one |= {key: told[name][key] for key in told[name] if key != "sha256"} | {"why": why}
        about = {"box": instance.box, "size": instance.size, "trap": instance.trap}
        before[instance.id] = {**about, "chance": chance, **found}
        status = ", ".join(f"{n} {e['status']}" for n, e in found["entries"].items())
        say(f"{instance.id}: {found['truth']['good']} of {found['truth']['plans']}; {status}")
        for name, one in found["entries"].items():
            if one["why"] and not one["points"]:
                say(f"  {name}: {one['why']}")
    report = {"format": FORMAT, "instances": dict(sorted(before.items()))}
    path.write_text(json.dumps(report, indent=1) + "\n")
    return report
