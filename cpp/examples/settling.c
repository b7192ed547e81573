/* Drag on eight spheres that settle in a periodic box: nearest neighbours, then the model.
 *
 * cc -c settling.c && c++ settling.o ../dustfall.cpp -I.. -o settling && ./settling model.json */

#include <stdio.h>
#include <stdlib.h>

#include "dustfall.h"

enum { SPHERES = 8 };

int main(int count, char **argument) {
    const double period[3] = {9.0, 9.0, 9.0}, up[3] = {0.0, 0.0, 1.0};
    double position[SPHERES][3], flow[SPHERES][3], beta[SPHERES], side[SPHERES][3];
    dustfall_model *model = dustfall_load(count > 1 ? argument[1] : "model.json");
    if (model == NULL) {
        fprintf(stderr, "%s\n", dustfall_error());
        return 1;
    }
    /* All settle at one velocity: the fluid runs upwards past them. */
    for (int i = 0; i < SPHERES; ++i) {
        position[i][0] = i % 3 * 3.0;
        position[i][1] = i / 3 * 2.5;
        position[i][2] = i;
        flow[i][0] = flow[i][1] = 0.0;
        flow[i][2] = 1.0;
    }
    const int neighbours = dustfall_neighbours(model);
    double *vectors = malloc(sizeof(double) * 3 * SPHERES * neighbours);
    int64_t *rows = malloc(sizeof(int64_t) * SPHERES * neighbours);
    int failed = vectors == NULL || rows == NULL ||
                 dustfall_nearest(SPHERES, &position[0][0], period, neighbours, vectors, rows) ||
                 dustfall_drag(model, SPHERES, &flow[0][0], vectors, up, beta, &side[0][0]);
    if (failed) fprintf(stderr, "%s\n", dustfall_error());
    for (int i = 0; i < SPHERES && !failed; ++i)
        printf("%.12f %.12f %.12f %.12f\n", beta[i], side[i][0], side[i][1], side[i][2]);
    free(vectors);
    free(rows);
    dustfall_free(model);
    return failed;
}
