/* Dry friction by maximum dissipation: joints that can stick do, the others slide against all of theirs. */
#ifndef HAPTICD_DRY_H
#define HAPTICD_DRY_H

enum { DRY_MAX = 16 };

/* Impulses p with |p_i| <= most_i that leave the least kinetic energy, min 1/2 p^T A p + v^T p, with A (n, n)
 * the inverse inertia and v (n) the speeds before; n <= DRY_MAX. Then v_i + (A p)_i = 0, or p_i is as large
 * as it may be and opposes it. Whatever p comes out, p^T v + 1/2 p^T A p <= 0: friction gives no energy.
 * p holds a first guess, such as that of the last step: those that have all they may slide on.
 * stuck (n): 1 where the joint is held. */
void dry_impulse(int n, const double *A, const double *v, const double *most, double *p,
                 unsigned char *stuck);

#endif
