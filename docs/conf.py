"""The pages as a site: `sphinx-build -W docs docs/_build` with the extra `docs`."""

import re
import sys
from collections.abc import Callable
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

project = "nsmaps"
author = "The nsmaps developers"
version = release = version_of("nsmaps")
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "sphinx_copybutton", "sphinx_design"]
#: generated pages that others include
INCLUDED = ("arrays", "commands", "errors", "figures", "keys", "literature", "rooms")
exclude_patterns = ["_build", *(f"_generated/{name}.md" for name in INCLUDED)]
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
sys.path.insert(0, str(HERE))


def write_generated(app: object) -> None:
    """Write the pages that are made from the package."""
    from generated import pages

    (HERE / "_generated").mkdir(exist_ok=True)
    for name, text in pages().items():
        (HERE / "_generated" / name).write_text(text, encoding="utf-8")


def spaced(text: str) -> str:
    """A formula in MathML with the thin spaces about sin, log and others that TeX sets."""
    name = "<mi>(?:(?:arc)?(?:sin|cos|tan)h?|exp|log|ln)</mi>"
    one, thin = rf"(?:<msup>{name}<mn>\d+</mn></msup>|(?<!<msup>)(?<!<msub>){name})", '<mspace width="0.17em"/>'
    text = re.sub(rf"({one})(?=<m(?!o|space))", rf"\1{thin}", text)
    return re.sub(rf"(</m(?:i|n|sub|sup|frac|over|row)>)(?={one})", rf"\1{thin}", text)


def formula(display: str) -> Callable[[Any, Any], None]:
    """The visitor of a formula, which writes it as MathML."""

    def visit(writer: Any, node: Any) -> None:
        from docutils.nodes import SkipNode
        from latex2mathml.converter import convert

        text = spaced(convert(node.astext(), display=display))
        writer.body.append(text if display == "inline" else f'<div class="formula">{text}</div>')
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
    app.connect("builder-inited", write_generated)
    app.connect("doctree-read", open_in_full)
    app.connect("build-finished", write_explore)
