"""Every table and figure of the paper, and our own questions: ``python -m experiments``.

Linear algebra libraries split sums over their threads, and the split changes the last bits. One
thread each, set before numpy is first imported, keeps results the same for any number of workers.
"""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"
