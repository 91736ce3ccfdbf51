"""The pages as a site: `sphinx-build -W docs docs/_build` with the extra `docs`."""

from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

project = "nsmaps"
author = "The nsmaps developers"
version = release = version_of("nsmaps")
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "sphinx_copybutton", "sphinx_design"]
exclude_patterns = ["_build"]
nb_execution_mode = "auto"  # notebooks are kept without outputs, and executed here
nb_execution_timeout = 300
nb_execution_raise_on_error = True
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True, "exclude-members": "model_config"}
default_role = "code"
napoleon_google_docstring = True
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
html_theme = "furo"
html_title = f"nsmaps {version}"
html_static_path = ["_static"]
html_css_files = ["pictures.css"]
EXPLORED = "vi_pair/explore.html"


def write_api(app: object) -> None:
    """The page of all public names, room by room, generated from the package's own list."""
    import nsmaps

    lines = ["# API", "", "Each name is imported from its module when it is first used.", ""]
    for package in (nsmaps, *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in (*nsmaps.__all__, "figures"))):
        lines += [f"## {package.__name__}", ""]
        for name in (name for name in package.__all__ if name != "__version__"):
            kind = "autoclass" if isinstance(getattr(package, name), type) else "autofunction"
            lines += ["```{eval-rst}", f".. {kind}:: {package.__name__}.{name}", "```", ""]
    folder = Path(__file__).parent / "_generated"
    folder.mkdir(exist_ok=True)
    (folder / "api.md").write_text("\n".join(lines))


def write_explore(app: Any, error: Exception | None) -> None:
    """The page of a study to be turned by hand, from a run made when the site is built: `EXPLORED` below the site's root."""
    if error is None and app.builder.format == "html":
        import nsmaps
        from nsmaps.explore.page.write import write_page

        folder = (Path(app.outdir) / EXPLORED).parent
        folder.mkdir(exist_ok=True)
        write_page(nsmaps.run_study(f"{folder.name}/explore"), folder)


def open_in_full(app: Any, page: Any) -> None:
    """Pictures are links to their files, as Sphinx makes them of those with a scale; those of cards are links already."""
    from docutils.nodes import image

    for picture in page.findall(image):
        if "sd-card-img-top" not in picture["classes"]:
            picture["scale"] = 100


def setup(app: Any) -> None:
    """Write the page before any is read."""
    app.connect("builder-inited", write_api)
    app.connect("doctree-read", open_in_full)
    app.connect("build-finished", write_explore)
