import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.step_size import step_size_table


def series(step, error):
    time = np.arange(0, 20 + step / 2, step)
    constant = np.ones_like(time)
    return xr.Dataset(
        {
            "time": ("step", time),
            "inverse_beta_mean": ("step", 1 + 0.1 * time + error * np.minimum(time, 1)),
            "settling_velocity_mean": ("step", constant),
            "settling_velocity_variance": ("step", 0.5 * constant),
            "new_neighbours": ("step", np.where(time > 15, 0.2, 0.0)),
            "only_farthest": ("step", np.where(time > 15, 0.75, np.nan)),
            "overlaps": ("step", 3 * constant),
        },
        attrs={"step": step},
    )


def test_steps_are_compared_early_with_the_smallest_and_late_by_averages():
    table = step_size_table([series(0.2, 0.04), series(0.1, 0.01), series(0.05, 0.0)], 10.0, 1.0)
    assert table.step.tolist() == [0.05, 0.1, 0.2]
    np.testing.assert_allclose(table.early_error, [0, 0.01, 0.04], atol=1e-12)
    np.testing.assert_allclose(table.inverse_beta_mean, [2.5, 2.51, 2.54], atol=1e-12)
    np.testing.assert_allclose(table.settling_velocity_variance, 0.5)
    np.testing.assert_allclose(table.settling_velocity_variance_half_width, 0, atol=1e-12)
    np.testing.assert_allclose(table.only_farthest, 0.75)
    np.testing.assert_allclose(table.overlaps, 3)


def test_the_same_step_twice_is_refused():
    with pytest.raises(ValueError, match="none twice"):
        step_size_table([series(0.1, 0), series(0.1, 1)], 10.0, 1.0)
