"""Spectra of velocity fluctuations in time, turned into wavenumber, and their slope."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy
import xarray as xr

from dustfall.analysis.settling import (
    case_of,
    even_interval,
    from_time,
    settling_velocities,
    stokes_number,
    with_starts,
)
from dustfall.analysis.time_averages import ROUNDING

METHODS = ("periodogram", "welch")

REDUCED, SI = UNITS = ("reduced", "SI")
"""Units of a spectrum: v_s, d_p and tau, or metres and seconds."""

BINS_PER_DECADE = 20
"""Of an averaged spectrum: narrow beside what a slope is fitted over, wide enough to average."""

HIGHEST_FITTED = 0.25
"""Highest frequency that a slope is fitted to, in sampling frequencies: half the Nyquist frequency,
above which aliasing bends the spectrum."""

SHORTEST_SEGMENT = 24
"""Samples of a Welch segment at least: with fewer the window hides what the spectrum is."""

SLABS = 10
"""Parts of a cloud that the slope of its spectrum is found without, each in turn."""


@dataclass(frozen=True)
class PowerLaw:
    """E = exp(intercept) kappa^slope, with the standard error of the slope."""

    slope: float
    standard_error: float
    intercept: float

    def __call__(self, kappa):
        return np.exp(self.intercept) * np.asarray(kappa) ** self.slope


def power_spectral_density(
    values, interval, method="periodogram", window="boxcar", segment=None
) -> tuple[np.ndarray, np.ndarray]:
    """One-sided power spectral density of evenly sampled series about their means.

    Parameters: `values` (..., m), `interval` between samples, `method` "periodogram" or "welch"
    (halved overlap, Hann unless `window` says otherwise), `segment` the samples of a Welch segment
    (default m/8, but at least 24). Returns the frequencies f >= 0 [1/unit of interval] and the
    density (..., frequencies) [unit of values squared times unit of interval].

    Parseval: for the plain periodogram sum(density) * f[1] is the variance to rounding, for odd
    and even m. A boxcar leaks the jump between last and first value as f^-2 into high frequencies,
    which looks like a power law; a Hann window does not.

    Raises ValueError for an unknown method, fewer than four values, values that are not finite,
    or an interval or a segment out of range.
    """
    x = np.asarray(values, dtype=float)
    samples = x.shape[-1] if x.ndim else 0
    if samples < 4:
        raise ValueError(f"a series of shape {x.shape} has no spectrum; at least 4 values")
    if not np.isfinite(x).all():
        raise ValueError(f"value {np.argwhere(~np.isfinite(x))[0].tolist()} is not finite")
    if not (np.isfinite(interval) and interval > 0):
        raise ValueError(f"the sampling interval is {interval}; it must be above zero")
    if method not in METHODS:
        raise ValueError(f"the method is {method!r}; allowed: {', '.join(METHODS)}")
    x = x - x.mean(axis=-1, keepdims=True)
    if method == "periodogram":
        return scipy.signal.periodogram(x, 1 / interval, window=window, detrend=False)
    segment = min(max(SHORTEST_SEGMENT, samples // 8), samples) if segment is None else segment
    if not 4 <= segment <= samples:
        raise ValueError(f"a Welch segment has {segment} samples; allowed: 4 to {samples}")
    window = "hann" if window == "boxcar" else window
    return scipy.signal.welch(x, 1 / interval, window=window, nperseg=segment, detrend=False)


def energy_spectrum(
    velocity, interval, stokes_number=1.0, **settings
) -> tuple[np.ndarray, np.ndarray]:
    """Energy spectrum E(kappa) of one particle's settling velocity.

    kappa = 2 pi f / mean v and E = PSD mean v / (2 pi) (paper, section "Mineral dust
    sedimentation"). Parameters: `velocity` (m,) [v_s], `interval` [tau], `stokes_number`
    = v_s tau / d_p, `settings` of `power_spectral_density`. Returns kappa > 0 [1/d_p] and
    E [v_s^2 d_p]; sum(E) dkappa is the variance.

    Raises ValueError for a particle that does not settle (mean velocity not above zero).
    """
    mean = float(np.mean(velocity)) * stokes_number
    if not mean > 0:
        raise ValueError(f"the mean settling velocity is {mean}; kappa needs one above zero")
    frequency, density = power_spectral_density(velocity, interval, **settings)
    kappa = 2 * np.pi * frequency / mean
    return kappa[1:], density[1:] * mean / (2 * np.pi)


def averaged_in_bins(kappa, energy, bins_per_decade=BINS_PER_DECADE) -> pd.DataFrame:
    """Average a spectrum in bins of equal width on the logarithmic axis.

    Returns the columns kappa (geometric mean), energy (mean) and ordinates (their number) of the
    bins that hold any.
    """
    kappa, energy = np.asarray(kappa, dtype=float), np.asarray(energy, dtype=float)
    number = np.floor(np.log10(kappa / kappa[0]) * bins_per_decade + 1e-9).astype(int)
    groups = pd.DataFrame({"kappa": np.log(kappa), "energy": energy}).groupby(number)
    table = groups.agg(kappa=("kappa", "mean"), energy=("energy", "mean"))
    table["kappa"] = np.exp(table["kappa"])
    return table.assign(ordinates=groups.size()).reset_index(drop=True)


def spectral_slope(kappa, energy, ordinates=None, limits=(0.0, np.inf)) -> PowerLaw:
    """Fit a power law to a spectrum by weighted least squares in log-log coordinates.

    Parameters: `kappa` and `energy` (m,); `ordinates` (m,), how many periodogram ordinates each
    value averages (default one); `limits` of kappa, inclusive. The logarithm of the mean of j
    ordinates of a random process is biased by psi(j) - ln j and has the variance psi'(j); the
    weights are these variances' inverses, and the standard error is scaled by the scatter found.

    Raises ValueError where fewer than three positive values lie inside the limits.
    """
    kappa, energy = np.asarray(kappa, dtype=float), np.asarray(energy, dtype=float)
    count = np.ones_like(kappa) if ordinates is None else np.asarray(ordinates, dtype=float)
    inside = (kappa > 0) & (energy > 0) & (kappa >= limits[0]) & (kappa <= limits[1])
    if inside.sum() < 3:
        raise ValueError(
            f"{inside.sum()} positive values of the spectrum lie between kappa = {limits[0]} and "
            f"{limits[1]}; a slope needs at least 3"
        )
    count = count[inside]
    x = np.log(kappa[inside])
    y = np.log(energy[inside]) - scipy.special.digamma(count) + np.log(count)
    weight = 1 / scipy.special.polygamma(1, count)
    centre = np.average(x, weights=weight)
    spread = np.sum(weight * (x - centre) ** 2)
    level = np.average(y, weights=weight)
    slope = np.sum(weight * (x - centre) * y) / spread
    scatter = np.sum(weight * (y - level - slope * (x - centre)) ** 2) / (len(x) - 2)
    return PowerLaw(float(slope), float(np.sqrt(scatter / spread)), float(level - slope * centre))


def phase_and_spectra(
    runs: list[xr.Dataset],
    start: float,
    fit_frequencies=(0.0, np.inf),
    points=1000,
    units=REDUCED,
    **settings,
) -> pd.DataFrame:
    """Tabulate the phase diagram and the energy spectrum of each run's tracked particles.

    Parameters: `runs`, series datasets (tracked_velocity [v_s] and tracked_force [weight minus
    buoyancy], both (step, tracked, spatial), gravity along -z; attribute stokes_number); `start`
    of the statistics [tau]; `fit_frequencies`, limits [1/tau] of the slope's fit, of which the
    upper is held at half the Nyquist frequency (above it aliasing bends the spectrum); `points`,
    the most rows of a phase diagram; `units` of the spectra (`in_units`); `settings` of
    `power_spectral_density`.

    Returns the columns panel ("phase", "spectrum" or "fit"), volume_fraction, n, particle (from
    1), x, y, slope, slope_error, units. Phase: x = v_s/v_s,Stokes, y = F_d/(F_g - F_b). Spectrum:
    x = kappa [1/d_p], y = E [v_s^2 d_p], averaged in bins. Fit: the two ends of the fitted line.
    A particle whose velocity never changes has a phase point and no spectrum.

    Raises ValueError for no run, unknown units, uneven time steps or too short a run.
    """
    tables = []
    for run in runs:
        part = from_time(run, start, "step")
        interval = even_interval(part["time"])
        number = stokes_number(run)
        velocity, drag = (
            part[name].transpose("step", "tracked", "spatial").values[:, :, 2].astype(float)
            for name in ("tracked_velocity", "tracked_force")
        )
        case = case_of(run)
        kept = np.unique(
            np.linspace(0, part.sizes["step"] - 1, min(points, part.sizes["step"]))
            .round()
            .astype(int)
        )
        for i in range(velocity.shape[1]):
            settling = -velocity[:, i]
            head = {k: case[k] for k in ("volume_fraction", "n")} | {"particle": i + 1}
            phase = {"panel": "phase", "x": settling[kept], "y": drag[kept, i], "units": units}
            tables.append(pd.DataFrame(head | phase))
            # A float32 series of an undisturbed particle differs by rounding alone.
            if np.ptp(settling) <= ROUNDING * abs(settling.mean()):
                continue
            kappa, energy = energy_spectrum(settling, interval, number, **settings)
            spectrum = averaged_in_bins(kappa, energy)
            per_frequency = 2 * np.pi / (settling.mean() * number)
            highest = min(fit_frequencies[1], HIGHEST_FITTED / interval)
            limits = (fit_frequencies[0] * per_frequency, highest * per_frequency)
            law = spectral_slope(
                spectrum["kappa"], spectrum["energy"], spectrum["ordinates"], limits
            )
            found = {"slope": law.slope, "slope_error": law.standard_error}
            curve = {"panel": "spectrum", "x": spectrum["kappa"], "y": spectrum["energy"]}
            ends = np.clip(limits, spectrum["kappa"].min(), spectrum["kappa"].max())
            fit = {"panel": "fit", "x": ends, "y": law(ends)}
            both = [pd.DataFrame(head | part | found) for part in (curve, fit)]
            tables.append(in_units(pd.concat(both), run, units))
    if not tables:
        raise ValueError("there are no runs: at least one series is needed")
    table = pd.concat(tables, ignore_index=True)
    columns = ["panel", "volume_fraction", "n", "particle", "x", "y", "slope", "slope_error"]
    return table.reindex(columns=[*columns, "units"])


def cloud_spectra(
    trajectories: list[xr.Dataset],
    starts: float | Sequence[float],
    fit_frequencies=(0.0, np.inf),
    progress=None,
    units=REDUCED,
) -> pd.DataFrame:
    """Tabulate the energy spectrum of the settling velocity, averaged over all particles.

    Parameters: `trajectories` (velocities (frame, atom, spatial) [v_s], coordinates, cell_lengths;
    attribute stokes_number), `starts` of their statistics [tau], `fit_frequencies` as in
    `phase_and_spectra`, `progress`, `units` of the spectra (`in_units`).
    kappa = 2 pi f / mean v with the mean over the cloud. The spectrum comes by both methods: the
    plain periodogram of the paper, and Welch's with its Hann window.

    The slope's 95 % interval is a jackknife: the cloud is cut into ten slabs by where particles
    were at `start`, so that neighbours stay together, and each slab is left out in turn.

    Returns the columns method, panel, volume_fraction, n, x, y, slope, slope_low, slope_high,
    units. Panel "density": x = f [1/tau], y = PSD [v_s^2 tau]; "spectrum" and "fit": x = kappa
    [1/d_p], y = E [v_s^2 d_p]. A case whose particles all keep their velocity has no rows.

    Raises ValueError for no trajectory, unknown units, uneven frames or fewer than four after
    `start`.
    """
    tables = []
    for done, (trajectory, start) in enumerate(with_starts(trajectories, starts), start=1):
        velocity, interval = settling_velocities(trajectory, start)
        if np.ptp(velocity, axis=0).max() > ROUNDING * abs(velocity.mean()):
            speed = velocity.mean() * stokes_number(trajectory)
            slab = _slabs(trajectory, start)
            case = case_of(trajectory)
            head = {k: case[k] for k in ("volume_fraction", "n")}
            for method in METHODS:
                frequency, density = power_spectral_density(velocity.T, interval, method=method)
                kappa = 2 * np.pi * frequency[1:] / speed
                energy = density[:, 1:] * speed / (2 * np.pi)
                highest = min(fit_frequencies[1], HIGHEST_FITTED / interval)
                limits = 2 * np.pi * np.array([fit_frequencies[0], highest]) / speed
                of_velocity = {"x": frequency[1:], "y": density[:, 1:].mean(axis=0)}
                both = [
                    pd.DataFrame({"panel": "density"} | of_velocity),
                    _with_slope(kappa, energy, slab, limits),
                ]
                found = pd.concat(both).assign(method=method, **head)
                tables.append(in_units(found, trajectory, units))
        if progress:
            progress(done, len(trajectories))
    if not tables:
        raise ValueError("there is no trajectory whose particles change their velocity")
    table = pd.concat(tables, ignore_index=True)
    columns = ["method", "panel", "volume_fraction", "n", "x", "y"]
    return table[[*columns, "slope", "slope_low", "slope_high", "units"]]


def in_units(table: pd.DataFrame, run: xr.Dataset, units: str) -> pd.DataFrame:
    """Give the spectra of a run, in v_s, d_p and tau, other units: "reduced" leaves them.

    `table`: panel, x, y. In "SI" the panels "spectrum" and "fit" get kappa [1/m] and E [m^3/s^2],
    "density" gets f [Hz] and the density of the velocity [(m^2/s^2)/Hz]. Returns it with the column
    units. Raises ValueError for other units, or a run without the attributes diameter [m],
    response_time [s] and settling_velocity [m/s].
    """
    if units not in UNITS:
        raise ValueError(f"units are {units!r}; allowed: {', '.join(UNITS)}")
    table = table.assign(units=units)
    if units == REDUCED:
        return table
    try:
        length, time, velocity = (
            float(run.attrs[name]) for name in ("diameter", "response_time", "settling_velocity")
        )
    except KeyError as error:
        raise ValueError(f"the dataset lacks the attribute {error}, which SI units need") from None
    scale = table["panel"].map({"density": time}).fillna(length)
    return table.assign(x=table["x"] / scale, y=table["y"] * velocity**2 * scale)


def _with_slope(kappa, energy, slab, limits) -> pd.DataFrame:
    """Mean spectrum of particles (n, kappa), its fitted line and the slope with its interval."""
    totals = np.array([energy[slab == s].sum(axis=0) for s in range(SLABS)])
    counts = np.bincount(slab, minlength=SLABS)
    mean = totals.sum(axis=0) / len(energy)
    ordinates = np.full(kappa.size, len(energy))
    law = spectral_slope(kappa, mean, ordinates, limits)
    without = [
        spectral_slope(kappa, (len(energy) * mean - t) / (len(energy) - c), ordinates, limits).slope
        for t, c in zip(totals, counts, strict=True)
    ]
    error = np.sqrt((SLABS - 1) * np.var(without))
    half = scipy.stats.t.ppf(0.975, SLABS - 1) * error
    ends = np.clip(limits, kappa[0], kappa[-1])
    table = pd.concat(
        [
            pd.DataFrame({"panel": "spectrum", "x": kappa, "y": mean}),
            pd.DataFrame({"panel": "fit", "x": ends, "y": law(ends)}),
        ]
    )
    return table.assign(slope=law.slope, slope_low=law.slope - half, slope_high=law.slope + half)


def _slabs(trajectory, start):
    """Which of ten slabs of equal width each particle is in at the start of the statistics."""
    first = from_time(trajectory, start, "frame").isel(frame=0)
    place = first["coordinates"][:, 0].values / float(first["cell_lengths"][0])
    return np.minimum((SLABS * (place - np.floor(place))).astype(int), SLABS - 1)
