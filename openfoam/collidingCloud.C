#include "collidingCloud.H"
#include "NeighbourDragForce.H"

// One file a cloud: the macro defines a type of a fixed name.
makeParticleForceModelType(NeighbourDragForce, collidingCloud);
