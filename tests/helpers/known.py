"""Hand-made scenes with known answers, and a bad certificate for every check of the checker.

The plain scene: T = 2, k in [-1, 1], h = max(k, 0), c_1 = (1, h), c_2 = (2, 2h). The plan p0 = (0,
0), k = 1/2 visits (0, 0), (1, 0.5), (2, 1). The obstacle's top is y = -1; disc 1/2 and tube 1/4
leave it 1/4 of room, at knot 0.
"""

import copy
import hashlib
import json
import math
import re

import answer_files as build

TOP = [[1, "1"]]  # the upper y face of an obstacle made by build.box_rows
ABOVE = [[[[2, TOP]]]]  # separation by that face throughout
ZERO = [["0", "0"], ["0", "0"]]  # body point and error of a contact of the reference point
REST = {"open": None}


def plain(obstacle=((0.5, -3), (1.5, -1))):
    """The plain scene with one sample and one set."""
    problem = {
        "n_p": 2,
        "points": 1,
        "n_q": 0,
        "n_k": 1,
        "steps": 2,
        "dt": "0.05",
        "domain": {"lo": ["-1"], "hi": ["1"]},
    }
    problem |= {"goal": build.box_rows((1, -1), (3, 3)), "start": build.box_rows((-1, -1), (1, 1))}
    problem |= {"obstacles": [build.box_rows(*obstacle)], "body": build.one_part({"radius": "0.5"})}
    network = {
        "weights": [[["1"]], [["0"], ["1"], ["0"], ["2"]]],
        "biases": [["0"], ["1", "0", "2", "0"]],
    }
    quarter = ["0x1p-2", "1/4"]
    tube = {"edges": [["-1", "0", "1"]], "interval": [[[quarter]] * 2] * 2, "final": [quarter] * 2}
    sample = {"p0": ["0", "0"], "k": ["0.5"], "sep": ABOVE}
    return build.answer(problem, network, tube, [sample], [{**sample, "bin": 1, "pattern": "1"}])


def corridor():
    """The plain scene with the sample's directions as a corridor, and nothing else."""
    answer = plain()
    return build.only(answer, "corridors", *answer["samples"])


def line():
    """One axis, one interval, no hidden neuron, nothing to hit: c_1 = k."""
    problem = {
        "n_p": 1,
        "points": 1,
        "n_q": 0,
        "n_k": 1,
        "steps": 1,
        "dt": "1",
        "domain": {"lo": ["-1"], "hi": ["1"]},
    }
    problem |= {
        "goal": build.box_rows((-9,), (9,)),
        "start": None,
        "obstacles": [],
        "body": build.one_part({"radius": "0"}),
    }
    tube = {"edges": [["-1", "1"]], "interval": [[[["0"]]]], "final": [["0"]]}
    network = {"weights": [[["1"]]], "biases": [["0"]]}
    return build.answer(problem, network, tube, [{"p0": ["0"], "k": ["0"], "sep": []}])


def tree(node):
    """Flat list of a nested tree: (axis, at, lower, upper) or a leaf."""
    if isinstance(node, dict):
        return [node]
    axis, at, lower, upper = node
    return [{"split": [axis, at]}, *tree(lower), *tree(upper)]


def faces(n):
    """Proof of a box of z by a goal made by build.box_rows, without q."""
    return [[[[n + i, "1"]], [[i, "1"]]] for i in range(n)]


def with_plan(answer, kind, lo, hi, nodes):
    """The answer with a no_plan part only."""
    plan = {"kind": kind, "z": {"lo": lo, "hi": hi}, "faces": faces(len(lo)), "tree": tree(nodes)}
    return json.loads(json.dumps({**answer, "samples": [], "sets": [], "no_plan": plan}))


def hit(*contacts, o=0, t=1, alpha="1"):
    """A hit by the reference point: contacts are pairs of a body point and an error."""
    some = [[body, [error]] for body, error in contacts]
    return {"hit": [o, 0, t, alpha, [[["1"], some]]]}


def proof(obstacle, nodes):
    """The plain scene's proof that there is no plan; an admissible z is in [1.25, 2.75] x [-0.75,
    2.75].
    """
    return with_plan(plain(obstacle), "proved", ["1.25", "-0.75"], ["2.75", "2.75"], nodes)


def blocked():
    """An obstacle that covers the end of every admissible plan."""
    return proof(((1, -1), (3, 3)), hit(ZERO))


def bracket():
    """Each kind of leaf once. k <= 0 is the straight path with h = 0; z_y reaches 3.5, where the
    goal is missed.
    """
    down = hit([["0", "-0.5"], ["0", "0"]], t=0)
    low = (0, "1.5", REST, (0, "2.5", down, REST))
    high = (1, "-0.125", REST, (1, "0.875", {"safe": ABOVE}, (1, "1.75", REST, {"start": TOP})))
    nodes = (1, "2.875", (2, "0", (1, "-0.5", low, high), REST), {"goal": TOP})
    return with_plan(plain(), "bracket", ["1.25", "-0.75"], ["2.75", "3.5"], nodes)


def triangle(obstacle=((1, -1), (3, 2.5)), *contacts):
    """The plain proof with a polygonal body that reaches 1/2 down and 1/4 up."""
    middle = [["1/3", "1/3", "1/3"], ["0", "0"]]
    answer = proof(
        obstacle, hit(middle, *(contacts or [[["0.5", "0.25", "0.25"], ["0", "-0.25"]]]))
    )
    vertices = [["0", "-0.5"], ["0.5", "0.25"], ["-0.5", "0.25"]]
    answer["problem"]["body"] = build.one_part({"vertices": vertices})
    return build.rehash(answer)


def wide(name, lo="-8", hi="8"):
    """The line with two bins of final widths 1 and 2, and one leaf of the given name, or a split of
    z at 7.5.
    """
    answer = line()
    answer["tube"] = {
        "edges": [["-1", "0", "1"]],
        "interval": [[[["1"]]], [[["2"]]]],
        "final": [["1"], ["2"]],
    }
    nodes = {name: []} if name != "goal" else (0, "7.5", REST, {"goal": [[0, "1"]]})
    return build.rehash(with_plan(answer, "bracket", [lo], [hi], nodes))


def bent(b):
    """c_1 = |k + 1/2| and starts below b: z = 9 is safe at the corners of k but at k = -1/2 only if
    b >= 9.
    """
    answer = line()
    weights = [[["1"], ["1"], ["-1"]], [["0", "1", "1"]]]
    answer["network"] = {"weights": weights, "biases": [["0", "0.5", "-0.5"], ["0"]]}
    answer["problem"]["start"] = {"A": [["1"]], "b": [b]}
    return build.rehash(with_plan(answer, "bracket", ["-9"], ["9"], {"safe": []}))


def folded(b, name="start"):
    """c_1 = y_1 - y_2, y_1 = max(x_1 - x_2, 0), y_2 = max(x_2 - 1/4, 0), with x_1 = max(k + 1/2, 0)
    and x_2 = max(1/2 - k, 0). No plan starts at or below b if b < -10.5, where z = -9 and k = 1 do.

    By bounds over all of K it takes b < -11.75: in turn x_1 <= (3 k + 3) / 4, x_2 >= 1/2 - k, y_1
    <= (x_1 - x_2) / 2 + 1 and y_2 >= x_2 - 1/4 give y_2 - y_1 >= -7/8 - 15 k / 8.
    """
    answer = line()
    first = [["1"], ["-1"]]
    second = [["1", "-1"], ["0", "1"]]
    answer["network"] = {
        "weights": [first, second, [["1", "-1"]]],
        "biases": [["0.5", "0.5"], ["0", "-0.25"], ["0"]],
    }
    answer["problem"]["start"] = {"A": [["1"]], "b": [b]}
    leaf = {"bounded": {name: [[0, "1"]]}}
    return build.rehash(with_plan(answer, "bracket", ["-9"], ["9"], leaf))


def at_a_knot(depth, second):
    """A point that stands still at z in [-1/1000, 1/1000] for two steps; the contact at knot 1, a
    quarter beyond, lies `depth` inside an obstacle of the first step. second: widths of that step.

    There is no trajectory that touches with an error which the next interval forbids; if the
    contact is inside the obstacle, there is one a moment before.
    """
    answer = line()
    answer["problem"] |= {
        "steps": 2,
        "goal": build.box_rows((build.F(-1, 1000),), (build.F(1, 1000),)),
        "obstacles": [build.box_rows((build.F(1, 4) - depth,), (9,)) | {"steps": [0, 0]}],
    }
    answer["network"] = {"weights": [[["0"], ["0"]]], "biases": [["0", "0"]]}
    answer["tube"] |= {"interval": [[[["0.25"]], [[second]]]], "final": [["0"]]}
    what = hit([["0"], ["0.25"]], t=0)
    return build.rehash(with_plan(answer, "proved", ["-0.001"], ["0.001"], what))


def rounding(half):
    """Room for the disc along (-1, 1) of floor(sqrt(2) 2^80) + half/2 in units of 2^-81: is the
    root rounded up?
    """
    room = build.F(2 * math.isqrt(2 << 160) + half, 4 << 80)
    b = ["9", "-0.5", build.text(-room - build.F(1, 2))]
    obstacle = {"A": [["1", "0"], ["0", "1"], ["-1", "0"]], "b": b, "steps": [0, 0]}
    return {
        "problem__obstacles__0": obstacle,
        "samples__0__sep": [[[[1, [[1, "1"], [2, "1"]]]]]],
        "sets": [],
    }


VALID = {make.__name__: make for make in (plain, corridor, line, blocked, bracket, triangle)}
VALID |= {"folded": lambda: folded("-11.7500001")}
VALID |= {"wide": lambda: wide("safe", "-7", "7") | {"no_plan": None}, "bent": lambda: bent("9")}
CASES = {}


def change(answer, changes):
    """Changes an answer in place; hashes are made right again afterwards, unless a hash is what is
    changed.

    A place is a path of keys joined by "__", ending in "append" to append.
    """
    for hashes in (False, True):
        for place, value in changes.items():
            if ("hash" in place) == hashes:
                *keys, last = [int(key) if key.isdigit() else key for key in place.split("__")]
                part = answer
                for key in keys:
                    part = part[key]
                if last == "append":
                    part.append(copy.deepcopy(value))
                else:
                    part[last] = copy.deepcopy(value)
        if not hashes:
            build.rehash(answer)
    if any(place.startswith("claim") for place in changes):
        answer["hash"]["claim"] = build.sha256(answer["claim"])
    return answer


def bad(why, fresh=plain, limits=None, **changes):
    """Registers a bad certificate: a valid one changed in places, perhaps with smaller limits of
    the checker.
    """
    assert why not in CASES
    CASES[why] = (lambda: json.dumps(change(fresh(), changes)), limits or {})


def bad_text(why, new):
    """Registers a bad file: the plain answer with something put in front of its first key."""
    CASES[why] = (lambda: json.dumps(plain()).replace('{"format"', new + '"format"', 1), {})


def bad_proof(why, obstacle, nodes):
    bad(why, lambda: proof(obstacle, nodes))


# Numbers, lists and whole numbers.
bad("a number of a thousand digits", samples__0__k=["0.5" + "0" * 1000])
bad("a number with blanks", samples__0__k=[" 0.5 "])
bad("a string for a list of digits", samples__0__p0="00")
bad("p0 with a third entry", samples__0__p0=["0", "0", "7"])
bad("k with a second entry", samples__0__k=["0.5", "7"])
bad("p0 of a set with a third entry, taken for k", sets__0__p0=["0", "0", "0.5"])
bad("k of a set with a second entry", sets__0__k=["0.5", "7"])
bad("a denominator of 9000 bits", samples__0__p0=["0x1p-9000", "0"])
bad(  # the second row is spelled otherwise, so that all are read as fractions
    "a goal of 18000 bits",
    line,
    problem__goal={"A": [["0x1p-8000"], ["1"]], "b": ["0x1p+9999", "999"]},
)
bad("a width of 9000 bits", line, tube__interval=[[[["0x1p-9000"]]]])
bad(
    "a network of 18000 bits",
    line,
    network__weights=[[["0x1p+9999"]]],
    network__biases=[["0x1p-8000"]],
)
bad("row true", samples__0__sep=[[[[2, [[True, "1"]]]]]])
bad("row -3", samples__0__sep=[[[[2, [[-3, "1"]]]]]])
bad("a run that ends at true", samples__0__sep=[[[[True, TOP], [2, TOP]]]])
bad("a run past the end", samples__0__sep=[[[[3, TOP]]]])
bad("a run that ends where it starts", samples__0__sep=[[[[0, TOP], [2, TOP]]]])
bad("runs that stop early", samples__0__sep=[[[[1, TOP]]]])
bad("no runs", samples__0__sep=[[[]]])
bad("an obstacle without separation", samples__0__sep=[])
bad("runs that are not told by part", samples__0__sep=[[[2, TOP]]])
bad("separation as an object", line, samples__0__sep={})
for name in ("n_p", "points", "n_k", "steps"):
    bad(f"{name} true", line, **{f"problem__{name}": True})
bad("n_q false", line, problem__n_q=False)
bad("first step false", problem__obstacles__0__steps=[False, 1])
bad("last step true", problem__obstacles__0__steps=[0, True])
bad("bin true", sets__0__bin=True)
bad("samples as an object", samples={})
bad("sets as an object", sets={})
for place in (
    "samples__0",
    "sets__0",
    "problem__goal",
    "problem__start",
    "problem__obstacles__0",
    "problem",
):
    bad(f"an unknown field in {place}", **{f"{place}__note": "1"})
bad("an unknown field in the network", network__note="1")
bad("an unknown field in the tube", tube__note="1")
bad("an unknown field in a box", problem__domain__note="1")
bad("an unknown field in a polygon", triangle, problem__body__parts__0__note="1")
bad(
    "a body that is a disc and a polygon",
    problem__body=build.one_part({"radius": "0.1", "vertices": [["9", "9"]]}),
)

# The problem.
bad("a robot without a point", problem__points=0)
bad("a reversed domain", samples=[], sets=[], problem__domain={"lo": ["0.5"], "hi": ["-0.5"]})
bad("obstacles as an object", samples=[], sets=[], problem__obstacles={})
bad("goal rows as an object", line, problem__goal={"A": {}, "b": []})
bad("a goal row that is too long", line, problem__goal={"A": [["1", "1"]], "b": ["9"]})
bad("more goal offsets than rows", line, problem__goal={"A": [["1"]], "b": ["9", "-9"]})
bad("an obstacle that starts before 0", problem__obstacles__0__steps=[-1, 1], samples=[], sets=[])
bad(
    "an obstacle that ends before it starts",
    problem__obstacles__0__steps=[1, 0],
    samples__0__sep=[[[]]],
    sets=[],
)
bad(
    "an obstacle that ends after the horizon",
    problem__obstacles__0__steps=[0, 2],
    samples=[],
    sets=[],
)
bad("a negative radius", problem__body__parts__0__radius="-0.5", problem__obstacles__0__b__1="-0.3")
bad("vertices as an object", line, problem__body=build.one_part({"vertices": {}}))
bad("a part of no point", line, problem__body__parts__0__points=[])
bad("a body of nothing", line, problem__body=build.one_part({"vertices": []}))
bad("a vertex of three coordinates", problem__body=build.one_part({"vertices": [["0", "0", "0"]]}))

# The network.
bad("65 layers", line, network={"weights": [[["1"]]] * 65, "biases": [["0"]] * 65})
bad("no layers", line, network={"weights": [], "biases": []}, samples=[])
bad("an output too many", network__weights__1__append=["0"], network__biases__1__append="0")
bad("a layer as an object", line, network={"weights": [{}, [[]]], "biases": [[], ["0"]]})
bad("a row of weights that is too long", line, network__weights=[[["1", "1"]]], samples=[])
bad("a bias too many", line, network__biases=[["0", "0"]], samples=[])
bad("biases of another layer", line, network__biases=[["0"], ["0"]])

# The tube.
bad(
    "edges that go back",
    line,
    tube={"edges": [["-1", "2", "-2", "1"]], "interval": [[[["0"]]]] * 3, "final": [["0"]] * 3},
)
bad(
    "edges as a string of digits",
    line,
    tube__edges=["01"],
    problem__domain={"lo": ["0"], "hi": ["1"]},
)
bad("edges of a second axis", line, tube__edges__append=["0", "1"], samples=[])
FLAT = {"edges": [["0"]], "interval": [], "final": []}
bad(
    "a flat axis without a bin",
    line,
    problem__domain={"lo": ["0"], "hi": ["0"]},
    tube=FLAT,
    samples=[],
)
bad("bins that end before the domain", tube__edges=[["-1", "0", "0.75"]])
bad("widths that are not told by point", tube__interval=[[["1/4", "1/4"]] * 2] * 2)
bad("a negative width", tube__interval=[[[["1/4", "-1"]]] * 2] * 2)
bad("a bin too many", tube__interval__append=[[["0", "0"]]] * 2)
bad("a final bin too many", tube__final__append=["0", "0"])
bad("an interval too many", tube__interval__1__append=[["0", "0"]])
bad("a width too many", tube__interval__1__1__0__append="0")
bad("a final width too many", tube__final__1__append="0")

# What a sample claims.
bad("k outside the domain", problem__domain__hi=["0.25"], sets=[])
bad("p0 outside the start set", samples__0__p0=["1.125", "0"], problem__goal__b__0="9")
bad("a goal missed by less than the tube", samples__0__p0=["0.875", "0"])
bad("a goal missed by less than the tube on its lower side", samples__0__p0=["-0.875", "0"])
bad(
    "a goal reached by the network without ReLU only",
    samples__0__k=["-0.5"],
    problem__obstacles__0__b__1="-2.9",
    problem__goal=build.box_rows((1, -3), (3, -0.5)),
    sets=[],
)
bad(
    "a negative multiplier",
    samples__0__sep=[[[[2, [[1, "-1"]]]]]],
    samples__0__p0=["0", "-3"],
    sets=[],
    problem__goal__b__3="9",
    problem__start=None,
)
bad(
    "a zero direction for an empty obstacle",
    samples__0__sep=[[[[2, [[0, "1"], [2, "1"]]]]]],
    problem__obstacles__0__b=["0", "-1", "-1", "3"],
)
bad("touching", problem__obstacles__0__b__1="-0.75", sets=[])
bad(
    "touching with a polygon",
    problem__obstacles__0__b__1="-0.75",
    sets=[],
    problem__body=build.one_part({"vertices": [["0", "-0.5"], ["0.5", "0.25"], ["-0.5", "0.25"]]}),
)
bad("touching by less than the rounding of a root", **rounding(1))
bad("touching by the part of a root below the last unit", **rounding(0))
bad("contact at the first knot only", samples__0__p0=["0", "-0.25"])
bad("contact at the last knot only", network__weights__1__3=["-0.5"], sets=[])
bad(
    "contact at knot 1, in the second interval's width only",
    samples__0__k=["0.25"],
    sets=[],
    tube__interval__1__1__0__1="0.75",
)
bad(
    "contact at knot 1, in the first interval's width only",
    samples__0__p0=["0", "0.5"],
    sets=[],
    tube__interval__1__0__0__1="0.75",
    network__weights__1__1=["-0.5"],
)
bad(
    "contact in the width of one of two bins",
    tube__interval__0=[[["0", "0.75"]]] * 2,
    samples__0__k=["0"],
)
bad(
    "a set in contact at knot 1, in the second interval's width only",
    samples=[],
    sets__0__k=["0.25"],
    tube__interval__1__1__0__1="0.75",
)
bad(
    "a set in contact at knot 1, in the first interval's width only",
    samples=[],
    sets__0__p0=["0", "0.5"],
    tube__interval__1__0__0__1="0.75",
    network__weights__1__1=["-0.5"],
)
bad(
    "contact in the width of another bin than an earlier sample's",
    tube__interval__0=[[["0", "0.75"]]] * 2,
    samples__append={"p0": ["0", "0"], "k": ["-0.5"], "sep": ABOVE},
)
bad("a goal missed in one of two bins", tube__final__0=["1.5", "0"], samples__0__k=["0"])

# What a set claims.
bad("a pattern with a digit too many", sets__0__pattern="10")
bad("a pattern as a list", sets__0__pattern=["1"])
bad("a pattern for the other side", sets__0__pattern="0")
bad("an inner point on a neuron's boundary", sets__0__k=["0"], tube__edges=[["-1", "-0.5", "1"]])
bad("an inner point below its bin", sets__0__k=["0"], network__biases__0=["1"], samples=[])
bad("an inner point above its bin", sets__0__bin=0)
bad("an inner point at the domain's lower end", problem__domain__lo=["0.5"])
bad("an inner point at the domain's upper end", problem__domain__hi=["0.5"])
bad("an inner point on the start set's boundary", sets__0__p0=["-1", "0"], problem__goal__b__2="9")
bad("an inner point on the goal's boundary", sets__0__p0=["0.75", "0"])
bad("an inner point in contact", sets__0__p0=["0", "-0.25"])
CONSTANT = {"weights": [[["1"], ["0"]], [["0", "0"], ["1", "0"], ["0", "0"], ["2", "0"]]]}
bad(
    "a constant neuron with the wrong sign",
    sets__0__pattern="11",
    network=CONSTANT | {"biases": [["0", "-1"], ["1", "0", "2", "0"]]},
)
bad(
    "a pattern with another letter",
    sets__0__pattern="1x",
    network=CONSTANT | {"biases": [["0", "-1"], ["1", "0", "2", "0"]]},
)

# What a corridor claims.
bad("corridors as an object", corridor, corridors={})
bad("corridors null", corridor, corridors=None)
bad("an unknown field in corridors__0", corridor, corridors__0__note="1")
bad("a set for a corridor", corridor, corridors__0=plain()["sets"][0])
bad("directions without a plan", corridor, corridors__0={"sep": ABOVE})
bad("a plan without directions", corridor, corridors__0__sep=[])
bad("directions as numbers", corridor, corridors__0__sep=[[[[2, [[1, 1.0]]]]]])
bad("a direction from another side", corridor, corridors__0__sep=[[[[2, [[0, "1"]]]]]])
bad(
    "a corridor with a negative multiplier",
    corridor,
    corridors__0__sep=[[[[2, [[1, "-1"]]]]]],
    corridors__0__p0=["0", "-3"],
    problem__goal__b__3="9",
    problem__start=None,
)
bad("a corridor whose runs stop early", corridor, corridors__0__sep=[[[[1, TOP]]]])
bad(
    "a corridor whose plan starts outside",
    corridor,
    corridors__0__p0=["1.125", "0"],
    problem__goal__b__0="9",
)
bad("a corridor whose plan misses the goal", corridor, corridors__0__p0=["0.875", "0"])
bad("a corridor whose plan has k outside the domain", corridor, problem__domain__hi=["0.25"])
bad("a corridor whose plan does not keep to it", corridor, corridors__0__p0=["0", "-0.25"])
bad(
    "a corridor whose plan does not keep to it in one of two bins",
    corridor,
    corridors__0__k=["0"],
    tube__interval__0=[[["0", "0.75"]]] * 2,
)
bad(
    "a second corridor whose plan does not keep to it",
    corridor,
    corridors__append={"p0": ["0", "-0.25"], "k": ["0.5"], "sep": ABOVE},
)

# The file and its hashes.
bad("another format", format="parc_jax.answer/1")
bad("a field that nobody knows", coverage={})
bad("a meta part that is too long", claim=None, meta="0" * 100, limits={"MAX_REMARK": 99})
bad("a claim that is too long", limits={"MAX_REMARK": 99})
bad("more work than allowed", limits={"WORK_AT_LEAST": 0, "WORK_PER_CHARACTER": 0})
CASES["a file with too many values"] = (lambda: json.dumps(plain()), {"MAX_VALUES": 50})
bad("a wrong hash", hash__tube="0" * 64)
bad("a claim about another network", claim__network_hash="0" * 64)
bad("a claim about another tube", claim__tube_hash="0" * 64)
# Of the claim's numbers: what runs do not show.
BLOCK = {"n": 6905, "discard": 0, "eps": "1/1000"}


def claim_of_bins(*blocks):
    """The plain answer, whose claim is about its bins, in these blocks."""
    answer = plain()
    bins = len(answer["tube"]["final"])
    told = {"bin_eps": ["1/1000"] * bins, "evidence": {"blocks": list(blocks)}, "delta": "1/100"}
    told |= {"n": max([6905, *(block["n"] for block in blocks)])}
    told |= {"discard": max([0, *(block["discard"] for block in blocks)])}
    answer["claim"] |= told
    return answer


bad("a claim of too few runs", claim__n=6904)
bad("a claim of a smaller eps", claim__eps="1/1001")
bad("a claim of more confidence", claim__delta="1/1001")
bad("a claim with a run left outside for nothing", claim__discard=1)
bad("a claim with a second look for nothing", claim__looks=2)
bad("a claim with less than no runs left outside", claim__discard=-1)
bad("a claim with no look", claim__looks=0, claim__n=10)
bad("a claim with a delta of two", claim__delta="2", claim__n=1)
bad("a claim of true runs", claim__n=True, claim__eps="0.9995")
bad(
    "a claim with more runs left outside than are counted",
    claim__n=20_000,
    claim__discard=2,
    limits={"MAX_DISCARDS": 1},
)
bad("a claim of no blocks", claim_of_bins)
bad("a claim whose blocks cost more than delta", lambda: claim_of_bins(*[BLOCK] * 11))
bad("a claim of a block with a note", lambda: claim_of_bins(BLOCK | {"note": ""}))
bad("a claim about no block", lambda: claim_of_bins(BLOCK), claim__bin_eps__0="1/2")
bad("a claim about another number of bins", lambda: claim_of_bins(BLOCK), claim__bin_eps=[])
bad("a claim of no run of its bins", lambda: claim_of_bins(BLOCK), claim__n=0)
bad(
    "a claim about a block of no run",
    lambda: claim_of_bins(BLOCK | {"n": 0, "eps": "1"}),
    claim__eps="1",
    claim__bin_eps=2 * ["1"],
)
bad("a claim of a worse block", lambda: claim_of_bins(BLOCK, BLOCK | {"eps": "1/100"}))
# Of its premises, which are its fields: what nobody could print, or does not fit the file.
SHOWN = {"eps": "1/1000", "delta": "1/1000", "n": "6905 runs", "discards": "0", "looks": "1"}
LAW = {
    "generator": "a toy",
    "parameters": [["parc_jax:box of k", "N"], ["wind", "3 m/s"]],
    "k_law": "uniform",
    "lo": ["-0x1p+0"],
    "hi": ["0x1p+0"],
}


def hash_of_law(law):
    """Of its fields but the hash."""
    told = json.dumps({name: law[name] for name in law if name != "hash"}, sort_keys=True)
    return hashlib.sha256(told.encode()).hexdigest()


LAW["hash"] = hash_of_law(LAW)
FACTS = {
    "quantifier": f"a new rollout drawn from a toy (k uniform on N, wind = 3 m/s; "
    f"{LAW['hash'][:8]})",
    "subject": {"system": "toy", "domain": {"lo": ["-0x1p+0"], "hi": ["1"]}, "time": ["1/20"]},
    "law": LAW,
    "assumptions": ["IID", "HIDDEN_START(given the load (of 3 kg))"],
}
OF_BINS = f"in each claimed bin of K, {FACTS['quantifier']} with k in that bin"


def with_facts(make=plain):
    """An answer whose claim states all that it rests on."""
    answer = make()
    answer["claim"] |= copy.deepcopy(FACTS)
    answer["claim"]["evidence"] |= {"failed": 0, "not_drawn": ["wind", "load"]}
    if answer["claim"]["bin_eps"] is not None:
        answer["claim"]["quantifier"] = OF_BINS
    return build.rehash(answer)


def with_facts_of_bins():
    """Of a claim about bins, one of them without a claim, by recordings."""
    answer = claim_of_bins(BLOCK | {"n": 7100}, BLOCK | {"n": 9300, "discard": 1})
    answer["claim"]["evidence"] |= {"rows": 20_000, "recordings": "0a1b", "eps_asked": "eps = 1/2"}
    answer["claim"]["bin_eps"][0] = None
    return with_facts(lambda: answer)


NUMBERED = {
    "assumptions": [
        "IID",
        "WORKERS_LOST(1,016, independent of the run)",
        "TRANSLATION_INVARIANCE(within 1.00001e-05; 0.125 seen from 8 starts)",
        "ROTATION_INVARIANCE(within 1.00001e-05; not measured)",
        "INTERSAMPLE(acceleration <= (0.5, 2.0) m/s^2, h = 0.05 s)",
        "UNSEEN(1 look; network, profile, eps and discards were settled before these runs)",
        "LEFT_OUT(40 of their log, with k outside of K, or independent of k and run)",
    ],
    # of two points in the plane: acceleration h^2 / 8
    "intersample": ["1/6400", "1/1600", "1/6400", "1/1600"],
}
SLOW, ODD_STEP = "INTERSAMPLE(speed <= 0.00625 m/s, h = 0.05 s)", {"claim__intersample__0": "1/64"}


def with_numbers(**claim):
    """An answer whose claim has assumptions with numbers, which other fields have as well."""
    answer = with_facts()
    answer["claim"] |= copy.deepcopy(NUMBERED) | claim
    answer["claim"]["subject"]["time"] = ["0.05", "1/10", "1/20"]
    start = {"gap": build.text(build.F(100001, 10**10)), "seen": "0x1p-3", "turned": None}
    answer["claim"]["evidence"] |= {"lost": 1016, "start": start, "left_out": 40}
    return build.rehash(answer)


VALID |= {make.__name__: make for make in (with_facts, with_facts_of_bins, with_numbers)}
for one in NUMBERED["assumptions"]:
    name, digits = one.partition("(")[0], re.finditer(r"[0-9]+", one)
    for where in digits:
        more = f"{one[: where.start()]}{int(where[0]) + 1}{one[where.end() :]}"
        all_of_them = [more if x == one else x for x in NUMBERED["assumptions"]]
        bad(f"a claim that assumes {more}", lambda n=all_of_them: with_numbers(assumptions=n))
for name, value in {"seen": None, "gap": "0x1p-3", "turned": "0x1p-3"}.items():
    bad(f"a claim of another {name}", with_numbers, **{f"claim__evidence__start__{name}": value})
bad("a claim of no trial of starts", with_numbers, claim__evidence__start=None)
bad("a claim of a bound of another axis", with_numbers, claim__intersample__1="1/6400")
slow = [SLOW if "acceleration" in x else x for x in NUMBERED["assumptions"]]
bad("a claim of another bound of speed", lambda: with_numbers(assumptions=slow), **ODD_STEP)
for name, value in {"given": [0], "rotation": ["turns"]}.items():
    edit = {f"claim__subject__{name}": value, "claim__assumptions": ["IID"]}
    bad(f"a claim whose ledger lacks what {name} implies", with_facts, **edit)
for name, value in {"lost": "uncounted", "left_out": 3}.items():
    bad(
        f"a claim of runs that are {name} in silence",
        with_facts,
        **{f"claim__evidence__{name}": value},
    )
bad("a claim of runs lost that nobody counted", with_numbers, claim__evidence__lost="uncounted")
# Each of them changes what is printed, and none of the proof.
EDITS = {
    "claim__kind": "declared",
    "claim__n": 6906,
    "claim__eps": "1/999",
    "claim__delta": "1/999",
    "claim__evidence__failed": 1,
    "claim__evidence__recordings": "ff",
    "claim__evidence__eps_asked": "eps = 1/10000",
    "claim__evidence__not_drawn": ["wind"],
    "claim__law": {},
    "claim__subject": {},
    "claim__assumptions": [],
    "claim__assumptions__0": "IID of each day",
    "claim__assumptions__1": "HIDDEN_START(given nothing)",
    "claim__assumptions__append": "CALM(wind below 3 m/s)",
}
OF_A_RECORDING = (
    "a plan whose k is that of a new recording for which this set has a start, one of 400 that are "
    "drawn so as to end in the goal, and whose p0 is the first such start, run in this scene by"
)
STEPS = [["1.0", 240, 0], ["0.7", 300, 0], ["0.5", 400, 1]]


def tested():
    """An answer whose claim is of a set that was tested in its scene, at 1/100 and 1/10."""
    answer = corridor()
    evidence = {"steps": copy.deepcopy(STEPS), "scale": "0.5", "tests": 500, "of": "0a1b"}
    evidence["scene"] = build.sha256(answer["problem"])
    evidence |= {"corridors": 1, "within": [["0x1p+0"], ["1", "2"]]}
    evidence["set"] = build.sha256([answer["corridors"], evidence["within"]])
    claim = {"kind": "validated", "eps": "1/100", "delta": "1/10", "n": 400, "discard": 1}
    answer["claim"] |= claim | {"evidence": evidence}
    return build.rehash(answer)


IDS = ["0a1b", "0c2d"] * 250


def tested_by_recordings(ids=IDS):
    """The same of recordings, whose law is stated whole."""
    answer = tested()
    evidence = answer["claim"]["evidence"]
    evidence |= {"tested": ids, "recordings": build.sha256(ids)}
    told = {"law": LAW | {"k_law": "logged"}, "subject": FACTS["subject"]}
    told = copy.deepcopy(told)
    told["law"]["hash"] = hash_of_law(told["law"])
    told["quantifier"] = (
        f"{OF_A_RECORDING} a toy (k as logged, wind = 3 m/s; {told['law']['hash'][:8]})"
    )
    answer["claim"] |= told
    return build.rehash(answer)


def tested_from_one_start(said="-0.25, 0"):
    """The same, all from one start, which its words name."""
    answer = tested_by_recordings()
    law = answer["claim"]["quantifier"].removeprefix(OF_A_RECORDING)
    answer["claim"]["quantifier"] = (
        f"a plan from ({said}) m in the scene's frame whose k is that of a new recording for which "
        f"this set has such a plan, run in this scene by{law}"
    )
    answer["claim"]["evidence"]["at"] = ["-0x1p-2", "0x0p+0"]
    return build.rehash(answer)


VALID |= {make.__name__: make for make in (tested, tested_by_recordings, tested_from_one_start)}
bad("a set of one start in words of another", lambda: tested_from_one_start("0.25, 0"))
bad("a set of a start in no list", tested_from_one_start, claim__evidence__at="0")
bad("a set of one start in words of drawn ones", tested_by_recordings, **{
    "claim__evidence__at": ["-0x1p-2", "0x0p+0"],
})  # fmt: skip
bad("a set of drawn starts in words of one", tested_from_one_start, claim__evidence__at=None)
bad("a tested set of fewer recordings than tests", lambda: tested_by_recordings(IDS[:499]))
bad("a tested set with other recordings", tested_by_recordings, claim__evidence__tested=IDS[::-1])
bad("a tested set of recordings in one text", lambda: tested_by_recordings(500 * "a"))
bad("a tested set in words of runs", tested_by_recordings, claim__quantifier=FACTS["quantifier"])
bad("a tested set of recordings in other words", tested, **{
    "claim__evidence__tested": IDS, "claim__evidence__recordings": build.sha256(IDS),
    "claim__law": {**LAW}, "claim__quantifier": "a plan drawn uniformly from this set",
})  # fmt: skip
for why, changes in {
    "another scene": {"claim__evidence__scene": "0" * 64},
    "fewer corridors": {"corridors": []},
    "another corridor": {"corridors__0__k": ["0x1p-1"]},
    "a corridor more": {"corridors": 2 * corridor()["corridors"]},
    "a corridor less than it says": {"claim__evidence__corridors": 2},
    "another hash of its set": {"claim__evidence__set": "0" * 64},
    "another place of draws": {"claim__evidence__within": None},
    "a set of nobody": {
        "claim__evidence__corridors": 0,
        "claim__evidence__set": build.sha256([[], [["0x1p+0"], ["1", "2"]]]),
        "corridors": [],
    },
    "bins": {"claim__bin_eps": ["1/100"]},
    "two looks": {"claim__looks": 2},
    "no tests": {"claim__evidence__steps": []},
    "rising scales": {"claim__evidence__steps__1": ["1.5", 300, 0]},
    "sets that shrink": {"claim__evidence__steps__1": ["0.7", 500, 0]},
    "failures that go": {"claim__evidence__steps__1": ["0.7", 700, 2]},
    "more tested than drawn": {"claim__evidence__tests": 399},
    "other runs than tested": {"claim__n": 401},
    "other failures than tested": {"claim__discard": 0},
    "another scale than tested": {"claim__evidence__scale": "0.4"},
    "a test of too few": {"claim__evidence__steps__0": ["1.0", 220, 0]},
    "less risk than shown": {"claim__eps": "1/101", "claim__delta": "1/11"},
    "a scale of zero": {"claim__evidence__steps__2": ["0", 400, 1], "claim__evidence__scale": "0"},
    "a note in a test": {"claim__evidence__steps__0": ["1.0", 240, 0, ""]},
    "a true failure": {"claim__evidence__steps__2": ["0.5", 400, True]},
    "no run": {"claim__evidence__steps__0": ["1.0", 0, 0]},
}.items():
    bad(f"a tested set with {why}", tested, **changes)
bad("a tested set with more failures than are counted", tested, limits={"MAX_DISCARDS": 0})
OTHER_DOMAIN = {"claim__subject__domain__hi": ["2"]}
TRUE_DISCARD = {"claim__evidence__blocks__1__discard": True}
bad("a claim about another domain", with_facts, claim__subject__domain__hi=["2"])
bad("a claim without a law about another domain", with_facts, claim__law={}, **OTHER_DOMAIN)
bad("a claim with fewer runs than a block", with_facts_of_bins, claim__n=9299)
bad("a claim of bins with true discards", with_facts_of_bins, claim__discard=True)
bad("a claim of a block with true discards", with_facts_of_bins, **TRUE_DISCARD)
bad("a claim of bins of rows as a text", with_facts_of_bins, claim__evidence__rows="20000")
bad(
    "a claim of more runs than are counted, of which more failed than are left outside",
    with_facts,
    claim__n=10**9,
    claim__evidence__failed=1,
)
bad(
    "a claim of other looks than are assumed", with_facts, claim__assumptions=["UNSEEN(2 looks; x)"]
)
bad("a claim in the words of another law", with_facts, claim__quantifier=f"{FACTS['quantifier']}s")
bad("a claim of bins with fewer discards than a block", with_facts_of_bins, claim__discard=0)
bad("a claim of bins in other words", with_facts_of_bins, claim__quantifier=FACTS["quantifier"])
bad("a claim of recordings in words of runs", with_facts, claim__evidence__rows=7000)
bad("a law with a note", with_facts, claim__law__note="")
bad("a law with half a parameter", with_facts, claim__law__parameters=[["wind"]])


def with_law(words=True, **fields):
    """The answer of `with_facts` with another law, which has its hash, perhaps in its words."""
    answer = with_facts()
    law = answer["claim"]["law"]
    before = law["hash"]
    law |= fields
    law["hash"] = hash_of_law(law)
    if words:
        said = answer["claim"]["quantifier"].replace(before[:8], law["hash"][:8])
        answer["claim"]["quantifier"] = said
    return build.rehash(answer)


for name, value in (LAW | {"hash": "0" * 64, "generator": "the toy", "k_law": "logged"}).items():
    if value != LAW[name]:
        bad(f"a law of another {name}", with_facts, **{f"claim__law__{name}": value})
    if name != "hash" and value != LAW[name]:
        bad(f"words of another {name}", lambda n=name, v=value: with_law(**{n: v}))


def with_words(words, **fields):
    """The same in the words of how k is drawn and of the parameters."""
    answer = with_law(**fields)
    claim = answer["claim"]
    claim["quantifier"] = f"a new rollout drawn from a toy (k {words}; {claim['law']['hash'][:8]})"
    return build.rehash(answer)


bad("a law with parameters as an object", lambda: with_words("uniform on K", parameters={}))
bad(
    "a law with a parameter as a text", lambda: with_words("uniform on K, a = b", parameters=["ab"])
)
bad("a law with an end as a text", lambda: with_law(hi="1"))
bad("words of the law before", lambda: with_law(words=False, lo=["-1.0"]))
bad("a law of a larger K", lambda: with_law(hi=["1.5"]))
bad("a law of another number of axes", lambda: with_law(hi=["1", "1"], lo=["-1", "-1"]))


def with_part(lo, hi):
    """Of a law on a larger box."""
    answer = with_law(k_law="even, of which K is a part", lo=lo, hi=hi)
    said = answer["claim"]["quantifier"]
    answer["claim"]["quantifier"] = said.replace("uniform on N", "by even, of which K is a part")
    return build.rehash(answer)


VALID |= {
    "part": lambda: with_part(["-2"], ["1"]),
    "part_of_two": lambda: with_part(["0", "0"], ["0", "0"]),
}
bad("a law of a smaller box", lambda: with_part(["-2"], ["0.5"]))
bad("a law of half a box", lambda: with_part(["-2"], []))
bad("a claim about a domain of two axes", with_facts, claim__subject__domain=2 * [["-1"]])
bad("a claim about another time step", with_facts, claim__subject__time=["0.051", "0.1"])
bad("a claim about a time step of words", with_facts, claim__subject__time=["soon"])
bad("a claim about half a domain", with_facts, claim__subject__domain={"lo": ["-1"]})
bad("a claim about no domain", with_facts, claim__subject__domain={"lo": [], "hi": []})
bad("a claim of less than no failed run", with_facts, claim__evidence__failed=-1)
bad(
    "a claim of more failed runs than less than none left outside",
    with_facts,
    claim__evidence__failed=1,
    claim__discard=-1,
)
bad("a claim about a domain with a note", with_facts, claim__subject__domain__note="")
bad("a claim about a domain by its keys", with_facts, claim__subject__domain__lo={"-1": ""})
bad(
    "a claim of bins of more failed runs than runs",
    with_facts_of_bins,
    claim__evidence__failed=9301,
)
bad("a claim of more failed runs than there are", with_facts, claim__evidence__failed=6906)
bad("a claim of true failed runs", with_facts, claim__evidence__failed=True)
bad("a claim of rows as a text", with_facts, claim__evidence__rows="7000")
bad("a claim whose law is a number", with_facts, claim__quantifier=5)
bad("a claim whose law is a list", with_facts, claim__law=["uniform"])
bad("a claim whose k is a list", with_facts, claim__law__k_law=["uniform"])
bad("a claim whose recordings are a number", with_facts, claim__evidence__recordings=5)
bad("a claim whose eps asked is a number", with_facts, claim__evidence__eps_asked=5)
bad("a claim of what is not drawn as a text", with_facts, claim__evidence__not_drawn="wind")
bad("a claim of what is not drawn in lists", with_facts, claim__evidence__not_drawn=[["wind"]])
bad("a claim that assumes a number", with_facts, claim__assumptions__append=5)
bad("a claim that assumes an object", with_facts, claim__assumptions={"IID": ""})
bad("a claim that assumes too much", with_facts, limits={"MAX_PREMISES": 1})
bad("a time step of zero", line, problem__dt="0")
bad_text("a key twice", '{"format": 0, ')
bad_text("values nested too deep", '{"meta": ' + "[" * 501 + "]" * 501 + ", ")
bad_text("a float in a part that is ignored", '{"meta": 1.5, ')
bad_text("a NaN in a part that is ignored", '{"meta": NaN, ')
bad("more neurons at vertices than are kept", bracket, limits={"MAX_KEPT": 1})
bad("more conditions than are kept", limits={"MAX_CONDITIONS": 7}, samples=[])
CASES["a file that is too large"] = (
    lambda: json.dumps(plain()) + "  ",
    {"MAX_BYTES": len(json.dumps(plain()))},
)

# No plan.
bad("an unknown field in no_plan", blocked, no_plan__note="1")
bad("a no_plan part of another kind", blocked, no_plan__kind="likely")
bad("an open leaf in a proof", blocked, no_plan__tree=[REST])
bad("a leaf too many", blocked, no_plan__tree__append=REST)
bad("a box of z that the goal does not imply", blocked, no_plan__z__lo=["1.5", "-0.75"])
bad(
    "a face of z in another direction",
    blocked,
    no_plan__faces__0__1=[[0, "1"], [1, "0.001"]],
    no_plan__z__hi=["2.8", "2.75"],
)
bad("the faces of an axis missing", blocked, no_plan__faces=faces(2)[:1])
bad("one face missing", blocked, no_plan__faces__1=faces(2)[1][:1])
bad(
    "a box of z with a third axis",
    bracket,
    no_plan__z={"lo": ["1.25", "-0.75", "0"], "hi": ["2.75", "3.5", "1"]},
    no_plan__tree=[REST],
)
FLAT_Z = with_plan(line(), "bracket", ["9"], ["9"], REST)
bad("a flat box of z", lambda: copy.deepcopy(FLAT_Z), problem__goal=build.box_rows((9,), (9,)))
bad("a flat domain", lambda: wide("safe", "-9", "9"), problem__domain={"lo": ["0"], "hi": ["0"]})
bad(
    "a box of z for an end wider than the last interval",
    blocked,
    tube__interval__0__1=[["1/8", "1/8"]],
)
bad("touching at a knot", lambda: at_a_knot(build.F(1, 1000), "0"))
bad("a split below its box", blocked, no_plan__tree=tree((0, "1", hit(ZERO), hit(ZERO))))
bad("a split above its box", blocked, no_plan__tree=tree((0, "3", hit(ZERO), hit(ZERO))))
bad("a split on axis false", blocked, no_plan__tree=tree((False, "2", hit(ZERO), hit(ZERO))))
bad("a hit of obstacle false", blocked, no_plan__tree=[hit(ZERO, o=False)])
bad("a hit of obstacle -1", blocked, no_plan__tree=[hit(ZERO, o=-1)])
bad_proof("a hit in interval false", ((0, -2), (2, 3)), hit(ZERO, t=False))
bad(
    "a hit before the obstacle exists",
    blocked,
    no_plan__tree=[hit(ZERO, t=1)],
    problem__obstacles__0__steps=[0, 0],
)
bad_proof("a hit beyond the interval", ((2, -1), (4, 4)), hit(ZERO, alpha="2"))
bad_proof("a hit at some vertices only", ((1, -1), (3, 2)), hit(ZERO))
bad_proof("an error outside the tube", ((1, -1), (3, 2.25)), hit(ZERO, [["0", "0"], ["0", "-0.5"]]))
bad_proof("an error of three coordinates", ((1, -1), (3, 3)), hit([["0", "0"], ["0", "0", "0"]]))
bad_proof(
    "a body point outside the disc", ((1, -1), (3, 2)), hit(ZERO, [["0", "-0.75"], ["0", "0"]])
)
bad_proof(
    "a body point of three coordinates", ((1, -1), (3, 3)), hit([["0", "0", "0"], ["0", "0"]])
)
bad("a negative weight", lambda: triangle(((1, -1), (3, 1.5)), [["2", "-0.5", "-0.5"], ["0", "0"]]))
bad(
    "weights that sum to two", lambda: triangle(((1, -1), (3, 1.75)), [["2", "0", "0"], ["0", "0"]])
)
bad("a fourth weight", lambda: triangle(((1, -1), (3, 2.5)), [["1", "0", "0", "0"], ["0", "0"]]))
REACH = hit(ZERO, [["0", "0"], ["0", "-0.5"]])
bad(
    "an error in the wider of two bins",
    lambda: proof(((1, -1), (3, 2.25)), REACH),
    tube__interval__0=[[["0.5", "0.5"]]] * 2,
)
bad("a safe leaf inside the narrower of two bins", lambda: wide("safe"))
bad("a goal leaf for the wider of two bins", lambda: wide("goal"))
bad("a box of z for the wider of two bins", lambda: wide("open", "-7", "7"))
bad("a safe leaf that fails between the corners of k", lambda: bent("8.5"))
bad("bounds that do not reach", lambda: folded("-11.75"))
bad("a false leaf by bounds", lambda: folded("-10.4"))
bad(
    "an open leaf by bounds",
    blocked,
    no_plan__kind="bracket",
    no_plan__tree=[{"bounded": REST}],
)
bad("too many cells", blocked, limits={"MAX_POINTS": 2})
