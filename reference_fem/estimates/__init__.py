"""What a run states of its errors, and meshes that keep a wanted one."""
