#include "avatar_law.h"
#include "rotation.h"
#include "task_arm.h"

#include <math.h>
#include <string.h>

static const double FULL_TURN = 6.283185307179586;

/* C = A B^T, or A^T B. */
static void times_transposed(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[3 * i + j] = A[3 * i] * B[3 * j] + A[3 * i + 1] * B[3 * j + 1] + A[3 * i + 2] * B[3 * j + 2];
}

static void transposed_times(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) C[3 * i + j] = A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
}

static void times(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

static double norm(const double *v) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Rotation vector from the held to the commanded pose: of the two about its axis the one next to that of the
 * tick before, or a command that passes the half turn would throw the goal to the other side. */
static void turn_to_command(avatar_law *l) {
    double relative[9], v[3], other[3], near = 0.0, far = 0.0;
    transposed_times(l->held_rotation, l->commanded_rotation, relative);
    rotation_log(relative, v);
    const double angle = norm(v);
    for (int k = 0; k < 3; k++) {
        other[k] = angle > 0.0 ? v[k] * (1.0 - FULL_TURN / angle) : 0.0;
        near += (v[k] - l->turn[k]) * (v[k] - l->turn[k]);
        far += (other[k] - l->turn[k]) * (other[k] - l->turn[k]);
    }
    const int flipped = l->share > 0.0 && angle > 0.0 && far < near;
    memcpy(l->turn, flipped ? other : v, sizeof v);
}

static void lead(avatar_law *l) {
    double part[3], motion[9];
    turn_to_command(l);
    l->share = fmin(1.0, l->share + l->dt / l->fade);
    if (l->share >= 1.0) {
        memcpy(l->goal, l->commanded, 3 * sizeof(double));
        memcpy(l->goal_rotation, l->commanded_rotation, 9 * sizeof(double));
        return;
    }
    for (int k = 0; k < 3; k++) {
        l->goal[k] = l->held[k] + l->share * (l->commanded[k] - l->held[k]);
        part[k] = l->share * l->turn[k];
    }
    rotation_exp(part, motion);
    times(l->held_rotation, motion, l->goal_rotation);
}

static void bounded(double *v, double most) {
    const double size = norm(v);
    if (size > most)
        for (int k = 0; k < 3; k++) v[k] *= most / size;
}

void avatar_law_hold(avatar_law *l, int steady) {
    for (int k = 0; k < 6; k++) l->steady[k] = steady ? l->wrench[k] : 0.0;
    bounded(l->steady, l->most_force);
    bounded(l->steady + 3, l->most_torque);
    memcpy(l->held, l->position, sizeof l->held);
    memcpy(l->held_rotation, l->rotation, sizeof l->held_rotation);
    l->share = 0.0;
}

void avatar_law_update(avatar_law *l, int follow) {
    double difference[9];
    if (follow) {
        lead(l);
    } else {
        memcpy(l->goal, l->held, sizeof l->held);
        memcpy(l->goal_rotation, l->held_rotation, sizeof l->held_rotation);
    }
    times_transposed(l->rotation, l->goal_rotation, difference);
    rotation_log(difference, l->error + 3);
    for (int k = 0; k < 3; k++) l->error[k] = l->position[k] - l->goal[k];
    if (!follow) {
        for (int k = 0; k < 6; k++) l->steady[k] -= l->dt * l->rate * l->stiffness[k] * l->error[k];
        bounded(l->steady, l->most_force);
        bounded(l->steady + 3, l->most_torque);
    }
    double spring[6];
    for (int k = 0; k < 6; k++) spring[k] = -l->stiffness[k] * l->error[k];
    bounded(spring, l->most_pull);
    bounded(spring + 3, l->most_turn);
    for (int k = 0; k < 6; k++)
        l->wrench[k] = spring[k] - l->damping[k] * l->twist[k] + (1.0 - l->share) * l->steady[k];
    for (int i = 0; i < l->n; i++) l->torque[i] = l->null[i] + l->coriolis[i] + l->own[i];
    task_arm_push(l->n, l->J, l->wrench, l->torque);
}
