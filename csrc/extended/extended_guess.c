#include "names.h"

#include "../hqp_guess.c"
