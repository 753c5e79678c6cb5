"""Many sweeps: a virtual laboratory or recorded movies, each analysed, all compared."""
