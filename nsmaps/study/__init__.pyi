"""A file in, results out: studies in YAML, their runs, their verdicts, and the folders that keep them."""

from nsmaps.study.result import Verdict as Verdict
from nsmaps.study.sections.base import Finding as Finding
from nsmaps.study.sections.base import Table as Table
