"""The catalogue: every row is a figure that draws, with its sentences; tests/test_extension.py adds one."""

import re
from importlib import import_module
from inspect import isfunction, signature

import pytest

from nsmaps.study.pictures.animate import FILMS
from nsmaps.study.study import CATALOGUE, Study

SENTENCES = re.compile(r"[A-Z].*\.")


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_row_is_a_module_that_draws_and_whole_sentences(name):
    row = CATALOGUE[name]
    module = import_module(f"nsmaps.figures.{row.module}")
    required = [each for each in signature(module.sheets).parameters.values() if each.default is each.empty]
    assert len(required) <= len(row.needs) <= len(signature(module.sheets).parameters)
    drawn = [each for key, each in vars(module).items() if isfunction(each) and not key.startswith("_")]
    assert any("ax" in signature(each).parameters for each in drawn)
    assert SENTENCES.fullmatch(row.alt)
    assert SENTENCES.fullmatch(row.caption)
    assert set(row.sections) <= set(Study.model_fields)


def test_the_figures_that_move_are_those_that_say_so():
    assert {name for name, row in CATALOGUE.items() if row.animated} == set(FILMS)
