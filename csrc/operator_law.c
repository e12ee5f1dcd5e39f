#include "operator_law.h"
#include "task_arm.h"

#include <string.h>

static void pushed(const operator_law *l, const double *wrench, double *tau) {
    memset(tau, 0, sizeof(double) * (size_t)l->n);
    task_arm_push_palm(l->n, l->J, l->rotation, wrench, tau);
}

void operator_law_update(const operator_law *l) {
    pushed(l, l->hand, l->command);
    pushed(l, l->felt, l->feedback);
    pushed(l, l->limits, l->avatar);
    for (int i = 0; i < l->n; i++) {
        l->command[i] *= l->alpha[i] * l->assist;
        l->torque[i] =
            l->command[i] + l->feedback[i] + l->own[i] + l->avatar[i] + l->null[i] + l->coriolis[i];
    }
}
