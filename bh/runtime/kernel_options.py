"""How kernels are compiled: a kernel gets only those entrances that somebody uses, since each takes time to compile."""

from __future__ import annotations

KERNEL = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # Python calls it
INNER = {**KERNEL, "no_cpython_wrapper": True}  # other kernels call it, Python cannot
