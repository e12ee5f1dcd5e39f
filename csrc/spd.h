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

/* Raise what is small of A (n x n), in place: an eigenvalue e below `least` becomes
 * (e^2 + least^2) / (2 least), continuous with its slope. A stays as it is, to the bit, where none is. */
void spd_raise(int n, double *A, double least);

/* log det A from the factor of A. */
double spd_logdet(int n, const double *L);

#endif
