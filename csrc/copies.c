#include "copies.h"

void copies_take(const copies_part *parts, int count) {
    for (int k = 0; k < count; k++)
        for (int i = 0; i < parts[k].n; i++) parts[k].to[i] = parts[k].from[i];
}
