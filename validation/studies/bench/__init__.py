"""Time against error: work-precision, kernels' speed, the ledger of shortcuts, peers."""
