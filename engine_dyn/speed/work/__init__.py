"""Work curves of designs, as sums of a few columns."""
