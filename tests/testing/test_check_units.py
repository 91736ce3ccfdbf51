"""Units that a system names are of what it has."""

import pytest
from messages import message
from nsmaps_buck_converter import BuckConverter
from nsmaps_impact_oscillator import ImpactOscillator

import nsmaps
from nsmaps.errors import CheckError
from nsmaps.study.conclusions.phrases import parameters
from nsmaps.testing.formulas import check_units

OSCILLATOR = {"zeta": 0.02, "w": 0.81, "A": 0.35, "wall": 1.0}


def of(units: object, dimensionless: bool = False) -> ImpactOscillator:
    class Named(ImpactOscillator):
        """With other units."""

    Named.units, Named.dimensionless = units, dimensionless
    return Named(**OSCILLATOR)


@pytest.mark.parametrize("name", ["impact_oscillator/grazing", "buck_converter/diagram", "vi_pair/fp", "duffing/diagram"])
def test_those_of_installed_systems_are_in_order(name: str) -> None:
    system = nsmaps.load_study(name).system_object()
    assert system.dimensionless or system.units
    check_units(system)


@pytest.mark.parametrize(
    ("units", "said"),
    [
        ({"walls": "m"}, message("testing.unknown-unit", name="walls", near="wall")),
        ({"A": ""}, message("testing.unit", name="A", cls="Named", unit="''")),
        ({"A": None}, message("testing.unit", name="A", cls="Named", unit="None")),
    ],
)
def test_others_are_errors(units: dict, said: str) -> None:
    with pytest.raises(CheckError, match=said):
        check_units(of(units))


def test_a_dimensionless_system_names_none() -> None:
    check_units(of({}, dimensionless=True))
    with pytest.raises(CheckError, match=message("testing.dimensionless")):
        check_units(of({"A": "m"}, dimensionless=True))


def test_reports_say_them() -> None:
    class Found:
        system = BuckConverter(E=24.5)

    assert "R = 22 Ω" in parameters(Found())
    assert "a1 = 8.4," in parameters(Found())
    assert "E = 24.5 V" in parameters(Found())
