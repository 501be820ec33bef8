"""Recorded runs out of bags: forty recordings are written as a robot would, then read, learned
from, and asked about a scene.

Needs the extra `bags`: `pip install 'parc_jax[bags]'`. Writes the folder `bags` and `answer.mcap`.
"""

import math

import jax
import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import parc_jax as pj
from sims.ros.foxglove import write_mcap

ros, rng = get_typestore(Stores.ROS2_HUMBLE), np.random.default_rng(0)
T = {name.rsplit("/", 1)[1]: kind for name, kind in ros.types.items()}


def put(bag, where, seconds, message):
    bag.write(where, round(seconds * 1e9), bytes(ros.serialize_cdr(message, where.msgtype)))


for number in range(40):
    with Writer(f"bags/{number:02}", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        odom = bag.add_connection("/odom", "geometry_msgs/msg/PoseStamped", typestore=ros)
        orders = bag.add_connection("/cmd_vel", "geometry_msgs/msg/Twist", typestore=ros)
        pose, speed, command = np.array([3.0, -1.0, 0.4]), np.zeros(2), np.zeros(2)
        for tick in range(375):  # 50 Hz; 1.1 s of driving, 0.4 s of rest
            now = 1.7e9 + 100.0 * number + 0.02 * tick
            if tick % 75 in (5, 60):
                command = rng.uniform([0.3, -0.6], [1.0, 0.6]) if tick % 75 == 5 else np.zeros(2)
                linear, angular = (
                    T["Vector3"](command[0], 0.0, 0.0),
                    T["Vector3"](0.0, 0.0, command[1]),
                )
                put(bag, orders, now, T["Twist"](linear, angular))
            turn = T["Quaternion"](0.0, 0.0, math.sin(pose[2] / 2), math.cos(pose[2] / 2))
            told = T["Pose"](T["Point"](pose[0], pose[1], 0.0), turn)
            stamp = T["Time"](int(now), round(now % 1 * 1e9))
            put(bag, odom, now, T["PoseStamped"](T["Header"](stamp, "odom"), told))
            speed += 0.2 * (command - speed) + 0.004 * rng.normal(
                size=2
            )  # a lag of 0.1 s, and noise
            pose += 0.02 * np.array(
                [speed[0] * math.cos(pose[2]), speed[0] * math.sin(pose[2]), speed[1]]
            )


grid, K = pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.05), pj.box([0.3, -0.6], [1.0, 0.6])
runs = pj.exchange.load_bags(
    "bags", grid, pose="/odom", command="/cmd_vel", k=("linear.x", "angular.z"), domain=K
)
train, held = runs.split(0.5)  # recordings stay whole
net = pj.learning.train(train, hidden=(8, 8), key=jax.random.key(0), seeds=2, steps=1500)
claim = pj.learning.bound_error(net, held, None, eps=0.15, delta=0.05, bins=(1, 1), train=train)
model = pj.learning.trajectory_model(net, claim)

ahead = pj.box([1.3, 0.5, -np.pi], [2.0, 1.2, np.pi])  # x, y of the goal in the map, any heading
boxes = [pj.box([1.3, -0.2], [1.9, 0.2]), pj.box([0.4, 0.8], [1.0, 1.6])]
problem = pj.reach_avoid(ahead, boxes, 0.12)
answer = pj.Planner(model).solve(
    problem, jax.random.key(1), pj.Settings(samples=20), at=[0.8, 0.3, 0.5]
)
print(runs.n, "runs;", held.n, "of them held out")
print(answer.summary())
assert answer.status is pj.types.Status.PROVED
write_mcap("answer.mcap", answer)
