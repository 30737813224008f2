"""What runs beside the physics: progress meters, threads, the cache of compiled kernels."""
