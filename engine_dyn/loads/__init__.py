"""What acts on the crankshaft beside gas and masses: loads, drivers, friction."""
