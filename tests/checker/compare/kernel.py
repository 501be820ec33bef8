"""Writes an answer as Rocq terms, with proofs that Coq's kernel finds by computing.

    python tests/checker/compare/kernel.py answer.json Real.v [--entries 1]
    coqc Real.v

Real.v ends with `meaning` of an answer of these entries. Neither extraction nor OCaml nor the
reader stand between them and the kernel, only this translation, which can be read in Real.v. It was
written from docs/certificates.md and not from the reader; two_readers.py compares the two.
"""

import argparse
import json
import re
from fractions import Fraction
from pathlib import Path

HEAD = """(* {source} as terms. Each lemma is found true by computing in the kernel (vm_compute). *)
From Coq Require Import Reals QArith List.
From ParcJax Require Import Spec Arithmetic Checker Polytopes Doubt NoPlan Answer.
From ParcJax Require Import Theorems Statements.
Import ListNotations.
Open Scope Z_scope.
"""


def fraction(text):
    if found := re.fullmatch(r"(-?)0x([0-9a-f]+)(?:\.([0-9a-f]*))?p([+-]?[0-9]+)", text):
        sign, whole, rest, power = found.groups("")
        return int(sign + whole + rest, 16) * Fraction(2) ** (int(power) - 4 * len(rest))
    return Fraction(text)


def number(text):
    value = fraction(text)
    return f"(Qmake ({value.numerator}) {value.denominator})"


def nat(i):
    return f"{i}%nat"


def array(items):
    return "[" + "; ".join(items) + "]"


def vector(v):
    return array(map(number, v))


def rows(A, b):
    return array(f"({vector(a)}, {number(c)})" for a, c in zip(A, b, strict=True))


def polytope(p):
    return "[]" if p is None else rows(p["A"], p["b"])


def body(b):
    shape = f"(Disc {number(b['radius'])})" if "radius" in b else None
    return shape or f"(Hull {array(map(vector, b['vertices']))})"


def part(p):
    return f"(Part {array(map(nat, p['points']))} {body(p)})"


def obstacle(o, steps):
    first, last = o.get("steps", [0, steps - 1])
    return f"(Obstacle {polytope(o)} {nat(first)} {nat(last)})"


def box(lo, hi):
    return array(f"({a}, {b})" for a, b in zip(map(number, lo), map(number, hi), strict=True))


def problem(p):
    sizes = " ".join(nat(p[name]) for name in ("n_p", "n_q", "n_k", "points", "steps"))
    return (
        f"(Problem {sizes} {box(**p['domain'])} {polytope(p['start'])} "
        f"{polytope(p['goal'])} {array(obstacle(o, p['steps']) for o in p['obstacles'])} "
        f"{array(map(part, p['body']['parts']))})"
    )


def network(n):
    layers = zip(n["weights"], n["biases"], strict=True)
    return array(rows(W, b) for W, b in layers)


def error(e):
    return f"(Rows {polytope(e)})" if isinstance(e, dict) else f"(Widths {vector(e)})"


def tube(t):
    def step(s):
        return array(map(error, s))

    interval = array(array(map(step, b)) for b in t["interval"])
    return f"(Tube {array(map(vector, t['edges']))} {interval} {array(map(error, t['final']))})"


def multipliers(some):
    return array(f"({nat(i)}, {number(m)})" for i, m in some)


def hints(t):
    ways = [end["goal"] if isinstance(end, dict) else [] for end in t["final"]]
    return array(array(array(map(multipliers, row)) for row in of_bin) for of_bin in ways)


def separation(sep):
    def run(r):
        return f"({nat(r[0])}, {multipliers(r[1])})"

    return array(array(array(map(run, s)) for s in o) for o in sep)


def pattern(digits, network):
    layers, at = [], 0
    for bias in network["biases"][:-1]:
        layers.append(array("true" if c == "1" else "false" for c in digits[at : at + len(bias)]))
        at += len(bias)
    return array(layers)


def sample(s):
    return f"(Sample {vector(s['p0'])} {vector(s['k'])} {separation(s['sep'])})"


def piece(s, network):
    bits = pattern(s["pattern"], network)
    return f"(Piece {vector(s['p0'] + s['k'])} {nat(s['bin'])} {bits} {separation(s['sep'])})"


def boxed(s):
    middle = list(map(fraction, s["k"]))
    half = list(map(fraction, s["room"]["k"]))
    lo = [str(k - e) for k, e in zip(middle, half, strict=True)]
    hi = [str(k + e) for k, e in zip(middle, half, strict=True)]
    sizes = f"{vector(s['p0'])} {vector(s['room']['p0'])} {box(lo, hi)}"
    return f"(Boxed {sizes} {separation(s['sep'])})"


def use(entry):
    row, m, *named = entry
    shrink = f"(Some {vector(named[0])})" if named else "None"
    return f"(Use {nat(row)} {number(m)} {shrink})"


def hit(entry):
    whom, which, step, share, groups = entry

    def contact(c):
        return f"(Contact {vector(c[0])} {array(map(vector, c[1]))})"

    def group(g):
        return f"(Group {vector(g[0])} {array(map(contact, g[1]))})"

    place = " ".join(map(nat, (whom, which, step)))
    return f"(Hit {place} {number(share)} {array(map(group, groups))})"


def reason(node):
    ((name, what),) = node.items()
    return {
        "goal": lambda: f"(Misses {array(map(use, what))})",
        "start": lambda: f"(Elsewhere {multipliers(what)})",
        "hit": lambda: f"(Hits {hit(what)})",
        "safe": lambda: f"(Safe {separation(what)})",
        "open": lambda: "Open",
        "bounded": lambda: f"(Bounded {reason(what)})",
    }[name]()


def tree(nodes):
    """Of the nodes that begin a flat list, the first tree; takes them from it."""
    node = nodes.pop(0)
    if "split" not in node:
        return f"(Leaf {reason(node)})"
    axis, at = node["split"]
    lower = tree(nodes)
    return f"(Split {nat(axis)} {number(at)} {lower} {tree(nodes)})"


def absence(plan):
    if plan is None:
        return "Unclaimed"
    faces = array(f"({array(map(use, a))}, {array(map(use, b))})" for a, b in plan["faces"])
    kind = {"proved": "Proved", "bracket": "Bracket"}[plan["kind"]]
    return f"({kind} (Proof {box(**plan['z'])} {faces} {tree(list(plan['tree']))}))"


def tried(translate, part):
    """The term of a part, None where it is none."""
    try:
        return translate(part)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None


def entries(translate, some):
    """The terms of entries, as options."""
    found = [tried(translate, entry) for entry in some]
    return ["None" if term is None else f"(Some {term})" for term in found]


def terms(answer):
    """The record `answer` of Answer.v: {field: term}, of entries a list of terms."""

    def set_of_plans(s):
        return piece(s, answer["network"])

    return {
        "scene": problem(answer["problem"]),
        "net": network(answer["network"]),
        "around": tube(answer["tube"]),
        "hints": hints(answer["tube"]),
        "samples": entries(sample, answer["samples"]),
        "sets": entries(set_of_plans, answer["sets"]),
        "corridors": entries(sample, answer.get("corridors", [])),
        "doubts": entries(boxed, answer.get("doubt", [])),
        "absent": tried(absence, answer["no_plan"]) or "Unread",
    }


WHOLE = """Definition whole :=
  Answer scene net around hints {samples} {sets} {corridors} {doubts} absent.
Definition accepts v := match v with Accepted _ _ => true | _ => false end.
Lemma whole_ok : accepts (check_answer whole) = true.
Proof. vm_cast_no_check (eq_refl true). Qed.
Lemma accepts_it v : accepts v = true -> exists marks r, v = Accepted marks r.
Proof. destruct v; try discriminate. eauto. Qed.
Theorem whole_is_true : exists r, meaning whole r.
Proof.
  destruct (accepts_it _ whole_ok) as (marks & r & H). exists r. exact (accepted whole marks r H).
Qed.
Check whole_is_true.
Print Assumptions whole_is_true.
"""


def script(answer, source, most):
    """The text of Real.v, with so many entries of each kind at most."""
    made = terms(answer)
    lines = [HEAD.format(source=source)]
    types = {"scene": "problem", "net": "list layer", "around": "tube", "hints": "list goal_hints"}
    types |= {"absent": "absence"}
    lines += [f"Definition {name} : {kind} := {made[name]}." for name, kind in types.items()]
    some = {kind: array(made[kind][:most]) for kind in ("samples", "sets", "corridors", "doubts")}
    return "\n".join([*lines, WHOLE.format(**some)])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("answer", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--entries", type=int, default=1, help="of each kind at most")
    arguments = parser.parse_args()
    answer = json.loads(arguments.answer.read_text())
    text = script(answer, arguments.answer.name, arguments.entries)
    arguments.out.write_text(text)


if __name__ == "__main__":
    main()
