"""Torques on the crankshaft besides those of gas and masses: loads, drivers, friction.

laws               how a load or driver depends on the speed: the registry, compiled
driven_machine     tables of torque, motors, and which law an engine has
friction           mean friction, and its shape over the stroke
piecewise_cubic    the piece of a table in which a place lies
"""
