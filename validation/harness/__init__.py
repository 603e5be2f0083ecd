"""What all commands need: records, files, the store, processes, interrupts, pages, tables."""
