"""The planar pair against numpy's roots."""

import numpy as np
import pytest

from conftest import tvse

PAIR = dict(inertia=1, zeta_n=0.3, omega_n=1.2, zeta_b=0.005, omega_b=1, upsilon=0.2, phi=1)


def quartic(thrust, inertia, zeta_n, omega_n, zeta_b, omega_b, upsilon, phi):
    """The determinant of the pair (3), multiplied out by numpy."""
    nozzle = np.poly1d([inertia, 2 * zeta_n * omega_n * inertia, inertia * omega_n**2])
    mode = np.poly1d([1, 2 * zeta_b * omega_b, omega_b**2])
    return nozzle * mode - np.poly1d([upsilon, 0, 0]) * np.poly1d([upsilon, 0, phi * thrust])


def planar(*more, **pair):
    options = [f"--{name.replace('_', '-')}={value}" for name, value in pair.items()]
    return tvse("planar", *options, *more)


def sweep(thrusts, **pair):
    low, high = min(thrusts), max(thrusts)
    lines = planar(f"--sweep={low}:{high}:{len(thrusts)}", **pair).splitlines()[1:]
    for line in lines:
        thrust, stable, *numbers = line.split(",")
        parts = np.array(numbers, float).reshape(4, 2)
        yield float(thrust), stable == "true", parts[:, 0] + 1j * parts[:, 1]


OTHERS = [
    PAIR,
    PAIR | dict(upsilon=-0.3),
    PAIR | dict(zeta_n=0.05, omega_n=0.9, zeta_b=0.02),
    dict(inertia=24000, zeta_n=0.3, omega_n=39.6, zeta_b=0.005, omega_b=32.7, upsilon=24, phi=2.8e-3),
]


@pytest.mark.parametrize("pair", OTHERS)
def test_poles_are_the_roots_of_the_quartic(pair):
    push = 3 * pair["omega_b"] ** 2 * abs(pair["upsilon"]) / pair["phi"]
    stabilities = set()
    for thrust, stable, poles in sweep(np.linspace(0, push, 31), **pair):
        expected = quartic(thrust, **pair).roots
        ours, theirs = np.sort_complex(poles), np.sort_complex(expected)
        # Roots of a quartic by its companion matrix: the square root of ε where two nearly meet.
        assert np.abs(ours - theirs).max() < 1e-8 * np.abs(theirs).max()
        if abs(theirs.real).min() > 1e-8:
            assert stable == (theirs.real.max() < 0)
        stabilities.add(stable)
    assert pair["upsilon"] < 0 or stabilities == {True, False}


def test_the_critical_thrust_is_where_numpys_roots_reach_the_axis():
    text = planar("--thrust=0.2", **PAIR)
    line = next(l for l in text.splitlines() if l.startswith("critical thrust"))
    found = float(line.split()[-2])
    from scipy.optimize import brentq

    exact = brentq(lambda r: quartic(r, **PAIR).roots.real.max(), 0.1, 0.5, xtol=1e-14)
    assert abs(found - exact) < 6e-11
    assert abs(exact - 0.2502057481) < 6e-11
    assert "12.2360000000" in text
