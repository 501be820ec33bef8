"""Known answers and metamorphic laws of samples and sets."""

import copy
import itertools
import random
from fractions import Fraction as F

import answer_files as build
import known
import pytest

from parc_jax import checker

ULP = F(1, 2**40)


def verdict(answer):
    try:
        checker.check_answer(build.rehash(answer))
    except checker.Rejected:
        return False
    return True


def spoilt(**changes):
    return verdict(known.change(known.plain(), changes))


@pytest.mark.parametrize(
    "body", [{"radius": "0.5"}, {"vertices": [["0", "-0.5"], ["0.5", "0.25"], ["-0.5", "0.25"]]}]
)
def test_touching_is_refused_and_one_ulp_of_room_accepted(body):
    """Gap = body + tube exactly: closed obstacles, strict separation."""
    body = build.one_part(body)
    for room, accepted in ((F(0), False), (ULP, True), (-ULP, False)):
        top = build.text(F(-3, 4) - room)
        assert spoilt(problem__body=body, problem__obstacles__0__b__1=top, sets=[]) is accepted
        assert spoilt(problem__body=body, problem__obstacles__0__b__1=top, samples=[]) is accepted


def test_touching_along_a_diagonal_of_integer_length():
    """Direction (3, 4) has length 5: no rounding of the root, so the room is exact here too."""
    for room, accepted in ((F(0), False), (ULP, True)):
        # (3, 4) . p >= 0 on the path, so b + 5/2 + 7/4 must be below 0
        obstacle = {"A": [["3", "4"]], "b": [build.text(-F(17, 4) - room)]}
        sep = [[[[2, [[0, "1"]]]]]]
        assert spoilt(problem__obstacles__0=obstacle, samples__0__sep=sep, sets=[]) is accepted


def test_the_goal_is_closed():
    for room, accepted in ((F(0), True), (-ULP, False)):
        assert spoilt(problem__goal__b__0=build.text(F(9, 4) + room), sets=[]) is accepted


def test_decimals_are_not_floats():
    """0.1 + 0.2 is exactly 0.3: the goal ends there and is reached."""
    changes = {
        "samples__0__p0": ["0.1", "0"],
        "network__biases__1__2": "0.2",
        "network__biases__1__0": "0.1",
    }
    changes |= {"problem__goal": build.box_rows((-9, -9), (9, 9)), "problem__goal__b__0": "0.3"}
    changes |= {"tube__final": [["0", "0"]] * 2, "sets": []}
    assert spoilt(**changes)
    assert not spoilt(**changes | {"problem__goal__b__0": (0.1 + 0.2 - 1e-16).hex()})


def wall(x, thick, steps=None):
    """A wall across the path of the plain scene, tube and body small."""
    answer = known.plain(((x - thick, -9), (x + thick, 9)))
    answer["problem"]["body"] = build.one_part({"radius": "0"})
    answer["tube"] |= {"interval": [[[["0", "0"]]] * 2] * 2, "final": [["0", "0"]] * 2}
    if steps:
        answer["problem"]["obstacles"][0]["steps"] = steps
    return answer | {"corridors": copy.deepcopy(answer["samples"])}


def separations(n_runs):
    """Many candidate separations by the rows of a box."""
    choices = [[[i, "1"]] for i in range(4)] + [
        [[i, "1"], [j, "0.5"]] for i, j in itertools.permutations(range(4), 2)
    ]
    for combination in itertools.product(choices, repeat=n_runs):
        yield [[[[t + 1, m] for t, m in enumerate(combination)]]]


@pytest.mark.parametrize(
    "x, thick",
    [
        (1.5, 1e-9),
        pytest.param(0.5, 1e-6, marks=pytest.mark.slow),
        pytest.param(1.0, 0.1, marks=pytest.mark.slow),
    ],
)
def test_a_wall_between_knots_is_never_jumped(x, thick):
    """Knots at x = 0, 1, 2. Also the jump over a wall that is hidden by a bounded start set: P0 =
    [-.1, .1]^2.
    """
    answer = wall(x, thick)
    answer["problem"]["start"] = build.box_rows((-0.1, -0.1), (0.1, 0.1))
    for sep in separations(2):
        for part in build.KINDS:
            assert not verdict(build.only(answer, part, answer[part][0] | {"sep": sep}))


def test_a_wall_that_exists_only_in_other_intervals_is_passed():
    answer = wall(1.5, 0.1, steps=[0, 0])
    for entry in build.entries(answer):
        entry["sep"] = [[[[1, [[2, "1"]]]]]]
    assert verdict(answer)
    answer["problem"]["obstacles"][0]["steps"] = [1, 1]
    for entry in build.entries(answer):
        entry["sep"] = [[[[2, [[2, "1"]]]]]]
    assert not verdict(answer)


def neuron(weight, bias):
    """The plain network with another first neuron of the given weight and bias, which adds to y."""
    weights = [[[weight], ["1"]], [["0", "0"], ["1/64", "1"], ["0", "0"], ["1/64", "2"]]]
    return {"weights": weights, "biases": [[bias, "0"], ["1", "0", "2", "0"]]}


@pytest.mark.parametrize("bias, patterns", [("1", "1"), ("-1", "0"), ("0", "01")])
def test_constant_neurons_have_the_right_sign(bias, patterns):
    """A neuron that is constant and positive is on; a constant zero may be called either."""
    for bit in "01":
        assert spoilt(network=neuron("0", bias), sets__0__pattern=bit + "1") is (bit in patterns)


def test_a_dead_layer_does_not_hide_its_successor():
    """Layer 2 is constant because layer 1 is off; its positive bias still counts."""
    weights = [[["1"]], [["5"]], [["0"], ["1"], ["0"], ["2"]]]
    network = {"weights": weights, "biases": [["-3"], ["0.25"], ["1", "0", "2", "0"]]}
    for pattern, accepted in (("01", True), ("00", False), ("11", False), ("10", False)):
        assert spoilt(network=network, sets__0__pattern=pattern) is accepted


@pytest.mark.parametrize("power", [-1000, -30, 30, 1000])
def test_rescaling_a_neuron_changes_nothing(power):
    """First weights times 2^m, outgoing times 2^-m: the same function, cells and verdicts."""
    answer = build.scene(3)
    for layer, column in ((0, None), (1, 0)):
        for row in answer["network"]["weights"][layer][: 1 if column is None else None]:
            for i in range(len(row)) if column is None else [column]:
                row[i] = f"{build.value(row[i]) * F(2) ** (power if layer == 0 else -power)}"
    answer["network"]["biases"][0][0] = (
        f"{build.value(answer['network']['biases'][0][0]) * F(2) ** power}"
    )
    assert verdict(answer)


def spike():
    """y_2 of the plain scene plus a spike of height -4 on a share of 1e-8 of the k axis, at k =
    0.75.
    """
    w = F(1, 10**8)
    bias = [[build.text(-(F(3, 4) + s * w)) for s in (-1, 0, 1)]]
    height = build.text(-4 / w)
    weights = [[["1"], ["1"], ["1"], ["1"]]]
    down = ["0", height, build.text(8 / w), height]
    weights.append([["0"] * 4, ["1", *down[1:]], ["0"] * 4, ["2", "0", "0", "0"]])
    return {"weights": weights, "biases": [["0", *bias[0]], ["1", "0", "2", "0"]]}


def test_a_hidden_spike_is_found():
    """Everywhere else is safe; sets beside the spike do not contain it, and nothing that does is
    accepted.
    """
    changes = {
        "network": spike(),
        "tube__interval": [[[["0", "0"]]] * 2] * 2,
        "sets__0__pattern": "1000",
    }
    assert spoilt(**changes)
    inside = build.text(F(3, 4))
    assert not spoilt(**changes, samples__0__k=[inside], sets=[])
    for pattern in map("".join, itertools.product("01", repeat=3)):
        assert not spoilt(
            **changes | {"sets__0__pattern": "1" + pattern}, samples=[], sets__0__k=[inside]
        )
    for low, high, accepted in (
        ("0.5", "0.74", True),
        ("0.76", "0.9", True),
        ("0.5", "0.9", False),
    ):
        safe = (0, "2.75", {"safe": known.ABOVE}, known.REST)
        nodes = (1, "1.5", known.REST, (1, "1.75", (0, "1.25", known.REST, safe), known.REST))
        answer = known.with_plan(known.plain(), "bracket", ["1", "-1"], ["3", "3"], nodes)
        kept = {key: changes[key] for key in ("network", "tube__interval")}
        assert (
            verdict(known.change(answer, kept | {"problem__domain": {"lo": [low], "hi": [high]}}))
            is accepted
        )


def refined(answer):
    """The same answer with a knot inserted in the middle of every interval: piecewise linear, so
    nothing changes.
    """
    new, T = copy.deepcopy(answer), answer["problem"]["steps"]
    n = answer["problem"]["n_p"]
    new["problem"]["steps"] = 2 * T
    for key in ("weights", "biases"):
        last = build.value(answer["network"][key][-1])
        zero = [F(0)] * len(last[0]) if key == "weights" else F(0)
        knots = [[zero] * n] + [last[t * n : (t + 1) * n] for t in range(T)]
        rows = []
        for a, b in itertools.pairwise(knots):
            if key == "weights":
                rows += [
                    [(u + v) / 2 for u, v in zip(x, y, strict=True)]
                    for x, y in zip(a, b, strict=True)
                ] + b
            else:
                rows += [(x + y) / 2 for x, y in zip(a, b, strict=True)] + b
        new["network"][key][-1] = build.text(rows + last[T * n :])
    new["tube"]["interval"] = [[e for e in b for _ in range(2)] for b in answer["tube"]["interval"]]
    for obstacle in new["problem"]["obstacles"]:
        if "steps" in obstacle:
            obstacle["steps"] = [2 * obstacle["steps"][0], 2 * obstacle["steps"][1] + 1]
    for entry in build.entries(new):
        entry["sep"] = [[[[2 * stop, m] for stop, m in runs]] for (runs,) in entry["sep"]]
    return new


def moved(answer):
    """World and plans shifted by (7, -3)."""
    new, shift = copy.deepcopy(answer), [F(7), F(-3)]
    for rows in (new["problem"]["goal"], new["problem"]["start"], *new["problem"]["obstacles"]):
        pairs = zip(build.value(rows["A"]), build.value(rows["b"]), strict=True)
        rows["b"] = build.text([b + build.dot(a[:2], shift) for a, b in pairs])
    for entry in build.entries(new):
        entry["p0"] = build.text(
            [x + s for x, s in zip(build.value(entry["p0"]), shift, strict=True)]
        )
    return new


def scaled(answer):
    """Obstacle rows scaled by 3, multipliers by 1/7."""
    new = copy.deepcopy(answer)
    for obstacle in new["problem"]["obstacles"]:
        obstacle["A"] = build.text([[3 * x for x in row] for row in build.value(obstacle["A"])])
        obstacle["b"] = build.text([3 * x for x in build.value(obstacle["b"])])
    for entry in build.entries(new):
        for _, multipliers in itertools.chain(*itertools.chain(*entry["sep"])):
            multipliers[:] = [[i, build.text(build.value(m) / 7)] for i, m in multipliers]
    return new


def permuted(answer):
    """Neurons of the first layer in reverse order."""
    new, n = copy.deepcopy(answer), len(answer["network"]["biases"][0])
    new["network"]["weights"][0].reverse()
    new["network"]["biases"][0].reverse()
    for row in new["network"]["weights"][1]:
        row.reverse()
    for piece in new["sets"]:
        piece["pattern"] = piece["pattern"][:n][::-1] + piece["pattern"][n:]
    return new


def doubled(answer):
    """The first neuron twice, with half its outgoing weights."""
    new = copy.deepcopy(answer)
    new["network"]["weights"][0].insert(0, new["network"]["weights"][0][0])
    new["network"]["biases"][0].insert(0, new["network"]["biases"][0][0])
    for row in new["network"]["weights"][1]:
        row[:1] = [build.text(build.value(row[0]) / 2)] * 2
    for piece in new["sets"]:
        piece["pattern"] = piece["pattern"][0] + piece["pattern"]
    return new


def shrunken(answer, rng):
    """The same scene with a third of its room taken away or twice as much given."""
    new = copy.deepcopy(answer)
    for row in new["problem"]["obstacles"]:
        row["b"] = build.text([b + build.dyadic(rng, F(1, 2)) for b in build.value(row["b"])])
    return new


@pytest.mark.parametrize("change", [refined, moved, scaled, permuted, doubled])
def test_changes_that_mean_nothing_keep_every_verdict(change):
    rng, seen = random.Random(5), set()
    for seed in range(6):
        answer = build.scene(
            seed, T=4, hidden=(3, 2), body=build.DISC if seed % 2 else build.TRIANGLE
        )
        for variant in (answer, shrunken(answer, rng), shrunken(answer, rng)):
            for part in build.KINDS:
                single = build.only(variant, part)
                seen.add(verdict(single))
                assert verdict(change(single)) is verdict(single)
    assert seen == {True, False}


def test_an_easier_question_keeps_a_proof_valid():
    """Smaller tube, body, obstacles, larger goal and start set."""
    for seed in range(4):
        answer = build.scene(seed, T=4, hidden=(3,))
        for part in ("interval", "final"):
            answer["tube"][part] = build.text(halved(build.value(answer["tube"][part])))
        answer["problem"]["body"] = build.one_part({"radius": "0.1"})
        for obstacle in answer["problem"]["obstacles"]:
            obstacle["b"] = build.text([b - F(1, 16) for b in build.value(obstacle["b"])])
        for rows in (answer["problem"]["goal"], answer["problem"]["start"]):
            rows["b"] = build.text([b + F(1, 16) for b in build.value(rows["b"])])
        assert verdict(answer)


def halved(x):
    return [halved(v) for v in x] if isinstance(x, list) else x / 2
