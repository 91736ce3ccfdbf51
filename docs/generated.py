"""The pages that are made from the package when the site is built: keys, commands, errors, figures, arrays and more."""

import re
from ast import get_docstring, parse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
OPTION = "| option | meaning | default |\n|---|---|---|"
#: the pages that explain sections of studies, from the page that includes their keys
EXPLAINED = {
    "diagonal": "algorithm.md",
    "partition": "algorithm.md#the-algorithm-by-itself",
    "parametric_map": "algorithm.md",
    "domains": "numerics.md#bounds-of-auxiliary-maps",
    "second_iterate": "algorithm.md#the-second-iterate",
    "bifurcation_diagram": "dynamics.md#bifurcation-diagrams",
    "branches": "dynamics.md#branches-and-their-events",
    "bifurcation_curves": "dynamics.md#bifurcation-curves",
    "parameter_plane": "dynamics.md#parameter-planes",
    "lyapunov": "dynamics.md#lyapunov-exponents",
    "basins": "dynamics.md#basins-of-attraction",
    "global_continuation": "dynamics.md#attractors-along-a-parameter",
    "manifolds": "dynamics.md#manifolds-of-saddles",
    "noise": "dynamics.md#noise",
    "observe": "observables.md",
    "observable": "observables.md#formulas",
    "estimate": "../how-to/measured-data.md",
    "basin_distance": "../how-to/measured-motion.md#the-largest-safe-disturbance",
    "optimize": "../how-to/optimum.md",
    "morse_sets": "cells.md",
    "exit_times": "cells.md#exit-times",
    "proof": "proof.md",
    "horseshoe": "proof.md#chaos",
    "fit": "../how-to/fit.md",
}


def pages() -> dict[str, str]:
    """The text of every page by its name below `_generated`."""
    makers = (api, arrays, commands, errors, figures, keys, literature, rooms, thumbnails)
    return {f"{maker.__name__}.md": "\n".join(maker()) for maker in makers}


def api() -> Iterator[str]:
    """All public names, room by room, from the package's own list."""
    import nsmaps

    yield from ("# API", "", "Each name is imported from its module when it is first used.", "")
    for package in (nsmaps, *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in (*nsmaps.__all__, "figures"))):
        yield from (f"## {package.__name__}", "")
        for name in (name for name in package.__all__ if name != "__version__"):
            kind = "autoclass" if isinstance(getattr(package, name), type) else "autofunction"
            yield from ("```{eval-rst}", f".. {kind}:: {package.__name__}.{name}", "```", "")


def keys() -> Iterator[str]:
    """The keys of studies, section by section, from the classes of the analyses."""
    from nsmaps.study.schema import key_tables
    from nsmaps.study.study import Study

    tables = key_tables(Study)
    titles = {of: f"In an entry of `{of}`" if table.entry else f"In `{of}`" for of, table in tables.items()}
    for of, table in tables.items():
        if of:
            link = EXPLAINED.get(of)
            page = "" if not link else link if link.startswith("..") else f"../explanation/{link}"
            yield from ("", f"### {titles[of]}", "", table.text, "", *([f"[Explanation]({page})", ""] if page else []))
        yield from ("| key | values | default | meaning |", "|---|---|---|---|")
        for key in table.keys:
            kind = re.sub(r"section `(\w+)`", lambda found: f"[{found[1]}](#{_anchor(titles[found[1]])})", key.kind)
            yield f"| `{key.name}` | {kind} | {key.default} | {key.meaning} |"


def commands() -> Iterator[str]:
    """The commands with their options, from their own help."""
    from typer.main import get_command

    from nsmaps.cli.cli import app

    for name, command in sorted(get_command(app).commands.items()):
        arguments = [part for part in command.params if part.param_type_name == "argument"]
        usage = " ".join(["nsmaps", name, *(part.metavar or part.name.upper() for part in arguments)])
        yield from ("", f"## nsmaps {name}", "", f"`{usage}`", "", _paragraphs(command.help), "")
        yield from (f"`{(part.metavar or part.name.upper()).strip('[]')}`: {part.help}\n" for part in arguments if part.help)
        options = [part for part in command.params if part.param_type_name == "option" and not part.hidden]
        yield from ([OPTION] if options else [])
        for option in options:
            yield f"| {', '.join(f'`{each}`' for each in option.opts)} | {option.help} | {_default(option)} |"
        yield from ("", "```sh", *re.findall(r"(?m)^\$ (.*?) *$", command.epilog or ""), "```")


def errors() -> Iterator[str]:
    """The errors, from their docstrings."""
    from nsmaps import errors

    yield from ("| error | when |", "|---|---|")
    for name, cls in vars(errors).items():
        if isinstance(cls, type) and issubclass(cls, errors.NsmapsError) and cls is not errors.NsmapsError:
            yield f"| `{name}` | {' '.join((cls.__doc__ or '').split()).rstrip('.')} |"


def figures() -> Iterator[str]:
    """The figures of studies, from their declarations."""
    from nsmaps.study.study import CATALOGUE

    yield from ("| name | shows | needs |", "|---|---|---|")
    for name, figure in CATALOGUE.items():
        caption, needs = figure.caption.replace("|", "\\|"), ", ".join(f"`{section}`" for section in figure.sections)
        yield f"| `{name}` | {caption} | {needs} |"


def arrays() -> Iterator[str]:
    """The arrays of results, from the classes that declare them."""
    import nsmaps
    from nsmaps.results import ARRAY, ArrayProperty

    yield from ("| result | array | axes | unit | holds |", "|---|---|---|---|---|")
    for room in (nsmaps, *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in nsmaps.__all__)):
        for name in getattr(room, "__all__", ()):
            cls = getattr(room, name)
            fields = getattr(cls, "__dataclass_fields__", {}).items()
            declared = {key: field.metadata[ARRAY] for key, field in fields if ARRAY in field.metadata}
            if isinstance(cls, type):
                declared |= {key: value.declaration for key, value in vars(cls).items() if isinstance(value, ArrayProperty)}
            for key, each in declared.items():
                yield f"| `{name}` | `{key}` | {', '.join(each.axes)} | {each.unit or 'of the quantity'} | {each.text} |"


def literature() -> Iterator[str]:
    """The literature by topic, from `references.bib`."""
    text = (HERE / "references.bib").read_text(encoding="utf-8")
    for latex, letter in ((r"{\"u}", "ü"), (r"{\'e}", "é"), (r"{\l}", "ł"), (r"\&", "&"), (r"\url", "")):
        text = text.replace(latex, letter)
    topics: dict[str, list[str]] = {}
    for key, entry in re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", text, re.MULTILINE | re.DOTALL):
        fields = {name: re.sub("[{}]", "", value) for name, value in re.findall(r"(?m)^  (\w+) = \{(.*)\},$", entry)}
        authors = ", ".join(author.partition(",")[0] for author in fields["author"].split(" and "))
        place = [fields[name] for name in ("journal", "publisher", "school", "howpublished", "volume") if name in fields]
        year = [f"({fields['year']})"] if "year" in fields else []
        row = f"| `{key}` | {authors}, *{fields['title']}*, {' '.join([*place, *year])} | {fields['annote']} |"
        topics.setdefault(fields["keywords"], []).append(row)
    for topic, rows in topics.items():
        yield from ("", f"## {topic}", "", "| key | work | used in |", "|---|---|---|", *rows)


def rooms() -> Iterator[str]:
    """The packages of nsmaps, each with the first sentence of its docstring."""
    package = HERE.parent / "nsmaps"
    yield from ("| room | contents |", "|---|---|")
    for file in sorted(package.glob("*/**/__init__.py")):
        said = (get_docstring(parse(file.read_text(encoding="utf-8"))) or "").partition("\n\n")[0].replace("\n", " ")
        yield f"| `{file.parent.relative_to(package)}` | {said} |"


def thumbnails() -> Iterator[str]:
    """All pictures, each with a link to the page that shows it."""
    from ruamel.yaml import YAML

    listed = YAML(typ="safe").load((HERE / "gallery" / "figures.yaml").read_text(encoding="utf-8"))
    pictures = {f"../gallery/{one['file']}.png": ("../gallery/index", one["figure"]) for one in listed["figures"]}
    texts = {page: page.read_text(encoding="utf-8") for page in HERE.rglob("*.md") if page.parent.name[0] != "_"}
    for one in (*listed["pages"], *listed["saved"], *listed["tables"]):
        file = HERE.parent / one["file"]
        for page, text in texts.items():
            if file.is_relative_to(HERE) and (f"/{file.name})" in text or f"/{file.name}\n" in text):
                shown = f"../{page.relative_to(HERE).with_suffix('')}"
                pictures[f"../{file.relative_to(HERE)}"] = (shown, one.get("figure", page.stem))
    yield from ("# Thumbnails", "", "Every picture of these pages; a click leads to the page that shows it.", "")
    yield from ("::::{grid} 2 3 4 5", ":gutter: 2", "")
    for picture, (page, name) in pictures.items():
        yield from (":::{grid-item-card}", f":img-top: {picture}", f":img-alt: {name}", f":link: {page}", ":link-type: doc")
        yield from (f"`{name}`", ":::", "")
    yield "::::"


def _anchor(title: str) -> str:
    """The anchor of a heading."""
    return title.lower().replace("`", "").replace(" ", "-")


def _paragraphs(text: str | None) -> str:
    """The help of a command as paragraphs."""
    return "\n\n".join(" ".join(part.split()) for part in (text or "").split("\n\n"))


def _default(option: Any) -> str:
    """The default of an option as its help shows it."""
    shown = option.show_default if isinstance(option.show_default, str) else option.default
    return "" if shown in (None, False, "", ()) or callable(shown) else f"`{shown}`"
