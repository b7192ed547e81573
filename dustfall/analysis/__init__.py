"""Statistics of the data set and of settling clouds: from arrays and datasets to tidy tables."""

from dustfall.extras import extra

with extra("analysis"):
    import pandas  # noqa: F401
