"""Test whether the steady-state averages depend on the number of particles."""

import pandas as pd

import joblog
from dustfall.analysis.independence import independence_of_n
from dustfall.files import atomic
from dustfall.sedimentation.closures.all_particles import AllParticles

joblog.start(snakemake)

steady = pd.read_csv(snakemake.input.steady)
# Where all particles feel each other, what is found depends on the box: that is no question.
steady = steady[steady["model"] != AllParticles.name]
with atomic(snakemake.output[0]) as path:
    independence_of_n(steady).to_csv(path, index=False)
