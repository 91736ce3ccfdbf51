"""Verdicts that are expected to fail: what their failure shows, where it comes and where it does not."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from messages import message

import nsmaps
from nsmaps.study.conclusions.verdict import conclusion

STUDY = """\
system: vi_pair
parameters: {d: 0.35, r: 0.5, M: 0.1245, g: 9.8, beta: pi/3, F: 5}
orbits: [{start: {v: 0.35, phi: 1.5}, n_returns: 100}]
domains:
  - {name: flat, map: exact, bounds_kind: sampled, box: {v: [0.8, 0.87], phi: [0.3, 0.43]}, max_updates: 1}
  - {name: small, map: exact, bounds_kind: sampled, box: {v: [0.8214, 0.8454], phi: [0.3391, 0.3881]}, max_updates: 1REQUIRE}
expected_failures:
"""


def made(expected: str, require: str = "", **settings: float) -> nsmaps.StudyResult:
    Path("s.yaml").write_text(STUDY.replace("REQUIRE", require) + expected)
    return nsmaps.run_study(nsmaps.load_study("s.yaml", parameters=settings), "other" if settings else "out")


def text(result: nsmaps.StudyResult, name: str) -> str:
    (verdict,) = (verdict for verdict in result.verdicts if verdict.name == name)
    return verdict.text


def test_a_failure_that_is_expected_says_what_it_shows() -> None:
    plain = {verdict.name: verdict.text for verdict in made("  domain small: nothing\n").verdicts}
    result = made("  domain flat: a box may be too flat\n")
    because = plain["domain flat: forward invariant"].removeprefix("no: ")
    assert text(result, "domain flat: forward invariant") == f"no: expected to fail: shows that a box may be too flat; {because}"
    assert text(result, "domain flat: converged").startswith("no: expected to fail: shows that a box may be too flat; ")
    flat = [verdict.shows for verdict in result.verdicts if verdict.name.startswith("domain flat")]
    assert flat == ["a box may be too flat"] * 2
    assert text(result, "domain small: forward invariant") == plain["domain small: forward invariant"].replace(
        "expected to fail, but confirmed; ", ""
    )
    others = "2 hold, 2 fail as expected, 1 fails: domain small: converged (exact map)."
    assert f"Of 5 verdicts, none of them required, {others}" in conclusion(result)
    again = nsmaps.read_result("out")
    assert [verdict.shows for verdict in again.verdicts] == [verdict.shows for verdict in result.verdicts]
    kept = json.loads(Path("out/result.json").read_text())["verdicts"]
    assert sum(verdict["shows"] != "" for verdict in kept) == 2


def test_one_claim_or_one_map_of_a_name() -> None:
    result = made('  "domain flat: forward invariant": flat\n')
    assert [v.name for v in result.verdicts if v.shows] == ["domain flat: forward invariant"]
    result = made("  domain flat (exact map): flat\n")
    assert [v.name for v in result.verdicts if v.shows] == ["domain flat: forward invariant", "domain flat: converged"]
    assert not any(v.shows for v in made("  domain flat (composite map): flat\n").verdicts)


def test_what_holds_against_expectation_or_is_no_verdict_is_said() -> None:
    result = made("  domain small: too small\n  domain other: none\n")
    assert text(result, "domain small: forward invariant").startswith(
        "yes: expected to fail, but confirmed; no worst-case step leaves"
    )
    said = conclusion(result)
    assert "Expected to fail, but no verdict here that is not required: domain other." in said
    assert [verdict.name for verdict in result.verdicts if verdict.shows] == ["domain small: converged"]


def test_required_verdicts_and_other_parameters_are_not_excused() -> None:
    required = made("  domain flat: flat\n  domain small: small\n", ", require: [forward_invariant]")
    assert text(required, "domain small: forward invariant").startswith("yes: no worst-case step leaves")
    changed = made("  domain flat: flat\n", d=0.351)
    assert not any(verdict.shows for verdict in changed.verdicts)
    assert "xpected" not in conclusion(changed)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("  [1]\n", message("study.not-keys", name="expected_failures", value="[1]")),
        ("  domain flat: [1, 2]\n", message("study.not-a-text", name="domain flat", value="[1, 2]")),
    ],
)
def test_what_it_shows_is_a_text(wrong: str, said: str) -> None:
    Path("s.yaml").write_text(STUDY.replace("REQUIRE", "") + wrong)
    with pytest.raises(nsmaps.NsmapsError, match=said):
        nsmaps.load_study("s.yaml")


def test_a_single_verdict_is_stated_in_a_sentence() -> None:
    result = made("  domain small: nothing\n")
    one = replace(result, verdicts=[verdict for verdict in result.verdicts if verdict.name == "domain flat: forward invariant"])
    assert conclusion(one).startswith("The only verdict, which is not required, does not hold: domain flat: forward invariant.")
