#include "handle_lead.h"

void handle_lead_update(const handle_lead *h, const double *wrench) {
    for (int i = 0; i < 6; i++) {
        const double above = h->keep * (wrench[i] - h->below[i]);
        h->below[i] = wrench[i] - above;
        h->wrench[i] = wrench[i] + h->share * above;
    }
}
