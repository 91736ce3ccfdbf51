"""The pages as a site: `sphinx-build -W docs docs/_build` with the extra `docs`."""

from collections.abc import Callable
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

project = "nsmaps"
author = "The nsmaps developers"
version = release = version_of("nsmaps")
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "sphinx_copybutton", "sphinx_design"]
exclude_patterns = [
    "_build",
    "_generated/figures.md",
    "_generated/arrays.md",
    "_generated/rooms.md",
]  # the latter are included by pages
nb_execution_mode = "auto"  # notebooks are kept without outputs, and executed here
nb_execution_timeout = 300
nb_execution_raise_on_error = True
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True, "exclude-members": "model_config"}
default_role = "code"
suppress_warnings = ["ref.python"]  # types of fields such as `name`, of which there are several
napoleon_google_docstring = True
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
html_theme = "furo"
html_title = f"nsmaps {version}"
html_show_copyright = False
html_math_renderer = "mathml"  # without a script or a font from a network
html_static_path = ["_static"]
html_css_files = ["pictures.css"]
EXPLORED = "vi_pair/explore.html"
HERE = Path(__file__).parent


def write_api(app: object) -> None:
    """The page of all public names, room by room, generated from the package's own list."""
    import nsmaps

    lines = ["# API", "", "Each name is imported from its module when it is first used.", ""]
    for package in (nsmaps, *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in (*nsmaps.__all__, "figures"))):
        lines += [f"## {package.__name__}", ""]
        for name in (name for name in package.__all__ if name != "__version__"):
            kind = "autoclass" if isinstance(getattr(package, name), type) else "autofunction"
            lines += ["```{eval-rst}", f".. {kind}:: {package.__name__}.{name}", "```", ""]
    write_page("api.md", lines)


def write_thumbnails(app: object) -> None:
    """The page of all pictures, each with a link to the page that shows it."""
    from ruamel.yaml import YAML

    listed = YAML(typ="safe").load((HERE / "gallery" / "figures.yaml").read_text(encoding="utf-8"))
    pictures = {f"../gallery/{one['file']}.png": ("../gallery/index", one["figure"]) for one in listed["figures"]}
    pages = [page for page in HERE.rglob("*.md") if page.parent.name[0] != "_"]
    for one in (*listed["pages"], *listed["saved"], *listed["tables"]):
        file = HERE.parent / one["file"]
        for page in pages:
            if f"/{file.name})" in page.read_text(encoding="utf-8") and file.is_relative_to(HERE):
                pictures[f"../{file.relative_to(HERE)}"] = (
                    f"../{page.relative_to(HERE).with_suffix('')}",
                    one.get("figure", page.stem),
                )
    lines = ["# Thumbnails", "", "Every picture of these pages; a click leads to the page that shows it.", ""]
    lines += ["::::{grid} 2 3 4 5", ":gutter: 2", ""]
    for picture, (page, name) in pictures.items():
        lines += [
            ":::{grid-item-card}",
            f":img-top: {picture}",
            f":img-alt: {name}",
            f":link: {page}",
            ":link-type: doc",
            f"`{name}`",
            ":::",
            "",
        ]
    write_page("thumbnails.md", [*lines, "::::"])


def write_tables(app: object) -> None:
    """The tables of rooms, of figures and of arrays of results, from docstrings, declarations and classes."""
    from ast import get_docstring, parse

    import nsmaps
    from nsmaps.results import ARRAY, ArrayProperty
    from nsmaps.study.study import CATALOGUE

    lines = ["| name | shows | needs |", "|---|---|---|"]
    for name, figure in CATALOGUE.items():
        caption, needs = figure.caption.replace("|", "\\|"), ", ".join(f"`{section}`" for section in figure.sections)
        lines.append(f"| `{name}` | {caption} | {needs} |")
    write_page("figures.md", lines)
    lines = ["| result | array | axes | unit | holds |", "|---|---|---|---|---|"]
    for room in (nsmaps, *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in nsmaps.__all__)):
        for name in getattr(room, "__all__", ()):
            cls = getattr(room, name)
            declared = {
                key: field.metadata[ARRAY]
                for key, field in getattr(cls, "__dataclass_fields__", {}).items()
                if ARRAY in field.metadata
            }
            declared |= (
                {key: value.declaration for key, value in vars(cls).items() if isinstance(value, ArrayProperty)}
                if isinstance(cls, type)
                else {}
            )
            for key, each in declared.items():
                lines.append(f"| `{name}` | `{key}` | {', '.join(each.axes)} | {each.unit or 'of the quantity'} | {each.text} |")
    write_page("arrays.md", lines)
    package = HERE.parent / "nsmaps"
    lines = ["| room | contents |", "|---|---|"]
    for file in sorted(package.glob("*/**/__init__.py")):
        said = (get_docstring(parse(file.read_text(encoding="utf-8"))) or "").partition("\n\n")[0].replace("\n", " ")
        lines.append(f"| `{file.parent.relative_to(package)}` | {said} |")
    write_page("rooms.md", lines)


def write_page(name: str, lines: list[str]) -> None:
    """Write a page that is generated when the site is built."""
    (HERE / "_generated").mkdir(exist_ok=True)
    (HERE / "_generated" / name).write_text("\n".join(lines), encoding="utf-8")


def formula(display: str) -> Callable[[Any, Any], None]:
    """The visitor of a formula, which writes it as MathML."""

    def visit(writer: Any, node: Any) -> None:
        from docutils.nodes import SkipNode
        from latex2mathml.converter import convert

        writer.body.append(convert(node.astext(), display=display))
        raise SkipNode

    return visit


def write_explore(app: Any, error: Exception | None) -> None:
    """The page of a study to be turned by hand, from a run made when the site is built: `EXPLORED` below the site's root."""
    if error is None and app.builder.format == "html":
        import nsmaps
        from nsmaps.explore.page.write import write_page as write_explored

        folder = (Path(app.outdir) / EXPLORED).parent
        folder.mkdir(exist_ok=True)
        write_explored(nsmaps.run_study(f"{folder.name}/explore"), folder)


def open_in_full(app: Any, page: Any) -> None:
    """Pictures are links to their files, as Sphinx makes them of those with a scale; those of cards are links already."""
    from docutils.nodes import image

    for picture in page.findall(image):
        if "sd-card-img-top" not in picture["classes"]:
            picture["scale"] = 100


def setup(app: Any) -> None:
    """Write the generated pages before any is read."""
    app.add_html_math_renderer("mathml", (formula("inline"), None), (formula("block"), None))
    app.connect("builder-inited", write_api)
    app.connect("builder-inited", write_thumbnails)
    app.connect("builder-inited", write_tables)
    app.connect("doctree-read", open_in_full)
    app.connect("build-finished", write_explore)
