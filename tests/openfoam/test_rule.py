"""`snakemake openfoam`: the same cloud in both programs."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).resolve().parents[2]


def test_both_programs_have_one_start_and_agree_in_the_means(tmp_path):
    subprocess.run(
        [
            *(sys.executable, "-m", "snakemake", "--cores", "1", "--directory", str(tmp_path)),
            *("--configfile", "config/smoke.yaml", "--", "openfoam"),
        ],
        cwd=ROOT,
        check=True,
    )
    table = pd.read_csv(tmp_path / "results/figures/openfoam_settling.csv")
    own, other = (table[table["program"] == name] for name in ("dustfall", "OpenFOAM"))
    np.testing.assert_allclose(own["time"], other["time"], atol=1e-9)
    assert own["velocity"].iloc[0] == other["velocity"].iloc[0] == 1.0
    assert own["velocity"].iloc[-1] > 1.3
    for quantity in ("inverse_beta", "velocity"):
        np.testing.assert_allclose(own[quantity], other[quantity], rtol=0.01, err_msg=quantity)
