"""Several sections of one kind: one under a name of its own sees a study, and its result, as if it were the only one."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import create_model

from nsmaps.study.estimates import Size
from nsmaps.study.sections.base import Analysis, Finding, Need, Steps, Table, Verdict

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


def may_be_renamed(kind: type[Steps]) -> bool:
    """Whether a study may have several sections of a kind: of a step of its own, whose results replace no others."""
    return issubclass(kind, Analysis) and kind.computes() and kind.stored and kind.replaces is Steps.replaces


class OwnName(Analysis):
    """The methods of an analysis under another key: they call those of its class with what these know by their own key."""

    kind: ClassVar[type[Analysis]]

    def needs(self) -> Iterator[Need]:
        for loc, text, section in self.kind.needs(self):
            yield (self.key, *loc[1:]), text, section

    def check(self, study: "Study") -> None:
        self.kind.check(self, study_of(study, self.key, self.kind))

    def bind(self, binding: "Binding") -> Any:
        return self.kind.bind(self, replace(binding, study=study_of(binding.study, self.key, self.kind)))

    def compute(self, plan: "Plan", result: "StudyResult") -> Any:
        own = {**plan.bound, self.kind.key: plan.bound[self.key]}
        seen = replace(plan, study=study_of(plan.study, self.key, self.kind), bound=own)
        found = self.kind.compute(self, seen, result_of(result, self.key, self.kind))
        return {_part(self.key, self.kind, name): part for name, part in found.items()} if isinstance(found, Mapping) else found

    def describe(self, study: "Study") -> str:
        return self.kind.describe(self, study_of(study, self.key, self.kind))

    def size(self, study: "Study", system: "System") -> Size | None:
        return self.kind.size(self, study_of(study, self.key, self.kind), system)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        found = self.kind.numbers(self, result_of(result, self.key, self.kind))
        return {_part(self.key, self.kind, name): numbers for name, numbers in found.items()}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        for verdict in self.kind.verdicts(self, result_of(result, self.key, self.kind)):
            yield replace(verdict, name=f"{self.key}: {verdict.name.removeprefix(f'{self.kind.key}: ')}")

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        return self.kind.findings(self, result_of(result, self.key, self.kind))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        for table in self.kind.tables(self, result_of(result, self.key, self.kind)):
            yield replace(table, title=f"{self.key}: {table.title}")

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        seen, module = result_of(result, self.key, self.kind), figure.removeprefix(f"{self.key}_")
        name = self.kind.figures[0].name if figure == self.key else module
        return self.kind.caption(self, seen, name, part)


def study_of(study: "Study", key: str, kind: type[Analysis]) -> "Study":
    """The study in which the section `key` is that of its kind; errors name the place of `key`."""
    seen = study.model_copy(update={kind.key: getattr(study, key)})
    seen._source = replace(study.source, renamed={kind.key: key})
    return seen


def result_of(result: "StudyResult", key: str, kind: type[Analysis]) -> "StudyResult":
    """The result in which the parts of the section `key` are those of its kind."""
    own = {name: result.parts.get(_part(key, kind, name), empty) for name, empty in kind.results.items()}
    return replace(result, study=study_of(result.study, key, kind), parts={**result.parts, **own})


def _part(key: str, kind: type[Analysis], name: str) -> str:
    """The name of a part of a result of the section `key`, by that of its kind."""
    return key if name == kind.key else f"{key}_{name}"


def renamed(key: str, kind: type[Analysis]) -> type[Analysis]:
    """The class of a section of a kind under a name of its own, `key: {analysis: KIND, ...}`."""
    fields: Any = {"analysis": (Literal[kind.key], ...)}
    base: Any = (OwnName, kind)
    about: Any = {"__module__": kind.__module__, "__doc__": kind.__doc__}
    analysis: type[Analysis] = create_model(kind.__name__, __base__=base, **about, **fields)
    analysis.key, analysis.kind = key, kind  # type: ignore[attr-defined]
    analysis.results = {_part(key, kind, name): empty for name, empty in kind.results.items()}
    figures = []
    for number, figure in enumerate(kind.figures):
        needs = tuple(
            replace(need, sections=tuple(key if name == kind.key else name for name in need.sections)) for need in figure.needs
        )
        called = f"{key}_{figure.name}" if number else key
        figures.append(replace(figure, needs=needs, called=called, seen=partial(result_of, key=key, kind=kind)))
    analysis.figures = tuple(figures)
    return analysis
