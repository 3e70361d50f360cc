"""SpLap Editor: surface-aware Laplacian deformation of captured Gaussian splats."""

import os

# Small dense BLAS calls run 3-5 times slower with BLAS threads; numpy reads this when it is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"
