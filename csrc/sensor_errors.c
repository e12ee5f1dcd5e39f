#include "sensor_errors.h"

#include <math.h>
#include <string.h>

void sensor_errors_take(const sensor_errors *e) {
    double *truth = e->truth;
    for (int k = 0; k < e->count; k++) {
        const sensor_field *const field = &e->field[k];
        memcpy(truth, field->value, (size_t)field->n * sizeof *truth);
        truth += field->n;
    }
}

void sensor_errors_give(sensor_errors *e) {
    const double *seen = e->seen;
    const double *const offset = e->offset + e->n * e->next++;
    for (int i = 0; i < e->n; i++) {
        const double x = e->seen[i] + offset[i], range = e->range[i], step = e->step[i];
        const double within = x < -range ? -range : x > range ? range : x;
        e->seen[i] = step != 0.0 ? step * rint(within / step) : within;
    }
    for (int k = 0; k < e->count; k++) {
        const sensor_field *const field = &e->field[k];
        memcpy(field->value, seen, (size_t)field->n * sizeof *seen);
        seen += field->n;
    }
}
