"""Episodes of a robot that is exactly where its network says."""

import math

import numpy as np
from toy_models import line_model, resting, told, toy_case

import parc_jax as pj
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.system import TURNS

PATIENT = pj.drive.Effort(candidates=64, deadline=300.0)


def driven(turning: bool, n: int = 4, spans=None):
    """n commitments, each left half way, and a block far away; spans: of the block."""
    if turning:
        model, _ = toy_case(0)
        model = resting(told(model, rotation=(TURNS,)))
    else:
        model = line_model(4, 0.01, rests=True)
    loop = pj.drive.Loop(
        model, 0.05, leave=0.5, given=(1,), uncertainty=pj.Uncertainty(start=0.01), effort=PATIENT
    )
    half, seconds = model.time.n_steps // 2, model.time.t_f / 2
    pose = np.array([0.3, -0.2, 0.7] if turning else [0.3, -0.2])
    block = pj.box([30.0, 30.0], [31.0, 31.0])
    out = []
    for i in range(n):
        now = seconds * i
        made = spans and [pj.problem.Span(span, model.time.dt, now) for span in spans]
        asked = {"at": now, "spans": made}
        step = loop.step(pose, [0.1], [block], lambda seen: -seen.path[:, -1, 0], **asked)
        assert step.new, step.reason
        out.append(step.committed)
        offsets, _ = trajectories(model.net, model.layout, step.committed.k[None])
        way = offsets[0, half, :2]
        if turning:
            c, s = math.cos(pose[2]), math.sin(pose[2])
            way = np.array([c * way[0] - s * way[1], s * way[0] + c * way[1]])
        pose = np.concatenate([pose[:2] + way, pose[2:] + 0.3])
    return out
