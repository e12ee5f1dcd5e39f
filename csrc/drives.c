#include "drives.h"

int32_t drives_there(const drives_group *groups, int32_t count, uint32_t mask, uint32_t wanted,
                     int32_t in_any_mode) {
    for (int32_t k = 0; k < count; k++) {
        const drives_group *const group = &groups[k];
        for (int32_t i = 0; i < group->n; i++) {
            if ((group->statusword[i] & mask) != wanted) return 0;
            if (!in_any_mode && group->mode[i] != group->own_mode[i]) return 0;
        }
    }
    return 1;
}
