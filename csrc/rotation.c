#include "rotation.h"

#include <math.h>
#include <string.h>

void rotation_log(const double *R, double *vector) {
    /* sin(angle) times the axis, and cos(angle) */
    const double x = 0.5 * (R[7] - R[5]), y = 0.5 * (R[2] - R[6]), z = 0.5 * (R[3] - R[1]);
    const double sine = sqrt(x * x + y * y + z * z);
    const double cosine = 0.5 * (R[0] + R[4] + R[8] - 1.0);
    const double angle = atan2(sine, cosine);
    if (sine > 1e-6 || cosine > 0.0) {
        const double scale = sine > 1e-8 ? angle / sine : 1.0 + sine * sine / 6.0;
        vector[0] = scale * x, vector[1] = scale * y, vector[2] = scale * z;
        return;
    }
    /* close to a half turn R + 1 = 2 a a^T: take the axis from the column of its largest entry */
    int k = 0;
    for (int i = 1; i < 3; i++)
        if (R[4 * i] > R[4 * k]) k = i;
    double norm = 0.0;
    for (int i = 0; i < 3; i++) {
        vector[i] = 0.5 * (R[3 * i + k] + R[3 * k + i]) + (i == k ? 1.0 : 0.0);
        norm += vector[i] * vector[i];
    }
    norm = sqrt(norm);
    const double sign = x * vector[0] + y * vector[1] + z * vector[2] < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 3; i++) vector[i] *= sign * angle / norm;
}

void rotation_exp(const double *vector, double *R) {
    const double x = vector[0], y = vector[1], z = vector[2];
    const double square = x * x + y * y + z * z, angle = sqrt(square);
    /* sin(t) / t and (1 - cos(t)) / t^2 */
    const double s = angle > 1e-4 ? sin(angle) / angle : 1.0 - square / 6.0;
    const double c = angle > 1e-4 ? (1.0 - cos(angle)) / square : 0.5 - square / 24.0;
    R[0] = 1.0 - c * (y * y + z * z), R[1] = c * x * y - s * z, R[2] = c * x * z + s * y;
    R[3] = c * x * y + s * z, R[4] = 1.0 - c * (x * x + z * z), R[5] = c * y * z - s * x;
    R[6] = c * x * z - s * y, R[7] = c * y * z + s * x, R[8] = 1.0 - c * (x * x + y * y);
}

void rotation_advance_body(double *p, double *R, double *v, const double *a, double dt) {
    double turn[3], increment[9], before[9];
    for (int i = 0; i < 3; i++) {
        p[i] += dt * (v[i] + 0.5 * dt * a[i]);
        turn[i] = dt * (v[3 + i] + 0.5 * dt * a[3 + i]);
    }
    rotation_exp(turn, increment);
    memcpy(before, R, sizeof before);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            R[3 * i + j] = increment[3 * i] * before[j] + increment[3 * i + 1] * before[3 + j] +
                           increment[3 * i + 2] * before[6 + j];
    for (int i = 0; i < 6; i++) v[i] += dt * a[i];
}
