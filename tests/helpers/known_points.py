"""A hand-made scene with several points and parts, boxes of doubt and a tube of templates, and a
bad certificate for every check of the checker that only such files meet.

The plain scene of known.py with a second point, 1 above the first. A capsule of radius 1/2 around
both keeps 1/4 of room above the obstacle, a triangle hangs from the second point alone. The second
bin's errors are templates: where the first has widths of 1/4, rows of them.
"""

import json

import answer_files as build
import known
from known import TOP

BOTH = [[[2, TOP]], [[2, TOP]]]  # separation of both parts by the upper face throughout
AXES = [["1", "0"], ["-1", "0"], ["0", "1"], ["0", "-1"]]
QUARTERS = {"A": AXES, "b": ["1/4"] * 4}
END = [[str(int(i == j) - int(i + 4 == j)) for i in range(4)] for j in range(8)]
PLAN = {"p0": ["0", "0"], "k": ["0.5"], "sep": [BOTH]}
DOUBT = PLAN | {"room": {"p0": ["1/8", "1/8"], "k": ["1/8"]}}


def points():
    """The scene with one entry of each kind."""
    answer = known.plain()
    problem, tube = answer["problem"], answer["tube"]
    problem["points"] = 2
    triangle = [["0", "-0.25"], ["0.25", "0"], ["-0.25", "0"]]
    problem["body"] = {
        "parts": [{"points": [0, 1], "radius": "0.5"}, {"points": [1], "vertices": triangle}]
    }
    problem["goal"] = build.box_rows((1, -1, 1, 0), (3, 3, 3, 4))
    answer["network"] = {
        "weights": [[["1"]], [["0"], ["0"], *[["0"], ["1"]] * 2, *[["0"], ["2"]] * 2]],
        "biases": [["0"], ["0", "1", *["1", "0", "1", "1"], *["2", "0", "2", "1"]]],
    }
    widths = [["0x1p-2", "1/4"]] * 2
    tube["interval"] = [[widths] * 2, [[QUARTERS] * 2] * 2]
    ways = [[[[i, "1"]]] for i in range(8)]
    tube["final"] = [["1/4"] * 4, {"A": END, "b": ["1/4"] * 8, "goal": ways}]
    answer |= {"samples": [PLAN], "corridors": [PLAN], "doubt": [DOUBT]}
    answer["sets"] = [{**PLAN, "bin": 1, "pattern": "1"}]
    return build.rehash(json.loads(json.dumps(answer)))  # shares nothing


STILL = [["0", "0"], [["0", "0"]] * 2]  # a contact of a mixture of both points without errors
UP = [["0", "0.5"], [["0", "0"], ["0", "1/4"]]]  # 1/2 higher by the disc, and an error of point 1


def hit(*groups, part=0, t=1, alpha="1"):
    return {"hit": [0, part, t, alpha, [[weights, list(some)] for weights, *some in groups]]}


def end_error(axis, size):
    """An error at the end of one coordinate of the first point."""
    return [size if axis == i else "0" for i in range(4)]


def beside_the_model(*places):
    """The scene with errors of at least 1/8 along x, in these places of the second bin's tube:
    (interval, point), or "end". The model itself has none.
    """
    answer = points()
    tube = answer["tube"]
    off = {"b": ["1/4", "-1/8", "1/4", "1/4"]}
    for place in places:
        if place == "end":
            tube["final"][1]["b"][4] = "-1/8"
        else:
            t, i = place
            tube["interval"][1][t][i] = QUARTERS | off
    return build.rehash(json.loads(json.dumps(answer)))


BELOW = hit((["0", "1"], UP, STILL))  # the second point reaches up to the shelf
ACROSS = hit((["1/4", "3/4"], STILL), (["1", "0"], STILL))  # each end of the box has its mixture


def shelf(below=BELOW, across=ACROSS, beyond="1/4", split="2.875"):
    """A shelf over the end, at a height of 1 to 1.25 and a little more, since contacts at the end
    have to be inside where its errors are a template. Whoever ends below reaches up to it; between
    1/4 and 1 it cuts the capsule; above 2.75 the goal is missed.
    """
    answer = points()
    answer["problem"]["obstacles"] = [build.box_rows((0, build.F(15, 16)), (3, "21/16"))]
    missed = {"goal": [[1, "1", end_error(1, beyond)]]}
    nodes = (1, split, (1, "0.25", below, (1, "1", across, known.REST)), missed)
    answer = known.with_plan(answer, "bracket", ["1.25", "-0.75"], ["2.75", "3.5"], nodes)
    answer["no_plan"]["faces"] = [
        [[[4 + i, "1", end_error(i, "-1/4")]], [[i, "1", end_error(i, "1/4")]]] for i in range(2)
    ]
    return build.rehash(answer | {"corridors": [], "doubt": []})


def narrow(what, half=0):
    """The shelf with a hit where z is 1 to 1.125 high, in the lower or upper half of k.

    In interval 1 the points move up by h = max(k, 0) and by 1 to the right until they reach z.
    """
    answer = shelf()
    parts = [known.REST, known.REST]
    parts[half] = (1, "1", known.REST, (1, "1.125", what, known.REST))
    answer["no_plan"]["tree"] = known.tree((2, "0", *parts))
    return build.rehash(answer)


VALID = {"points": points, "shelf": shelf}
CASES = {}


def bad(why, fresh=points, limits=None, **changes):
    """Registers a bad certificate, as known.bad does."""
    assert why not in {**CASES, **known.CASES}, why
    CASES[why] = (lambda: json.dumps(known.change(fresh(), changes)), limits or {})


bad("too many points", limits={"MAX_REFERENCE_POINTS": 1})

# The body.
bad("an unknown field in a body of parts", problem__body__note="1")
bad("no part", problem__body={"parts": []}, samples=[], sets=[], corridors=[], doubt=[])
bad("a part without a point", problem__body__parts__0__points=[])
bad("a part of point true", problem__body__parts__0__points=[0, True])
bad("a part of a point that is not there", problem__body__parts__1__points=[2])
bad("a body that is a shape alone", known.plain, problem__body={"radius": "0.5"})
bad("separation of a third part", samples__0__sep=[[*BOTH, []]])
bad("separation of one of two parts", samples__0__sep=[[[[2, TOP]]]])
bad("separation of no part", samples__0__sep=[[[2, TOP]]])
bad("contact of the second part only", problem__body__parts__1__vertices__0=["0", "-1.75"])
bad(
    "contact of the second point only",
    problem__body={"parts": [{"points": [0, 1], "radius": "0.5"}]},
    samples__0__sep=[[[[2, TOP]]]],
    sets=[],
    corridors=[],
    doubt=[],
    network__biases__1__1="-0.5",
)
bad(
    "the second point ends outside the goal",
    problem__goal=build.box_rows((1, -1, 1, 0), (3, 3, "2.25", 4)),
    samples__0__p0=["1/2", "0"],
    sets=[],
    corridors=[],
    doubt=[],
)

# The tube.
bad("a second point that reaches too low", tube__interval__1__0__1__b=["1/4", "1/4", "1/4", "2"])
bad("errors of a third point", tube__interval__0__0__append=["1/4", "1/4"])
bad("a width of a third axis", tube__interval__0__0__0=["1/4", "1/4", "0"])
bad("an unknown field in a template", tube__interval__1__0__0=QUARTERS | {"note": "1"})
bad("an unknown field in the errors of an end", tube__final__1__note="1")
bad("ways for a ninth row of the goal", tube__final__1__goal__append=[])
bad("a template without a lower end", tube__interval__1__0__0={"A": AXES[:3], "b": ["1/4"] * 3})
bad("a template that reaches too low", tube__interval__1__0__0__b=["1/4", "1/4", "1/4", "1/2"])
bad("an end without a way", tube__final__1__goal__0=[])
bad("an end whose way is another row's", tube__final__1__goal__0=[[[1, "1"]]])
bad("an end whose way is negative", tube__final__1__goal__0=[[[4, "-1"]]])
NOTHING = {"samples": [], "sets": [], "corridors": [], "doubt": []}
bad("ways as an object, of a bin that nobody asks for", tube__final__1__goal__0={}, **NOTHING)
bad("a way as an object", tube__final__1__goal__0__append={})
bad("a way as a text", tube__final__1__goal__0__append="")
bad("an end with a row that is not there", tube__final__1__goal__0=[[[8, "1"]]])
bad("an end that is missed by the errors", tube__final__1__b=["1.5", *["1/4"] * 7])
bad("touching with a template", samples__0__p0=["0", "-1/4"], sets=[], corridors=[], doubt=[])

# Boxes of doubt.
bad("an unknown field in a box of doubt", doubt__0__note="1")
bad("an unknown field in a room", doubt__0__room__note="1")
bad("p0 of a box with a third entry", doubt__0__p0=["0", "0", "7"])
bad("k of a box with a second entry", doubt__0__k=["0.5", "7"])
bad("room for a third axis", doubt__0__room__p0=["1/8", "1/8", "0"])
bad("room for a second k", doubt__0__room__k=["1/8", "0"])
bad("negative room", doubt__0__room__p0=["-1/8", "1/8"])
bad("room to touch", doubt__0__room__p0=["1/8", "1/4"])
bad("a box that leaves the domain below", doubt__0__k=["-1"], doubt__0__room__k=["1/8"])
bad("a box that leaves the domain above", doubt__0__k=["1"], doubt__0__room__k=["1/8"])
bad("boxes as an object", doubt={})
bad(
    "a box that meets a bin with wider errors",
    doubt__0__k=["1/8"],
    tube__interval__0__0__0=["1/4", "1/2"],
)

# No plan.
SHELF = {
    "problem__obstacles__0": build.box_rows((0, build.F(15, 16)), (2, "21/16"))
}  # which ends before z does
bad("a hit that names no part", shelf, no_plan__tree__2={"hit": [0, 1, "1", [known.ZERO]]})
bad("a hit of part false", shelf, no_plan__tree__4__hit__1=False)
bad("a hit of a part that is not there", shelf, no_plan__tree__4__hit__1=2)
bad("a mixture of three points", shelf, no_plan__tree__4__hit__4__1__0=["1", "0", "0"])
bad(
    "a mixture with a negative weight",
    shelf,
    no_plan__tree__3={"split": [1, "1.5"]},
    no_plan__tree__4__hit__4__1__0=["1.25", "-0.25"],
)
bad("a mixture that sums to a half", lambda: narrow(hit((["1/2", "0"], STILL))))
CHANGES = hit((["1", "0"], STILL), (["0", "1"], STILL), alpha="0")
bad("a mixture that changes with k", lambda: narrow(CHANGES, half=1))
bad("a hit at the other knot", lambda: narrow(hit((["1", "0"], STILL))), **SHELF)
OF_ONE = [["0", "0"], [["0", "0"]]]
bad("a contact with the error of one point", shelf, no_plan__tree__4__hit__4__1__1__0=OF_ONE)
IN_SPACE = [["0", "0"], [["0", "0", "0"], ["0", "0"]]]
bad("a contact with an error in space", shelf, no_plan__tree__4__hit__4__1__1__0=IN_SPACE)
OUTSIDE = [["0", "0.5"], [["0", "0"], ["0", "3/8"]]]
bad("an error of a point outside the tube", shelf, no_plan__tree__2__hit__4__0__1__0=OUTSIDE)
OTHER = [["0", "0.5"], [["0", "1/4"], ["0", "0"]]]
bad("an error of a point without weight", shelf, no_plan__tree__2__hit__4__0__1__0=OTHER)
bad(
    "an error of a point in one of two bins",
    shelf,
    tube__interval__1__1__1__b=["1/4", "1/4", "1/8", "1/4"],
)
bad("a goal row with a fifth error", shelf, no_plan__tree__6__goal__0__2=["0", "1/4", *"000"])
bad("an error of a goal row outside the tube", lambda: shelf(beyond="1/2", split="2.625"))
bad("a goal row that is true", shelf, no_plan__tree__6__goal__0__0=True)
bad(
    "an error of a face outside the tube",
    shelf,
    no_plan__faces__1__1__0__2=end_error(1, "1/2"),
    no_plan__z__hi=["2.75", "2.6"],
    no_plan__tree=[known.REST],
)
bad("an error of a face in one of two bins", shelf, tube__final__0=["1/4", "1/8", "1/4", "1/4"])
bad(
    "an error of a face outside the last interval",
    shelf,
    tube__interval__1__1__0__b=["1/4", "1/4", "1/8", "1/4"],
)
bad("contacts as an object", shelf, no_plan__tree__4__hit__4__append=[["1", "0"], {}])
BESIDE = QUARTERS | {"b": ["1/4", "-1/8", "1/4", "1/4"]}
bad("a template that excludes the model", shelf, tube__interval__1__0__0=BESIDE)
bad(
    "a template of the end that excludes the model",
    shelf,
    tube__final__1__b=["1/4"] * 4 + ["-1/8"] + ["1/4"] * 3,
    no_plan__faces=[
        [[[row, "1", ["1/4", error, "0", "0"]]] for row, error in pair]
        for pair in (((4, "0"), (0, "0")), ((5, "-1/4"), (1, "1/4")))
    ],
    no_plan__z__lo=["0.75", "-0.75"],
    no_plan__tree=[known.REST],
)
WAYS = [[[[row, "1"]]] for row in (0, 2, 1, 3)]
bad(
    "a face without an error of a template", known.bracket, tube__final__1=QUARTERS | {"goal": WAYS}
)
