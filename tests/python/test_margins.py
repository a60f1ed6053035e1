"""Margins of single loops against python-control, and against closed forms with delays."""

import csv
import io
import math

import control
import numpy as np
import pytest

from conftest import tvse


def listed(coefficients):
    return ",".join(repr(float(c)) for c in np.atleast_1d(coefficients))


def margins(numerator, denominator, *more):
    text = tvse("margins", "--numerator", listed(numerator), "--denominator", listed(denominator), *more)
    rows = list(csv.DictReader(io.StringIO(text)))
    value = {row["name"]: float(row["value"]) for row in rows}
    omega = {row["name"]: float(row["omega_rad_s"]) for row in rows if row["omega_rad_s"]}
    return value, omega


def random_loop(seed):
    """A strictly proper loop: light and heavy pairs, real poles, some integrators, some unstable."""
    rng = np.random.default_rng(seed)
    poles = list(-(10 ** rng.uniform(-1, 1.5, rng.integers(1, 4))))
    for _ in range(rng.integers(1, 4)):
        omega, zeta = 10 ** rng.uniform(-0.5, 1.5), 10 ** rng.uniform(-2.5, -0.2)
        if rng.random() < 0.15:
            zeta = -zeta
        poles += list(omega * (-zeta + 1j * math.sqrt(1 - zeta**2) * np.array([1, -1])))
    if rng.random() < 0.4:
        poles.append(0.0)
    if rng.random() < 0.15:
        poles.append(10 ** rng.uniform(-1, 0.5))
    zeros = []
    for _ in range(rng.integers(0, (len(poles) - 1) // 2 + 1)):
        omega, zeta = 10 ** rng.uniform(-0.5, 1.5), rng.uniform(-0.3, 0.9)
        zeros += list(omega * (-zeta + 1j * math.sqrt(1 - zeta**2) * np.array([1, -1])))
    zeros = zeros[: len(poles) - 1]
    if len(zeros) % 2:
        zeros = zeros[:-1]
    denominator, numerator = np.poly(poles).real, np.poly(zeros).real if zeros else np.ones(1)
    # A gain that brings the loop near 1 at a random frequency.
    at = 1j * 10 ** rng.uniform(-0.5, 1.2)
    gain = abs(np.polyval(denominator, at) / np.polyval(numerator, at)) * 10 ** rng.uniform(-0.7, 0.3)
    return gain * numerator, denominator


def closed_poles(numerator, denominator):
    return np.roots(np.polyadd(denominator, numerator))


SEEDS = range(150)
CAP_DB, CAP_S = 40.0, 10.0


@pytest.mark.parametrize("seed", SEEDS)
def test_margins_are_those_of_python_control(seed):
    numerator, denominator = random_loop(seed)
    value, omega = margins(numerator, denominator)
    unstable = int((closed_poles(numerator, denominator).real > 0).sum())
    assert value["unstable_poles"] == unstable
    if unstable:
        named = [v for n, v in value.items() if "margin" in n or n == "ellipse_distance"]
        assert len(named) == 6 and not any(named)
        return
    loop = control.tf(numerator, denominator)
    gains, phases, _, w_gain, w_phase, _ = control.stability_margins(loop, returnall=True)
    gains_db = 20 * np.log10(np.abs(gains))
    # A gain above 1 may still be put on, one below 1 taken off.
    high = min([g for g in gains_db if g > 0], default=CAP_DB)
    low = min([-g for g in gains_db if g <= 0], default=CAP_DB)
    # At zero frequency the loop is known to (ε/ω)² of its slowest pole, ε = ω/10 at most.
    assert value["gain_margin_high_db"] == pytest.approx(min(high, CAP_DB), rel=1e-5, abs=1e-3)
    assert value["gain_margin_low_db"] == pytest.approx(min(low, CAP_DB), rel=1e-5, abs=1e-3)
    phase = min(np.abs((np.array(phases) + 180) % 360 - 180), default=180)
    assert value["phase_margin_deg"] == pytest.approx(phase, rel=1e-5, abs=1e-3)
    delays = np.radians(np.array(phases) % 360) / np.array(w_phase)
    assert value["delay_margin_s"] == pytest.approx(min([*delays, CAP_S]), rel=1e-5, abs=1e-6)
    # python-control looks at given frequencies only: about ours and on a grid.
    grid = np.logspace(-3, 3, 5001)
    if "disk_margin" in omega and omega["disk_margin"] > 0:
        grid = np.sort(np.append(grid, omega["disk_margin"] * (1 + np.linspace(-1e-3, 1e-3, 201))))
    disk, gain, phase = control.disk_margins(loop, grid, skew=0.0)
    assert value["disk_margin"] <= disk * (1 + 1e-6)
    assert value["disk_margin"] == pytest.approx(min(disk, 2.0), rel=1e-4)


@pytest.mark.parametrize("seed", SEEDS[::10])
def test_the_curve_is_the_response(seed):
    numerator, denominator = random_loop(seed)
    delay = 0.06
    text = tvse(
        "margins",
        f"--numerator={listed(numerator)}",
        f"--denominator={listed(denominator)}",
        f"--delay={delay}",
        "--curve",
    )
    table = np.array([[float(v) for v in row] for row in list(csv.reader(io.StringIO(text)))[1:]])
    hertz, re, im, decibel, phase = table.T
    s = 2j * np.pi * hertz
    expected = control.tf(numerator, denominator)(s) * np.exp(-s * delay)
    found = re + 1j * im
    assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max()
    assert np.allclose(np.abs(found / expected), 1, atol=1e-9)
    assert np.allclose(decibel, 20 * np.log10(np.abs(found)), atol=1e-9)
    assert np.allclose(np.exp(1j * np.radians(phase)), found / np.abs(found), atol=1e-9)
    follows = (np.abs(decibel) < 39)[:-1] & (np.abs(decibel) < 39)[1:]
    assert np.abs(np.diff(phase))[follows].max(initial=0) <= 30.001


def test_the_disk_margin_of_the_published_example():
    value, omega = margins([25], [1, 10, 10, 10])
    assert value["disk_margin"] == pytest.approx(0.458, abs=5e-4)
    assert omega["disk_margin"] == pytest.approx(1.95, abs=6e-3)
    assert value["disk_gain_low"] == pytest.approx(0.627, abs=5e-4)
    assert value["disk_gain_high"] == pytest.approx(1.594, abs=5e-4)
    at = np.array([omega["disk_margin"]])
    disk, gain, phase = control.disk_margins(control.tf([25], [1, 10, 10, 10]), at)
    assert value["disk_margin"] == pytest.approx(disk, rel=1e-9)
    assert 20 * math.log10(value["disk_gain_high"]) == pytest.approx(gain, rel=1e-9)
    assert value["disk_phase_deg"] == pytest.approx(phase, rel=1e-9)


@pytest.mark.parametrize("crossover, delay", [(1.0, 0.1), (2.0, 0.25), (0.3, 4.0), (10.0, 0.06)])
def test_a_delayed_integrator_has_its_closed_forms(crossover, delay):
    value, _ = margins([crossover], [1, 0], f"--delay={delay}")
    assert value["unstable_poles"] == 0
    angle = math.pi / 2 - crossover * delay
    assert value["phase_margin_deg"] == pytest.approx(math.degrees(angle), rel=1e-9)
    assert value["delay_margin_s"] == pytest.approx(angle / crossover, rel=1e-9)
    gain = 20 * math.log10(math.pi / (2 * crossover * delay))
    assert value["gain_margin_high_db"] == pytest.approx(gain, rel=1e-9)


def test_a_delay_beyond_the_margin_makes_the_loop_unstable():
    assert margins([2], [1, 0], "--delay=0.78")[0]["unstable_poles"] == 0
    value, _ = margins([2], [1, 0], "--delay=0.79")
    assert value["unstable_poles"] == 2
    assert value["phase_margin_deg"] == 0
