"""Clock, loop, cycle, modes, recorder, replay, configuration and the command line."""

import os

# before numpy is imported: its matrices here are small, and a second thread only disturbs the loop
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
