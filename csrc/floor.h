/*
 * What the solver cannot undercut without using structure: one dense hierarchical LQ factorisation and solve
 * at an active set that is already known. For the benchmark only.
 */
#ifndef FLOOR_H
#define FLOOR_H

/* Doubles that floor_solve needs as `work` for this many variables and active rows. */
int floor_work(int n, int total);

/*
 * Minimise |target_1 - active_1 x|^2; among the minimisers |target_2 - active_2 x|^2; and so on.
 *
 * rows: [levels] active rows of each level; active: [total][n], all levels one after the other; target:
 * [total]. x: [n], the shortest where the levels leave it free. Returns the rank: the directions of x they
 * determine.
 */
int floor_solve(int n, int levels, const int *rows, const double *active, const double *target, double *work,
                double *x);

#endif
