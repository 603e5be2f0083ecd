"""The first flight as rigid bodies, and where and how hard it ends."""
