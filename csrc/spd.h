/* Small symmetric positive definite matrices, row-major, by Cholesky's factor. */
#ifndef HAPTICD_SPD_H
#define HAPTICD_SPD_H

enum { SPD_MAX = 16 };

/* Lower factor L of A = L L^T (n x n), in place, the upper part left as it is. Returns 0, or -1 where A is
 * not positive definite, or singular to rounding. */
int spd_factor(int n, double *A);

/* x = L^-1 x. */
void spd_lower(int n, const double *L, double *x);

/* x = A^-1 x from the factor of A. */
void spd_solve(int n, const double *L, double *x);

/* A^-1 (n x n, n <= SPD_MAX) from the factor of A. */
void spd_invert(int n, const double *L, double *inverse);

/* log det A from the factor of A. */
double spd_logdet(int n, const double *L);

#endif
