"""Dynobench's own models, asked over a pipe. Run by an interpreter that has dynobench and the NumPy
that it was compiled for, which is older than the one that parc_jax needs; loads nothing else.
"""

import os
import pickle
import sys
from functools import cache

import dynobench
import numpy as np

TICK = 0.1  # [s] the models' own step


@cache
def model(name, scene=""):
    """A model, with the obstacles of a scene if one is named."""
    file = f"{dynobench.PKGDIR}models/{name}.yaml"
    if scene:
        return dynobench.robot_factory_with_env(file, f"{dynobench.PKGDIR}envs/{name}/{scene}.yaml")
    return dynobench.robot_factory(file, [], [])


def folder():
    """Where dynobench keeps its scenes."""
    return dynobench.PKGDIR


def steps(name, start, controls):
    """(n + 1, n_x) states from a start (n_x,) under controls (n, n_u), within their limits."""
    plant = model(name)
    low, high = plant.get_u_lb(), plant.get_u_ub()
    found = np.tile(np.asarray(start, float), (len(controls) + 1, 1))
    for i, control in enumerate(np.clip(controls, low, high)):
        plant.step(found[i + 1], found[i], control, TICK)
    return found


def towards(name, start, commands):
    """The same for a model with speeds as its last two states: commands (n, 2) are speeds, towards
    which it accelerates as its limits allow.
    """
    found = [np.asarray(start, float)]
    for command in commands:
        found.append(steps(name, found[-1], (command - found[-1][-2:])[None] / TICK)[1])
    return np.stack(found)


def distances(name, scene, states):
    """(n,) [m] from the robot in states (n, n_x) to the nearest obstacle of a scene, as dynobench
    measures it.
    """
    plant, found = model(name, scene), []
    for state in states:
        told = dynobench.CollisionOut()
        plant.collision_distance(state, told)
        found.append(told.distance)
    return np.array(found)


ANSWERS = {f.__name__: f for f in (folder, steps, towards, distances)}


def serve():
    """Answer until nobody asks: (True, answer), or (False, what went wrong). The models print: what
    they print goes nowhere.
    """
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    while True:
        try:
            name, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = True, ANSWERS[name](*arguments)
        except Exception as error:  # of whoever asks: told, and the next question is answered
            answer = False, f"{type(error).__name__}: {error}"
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    serve()
