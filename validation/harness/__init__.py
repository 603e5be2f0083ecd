"""What every command needs: records, files, the store, processes, interrupts, pages, tables."""
