"""Physical properties of a settling suspension, and the scales that they set."""

import warnings
from dataclasses import dataclass, fields, replace
from math import cbrt, isfinite

from dustfall.spheres import plain
from dustfall.units import SPHERE_VOLUME

MOST_GALILEO = 1.0
"""Largest Galileo number that is settled with Stokes drag. It is the Reynolds number that Stokes'
law gives a lone sphere, and inertia of the fluid adds 3/16 of that to its drag (Oseen): 19 %."""

DOUBTFUL_GALILEO = 0.5
"""Where it exceeds this, 9 % by Oseen, a warning says so."""


@dataclass(frozen=True)
class Properties:
    """One fluid and one kind of sphere, in SI units.

    The defaults are those of mineral dust in air at 20 °C (paper, Table 1).

    Attributes
    ----------
    fluid_density : kg/m³
    viscosity : dynamic viscosity of the fluid, Pa s
    diameter : of a particle, m
    particle_density : kg/m³, larger than that of the fluid
    gravity : m/s²

    Raises
    ------
    ValueError : a property is not positive and finite, or the particles are not heavier than the
        fluid.
    """

    fluid_density: float = 1.2041
    viscosity: float = 1.81e-5
    diameter: float = 25e-6
    particle_density: float = 2500.0
    gravity: float = 9.81

    def __post_init__(self):
        for field in fields(self):
            value = plain(getattr(self, field.name))
            object.__setattr__(self, field.name, value)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{field.name} is {value}: it has to be positive and finite")
        if self.particle_density <= self.fluid_density:
            raise ValueError(
                f"particle_density is {self.particle_density} kg/m³: it has to exceed "
                f"fluid_density, {self.fluid_density} kg/m³, for the particles to settle"
            )

    @property
    def response_time(self) -> float:
        """tau = rho_p d² / (18 eta), in s (paper, Table 1); added mass is left out, as there."""
        return self.particle_density * self.diameter**2 / (18 * self.viscosity)

    @property
    def settling_velocity(self) -> float:
        """v_s = d² g (rho_p - rho_f) / (18 eta) of an isolated sphere, in m/s (paper, Table 1)."""
        excess_density = self.particle_density - self.fluid_density
        return self.diameter**2 * self.gravity * excess_density / (18 * self.viscosity)

    @property
    def galileo(self) -> float:
        """Ga = v_s d rho_f / eta (paper, section "Mineral dust sedimentation")."""
        return self.settling_velocity * self.diameter * self.fluid_density / self.viscosity

    @property
    def stokes_number(self) -> float:
        """v_s tau / d: the diameters that an isolated sphere settles in one response time."""
        return self.settling_velocity * self.response_time / self.diameter

    def check_stokes_flow(self) -> None:
        """Raise ValueError where the flow around a sphere is no Stokes flow; warn where it may be.

        Limits: `MOST_GALILEO` and `DOUBTFUL_GALILEO`.
        """
        si = ", ".join(f"{field.name} {getattr(self, field.name):g}" for field in fields(self))
        found = f"the Galileo number is {self.galileo:.3g} ({si}, in SI units)"
        if not self.galileo <= MOST_GALILEO:
            raise ValueError(
                f"{found}: Stokes drag is allowed up to {MOST_GALILEO:g}, where the inertia of the "
                "fluid adds 19 % to it"
            )
        if self.galileo > DOUBTFUL_GALILEO:
            warnings.warn(
                f"{found}: above {DOUBTFUL_GALILEO:g} the inertia of the fluid, which is left out, "
                f"adds {3 / 16 * self.galileo:.0%} to the drag",
                stacklevel=2,
            )

    def spreading_time(self, volume_fraction: float) -> float:
        """Time [tau] in which a random cloud forgets who was next to whom: l^2 d_p / (v_s tau).

        l is the mean spacing in d_p, and a Stokeslet at that distance moves a sphere by the
        order of v_s / l: at this velocity l takes so long. With five neighbours the spread of the
        velocities in a random cloud is 1.1 v_s / l, from phi = 1e-8 to 1e-3.
        """
        spacing = mean_spacing(volume_fraction)
        return spacing**2 / self.stokes_number

    def with_galileo_multiple(self, multiple: float, change: str = "gravity") -> "Properties":
        """The same suspension at `multiple` times its Galileo number, by changing one property.

        Ga = d³ g rho_f (rho_p - rho_f) / (18 eta²), so each choice of `change` ("gravity",
        "viscosity", "diameter", "particle_density") has one answer; all but gravity also change
        the response time.

        Raises
        ------
        ValueError : `multiple` is not positive, or `change` is none of the four.
        """
        if not (isfinite(multiple) and multiple > 0):
            raise ValueError(f"Galileo multiple is {multiple}: it has to be positive and finite")
        excess_density = self.particle_density - self.fluid_density
        changed = {
            "gravity": self.gravity * multiple,
            "viscosity": self.viscosity / multiple ** (1 / 2),
            "diameter": self.diameter * multiple ** (1 / 3),
            "particle_density": self.fluid_density + excess_density * multiple,
        }
        if change not in changed:
            raise ValueError(f"change is {change!r}: allowed are {', '.join(changed)}")
        return replace(self, **{change: changed[change]})


def mean_spacing(volume_fraction: float) -> float:
    """Side of the cube [d_p] that a particle has to itself: n^(-1/3) of the number density n."""
    return cbrt(SPHERE_VOLUME / volume_fraction)
