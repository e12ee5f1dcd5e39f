#include "shared_wrench.h"

void shared_wrench_take(const shared_wrench *s, const double *wrench, double felt, double held) {
    for (int i = 0; i < 6; i++) s->felt[i] = felt * wrench[i], s->held[i] = held * wrench[i];
}
