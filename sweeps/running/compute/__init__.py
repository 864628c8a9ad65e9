"""Computing a plan: in memory, into an archive, on a cluster."""
