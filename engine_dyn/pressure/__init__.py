"""Pressure in the cylinder over the crank angle: given diagrams and modelled cycles."""
