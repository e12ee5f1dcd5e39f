#include "spd.h"

#include <math.h>
#include <string.h>

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

enum { ROTATIONS = 12 };

/* Eigenvalues on the diagonal of A and eigenvectors as rows of V, by cyclic Jacobi rotations. */
static void diagonalise(int n, double *A, double *V) {
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) V[n * i + j] = i == j ? 1.0 : 0.0;
    for (int sweep = 0; sweep < ROTATIONS; sweep++) {
        int rotated = 0;
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++) {
                const double off = A[n * p + q], difference = A[n * q + q] - A[n * p + p];
                if (off * off <= 1e-32 * fabs(A[n * p + p] * A[n * q + q])) continue;
                const double ratio = difference / (2.0 * off);
                const double t = copysign(1.0, ratio) / (fabs(ratio) + sqrt(1.0 + ratio * ratio));
                const double c = 1.0 / sqrt(1.0 + t * t), s = t * c;
                for (int k = 0; k < n; k++) {
                    const double x = A[n * k + p], y = A[n * k + q];
                    A[n * k + p] = c * x - s * y, A[n * k + q] = s * x + c * y;
                }
                for (int k = 0; k < n; k++) {
                    const double x = A[n * p + k], y = A[n * q + k], v = V[n * p + k], w = V[n * q + k];
                    A[n * p + k] = c * x - s * y, A[n * q + k] = s * x + c * y;
                    V[n * p + k] = c * v - s * w, V[n * q + k] = s * v + c * w;
                }
                rotated = 1;
            }
        if (!rotated) return;
    }
}

void spd_raise(int n, double *A, double least) {
    double D[SPD_MAX * SPD_MAX], V[SPD_MAX * SPD_MAX];
    memcpy(D, A, sizeof(double) * (size_t)(n * n));
    diagonalise(n, D, V);
    for (int k = 0; k < n; k++) {
        const double e = D[n * k + k];
        if (!(e < least)) continue;
        const double more = 0.5 * (least - e) * (least - e) / least; /* (e^2 + least^2) / (2 least) - e */
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) A[n * i + j] += more * V[n * k + i] * V[n * k + j];
    }
}
