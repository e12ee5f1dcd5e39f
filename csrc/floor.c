/*
 * Householder reflectors from the right, row by row, each applied to all rows that follow: [rows] Q = [L 0]
 * (Golub, Van Loan, Matrix Computations, section 5.2). A level whose rows depend on each other is folded from
 * the left. No zero is skipped and no structure looked for. The inner loops are the solver's.
 */
#include "floor.h"

#include "hqp_lanes.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

static const double RANK = 1e-9; /* a row is dependent when less than this part of its norm is left */

/* Rows of `ld` doubles, a multiple of 4, aligned to 4 of them, zero behind the first n. */
typedef struct factors {
    int n, top, ld;
    double *row;        /* [total] the active rows times H_0 .. H_{top-1} */
    double *reflector;  /* [n] v_k, with H_k = I - v_k v_k^T */
    double *z;          /* [ld] Q^T x */
    double *rhs, *norm; /* [total] */
    double *small;      /* [total][n + 1] a level whose rows depend on each other, while it is folded */
    int *kept;          /* [total] the level's rows with a part in its columns */
} factors;

static int ceil4(int i) {
    return (i + 3) & ~3;
}

int floor_work(int n, int total) {
    const int ld = ceil4(n);
    return 4 + total * ld + n * ld + ld + 3 * ceil4(total) + total * (n + 1);
}

static factors lay_out(int n, int total, double *work) {
    factors f = {.n = n, .ld = ceil4(n)};
    double *at = (double *)(((uintptr_t)work + 31) & ~(uintptr_t)31);
    f.row = at;
    f.reflector = f.row + total * f.ld;
    f.z = f.reflector + n * f.ld;
    f.rhs = f.z + f.ld;
    f.norm = f.rhs + ceil4(total);
    f.kept = (int *)(void *)(f.norm + ceil4(total));
    f.small = f.norm + 2 * ceil4(total);
    return f;
}

/* row H, columns from .. ld */
static void reflect(double *row, const double *v, int from, int ld) {
    hqp_axpy(row, -hqp_dot(row, v, from, ld), v, from, ld);
}

/* Row i gives the next reflector, which is applied to rows i + 1 .. total; 0: it depends on those before. */
static int take_row(factors *f, int i, int total) {
    double *row = f->row + i * f->ld, *v = f->reflector + f->top * f->ld;
    const int top = f->top, from = top & ~3;
    memcpy(v + from, row + from, (size_t)(f->ld - from) * sizeof(double));
    for (int k = from; k < top; k++) v[k] = 0.0;
    const double left = sqrt(hqp_dot(v, v, from, f->ld));
    if (!(left > RANK * f->norm[i])) return 0;
    const double head = row[top], signed_left = head < 0.0 ? -left : left;
    const double scale = 1.0 / sqrt(left * (left + fabs(head)));
    v[top] += signed_left;
    for (int k = top; k < f->ld; k++) v[k] *= scale;
    row[top] = -signed_left;
    memset(row + top + 1, 0, (size_t)(f->ld - top - 1) * sizeof(double));
    int r = i + 1;
    for (; r + 4 <= total; r += 4) {
        double *at = f->row + r * f->ld, *const rows[4] = {at, at + f->ld, at + 2 * f->ld, at + 3 * f->ld};
        hqp_reflect_four(rows, v, from, f->ld);
    }
    for (; r < total; r++) reflect(f->row + r * f->ld, v, from, f->ld);
    f->top++;
    return 1;
}

/* z[0 .. width) = argmin |M z - rhs|, for m[count][width + 1] = [M rhs] of full column rank, by reflectors
 * from the left */
static void least_squares(double *m, int count, int width, double *z) {
    const int ld = width + 1;
    for (int c = 0; c < width; c++) {
        double sum = 0.0;
        for (int i = c; i < count; i++) sum += m[i * ld + c] * m[i * ld + c];
        const double head = m[c * ld + c], left = head < 0.0 ? -sqrt(sum) : sqrt(sum), u = head + left;
        m[c * ld + c] = -left;
        for (int k = c + 1; k <= width; k++) {
            double t = u * m[c * ld + k];
            for (int i = c + 1; i < count; i++) t += m[i * ld + c] * m[i * ld + k];
            t /= left * u;
            m[c * ld + k] -= t * u;
            for (int i = c + 1; i < count; i++) m[i * ld + k] -= t * m[i * ld + c];
        }
    }
    for (int c = width - 1; c >= 0; c--) {
        double sum = m[c * ld + width];
        for (int k = c + 1; k < width; k++) sum -= m[c * ld + k] * z[k];
        z[c] = sum / m[c * ld + c];
    }
}

/* z of the columns `from` .. top, which the level's rows first .. end determine */
static void solve_level(factors *f, int first, int end, int from) {
    const int width = f->top - from;
    int count = 0;
    for (int r = first; r < end; r++) {
        const double *row = f->row + r * f->ld;
        double part = 0.0;
        for (int k = from; k < f->top; k++) part += row[k] * row[k];
        if (sqrt(part) > RANK * f->norm[r]) f->kept[count++] = r;
    }
    for (int r = 0; r < count && count == width; r++) {
        const double *row = f->row + f->kept[r] * f->ld;
        f->z[from + r] = (f->rhs[f->kept[r]] - hqp_inner(row, f->z, from + r)) / row[from + r];
    }
    if (count == width) return;
    for (int r = 0; r < count; r++) {
        const double *row = f->row + f->kept[r] * f->ld;
        double *to = f->small + r * (width + 1);
        to[width] = f->rhs[f->kept[r]] - hqp_inner(row, f->z, from);
        memcpy(to, row + from, (size_t)width * sizeof(double));
    }
    least_squares(f->small, count, width, f->z + from);
}

int floor_solve(int n, int levels, const int *rows, const double *active, const double *target, double *work,
                double *x) {
    int total = 0;
    for (int p = 0; p < levels; p++) total += rows[p];
    factors f = lay_out(n, total, work);
    for (int i = 0; i < total; i++) {
        double *row = f.row + i * f.ld;
        memcpy(row, active + (ptrdiff_t)i * n, (size_t)n * sizeof(double));
        for (int k = n; k < f.ld; k++) row[k] = 0.0;
        f.norm[i] = sqrt(hqp_dot(row, row, 0, f.ld));
        f.rhs[i] = target[i];
    }
    memset(f.z, 0, (size_t)f.ld * sizeof(double));
    for (int p = 0, first = 0; p < levels && f.top < n; first += rows[p++]) {
        const int from = f.top, end = first + rows[p];
        for (int i = first; i < end && f.top < n; i++) take_row(&f, i, total);
        if (f.top > from) solve_level(&f, first, end, from);
    }
    for (int k = f.top - 1; k >= 0; k--) reflect(f.z, f.reflector + k * f.ld, k & ~3, f.ld);
    memcpy(x, f.z, (size_t)n * sizeof(double));
    return f.top;
}
