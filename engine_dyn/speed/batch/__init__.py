"""The solver of many designs at once: blocks of designs side by side, as SIMD lanes.

The problem is that of the general solver (same symbols), with the power mean as closure:

    constant inertia:   u = X - y,                          u = q - 1,  X = g P - eta V,
    variable inertia:   u = (X - y)/tau,                    tau = 1 + eta V,
    y' = kappa (F - 1),   F = q^a,   a = alpha/2 = F'(1).

Here y is what the load takes, less the constant c of the closure. It is split into its linear part
and a nonlinear remainder of second order, y' + beta y = beta X + kappa r with beta = a kappa and
r = F - 1 - a u tau: a recurrence with constant coefficients over coarse nodes, see
docs/method.md (98) to (101), (113) and (120). Exponent 2 with constant inertia has r = 0 and needs
no iteration, exponent 0 has no load term at all, only the geometric mean to close; else r is
iterated.

Where things are, in the order of a design's way:

inputs          inputs of designs into the state of a block
work_harmonics  what the work curves of designs without a common table are added up from
own_curves      adding them up, for the designs of a block
two_grid        two grids of a table: coarse nodes for the load, fine ones for the extremes
state           the table of all numbers of a design while it is solved
forms           which equation a block has, told to the compiler
reduction       from inputs to the numbers of the equation and the weights of the recurrence
recurrence      the linear part
iteration       the nonlinear remainder
constant_load   exponent 0
closures        constants of the closures, mean speeds, cycle times
powers          series of powers, roots and logarithms
rational        laws that are rational functions of the speed: a motor, b omega + c omega^2
candidates      at which coarse nodes the extremes can be
intervals       the search for an extreme beside one coarse node
extrema         the extremes, and the estimate of their error
ripple          whether ripple of the torque can have misled that search
block           all of these for one block
storage         results of a block
driver          the kernels: loops over blocks
angles          the angles of curves, and a table's curves at them
traces          speed over the crank angle
front           what Python calls

Lanes never exchange anything: a lane whose u no longer changes keeps it ("frozen"), blocks are
filled up by repeating a design, and every sum runs in a fixed order, so a design's numbers cannot
depend on its neighbours. What is out of the range of this method (a load that is strong over one
interval, a speed that falls or rises by much, a torque within rounding of idle) is deferred to the
general solver.
"""
