#include "names.h"

#include "../hqp_walk.c"
