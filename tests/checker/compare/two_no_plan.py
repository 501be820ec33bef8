"""Mutants of proofs that no plan exists and of volumes: both checkers must give the same verdict.

Random scenes of one point with the trees of tests/helpers/tree_search.py, those of bodies.py
(several points and parts, space, templates) with the trees of tree_points.py, and the hand-made
ones of known.py and known_points.py.
"""

import copy
import itertools
import json

import answer_files as build
import bodies
import known
import known_points
import mutants
import tree_points
import tree_search
import two_mutants

MUTANTS = 30  # of one answer
VALID = known.VALID | known_points.VALID
HAND_MADE = [name for name, make in VALID.items() if make()["no_plan"] is not None]
NAMES = ("goal", "start", "hit", "safe", "open")


def within(node):
    """The node, or the reason of a leaf by bounds."""
    return node.get("bounded", node)


def nodes(rng, plan, *names):
    """A random node of the tree with one of these names, by its only key, or IndexError."""
    found = [within(node) for node in plan["tree"]]
    return rng.choice([node for node in found if next(iter(node)) in (names or (*NAMES, "split"))])


def rename(rng, plan):
    node = nodes(rng, plan)
    (what,) = node.values()
    node.clear()
    node[rng.choice(NAMES)] = what


def hit(rng, plan):
    return nodes(rng, plan, "hit")["hit"]


def odd_hit(rng, plan):
    """Another obstacle, part, interval or moment."""
    what = hit(rng, plan)
    odd = [rng.randint(-1, 3), rng.randint(-1, 3), rng.randint(-1, 5), rng.choice("01")]
    place = rng.randrange(len(odd))
    what[place] = odd[place]


def weights(rng, plan):
    """Other weights of a mixture: shaken, or moved to another point."""
    group = rng.choice(hit(rng, plan)[4])
    if rng.random() < 0.5:
        two_mutants.shake(rng, group[0])
    else:
        rng.shuffle(group[0])


def goal_error(rng, plan):
    """Another error of a goal row: shaken, dropped, doubled."""
    entries = [*itertools.chain(*plan["faces"])]
    entries += [within(node)["goal"] for node in plan["tree"] if "goal" in within(node)]
    entry = rng.choice(rng.choice(entries))
    change = rng.choice(["shaken", "dropped", "doubled"])
    if change == "dropped":
        entry.pop(2)
    elif change == "shaken":
        two_mutants.shake(rng, entry[2])
    else:
        entry[2] = [build.text(2 * build.value(x)) for x in entry[2]]


def copied(rng, plan):
    tree = plan["tree"]
    tree.insert(rng.randrange(len(tree) + 1), copy.deepcopy(rng.choice(tree)))


def other_axis(rng, plan):
    nodes(rng, plan, "split")["split"][0] = rng.randint(-1, 5)


MUTATIONS = {
    "nothing": lambda r, p: None,
    "a number": lambda r, p: two_mutants.shake(r, p["tree"]),
    "a cut": lambda r, p: two_mutants.shake(r, nodes(r, p, "split")),
    "an axis": other_axis,
    "a face": lambda r, p: two_mutants.shake(r, p["faces"]),
    "a row of a face": lambda r, p: r.choice(r.choice(r.choice(p["faces"]))).__setitem__(
        0, r.randint(-1, 7)
    ),
    "the box of z": lambda r, p: two_mutants.shake(r, p["z"]),
    "a reason": rename,
    "by bounds": lambda r, p: mutants.bound(r, p["tree"]),
    "a hit": odd_hit,
    "a contact": lambda r, p: two_mutants.shake(r, hit(r, p)[-1]),
    "a contact dropped": lambda r, p: two_mutants.drop(r, hit(r, p)[-1]),
    "a group's contact dropped": lambda r, p: two_mutants.drop(r, r.choice(hit(r, p)[4])[1]),
    "weights": weights,
    "a goal row's error": goal_error,
    "a combination": lambda r, p: two_mutants.shake(r, nodes(r, p, "goal", "start")),
    "a node dropped": lambda r, p: two_mutants.drop(r, p["tree"]),
    "a node copied": copied,
    "the kind": lambda r, p: p.update(kind=r.choice(["proved", "bracket", "likely"])),
}
QUESTION = two_mutants.QUESTION
QUESTIONS = [name for name in QUESTION if not name.startswith("touch") and name != "ways"]


def of_points(rng):
    """A bracket: a small goal for the first point, and an obstacle over it."""
    problem, network, tube = bodies.scene(rng)
    n, size = problem["n_p"], problem["points"] * problem["n_p"] + problem["n_q"]
    for i in [*range(n), *range(size, size + n)]:
        problem["goal"]["b"][i] = build.text(build.F(rng.randint(2, 6), 4))
    for i in [*range(n, size), *range(size + n, 2 * size)]:
        problem["goal"]["b"][i] = build.text(build.F(rng.randint(1, 40), 4))
    half = [build.F(rng.randint(1, 8), 4) for _ in range(n)]
    near = build.box_rows([-x for x in half], [x + rng.randint(0, 1) for x in half])
    problem["obstacles"][0] |= near
    question = [problem, network, tube]

    def corners(b, t, i):
        return bodies.corners(tube["interval"][b][t][i], n)

    def attempt(middle):
        _, y = build.evaluate(network, middle[n:])
        last = problem["steps"] * problem["points"] * n - n
        p0 = [a - c for a, c in zip(middle[:n], y[last : last + n], strict=True)]
        return bodies.separation(problem, network, p0, middle[n:])

    plan = tree_points.grow(rng, question, corners, attempt, depth=4)
    return build.answer(*question, no_plan=plan)


def source(rng):
    """An answer with a part no_plan and nothing else."""
    if rng.random() < 0.2:
        return VALID[rng.choice(HAND_MADE)]()
    if rng.random() < 0.6:
        return of_points(rng)
    answer = build.scene(
        rng.randrange(10**6),
        T=4,
        hidden=(3,),
        bins=rng.choice([(1, 1), (2, 1), (2, 2)]),
        body=rng.choice([build.DISC, build.TRIANGLE]),
        starts=rng.random() < 0.5,
        counts=(0, 0, 0),
    )
    parts = [answer[part] for part in ("problem", "network", "tube")]
    return build.rehash(answer | {"no_plan": tree_search.grow(*parts, depth=5)})


def batch(rng, left, valid=None):
    """Mutants of one answer."""
    answer = valid or source(rng)
    for _ in range(MUTANTS):
        mutant = copy.deepcopy(answer)
        try:
            if rng.random() < 0.2:
                what = rng.choice(QUESTIONS)
                QUESTION[what](rng, mutant)
            else:
                what = rng.choice(list(MUTATIONS))
                MUTATIONS[what](rng, mutant["no_plan"])
        except (IndexError, AttributeError, TypeError):  # nothing of this kind to change
            continue
        yield what, json.dumps(build.rehash(mutant))
