"""What a step of settling costs: every closure and size has its row, and a power law its power."""

import numpy as np
import pandas as pd
import pytest

from dustfall.benchmarks.settling_cost import exponents, settling_cost


def test_exponent_of_a_power_law_is_its_power():
    particles = np.array([1e3, 1e4, 1e6])
    table = pd.concat(
        pd.DataFrame(
            {"closure": name, "threads": 1, "particles": particles, "seconds": particles**power}
        )
        for name, power in {"fast": 1.0, "slow": 1.7}.items()
    )
    found = exponents(table)
    assert found["closure"].tolist() == ["fast", "slow"]
    assert found["exponent"].to_numpy() == pytest.approx([1.0, 1.7])


def test_every_closure_steps_clouds_of_every_size_in_what_it_takes():
    table = settling_cost([300, 200], 1e-3, threads=[1])
    assert table["particles"].tolist() == [200, 200, 300, 300]
    assert table["closure"].tolist() == ["nearest_neighbours", "all_particles"] * 2
    together = table["closure"] == "all_particles"
    assert (table.loc[together, "products"] >= 1.0).all()
    assert table.loc[~together, "products"].isna().all()
    assert (np.diff(table["memory"]) >= 0.0).all()
    assert (table["seconds"] * table["steps_per_second"]).to_numpy() == pytest.approx(1.0)
