"""Torsional vibration of shafts: discs on shafts without mass, excited by the orders of torques.

The convention is that of `engine_dyn.forces.cylinder_harmonics`: whatever vibrates is

    Re sum_nu C_nu exp(i nu phi),    phi = omega t, 0 at firing dead centre of cylinder 1,

with orders nu in periods a turn of the disc that the system is referred to, here called the crank,
whose mean speed is omega. So a derivative over time is a factor i nu omega, damping a positive
imaginary part of a stiffness, and what is late has a negative phase. Angles theta are deviations
from uniform rotation [rad], positive in the sense of rotation of the crank. In

    J theta'' + C theta' + K theta = torques,

a shaft between two discs has the complex stiffness k* = k (1 + i eta) + i nu omega c. Its torque
k* (theta_second - theta_first) acts on the first disc in the sense of rotation, and on the second
against it. Order 0, the mean torque, is no vibration: see `system.mean_torques`.

Sources: Ker Wilson, Practical Solution of Torsional Vibration Problems; Den Hartog, Mechanical
Vibrations; Thomson, Theory of Vibration. Equations without a source are derived where they stand.
"""
