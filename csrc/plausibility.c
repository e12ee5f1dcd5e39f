#include "plausibility.h"

#include <math.h>
#include <stddef.h>

static int32_t older(int32_t age, int elapsed) {
    return age < PLAUSIBILITY_NEVER - elapsed ? age + elapsed : PLAUSIBILITY_NEVER;
}

/* Whether a value is near enough to the last accepted one, or where its rate of this tick says. */
static int near(const plausible_values *v, int i, int32_t age) {
    const double change = v->value[i] - v->accepted[i], most = v->step[i] * age;
    if (age >= PLAUSIBILITY_NEVER || fabs(change) <= most) return 1;
    if (!v->rate || v->rate_age[i] != 0) return 0;
    return fabs(change - v->rate[i] * v->dt * age) <= PLAUSIBILITY_CONFIRMED * most;
}

int plausible_accept(const plausible_values *v, int elapsed) {
    int old = 0, came = 0, changed = 0;
    for (int i = 0; i < v->n; i++) {
        const int32_t age = older(v->age[i], elapsed);
        const int arrived = v->fresh[v->device[i] * v->stride];
        /* comparisons that a NaN fails */
        const int fits = fabs(v->value[i]) <= v->most[i] && near(v, i, age);
        v->rejected[i] = arrived && !fits;
        came |= arrived;
        changed |= arrived && v->value[i] != v->accepted[i];
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
    if (came) *v->still = changed ? 0 : older(*v->still, 1);
    *v->old = old;
    return old;
}

int plausible_move(const plausible_motion *m, int free_to_move) {
    int frozen = 0;
    for (int i = 0; i < m->n; i++) {
        m->frozen[i] = 0;
        if (!(fabs(m->position[i] - m->anchor[i]) <= m->quantum[i])) {
            m->anchor[i] = m->position[i];
            m->loaded[i] = m->load ? m->load[i] : 0.0;
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
        const double yielded = m->load ? m->compliance[i] * (m->load[i] - m->loaded[i]) : 0.0;
        const double went = fmin(fabs(m->travel[i]), fabs(m->travel[i] - yielded)); /* a load only excuses */
        const int32_t enough = m->patience[i];
        const int must_move = went > m->reach[i] || m->pushed[i] >= enough || m->pushed[i] <= -enough;
        m->frozen[i] = m->still[i] >= m->limit && must_move;
        frozen += m->frozen[i];
    }
    return frozen;
}

int plausible_travel(const plausible_course *c, int elapsed) {
    int wrong = 0;
    double *const error = c->errors + (size_t)*c->head * (size_t)c->n;
    double *const place = c->places + (size_t)*c->head * (size_t)c->n;
    for (int i = 0; i < c->n; i++) {
        const double x = c->position[i], v = c->velocity[i];
        c->gap[i] = older(c->gap[i], elapsed);
        if (c->position_age[i] == 0 && c->velocity_age[i] == 0) {
            if (c->gap[i] == 1)
                c->error[i] += x - c->last_position[i] - 0.5 * c->dt * (v + c->last_velocity[i]);
            if (c->gap[i] >= PLAUSIBILITY_NEVER ||
                elapsed > 1) { /* a way of unknown duration tells no speed */
                for (int k = 0; k < c->window; k++) c->places[k * c->n + i] = x;
                c->since[i] = 0;
            } else if (c->since[i] < c->window) {
                c->since[i]++;
            }
            c->last_position[i] = x;
            c->last_velocity[i] = v;
            c->gap[i] = 0;
        }
        const int apart = !(fabs(c->error[i] - error[i]) <= c->tolerance[i]);
        c->apart[i] = apart ? older(c->apart[i], 1) : 0;
        c->wrong[i] = c->apart[i] >= c->limit;
        wrong += c->wrong[i];
        if (c->since[i] >= PLAUSIBILITY_EXTRAPOLATED) c->way[i] = fabs(x - place[i]) / (c->since[i] * c->dt);
        c->speed[i] = fmax(fabs(v), c->way[i]);
        error[i] = c->error[i];
        place[i] = x;
    }
    *c->head = (*c->head + 1) % c->window;
    return wrong;
}

/* Part of a pair's reach by which a deflection that lags behind is as good as one that does not. */
static const double SLOW = 0.25;

int plausible_agree(const plausible_pairs *p) {
    int mismatched = 0;
    for (int i = 0; i < p->n; i++) {
        const double deflection = p->motor[i] - p->link[i];
        const int yields = p->compliance[i] > 0.0;
        const double lag = yields ? p->relaxing * fabs(deflection - p->deflection[i]) : 0.0;
        if (!(fabs(p->load[i] - p->load_stood[i]) <= p->quantum[i])) {
            /* only a swift one: a link encoder that errs moves it, too; before the first tick nothing is
             * known */
            p->lag_stood[i] = isnan(p->load_stood[i]) ? 0.0 : fmax(0.0, lag - SLOW * p->reach[i]);
            p->load_stood[i] = p->load[i];
            p->deflection_stood[i] = deflection;
        }
        const double fit = fmax(p->least[i], fmin(p->most[i], deflection / p->load[i]));
        const double apart = deflection - fit * p->load[i];
        const double tolerance = p->tolerance[i] * (yields ? fmin(1.0, fit / p->compliance[i]) : 1.0);
        p->deflection[i] = deflection;
        const double stays = p->reach[i] + p->lag_stood[i];
        const int stuck = !(fabs(deflection - p->deflection_stood[i]) <= stays);
        p->mismatched[i] = stuck || !(fabs(apart) <= tolerance + lag);
        mismatched += p->mismatched[i];
    }
    return mismatched;
}

int plausible_tick(const plausible_machine *m, int elapsed, int free_to_move) {
    int found = 0;
    for (int i = 0; i < m->values_count; i++) {
        const int old = plausible_accept(m->values[i], elapsed);
        if (i >= m->sensors) found += old;
    }
    for (int i = 0; i < m->motions_count; i++) found += plausible_move(m->motions[i], free_to_move);
    for (int i = 0; i < m->courses_count; i++) found += plausible_travel(m->courses[i], elapsed);
    for (int i = 0; i < m->balances_count; i++)
        found += balance_torques(m->balances[i], elapsed, free_to_move);
    for (int i = 0; i < m->springs_count; i++) springs_learn(m->springs[i], free_to_move);
    for (int i = 0; i < m->pairs_count; i++) found += plausible_agree(m->pairs[i]);
    return found;
}
