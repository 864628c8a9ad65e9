"""Making one archive of several, or a larger or newer one of one."""
