#include "link_age.h"

/* a - b modulo 2^64 */
static int64_t less(int64_t a, int64_t b) {
    return (int64_t)((uint64_t)a - (uint64_t)b);
}

int32_t link_judge(link_ages *ages, int64_t now, uint64_t sent, uint64_t echo, uint32_t held, link_age *age) {
    if (echo == 0 || echo > (uint64_t)now) return 0;
    const int64_t round_trip = now - (int64_t)echo - held;
    if (round_trip < 0) return 0;
    const int64_t ahead = less((int64_t)sent, now);
    int64_t least = ahead;
    int64_t most = less(ahead, -round_trip);
    if (ages->begun) {
        const int64_t slack = (now - ages->at) / LINK_DRIFT + 1;
        const int64_t loose_least = less(ages->least, slack);
        const int64_t loose_most = less(ages->most, -slack);
        const int64_t tight_least = least > loose_least ? least : loose_least;
        const int64_t tight_most = most < loose_most ? most : loose_most;
        if (tight_least <= tight_most) {
            least = tight_least;
            most = tight_most;
        } else {
            ages->jumps++;
        }
    }
    *ages = (link_ages){.least = least, .most = most, .at = now, .begun = 1, .jumps = ages->jumps};
    /* the bounds are no looser than this packet's own: 0 <= likely <= round_trip */
    *age =
        (link_age){.likely = less(least, ahead) + less(most, least) / 2, .most = round_trip, .unheard = held};
    return 1;
}
