/* Two variables within limits, and below that a wish for their sum.
 *
 *     cc hqp.c $(pkg-config --cflags --libs hapticd-hqp) -o hqp && ./hqp
 *
 * With a PREFIX of your own the loader has to be told: LD_LIBRARY_PATH=PREFIX/lib ./hqp
 */
#include <hqp.h>
#include <stdio.h>

int main(void) {
    const double C[] = {1.0, 0.0, 0.0, 1.0}, lb[] = {-1.0, -1.0}, ub[] = {1.0, 1.0};
    const double A[] = {1.0, 1.0};
    double b[] = {0.0};
    const hqp_level levels[] = {{.C = C, .lb = lb, .ub = ub}, {.A = A, .b = b}};

    const int equalities[] = {0, 1}, inequalities[] = {2, 0};
    const hqp_dims dims = {.n = 2, .levels = 2, .equalities = equalities, .inequalities = inequalities};
    hqp_solver *solver = hqp_create(&dims, NULL); /* NULL: default settings */
    if (!solver) return 1;

    for (int tick = 1; tick <= 3; tick++) {
        double x[2], w[1];
        hqp_info info = {.w = w};
        b[0] = tick;
        hqp_solve(solver, levels, x, &info); /* warm from the second on */
        printf("%s: x = %.3f %.3f, wish missed by %.3f\n", hqp_status_name(info.status), x[0], x[1], w[0]);
    }
    hqp_destroy(solver);
    return 0;
}
