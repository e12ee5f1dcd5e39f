#include "spd.h"

#include <math.h>

int spd_factor(int n, double *S) {
    for (int j = 0; j < n; j++) {
        double d = S[n * j + j];
        for (int k = 0; k < j; k++) d -= S[n * j + k] * S[n * j + k];
        if (!(d > 0.0)) return -1;
        S[n * j + j] = sqrt(d);
        for (int i = j + 1; i < n; i++) {
            double sum = S[n * i + j];
            for (int k = 0; k < j; k++) sum -= S[n * i + k] * S[n * j + k];
            S[n * i + j] = sum / S[n * j + j];
        }
    }
    return 0;
}

void spd_lower(int n, const double *L, double *b) {
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) b[i] -= L[n * i + k] * b[k];
        b[i] /= L[n * i + i];
    }
}

void spd_solve(int n, const double *L, double *b) {
    spd_lower(n, L, b);
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) b[i] -= L[n * k + i] * b[k];
        b[i] /= L[n * i + i];
    }
}
