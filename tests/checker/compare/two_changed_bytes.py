"""Files with changed bytes outside of the hashed parts: both checkers must refuse, or accept, the
same.
"""

import json

import answer_files as build
import two

KINDS = build.KINDS
ODD_BYTES = [bytes([b]) for b in b'{}[]",:0123456789-+.eEpx/\\u ntf\x00\n\xff\xc3']
SLOTS = ("samples", "sets", "corridors", "no_plan", "claim", "format", "hash")
judge = two.by_file


def batch(rng, left, valid):
    """Files of one answer with up to two bytes changed, doubled or left out."""
    answer = {**valid, "meta": {"note": "ignored"}, "no_plan": None}
    for kind in KINDS:
        answer[kind] = answer[kind][:2]
    hashed = json.dumps({part: answer[part] for part in ("problem", "network", "tube")})[1:-1]
    rest = json.dumps({key: value for key, value in answer.items() if key in (*SLOTS, "meta")})
    for number in range(left):
        text = bytearray(rest[:-1].encode())
        for _ in range(rng.choice([0, 1, 1, 2])):
            at = rng.randrange(len(text))
            text[at : at + rng.randint(0, 1)] = rng.choice(ODD_BYTES) * rng.randint(0, 2)
        yield number, bytes(text) + b", " + hashed.encode() + b"}"
