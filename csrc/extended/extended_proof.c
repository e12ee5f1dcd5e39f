#include "names.h"

#include "../hqp_proof.c"
