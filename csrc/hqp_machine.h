/* What the machine has that runs this. */
#ifndef HQP_MACHINE_H
#define HQP_MACHINE_H

/* Whether what was compiled for AVX2 runs here. */
int hqp_has_avx2(void);

#endif
