/* Symmetric positive definite systems of a few rows, row-major; the lower triangle is read and written. */
#ifndef HAPTICD_SPD_H
#define HAPTICD_SPD_H

/* S = L L^T in place. Returns 0, or -1 where S is not positive definite. */
int spd_factor(int n, double *S);

/* b <- L^-1 b. */
void spd_lower(int n, const double *L, double *b);

/* b <- (L L^T)^-1 b. */
void spd_solve(int n, const double *L, double *b);

#endif
