#include "plausibility.h"

#include <math.h>

static int32_t older(int32_t age, int elapsed) {
    return age < PLAUSIBILITY_NEVER - elapsed ? age + elapsed : PLAUSIBILITY_NEVER;
}

int plausible_accept(const plausible_values *v, int elapsed) {
    int old = 0;
    for (int i = 0; i < v->n; i++) {
        const int32_t age = older(v->age[i], elapsed);
        const int arrived = v->fresh[v->device[i] * v->stride];
        /* comparisons that a NaN fails */
        const int fits =
            fabs(v->value[i]) <= v->most[i] &&
            (age >= PLAUSIBILITY_NEVER || fabs(v->value[i] - v->accepted[i]) <= v->step[i] * age);
        v->rejected[i] = arrived && !fits;
        if (arrived && fits) {
            v->accepted[i] = v->value[i];
            v->age[i] = 0;
            continue;
        }
        old++;
        v->age[i] = age;
        if (v->rejected[i]) {
            const int ahead = age < PLAUSIBILITY_EXTRAPOLATED ? age : PLAUSIBILITY_EXTRAPOLATED;
            v->value[i] = v->accepted[i] + (v->rate ? v->rate[i] * v->dt * ahead : 0.0);
        }
    }
    return old;
}

int plausible_move(const plausible_motion *m, int free_to_move) {
    int frozen = 0;
    for (int i = 0; i < m->n; i++) {
        m->frozen[i] = 0;
        if (!(fabs(m->position[i] - m->anchor[i]) <= m->quantum[i])) {
            m->anchor[i] = m->position[i];
            m->travel[i] = 0.0;
            m->still[i] = m->pushed[i] = 0;
            continue;
        }
        const double net = m->command[i] - (m->opposing ? m->opposing[i] : 0.0);
        /* a drive that is told nothing may have its brake closed */
        const int pushes = free_to_move && m->command[i] != 0.0 && fabs(net) > m->acting[i];
        const int32_t along = net > 0.0 ? 1 : -1;
        m->still[i] = older(m->still[i], 1);
        m->travel[i] += m->velocity[i] * m->dt;
        m->pushed[i] = pushes ? along + (along * m->pushed[i] > 0 ? m->pushed[i] : 0) : 0;
        const int must_move =
            fabs(m->travel[i]) > m->reach[i] || m->pushed[i] >= m->limit || m->pushed[i] <= -m->limit;
        m->frozen[i] = m->still[i] >= m->limit && must_move;
        frozen += m->frozen[i];
    }
    return frozen;
}

int plausible_agree(const plausible_pairs *p) {
    int mismatched = 0;
    for (int i = 0; i < p->n; i++) {
        const double apart = p->motor[i] - p->link[i] - p->compliance[i] * p->load[i];
        p->mismatched[i] = !(fabs(apart) <= p->tolerance[i]);
        mismatched += p->mismatched[i];
    }
    return mismatched;
}
