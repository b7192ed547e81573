"""Statistics of the data set and of settling clouds: from arrays and datasets to tidy tables."""
