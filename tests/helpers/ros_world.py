"""A small world of ROS 2 in a process of its own: a platform that slides through a hall with two
posts, says where it is, and does what it is told on /pilot/manoeuvre. Time stands still while the
pilot thinks, so a busy machine changes nothing.

    python ros_world.py OUT.json [X Y]   what was seen, once the goal is reached or time is up;
                                         X Y: where somebody is who might move
"""

import json
import sys
import time

import numpy as np
import rclpy
import sliding
from geometry_msgs.msg import Pose, PoseArray, PoseStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetPlan
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Empty, Float64MultiArray, String

POSTS = [(1.0, -0.4, 1.2, 0.3), (2.2, 0.3, 2.4, 0.9)]
GOAL, NEAR = (3.2, 0.3), 0.4  # [m]
STEP, KNOTS = 4, 40  # knots between poses; cycles at most
PATIENCE = 240.0  # [s] of the clock for an answer, whatever else the machine does
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class World:
    def __init__(self):
        self.node = node = rclpy.create_node("world")
        self.heard = {"k": [], "paths": [], "statements": []}
        node.create_subscription(Float64MultiArray, "/pilot/manoeuvre", self._told, 10)
        node.create_subscription(Path, "/pilot/path", self.heard["paths"].append, KEPT)
        node.create_subscription(String, "/pilot/statement", self._said, 10)
        self.odom = node.create_publisher(Odometry, "/odom", 10)
        self.goal = node.create_publisher(PoseStamped, "/goal_pose", 1)
        self.map = node.create_publisher(OccupancyGrid, "/map", KEPT)
        self.restart = node.create_publisher(Empty, "/pilot/restart", 1)
        self.plan = node.create_client(GetPlan, "/pilot/plan")
        self.who = [float(word) for word in sys.argv[2:]]
        self.movers = node.create_publisher(PoseArray, "/movers", 1)

    def _told(self, message):
        self.heard["k"].append(list(message.data))
        self.names = [dim.label for dim in message.layout.dim]

    def _said(self, message):
        self.heard["statements"].append(message.data)

    def until(self, done):
        """Spin until something has happened."""
        begin = time.monotonic()
        while not done():
            rclpy.spin_once(self.node, timeout_sec=0.1)
            if time.monotonic() - begin > PATIENCE:
                raise SystemExit(f"nothing within {PATIENCE:g} s; heard {self.heard['statements']}")

    def tell_map(self, frame="map"):
        cells = sliding.hall(POSTS)
        message = OccupancyGrid()
        message.header.frame_id = frame
        message.info.resolution = 0.05
        message.info.height, message.info.width = cells.shape
        message.info.origin.position.x, message.info.origin.position.y = -1.0, -1.5
        message.info.origin.orientation.w = 1.0
        message.data = cells.ravel().tolist()
        self.map.publish(message)

    def tell_movers(self, at):
        if self.who:
            one, message = Pose(), PoseArray()
            message.header.frame_id = "map"
            stamp(message, at)
            one.position.x, one.position.y = self.who
            message.poses = [one]
            self.movers.publish(message)

    def posed(self, x, y, at=0):
        message = PoseStamped()
        message.header.frame_id = "map"
        stamp(message, at)
        message.pose.position.x, message.pose.position.y = float(x), float(y)
        message.pose.orientation.w = 1.0
        return message

    def tell_pose(self, place, speed, at):
        message = Odometry()
        message.header.frame_id, message.child_frame_id = "map", "base_link"
        stamp(message, at)
        message.pose.pose.position.x, message.pose.pose.position.y = map(float, place)
        message.pose.pose.orientation.w = 1.0
        message.twist.twist.linear.x, message.twist.twist.linear.y = map(float, speed)
        self.odom.publish(message)


def stamp(message, at):
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(at, 10**9)


def drive(world):
    """Places at all knots, whether the goal was reached, and the time [ns]."""
    at, place, speed = 10**9, np.zeros(2), np.zeros(2)
    begun, knots, k = place, 12, [0.0] * 4
    track = [place.tolist()]
    for _ in range(KNOTS):
        if np.linalg.norm(place - GOAL) <= NEAR:
            return track, True, at
        before = len(world.heard["statements"])
        world.tell_movers(at)
        world.tell_pose(place, speed, at)
        world.until(lambda n=before: len(world.heard["statements"]) > n)
        said = world.heard["statements"][-1]
        if said.startswith("Commitment"):
            number = int(said.split(":")[0].split()[1])
            world.until(lambda n=number: len(world.heard["k"]) > n)
            begun, knots, k = place, 0, world.heard["k"][number]
        for _ in range(STEP):
            knots += 1
            place, speed = sliding.after(begun, k, knots)
            track.append(place.tolist())
        at += STEP * round(sliding.DT * 1e9)
    return track, False, at


def restart(world, place, at):
    """Not before the last manoeuvre has come to rest."""
    world.restart.publish(Empty())
    world.until(lambda: any("restart: expected a robot" in s for s in world.heard["statements"]))
    world.tell_pose(place, np.zeros(2), at + 2 * 10**9)
    while not any(s.startswith("Restarted") for s in world.heard["statements"]):
        before = len(world.heard["statements"])
        world.restart.publish(Empty())  # refused until the pose is there, too
        world.until(lambda n=before: len(world.heard["statements"]) > n)


def main():
    rclpy.init()
    world = World()
    world.until(lambda: world.odom.get_subscription_count() and world.map.get_subscription_count())
    world.until(lambda: world.plan.wait_for_service(0.0) and world.goal.get_subscription_count())
    world.until(world.restart.get_subscription_count)
    world.tell_map("odom")
    world.until(lambda: any("frame 'map'; got 'odom'" in s for s in world.heard["statements"]))
    world.tell_map()
    asked = GetPlan.Request(start=world.posed(0, 0), goal=world.posed(0.4, 0.1), tolerance=0.1)
    answer = None
    while answer is None or "no map" in world.heard["statements"][-1]:  # until the map is there
        future = world.plan.call_async(asked)
        world.until(future.done)
        answer = future.result().plan
    proved = world.heard["statements"][-1]
    world.goal.publish(world.posed(*GOAL))
    world.until(lambda: world.heard["statements"][-1].startswith("The goal is"))
    track, arrived, at = drive(world)
    restart(world, track[-1], at)
    told = {
        "arrived": arrived,
        "track": track,
        "plan": [[p.pose.position.x, p.pose.position.y] for p in answer.poses],
        "proved": proved,
        "statements": world.heard["statements"],
        "names": world.names,
        "paths": [
            [[p.pose.position.x, p.pose.position.y] for p in path.poses]
            for path in world.heard["paths"]
        ],
    }
    with open(sys.argv[1], "w") as file:
        json.dump(told, file)
    rclpy.shutdown()


if __name__ == "__main__":
    main()
