"""The page of `live`, drawn by viser: one scene for all browsers, on this machine alone."""

import json
import logging
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from parc_jax.answer.answer import Answer, answer_data
from parc_jax.app.live import Drawn, Grip, Live, swept
from parc_jax.app.plot import shapes
from parc_jax.common.errors import InputError
from parc_jax.common.on_use import package
from parc_jax.common.spelling import counted, rounded_down, rounded_up
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.labels import name_of
from parc_jax.learning.systems.user_code import said
from parc_jax.problem.problem import goal_box
from parc_jax.statement import about_coverage, all_plans, resting_on, set_of

_log = logging.getLogger(__name__)
LOCAL = "127.0.0.1"
RATE = 25.0  # [1/s] pictures of a plan that is played
REST = 0.2  # [s] after which a slider is taken to rest
COLOURS = {"goal": (60, 150, 80), "start": (70, 110, 200)}
OBSTACLE, PLAN, BEST = (90, 90, 95), (40, 120, 220), (230, 120, 30)
HIGH, LOW = 0.06, 0.02  # [of the scene] height of obstacles and of plans in the plane


class Page:
    """A server, its controls, one thread for what was asked last. InputError without viser."""

    def __init__(self, live: Live, port: int):
        viser = package("viser", "live")
        self.live, self._rotation = live, package("viser.transforms", "live").SO3
        live.warm_up()  # before anybody waits for it
        self.server = viser.ViserServer(LOCAL, port, label="parc_jax", verbose=False)
        self._asked, self._wake, self._over = {"draw", "settle"}, threading.Condition(), False
        self._drawn: Drawn | None = None
        self._grips: dict[str, Any] = {}
        self._controls()
        self._scene()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def run(self) -> None:
        """Until interrupted."""
        print(f"http://{LOCAL}:{self.server.get_port()}  (Ctrl-C ends it)", flush=True)
        try:
            self._thread.join()
        finally:
            self.stop()

    def stop(self) -> None:
        """End the page for all browsers."""
        self._over = True
        self._ask()
        self._thread.join()
        self.server.stop()

    @property
    def told(self) -> str:
        """What stands beside the scene: of the plans, then of the set."""
        return f"{self._told.content}\n{self._set.content}"

    def move(self, name: str, place, turn=None) -> None:
        """Move a grip as by hand, and let it go; arguments as of `Live.move`."""
        self.live.move(name, place, turn)
        own = self.live.grips[name]
        self._grips[name].position = _in_space(own.place)
        self._grips[name].wxyz = self._rotation.from_matrix(_in_space(own.turn)).wxyz
        self._ask("draw", "settle")

    def _ask(self, *what: str) -> None:
        with self._wake:
            self._asked.update(what)
            self._wake.notify()

    def _controls(self) -> None:
        gui, live = self.server.gui, self.live
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        self._told, self._set = gui.add_markdown(""), gui.add_markdown("")
        self._play = gui.add_checkbox("play the roomiest plan", False)
        self._play.on_update(lambda _: self._ask())
        number = gui.add_slider("plans", 16, 64, 16, live.wanted)
        self._slides(number, lambda n: setattr(live, "wanted", int(n)))
        for i in live.chosen:
            label, (lo, hi) = live.model.labels.k[i], map(float, live.k[:, i])
            if lo < hi:
                step, ends = (hi - lo) / 100, tuple((x, f"{x:.3g}") for x in (lo, hi))
                slider = gui.add_multi_slider(
                    name_of(label), lo, hi, step, (lo, hi), min_range=step, marks=ends
                )
                self._slides(slider, lambda both, i=i: live.k[:, i].__setitem__(slice(None), both))
        for name in live.off:
            most = float(f"{live.most_off:.1g}")
            ends = (0.0, "exact"), (most, f"{most:g}")
            slider = gui.add_slider(f"{name} off by [m]", 0.0, most, most / 20, 0.0, marks=ends)
            self._slides(slider, lambda half, name=name: live.off.__setitem__(name, half))
        gui.add_button("save scene.toml").on_click(
            lambda event: event.client.send_file_download("scene.toml", live.toml().encode())
        )
        gui.add_button("prove, save answer.json").on_click(self._prove)

    def _slides(self, slider, change: Callable[[Any], None]) -> None:
        """Plans follow a slider at once, their set when it rests."""
        slider.on_update(lambda _: (change(slider.value), self._ask("draw", "settle", "slid")))

    def _prove(self, event) -> None:
        note = event.client.add_notification("proving", "in exact arithmetic", loading=True)
        try:
            text = json.dumps(answer_data(self.live.proved()), separators=(",", ":"))
            event.client.send_file_download("answer.json", text.encode())
        except InputError as error:
            event.client.add_notification("not proved", str(error))
        finally:
            note.remove()

    def _scene(self) -> None:
        live, scene, n_p = self.live, self.server.scene, self.live.model.n_p
        lo, hi = (side[:n_p] for side in goal_box(live.problem.goal, live.model.layout))
        way = swept(live.scene(), self.live.draw().plans)[2][..., :n_p].reshape(-1, n_p)
        seen = np.concatenate([[lo, hi], [grip.middle for grip in live.grips.values()], way])
        lo, hi = seen.min(axis=0), seen.max(axis=0)
        self.size = float(max((hi - lo).max(), 1e-3))
        for name, grip in live.grips.items():
            self._grip(name, grip)
        middle = _in_space((lo + hi) / 2)
        away = np.array([0.0, -0.3, 0.75]) if n_p == 2 else np.array([-0.7, -1.1, 0.8])
        scene.set_up_direction("+z")
        self.server.initial_camera.position = tuple(middle + away * self.size)
        self.server.initial_camera.look_at = tuple(middle)
        cell = 10.0 ** np.floor(np.log10(self.size / 2))
        sizes = {"cell_size": cell, "section_size": 10 * cell}
        scene.add_grid("/grid", 4 * self.size, 4 * self.size, position=tuple(middle), **sizes)

    def _grip(self, name: str, grip: Grip) -> None:
        n_p = self.live.model.n_p
        handle = self.server.scene.add_transform_controls(
            f"/{name}",
            scale=0.1 * self.size,
            position=_in_space(grip.place),
            wxyz=self._rotation.from_matrix(_in_space(grip.turn)).wxyz,
            active_axes=(grip.free, grip.free, grip.free and n_p == 3),
            disable_rotations=name == "start" and self.live.pose_size != n_p + 1,  # no heading
            depth_test=False,
        )
        colour = COLOURS.get(name, OBSTACLE)
        for corners in self._solids(name, grip):
            mesh = shapes.triangles(corners).reshape(-1, 3)
            faces, opacity = np.arange(len(mesh)).reshape(-1, 3), 0.35 * (colour != OBSTACLE)
            self._mesh(f"/{name}/solid", mesh, faces, colour, opacity or None, flat_shading=True)

        async def dragged(event) -> None:  # in the order of the mouse, which threads would not keep
            turn = self._rotation(handle.wxyz).as_matrix()[:n_p, :n_p]
            self.live.move(name, handle.position[:n_p], turn)
            self._ask("draw", *(["settle"] if event.phase == "end" else []))

        handle.on_update(dragged)
        self._grips[name] = handle

    def _solids(self, name: str, grip: Grip) -> list[np.ndarray]:
        """Corners, about the middle, of what is drawn of a grip; in the plane with some height."""
        n_p = self.live.model.n_p
        if grip.whole is None:
            return []
        try:
            part, at = shapes.linked(grip.whole, range(n_p))
            corners = shapes.corners_of(part)[:, list(at)] - grip.middle
        except InputError:  # not bounded
            return []
        top = self.size * (HIGH if name not in COLOURS else LOW / 10)
        tops = [np.c_[corners, np.full(len(corners), z)] for z in (0.0, top)]
        return [corners if n_p == 3 else np.concatenate(tops)]

    def _work(self) -> None:
        while not self._over:
            with self._wake:
                if not self._asked and not self._over:
                    self._wake.wait(1 / RATE if self._play.value else None)
                asked, self._asked = self._asked, set()
            try:
                if "draw" in asked:
                    self._draw()
                with self._wake:  # of sliders nothing says that they were let go
                    rest = REST if "slid" in asked else 0.0
                    more = self._wake.wait_for(lambda: self._asked or self._over, rest)
                if "settle" in asked and not more:
                    self._settle()
                elif "settle" in asked:
                    self._ask("settle")
                if self._play.value and self._drawn is not None and len(self._drawn.plans):
                    grid, best = self.live.model.time, self._drawn.plans[:1]
                    now = int(time.perf_counter() % (grid.t_f + 0.5) / grid.dt)
                    self._show("body", best, BEST, 0.9, at=[min(now, grid.n_steps)])
            except Exception as error:  # no sentence stays of what is there no more
                known = isinstance(error, InputError)
                told = str(error) if known else f"could not draw or measure this: {said(error)}"
                _log.log(logging.DEBUG if known else logging.ERROR, "live: %s", told, exc_info=True)
                self._set.content, self._told.content, self._drawn = "", f"**{told}**", None
                self._clear("plans", "best", "set", "body")

    def _draw(self) -> None:
        drawn = self._drawn = self.live.draw()
        self._clear("best", "set")
        told = f"**{len(drawn.plans)} safe plans** in {1e3 * drawn.seconds:.0f} ms"
        if len(drawn.plans):
            self._show("plans", drawn.plans, PLAN, 0.1)
            room = drawn.clearance[0]
            told += f", at most {rounded_up(room)} m clear" if room < np.inf else ", nothing near"
            if drawn.scene.nominal.uncertainty is not None:
                told += "; lines are of one possible run"
        else:
            self._clear("plans", "body")
        self._set.content = ""  # first: what was measured is not of these plans
        self._told.content = told

    def _settle(self) -> None:
        begin = time.perf_counter()
        answer, why = self.live.settle()
        took = time.perf_counter() - begin
        lines = [] if why is None else list(why.sentences)
        if answer is not None and answer.status.found:
            lines = [*about_set(answer), *lines]
            self._show("set", answer.samples, COLOURS["goal"])
        if self._drawn is not None and len(self._drawn.plans):
            self._show("best", self._drawn.plans[:1], BEST, 0.25, tube=True)
        self._set.content = "\n\n".join([*lines, f"measured in {took:.1f} s, not proved"])

    def _clear(self, *names: str) -> None:
        for name in names:
            for part in ("swept", "way"):
                self.server.scene.remove_by_name(f"/{name}/{part}")

    def _show(self, name: str, plans: np.ndarray, colour, opacity=0.0, **how) -> None:
        """Plans as lines, and with an opacity all that the body passes on them."""
        corners, faces, way = swept(self._drawn.scene, plans, **how)
        lift = np.array([0.0, 0.0, LOW * self.size * (self.live.model.n_p == 2)])
        lines = np.stack([way[:, :-1], way[:, 1:]], axis=2).reshape(-1, 2, 3) + 1.1 * lift
        with self.server.atomic():
            if opacity:
                lit = {"cast_shadow": False, "receive_shadow": False}
                self._mesh(f"/{name}/swept", corners + lift, faces, colour, opacity, **lit)
            if "at" not in how:
                data, thin = (np.float32(lines), np.uint8(colour)), {"thickness_units": "screen"}
                self.server.scene.add_line_segments(f"/{name}/way", *data, thickness=1.5, **thin)

    def _mesh(self, name: str, corners: np.ndarray, faces: np.ndarray, colour, opacity, **look):
        look |= {"color": colour, "opacity": opacity, "side": "double"}
        self.server.scene.add_mesh_simple(name, np.float32(corners), faces, **look)


def about_set(answer: Answer) -> list[str]:
    """What is measured of a set, of which k, how surely, under which tube, and what it rests on."""
    claim, share, lines, scene = answer.model.claim, answer.share, [], answer.scene
    box, robust = scene.box_of_k, scene.nominal.uncertainty is not None
    of = all_plans(scene.at is not None, box if box == claim.law.box else "the sliders' part of K")
    if share is not None:
        some = answer.cover.within is not None
        of += ", counting only those around the first found" * some
        least, most = rounded_down(100 * share.at_least, 3), rounded_up(100 * share.at_most, 3)
        sure = f"confidence {rounded_down(str(share.confidence), 10)}"
        doubt = " for all that is uncertain" * robust
        lines.append(f"**{least} to {most} %** of {of}{',' * (',' in of)} are safe{doubt}, {sure}")
    corridors = counted(len(answer.corridors), "corridor")
    lines.append(f"{corridors}: {about_coverage(answer.coverage, set_of(answer, 'the safe ones'))}")
    return [*lines, f"the tube is {in_short(claim)}", *resting_on(scene.nominal, world=True)]


def _in_space(x: np.ndarray) -> np.ndarray:
    """A place (n_p,), or a turn (n_p, n_p), as in space."""
    out = np.zeros(3) if x.ndim == 1 else np.eye(3)
    out[tuple(slice(n) for n in x.shape)] = x
    return out
