"""Slow and plain: the linear regions of a tiny network over a polytope, in rational arithmetic, by
the definition.
"""

from fractions import Fraction
from itertools import combinations


def exact_regions(net, A, b):
    """{pattern: exact vertices} of all regions with interior: leaf by leaf, vertices by all
    n-subsets of rows.
    """
    layers = [
        ([[Fraction(v) for v in row] for row in W.tolist()], [Fraction(v) for v in bias.tolist()])
        for W, bias in zip(net.weights[:-1], net.biases[:-1], strict=True)
    ]
    n = net.n_in
    domain = [
        ([Fraction(v) for v in row], Fraction(beta))
        for row, beta in zip(A.tolist(), b.tolist(), strict=True)
    ]
    identity = [([Fraction(int(i == j)) for j in range(n)], Fraction(0)) for i in range(n)]
    found = {}

    def descend(rows, pattern, layer, forms):
        if layer == len(layers):
            found[pattern] = vertices(rows, n)
            return
        W, bias = layers[layer]
        neuron(
            rows,
            pattern,
            layer,
            [affine(w, beta, forms) for w, beta in zip(W, bias, strict=True)],
            0,
            (),
        )

    def neuron(rows, pattern, layer, z, j, kept):
        if j == len(z):
            descend(rows, pattern, layer + 1, kept)
            return
        gradient, constant = z[j]
        values = [dot(gradient, v) + constant for v in vertices(rows, n)]
        off = ([Fraction(0)] * n, Fraction(0))
        below, above = (gradient, -constant), ([-g for g in gradient], constant)
        if max(values) <= 0:
            neuron(rows, (*pattern, False), layer, z, j + 1, (*kept, off))
        elif min(values) >= 0:
            neuron(rows, (*pattern, True), layer, z, j + 1, (*kept, z[j]))
        else:
            neuron([*rows, below], (*pattern, False), layer, z, j + 1, (*kept, off))
            neuron([*rows, above], (*pattern, True), layer, z, j + 1, (*kept, z[j]))

    descend(domain, (), 0, identity)
    return found


def affine(w, beta, forms):
    """sum_i w_i forms_i + beta for affine forms (gradient, constant)."""
    n = len(forms[0][0])
    gradient = [
        sum((wi * g[c] for wi, (g, _) in zip(w, forms, strict=True)), Fraction(0)) for c in range(n)
    ]
    return gradient, sum((wi * c for wi, (_, c) in zip(w, forms, strict=True)), beta)


def dot(a, x):
    return sum((p * q for p, q in zip(a, x, strict=True)), Fraction(0))


def vertices(rows, n):
    """All vertices of {a.x <= b}."""
    out = set()
    for subset in combinations(rows, n):
        x = solve([a for a, _ in subset], [b for _, b in subset])
        if x is not None and all(dot(a, x) <= b for a, b in rows):
            out.add(tuple(x))
    return out


def solve(M, c):
    """Gauss over the rationals; None if singular."""
    n = len(M)
    M = [[*row, v] for row, v in zip(M, c, strict=True)]
    for i in range(n):
        pivot = next((r for r in range(i, n) if M[r][i]), None)
        if pivot is None:
            return None
        M[i], M[pivot] = M[pivot], M[i]
        M[i] = [v / M[i][i] for v in M[i]]
        for r in range(n):
            if r != i and M[r][i]:
                M[r] = [v - M[r][i] * u for v, u in zip(M[r], M[i], strict=True)]
    return [row[n] for row in M]
