#include "names.h"

#include "../hqp_lean.c"
