"""Files that are not what was written: truncated, or with a bit flipped."""

import random
from pathlib import Path


def damage(path: Path, dice: random.Random) -> str:
    """Truncate a file, or flip one of its bits."""
    content = path.read_bytes()
    if dice.random() < 0.5:
        size = dice.randrange(len(content))
        path.write_bytes(content[:size])
        return f"{path.name} cut to {size} of {len(content)} bytes"
    place = dice.randrange(8 * len(content))
    flipped = bytearray(content)
    flipped[place // 8] ^= 1 << (place % 8)
    path.write_bytes(flipped)
    return f"{path.name} with bit {place} flipped"
