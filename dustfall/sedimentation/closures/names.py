"""Names of the closures, in files and configurations; they stand where else a force model does."""

NEAREST_NEIGHBOURS = "nearest_neighbours"
ALL_PARTICLES = "all_particles"
BACK_FLOW = "back_flow"
