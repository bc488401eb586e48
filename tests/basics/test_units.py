import math
import subprocess
import sys
from fractions import Fraction

import cf_units
import numpy as np
import pint
from golden import refused
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, fixture, mark

from historysim.basics.units import (
    UNIT_OF,
    conversion_factor,
    metres,
    quantity,
    quantity_text,
    to_si,
    uncertain_text,
)
from historysim.errors import InputError


@mark.parametrize(
    "number", [0.05, -3, 0, Fraction(1, 4), np.float64(2.5), np.float32(0.5), np.int64(7)]
)
def test_a_number_is_si(number):
    result = quantity(number, "N")
    assert type(result) is float
    assert result == float(number)


# the exact SI values: 1 gf = 9.80665e-3 N, 1 lbf = 4.4482216152605 N, 1 in = 25.4 mm by definition
@mark.parametrize(
    "text, unit, expected",
    [
        ("50 mN", "N", 0.05),
        ("20 gf", "N", 0.196133),
        ("1.5 kip", "N", 6672.33242289075),
        ("-2.5e-3 mm", "m", -2.5e-6),
        ("100 µm", "m", 1e-4),
        ("100 \u03bcm", "m", 1e-4),
        ("2 min", "s", 120.0),
        ("44.1 mJ/m²", "J m-2", 0.0441),
        ("1 N/m", "J m-2", 1.0),
        ("334 mN/µm", "N m-1", 334e3),
        ("1e-99999999999999999999 N", "N", 0.0),
    ],
)
def test_text_with_a_unit(text, unit, expected):
    assert quantity(text, unit) == expected


@given(st.decimals(min_value="-1e6", max_value="1e6", allow_nan=False, places=6))
def test_a_unit_changes_no_bit_of_the_number(number):
    assert quantity(f"{number} mN", "N") == float(f"{number}e-3")
    assert quantity(f"{number} GPa", "Pa") == float(f"{number}e9")


@given(
    st.text(max_size=12) | st.from_regex(r"[0-9.]{1,4} ?[a-zA-Z0-9/*^() .-]{0,8}", fullmatch=True)
)
def test_any_text_is_a_finite_number_or_an_input_error(text):
    try:
        result = quantity(text, "N")
    except InputError as error:
        assert "expected" in str(error)  # noqa: PT017 - not every text is an error
    else:
        assert np.isfinite(result)


# as an independent library reads them
_UNITS = (
    "N mN kN gf kgf lbf kip ozf m nm µm um in mil ft angstrom s ms min h day Pa GPa hPa psi bar N/mm2 mJ/m2 "
    "J.m-2 erg/cm2 N/m mN/nm N.mm-1 lbf/in mm2 cm2 in2 1/mm2 mm-2 µm^-2 mm3/(N.m) m2/N g kg lb Hz kHz min-1 1/s "
    "rad mrad degree ° Newton newtons micron meters second K V"
)


@mark.parametrize("text", _UNITS.split(" "))
def test_units_agree_with_udunits(text):
    given = cf_units.Unit(text)
    for unit in ("N", "m", "s", "Pa", "J m-2", "N m-1", "m2", "m-2", "m3 J-1", "kg", "Hz", "rad"):
        # UDUNITS also converts into a reciprocal
        if given.is_convertible(unit) and given.convert(0.0, unit) == 0:
            assert conversion_factor(text, unit) == approx(given.convert(1.0, unit), rel=1e-6)
        else:
            with refused("not a unit of"):
                conversion_factor(text, unit)


def test_plain_units_need_no_library():
    code = (
        "import sys; import historysim.basics.units as u; "
        "assert u.quantity('70 mN', 'N') == .07; u.quantity('50 mJ m-2', 'J m-2'); u.conversion_factor('%', '1'); "
        "print([m for m in ('numpy', 'pint') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@mark.parametrize(
    "value, text",
    [
        (0.09, "90 mN"),
        (0.0, "0 N"),
        (999.96, "1 kN"),
        (1e-20, "1e-05 fN"),
    ],
)
def test_quantities_get_a_prefix(value, text):
    assert quantity_text(value, "N") == text


@mark.parametrize(
    "value, error, text",
    [
        (3.2001e-6, 1.728e-10, "3.20010 ± 0.00017 µm"),
        (-1.5e-9, 2.4e-8, "-2 ± 24 nm"),
        (0.25, 0.031, "250 ± 31 mN"),
        (20e-9, 1e-22, "20 nm ± 1e-07 fm"),
        (20e-9, math.nan, "20 nm"),
    ],
)
def test_a_standard_error_shares_prefix_and_digits_with_its_value(value, error, text):
    assert uncertain_text(value, error, "N" if value == 0.25 else "m") == text


def test_texts_and_lists_of_them_become_numbers():
    assert to_si("50 mN", "N") == 0.05
    assert to_si(["1 µm", 2e-6, ["3 nm"]], "m") == [1e-6, 2e-6, [3e-9]]
    assert to_si(np.array(["1 µm", "2 µm"]), "m") == [1e-6, 2e-6]
    assert [metres(came) for came in ("2 mm", 3, np.float32(0.5))] == [2e-3, 3.0, 0.5]


@mark.parametrize("came", [3.0, 7, None, b"1", {}, np.arange(3)])
def test_what_has_no_unit_comes_through(came):
    assert to_si(came, "m") is came


@fixture(scope="module")
def registry():
    return pint.UnitRegistry()


@mark.parametrize("unit", [*sorted({*UNIT_OF.values()}), "N m-1", "m3 J-1", "Hz", "Pa m0.5"])
def test_quantities_of_pint_become_numbers(registry, unit):
    # the same physical dimension in another unit, by pint's own parser, and its size
    other, factor = {
        "N": ("mN", 1e-3), "m": ("nm", 1e-9), "s": ("ms", 1e-3), "Pa": ("GPa", 1e9), "J m-2": ("mJ/mm**2", 1e3),
        "m2": ("mm**2", 1e-6), "m-2": ("1/mm**2", 1e6), "m3": ("mm**3", 1e-9), "J": ("mJ", 1e-3), "kg": ("g", 1e-3),
        "rad": ("degree", np.pi / 180), "Pa m0.5": ("MPa*m**0.5", 1e6), "N m-1": ("mN/nm", 1e6),
        "m3 J-1": ("mm**3/J", 1e-9), "Hz": ("kHz", 1e3),
    }[unit]  # fmt: skip
    assert to_si(registry.Quantity(3, other), unit) == approx(3 * factor, rel=1e-15)
    several = to_si(registry.Quantity(np.array([1.0, 2.0]), other), unit)
    np.testing.assert_allclose(several, np.array([1.0, 2.0]) * factor, rtol=1e-15)
    with refused(r"'3 kelvin' has another unit; expected an? .* in "):
        to_si(registry.Quantity(3, "K"), unit)


@mark.parametrize("text", ["0.75 MPa √m", "750 kPa*√m"])
def test_a_toughness_has_the_root_of_a_metre(text):
    assert quantity(text, "Pa m0.5") == 0.75e6


@mark.parametrize("text", ["0.75 MPa", "0.75 MPa √m √m"])
def test_another_unit_is_no_toughness(text):
    with refused("expected a unit such as"):
        quantity(text, "Pa m0.5")


@mark.parametrize(
    "value, digits, text",
    [
        (0.9996, 3, "1 N"),
        (0.123, 2, "120 mN"),
        (-5.000123e-6, 9, "-5.000123 µN"),
    ],
)
def test_rounding_changes_the_prefix_and_never_gives_an_exponent(value, digits, text):
    assert quantity_text(value, "N", digits) == text
