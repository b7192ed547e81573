"""Spectra: Parseval, known slopes, wavenumbers, and the leakage of a plain periodogram."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import signal

from dustfall.analysis.spectra import (
    UNITS,
    averaged_in_bins,
    cloud_spectra,
    energy_spectrum,
    phase_and_spectra,
    power_spectral_density,
    spectral_slope,
)


def ornstein_uhlenbeck(m, interval, time_scale=1.0, seed=1):
    """Exact samples of a stationary Ornstein-Uhlenbeck process of unit variance."""
    rng = np.random.default_rng([seed, m])
    a = np.exp(-interval / time_scale)
    noise = np.sqrt(1 - a**2) * rng.normal(size=m)
    return signal.lfilter([1], [1, -a], noise, zi=[a * rng.normal()])[0]


def tracked_run(velocity, interval=0.1, phi=1e-3):
    """A run whose tracked particles settle with the given velocities (steps, 3)."""
    steps = len(velocity)
    vectors = np.zeros((steps, 3, 3))
    vectors[:, :, 2] = -velocity
    forces = np.zeros((steps, 3, 3))
    forces[:, :, 2] = 0.5 * velocity
    dims = ("step", "tracked", "spatial")
    return xr.Dataset(
        {
            "time": ("step", interval * np.arange(steps)),
            "tracked_velocity": (dims, vectors),
            "tracked_force": (dims, forces),
        },
        attrs={
            "model": "idnn",
            "n": 1000,
            "volume_fraction": phi,
            "galileo": 0.078,
            "stokes_number": 9.0,
        },
    )


@pytest.mark.parametrize("m", [4, 5, 1000, 1001])
def test_parseval_holds_to_rounding_for_odd_and_even_lengths(m):
    x = np.random.default_rng(m).normal(2.0, 1.5, m)
    frequency, density = power_spectral_density(x, 0.02)
    assert density.sum() * frequency[1] == pytest.approx(x.var(), rel=1e-12)
    assert frequency[-1] == pytest.approx(25.0 if m % 2 == 0 else 25.0 * (m - 1) / m)


def test_parseval_holds_for_welch_in_the_mean_and_a_sine_has_its_line():
    x = np.random.default_rng(1).normal(size=50_000)
    frequency, density = power_spectral_density(x, 0.5, method="welch", segment=1000)
    assert density.sum() * frequency[1] == pytest.approx(x.var(), rel=0.02)
    sine = 3 * np.sin(2 * np.pi * 0.25 * 0.5 * np.arange(4000))
    frequency, density = power_spectral_density(sine, 0.5, method="welch", segment=1000)
    assert frequency[density.argmax()] == pytest.approx(0.25)
    assert density.sum() * frequency[1] == pytest.approx(4.5, rel=0.01)


def test_energy_over_wavenumbers_is_the_variance_and_kappa_that_of_the_settling_wave():
    interval, mean, stokes_number = 0.1, 1.4, 9.0
    time = interval * np.arange(2000)
    velocity = mean + 0.1 * np.cos(2 * np.pi * 0.5 * time)
    kappa, energy = energy_spectrum(velocity, interval, stokes_number)
    assert energy.sum() * kappa[0] == pytest.approx(velocity.var(), rel=1e-12)
    # One period of 2 tau at 1.4 v_s is a wave of 2 * 1.4 * 9 d_p.
    assert kappa[energy.argmax()] == pytest.approx(2 * np.pi / (2 * mean * stokes_number))


@pytest.mark.parametrize("method", ["periodogram", "welch"])
def test_ornstein_uhlenbeck_process_has_slope_minus_two_within_its_error(method):
    interval = 0.02
    x = ornstein_uhlenbeck(100_000, interval)
    kappa, energy = energy_spectrum(x + 10, interval, method=method)
    spectrum = averaged_in_bins(kappa, energy)
    # Well above the corner (f = 1/(2 pi)) and well below the Nyquist frequency of 25.
    unit = 2 * np.pi / (x.mean() + 10)
    law = spectral_slope(*(spectrum[c] for c in spectrum), limits=(1.0 * unit, 5.0 * unit))
    assert law.slope == pytest.approx(-2, abs=0.06)
    assert abs(law.slope + 2) < 4 * law.standard_error
    assert law.standard_error < 0.03


def test_standard_error_of_the_slope_is_the_spread_over_realisations():
    slopes, errors = [], []
    for seed in range(60):
        x = ornstein_uhlenbeck(4000, 0.02, seed=seed)
        kappa, energy = energy_spectrum(x + 10, 0.02, window="hann")
        spectrum = averaged_in_bins(kappa, energy)
        law = spectral_slope(*(spectrum[c] for c in spectrum), limits=(0.5, 3.0))
        slopes.append(law.slope)
        errors.append(law.standard_error)
    assert 0.6 < np.mean(errors) / np.std(slopes) < 1.5


def test_exact_power_law_is_found_exactly():
    kappa = np.logspace(-2, 1, 30)
    law = spectral_slope(kappa, 3.0 * kappa**-1.7)
    assert law.slope == pytest.approx(-1.7, abs=1e-12)
    assert law.standard_error < 1e-12
    # A single periodogram ordinate lies below its mean by Euler's constant in the logarithm.
    np.testing.assert_allclose(law(kappa), 3.0 * np.exp(np.euler_gamma) * kappa**-1.7)


def test_a_plain_periodogram_of_a_slow_drift_shows_a_false_slope_of_minus_two():
    time = 0.05 * np.arange(1000)
    drift = 1.0 + 1e-3 * time / time[-1]
    slopes = {}
    for window in ("boxcar", "hann"):
        kappa, energy = energy_spectrum(drift, 0.05, window=window)
        limits = (0, kappa[-1] / 4)
        slopes[window] = spectral_slope(kappa, energy, limits=limits).slope
    assert slopes["boxcar"] == pytest.approx(-2, abs=0.1)
    assert slopes["hann"] < -4


def test_bins_keep_every_ordinate_and_their_total():
    rng = np.random.default_rng(1)
    kappa, energy = 0.1 * np.arange(1, 500), rng.exponential(size=499)
    table = averaged_in_bins(kappa, energy)
    assert table["ordinates"].sum() == 499
    assert (table["energy"] * table["ordinates"]).sum() == pytest.approx(energy.sum())
    assert table["kappa"].is_monotonic_increasing


def test_table_holds_phase_spectrum_and_fit_of_every_particle_that_moves():
    rng = np.random.default_rng(7)
    velocity = 1.4 + 0.05 * np.cumsum(rng.normal(size=(800, 3)), axis=0) / 20
    velocity[:, 2] = 1.0
    table = phase_and_spectra([tracked_run(velocity)], 20.0, points=100)
    phase = table[table["panel"] == "phase"]
    assert (phase.groupby("particle").size() == 100).all()
    np.testing.assert_allclose(phase["y"], 0.5 * phase["x"])
    assert set(table.loc[table["panel"] == "spectrum", "particle"]) == {1, 2}
    fit = table[(table["panel"] == "fit") & (table["particle"] == 1)]
    ends = np.log(fit["y"].to_numpy()), np.log(fit["x"].to_numpy())
    assert np.diff(ends[0]) / np.diff(ends[1]) == pytest.approx(fit["slope"].iloc[0])


def cloud(velocity, interval=0.2):
    """A trajectory of particles that settle with the given velocities (frames, n)."""
    frames, n = velocity.shape
    vectors = np.zeros((frames, n, 3))
    vectors[:, :, 2] = -velocity
    position = np.random.default_rng(n).uniform(0, 10, (n, 3)) + np.zeros((frames, 1, 1))
    run = tracked_run(np.ones((frames, 3)), interval)
    dims = ("frame", "atom", "spatial")
    return xr.Dataset(
        {
            "time": ("frame", run["time"].values),
            "velocities": (dims, vectors),
            "coordinates": (dims, position),
            "cell_lengths": (("frame", "cell_spatial"), np.full((frames, 3), 10.0)),
        },
        attrs=run.attrs | {"n": n},
    )


def test_the_cloud_has_the_mean_of_its_particles_spectra_and_parseval_holds():
    velocity = np.random.default_rng(3).normal(1.4, 0.1, (41, 30))
    table = cloud_spectra([cloud(velocity)], 0.0)
    plain = table[(table["method"] == "periodogram") & (table["panel"] == "spectrum")]
    kappa = plain["x"].to_numpy()
    assert plain["y"].sum() * kappa[0] == pytest.approx(velocity.var(axis=0).mean(), rel=1e-12)
    assert kappa[0] == pytest.approx(2 * np.pi / (41 * 0.2) / (velocity.mean() * 9.0))


def test_the_jackknife_interval_of_the_slope_holds_that_of_many_clouds():
    rows = []
    for seed in range(20):
        velocity = np.stack(
            [ornstein_uhlenbeck(512, 0.02, 1.0, 100 * seed + i) for i in range(40)], axis=1
        )
        table = cloud_spectra([cloud(velocity + 30, 0.02)], 0.0, (1.0, 5.0))
        rows.append(table[(table["method"] == "periodogram") & (table["panel"] == "fit")].iloc[0])
    fits = pd.DataFrame(rows)
    assert fits["slope"].mean() == pytest.approx(-2, abs=0.06)
    held = fits["slope_low"] < fits["slope"].mean()
    held &= fits["slope"].mean() < fits["slope_high"]
    assert held.sum() >= 16
    assert (fits["slope_high"] - fits["slope_low"]).mean() < 0.3


def test_a_cloud_that_never_changes_has_no_spectrum():
    with pytest.raises(ValueError, match="no trajectory whose particles change"):
        cloud_spectra([cloud(np.ones((20, 30)))], 0.0)


def test_bad_series_are_refused():
    with pytest.raises(ValueError, match="at least 4 values"):
        power_spectral_density(np.ones(3), 1.0)
    with pytest.raises(ValueError, match="'fourier'"):
        power_spectral_density(np.ones(9), 1.0, method="fourier")
    with pytest.raises(ValueError, match="interval is 0"):
        power_spectral_density(np.ones(9), 0)
    with pytest.raises(ValueError, match="allowed: 4 to 9"):
        power_spectral_density(np.ones(9), 1.0, method="welch", segment=10)
    with pytest.raises(ValueError, match="above zero"):
        energy_spectrum(np.linspace(-1, 0, 9), 1.0)
    with pytest.raises(ValueError, match="at least 3"):
        spectral_slope([1, 2], [1, 1])
    with pytest.raises(ValueError, match="at least one series"):
        phase_and_spectra([], 0.0)
    uneven = tracked_run(np.ones((20, 3)))
    uneven["time"][5] += 0.05
    with pytest.raises(ValueError, match="uneven"):
        phase_and_spectra([uneven], 0.0)


@pytest.mark.parametrize("units", UNITS)
def test_parseval_holds_in_the_units_of_the_spectra(units):
    # A cloud of dust in air: what settles faster or slower does so in m/s.
    run = cloud(np.random.default_rng(6).normal(1.3, 0.1, (501, 20)))
    run.attrs |= {"diameter": 25e-6, "response_time": 4.8e-3, "settling_velocity": 0.047}
    table = cloud_spectra([run], 0.0, units=units)
    assert set(table["units"]) == {units}
    velocity = -run["velocities"].values[:, :, 2] * (0.047 if units == "SI" else 1.0)
    variance = velocity.var(axis=0).mean()
    own = table[table["method"] == "periodogram"]
    for panel in ("density", "spectrum"):
        curve = own[own["panel"] == panel]
        # Frequencies and wavenumbers are whole multiples of the first.
        assert curve["y"].sum() * curve["x"].iloc[0] == pytest.approx(variance, rel=1e-9)
    highest = own.loc[own["panel"] == "density", "x"].max()
    interval = float(run["time"][1]) * (4.8e-3 if units == "SI" else 1.0)
    assert highest == pytest.approx(250 / 501 / interval)


def test_units_leave_the_slope_and_the_phase_alone_and_need_the_scales_of_the_run():
    velocity = 1.3 + 0.1 * ornstein_uhlenbeck(400, 0.1)[:, None] * np.ones(3)
    run = tracked_run(velocity)
    with pytest.raises(ValueError, match="'diameter', which SI units need"):
        phase_and_spectra([run], 0.0, units="SI")
    with pytest.raises(ValueError, match="allowed: reduced, SI"):
        phase_and_spectra([run], 0.0, units="cgs")
    run.attrs |= {"diameter": 25e-6, "response_time": 4.8e-3, "settling_velocity": 0.047}
    reduced, si = (phase_and_spectra([run], 0.0, units=units) for units in UNITS)
    assert si["slope"].equals(reduced["slope"])
    phase = si["panel"] == "phase"
    assert si[phase][["x", "y"]].equals(reduced[phase][["x", "y"]])
    assert not np.isclose(si["x"], reduced["x"], rtol=0.1)[~phase].any()
