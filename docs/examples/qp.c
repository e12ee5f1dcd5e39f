/* The point nearest to (1, 2) whose coordinates add up to 2 at most and are not negative.
 *
 *     cc qp.c $(pkg-config --cflags --libs hapticd-hqp) -o qp && ./qp
 *
 * With a PREFIX of your own the loader has to be told: LD_LIBRARY_PATH=PREFIX/lib ./qp
 */
#include <hqp_qp.h>
#include <stdio.h>

int main(void) {
    const double P[] = {1.0, 0.0, 0.0, 1.0}, q[] = {-1.0, -2.0}, G[] = {1.0, 1.0}, h[] = {2.0};
    const double lb[] = {0.0, 0.0};
    const hqp_qp qp = {.n = 2, .inequalities = 1, .P = P, .q = q, .G = G, .h = h, .lb = lb};

    hqp_qp_solver *solver = hqp_qp_create(2, 1); /* for this and all smaller QPs */
    if (!solver) return 1;
    double x[2], multipliers[3]; /* of A, G and the box */
    hqp_qp_answer answer = {.x = x, .multipliers = multipliers};
    const hqp_qp_status status = hqp_qp_solve(solver, &qp, &answer);
    printf("status %d: x = %.3f %.3f, multiplier of the sum %.3f\n", (int)status, x[0], x[1], multipliers[0]);
    hqp_qp_destroy(solver);
    return 0;
}
