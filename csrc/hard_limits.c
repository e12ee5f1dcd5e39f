#include "hard_limits.h"

#include <math.h>

int hard_limits_kept(const hard_limits *l) {
    for (int i = 0; i < l->n; i++) {
        const int placed = l->lower[i] <= l->position[i] && l->position[i] <= l->upper[i];
        if (!(placed && fabs(l->velocity[i]) <= l->motor_speed[i] && l->way[i] <= l->speed[i])) return 0;
    }
    return 1;
}
