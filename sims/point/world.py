"""Safety-Gymnasium's Point or Car among goal, hazards and vases, in MuJoCo: how a world is drawn,
built, judged. Needs NumPy and MuJoCo alone, so that it also runs beside the original package.

Laws, numbers and the order of random draws are those of safety-gymnasium 1.0.0 (Apache-2.0, the
OmniSafe team; point.xml and car.xml are its files), so that equal seeds give equal worlds.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import mujoco
import numpy as np

SUBSTEPS = 10  # steps of MuJoCo with one action
STEPS = 1000  # of an episode
HAZARD, GOAL, VASE = 0.2, 0.3, 0.1  # [m] radii, and half the edge of a vase
SINK = 4e-5  # [m] by which a vase is set down lower, as its contact is soft
VASE_DENSITY, VASE_SLOW = 0.001, 1e-4  # [kg/m^3]; [m/s] below which a vase counts as at rest
TRIES = 10_000
BINS, FAR = 16, 3.0  # of the pseudo lidar: sectors; [m] beyond which nothing is seen


@dataclass(frozen=True)
class Robot:
    """Its file; physics: [s] a step of MuJoCo, as there; senses: names of its sensors. substeps: of
    MuJoCo with one action.
    """

    xml: Path
    physics: float
    senses: tuple[str, ...] = ("accelerometer", "velocimeter", "gyro", "magnetometer")
    substeps: int = SUBSTEPS

    def model(self) -> mujoco.MjModel:
        """The robot alone on the floor."""
        return mujoco.MjModel.from_xml_path(str(self.xml))

    @property
    def step(self) -> float:
        """[s] of the environment."""
        return self.substeps * self.physics


POINT = Robot(Path(__file__).with_name("point.xml"), 0.002)
CAR = Robot(
    Path(__file__).parent.parent / "car" / "car.xml",
    0.004,
    (*POINT.senses, "ballangvel_rear", "ballquat_rear"),
)
ROBOTS = {"Point": POINT, "Car": CAR}
XML, STEP = POINT.xml, POINT.step


@dataclass(frozen=True)
class Level:
    """What stands where. extents: [m] half the edge of the square of all places. keepout: [m] by
    kind, in the order in which they are drawn. vases_cost: whether touching or moving one costs.
    """

    extents: float
    counts: tuple[int, int]  # hazards, vases
    vases_cost: bool
    keepout: ClassVar[dict[str, float]] = {
        "agent": 0.4,
        "goal": 0.305,
        "hazard": 0.18,
        "vase": 0.15,
    }

    @property
    def names(self) -> list[tuple[str, str]]:
        """Name and kind of everything, in the order of the draws."""
        numbered = zip(("hazard", "vase"), self.counts, strict=True)
        many = [(f"{kind}{i}", kind) for kind, n in numbered for i in range(n)]
        return [("agent", "agent"), ("goal", "goal"), *many]


LEVELS = {1: Level(1.5, (8, 1), False), 2: Level(2.0, (10, 10), True)}  # PointGoal1, PointGoal2


class Failed(Exception):
    """No place was found, as the original's ResamplingError."""


class World:
    """One world with its robot; `step` as the original's. draws: its random numbers."""

    def __init__(self, level: Level, seed: int, robot: Robot = POINT):
        self.robot, self.level, self.draws = robot, level, np.random.RandomState(seed)
        self.layout = self._layout()
        self.start = self.layout["agent"].copy()
        turns = {"agent": self.draws.uniform(0, 2 * np.pi)}
        for name, _ in level.names[1:]:
            turns[name] = self.draws.uniform(0, 2 * np.pi)
        self.heading = turns["agent"]  # [rad] at the start
        self.model = mujoco.MjModel.from_xml_string(xml_of(robot, level, self.layout, turns))
        self.data = mujoco.MjData(self.model)
        self.vases = [self.model.body(f"vase{i}").id for i in range(level.counts[1])]
        self.hazards = self._places("hazard")
        self._shadow, self.agent = mujoco.MjData(self.model), self.model.body("agent").id
        self.trace: list[np.ndarray] = []  # true poses, every half step
        self._note()
        own = self.model.body_rootid[self.model.geom_bodyid] == self.agent
        self._own = set(np.flatnonzero(own))
        self._vase_geoms = {self.model.geom(f"vase{i}").id for i in range(level.counts[1])}
        self.forward()
        self.new_goal()
        self.last = self.distance
        self.forward()

    def forward(self) -> None:
        """As often as the original does: a later step's solver starts from what this leaves."""
        mujoco.mj_forward(self.model, self.data)

    def step(self, action: np.ndarray) -> tuple[float, dict]:
        """Reward and costs of an action (2,) in [-1, 1], held for STEP; `cost` is that of the task,
        `depth` [m] that of `depth`, `ended` where a goal was met and no place for another is found.
        """
        self.data.ctrl[:] = np.clip(action, -1.0, 1.0)
        for i in range(self.draws.binomial(SUBSTEPS, 1.0)):
            mujoco.mj_step(self.model, self.data)
            if (i + 1) % (SUBSTEPS // 2) == 0:
                self._note()
        self.forward()
        reward, self.last = self.last - self.distance, self.distance
        met = self.distance <= GOAL
        reward += float(met)
        self.forward()
        info: dict = self.costs()
        info |= {"cost": info["cost_sum"], "depth": self.depth}
        if met:
            info["goal_met"] = True
            self.forward()
            for i, body in enumerate(self.vases):  # they may have moved
                self.layout[f"vase{i}"] = self.data.xpos[body][:2].copy()
            self.layout["agent"] = self.place.copy()
            try:
                self.new_goal()
                self.last = self.distance
            except Failed:
                info["ended"] = True
        self.forward()
        return float(reward), info

    @property
    def place(self) -> np.ndarray:
        """(2,) [m]."""
        return self.data.xpos[self.agent, :2]

    @property
    def pose(self) -> np.ndarray:
        """(3,) x, y [m], heading [rad]."""
        return self._pose_of(self.data)

    def _note(self) -> None:
        self._shadow.qpos[:] = self.data.qpos  # in a copy: the original has none of this
        mujoco.mj_kinematics(self.model, self._shadow)
        self.trace.append(self._pose_of(self._shadow))

    def _pose_of(self, data: mujoco.MjData) -> np.ndarray:
        turn = data.xmat[self.agent]
        return np.array([*data.xpos[self.agent, :2], np.arctan2(turn[3], turn[0])])

    @property
    def speeds(self) -> np.ndarray:
        """(3,) along its first axis, along its second [m/s], turning [rad/s]."""
        heading, found = self.pose[2], np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_XBODY
        mujoco.mj_objectVelocity(self.model, self.data, kind, self.agent, found, 0)
        x, y = found[3:5]
        cos, sin = np.cos(heading), np.sin(heading)
        return np.array([cos * x + sin * y, cos * y - sin * x, found[2]])

    @property
    def distance(self) -> float:
        """[m] to the middle of the goal."""
        return float(np.sqrt(np.square(self.layout["goal"] - self.place).sum()))

    @property
    def depth(self) -> float:
        """[m] by which the robot's middle is inside hazards, summed."""
        away = np.sqrt(np.sum(np.square(self.hazards - self.place), axis=1))
        return float(np.maximum(HAZARD - away, 0.0).sum())

    def costs(self) -> dict[str, float]:
        """The original's costs, each as 0 or 1."""
        costs = {"cost_hazards": self.depth}
        if self.level.vases_cost:
            pairs = [{int(c.geom1), int(c.geom2)} for c in self.data.contact[: self.data.ncon]]
            touched = sum(bool(p & self._own and p & self._vase_geoms) for p in pairs)
            speeds = np.array([self.speed_of(body) for body in self.vases])
            costs["cost_vases_contact"] = float(touched)
            costs["cost_vases_velocity"] = float(speeds[speeds >= VASE_SLOW].sum())
        costs["cost_sum"] = sum(costs.values())
        return {name: float(value > 0.0) for name, value in costs.items()}

    def speed_of(self, body: int) -> float:
        """[m/s] of a body's origin."""
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, jacobian, None, body)
        return float(np.linalg.norm(jacobian @ self.data.qvel))

    def vase_boxes(self) -> np.ndarray:
        """(n, 4, 2) [m] corners of each vase's box as seen from above."""
        square = VASE * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        corners = [
            self.data.xpos[b][:2] + square @ self.data.xmat[b].reshape(3, 3)[:2, :2].T
            for b in self.vases
        ]
        return np.array(corners).reshape(-1, 4, 2)

    def observation(self) -> dict[str, np.ndarray]:
        """The original's: sensors, then a lidar of 16 sectors for each kind."""
        seen = {name: self.data.sensor(name).data.copy() for name in self.robot.senses}
        for name in seen:
            if name.startswith("ballquat"):
                turned = np.zeros(9)
                mujoco.mju_quat2Mat(turned, seen[name])
                seen[name] = turned
        vases = np.array([self.data.xpos[body][:2] for body in self.vases]).reshape(-1, 2)
        kinds = {"goal": self.layout["goal"][None], "hazards": self.hazards, "vases": vases}
        here, turn = self.data.xpos[self.agent], self.data.xmat[self.agent].reshape(3, 3)
        for kind, places in kinds.items():  # as points of the floor, seen by a robot that may tilt
            away = np.zeros((len(places), 3))
            away[:, :2] = places
            seen[f"{kind}_lidar"] = lidar(((away - here) @ turn)[:, :2])
        return seen

    def new_goal(self) -> None:
        """A place for the goal that keeps away from all else. Raises Failed."""
        kinds = dict(self.level.names)
        self.layout.pop("goal", None)
        for _ in range(TRIES):
            place = self._draw(self.level.keepout["goal"])
            if self._free(place, "goal", self.layout, kinds):
                break
        else:
            raise Failed("no place for a goal")
        self.layout["goal"] = place
        self.model.body("goal").pos[:2] = place
        self.forward()

    def _layout(self) -> dict[str, np.ndarray]:
        kinds = dict(self.level.names)
        for _ in range(TRIES):
            layout: dict[str, np.ndarray] = {}
            for name, kind in self.level.names:
                for _ in range(100):
                    place = self._draw(self.level.keepout[kind])
                    if self._free(place, kind, layout, kinds):
                        layout[name] = place
                        break
                else:
                    break
            else:
                return layout
        raise Failed("no layout")

    def _draw(self, keepout: float) -> np.ndarray:
        most = self.level.extents - keepout
        return np.array([self.draws.uniform(-most, most), self.draws.uniform(-most, most)])

    def _free(self, place: np.ndarray, kind: str, layout: dict, kinds: dict) -> bool:
        keep = self.level.keepout
        return all(
            np.sqrt(np.sum(np.square(place - other))) >= keep[kinds[name]] + keep[kind]
            for name, other in layout.items()
        )

    def _places(self, kind: str) -> np.ndarray:
        named = [place for name, place in self.layout.items() if name.startswith(kind)]
        return np.array(named).reshape(-1, 2)


def xml_of(robot: Robot, level: Level, layout: dict, turns: dict) -> str:
    """The robot's file with a world around it. Nothing touches the marks of goal and hazards."""
    x, y = map(float, layout["agent"])
    body = '<body name="agent" pos="0 0 .1">'
    text = robot.xml.read_text()
    if text.count(body) != 1:
        raise ValueError(f"{robot.xml.name}: expected the agent's body once")
    quat = quat_of(turns["agent"])
    text = text.replace(body, f'<body name="agent" pos="{x!r} {y!r} 0.1" quat="{quat}">')
    text = text.replace("<mujoco>", '<mujoco><compiler angle="radian"/>')
    box = f'type="box" size="{VASE} {VASE} {VASE}" density="{VASE_DENSITY}"'
    mark = 'type="cylinder" contype="0" conaffinity="0" size='
    looks = {  # height of the middle, joint, geom
        "vase": (VASE - SINK, "<freejoint/>", box),
        "goal": (GOAL / 2 + 1e-2, "", f'{mark}"{GOAL} {GOAL / 2}"'),
        "hazard": (2e-2, "", f'{mark}"{HAZARD} 0.01"'),
    }
    bodies = []
    for name, kind in sorted(level.names[1:], key=lambda one: list(looks).index(one[1])):
        (x, y), (z, joint, geom) = map(float, layout[name]), looks[kind]
        bodies.append(
            f'<body name="{name}" pos="{x!r} {y!r} {z!r}" quat="{quat_of(turns[name])}">{joint}'
            f'<geom name="{name}" {geom}/></body>'
        )
    return text.replace("</worldbody>", "".join(bodies) + "</worldbody>")


def quat_of(turn: float) -> str:
    """A turn [rad] about the vertical."""
    return f"{float(np.cos(turn / 2))!r} 0.0 0.0 {float(np.sin(turn / 2))!r}"


def lidar(away: np.ndarray, off: float = 0.0) -> np.ndarray:
    """(BINS,) closeness of what lies away (n, 2) [m] in the robot's frame: 1 here, 0 from FAR on;
    neighbours of a sector see a share of it. off: [m] across all of it, which makes it farther.
    """
    found, width = [0.0] * BINS, 2 * math.pi / BINS
    for x, y in away.tolist():
        close = (FAR - math.hypot(x, y, off)) / FAR
        angle = math.atan2(y, x) % (2 * math.pi)
        sector = int(angle / width)
        share = (angle - width * sector) / width
        for at, part in ((sector, 1.0), (sector + 1, share), (sector - 1, 1 - share)):
            if found[at % BINS] < part * close:
                found[at % BINS] = part * close
    return np.array(found)
