"""Drift parking transcribed from its description in plain Python: slow, scalar, dense matrices, no
shortcuts.

The oracle of the drift tests. It shares nothing with sims.drift_parking, not even the constants.
"""

import math
from math import atan2, ceil, cos, exp, pi, sin, sqrt, tan, tanh

import numpy as np

M, IZ, L, G, MU = 1450.0, 2300.0, 2.4, 9.81, 1.1
A, B = 0.67 * L, L - 0.67 * L
CF, CR = 60_000.0, 160_000.0
SF, SR = MU * M * G * B / L, MU * M * G * A / L
DELTA_MAX, DELTA_STEP = math.radians(38), math.radians(1)
B_MAX, D_MAX = min(SF - 1, 7684.0), min(SR - 1, 7684.0)
H, T = 0.01, 0.1


def tyre(alpha, C, S, fx):
    zeta = sqrt(S**2 - fx**2) / S
    F = zeta * S
    slide = atan2(3 * F, C)
    t = tan(alpha)
    linear = -C * t + C**2 / (3 * F) * abs(t) * t - C**3 / (27 * F**2) * t**3
    s1 = 0.5 - 0.5 * tanh(100 * (alpha + slide))
    s2 = 0.5 - 0.5 * tanh(100 * (alpha - slide))
    return s2 * (s1 * F + (1 - s1) * linear) - (1 - s2) * F


def rates(z, fxr, fb, delta):
    """Derivative of (x, y, psi, r, V, beta, ux, uy), rear slip angle, rear sliding threshold."""
    _, _, psi, r, V, beta, ux, uy = z
    af, ar = atan2(uy + A * r, ux) - delta, atan2(uy - B * r, ux)
    w = ux * cos(delta) + (uy + A * r) * sin(delta)
    fxf = fb * cos(af) ** 2 * (1 - 2 / (1 + exp(min(10 * w, 700.0))))
    fyf, fyr = tyre(af, CF, SF, fxf), tyre(ar, CR, SR, fxr)
    d = delta - beta
    rate = (
        ux * cos(psi) - uy * sin(psi),
        ux * sin(psi) + uy * cos(psi),
        r,
        (A * (fyf * cos(delta) + fxf * sin(delta)) - B * fyr) / IZ,
        (fxf * cos(d) - fyf * sin(d) + fxr * cos(beta) + fyr * sin(beta)) / M,
        (fxf * sin(d) + fyf * cos(d) - fxr * sin(beta) + fyr * cos(beta)) / (M * V) - r,
        (fxr - fyf * sin(delta) + fxf * cos(delta)) / M + r * uy,
        (fyf * cos(delta) + fyr + fxf * sin(delta)) / M - r * ux,
    )
    return np.array(rate), ar, atan2(3 * sqrt(SR**2 - fxr**2), CR)


def kinematic(xi, eta):
    x, y, psi, V = xi
    return np.array(
        [x + T * V * cos(psi), y + T * V * sin(psi), psi + T * V * tan(eta[1]) / L, V + T * eta[0]]
    )


def plan(v):
    """States (64, 4) and inputs (64, 2), look-ahead included."""
    steer = pi - math.atan(tan(math.radians(15)) * L / (A - B))
    side = math.radians(15)
    r_star = MU * G / v * (B / L * cos(steer - side) + A / L * cos(steer + side))
    n_a = ceil((11 - 2 - 0.1) / (5 * T))
    xi, states, inputs = np.array([0, 0, 0, 0.1]), [], []
    for i in range(59):
        if i < n_a:
            eta = ((v - 2.1) / (n_a * T), 0.0)
        elif i == n_a:
            eta = (5.0, 0.0)
        else:
            c = -3 if i == n_a + 1 else 1
            eta = (
                5.0,
                float(np.clip(atan2(c * r_star * L, states[i - 1][3]), -DELTA_MAX, DELTA_MAX)),
            )
        states.append(xi)
        inputs.append(np.array(eta))
        xi = kinematic(xi, eta)
    return np.array(states + 5 * states[-1:]), np.array(inputs + 5 * inputs[-1:])


class Controller:
    """Receding-horizon iLQR with dense matrices and a plain backtracking search."""

    def __init__(self, v):
        self.ref, self.eta = plan(v)
        self.X, self.U = self.ref[:6].copy(), self.eta[:5].copy()
        self.K = self.backward(self.ref[:6])[1]

    def cost(self, X, U, ref):
        dU = np.diff(U, axis=0)
        return (
            30 * (dU**2).sum()
            + 70 * ((ref[:5] - X[:5]) ** 2).sum()
            + 100 * ((ref[5] - X[5]) ** 2).sum()
        )

    def backward(self, ref):
        v, Mx = 100 * (self.X[5] - ref[5]), 100 * np.eye(4)
        ks, Ks, g, hs = [None] * 5, [None] * 5, 0.0, 0.0
        for i in range(4, -1, -1):
            (_, _, psi, V), delta = self.X[i], self.U[i][1]
            Ai, Bi = np.eye(4), np.zeros((4, 2))
            Ai[0, 2], Ai[0, 3] = -T * V * sin(psi), T * cos(psi)
            Ai[1, 2], Ai[1, 3] = T * V * cos(psi), T * sin(psi)
            Ai[2, 3] = T * tan(delta) / L
            Bi[3, 0], Bi[2, 1] = T, T * V * (1 + tan(delta) ** 2) / L
            dU = self.U[i] - self.U[i - 1] if i else np.zeros(2)
            Qx, Qu = 70 * (self.X[i] - ref[i]) + Ai.T @ v, 30 * dU + Bi.T @ v
            Qxx, Qux, Quu = (
                70 * np.eye(4) + Ai.T @ Mx @ Ai,
                Bi.T @ Mx @ Ai,
                30 * np.eye(2) + Bi.T @ Mx @ Bi,
            )
            k, K = -np.linalg.solve(Quu, Qu), -np.linalg.solve(Quu, Qux)
            v = Qx + K.T @ Quu @ k + K.T @ Qu + Qux.T @ k
            Mx = Qxx + Qux.T @ K + K.T @ Qux + K.T @ Quu @ K
            ks[i], Ks[i] = k, K
            g, hs = g - Qu @ k, hs + 0.5 * k @ Quu @ k
        return ks, Ks, g, hs

    def roll_out(self, now, k, epsilon):
        X, U = [now], []
        for i in range(5):
            U.append(self.U[i] + self.K[i] @ (X[i] - self.X[i]) + epsilon * k[i])
            X.append(kinematic(X[i], U[i]))
        return np.array(X), np.array(U)

    def solve(self, j, now):
        ref = self.ref[j : j + 6]
        self.X, self.U = np.vstack([self.X[1:], ref[5]]), np.vstack([self.U[1:], self.eta[j + 4]])
        self.X, self.U = self.roll_out(now, np.zeros((5, 2)), 0.0)
        cost = self.cost(self.X, self.U, ref)
        for _ in range(50):
            k, self.K, g, hs = self.backward(ref)
            if abs(g + hs) < 1e-3:
                break
            epsilon, accepted = 1.0, False
            while epsilon > 0.05 and not accepted:
                X, U = self.roll_out(now, k, epsilon)
                new = self.cost(X, U, ref)
                accepted = (cost - new) / (epsilon * g + epsilon**2 * hs) > 0.1
                if accepted:
                    self.X, self.U, cost = X, U, new
                else:
                    epsilon *= 0.95
            if epsilon < 0.05:
                break
        return self.U[0]


def limited(delta, last):
    if abs(delta - last) > DELTA_STEP:
        delta = last + math.copysign(DELTA_STEP, delta - last)
    return min(max(delta, -DELTA_MAX), DELTA_MAX)


def runge_kutta(f, z):
    f1 = f(z, 0)
    f2 = f(z + H / 2 * f1, 1)
    f3 = f(z + H / 2 * f2, 2)
    f4 = f(z + H * f3, 3)
    return z + H / 6 * (f1 + 2 * f2 + 2 * f3 + f4)


def simulate(v, threshold, steps_after_switch=400):
    """Dictionary: states (781, 8), NaN where not simulated; switch; steer at the switch; commands
    {j: (A, delta)}.
    """
    controller = Controller(v)
    commands = {0: controller.U[0].copy()}
    solve_at = {(10 * j - 6, 3) if 6 <= j <= 12 else (10 * j - 5, 1): j for j in range(1, 40)}
    a0, fr0 = D_MAX / M, sqrt(SR**2 - D_MAX**2)
    z = np.array([0, 0, 0, 0, 0.1, 0, 0, 0])
    states, steers = [z], [0.0]
    f2 = np.array([0, 0, 0, 0, a0, 0, a0, 0])
    f3 = np.array([H / 2 * a0, 0, 0, 0, 0, 0, 0, 0])
    f4 = np.array(
        [0, 0, 0, (-A * SF + B * fr0) / IZ, a0, -(SF + fr0) / (0.1 * M), a0, -(SF + fr0) / M]
    )
    z = z + H / 6 * (2 * f2 + 2 * f3 + f4)
    memory = {
        "delta": 0.0,
        "vdot": a0,
        "ar": pi / 2,
        "slide": atan2(3 * fr0, CR),
        "command": commands[0],
    }

    def tracking(n):
        def f(z, stage):
            if (n, stage) in solve_at:
                j = solve_at[n, stage]
                memory["command"] = commands[j] = controller.solve(j, z[[0, 1, 2, 4]]).copy()
            fxr = min(max(2 * M * (memory["command"][0] - memory["vdot"]), 0.0), D_MAX)
            delta = memory["delta"] if memory["ar"] > memory["slide"] else memory["command"][1]
            delta = limited(delta, memory["delta"])
            rate, ar, slide = rates(z, fxr, 0.0, delta)
            memory.update(delta=delta, vdot=rate[4], ar=ar, slide=slide)
            return rate

        return f

    states.append(z)
    steers.append(0.0)
    for n in range(1, 390):
        z = runge_kutta(tracking(n), z)
        states.append(z)
        steers.append(memory["delta"])
    beyond = [s[5] > threshold for s in states]
    switch = next(i for i in range(380) if all(beyond[i : i + 10])) + 1
    states, z, delta = states[: switch + 1], states[switch].copy(), steers[switch]
    z[6:] = z[4] * cos(z[5]), z[4] * sin(z[5])
    states[switch] = z
    memory["delta"] = limited(z[5], delta)

    def braking(z, stage):
        memory["delta"] = limited(z[5], memory["delta"])
        return rates(z, 0.0, -B_MAX, memory["delta"])[0]

    for _ in range(steps_after_switch):
        z = runge_kutta(braking, z)
        states.append(z)
    held = 781 - len(states) if steps_after_switch == 400 else 0
    full = np.full((781, 8), np.nan)
    full[: len(states) + held] = np.array(states + held * states[-1:])
    return {"states": full, "switch": switch, "steer": delta, "commands": commands}
