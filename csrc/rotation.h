/* Rotation matrices (3 x 3, row-major) and rotation vectors. */
#ifndef HAPTICD_ROTATION_H
#define HAPTICD_ROTATION_H

/* Rotation vector of R, its angle in [0, pi]. */
void rotation_log(const double *R, double *vector);

/* R = exp(vector). */
void rotation_exp(const double *vector, double *R);

/* A free body over dt under constant acceleration: p += v dt + a dt^2 / 2, R turned by the same increment
 * of its angular part, v += a dt. p (3), R (9), v and a (6): (linear, angular) in the base frame. */
void rotation_advance_body(double *p, double *R, double *v, const double *a, double dt);

#endif
