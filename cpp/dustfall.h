/* Force models of dustfall for C, Fortran and whatever calls C.
 *
 * Lengths are in particle diameters d_p, forces in Re_p c_D, where an isolated sphere feels 24 along
 * the flow. Arrays are dense with the last index running fastest (in Fortran: the shapes reversed).
 * A function that can fail returns a null pointer or a status other than zero, and
 * `dustfall_error()` says why. A model may be used by several threads at a time. */

#ifndef DUSTFALL_H
#define DUSTFALL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dustfall_model dustfall_model;

/* The model in a JSON file that `dustfall.forces.export` wrote; null where it cannot be read, is
 * damaged, of another version, or does not reproduce its test scenes. */
dustfall_model *dustfall_load(const char *path);
void dustfall_free(dustfall_model *model);

/* Neighbours N that the model takes. */
int dustfall_neighbours(const dustfall_model *model);
/* Kind of the model, and SHA-256 of what its file holds; both live as long as the model. */
const char *dustfall_name(const dustfall_model *model);
const char *dustfall_hash(const dustfall_model *model);

/* Force (count, 3) [Re_p c_D] on the reference sphere at the origin, for neighbours (count, N, 3)
 * [d_p], any order, in the frame of the flow (x spanwise, y streamwise, z vertical). */
int dustfall_predict(const dustfall_model *model, int64_t count, const double *neighbours,
                     double *force);

/* Drag on particles in any frame: 3 pi mu d (beta u + side), u = fluid velocity minus particle
 * velocity. Takes u as `flow` (count, 3), any unit, and neighbours (count, N, 3) [d_p] from each
 * particle; writes beta (count,) and side (count, 3) [unit of u]. A particle at rest has no drag;
 * its beta is that of a flow along `at_rest` (3,). */
int dustfall_drag(const dustfall_model *model, int64_t count, const double *flow,
                  const double *neighbours, const double *at_rest, double *beta, double *side);

/* The `number` nearest neighbours of each of the points (count, 3), exactly, with periodic images
 * along each axis whose period (3,) is not zero. Writes the vectors to them (count, number, 3),
 * nearest first, and their rows (count, number), counted from zero. At least `number` + 1 points
 * are needed. Lengths in any unit. */
int dustfall_nearest(int64_t count, const double *positions, const double *period, int number,
                     double *vectors, int64_t *rows);

/* Why the last call of this thread failed. */
const char *dustfall_error(void);

#ifdef __cplusplus
}
#endif

#endif
