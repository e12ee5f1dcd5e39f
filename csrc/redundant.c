#include "redundant.h"

#include <math.h>
#include <string.h>

#include "rotation.h"
#include "spd.h"

/* C (rows x n) = A (rows x n) T (n x n). */
static void times(int rows, int n, const double *A, const double *T, double *C) {
    for (int a = 0; a < rows; a++)
        for (int j = 0; j < n; j++) {
            double sum = 0.0;
            for (int i = 0; i < n; i++) sum += A[n * a + i] * T[n * i + j];
            C[n * a + j] = sum;
        }
}

static void transmit(const redundant *r, const double *q, double *joints) {
    const int n = r->chain->n;
    for (int i = 0; i < n; i++) {
        joints[i] = 0.0;
        for (int j = 0; j < n; j++) joints[i] += r->transmission[n * i + j] * q[j];
    }
}

static const double NONE[SERIAL_MAX_JOINTS];

static double scale(const redundant *r, int a) {
    return r->row[a] < 3 ? 1.0 : r->lever;
}

/* Rotation vector that takes the reference to the present orientation, in the axes of the base. */
static void turned(const redundant *r, double *vector) {
    double R[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            R[3 * i + j] = 0.0;
            for (int k = 0; k < 3; k++)
                R[3 * i + j] += r->frame.rotation[3 * i + k] * r->reference[3 * j + k];
        }
    rotation_log(R, vector);
}

static void kinematics(const redundant *r, const double *joints, const double *rates, double *x, double *J) {
    const int n = r->chain->n;
    double rows[REDUNDANT_MAX_TASK * SERIAL_MAX_JOINTS];
    serial_frames(r->chain, joints, rates, &r->frame, 1);
    double turn[3] = {0.0};
    if (r->m > 3) turned(r, turn);
    for (int a = 0; a < r->m; a++) {
        const int row = r->row[a];
        x[a] = row < 3 ? r->frame.position[row] : r->lever * turn[row - 3];
        for (int i = 0; i < n; i++) rows[n * a + i] = scale(r, a) * r->frame.J[n * row + i];
    }
    times(r->m, n, rows, r->transmission, J);
}

/* Column i of the chain's Jacobian turns with every joint k below it, and moves with every one above it:
 * dJ_i/dr_k = w_min(i,k) x J_max(i,k), w the angular part, which itself only turns: w_k x w_i for k < i. */
static double curvature(const redundant *r, int i, int k, int row) {
    const int n = r->chain->n, low = i < k ? i : k, high = i < k ? k : i;
    const int b = (row + 1) % 3, c = (row + 2) % 3;
    const double *J = r->frame.J, *w = J + 3 * n;
    if (row >= 3) return k < i ? r->lever * (w[n * b + k] * w[n * c + i] - w[n * c + k] * w[n * b + i]) : 0.0;
    return J[n * (3 + b) + low] * J[n * c + high] - J[n * (3 + c) + low] * J[n * b + high];
}

static void derivatives(const redundant *r, double *dJ) {
    const int n = r->chain->n, m = r->m;
    double of_joint[SERIAL_MAX_JOINTS][REDUNDANT_MAX_TASK * SERIAL_MAX_JOINTS];
    for (int k = 0; k < n; k++) {
        double rows[REDUNDANT_MAX_TASK * SERIAL_MAX_JOINTS];
        for (int a = 0; a < m; a++)
            for (int i = 0; i < n; i++) rows[n * a + i] = curvature(r, i, k, r->row[a]);
        times(m, n, rows, r->transmission, of_joint[k]);
    }
    for (int k = 0; k < n; k++)
        for (int e = 0; e < m * n; e++) {
            double sum = 0.0;
            for (int l = 0; l < n; l++) sum += r->transmission[n * l + k] * of_joint[l][e];
            dJ[m * n * k + e] = sum;
        }
}

static void inertia(const redundant *r, const double *joints) {
    const int n = r->chain->n;
    double own[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS], half[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS];
    serial_inertia(r->chain, joints, own);
    times(n, n, own, r->transmission, half);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = i == j ? r->rotor[i] : 0.0;
            for (int l = 0; l < n; l++) sum += r->transmission[n * l + i] * half[n * l + j];
            r->M[n * i + j] = sum;
        }
}

void redundant_update(const redundant *r) {
    const int n = r->chain->n;
    double joints[SERIAL_MAX_JOINTS], rates[SERIAL_MAX_JOINTS], load[SERIAL_MAX_JOINTS];
    transmit(r, r->q, joints);
    transmit(r, r->qd, rates);
    kinematics(r, joints, rates, r->position, r->J);
    derivatives(r, r->dJ);
    inertia(r, joints);
    serial_torques(r->chain, joints, rates, NONE, NONE, load);
    times(1, n, load, r->transmission, r->bias);
    serial_torques(r->chain, joints, NONE, NONE, r->gravity, load);
    times(1, n, load, r->transmission, r->weight);
    for (int a = 0; a < r->m; a++) {
        r->drift[a] = scale(r, a) * r->frame.drift[r->row[a]];
        r->velocity[a] = 0.0;
        for (int i = 0; i < n; i++) r->velocity[a] += r->J[n * a + i] * r->qd[i];
    }
}

void redundant_sweep(const redundant *r, int count, const double *q, double *x, double *J, double *dJ) {
    const int n = r->chain->n, m = r->m;
    double joints[SERIAL_MAX_JOINTS];
    for (int c = 0; c < count; c++, q += n, x += m, J += m * n) {
        transmit(r, q, joints);
        kinematics(r, joints, NULL, x, J);
        if (dJ) derivatives(r, dJ + (size_t)(n * m * n) * (size_t)c);
    }
}

/* Added to the diagonal of J J^T: it is singular where the hand cannot move in some direction. */
static const double DAMPING = 1e-12;

/* The least dq with J dq = e, by e = (J J^T)^-1 e. */
static void least_step(const redundant *r, const double *J, double *e, double *dq) {
    const int n = r->chain->n, m = r->m;
    double A[REDUNDANT_MAX_TASK * REDUNDANT_MAX_TASK];
    for (int a = 0; a < m; a++)
        for (int b = 0; b <= a; b++) {
            double sum = a == b ? DAMPING : 0.0;
            for (int i = 0; i < n; i++) sum += J[n * a + i] * J[n * b + i];
            A[m * a + b] = sum;
        }
    memset(dq, 0, sizeof(double) * (size_t)n);
    if (spd_factor(m, A)) return;
    spd_solve(m, A, e);
    for (int a = 0; a < m; a++)
        for (int i = 0; i < n; i++) dq[i] += J[n * a + i] * e[a];
}

void redundant_approach(const redundant *r, int count, double *q, const double *x, int steps, double longest,
                        double arrived) {
    const int n = r->chain->n, m = r->m;
    for (int c = 0; c < count; c++, q += n, x += m) {
        double away = INFINITY;
        for (int step = 0; step < steps && away > arrived; step++) {
            double joints[SERIAL_MAX_JOINTS], dq[SERIAL_MAX_JOINTS];
            double error[REDUNDANT_MAX_TASK], J[REDUNDANT_MAX_TASK * SERIAL_MAX_JOINTS];
            double squares = 0.0, largest = longest;
            transmit(r, q, joints);
            kinematics(r, joints, NULL, error, J);
            for (int a = 0; a < m; a++) {
                error[a] = x[a] - error[a];
                squares += error[a] * error[a];
            }
            away = sqrt(squares);
            least_step(r, J, error, dq);
            for (int i = 0; i < n; i++) largest = fmax(largest, fabs(dq[i]));
            for (int i = 0; i < n; i++) q[i] += longest / largest * dq[i];
        }
    }
}
