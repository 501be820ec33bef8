"""Writes an answer as Rocq terms, with proofs that Coq's kernel finds by computing.

    python tests/checker/rocq/compare/kernel.py answer.json Real.v [--samples 1] [--sets 1]
    coqc Real.v

Real.v ends with theorems about this very scene, network and tube: neither extraction nor OCaml nor
the reader stand between them and the kernel, only this translation, which can be read in Real.v.
"""

import argparse
import json
import re
from fractions import Fraction
from pathlib import Path

HEAD = """(* {source} as terms. Each lemma is found true by computing in the kernel (vm_compute). *)
From Coq Require Import Reals QArith List.
Require Import Spec Arithmetic Checker Theorems.
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
    return f"(Part {array(f'{i}%nat' for i in p['points'])} {body(p)})"


def obstacle(o, steps):
    first, last = o.get("steps", [0, steps - 1])
    return f"(Obstacle {polytope(o)} {first} {last})"


def problem(p):
    domain = zip(map(number, p["domain"]["lo"]), map(number, p["domain"]["hi"]), strict=True)
    return (
        f"Problem {p['n_p']} {p['n_q']} {p['n_k']} {p['points']} {p['steps']} "
        f"{array(f'({lo}, {hi})' for lo, hi in domain)} {polytope(p['start'])} "
        f"{polytope(p['goal'])} {array(obstacle(o, p['steps']) for o in p['obstacles'])} "
        f"{array(map(part, p['body']['parts']))}"
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
    return f"Tube {array(map(vector, t['edges']))} {interval} {array(map(error, t['final']))}"


def separation(sep):
    def run(r):
        return f"({r[0]}%nat, {array(f'({i}%nat, {number(m)})' for i, m in r[1])})"

    return array(array(array(map(run, s)) for s in o) for o in sep)


def pattern(digits, network):
    layers, at = [], 0
    for bias in network["biases"][:-1]:
        layers.append(array("true" if c == "1" else "false" for c in digits[at : at + len(bias)]))
        at += len(bias)
    return array(layers)


def computed(name, statement, theorem):
    """A lemma that the kernel computes, and what follows from it."""
    return [
        f"Lemma {name}_ok : {statement} = true. Proof. vm_cast_no_check (eq_refl true). Qed.",
        f"Definition {name}_is_safe := {theorem} _ _ _ [] _ context_is_ok {name}_ok.",
        f"Check {name}_is_safe.",
    ]


def script(answer, source, n_samples, n_sets):
    """The text of Real.v. Hints for the goal are not translated."""
    lines = [
        HEAD.format(source=source),
        f"Definition scene := {problem(answer['problem'])}.",
        f"Definition network : list layer := {network(answer['network'])}.",
        f"Definition tubes := {tube(answer['tube'])}.",
        "Lemma context_is_ok : context_ok scene network tubes = true.",
        "Proof. vm_cast_no_check (eq_refl true). Qed.",
    ]
    for i, s in enumerate(answer["samples"][:n_samples]):
        plan = f"Sample {vector(s['p0'])} {vector(s['k'])} {separation(s['sep'])}"
        lines.append(f"Definition sample{i} := {plan}.")
        lines += computed(
            f"sample{i}", f"check_sample scene network tubes [] sample{i}", "sample_safe"
        )
    for i, s in enumerate(answer["sets"][:n_sets]):
        bits = pattern(s["pattern"], answer["network"])
        piece = f"{vector(s['p0'] + s['k'])} {s['bin']} {bits} {separation(s['sep'])}"
        lines.append(f"Definition piece{i} := Piece {piece}.")
        lines += computed(f"piece{i}", f"check_set scene network tubes [] piece{i}", "set_safe")
    return "\n".join([*lines, "Print Assumptions sample0_is_safe."]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("answer", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--samples", type=int, default=1)
    parser.add_argument("--sets", type=int, default=1)
    arguments = parser.parse_args()
    answer = json.loads(arguments.answer.read_text())
    text = script(answer, arguments.answer.name, arguments.samples, arguments.sets)
    arguments.out.write_text(text)


if __name__ == "__main__":
    main()
