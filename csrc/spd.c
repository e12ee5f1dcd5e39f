#include "spd.h"

#include <math.h>

/* A pivot smaller than this share of the largest diagonal entry is rounding: the matrix counts as singular.
 */
static const double SINGULAR = 1e-14;

int spd_factor(int n, double *A) {
    double largest = 0.0;
    for (int i = 0; i < n; i++) largest = fmax(largest, A[n * i + i]);
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            double sum = A[n * i + j];
            for (int k = 0; k < j; k++) sum -= A[n * i + k] * A[n * j + k];
            if (i > j)
                A[n * i + j] = sum / A[n * j + j];
            else if (!(sum > SINGULAR * largest))
                return -1;
            else
                A[n * j + j] = sqrt(sum);
        }
    return 0;
}

void spd_lower(int n, const double *L, double *x) {
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++) x[i] -= L[n * i + k] * x[k];
        x[i] /= L[n * i + i];
    }
}

void spd_solve(int n, const double *L, double *x) {
    spd_lower(n, L, x);
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) x[i] -= L[n * k + i] * x[k];
        x[i] /= L[n * i + i];
    }
}

double spd_logdet(int n, const double *L) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += log(L[n * i + i]);
    return 2.0 * sum;
}

void spd_invert(int n, const double *L, double *inverse) {
    for (int j = 0; j < n; j++) {
        double column[SPD_MAX] = {0.0};
        column[j] = 1.0;
        spd_solve(n, L, column);
        for (int i = 0; i < n; i++) inverse[n * i + j] = column[i];
    }
}
