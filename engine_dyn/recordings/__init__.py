"""Recorded signals: cylinder pressure of many cycles, teeth of a wheel, and what they tell.

Plain arrays in SI units and radians, angle zero at firing top dead centre; no files.
"""
