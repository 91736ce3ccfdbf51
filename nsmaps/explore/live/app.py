"""What the page of a live exploration does: a scene that widgets change, and pictures computed beside it, coarse ones first."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from math import isfinite
from pathlib import Path
from time import monotonic
from typing import Any

from bokeh.document import Document
from bokeh.events import RangesUpdate, Reset, Tap
from bokeh.models import CustomJS

from nsmaps.errors import NsmapsError
from nsmaps.explore.live import pictures
from nsmaps.explore.live.page import Page
from nsmaps.explore.live.scene import Scene, extents, span, study_of
from nsmaps.explore.page.sweep import lettered
from nsmaps.progress import Progress

_ROWS = 230  #: of a diagram, no more than pixels, so that thin lines are whole
_KEPT = 50  #: scenes to which one can go back
_WAIT = 80  #: milliseconds without a change of the axes, after which pictures are computed
_PATIENCE = 10.0  #: seconds that the next, finer picture may take, by what the last one took

#: where the browser changes to dark colours or back; other pictures are inverted by the style sheet
_REDRAWN = 'matchMedia("(prefers-color-scheme: dark)").onchange = () => Bokeh.index.find_one(plane).rerender()'


@dataclass(frozen=True, slots=True)
class Task:
    """How a picture is computed, from a coarse one to a fine one, and drawn."""

    compute: Callable[[Scene, int, Progress], Any]  #: of a scene, with so many columns or points
    draw: Callable[[Scene, Any], None]
    levels: tuple[int, ...] = (0,)
    power: int = 1  #: of the level, to which the work is proportional


class SupersededError(Exception):
    """What is being computed is not asked for any more."""


class App:
    """One visitor's page: a scene that the widgets change, and pictures that follow it."""

    def __init__(self, scene: Scene, folder: Path) -> None:
        self.scene, self.page = scene, Page(scene)
        self._first, self._folder = scene, folder
        self._shown: pictures.Diagram | None = None
        self._found: pictures.Cycles = ()
        self._earlier: list[Scene] = []
        self._worker = ThreadPoolExecutor(max_workers=1)
        self._tasks: Mapping[str, Task] = {
            "orbit": Task(lambda scene, level, still: pictures.followed(scene), self.page.draw_orbit),
            "plane": Task(self._areas, self.page.draw_plane, (60, 120, 240), 2),
            "diagram": Task(self._attractors, self._shows, (80, 240, 720)),
            "cycles": Task(lambda scene, level, still: pictures.cycles(scene), self._list_cycles),
        }
        self._asked, self._pending = dict.fromkeys(self._tasks, 0), dict[str, Any]()
        self._connect()

    def show(self, doc: Document) -> None:
        """Put the page into a document, and compute its pictures."""
        self._doc = doc
        doc.title = f"nsmaps: {self.scene.title}"
        doc.add_root(self.page.layout())
        doc.js_on_event("document_ready", CustomJS(args={"plane": self.page.plane}, code=_REDRAWN))
        doc.on_session_destroyed(lambda context: self._end())
        self._refresh("orbit", "plane", "diagram")

    def _end(self) -> None:
        """Give up everything that is being computed, as the page was closed."""
        self._asked = dict.fromkeys(self._asked, -1)
        self._worker.shutdown(wait=False, cancel_futures=True)

    def _connect(self) -> None:
        """What each widget and each picture does when it is used."""
        page = self.page
        for name, slider in page.sliders.items():
            slider.on_change("value", lambda attr, old, new, name=name: self._set(name, new))
            page.entries[name].on_change("value", lambda attr, old, new, name=name: self._set(name, new))
        page.parameter.on_change("value", lambda attr, old, new: self._choose(new, self.scene.coordinate))
        page.coordinate.on_change("value", lambda attr, old, new: self._choose(self.scene.parameter, new))
        page.follow.on_change("active", lambda attr, old, new: self._refresh("diagram"))
        page.back.on_click(self._back)
        page.colours.on_change("active", lambda attr, old, new: self._refresh("plane"))
        page.cycles.on_click(lambda: self._refresh("cycles"))
        page.save.on_click(self._save)
        for key, picture in (("diagram", page.diagram), ("plane", page.plane)):
            picture.on_event(RangesUpdate, partial(self._moved, key))
            picture.on_event(Reset, partial(self._reset, key))
            picture.on_event(Tap, partial(self._tapped, key))

    # changes by hand

    def _set(self, name: str, value: float) -> None:
        """A parameter from its slider or its field, which show the same; the diagram depends on all but its own."""
        if value is None or value == self.scene.system.parameters[name]:
            return
        try:
            scene = self.scene.at(**{name: float(value)})
        except NsmapsError as error:
            self._say(escape(str(error)))
            return
        self._remember()
        self.scene = scene
        self.page.set_value(name, float(value))
        self._refresh("orbit", "plane", *(["diagram"] if name != self.scene.parameter else []))

    def _remember(self) -> None:
        """Add the scene to those to which `_back` leads."""
        self._earlier = [*self._earlier[1 - _KEPT :], self.scene]

    def _back(self) -> None:
        """The scene before the last change by hand."""
        if not self._earlier:
            self._say("There is no earlier view.")
            return
        self.scene = self._earlier.pop()
        for name, value in self.scene.system.parameters.items():
            self.page.set_value(name, value, anew=True)
        self.page.widen(self.scene)
        self._refresh("orbit", "plane", "diagram")

    def _choose(self, parameter: str, coordinate: str) -> None:
        """Another parameter or coordinate of the diagram, whose axes are made as wide as they have to be."""
        if (parameter, coordinate) == (self.scene.parameter, self.scene.coordinate):
            return
        self._remember()
        old = self.scene
        values = old.values if parameter == old.parameter else span(old.system, parameter)
        heights = extents(old.system, old.start, parameter, values)[list(old.coordinates).index(coordinate)]
        self.scene = replace(old, parameter=parameter, coordinate=coordinate, values=values, heights=heights)
        self._first = replace(self.scene, plane=self._first.plane)
        self.page.widen(self.scene)
        self._refresh("diagram")

    def _moved(self, key: str, event: RangesUpdate) -> None:
        """The axes of a picture were moved; it is computed when they rest."""
        ends = [event.x0, event.x1, event.y0, event.y1]
        if not all(end is not None and isfinite(end) for end in ends) or not (ends[0] < ends[1] and ends[2] < ends[3]):
            return
        x, y = (float(ends[0]), float(ends[1])), (float(ends[2]), float(ends[3]))
        parts = {"values": x, "heights": y} if key == "diagram" else {"plane": dict(zip(self.scene.plane, (x, y), strict=True))}
        if all(getattr(self.scene, name) == part for name, part in parts.items()):
            return
        if key not in self._pending:
            self._remember()
        self.scene = replace(self.scene, **parts)
        if key in self._pending:
            self._doc.remove_timeout_callback(self._pending.pop(key))
        self._pending[key] = self._doc.add_timeout_callback(partial(self._rested, key), _WAIT)

    def _rested(self, key: str) -> None:
        self._pending.pop(key, None)
        self._refresh(key)

    def _reset(self, key: str, event: Reset) -> None:
        """The axes with which the page began."""
        self._remember()
        own = ("values", "heights") if key == "diagram" else ("plane",)
        parts = {name: getattr(self._first, name) for name in own}
        self.scene = replace(self.scene, **parts)
        self.page.widen(self.scene)
        self._refresh(key)

    def _tapped(self, key: str, event: Tap) -> None:
        """A point was clicked: the start is there, and of the diagram the parameter too."""
        x, y = float(event.x), float(event.y)
        if key == "plane":
            self._remember()
            self.scene = self.scene.placed(x, y)
            self._refresh("orbit")
        elif self._shown is not None:
            self.scene = replace(self.scene, start=pictures.nearest(self._shown, self.scene, x, y))
            self._set(self.scene.parameter, x)

    def _save(self) -> None:
        """Write the scene as a study into the folder; no file is overwritten."""
        from nsmaps.study.store.archive import resolved

        name = self.page.name.value.strip()
        path = self._folder / f"{name}.yaml"
        try:
            if Path(name).name != name:
                raise ValueError(f"{name!r} is not a name; expected: letters, digits, spaces and _, without a folder")
            text = self._history() + resolved(study_of(self.scene, name, self.page.way))
            with path.open("x", encoding="utf-8") as file:
                file.write(text)
        except FileExistsError:
            self._say(escape(f"{path} is there already and is not overwritten; expected: another name"))
        except (ValueError, OSError) as error:
            self._say(escape(f"nothing was saved: {error}"))
        else:
            self._say(escape(f"saved; to run it: nsmaps run {path}"))

    def _history(self) -> str:
        """What was changed and found by hand, as comments above a saved study."""
        began, now = self._first.system.parameters, self.scene.system.parameters
        changed = [f"{name} = {now[name]:.12g}, was {began[name]:.12g}" for name in now if now[name] != began[name]]
        lines = [f"Explored by hand, from: {self._first.title}", f"Parameters changed: {'; '.join(changed) or 'none'}"]
        lines += [f"Cycle found: {pictures.cycle_text(one)}" for one in self._found]
        return "".join(f"# {' '.join(line.split())}\n" for line in lines)

    # pictures

    def _attractors(self, scene: Scene, level: int, still: Progress) -> pictures.Diagram:
        return pictures.diagram(scene, level, _ROWS, still, self.page.way)

    def _refresh(self, *keys: str) -> None:
        """Compute pictures anew, and give up what is being computed of them."""
        self.page.now.location = self.scene.system.parameters[self.scene.parameter]
        if "plane" in keys or "cycles" in keys:
            self._say("")
            self._found = ()
            self.page.draw_cycles(self.scene, pictures.by_stability((), len(self.scene.start)))
        for key in keys:
            self._asked[key] += 1
            self._compute(key, 0)

    def _compute(self, key: str, level: int) -> None:
        """Compute a picture beside the page."""
        task, number, scene = self._tasks[key], self._asked[key], self.scene

        def still(fraction: float) -> None:
            if self._asked[key] != number:
                raise SupersededError

        def work() -> tuple[Any, float]:
            still(0.0)
            begun = monotonic()
            return task.compute(scene, task.levels[level], still), monotonic() - begun

        def done(found: "Future[tuple[Any, float]]") -> None:
            if not found.cancelled() and self._asked[key] == number:
                with suppress(AttributeError):  # Bokeh's document of a page that is closed meanwhile has lost its parts
                    self._doc.add_next_tick_callback(partial(self._arrived, key, level, number, scene, found))

        fine = f", level {level + 1} of {len(task.levels)}" if len(task.levels) > 1 else ""
        self.page.busy.text = f"computing: {key}{fine}"
        self._worker.submit(work).add_done_callback(done)

    def _arrived(self, key: str, level: int, number: int, scene: Scene, found: "Future[tuple[Any, float]]") -> None:
        """Draw what was computed, unless it is not asked for any more; then the same more finely."""
        error = found.exception()
        if self._asked[key] != number or isinstance(error, SupersededError):
            return
        if error is not None:
            self._say(escape(str(error) if isinstance(error, NsmapsError) else f"{type(error).__name__}: {error}"))
            return
        task, (picture, seconds) = self._tasks[key], found.result()
        self.page.busy.text = ""
        task.draw(scene, picture)
        if level + 1 < len(task.levels):
            growth = (task.levels[level + 1] / task.levels[level]) ** task.power
            if growth * seconds < _PATIENCE:
                self._compute(key, level + 1)

    def _areas(self, scene: Scene, level: int, still: Progress) -> pictures.Plane:
        return (pictures.reached if self.page.colours.active else pictures.words)(scene, level, still)

    def _shows(self, scene: Scene, shown: pictures.Diagram) -> None:
        self._shown = shown
        self.page.draw_diagram(scene, shown)

    def _list_cycles(self, scene: Scene, found: "pictures.Cycles") -> None:
        self._found = found
        self.page.draw_cycles(scene, pictures.by_stability(found, len(scene.start)))
        lines = [pictures.cycle_text(one) for one in found] or ["No cycle was found from points of the plane."]
        self._say("<br>".join(escape(lettered(line, scene.system)) for line in lines))

    def _say(self, text: str) -> None:
        self.page.said.text = f'<p class="soft">{text}</p>' if text else ""
