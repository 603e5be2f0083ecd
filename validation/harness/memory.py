"""Peak memory of this process."""

import resource
import sys
from pathlib import Path


def peak_memory_MB() -> float:
    """Largest resident set of this process so far, MB (1e6 bytes).

    Linux' ``ru_maxrss`` starts at the size of the process that spawned this one (it survives
    exec), which would charge a small run for its parent; ``VmHWM`` belongs to this program alone.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024 / 1e6
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak * (1 if sys.platform == "darwin" else 1024) / 1e6
