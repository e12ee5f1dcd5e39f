#include "balance.h"

#include <math.h>
#include <stddef.h>

/* Entry of an axis so many ticks ago. */
static double past(const torque_balance *b, const double *rows, int i, int ago) {
    const int row = (*b->head + b->depth - 1 - ago) % b->depth;
    return rows[row * b->n + i];
}

static void take(const torque_balance *b) {
    const size_t row = (size_t)*b->head * (size_t)b->n;
    for (int i = 0; i < b->n; i++) {
        b->commands[row + (size_t)i] = b->command[i];
        b->loads[row + (size_t)i] = b->load[i];
        b->rates[row + (size_t)i] = b->rate[i];
    }
    *b->head = (*b->head + 1) % b->depth;
}

int balance_torques(const torque_balance *b, int elapsed, int free_to_move) {
    const int w = b->window;
    int found = 0;
    take(b);
    for (int i = 0; i < b->n; i++) {
        const int comparable = free_to_move && elapsed == 1 && b->age[i] == 0 && b->command[i] != 0.0;
        b->since[i] = comparable ? b->since[i] + (b->since[i] < b->depth) : 0;
        b->agree[i] = b->unbalanced[i] = 0;
        if (b->since[i] < b->depth) continue;
        double told = 0.0, load = 0.5 * (past(b, b->loads, i, 0) + past(b, b->loads, i, w));
        for (int k = 1; k <= w; k++) told += past(b, b->commands, i, k);
        for (int k = 1; k < w; k++) load += past(b, b->loads, i, k);
        told /= w;
        load /= w;
        const double faster = past(b, b->rates, i, 0) - past(b, b->rates, i, w);
        const double inertial = b->rotor[i] * faster / (w * b->dt);
        /* by how much the mean would be another if the drive obeyed a tick earlier or later */
        const double earlier = past(b, b->commands, i, 0) - past(b, b->commands, i, w);
        const double later = past(b, b->commands, i, w + 1) - past(b, b->commands, i, 1);
        const double late = fmax(fabs(earlier), fabs(later)) / w;
        const double most = b->tolerance[i] + b->rub * fabs(load) + b->doubt * fabs(inertial) + late;
        const double apart = fabs(told - inertial - load);
        b->agree[i] = apart <= 0.5 * most;
        b->unbalanced[i] = !(apart <= most); /* what is not a number is one */
        found += b->unbalanced[i];
    }
    return found;
}
