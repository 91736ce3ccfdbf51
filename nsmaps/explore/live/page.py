"""The widgets and pictures of a live exploration, as a Bokeh layout; what they do is in `app`."""

from collections.abc import Mapping
from html import escape
from importlib.resources import files
from math import pi
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import (
    AdaptiveTicker,
    Axis,
    BasicTicker,
    BasicTickFormatter,
    Button,
    ColumnDataSource,
    CustomJSTickFormatter,
    Div,
    GlobalInlineStyleSheet,
    HoverTool,
    LayoutDOM,
    LinearColorMapper,
    NumericInput,
    RadioButtonGroup,
    Range1d,
    Select,
    Slider,
    Span,
    TextInput,
)
from bokeh.plotting import figure

from nsmaps.arrays import Floats
from nsmaps.coordinates import is_angle
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.explore.live.pictures import RETURNS, Diagram, Followed, Plane, Way
from nsmaps.explore.live.scene import Scene, span
from nsmaps.explore.page.sweep import letter
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, ORANGE, PIECES, RED, REST, SKY, family_colours, tint

_STEPS = 400  #: of a slider
_SHADES = [f"#{level:02x}{level:02x}{level:02x}" for level in range(220, -1, -1)]
_CURVES = (RED, BLUE, BLACK, GREEN, MAGENTA, SKY, ORANGE)  #: of the motion: the ball or first state, then walls or other states
_ROOM = files("nsmaps.explore")
_STYLE = _ROOM.joinpath("live", "live.css").read_text(encoding="utf-8")
_LOOK = _ROOM.joinpath("page", "page.css").read_text(encoding="utf-8") + _STYLE
_TONED: dict[str, Any] = {
    "css_classes": ["toned"],
    "stylesheets": [_STYLE],
}  #: turned round in dark mode, unlike words of the plane
#: how a diagram is followed, in the order of the buttons
_WAYS: dict[Way, str] = {None: "From the start", "up": "Followed up", "down": "Followed down"}
_HELP = "Drag a rectangle on a picture to enlarge it, click a point to follow its orbit. Sliders move by the arrow keys, too."
_GREY = "#7a7a7a"  #: of legends, read on light and dark pages
_SIDE = 300  #: pixels, of the column of widgets
_WIDE = {"sizing_mode": "stretch_width", "min_width": 300}
_STYLED = {"stylesheets": [_LOOK]}
_PARTS = """const part = Number((tick / Math.PI).toPrecision(6))
return part ? `${part === 1 ? "" : part}\u03c0` : "0";"""  #: of pi, in JavaScript
_PLACE = {"x": "x", "y": "y", "dw": "dw", "dh": "dh"}


def _pale(colour: str) -> str:
    """A colour on which marks can be seen."""
    return "#{:02x}{:02x}{:02x}".format(*(round(255 * part) for part in tint(colour, 0.4)))


_FILLS = [*map(_pale, PIECES), REST]  #: of areas


class Page:
    """The widgets, pictures and their data."""

    def __init__(self, scene: Scene) -> None:
        names = list(scene.system.parameters)
        about = f"<p>{escape(scene.name)}. All pictures are of the exact map.</p>"
        self.title = Div(text=f"<h1>{escape(scene.title)}</h1>{about}<p class='soft'>{_HELP}</p>", **_WIDE, **_STYLED)
        self.sliders = {name: _slider(scene, name) for name in names}
        self._ends = {name: (slider.start, slider.end) for name, slider in self.sliders.items()}
        self.entries = {name: _entry(slider) for name, slider in self.sliders.items()}
        self.parameter = Select(title="Parameter of the diagram", value=scene.parameter, options=names)
        self.coordinate = Select(title="Coordinate of the diagram", value=scene.coordinate, options=list(scene.coordinates))
        self.follow = RadioButtonGroup(labels=["same start", "followed up", "followed down"], active=0)
        self.colours = RadioButtonGroup(labels=["words", "basins"], active=0)
        self.back = Button(label="Back")
        self.cycles = Button(label="Find cycles of up to four returns")
        self.name = TextInput(title="Name of a study", value="explored")
        self.save = Button(label="Save as a study", button_type="primary")
        self.busy, self.said = Div(text="", **_STYLED), Div(text="", width=_SIDE, **_STYLED)
        self.summary, self.areas = Div(text="", **_WIDE, **_STYLED), Div(text="", **_WIDE, **_STYLED)
        self._images = {key: ColumnDataSource({name: [] for name in ("image", *_PLACE)}) for key in ("diagram", "plane")}
        self._marks = {key: ColumnDataSource({"x": [], "y": []}) for key in ("orbit", "last", "start", "stable", "unstable")}
        self._curves = ColumnDataSource({"xs": [], "ys": [], "name": [], "colour": []})
        self.diagram, self.now = self._make_diagram()
        self.plane = self._make_plane()
        moves = isinstance(scene.system, FlowSystem)
        title = "Motion through the first impacts or events" if moves else "First returns"
        self.motion = figure(name="motion", height=400, title=title, **_TONED, **_look("pan"))
        self.motion.multi_line("xs", "ys", source=self._curves, line_color="colour", line_width=1.6, legend_field="name")
        self.motion.xaxis.axis_label = "time" if moves else "return"
        self.motion.add_layout(self.motion.legend[0], "above")
        self.motion.legend.orientation = "horizontal"
        for picture in (self.diagram, self.plane, self.motion):
            picture.toolbar.logo, picture.outline_line_color = None, None
            for legend in picture.legend:
                legend.update(label_text_color=_GREY, background_fill_alpha=0, border_line_color=None)
            picture.add_tools(HoverTool(tooltips=[("x", "$x{0.000000}"), ("y", "$y{0.000000}")], point_policy="follow_mouse"))
        self.widen(scene)

    def layout(self) -> LayoutDOM:
        """All of it, widgets at the left, or above on a narrow page."""
        values = [row(slider, self.entries[name], width=_SIDE) for name, slider in self.sliders.items()]
        widgets = (row(self.back, self.busy), self.parameter, self.coordinate, self.follow, *values, self.colours, self.cycles)
        wraps = {"sizing_mode": "stretch_width", "styles": {"flex-wrap": "wrap"}}
        plane = column(self.areas, self.plane, **_WIDE)
        motion = column(self.summary, self.motion, **_WIDE)
        pictures = column(self.diagram, row(plane, motion, **wraps), **_WIDE)
        side = column(*widgets, self.name, self.save, self.said, width=_SIDE, **_TONED)
        return column(self.title, row(side, pictures, **wraps), stylesheets=[GlobalInlineStyleSheet(css=_LOOK)], **_WIDE)

    def _make_diagram(self) -> tuple[Any, Span]:
        plot = figure(name="diagram", height=360, title="From the start", **_TONED, **_look("box_zoom"))
        shades = LinearColorMapper(_SHADES, low=0, high=1, nan_color="#ffffff00")
        plot.image("image", source=self._images["diagram"], color_mapper=shades, level="image", **_PLACE)
        plot.grid.visible = False
        now = Span(location=0, dimension="height", line_color=RED, line_width=1.5)
        plot.add_layout(now)
        return plot, now

    def _make_plane(self) -> Any:
        plot = figure(name="plane", height=400, **_look("box_zoom"))
        plot.grid.visible = False
        self._areas = LinearColorMapper(_FILLS, low=-0.5, high=len(_FILLS) - 0.5)
        plot.image("image", source=self._images["plane"], color_mapper=self._areas, level="image", **_PLACE)
        looks: Mapping[str, tuple[str, dict[str, Any]]] = {
            "orbit": ("orbit", {"size": 3, "fill_color": "#333333", "line_color": _GREY, "line_width": 0.5}),
            "last": ("last tenth", {"size": 7, "fill_color": MAGENTA, "line_color": BLACK}),
            "start": ("start", {"size": 9, "fill_color": "white", "line_color": BLACK}),
            "stable": ("stable cycle", {"marker": "diamond", "size": 12, "fill_color": BLACK, "line_color": "white"}),
            "unstable": ("unstable cycle", {"marker": "diamond", "size": 12, "fill_color": "white", "line_color": BLACK}),
        }
        for key, (text, look) in looks.items():
            plot.scatter("x", "y", source=self._marks[key], legend_label=text, **look)
        self._items = dict(zip(looks, plot.legend[0].items, strict=True))
        plot.add_layout(plot.legend[0], "below")
        plot.legend.orientation, plot.legend.click_policy, plot.legend.ncols = "horizontal", "hide", 3
        return plot

    def widen(self, scene: Scene) -> None:
        """Axes and their names as a scene has them."""
        for each, x, y in ((self.diagram, scene.values, scene.heights), (self.plane, *scene.plane.values())):
            each.x_range, each.y_range = Range1d(*x), Range1d(*y)
        for each, names in ((self.diagram, (scene.parameter, scene.coordinate)), (self.plane, scene.plane)):
            for axis, name in zip((each.xaxis[0], each.yaxis[0]), names, strict=True):
                _name(axis, name, name in scene.coordinates and is_angle(next(x for x in scene.coordinates if x == name)))

    def set_value(self, name: str, value: float, anew: bool = False) -> None:
        """Show the value of a parameter on its slider and in its field.

        The slider is made longer where it ends before, `anew` from the ends that it had at first.
        """
        slider = self.sliders[name]
        low, high = self._ends[name] if anew else (slider.start, slider.end)
        slider.update(start=min(low, value), end=max(high, value), value=value)
        self.entries[name].value = value

    @property
    def way(self) -> Way:
        """How the diagram is followed."""
        return list(_WAYS)[self.follow.active or 0]

    def draw_diagram(self, scene: Scene, shown: Diagram) -> None:
        """A diagram over the axes of the scene that it was computed for."""
        self._images["diagram"].data = _placed(shown.shade, scene.values, scene.heights)
        self.diagram.title.text = f"{_WAYS[self.way]} at {shown.counts.shape[1]} values, {RETURNS} returns each"

    def draw_plane(self, scene: Scene, shown: Plane) -> None:
        """A plane over the axes of the scene that it was computed for, with its areas named above."""
        self._images["plane"].data = _placed(shown.areas.astype(float), *scene.plane.values())
        chip = '<span><i style="background: {}"></i>{}</span>'
        fills = _fills(shown)
        self._areas.palette = [*fills, *_FILLS[len(fills) :]]
        chips = " ".join(chip.format(fills[k], escape(name)) for k, name in enumerate(shown.names))
        self.areas.text = f'<div class="legend"><b>{shown.kind}</b> {chips}</div>'

    def draw_orbit(self, scene: Scene, found: Followed) -> None:
        """An orbit on the plane, and its motion."""
        states = found.orbit.states
        for key, part in (("orbit", states), ("last", states[-(len(states) // 10) :]), ("start", states[:1])):
            self._mark(key, scene, part)
        curves = found.curves
        colours = [_CURVES[k % len(_CURVES)] for k in range(len(curves))]
        times = [found.time] * len(curves)
        self._curves.data = {"xs": times, "ys": list(curves.values()), "name": list(curves), "colour": colours}
        self.summary.text = f"<b>Orbit</b> {escape(found.text)}"

    def draw_cycles(self, scene: Scene, found: Mapping[str, Floats]) -> None:
        """States of cycles, stable and unstable ones apart, of shape (k, n)."""
        for kind, states in found.items():
            self._mark(kind, scene, states)

    def _mark(self, key: str, scene: Scene, states: Floats) -> None:
        x, y = (states[:, list(scene.coordinates).index(name)] for name in scene.plane)
        self._marks[key].data = {"x": x, "y": y}
        self._items[key].visible = bool(len(x))


def _name(axis: Axis, name: str, angle: bool) -> None:
    """The name of an axis; an angle has ticks at decimal parts of pi."""
    axis.axis_label = letter(name)
    axis.ticker = (
        AdaptiveTicker(mantissas=[0.1 * pi, 0.25 * pi, 0.5 * pi], base=10, desired_num_ticks=4) if angle else BasicTicker()
    )
    axis.formatter = CustomJSTickFormatter(code=_PARTS) if angle else BasicTickFormatter()


def _fills(shown: Plane) -> list[str]:
    """The colours of the areas of a plane: of words those of the figures."""
    if not shown.of_words:
        return _FILLS[: len(shown.names)]
    return [_pale(colour) for colour in family_colours(list(shown.names)).values()]


def _look(drag: str) -> dict[str, Any]:
    """The tools of a picture."""
    return {"tools": "pan,wheel_zoom,box_zoom,save,reset", "active_drag": drag, "sizing_mode": "stretch_width"}


def _placed(image: Floats, x: tuple[float, float], y: tuple[float, float]) -> dict[str, Any]:
    """An image over two ranges, as a source has it."""
    return {"image": [image], "x": [x[0]], "y": [y[0]], "dw": [x[1] - x[0]], "dh": [y[1] - y[0]]}


def _slider(scene: Scene, name: str) -> Slider:
    """The slider of a parameter, which reaches over the axis of the diagram where it is there."""
    value, (low, high) = scene.system.parameters[name], span(scene.system, name)
    if name == scene.parameter:
        low, high = min(low, *scene.values), max(high, *scene.values)
    return Slider(
        title=letter(name), value=value, start=low, end=high, step=(high - low) / _STEPS, format="0.00000", width=_SIDE - 120
    )


def _entry(slider: Slider) -> NumericInput:
    """A field for the value of a slider, also beyond its ends."""
    return NumericInput(title="value", value=slider.value, mode="float", format="0.0000000", width=90)
