import warnings

import numpy as np
import pytest

from dustfall.forces.formulas import FORMULAS
from dustfall.sedimentation import NearestNeighbours, Properties, random_start
from dustfall.sedimentation.properties import mean_spacing


def test_default_properties_are_those_of_the_papers_table():
    dust = Properties()
    assert dust.response_time == pytest.approx(4.79589e-3, abs=5e-9)
    assert dust.settling_velocity == pytest.approx(0.0470, abs=5e-5)
    assert dust.galileo == pytest.approx(0.078, abs=5e-4)


def test_weight_less_buoyancy_balances_stokes_drag_at_the_settling_velocity():
    water = Properties(1000.0, 1e-3, 1e-4, 2650.0, 9.81)
    volume = 3.141592653589793 / 6 * water.diameter**3
    weight = volume * (water.particle_density - water.fluid_density) * water.gravity
    drag = 3 * 3.141592653589793 * water.viscosity * water.diameter * water.settling_velocity
    assert drag == pytest.approx(weight, rel=1e-12)


def test_stokes_number_is_the_diameters_settled_in_a_response_time():
    dust = Properties()
    assert dust.stokes_number == pytest.approx(0.0470 * 4.79589e-3 / 25e-6, rel=1e-3)


@pytest.mark.parametrize("change", ["gravity", "viscosity", "diameter", "particle_density"])
def test_galileo_multiple_multiplies_the_galileo_number(change):
    dust = Properties()
    assert dust.with_galileo_multiple(4, change).galileo == pytest.approx(
        4 * dust.galileo, rel=1e-12
    )


def test_galileo_multiple_changes_gravity_alone_by_default():
    assert Properties().with_galileo_multiple(2) == Properties(gravity=2 * 9.81)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"viscosity": 0.0}, "viscosity is 0.0"),
        ({"diameter": float("nan")}, "diameter is nan"),
        ({"particle_density": 1.0}, "particle_density is 1.0"),
    ],
)
def test_impossible_properties_are_refused_by_name(wrong, named):
    with pytest.raises(ValueError, match=named):
        Properties(**wrong)


def test_numbers_of_numpy_are_plain_ones():
    gravity, diameter = np.float32(8.0), np.float32(2.0**-15)
    given = Properties(gravity=gravity, diameter=diameter)
    assert given == Properties(gravity=8.0, diameter=2.0**-15)
    assert all(type(value) is float for value in vars(given).values())
    assert type(given.with_galileo_multiple(np.float32(2.0)).gravity) is float


def test_unknown_way_to_the_galileo_number_is_refused():
    with pytest.raises(ValueError, match="fluid_density"):
        Properties().with_galileo_multiple(2, "fluid_density")


def test_what_is_no_stokes_flow_is_refused_and_what_may_be_none_is_told():
    dust = Properties()
    with pytest.raises(ValueError, match=r"Galileo number is .*diameter 25, .*is allowed up to 1"):
        Properties(diameter=25.0).check_stokes_flow()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dust.with_galileo_multiple(0.5 / dust.galileo * 0.999).check_stokes_flow()
    for multiple in (0.501, 0.999):
        with pytest.warns(UserWarning, match="inertia of the fluid"):
            dust.with_galileo_multiple(multiple / dust.galileo).check_stokes_flow()
    with pytest.raises(ValueError, match="Galileo number is 1"):
        dust.with_galileo_multiple(1.001 / dust.galileo).check_stokes_flow()


def test_a_random_cloud_spreads_by_its_mean_spacing_in_a_spreading_time():
    properties = Properties()
    for phi in (1e-3, 1e-6):
        start = random_start(2000, phi, seed=1, velocity="stokes")
        closure = NearestNeighbours(FORMULAS["rotne_prager"])
        spread = (1 / closure(start).beta).std() * properties.stokes_number
        moved = spread * properties.spreading_time(phi) / mean_spacing(phi)
        assert moved == pytest.approx(1.1, abs=0.15), phi
