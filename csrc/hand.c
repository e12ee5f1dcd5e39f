#include "hand.h"
#include "rotation.h"

#include <math.h>

static void pull(const hand *h, int part, const double *error, const double *rate, const double *speed) {
    double *const wrench = h->wrench + 3 * part;
    double size = 0.0;
    for (int k = 0; k < 3; k++) {
        wrench[k] = h->stiffness[part] * error[k] + h->damping[part] * (rate[k] - speed[k]);
        size += wrench[k] * wrench[k];
    }
    size = sqrt(size);
    for (int k = 0; k < 3 && size > h->strength[part]; k++) wrench[k] *= h->strength[part] / size;
}

void hand_pull(const hand *h, const double *place, const double *rate, const double *omega,
               const double *position, const double *twist) {
    double error[3], turn[3];
    for (int k = 0; k < 3; k++) error[k] = place[k] - position[k];
    rotation_log(h->between, turn);
    pull(h, 0, error, rate, twist);
    pull(h, 1, turn, omega, twist + 3);
}
